"""Faults of radio reports; each takes a sound log and returns one with the fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from mapfilter._types import Floats, Ints
from mapfilter.simulation.worlds.windows import Window
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import NEIGHBOUR

CACHE_S = 60.0
"""Age of the levels of a cell that are taken from a cache."""


def radio_ends(log: TrackLog, window: Window, _rng: np.random.Generator) -> TrackLog:
    """Leave the radio reports out.

    The modem restarts or is without service, the permission for locations is withdrawn, or the
    program may no longer ask in the background. Motion goes on.
    """
    rows = ~window.holds(log.radio["time_s"])
    return replace(log, radio=log.radio[rows].reset_index(drop=True))


def radio_frozen(log: TrackLog, window: Window, _rng: np.random.Generator) -> TrackLog:
    """Repeat the report at the begin at the usual rate, with cells and levels, as time goes on.

    Phones answer from a cache while the screen is off: in public recordings from Belgium reports
    freeze within a minute or two, and are repeated for half a kilometre and more.
    """
    time_s, report = _reports(log)
    inside = np.flatnonzero(window.holds(time_s))
    if not inside.size:
        return log
    source = np.arange(time_s.size)
    source[inside] = max(int(inside[0]) - 1, 0)
    return _reported(log, time_s, report, source)


def levels_backwards(log: TrackLog, window: Window, _rng: np.random.Generator) -> TrackLog:
    """Deliver the reports of the fault's time in reverse order, at the times of the others.

    A buffer is emptied from its end; a table in a data base is read in descending order.
    """
    time_s, report = _reports(log)
    inside = np.flatnonzero(window.holds(time_s))
    source = np.arange(time_s.size)
    source[inside] = inside[::-1]
    return _reported(log, time_s, report, source)


def neighbour_stuck(log: TrackLog, window: Window, rng: np.random.Generator) -> TrackLog:
    """Repeat one neighbour of the first report as it was, in every report.

    Modems keep entries of their neighbour list that they no longer measure. While that cell serves,
    it is measured.
    """
    radio, (time_s, report) = log.radio, _reports(log)
    inside = window.holds(time_s)
    is_neighbour = (radio["role"] == NEIGHBOUR).to_numpy()
    rows = np.flatnonzero(is_neighbour & inside[report])
    if not rows.size:
        return log
    code = _cell_codes(radio)
    stuck = int(rng.choice(rows[report[rows] == report[rows[0]]]))
    same = code == code[stuck]
    serves = np.zeros(time_s.size, dtype=bool)
    serves[report[same & ~is_neighbour]] = True
    wanted_s = time_s[inside & ~serves & (time_s >= time_s[report[stuck]])]
    again = radio.iloc[np.full(wanted_s.size, stuck)].assign(time_s=wanted_s)
    kept = radio[~(same & is_neighbour & inside[report])]
    whole = pd.concat([kept, again]).sort_values("time_s", kind="stable")
    return replace(log, radio=whole.reset_index(drop=True))


def cell_stale(log: TrackLog, window: Window, _rng: np.random.Generator) -> TrackLog:
    """Report the cell that is received most often with its levels of a minute ago.

    Layers of the operating system keep what they know of each cell for different times. Where there
    is nothing from then, the present level is reported.
    """
    radio = log.radio
    inside = window.holds(radio["time_s"])
    if not inside.any():
        return log
    code = _cell_codes(radio)
    rows = np.flatnonzero(code == np.bincount(code).argmax())
    time_s = radio["time_s"].to_numpy(dtype=np.float64)
    # The last time that it was received, a minute before or earlier; not long ago.
    last = np.searchsorted(time_s[rows], time_s[rows] - CACHE_S, side="right") - 1
    old = time_s[rows] - time_s[rows[np.maximum(last, 0)]]
    known = (last >= 0) & (old <= 2 * CACHE_S) & inside[rows]
    source = np.arange(len(radio))
    source[rows[known]] = rows[last[known]]
    taken = {name: radio[name].array[source] for name in ("level_dbm", "censored")}
    return replace(log, radio=radio.assign(**taken))


def _reports(log: TrackLog) -> tuple[Floats, Ints]:
    """Return the times of the reports, and to which of them each row belongs."""
    time_s, report = np.unique(log.radio["time_s"].to_numpy(), return_inverse=True)
    return time_s, report


def _reported(log: TrackLog, time_s: Floats, report: Ints, source: Ints) -> TrackLog:
    """Return a log in which each report holds what that of ``source`` holds."""
    rows = [np.flatnonzero(report == number) for number in range(time_s.size)]
    taken = [rows[number] for number in source]
    every = np.concatenate(taken) if taken else np.empty(0, dtype=np.intp)
    at_s = np.repeat(time_s, [part.size for part in taken])
    radio = log.radio.iloc[every].assign(time_s=at_s).reset_index(drop=True)
    return replace(log, radio=radio)


def _cell_codes(radio: pd.DataFrame) -> Ints:
    """Return a number for the cell of each row; neighbours are known by carrier and code only."""
    names = zip(radio["arfcn"].fillna(-1), radio["bsic"].fillna(-1), strict=True)
    code, _ = pd.factorize(pd.Series(list(names), dtype=object))
    return np.asarray(code, dtype=np.int64)
