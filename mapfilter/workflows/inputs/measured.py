"""Recordings of other programs, and track logs, as measurements of a survey."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats
from mapfilter._words import number_of
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import unproject
from mapfilter.radio.identities import IDENTITY
from mapfilter.survey.measurement_rows import NotMeasurementsError, Rows
from mapfilter.tracks.checks.placeless import LOCAL_FRAME, LOCAL_FRAME_HINT, is_local_frame
from mapfilter.tracks.log_folders import is_log
from mapfilter.tracks.readers.contained.opening import OF_TABLES
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import format_named, format_of, has_levels, read_recording
from mapfilter.tracks.schema import SERVING, TABLES
from mapfilter.tracks.store import read_log

_LONGEST_S = 10.0
_CODE_REACH_M, _M_PER_DEG = 2000.0, 111_320.0
"""Beyond what is known of a cell its carrier and code may be another one's; of latitude."""
_UNKNOWN = -1.0
_PLAIN = "csv"
_EXPECTED = "levels of cells, and positions"


def recorded_rows(path: Path) -> Rows | None:
    """Return the levels of a recording or log with their positions; None for no known format.

    A level is placed between the positions before and after it, where they are at most 10 s apart,
    or at a position of its own time. Levels of no cell, and bounds, are set aside.

    Raises
    ------
    InputError
        The recording holds no usable row, or lacks positions or cells, or its dates may be read in
        two ways. NotMeasurementsError where it lacks cells and is no plain CSV.
    """
    if is_log(path):
        return _log_rows(path)
    in_table = path.suffix.lower() in OF_TABLES
    known = format_of(path)
    # Read as text, what holds tables in another form would be a drive test or not by chance, and
    # Parquet is found to be a recording only when it is read.
    if known is None and not in_table:
        return None
    try:
        recording = read_recording(path, options=ReadOptions())
    except InputError as error:
        # JSON, workbooks and layers may be of anything. A person can tell which date was meant.
        unclear = any(fault.where.endswith(", time") for fault in error.faults)
        if in_table and not (unclear and has_levels(path)):
            raise NotMeasurementsError(error.faults) from error
        raise
    known = known or format_named(recording.format)
    tables = recording.tables
    lacking = [name for name in ("radio", "positions") if name not in tables]
    if lacking:
        got = f"{known.title} of {', '.join(tables)}"
        # Columns of plain CSV have any names, so that levels may be in one that is not known.
        if "radio" not in tables and (in_table or known.name != _PLAIN):
            raise fail(NotMeasurementsError, str(path), _EXPECTED, got)
        placed = {"true_places", "places"} & set(tables)
        hint = "convert it with --origin LAT,LON, and name the log" if placed else ""
        raise fail(InputError, str(path), _EXPECTED, got, hint)
    rows = Rows(path, read=recording.rows)
    for unusable in recording.unusable:
        rows.aside[f"rows left out: {unusable.reason}"] += unusable.count
    _add(rows, tables["radio"], tables["positions"], absolute=recording.clock.absolute)
    return rows


def _log_rows(path: Path) -> Rows:
    """Return the levels of a track log, placed by its ground truth, else by its fixes."""
    log = read_log(path)
    if is_local_frame(log.crs):
        raise fail(InputError, f"{path}, crs", "a CRS", LOCAL_FRAME, LOCAL_FRAME_HINT)
    places = log.gnss if log.truth.empty else log.truth
    if log.radio.empty or places.empty:
        held = [name for name in TABLES if len(getattr(log, name))]
        kind = NotMeasurementsError if log.radio.empty else InputError
        raise fail(kind, str(path), _EXPECTED, f"a log of {', '.join(held) or 'nothing'}")
    lon_deg, lat_deg = unproject(log.crs, places["east_m"], places["north_m"])
    accuracy_m = np.full(len(places), np.nan)
    if log.truth.empty:
        accuracy_m = np.sqrt(places["var_east_m2"] + places["var_north_m2"]).to_numpy()
    start_s = log.start_utc_s if np.isfinite(log.start_utc_s) else 0.0
    degrees = {"lat_deg": lat_deg, "lon_deg": lon_deg, "accuracy_m": accuracy_m}
    positions = pd.DataFrame({"time_s": places["time_s"].to_numpy() + start_s, **degrees})
    radio = log.radio.assign(time_s=log.radio["time_s"] + start_s)
    missing = [name for name in IDENTITY if name not in radio]
    radio = radio.assign(**{name: pd.array([pd.NA] * len(radio), "Int64") for name in missing})
    rows = Rows(path, read=len(radio))
    _add(rows, radio, positions, absolute=bool(np.isfinite(log.start_utc_s)))
    return rows


