"""Options of dead reckoning from the sensors of a phone."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, fields
from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le, Lt

from mapfilter.options import Options, Positive

Pose = Literal["auto", "device", "any"]
"""What the direction of walking is taken from."""

_OF_COMMANDS = {
    "pose": "--pose",
    "declination_deg": "--declination",
    "step_m": "--step-length",
}
STEP_FACTOR = 0.405
"""Weinberg's factor: metres by the fourth root of m/s²; of the walks in ``docs/howto/raw-imu``."""

COUNTED_M = 0.7
"""Usual length of a step."""


@dataclass(frozen=True, slots=True)
class WalkOptions(Options):
    """How steps and headings are made of the sensors of a phone.

    Parameters
    ----------
    pose : {"auto", "device", "any"}
        Direction of walking, seen from the phone: its top edge or, held upright, its back
        ("device"); the direction in which the steps accelerate it ("any", in a pocket or a bag);
        the first where both agree within 40 degrees, else the second ("auto").
    declination_deg : float or None
        Magnetic declination of the place: how far east of true north the compass points. Where
        it is not given, magnetic north is taken for true north, with an error of 8 degrees.
    field_ut : float
        Size of the magnetic field of the place; 0 for the median of the recording.
    step_factor : float
        Length of a step by the fourth root of its vertical acceleration's range in m/s².
    step_m : float or None
        Mean length of a step. Lengths by the accelerometer are scaled to it; steps that a phone
        only counts are 0.7 m where it is not given.
    """

    pose: Pose = "auto"
    declination_deg: Annotated[float, Ge(-180), Le(180)] | None = None
    field_ut: Annotated[float, Ge(0), Le(100)] = 0.0
    step_factor: Positive = STEP_FACTOR
    step_m: Annotated[float, Gt(0), Lt(3)] | None = None

    @property
    def counted_m(self) -> float:
        """Length of a step that a phone only counts."""
        return COUNTED_M if self.step_m is None else self.step_m


def without_effect(options: WalkOptions, used: Collection[str], why: str) -> tuple[str, ...]:
    """Return a note on each option that is not at its default, and is not used.

    Parameters
    ----------
    used : collection of str
        Names of the options that had an effect.
    why : str
        What the motion is made of instead.

    Examples
    --------
    >>> without_effect(WalkOptions(step_m=0.8), (), "motion is that of walk.csv")
    ('step_m = 0.8 (--step-length) has no effect: motion is that of walk.csv',)
    """
    found = []
    for field in fields(WalkOptions):
        value = getattr(options, field.name)
        if field.name in used or value == field.default:
            continue
        shown = f"{value:g}" if isinstance(value, float) else str(value)
        option = f" ({_OF_COMMANDS[field.name]})" if field.name in _OF_COMMANDS else ""
        found.append(f"{field.name} = {shown}{option} has no effect: {why}")
    return tuple(found)
