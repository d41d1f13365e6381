"""Recordings of one time whose serving cells differ, as those of two phones do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from mapfilter._types import Bools
from mapfilter.tracks.readers.recorded.recording import Recording

_NEAR_S, _NEAR_DB = 2.0, 3.0
_FEWEST, _SAME = 20, 0.6
"""Reports of the same times, and the share of equal ones below which they are of two phones."""


def two_phones_notes(recordings: Sequence[Recording]) -> list[str]:
    """Return a note for each recording whose serving cells are others than those of the first one.

    Two programs on one phone report the same cell, and nearly the same level.

    Parameters
    ----------
    recordings : sequence of Recording
        Of one journey, on one clock.
    """
    having = [(one.name, rows) for one in recordings if (rows := _serving(one)) is not None]
    notes = []
    for name, rows in having[1:]:
        first, known = having[0]
        same = _same(known, rows)
        if same.size >= _FEWEST and same.mean() < _SAME:
            notes.append(
                f"{name} and {first}: serving cells or levels differ in {np.mean(~same):.0%} of "
                "the reports of the same times, as those of two phones do; both are used: name "
                "the files of one phone alone"
            )
    return notes


def _serving(recording: Recording) -> pd.DataFrame | None:
    """Return the reports of serving cells with a level, in the order of time; None without any."""
    rows = recording.tables.get("radio")
    if rows is None:
        return None
    rows = rows[(rows["role"] == "serving") & rows["level_dbm"].notna() & rows["time_s"].notna()]
    # Of several serving cells of one time, as of two SIMs, none stands for the phone.
    rows = rows.drop_duplicates("time_s", keep=False).sort_values("time_s")
    return rows if len(rows) else None


def _same(first: pd.DataFrame, other: pd.DataFrame) -> Bools:
    """Return for each report of the other one with one of the first at its time whether they agree.

    Identities that one of the two lacks are not compared.
    """
    names = ["time_s", "ci", "level_dbm"]
    pairs = pd.merge_asof(
        *(one.assign(ci=pd.to_numeric(one["ci"]))[names].astype(float) for one in (other, first)),
        on="time_s",
        suffixes=("", "_first"),
        direction="nearest",
        tolerance=_NEAR_S,
    )
    pairs = pairs[pairs["level_dbm_first"].notna()]
    cells = pairs["ci"].eq(pairs["ci_first"]) | pairs["ci"].isna() | pairs["ci_first"].isna()
    near = (pairs["level_dbm"] - pairs["level_dbm_first"]).abs() <= _NEAR_DB
    return np.asarray(cells & near, dtype=np.bool_)
