"""Logs with measurements of cells for Kalman-type filters that have no sites."""

from __future__ import annotations

from dataclasses import replace

from mapfilter._words import number_of
from mapfilter.tracks.log import TrackLog

_OF_SITES = {
    "radio": ("row of cells (radio)", "rows of cells (radio)"),
    "tdoa": ("time difference (tdoa)", "time differences (tdoa)"),
}
"""Tables of which sites make measurements, and what one of their rows is called, and several."""


def needs_sites(log: TrackLog) -> bool:
    """Return whether only measurements of cells could tell a filter without a map the position.

    Fixes and dead reckoning need no sites, but dead reckoning alone does not start.
    """
    return log.gnss.empty and any(len(getattr(log, table)) for table in _OF_SITES)


def without_cells(log: TrackLog, sources: str) -> TrackLog:
    """Return a log without measurements of cells, with a note on them; the same log without any.

    Parameters
    ----------
    sources : str
        What has sites, for the note.

    Examples
    --------
    >>> import pandas as pd
    >>> from mapfilter.tracks.log import make_log
    >>> received = pd.DataFrame({"time_s": [0.0, 0.0], "role": ["serving", "neighbour"]})
    >>> log = without_cells(make_log("EPSG:32635", radio=received), "a plan")
    >>> len(log.radio), log.notes
    (0, ('2 rows of cells (radio) left out: their sites are unknown without a plan',))
    """
    rows = {table: getattr(log, table) for table in _OF_SITES}
    found = [number_of(len(one), *_OF_SITES[table]) for table, one in rows.items() if len(one)]
    if not found:
        return log
    note = f"{' and '.join(found)} left out: their sites are unknown without {sources}"
    emptied = {table: one.iloc[:0] for table, one in rows.items()}
    return replace(log, **emptied, notes=(*log.notes, note))