def _add(rows: Rows, radio: pd.DataFrame, positions: pd.DataFrame, *, absolute: bool) -> None:
    places, placed = _places(positions, radio["time_s"].to_numpy(dtype=np.float64))
    radio = _with_coded(rows, radio, places, placed)
    named = radio["cell"].notna().to_numpy()
    level = radio["level_dbm"].notna().to_numpy() & (radio["censored"].fillna(0) == 0).to_numpy()
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
    if not absolute:
        # Counted from an unknown start, or in an unknown zone: the order alone matters.
        time_s = time_s - time_s.min() + 1.0
    advance = np.full(len(radio), np.nan)
    if "timing_advance" in radio:
        advance = radio["timing_advance"].to_numpy(dtype=np.float64, na_value=np.nan)
    serving = (radio["role"] == SERVING).to_numpy(dtype=np.float64)
    level_dbm = radio["level_dbm"].to_numpy(dtype=np.float64)
    columns = [time_s, *places[:2], level_dbm, places[2], advance, serving]
    rows.values.frombytes(np.ascontiguousarray(np.stack(columns)[:, kept].T).tobytes())
    coded = (kept & radio["arfcn"].notna() & radio["bsic"].notna()).to_numpy()
    codes = radio[["arfcn", "bsic"]].to_numpy(dtype=object)[coded]
    for cell, (arfcn, bsic) in zip(radio["cell"].to_numpy(dtype=object)[coded], codes, strict=True):
        rows.codes[cell, (int(arfcn), int(bsic))] += 1
    parts = radio[list(IDENTITY)].fillna(_UNKNOWN).to_numpy(dtype=np.int64)[kept]
    whole = (parts >= 0).all(axis=1)
    for cell, identity in zip(cells[whole], parts[whole].tolist(), strict=True):
        mcc, mnc, lac, ci = identity
        rows.identities.setdefault(cell, (mcc, mnc, lac, ci))
    if "technology" in radio:
        technology = radio["technology"].astype(object)
        kinds = technology.where(technology.notna(), "").to_numpy()[kept]
        pairs = zip(cells, kinds, strict=True)
        rows.technologies.update((cell, kind) for cell, kind in pairs if kind)


def _with_coded(rows: Rows, radio: pd.DataFrame, places: Floats, placed: Bools) -> pd.DataFrame:
    """Return levels whose neighbours without an identity have the cell of their carrier and code.

    The file itself tells it where a cell is identified, within 2 km of all places at which it is;
    where several cells have that carrier and code, none is taken.
    """
    coded = (radio[["arfcn", "bsic"]].notna().all(axis=1) & placed).to_numpy()
    named = coded & radio["cell"].notna().to_numpy()
    bare = coded & ~radio["cell"].notna().to_numpy() & (radio["role"] != SERVING).to_numpy()
    if not (named.any() and bare.any()):
        return radio
    codes = radio["arfcn"].astype(str) + " " + radio["bsic"].astype(str)
    if "technology" in radio:
        codes = radio["technology"].astype(object).fillna("").astype(str) + " " + codes
    keys = codes.to_numpy(dtype=object)
    known = pd.DataFrame({"key": keys, "cell": radio["cell"], "lat": places[0], "lon": places[1]})
    cells = (
        known[named]
        .groupby("key")
        .agg(
            count=("cell", "nunique"),
            cell=("cell", "first"),
            south=("lat", "min"),
            north=("lat", "max"),
            west=("lon", "min"),
            east=("lon", "max"),
        )
    )
    found = cells[cells["count"] == 1].reindex(keys[bare])
    reach_deg = _CODE_REACH_M / _M_PER_DEG
    wide_deg = reach_deg / np.cos(np.radians(places[0][bare]))
    lat_deg, lon_deg = places[0][bare], places[1][bare]
    near = (found["south"] - reach_deg <= lat_deg) & (lat_deg <= found["north"] + reach_deg)
    near &= (found["west"] - wide_deg <= lon_deg) & (lon_deg <= found["east"] + wide_deg)
    names = radio["cell"].astype(object).to_numpy(copy=True)
    names[bare] = np.where(near.to_numpy(), found["cell"].to_numpy(dtype=object), None)
    if count := int(near.sum()):
        rows.remarks.append(f"{number_of(count, 'neighbour')} named by carrier and code")
    return radio.assign(cell=names)


def _places(positions: pd.DataFrame, time_s: Floats) -> tuple[Floats, Bools]:
    """Return latitude, longitude and accuracy at some times, shape (3, N), and where they hold."""
    positions = positions.drop_duplicates("time_s")
    at = positions["time_s"].to_numpy(dtype=np.float64)
    columns = positions[["lat_deg", "lon_deg", "accuracy_m"]].to_numpy(dtype=np.float64).T
    after = np.clip(np.searchsorted(at, time_s), 0, len(at) - 1)
    before = np.where(at[after] == time_s, after, np.maximum(after - 1, 0))
    placed = (at[before] <= time_s) & (time_s <= at[after])
    placed &= at[after] - at[before] <= _LONGEST_S
    lat_deg = np.interp(time_s, at, columns[0])
    # The short way round, also across 180 degrees.
    lon_deg = np.interp(time_s, at, np.unwrap(columns[1], period=360.0))
    accuracy_m = np.fmax(columns[2, before], columns[2, after])
    lon_deg -= 360.0 * np.round(lon_deg / 360.0)
    return np.stack([lat_deg, lon_deg, accuracy_m]), placed
