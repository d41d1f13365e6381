"""The contract of filters of beliefs: state in, state out, and what happened in ``info``.

A filter is a frozen object with four functions. ``predict`` and ``update`` are apart, because
inertial data, radio reports and GNSS fixes tick at different rates.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from math import isfinite
from typing import Any, Protocol, TypeVar

import numpy as np

from mapfilter._same import EqualByContent, EqualByValue
from mapfilter._types import Floats

PriorT = TypeVar("PriorT", contravariant=True)
BeliefT = TypeVar("BeliefT")
SecondT = TypeVar("SecondT")
ReadingT = TypeVar("ReadingT", contravariant=True)


class Status(StrEnum):
    """State of a filter at an epoch.

    ``SEARCHING`` → ``CONVERGED`` (the first epoch at which the switch rule holds) → ``TRACKING``;
    ``UNCERTAIN`` when a position is tracked, but not certain enough to be claimed; ``LOST`` when
    the evidence contradicts the belief; ``OUTSIDE`` when nothing on the map explains it: off the
    area, or in another network than the map's. No position is given then.
    """

    SEARCHING = "SEARCHING"
    CONVERGED = "CONVERGED"
    TRACKING = "TRACKING"
    UNCERTAIN = "UNCERTAIN"
    LOST = "LOST"
    OUTSIDE = "OUTSIDE"

    @property
    def is_followed(self) -> bool:
        """Whether one position is followed, claimed or not."""
        return self in (Status.CONVERGED, Status.TRACKING, Status.UNCERTAIN)


class Reason(StrEnum):
    """Why a reading was not used; ``USED`` when it was."""

    USED = "used"
    NOT_MOVED_ENOUGH = "not_moved_enough"
    NO_SERVING_CELL = "no_serving_cell"
    SECOND_SERVING_CELL = "second_serving_cell"
    UNKNOWN_CELL = "unknown_cell"
    NO_CELL = "no_cell"
    NO_POINTS_IN_CELL = "no_points_in_cell"
    NO_CANDIDATES_LEFT = "no_candidates_left"
    NO_HEADING = "no_heading"
    NO_STEP = "no_step"
    NO_READING = "no_reading"
    MOTION_MISSING = "motion_missing"
    MOTION_STUCK = "motion_stuck"
    HEADING_STUCK = "heading_stuck"
    IMPOSSIBLE_STEP = "impossible_step"
    PHONE_TURNED = "phone_turned"
    OTHER_UNIT = "other_unit"
    DELIVERED_TWICE = "delivered_twice"
    STALE_RADIO = "stale_radio"
    NOT_STARTED = "not_started"
    NOT_USED_BY_FILTER = "not_used_by_filter"
    AMBIGUOUS_CELL = "ambiguous_cell"
    UPDATE_FAILED = "update_failed"
    UNKNOWN_SATELLITE = "unknown_satellite"
    BELOW_HORIZON = "below_horizon"
    SECOND_READING = "second_reading"
    REJECTED_BY_EVIDENCE = "rejected_by_evidence"
    ON_PROBATION = "on_probation"
    REPEATED_FIX = "repeated_fix"


@dataclass(frozen=True, slots=True, eq=False)
class MotionStep(EqualByValue):
    """Dead reckoning over one interval.

    Parameters
    ----------
    step_m : float
        Distance moved, a_{t-1} = (trans, θ) of the paper.
    heading_rad : float
        Direction moved, counter-clockwise from grid east; NaN when there is no compass.
    turn_rad : float
        Change of heading over the interval; NaN when there is no gyroscope.
    spread_m : float
        Root mean square of the displacement, to all sides, of a step without heading; NaN for the
        distance itself.
    sampling_sd_m : float
        Deviation of the displacement, east as north, of a step that was made of velocities seconds
        apart; besides the errors that a filter assumes of every step.
    turned_sd_rad : float
        Deviation of a change of heading that was not measured, of a step to all sides; headings
        that turns add up to are unknown by it from there on.
    rows : float
        How many measured steps it is the sum of, each with errors of its own; of steps that are
        not equally long, how many such would have the same noise.
    """

    step_m: float
    heading_rad: float
    turn_rad: float = float("nan")
    spread_m: float = float("nan")
    sampling_sd_m: float = 0.0
    turned_sd_rad: float = 0.0
    rows: float = 1.0

    @property
    def is_undirected(self) -> bool:
        """Whether nothing is known of its direction, nor how far it leads to all sides."""
        return not (
            isfinite(self.heading_rad) or isfinite(self.turn_rad) or isfinite(self.spread_m)
        )

    @property
    def all_sides_m(self) -> float:
        """Root mean square of the displacement where there is no heading."""
        return self.spread_m if isfinite(self.spread_m) else abs(self.step_m)


@dataclass(frozen=True, slots=True, eq=False)
class Estimate(EqualByContent):
    """Position of a belief; NaN where the filter gives none.

    Parameters
    ----------
    east_m, north_m : float
        Mean position.
    covariance_m2 : (2, 2) array
        East, north.
    radii_m : (3,) array
        Radii about the mean that hold 50, 67 and 95 % of the belief.
    """

    east_m: float
    north_m: float
    covariance_m2: Floats
    radii_m: Floats


@dataclass(frozen=True, slots=True)
class UpdateInfo:
    """What an update did.

    Parameters
    ----------
    reason : Reason
        ``USED``, or why the reading was left alone.
    status : Status
        The filter's status after it.
    hypotheses : int
        How many position hypotheses the belief still holds.
    """

    reason: Reason
    status: Status
    hypotheses: int


class BeliefFilter(Protocol[PriorT, BeliefT, ReadingT]):
    """A filter of beliefs. All functions are pure: beliefs are never changed in place."""

    def init(self, prior: PriorT, rng: np.random.Generator) -> BeliefT:
        """Return the first belief."""

    def predict(
        self, belief: BeliefT, motion: MotionStep, rng: np.random.Generator
    ) -> tuple[BeliefT, Reason]:
        """Move the belief by one interval of dead reckoning; return why if it was not used."""

    def update(
        self, belief: BeliefT, reading: ReadingT, rng: np.random.Generator
    ) -> tuple[BeliefT, UpdateInfo]:
        """Update the belief with one reading."""

    def locate(self, belief: BeliefT) -> Estimate:
        """Return the position of the belief."""


PLACE_SHAPES = {"east_m": (), "north_m": (), "covariance_m2": (2, 2), "radii_m": (3,)}
"""Shapes of the fields that hold a position."""


class ReturnTypeError(TypeError):
    """A function of a filter returned something else than its contract says.

    Parameters
    ----------
    function : str
        Its name.
    expected, got : str
        What it has to return, and what it did.
    """

    def __init__(self, function: str, expected: str, got: str) -> None:
        self.function, self.expected, self.got = function, expected, got
        super().__init__(f"{function} returns {expected}, not {got}")


def checked_pair(
    returned: Any, function: str, first: str, second: type[SecondT]
) -> tuple[Any, SecondT]:
    """Return what a function of a filter returned, where it is a pair of which the second is typed.

    Parameters
    ----------
    first : str
        What the first one is called.

    Raises
    ------
    ReturnTypeError
        It is no pair, or the second is of another type.
    """
    is_pair = isinstance(returned, tuple | list) and len(returned) == 2
    if is_pair and isinstance(returned[1], second):
        return returned[0], returned[1]
    got = f"({first}, {_type_name(returned[1])})" if is_pair else _type_name(returned)
    raise ReturnTypeError(function, f"({first}, {second.__name__})", got)


def check_kinds(function: str, status: object, reason: object) -> None:
    """Check the status and the reason that a function of a filter returned: texts are neither.

    Raises
    ------
    ReturnTypeError
        One of them is of another type.
    """
    for value, kind in ((status, Status), (reason, Reason)):
        if not isinstance(value, kind):
            raise ReturnTypeError(function, f"a {kind.__name__}", repr(value)[:40])


def checked_estimate(returned: Any) -> Estimate:
    """Return what ``locate`` returned; ReturnTypeError where it is no estimate."""
    if isinstance(returned, Estimate):
        return returned
    raise ReturnTypeError("locate", "Estimate", _type_name(returned))


def check_shapes(function: str, returned: Any, shapes: Mapping[str, tuple[int, ...]]) -> None:
    """Check that what a function of a filter returned holds numbers, in arrays of some shapes.

    Parameters
    ----------
    shapes : mapping of str to tuple of int
        By field; () for a single number.

    Raises
    ------
    ReturnTypeError
        A field holds something else.
    """
    for name, shape in shapes.items():
        value = getattr(returned, name)
        try:
            # NumPy reads texts of digits as numbers, and None as NaN.
            is_other = value is None or np.asarray(value).dtype.kind in "US"
            found = None if is_other else np.asarray(value, dtype=np.float64).shape
        except (TypeError, ValueError):
            found = None
        if found != shape:
            expected = f"{name} of shape {shape}" if shape else f"{name} as a number"
            raise ReturnTypeError(
                function, expected, _type_name(value) if found is None else f"shape {found}"
            )


def _type_name(value: object) -> str:
    return "None" if value is None else type(value).__name__
