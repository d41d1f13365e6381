"""The rows of motion: when they end, their course, and what stairs and lifts change."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pandas as pd

from mapfilter._constants import MAD_TO_SD
from mapfilter._types import Bools, Floats, Ints
from mapfilter.tracks.pdr.height import TREAD_M, Climb, height_m
from mapfilter.tracks.pdr.signals import RATE_HZ

_IDLE_S = 1.5
_TICK_S = 1.0
_LAST_S = 0.2


def row_events(time_s: Floats, index: Ints, length_m: Floats) -> tuple[Floats, Floats, Ints]:
    """Return times, lengths and samples of rows: the start, steps, and each second at rest.

    Steps are never at the first or the last sample: they are peaks.
    """
    marks = np.concatenate([[0], index, [len(time_s) - 1]]).astype(np.int64)
    lengths = np.concatenate([[0.0], length_m, [0.0]])
    idle: list[int] = []
    tick = int(_TICK_S * RATE_HZ)
    for first, last in pairwise(marks.tolist()):
        if last - first > _IDLE_S * RATE_HZ:
            idle += range(first + tick, last - int(_LAST_S * RATE_HZ), tick)
    at = np.concatenate([marks, np.array(idle, dtype=np.int64)])
    every = np.concatenate([lengths, np.zeros(len(idle))])
    order = np.argsort(at, kind="stable")
    at = at[order]
    return time_s[at], every[order], at


def course_over_strides(course: Floats, at: Ints, stepped: Bools) -> tuple[Floats, float]:
    """Return the course of each row, a step's over two steps around it, and its white noise.

    The body turns to the left with one step and to the right with the next.
    """
    total = np.concatenate([[0.0], np.cumsum(course)])
    before = np.concatenate([at[:1], at[:-1]])
    lasted = np.minimum(at - before, int(_IDLE_S * RATE_HZ))
    middle = at - lasted / 2
    first = np.maximum((middle - lasted).round().astype(np.int64), 0)
    last = np.minimum((middle + lasted).round().astype(np.int64) + 1, len(course))
    mean = (total[last] - total[first]) / (last - first)
    values = np.where(stepped, mean, course[at])
    three = stepped[2:] & stepped[1:-1] & stepped[:-2]
    second = np.diff(values, 2)[three]
    sway = MAD_TO_SD * float(np.median(np.abs(second))) / np.sqrt(6.0) if second.size else 0.0
    return values, sway


def climbed_rows(
    rows: pd.DataFrame, barometer: pd.DataFrame, found: tuple[Climb, ...]
) -> pd.DataFrame:
    """Return rows with heights; steps on stairs are at most a tread long, those in a lift none."""
    rows = rows.copy()
    known = barometer.dropna().sort_values("time_s")
    if len(known):
        heights = height_m(known["pressure_hpa"].to_numpy(dtype=np.float64))
        rows["height_m"] = np.interp(rows["time_s"], known["time_s"], heights)
    for climb in found:
        inside = rows["time_s"].between(climb.begin_s, climb.end_s)
        stairs = climb.kind == "stairs"
        rows.loc[inside, "climb"] = 1.0 if stairs else 2.0
        most_m = TREAD_M if stairs else 0.0
        rows.loc[inside, "step_m"] = np.minimum(rows.loc[inside, "step_m"], most_m)
    return rows
