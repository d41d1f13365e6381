"""The candidate filter: global positioning and tracking as in Khalaf-Allah (2007), Tables 2 and 3.

The belief is a set of position candidates. It starts as all points of the serving cell's database
(Table 2, line 4). Each update moves all candidates by the dead reckoning since the last one,
matches each to the nearest point of the current serving cell and keeps it if that point is at most
the database's resolution away (lines 9–18). When few enough are left, their mean is the position
(lines 21–24), and from then on the one position is moved and matched to the nearest point, however
far (Table 3).

The paper leaves several things open; each is a field of
:class:`mapfilter.filters.candidate.CandidateOptions`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import IntEnum
from math import cos, isfinite, nan, sin
from typing import Annotated, Literal, Protocol

import numpy as np
from annotated_types import Ge

from mapfilter._same import EqualByValue
from mapfilter._types import Floats, Ints
from mapfilter.filters.contract import Estimate, MotionStep, Reason, Status, UpdateInfo
from mapfilter.options import NotNegative, Options

_UNKNOWN_COVARIANCE_M2: Floats = np.full((2, 2), nan)
_UNKNOWN_RADII_M: Floats = np.full(3, nan)


@dataclass(frozen=True, slots=True)
class CandidateOptions(Options):
    """Readings of what the paper leaves open.

    Parameters
    ----------
    update_length_m : float
        Distance after which candidates are updated (line 8). The paper uses ``DB_res``; 0 updates
        at every step. On a 5 m lattice steps of 1.4 m snap back to the point they came from; about
        22 m fit the paper's Fig. 5 best.
    tracking_length_m : float or None
        The same for Table 3, which as printed matches at every step (0); by default
        ``update_length_m``.
    prediction : {"last_heading", "displacement"}
        Line 10 projects the whole travelled distance along the last heading, as printed;
        "displacement" adds up the steps as vectors.
    duplicates : {"set", "list"}
        Whether candidates matched to the same point become one.
    threshold : int
        α of Table 2: the filter switches when no more candidates are left. With a set 1, with a
        list about 10.
    at_threshold : {"switch", "stall"}
        n = α is covered by neither branch of Table 2: the filter switches, or, as printed, stalls.
    switch_check : {"next_call", "same_call"}
        As printed, Table 2 checks the number of candidates at the next call and discards the motion
        of that call, such as 22 m; "same_call" checks right after the update, which alone gives
        errors as small as the paper's Table 4.
    when_empty : {"fail", "reinitialise"}
        With no candidate left the run has failed, or starts again from the serving cell's points.
    """

    update_length_m: NotNegative = 22.0
    tracking_length_m: NotNegative | None = None
    prediction: Literal["last_heading", "displacement"] = "displacement"
    duplicates: Literal["set", "list"] = "set"
    threshold: Annotated[int, Ge(1)] = 1
    at_threshold: Literal["switch", "stall"] = "switch"
    switch_check: Literal["next_call", "same_call"] = "same_call"
    when_empty: Literal["fail", "reinitialise"] = "fail"


class PointSet(Protocol):
    """The points of one cell, in the database's order.

    ``nearest`` returns, for N positions, the indices of the exactly nearest points (-1 where none
    is within ``max_distance_m``) and their distances. Of equally near points the *last* one is
    taken, as the ascending sort of Table 2, line 14 and Table 3, line 8 leaves it. A position that
    hits a point has an infinite weight 1/distance and matches it.
    """

    @property
    def east_m(self) -> Floats:
        """East of the points, shape (q,)."""

    @property
    def north_m(self) -> Floats:
        """North of the points, shape (q,)."""

    def nearest(
        self, east_m: Floats, north_m: Floats, max_distance_m: float
    ) -> tuple[Ints, Floats]:
        """Return (indices (N,), distances in metres (N,))."""


class Mode(IntEnum):
    """``Mode`` of Table 2, and what is left when all candidates are gone."""

    GLOBAL_POSITIONING = 0
    POSITION_TRACKING = 1
    FAILED = 2


@dataclass(frozen=True, slots=True, eq=False)
class CandidateBelief(EqualByValue):
    """Candidates and the motion since they were last matched.

    Parameters
    ----------
    mode : Mode
        Searching, tracking or failed.
    east_m, north_m : (n,) arrays
        Candidates when last matched; one when tracking.
    travelled_m : float
        Sum of the step lengths since then (``trvld_dist``).
    shift_east_m, shift_north_m : float
        Sum of the steps as vectors since then.
    heading_rad : float
        Last heading.
    """

    mode: Mode
    east_m: Floats
    north_m: Floats
    travelled_m: float = 0.0
    shift_east_m: float = 0.0
    shift_north_m: float = 0.0
    heading_rad: float = nan


@dataclass(frozen=True, slots=True)
class CandidateSearch:
    """Tables 2 and 3 of Khalaf-Allah (2007), as a filter of the common contract.

    The prior and each reading are the name of the serving cell.

    Parameters
    ----------
    points_of : callable
        Returns the points of a cell, or None for a cell that is not in the database.
    options : CandidateOptions
        The reading of the paper.
    resolution_m : float
        ``DB_res`` of the paper: a candidate survives if its match is at most this far away
        (line 15).
    """

    points_of: Callable[[str], PointSet | None]
    options: CandidateOptions = field(default_factory=CandidateOptions)
    resolution_m: float = 5.0

    def init(self, prior: str, rng: np.random.Generator) -> CandidateBelief:  # noqa: ARG002
        """Return all points of the first serving cell as candidates (Table 2, lines 2 and 4)."""
        return self._restart(self.points_of(prior))

    def predict(
        self,
        belief: CandidateBelief,
        motion: MotionStep,
        rng: np.random.Generator,  # noqa: ARG002
    ) -> tuple[CandidateBelief, Reason]:
        """Add one step to the motion since the last match (line 7; eqs. 3, 4, 9, 10)."""
        step_m, heading_rad = motion.step_m, motion.heading_rad
        if not isfinite(step_m):
            return belief, Reason.NO_STEP
        if not isfinite(heading_rad):
            return belief, Reason.NO_HEADING
        moved = replace(
            belief,
            # Line 7 takes the length of the vector: a noisy step below zero counts as positive.
            travelled_m=belief.travelled_m + abs(step_m),
            shift_east_m=belief.shift_east_m + step_m * cos(heading_rad),
            shift_north_m=belief.shift_north_m + step_m * sin(heading_rad),
            heading_rad=heading_rad,
        )
        return moved, Reason.USED

    def update(
        self,
        belief: CandidateBelief,
        reading: str,
        rng: np.random.Generator,  # noqa: ARG002
    ) -> tuple[CandidateBelief, UpdateInfo]:
        """Run one call of Table 2 (or 3) with the cell that serves now."""
        points = self.points_of(reading)
        if belief.mode is Mode.FAILED and self.options.when_empty == "fail":
            return belief, _info(belief, Reason.NO_CANDIDATES_LEFT)
        if points is None:
            return belief, _info(belief, Reason.UNKNOWN_CELL)
        if points.east_m.size == 0:
            return belief, _info(belief, Reason.NO_POINTS_IN_CELL)
        if belief.mode is Mode.POSITION_TRACKING:
            return self._track(belief, points)
        return self._search(belief, points)

    def locate(self, belief: CandidateBelief) -> Estimate:
        """Return the position; only when tracking, as in the paper (section 4.2).

        Between matches the last matched position is moved by the steps since. The algorithm holds
        no probabilities, so covariance and radii are NaN.
        """
        if belief.mode is not Mode.POSITION_TRACKING:
            return Estimate(nan, nan, _UNKNOWN_COVARIANCE_M2, _UNKNOWN_RADII_M)
        return Estimate(
            float(belief.east_m[0]) + belief.shift_east_m,
            float(belief.north_m[0]) + belief.shift_north_m,
            _UNKNOWN_COVARIANCE_M2,
            _UNKNOWN_RADII_M,
        )

    def _restart(self, points: PointSet | None) -> CandidateBelief:
        if points is None or points.east_m.size == 0:
            return CandidateBelief(Mode.FAILED, np.empty(0), np.empty(0))
        return CandidateBelief(Mode.GLOBAL_POSITIONING, points.east_m, points.north_m)

    def _search(
        self, belief: CandidateBelief, points: PointSet
    ) -> tuple[CandidateBelief, UpdateInfo]:
        options = self.options
        if belief.mode is Mode.FAILED:
            restarted = self._restart(points)
            return restarted, _info(restarted, Reason.USED)
        if self._few_left(belief):
            switched = _switch(belief)
            return switched, _info(switched, Reason.USED, converged=True)
        if belief.east_m.size <= options.threshold:
            return belief, _info(belief, Reason.USED)
        if belief.travelled_m < options.update_length_m:
            return belief, _info(belief, Reason.NOT_MOVED_ENOUGH)
        shift_east_m, shift_north_m = self._shift(belief)
        matched, _ = points.nearest(
            belief.east_m + shift_east_m, belief.north_m + shift_north_m, self.resolution_m
        )
        matched = matched[matched >= 0]
        if options.duplicates == "set":
            matched = np.unique(matched)
        mode = Mode.GLOBAL_POSITIONING if matched.size else Mode.FAILED
        updated = CandidateBelief(
            mode, points.east_m[matched], points.north_m[matched], heading_rad=belief.heading_rad
        )
        if mode is Mode.FAILED:
            if options.when_empty == "reinitialise":
                updated = self._restart(points)
            return updated, _info(updated, Reason.USED)
        if options.switch_check == "same_call" and self._few_left(updated):
            updated = _switch(updated)
            return updated, _info(updated, Reason.USED, converged=True)
        return updated, _info(updated, Reason.USED)

    def _track(
        self, belief: CandidateBelief, points: PointSet
    ) -> tuple[CandidateBelief, UpdateInfo]:
        """Move and match the one position (Table 3, lines 4–9).

        In Table 3 each step moves by its own signed length along its own heading, so steps between
        two matches add up as vectors.
        """
        length_m = self.options.tracking_length_m
        if belief.travelled_m < (self.options.update_length_m if length_m is None else length_m):
            return belief, _info(belief, Reason.NOT_MOVED_ENOUGH)
        matched, _ = points.nearest(
            belief.east_m + belief.shift_east_m, belief.north_m + belief.shift_north_m, np.inf
        )
        tracked = CandidateBelief(
            belief.mode,
            points.east_m[matched],
            points.north_m[matched],
            heading_rad=belief.heading_rad,
        )
        return tracked, _info(tracked, Reason.USED)

    def _few_left(self, belief: CandidateBelief) -> bool:
        """Return whether the switch rule of lines 6 and 21 holds."""
        count = belief.east_m.size
        if self.options.at_threshold == "switch":
            return count <= self.options.threshold
        return count < self.options.threshold

    def _shift(self, belief: CandidateBelief) -> tuple[float, float]:
        """Return how far the prediction moves candidates (Table 2, line 10)."""
        # Standing still there is no heading yet, and nothing to project along it.
        if self.options.prediction == "displacement" or belief.travelled_m == 0:
            return belief.shift_east_m, belief.shift_north_m
        return (
            belief.travelled_m * cos(belief.heading_rad),
            belief.travelled_m * sin(belief.heading_rad),
        )


def _switch(belief: CandidateBelief) -> CandidateBelief:
    """Go over to tracking from the mean of the candidates (Table 2, lines 21–24)."""
    return CandidateBelief(
        Mode.POSITION_TRACKING,
        np.array([belief.east_m.mean()]),
        np.array([belief.north_m.mean()]),
        heading_rad=belief.heading_rad,
    )


def _info(belief: CandidateBelief, reason: Reason, *, converged: bool = False) -> UpdateInfo:
    if converged:
        status = Status.CONVERGED
    elif belief.mode is Mode.POSITION_TRACKING:
        status = Status.TRACKING
    else:
        status = Status.SEARCHING if belief.mode is Mode.GLOBAL_POSITIONING else Status.LOST
    return UpdateInfo(reason, status, int(belief.east_m.size))
