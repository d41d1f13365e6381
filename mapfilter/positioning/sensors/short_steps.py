"""Steps of centimetres, as odometers give them 50 times a second: added up to half a metre.

To move thousands of hypotheses by two centimetres takes as long as by two metres, and on a grid of
pixels such steps blur a belief. So they wait until they are half a metre, or something else is
measured; the position is that far behind at most.
"""

from __future__ import annotations

from dataclasses import replace
from math import atan2, cos, hypot, isfinite, nan, radians, sin
from typing import NamedTuple

from mapfilter.angles import wrap_one_rad
from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.epochs import Epoch

LEAST_M = 0.5
"""Steps from this length on do not wait."""
_BENDS_RAD = radians(30.0)
"""Largest difference of two headings that have a mean: beyond, a phone is turned."""


class ShortSteps(NamedTuple):
    """Steps that wait, as one; None without any."""

    waiting: MotionStep | None = None

    def gathered(self, epoch: Epoch) -> tuple[ShortSteps, Epoch]:
        """Return what waits after an epoch, and the epoch with what has waited long enough.

        Examples
        --------
        >>> step = MotionStep(0.2, 0.1)
        >>> short, first = ShortSteps().gathered(Epoch(0.0, (step, step)))
        >>> first.motion
        ()
        >>> short, second = short.gathered(Epoch(0.1, (step,)))
        >>> round(second.motion[0].step_m, 1), short.waiting
        (0.6, None)
        """
        waiting, steps = self.waiting, epoch.motion
        if waiting is None and not any(_is_short(step) for step in steps):
            return self, epoch
        moved: list[MotionStep] = []
        for step in steps:
            if waiting is not None and not _are_one(waiting, step):
                moved.append(waiting)
                waiting = None
            if waiting is not None:
                waiting = _sum(waiting, step)
            elif _is_short(step):
                waiting = step
            else:
                moved.append(step)
            if waiting is not None and abs(waiting.step_m) >= LEAST_M:
                moved.append(waiting)
                waiting = None
        is_measured = epoch.radio or epoch.gnss is not None or epoch.pseudoranges or epoch.tdoa
        if waiting is not None and is_measured:
            moved.append(waiting)
            waiting = None
        return ShortSteps(waiting), replace(epoch, motion=tuple(moved))


def _is_short(step: MotionStep) -> bool:
    """Return whether a step may wait: a short one with a direction, and all of it measured."""
    return 0 < abs(step.step_m) < LEAST_M and _is_measured(step)


def _is_measured(step: MotionStep) -> bool:
    is_directed = isfinite(step.heading_rad) or isfinite(step.turn_rad)
    return is_directed and not isfinite(step.spread_m) and step.turned_sd_rad == 0


def _are_one(waiting: MotionStep, step: MotionStep) -> bool:
    """Return whether a step goes on from one that waits: as this does, and measured alike."""
    if not (
        abs(step.step_m) < LEAST_M and _is_measured(step) and waiting.step_m * step.step_m >= 0
    ):
        return False
    if isfinite(waiting.turn_rad) != isfinite(step.turn_rad):
        return False
    one_rad, other_rad = waiting.heading_rad, step.heading_rad
    if isfinite(one_rad) and isfinite(other_rad):
        return abs(wrap_one_rad(other_rad - one_rad)) <= _BENDS_RAD
    return isfinite(one_rad) == isfinite(other_rad)


def _sum(waiting: MotionStep, step: MotionStep) -> MotionStep:
    """Return two steps as one, along their mean heading."""
    heading_rad, weights = nan, (abs(waiting.step_m), abs(step.step_m))
    if isfinite(waiting.heading_rad):
        pair = waiting.heading_rad, step.heading_rad
        north = sum(k * sin(one) for k, one in zip(weights, pair, strict=True))
        east = sum(k * cos(one) for k, one in zip(weights, pair, strict=True))
        heading_rad = atan2(north, east)
    return MotionStep(
        waiting.step_m + step.step_m,
        heading_rad,
        waiting.turn_rad + step.turn_rad,
        sampling_sd_m=hypot(waiting.sampling_sd_m, step.sampling_sd_m),
    )
