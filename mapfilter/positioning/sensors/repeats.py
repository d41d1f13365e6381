"""Motion rows that repeat others: headings that stand still, and rows that are delivered twice.

A compass, or a fused orientation, hardly ever gives the same number for long while one walks. Where
it does, it has died, and its last value is used on. Rows that come in pairs of equal ones are
deliveries of one row: every other one is dropped, or all steps would count twice. Pairs at regular
times are those of a sensor that is read more often than it measures, and stay. Headings in whole
degrees, and those of made logs, do repeat, and go on doing so along a straight road: where headings
are as coarse as that, repetitions say nothing. Elsewhere each speaks by how rare it was before (a
CUSUM; Page, 1954). A heading that has never been another one is no compass's after some distance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import degrees, isfinite, log, nan

from mapfilter._same import EqualByValue
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.sensors.unmeasured import headless_step

_PRIOR_ROWS, _PRIOR_REPEATS = 50.0, 49.0
_MOST_NATS, _STILL_NATS = 1.0, 12.0
"""Gain of one repetition at most, and the sum from which on a heading stands still."""
_FINE_ROWS = 30
_NEVER_ROWS, _NEVER_M, _NEVER_COARSE_M, _ODD_ROWS = 100, 300.0, 1500.0, 3
"""Rows and metres after which a heading that was the same from the beginning, but for some first
rows, stands still; made logs without noise have such headings along an edge of a street that is
straight for so long, coarse ones along a road."""
_COARSE_PER_DEG, _COARSE_PER_RAD = 100.0, 1000.0
_PAIRS, _SOONER = 8, 0.8
"""Pairs of equal rows, and the interval within a pair relative to that between two of them."""
_TURNS_RAD, _ROUNDING = 1e-9, 1e-4

_Row = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class MotionRepeats(EqualByValue):
    """What is known of how the rows of a journey repeat each other; rests do not count.

    Parameters
    ----------
    last : tuple of float
        Step, heading and turn of the last row.
    was_equal : bool
        Whether it was equal to the one before.
    rows, repeats : float
        Rows so far, and those of them with the heading of the row before; without the present run.
    run : int
        Rows of the present run of equal headings.
    run_m : float
        Distance moved in it.
    nats : float
        How much the run speaks for a heading that stands still.
    still_m : float
        Distance moved since that was found.
    pairs : int
        Pairs of equal rows, one after the other.
    time_s, within_s, between_s : float
        Time of the last row; the last interval between equal rows, and between others.
    fine : int
        Rows whose heading has more digits than hundredths of a degree or thousandths of a radian.
    """

    last: _Row = (nan, nan, nan)
    was_equal: bool = False
    rows: float = _PRIOR_ROWS
    repeats: float = _PRIOR_REPEATS
    run: int = 0
    nats: float = 0.0
    still_m: float = 0.0
    pairs: int = 0
    time_s: float = nan
    within_s: float = nan
    between_s: float = nan
    fine: int = 0
    run_m: float = 0.0

    @property
    def stands_still(self) -> bool:
        """Whether the heading no longer follows the way."""
        if self.nats >= _STILL_NATS and self.fine >= _FINE_ROWS:
            return True
        never_changed = self.rows <= _PRIOR_ROWS + _ODD_ROWS
        least_m = _NEVER_M if self.fine > 0 else _NEVER_COARSE_M
        return never_changed and self.run >= _NEVER_ROWS and self.run_m >= least_m

    @property
    def come_twice(self) -> bool:
        """Whether rows are delivered twice."""
        return self.pairs >= _PAIRS and self.within_s < _SOONER * self.between_s


def without_repeats(
    repeats: MotionRepeats,
    time_s: float,
    steps: tuple[MotionStep, ...],
    step_unit_m: float = 1.0,
) -> tuple[MotionRepeats, tuple[MotionStep, ...], Reason]:
    """Return the rows of an epoch as far as they are news.

    Parameters
    ----------
    repeats : MotionRepeats
        After the rows before.
    time_s : float
        Of the epoch.
    steps : tuple of MotionStep
        Its rows.
    step_unit_m : float
        Unit that their lengths are read in.

    Returns
    -------
    repeats : MotionRepeats
    steps : tuple of MotionStep
        Without second deliveries; with a direction to all sides where the heading stands still.
    reason : Reason
        ``USED``, ``HEADING_STUCK`` or ``DELIVERED_TWICE``.
    """
    kept, why = [], Reason.USED
    for step in steps:
        if not isfinite(step.step_m) or step.step_m == 0:
            kept.append(step)
            continue
        repeats = _followed(repeats, time_s, step, step_unit_m)
        if repeats.come_twice and repeats.was_equal:
            why = Reason.DELIVERED_TWICE
            continue
        if repeats.stands_still:
            why = Reason.HEADING_STUCK
            before_m = repeats.still_m
            repeats = replace(repeats, still_m=before_m + abs(step.step_m))
            step = headless_step(step.step_m, before_m)
        kept.append(step)
    return (repeats, steps, why) if why is Reason.USED else (repeats, tuple(kept), why)


def _followed(
    repeats: MotionRepeats, time_s: float, step: MotionStep, step_unit_m: float
) -> MotionRepeats:
    """Return what is known after one more row."""
    row = step.step_m, step.heading_rad, step.turn_rad
    is_equal = all(map(_equal, row, repeats.last))
    pairs = repeats.pairs + is_equal if is_equal != repeats.was_equal else 0
    # A turn that repeats, too, is that of a row that stands still as a whole.
    turns = abs(step.turn_rad) > _TURNS_RAD and step.turn_rad != repeats.last[2]
    interval_s = time_s - repeats.time_s
    within_s = interval_s if is_equal else repeats.within_s
    between_s = repeats.between_s if is_equal else interval_s
    if step.heading_rad == repeats.last[1] and not turns:
        each = min(-log(repeats.repeats / repeats.rows), _MOST_NATS)
        run, nats = repeats.run + 1, repeats.nats + each
        return replace(
            repeats,
            last=row,
            was_equal=is_equal,
            pairs=pairs,
            run=run,
            run_m=repeats.run_m + step_unit_m * abs(step.step_m),
            nats=nats,
            time_s=time_s,
            within_s=within_s,
            between_s=between_s,
        )
    # A run in which the heading stood still is none of the usual ones.
    run = 0 if repeats.stands_still else repeats.run
    return MotionRepeats(
        row,
        is_equal,
        repeats.rows + run + 1,
        repeats.repeats + run,
        pairs=pairs,
        time_s=time_s,
        within_s=within_s,
        between_s=between_s,
        fine=repeats.fine + _is_fine(step.heading_rad),
    )


def _is_fine(heading_rad: float) -> bool:
    """Return whether a heading is no multiple of a hundredth degree or a thousandth radian."""
    if not isfinite(heading_rad):
        return False
    hundredths, thousandths = degrees(heading_rad) * _COARSE_PER_DEG, heading_rad * _COARSE_PER_RAD
    fine = abs(hundredths - round(hundredths)) > _ROUNDING
    return fine and abs(thousandths - round(thousandths)) > _ROUNDING


def _equal(value: float, other: float) -> bool:
    return value == other or not (isfinite(value) or isfinite(other))
