"""How a phone is held: how its headings are read, and the unit of its steps."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, radians

from mapfilter.angles import wrap_one_rad, wrap_rad
from mapfilter.filters.contract import MotionStep

_USUAL_RAD = radians(30.0)


@dataclass(frozen=True, slots=True)
class Hold:
    """How motion is read: the sign of headings, the angle that is added, the unit of steps in m."""

    sign: float = 1.0
    offset_rad: float = 0.0
    step_unit_m: float = 1.0

    def read(self, step: MotionStep) -> MotionStep:
        """Return a step with the length and the direction that it stands for."""
        if self.step_unit_m != 1.0:
            unit_m = self.step_unit_m
            step = MotionStep(
                unit_m * step.step_m,
                step.heading_rad,
                step.turn_rad,
                unit_m * step.spread_m,
                unit_m * step.sampling_sd_m,
                step.turned_sd_rad,
                step.rows,
            )
        if self.is_as_measured or not isfinite(step.heading_rad):
            return step
        direction_rad = self.direction_rad(step.heading_rad)
        return MotionStep(
            step.step_m,
            direction_rad,
            self.sign * step.turn_rad,
            step.spread_m,
            step.sampling_sd_m,
            step.turned_sd_rad,
            step.rows,
        )

    def direction_rad(self, heading_rad: float) -> float:
        """Return the direction that a heading stands for."""
        return wrap_one_rad(self.sign * heading_rad + self.offset_rad)

    @property
    def is_as_measured(self) -> bool:
        """Whether headings are read as they are, whatever the unit of steps."""
        return self.sign == 1.0 and self.offset_rad == 0.0

    @property
    def is_usual(self) -> bool:
        """Whether headings are read nearly as they are."""
        return self.sign > 0 and abs(self.offset_rad) < _USUAL_RAD

    def turned_by(self, angle_rad: float) -> Hold:
        """Return how headings are read whose directions are turned further by an angle."""
        offset_rad = float(wrap_rad(self.offset_rad + angle_rad))
        return Hold(self.sign, offset_rad, self.step_unit_m)

    def straight_on(self, before_rad: float, after_rad: float) -> tuple[Hold, Hold]:
        """Return how headings are read of a phone that was turned, or mirrored, on a straight walk.

        Parameters
        ----------
        before_rad, after_rad : float
            Headings as measured, of the rows before and after.

        Examples
        --------
        >>> turned, mirrored = Hold().straight_on(0.5, -2.5)
        >>> turned.direction_rad(-2.5), mirrored.direction_rad(-2.5)
        (0.5, 0.5)
        >>> f"{turned.direction_rad(-2.4):.1f}, {mirrored.direction_rad(-2.4):.1f}"
        '0.6, 0.4'
        """
        ahead_rad, sign = self.direction_rad(before_rad), self.sign
        unit_m = self.step_unit_m
        turned = Hold(sign, float(wrap_rad(ahead_rad - sign * after_rad)), unit_m)
        return turned, Hold(-sign, float(wrap_rad(ahead_rad + sign * after_rad)), unit_m)

    def mirrored_at(self, heading_rad: float) -> Hold:
        """Return how headings are read of a phone that has been mirrored since some heading.

        As that is along an axis of the mirror, nothing has changed so far: turns will.

        Examples
        --------
        >>> f"{Hold().mirrored_at(0.5).direction_rad(0.9):.1f}"
        '0.1'
        """
        ahead_rad, sign = self.direction_rad(heading_rad), self.sign
        offset_rad = float(wrap_rad(ahead_rad + sign * heading_rad))
        return Hold(-sign, offset_rad, self.step_unit_m)
