"""Faults of clocks and of delivery; each takes a sound log and returns one with the fault.

Rows stay in the order in which they were written, as in a file that a phone wrote.
"""

from __future__ import annotations

from dataclasses import replace
from math import isfinite

import numpy as np
import pandas as pd

from mapfilter.simulation.worlds.windows import Window
from mapfilter.tracks.log import TrackLog

FAR_S = 1e9
"""About the number of seconds of Unix time: what a clock shows that counts from 1970."""
BACK_S = 30.0
APART_S = 20.0
AGAIN_S = 0.3
PAUSED_S = 30.0
"""How long a recording pauses where nothing says that it goes on."""
_SOURCES = ("motion", "radio")


def report_far_ahead(log: TrackLog, window: Window, _rng: np.random.Generator) -> TrackLog:
    """Give the first row of a report a time of 1e9 s.

    The clock was set in between: time since the start of the phone is mixed with Unix time.
    """
    time_s = log.radio["time_s"].to_numpy(dtype=np.float64).copy()
    inside = np.flatnonzero(window.holds(time_s))
    time_s[inside[:1]] = FAR_S
    return replace(log, radio=log.radio.assign(time_s=time_s))


def clock_steps_back(log: TrackLog, window: Window, rng: np.random.Generator) -> TrackLog:
    """Give the rows of motion, or of radio, times that are 30 s too early.

    Clocks are set by the network or by NTP; one source takes the time of delivery, another that of
    the sensor. Where the fault ends, the clock is set again.
    """
    source = str(rng.choice(_SOURCES))
    return _shifted(log, source, window, -BACK_S)


def clocks_apart(log: TrackLog, window: Window, rng: np.random.Generator) -> TrackLog:
    """Give the rows of motion, or of radio, times that are 20 s too late.

    Sensors are time-stamped since the start of the phone, reports by its calendar; recordings of
    two devices are joined by hand.
    """
    source = str(rng.choice(_SOURCES))
    return _shifted(log, source, window, APART_S)


def epochs_twice(log: TrackLog, window: Window, _rng: np.random.Generator) -> TrackLog:
    """Deliver every row twice, again after 0.3 s: steps are counted twice.

    Two listeners were registered, or a queue is sent again after its first delivery was not
    acknowledged; rows are time-stamped as they arrive.
    """
    changed = {}
    for source in _SOURCES:
        table = getattr(log, source)
        again = table[window.holds(table["time_s"])]
        again = again.assign(time_s=again["time_s"] + AGAIN_S)
        whole = pd.concat([table, again]) if len(again) else table
        changed[source] = whole.sort_values("time_s", kind="stable").reset_index(drop=True)
    return replace(log, **changed)


def recording_paused(log: TrackLog, window: Window, _rng: np.random.Generator) -> TrackLog:
    """Leave all rows out, those of motion as those of radio; a pause without an end lasts 30 s.

    Operating systems suspend a program in the background; a logger is restarted, or its computer
    changes batteries. The first step after the pause is that of one interval.
    """
    lasts = isfinite(window.end_s)
    paused = window if lasts else replace(window, end_s=window.begin_s + PAUSED_S)
    changed = {}
    for source in _SOURCES:
        table = getattr(log, source)
        changed[source] = table[~paused.holds(table["time_s"])].reset_index(drop=True)
    return replace(log, **changed)


def _shifted(log: TrackLog, source: str, window: Window, by_s: float) -> TrackLog:
    table = getattr(log, source)
    inside = window.holds(table["time_s"])
    return replace(log, **{source: table.assign(time_s=table["time_s"] + by_s * inside)})
