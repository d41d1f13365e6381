"""Faults of step counters and headings; each takes a sound log and returns one with the fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.angles import wrap_rad
from mapfilter.simulation.worlds.windows import Window
from mapfilter.tracks.log import TrackLog

FEET = 3.28
"""Numbers of a length in feet, for one in metres."""


def motion_ends(log: TrackLog, window: Window, _rng: np.random.Generator) -> TrackLog:
    """Leave the rows of motion out.

    Operating systems stop the sensors of programs in the background, or while the screen is off,
    and go on delivering radio reports.
    """
    rows = ~window.holds(_time_s(log.motion))
    return replace(log, motion=log.motion[rows].reset_index(drop=True))


def steps_missing(log: TrackLog, window: Window, _rng: np.random.Generator) -> TrackLog:
    """Leave the steps empty (NaN); headings go on.

    The permission for activity recognition was withdrawn, or the step counter's process died.
    """
    return _with_steps(log, window, float("nan"))


def steps_zero(log: TrackLog, window: Window, _rng: np.random.Generator) -> TrackLog:
    """Count no steps while the phone goes on; headings go on.

    A step counter in hardware hangs until the phone is restarted; the phone lies in a pram, a
    basket or a bag, or is carried without any swing.
    """
    return _with_steps(log, window, 0.0)


def headings_frozen(log: TrackLog, window: Window, _rng: np.random.Generator) -> TrackLog:
    """Repeat the heading at the begin; no turns.

    The rotation vector is no longer delivered (another sensor rate, a paused listener), and the
    program goes on using the last one.
    """
    heading, inside = _headings(log.motion), window.holds(_time_s(log.motion))
    known = np.flatnonzero(np.isfinite(heading) & ~window.ended(_time_s(log.motion)))
    if inside.any() and known.size:
        first = int(np.argmax(inside))
        before = known[known < first]
        heading[inside] = heading[before[-1] if before.size else known[0]]
    return _with_headings(log, heading)


def headings_reversed(log: TrackLog, window: Window, _rng: np.random.Generator) -> TrackLog:
    """Turn the headings by 180 degrees.

    The phone is held the other way round, or put into the pocket upside down.
    """
    heading, inside = _headings(log.motion), window.holds(_time_s(log.motion))
    return _with_headings(log, np.where(inside, wrap_rad(heading + np.pi), heading))


def headings_mirrored(log: TrackLog, window: Window, _rng: np.random.Generator) -> TrackLog:
    """Count the headings clockwise instead of counter-clockwise.

    Axes are mapped anew when the screen faces down, with one sign wrong.
    """
    heading, inside = _headings(log.motion), window.holds(_time_s(log.motion))
    return _with_headings(log, np.where(inside, wrap_rad(-heading), heading))


def steps_in_feet(log: TrackLog, window: Window, _rng: np.random.Generator) -> TrackLog:
    """Give the steps in feet where metres are expected: 3.28 times as long.

    A program's setting of units, or a converter that was told the wrong ones.
    """
    step_m, inside = log.motion["step_m"].to_numpy(), window.holds(_time_s(log.motion))
    return replace(log, motion=log.motion.assign(step_m=np.where(inside, FEET * step_m, step_m)))


def _time_s(table: pd.DataFrame) -> Floats:
    return np.asarray(table["time_s"], dtype=np.float64)


def _headings(motion: pd.DataFrame) -> Floats:
    return np.array(motion["heading_rad"], dtype=np.float64)


def _with_steps(log: TrackLog, window: Window, value_m: float) -> TrackLog:
    step_m, inside = log.motion["step_m"].to_numpy(), window.holds(_time_s(log.motion))
    return replace(log, motion=log.motion.assign(step_m=np.where(inside, value_m, step_m)))


def _with_headings(log: TrackLog, heading_rad: Floats) -> TrackLog:
    """Return a log with other headings, and with the turns between them."""
    was = _headings(log.motion)
    more = np.diff(heading_rad, prepend=np.nan) - np.diff(was, prepend=np.nan)
    turn = log.motion["turn_rad"].to_numpy(dtype=np.float64)
    # Where nothing changed, the turns stay to the last bit.
    changed = np.isfinite(more) & (more != 0)
    turn = np.where(changed, wrap_rad(turn + np.where(changed, more, 0.0)), turn)
    return replace(log, motion=log.motion.assign(heading_rad=heading_rad, turn_rad=turn))
