"""Kalman-type filters over a log: GNSS fixes, timing advances, levels and dead reckoning.

No map is needed, only the sites. With dead reckoning the state is the position, moved by each step;
without, it is position and velocity, and motion is that of constant velocity with white
acceleration. A start without a fix is a Gaussian sum: one Gaussian over a kilometre goes astray.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.filters.gaussian import METHODS, Method
from mapfilter.models.state import MOVING
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.filter import ALL_KINDS, Filter, Kind, check_over
from mapfilter.positioning.kalman.belief import FusionHistory
from mapfilter.positioning.kalman.lasting import extended_layout
from mapfilter.positioning.kalman.level_errors import MOST_CELLS, CellSlots, with_levels
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.positioning.kalman.place import place_of
from mapfilter.positioning.kalman.reckoning import RECKONED
from mapfilter.positioning.kalman.state import KalmanState
from mapfilter.positioning.kalman.step import KalmanStep
from mapfilter.positioning.step_arguments import check_kinds_given, check_step
from mapfilter.positioning.step_output import StepOutput
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cells import CellPlan


@dataclass(frozen=True, slots=True)
class KalmanFilter(KalmanOptions):
    """A Kalman-type filter over GNSS fixes, timing advances, levels and dead reckoning.

    It needs no map, only the sites of the cells. Further parameters are those of
    :class:`mapfilter.positioning.kalman.models.KalmanOptions`.

    Parameters
    ----------
    method : str
        Extended (EKF), iterated (IEKF), unscented (UKF), cubature (CKF) or Rao-Blackwellised
        unscented Kalman filter (RBUKF).
    smooth : bool
        Whether positions are smoothed by the whole log (Rauch-Tung-Striebel).
    """

    method: Literal["ekf", "iekf", "rbukf", "ukf", "ckf"] = "ekf"
    smooth: bool = False

    @property
    def name(self) -> str:
        """The filter's name."""
        return self.method

    def over(self, database: RadioRouteDatabase, *, ways: bool = True) -> KalmanTracker:  # noqa: ARG002
        """Return the filter over the sites of a database."""
        check_over(self, database)
        return self.over_sites(database.plan)

    def over_sites(
        self, plan: CellPlan, antennas: Mapping[str, MeasuredAntenna] | None = None
    ) -> KalmanTracker:
        """Return the filter over the sites of a cell plan, with the antennas that cells name."""
        sites = SiteModels(plan, self, antennas)
        return KalmanTracker(sites, METHODS[self.method], self.smooth)


@dataclass(frozen=True, eq=False, repr=False)
class KalmanTracker(Filter[KalmanState]):
    """A Kalman-type filter over the sites of a cell plan."""

    sites: SiteModels
    method: Method
    smooth: bool = False

    @property
    def name(self) -> str:
        """The filter's name."""
        return self.method.name

    @property
    def crs(self) -> str:
        """CRS of the sites."""
        return self.sites.plan.crs

    @property
    def uses(self) -> Collection[Kind]:
        """Kinds of measurements that it takes."""
        return ("motion", "serving", "neighbour", "gnss")

    @property
    def made_of(self) -> KalmanOptions:
        """Options that it was made of."""
        return self.sites.options

    def with_options(self, options: KalmanOptions) -> KalmanTracker:
        """Return the filter by other options over the same sites."""
        return replace(self, sites=SiteModels(self.sites.plan, options, self.sites.antennas))

    def begin(self, kinds: Collection[Kind] = ALL_KINDS) -> KalmanState:
        """Return the state before the first epoch; InputError for a kind that is none."""
        check_kinds_given(kinds)
        layout = RECKONED if "motion" in kinds else MOVING
        if self.sites.options.has_lasting_fixes:
            layout = extended_layout(layout)
        heard = {"serving", "neighbour"}.intersection(kinds)
        slots = CellSlots.empty(min(MOST_CELLS, len(self.sites.cells)) if heard else 0)
        return KalmanState(with_levels(layout, slots), slots=slots)

    def step(
        self,
        state: KalmanState,
        epoch: Epoch,
        rng: np.random.Generator,
    ) -> tuple[KalmanState, StepOutput]:
        """Take one epoch: first move, then measure; there are no random numbers in it.

        Raises
        ------
        InputError
            A value of the epoch is of another type or beyond its range, it is before the last one,
            the state is one of another filter, or ``rng`` is no generator.
        """
        check_step(state, KalmanState, epoch, rng)
        work = KalmanStep(self.sites, self.method, state)
        output = StepOutput(work.take(epoch), unused=tuple(work.unused))
        return work.state, output.protected(work.tail)

    def smoother(self) -> KalmanSmoother | None:
        """Return a new smoother where positions shall be smoothed."""
        return KalmanSmoother() if self.smooth else None


@dataclass(eq=False)
class KalmanSmoother:
    """Smooths each part of the Gaussian sum (Rauch-Tung-Striebel)."""

    history: FusionHistory = field(default_factory=FusionHistory)
    where: list[int] = field(default_factory=list)

    def add(self, before: KalmanState, after: KalmanState) -> None:  # noqa: ARG002
        """Record the state after an epoch, and the motion that led to it."""
        if after.belief is not None and after.motion is not None:
            self.where = [after.layout.east, after.layout.north]
            self.history.add(after.belief, *after.motion)

    def smoothed(
        self,
        estimate: TrackEstimate,
        rng: np.random.Generator,  # noqa: ARG002
    ) -> TrackEstimate:
        """Replace the positions since the start by smoothed ones; statuses stay."""
        later = self.history.smoothed()
        first = len(estimate) - len(later)
        fixes = [estimate.fix(index) for index in range(len(estimate))]
        fixes[first:] = [
            replace(fix, **place_of(belief, self.where))
            for fix, belief in zip(fixes[first:], later, strict=True)
        ]
        return TrackEstimate.of_fixes(
            estimate.crs,
            estimate.filter,
            fixes,
            start_utc_s=estimate.start_utc_s,
            unused=estimate.unused,
        )
