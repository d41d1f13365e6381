"""Recordings of other programs as measurements of a survey."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats
from mapfilter.errors import InputError, fail
from mapfilter.survey.measurement_files import Rows
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import format_of, read_recording
from mapfilter.tracks.readers.recording import Recording

_LONGEST_S = 10.0
_UNKNOWN = -1.0


def recorded_rows(path: Path) -> Rows | None:
    """Return the levels of a recording with their positions; None for no known format.

    A level is placed between the positions before and after it, where they are at most 10 s apart,
    or at a position of its own time. Levels of no cell, and bounds, are set aside.

    Raises
    ------
    InputError
        The recording holds no usable row, or lacks cells or positions.
    """
    known = format_of(path)
    if known is None:
        return None
    recording = read_recording(path, options=ReadOptions())
    tables = recording.tables
    lacking = [name for name in ("radio", "positions") if name not in tables]
    if lacking:
        got = f"{known.title} of {', '.join(tables)}"
        raise fail(InputError, str(path), "levels of cells, and positions", got)
    rows = Rows(path, read=recording.rows)
    for unusable in recording.unusable:
        rows.aside[f"rows left out: {unusable.reason}"] += unusable.count
    _add(rows, recording)
    return rows


def _add(rows: Rows, recording: Recording) -> None:
    radio, positions = recording.tables["radio"], recording.tables["positions"]
    named = radio["cell"].notna().to_numpy()
    level = radio["level_dbm"].notna().to_numpy() & (radio["censored"].fillna(0) == 0).to_numpy()
    places, placed = _places(positions, radio["time_s"].to_numpy(dtype=np.float64))
    for reason, bad in (
        ("levels of cells without identity", ~named),
        ("cells without a level", named & ~level),
        (f"levels without a position within {_LONGEST_S:g} s", named & level & ~placed),
    ):
        if count := int(bad.sum()):
            rows.aside[reason] += count
    kept = named & level & placed
    cells = radio["cell"].astype(object).to_numpy()[kept]
    rows.cells.update({cell: number for number, cell in enumerate(dict.fromkeys(cells))})
    rows.sessions[""] = 0
    rows.cell.extend(rows.cells[cell] for cell in cells)
    rows.session.extend([0] * int(kept.sum()))
    time_s = radio["time_s"].to_numpy(dtype=np.float64)
    if not recording.clock.absolute:
        # Counted from an unknown start, or in an unknown zone: the order alone matters.
        time_s = time_s - time_s.min() + 1.0
    columns = [time_s, *places[:2], radio["level_dbm"].to_numpy(dtype=np.float64), places[2]]
    rows.values.frombytes(np.ascontiguousarray(np.stack(columns)[:, kept].T).tobytes())
    parts = radio[["mcc", "mnc", "lac", "ci"]].fillna(_UNKNOWN).to_numpy(dtype=np.int64)[kept]
    whole = (parts >= 0).all(axis=1)
    for cell, identity in zip(cells[whole], parts[whole].tolist(), strict=True):
        mcc, mnc, lac, ci = identity
        rows.identities.setdefault(cell, (mcc, mnc, lac, ci))


def _places(positions: pd.DataFrame, time_s: Floats) -> tuple[Floats, Bools]:
    """Return latitude, longitude and accuracy at some times, shape (3, N), and where they hold."""
    positions = positions.drop_duplicates("time_s")
    at = positions["time_s"].to_numpy(dtype=np.float64)
    columns = positions[["lat_deg", "lon_deg", "accuracy_m"]].to_numpy(dtype=np.float64).T
    after = np.clip(np.searchsorted(at, time_s), 0, len(at) - 1)
    before = np.where(at[after] == time_s, after, np.maximum(after - 1, 0))
    placed = (at[before] <= time_s) & (time_s <= at[after])
    placed &= at[after] - at[before] <= _LONGEST_S
    places = np.stack([np.interp(time_s, at, column) for column in columns[:2]])
    return np.vstack([places, np.fmax(columns[2, before], columns[2, after])]), placed
