"""Scans: the rows of a radio table that one look of the receiver gave, at one time or nearly so."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Ints
from mapfilter.tracks.schema import SERVING

SCAN_S = 1.0
"""Readings of a scan lie less than this after its first."""


def advertised(radio: pd.DataFrame) -> Bools:
    """Return which rows are advertisements of beacons: each is received by itself, at any time."""
    if "technology" not in radio:
        return np.zeros(len(radio), dtype=bool)
    return np.asarray((radio["technology"] == "BLE").fillna(False), dtype=bool)


def scan_of_rows(radio: pd.DataFrame) -> Ints:
    """Return the scan of each row, counted from 0.

    Rows of one time are one scan, and so are rows less than :data:`SCAN_S` after its first, until
    a cell, or a serving cell of the same technology, is reported again: that is a scan of its own.
    Beacons advertise several times a second, and may be received again.

    Parameters
    ----------
    radio : pandas.DataFrame
        Rows of a log, sorted by time.

    Examples
    --------
    >>> rows = pd.DataFrame({"time_s": [0.0, 0.2, 0.4, 0.5], "cell": ["a", "b", "a", "c"]})
    >>> scan_of_rows(rows.assign(role="neighbour", arfcn=None, bsic=None)).tolist()
    [0, 0, 1, 1]
    """
    times_s, moment = np.unique(radio["time_s"].to_numpy(np.float64), return_inverse=True)
    if not (np.diff(times_s) < SCAN_S).any():
        return np.asarray(moment, dtype=np.int64)
    names = radio[["cell", "arfcn", "bsic"]].astype(object)
    code = pd.MultiIndex.from_frame(names.where(names.notna(), "")).factorize()[0]
    # Neighbours that are known by their level alone are no cell twice.
    again = ~advertised(radio) & names.notna().any(axis=1).to_numpy(dtype=bool)
    family = radio["technology"] if "technology" in radio else pd.Series("", radio.index)
    serving = (radio["role"] == SERVING).to_numpy(dtype=bool)
    # Serving cells of a technology are one more code, below 0.
    served = np.where(serving, -1 - pd.factorize(family)[0] - 1, 0)
    edges = np.searchsorted(moment, np.arange(len(times_s) + 1))
    scan = np.zeros(len(times_s), dtype=np.int64)
    seen: set[int] = set()
    number, first_s = -1, -np.inf
    for k, time_s in enumerate(times_s.tolist()):
        rows = slice(edges[k], edges[k + 1])
        own = set(code[rows][again[rows]].tolist()) | set(served[rows][serving[rows]].tolist())
        if time_s - first_s >= SCAN_S or own & seen:
            number, first_s, seen = number + 1, time_s, set()
        seen |= own
        scan[k] = number
    return scan[moment]
