"""Filters over beliefs as filters over epochs: when to start, what to take, what to report."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import nan
from typing import Any

import numpy as np

from mapfilter._same import EqualByValue
from mapfilter.database.nearest import CellPointIndex
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.filters.contract import (
    BeliefFilter,
    Estimate,
    Reason,
    Status,
    UpdateInfo,
    check_kinds,
    checked_estimate,
    checked_pair,
)
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.filter import ALL_KINDS, Filter, Kind
from mapfilter.positioning.step_arguments import check_step
from mapfilter.positioning.step_output import Fix, StepOutput, UnusedReading
from mapfilter.tracks.schema import SERVING

_SILENT = (Reason.USED, Reason.NOT_MOVED_ENOUGH)


@dataclass(frozen=True, slots=True, eq=False)
class TrackState(EqualByValue):
    """State of a journey.

    Parameters
    ----------
    belief : object or None
        Of the filter; None before the first epoch that it can start from.
    hypotheses : int
        Position hypotheses after the last update.
    time_s : float
        Time of the last epoch; NaN before the first.
    """

    belief: Any = None
    status: Status = Status.SEARCHING
    hypotheses: int = 0
    time_s: float = nan


@dataclass(frozen=True, eq=False, repr=False)
class BeliefTracker(Filter[TrackState]):
    """A :class:`mapfilter.filters.contract.BeliefFilter` over epochs.

    It starts at the first epoch whose serving cell has points (or, where ``start_by_fix``, that
    has a GNSS fix): that epoch is the prior, and the first one to update with. What was travelled
    before is not motion of the hypotheses.

    Parameters
    ----------
    known : callable
        Returns USED for a cell with points, else why the filter cannot start from it.
    reading_of : callable
        Returns what the filter's ``init`` and ``update`` take of an epoch, or None.
    takes : collection of str
        Kinds of measurements that the filter takes.
    ways : bool
        Whether positions are matched to the way of the nearest point.
    """

    filter: BeliefFilter[Any, Any, Any]
    database: RadioRouteDatabase
    known: Callable[[str], Reason]
    reading_of: Callable[[Epoch], Any]
    filter_name: str
    takes: Collection[Kind] = ALL_KINDS
    start_by_fix: bool = False
    ways: bool = True

    @property
    def name(self) -> str:
        """Name of the filter."""
        return self.filter_name

    @property
    def crs(self) -> str:
        """CRS of the database."""
        return self.database.lattice.crs

    @property
    def uses(self) -> Collection[Kind]:
        """Kinds of measurements that it takes."""
        return self.takes

    def begin(self, kinds: Collection[Kind] = ALL_KINDS) -> TrackState:  # noqa: ARG002
        """Return the state before the first epoch."""
        return TrackState()

    def warm_up(self, merged: Sequence[Epoch]) -> None:  # noqa: ARG002
        """Read the points that positions are matched to."""
        if self.ways:
            _ = self._points

    def step(
        self, state: TrackState, epoch: Epoch, rng: np.random.Generator
    ) -> tuple[TrackState, StepOutput]:
        """Take one epoch: first move, then measure.

        Raises
        ------
        InputError
            A value of the epoch is of another type or beyond its range, it is before the last one,
            the state is one of another filter, or ``rng`` is no generator.
        """
        check_step(state, TrackState, epoch, rng)
        cell, reason, unused = self._serving(epoch)
        belief, status, count = state.belief, state.status, state.hypotheses
        if belief is None:
            unused += [_unused(epoch, "motion", "", Reason.NOT_STARTED) for _ in epoch.motion]
            by_fix = self.start_by_fix and epoch.gnss is not None
            if reason is not Reason.USED and not by_fix:
                if cell:
                    unused.append(_unused(epoch, SERVING, cell, reason))
                return replace(state, time_s=epoch.time_s), StepOutput(
                    Fix.nowhere(epoch.time_s, status, reason), unused=tuple(unused)
                )
            belief = self.filter.init(self.reading_of(epoch), rng)
        else:
            for motion in epoch.motion:
                returned = self.filter.predict(belief, motion, rng)
                belief, moved = checked_pair(returned, "predict", "belief", Reason)
                if moved is not Reason.USED:
                    unused.append(_unused(epoch, "motion", "", moved))
        reading = self.reading_of(epoch)
        if reading is not None:
            updated = self.filter.update(belief, reading, rng)
            belief, info = checked_pair(updated, "update", "belief", UpdateInfo)
            check_kinds("update", info.status, info.reason)
            status, count, reason = info.status, info.hypotheses, info.reason
            label = _unused(epoch, SERVING, cell, reason)
            if reason not in _SILENT and label not in unused:
                unused.append(label)
        elif status is Status.CONVERGED:
            # CONVERGED lasts one epoch, also where the next one has no measurement.
            status = Status.TRACKING
        located = checked_estimate(self.filter.locate(belief))
        fix = self._fix(epoch, located, status, count, reason)
        after = TrackState(belief, status, count, epoch.time_s)
        return after, StepOutput(fix, unused=tuple(unused))

    def _serving(self, epoch: Epoch) -> tuple[str, Reason, list[UnusedReading]]:
        """Return the serving cell, whether the filter can start from it, and what is left out."""
        if not epoch.radio:
            return "", Reason.NO_READING, []
        named = [row.cell for row in epoch.radio if row.role == SERVING and row.cell is not None]
        if not named:
            why = Reason.NO_SERVING_CELL
            return "", why, [_unused(epoch, SERVING, "", why)]
        more = [_unused(epoch, SERVING, cell, Reason.SECOND_SERVING_CELL) for cell in named[1:]]
        return named[0], self.known(named[0]), more

    def _fix(
        self, epoch: Epoch, located: Estimate, status: Status, count: int, reason: Reason
    ) -> Fix:
        fix = Fix(
            epoch.time_s,
            float(located.east_m),
            float(located.north_m),
            np.asarray(located.covariance_m2, dtype=np.float64).reshape(2, 2),
            np.asarray(located.radii_m, dtype=np.float64).reshape(3),
            status,
            count,
            nan,
            0,
            nan,
            reason,
        )
        if not self.ways:
            return fix
        index, way_id = self._points
        nearest, _ = index.nearest([fix.east_m], [fix.north_m])
        point = int(nearest[0])
        return replace(fix, way_id=int(way_id[point])) if point >= 0 else fix

    @cached_property
    def _points(self) -> tuple[CellPointIndex, Any]:
        points = self.database.points()
        return CellPointIndex.of_points(
            self.database.lattice, points.row, points.col
        ), points.way_id


def _unused(epoch: Epoch, kind: str, what: str, reason: Reason) -> UnusedReading:
    return UnusedReading(epoch.time_s, kind, what, reason)
