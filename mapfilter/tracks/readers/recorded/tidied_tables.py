"""Tables of a recording once all parts are read: in the order of time, without duplicates."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._words import number_of
from mapfilter.tracks.checks.cut_times import cut_times
from mapfilter.tracks.checks.repeated_readings import repeated_readings
from mapfilter.tracks.readers.recorded.batched_rows import without_batches
from mapfilter.tracks.readers.recorded.held_positions import own_positions
from mapfilter.tracks.readers.recorded.recorded_values import duplicates, reordered

_OF_STEPS = ("steps", "motion")
_SEVERAL = ("radio", "satellites", "ephemerides")
"""Tables that have several rows for each moment."""


def tidied(
    table: str, rows: pd.DataFrame, *, cells: bool, by_cell: bool
) -> tuple[pd.DataFrame, list[str], list[str]]:
    """Return a table with times sorted and without exact duplicates, and what was done.

    Parameters
    ----------
    table : str
        One of :data:`mapfilter.tracks.readers.recorded.tables.RECORDED`.
    rows : DataFrame
        With ``time_s``, as they were read.
    cells : bool
        Whether the file has some.
    by_cell : bool
        Whether it lists neighbours, so that a moment has a row for each cell.

    Returns
    -------
    rows : DataFrame
    notes : list of str
        Remarks on what is used otherwise than it stands.
    ignored : list of str
        Remarks on what is left out.
    """
    notes, ignored = [], []
    time = rows["time_s"].to_numpy()
    if (np.diff(time) < 0).any():
        rows = reordered(rows, np.argsort(time, kind="stable"))
        time = rows["time_s"].to_numpy()
    if table in _OF_STEPS:
        rows, batches = without_batches(table, rows, repeated=cells)
        if batches:
            notes.append(batches)
        time = rows["time_s"].to_numpy()
    if (np.diff(time) == 0).any():
        duplicate = repeated_readings(rows, duplicates(rows))
        if duplicate.any():
            dropped = number_of(int(duplicate.sum()), "exact duplicate row")
            notes.append(f"{table}: {dropped} dropped")
            rows = rows[~duplicate].reset_index(drop=True)
        # Equal steps are distance lost; a file with a row for each cell repeats them.
        counted = time if table == "motion" and not by_cell else rows["time_s"]
        if "provider" in rows and rows["provider"].notna().any():
            # Each provider has its own.
            counted = rows.loc[rows["provider"] == rows["provider"].mode().iloc[0], "time_s"]
        if table not in _SEVERAL and (cut := cut_times(np.asarray(counted))):
            ignored.append(f"{table}: {cut}")
    if table == "positions":
        rows, shared = own_positions(rows)
        ignored += shared
    return rows, notes, ignored
