"""Global positioning by the Bayes map filter, one epoch after another, live or in replay.

:meth:`BayesPositioner.step` moves the beliefs by dead reckoning, asks each source of evidence
(:mod:`mapfilter.positioning.bayes.sources.evidence`) for the epoch's log-likelihood terms, starts a
belief or weighs it with them, and reports. Equal epochs and seeds give equal bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from mapfilter._changes import changed
from mapfilter._device import PROCESSOR, Device
from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.particle import ParticleOptions
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.beginning import begun_at
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.beliefs.moving import moved
from mapfilter.positioning.bayes.beliefs.smoothing import BayesSmoother
from mapfilter.positioning.bayes.carriageways import CarriagewayFilters
from mapfilter.positioning.bayes.claims import judged, tracked
from mapfilter.positioning.bayes.doubted import doubted
from mapfilter.positioning.bayes.maker import Maker
from mapfilter.positioning.bayes.outputs import step_output
from mapfilter.positioning.bayes.rivals.alternative import AlternativeRules
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules, PullRules
from mapfilter.positioning.bayes.rivals.transitions import report
from mapfilter.positioning.bayes.sources.evidence import EvidenceSource, EvidenceUpdate
from mapfilter.positioning.bayes.sources.map_source import MapSource
from mapfilter.positioning.bayes.sources.radio import RadioSource
from mapfilter.positioning.bayes.sources.timing import TimingSource
from mapfilter.positioning.bayes.sources.usable import UsableEpoch, usable_epoch
from mapfilter.positioning.bayes.state import BayesState, belief_here, check_state
from mapfilter.positioning.bayes.waiting import report_alone, waits
from mapfilter.positioning.bayes.warm_up import run_kernels
from mapfilter.positioning.bayes.weighing import Weighing
from mapfilter.positioning.epoch_checks import check_epoch
from mapfilter.positioning.epochs import Epoch, serving_cell
from mapfilter.positioning.filter import ALL_KINDS, Filter, Hypotheses, Kind
from mapfilter.positioning.gnss.options import GnssOptions, TimingOptions
from mapfilter.positioning.gnss.source import FirstFix, FixSource, GnssSource, gnss_of
from mapfilter.positioning.known_start import check_start
from mapfilter.positioning.sensors.pace import DRIVEN, Pace
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.step_arguments import check_generator, check_kinds_given, check_later
from mapfilter.positioning.step_output import StepOutput, UnusedReading

_POSITIONS = frozenset[Kind]({"gnss", "pseudorange"})
_TOLD_ELSEWHERE = (Reason.USED, Reason.NOT_MOVED_ENOUGH, Reason.NO_READING, Reason.STALE_RADIO)


@dataclass(frozen=True, repr=False)
class BayesPositioner(Filter[BayesState]):
    """The map filter over an area.

    ``grid`` replaces particles by the exact filter on a grid; ``smooth`` smooths positions by the
    whole log. ``more_sources`` are sources of evidence besides the built-in ones. ``positioned``
    holds the options and rules that take the place of the others as long as positions or satellites
    are measured; None for the same ones. ``carriageways`` locate a vehicle as long as nothing but
    its turns and the map do. ``holds`` says when a phone may have been turned. ``scored`` is
    whether outputs leave out what scores do not need. Masses on a grid lie on ``device``. ``maker``
    made it of options.
    """

    model: BayesModel
    options: ParticleOptions = field(default_factory=ParticleOptions)
    rules: AlternativeRules = field(default_factory=AlternativeRules)
    grid: bool = False
    satellites: GnssOptions = field(default_factory=GnssOptions)
    timing: TimingOptions = field(default_factory=TimingOptions)
    smooth: bool = False
    more_sources: tuple[EvidenceSource, ...] = ()
    positioned: tuple[ParticleOptions, AlternativeRules] | None = None
    carriageways: CarriagewayFilters | None = None
    holds: HoldRules = field(default_factory=HoldRules)
    pulls: PullRules = field(default_factory=PullRules)
    scored: bool = False
    device: Device = PROCESSOR
    maker: Maker | None = field(default=None, compare=False, repr=False)

    @property
    def made_of(self) -> Any:
        """Options that it was made of; None where it was made by hand."""
        return None if self.maker is None else self.maker.options

    def with_options(self, options: Any) -> BayesPositioner:
        """Return the filter by other options over the same area."""
        return self if self.maker is None else self.maker.remade(self, options)

    @property
    def crs(self) -> str:
        """CRS of the area."""
        return self.area.lattice.crs

    @property
    def area(self) -> AreaFrame:
        """Map of the area."""
        return self.model.area

    @property
    def name(self) -> str:
        """Name of the filter."""
        return "grid" if self.grid else "bayes"

    @property
    def uses(self) -> frozenset[Kind]:
        """Motion, and what its sources use."""
        return frozenset[Kind]({"motion"}).union(*(source.kinds for source in self.sources))

    @cached_property
    def beliefs(self) -> BeliefFilters:
        """Filters and rules of single beliefs."""
        known = self.model, self.options, self.rules, self.grid, self.positioned
        return BeliefFilters(*known, self.carriageways, self.holds, self.pulls, self.device)

    @cached_property
    def sources(self) -> tuple[EvidenceSource, ...]:
        """Kinds of measurement, in the order in which their unused readings are reported."""
        area = self.area
        return (
            (FixSource if self.grid else GnssSource)(area, self.satellites),
            TimingSource(area, self.timing, self.model.timed_by_sites),
            FirstFix(area.origin_m),
            self._radio,
            *self.more_sources,
            *((MapSource(),) if self.beliefs.map_may_start else ()),
        )

    @cached_property
    def _radio(self) -> RadioSource:
        return RadioSource(self.area, self.model.evidence, self.model.usual_serving)

    @cached_property
    def _weighing(self) -> Weighing:
        return Weighing(self.beliefs, self._radio, self.sources)

    def begin(self, kinds: Collection[Kind] = ALL_KINDS) -> BayesState:
        """Return the state before the first epoch.

        Without ``motion`` among the kinds one may go anywhere between two epochs.

        Raises
        ------
        InputError
            A kind is none, or a text is given for a collection of them.
        """
        check_kinds_given(kinds)
        sources = {source.name: source.begin() for source in self.sources}
        # One that keeps to ways drives, also where nothing measures how fast.
        pace = DRIVEN if self.model.motion.corners_per_m > 0 else Pace()
        has_motion = "motion" in kinds or _POSITIONS.isdisjoint(kinds)
        watch = SensorWatch(pace=pace, has_motion=has_motion)
        return BayesState(sources=sources, area=self.area.checksum, watch=watch)

    def begin_at(
        self, east_m: float, north_m: float, sd_m: float, rng: np.random.Generator
    ) -> BayesState:
        """Return the state at a known start, in the CRS of the database.

        It is tracked from there, unless ``sd_m`` is so large that it counts as several places, and
        claimed if it is certain enough.

        Raises
        ------
        InputError
            The start lies farther outside the area than 500 m and than five deviations, as degrees
            given for metres do, or is no number; or ``rng`` is no generator.
        """
        check_start(east_m, north_m, sd_m, self.area.lattice)
        check_generator(rng)
        return begun_at(self.beliefs, self.begin(), (east_m, north_m, sd_m), rng)

    def step(
        self, state: BayesState, epoch: Epoch, rng: np.random.Generator
    ) -> tuple[BayesState, StepOutput]:
        """Process one epoch.

        Raises
        ------
        InputError
            A value is of another type or beyond its range, such as a level of None; the epoch is
            before the last one; the state is one of another area; or ``rng`` is no generator.
        """
        check_epoch(epoch)
        check_state(state, self.area)
        check_later(epoch, state.watch.times.epoch_s)
        check_generator(rng)
        given, state = state, tracked(state)
        before, weighing = state.status, self._weighing
        usable = usable_epoch(state, epoch, by_ways=self.beliefs.by_ways)
        epoch, motion, radio = usable.epoch, usable.motion, usable.radio
        wait = self._waits(given, usable)
        state, unused = moved(self.beliefs, state, usable.watch, epoch, rng, wait)
        waiting = (
            wait is not None and state.belief is given.belief and wait(state.reckoning.travelled_m)
        )
        if motion is not Reason.USED:
            unused = [UnusedReading(epoch.time_s, "motion", "", motion)]
        unused += usable.unused
        updates = report_alone(self._radio, state, epoch) if waiting else None
        if updates is None:
            state, updates = weighing.collected(state, epoch, given.particle_spacing_m)
        for update in updates:
            unused += update.unused
        reasons = (update.reason for update in updates if update.reason is not None)
        reason = next(reasons, Reason.NO_READING)
        if radio is not Reason.USED:
            reason = radio
        if state.belief is None:
            started = weighing.new_beliefs.from_evidence(updates, state, epoch, rng)
            if started is not None:
                belief, sources = started
                state = changed(state, belief=belief, sources={**state.sources, **sources})
        elif not waiting or state.belief is not given.belief:
            # Else nothing is read of it.
            moved_only = state.belief
            measured = usable.is_measured
            state, why = weighing.weighed(state, moved_only, updates, epoch, rng, measured=measured)
            reason = reason if why is Reason.USED else why
            used = state.belief is not moved_only
            if state.belief is not None:
                belief, status = report(before, state.belief, state.status)
                if belief is not state.belief or status is not state.status:
                    state = changed(state, belief=belief, status=status)
                positioned = gnss_of(state).was_used(epoch.time_s)
                state = judged(self.beliefs, state, weighed=used, positioned=positioned)
        elif given.status is Status.UNCERTAIN:
            state = changed(state, status=given.status)
        unused += doubted(
            self.beliefs, state, given.hold, epoch, unused, moves=motion is Reason.USED
        )
        gnss = gnss_of(state)
        if gnss.was_used(epoch.time_s):
            last_fix = state.last_fix if epoch.gnss is None else epoch.gnss
            watch = state.watch.positioned(epoch.time_s)
            state = changed(state, last_fix=last_fix, watch=watch)
        elif epoch.gnss is not None and gnss.rejecting:
            state = changed(state, watch=state.watch.contradicted())
        if reason not in _TOLD_ELSEWHERE:
            # Of a report without a serving cell, the first one.
            named = (row.cell for row in epoch.radio if row.cell is not None)
            cell = serving_cell(epoch) or next(named, "")
            unused.append(UnusedReading(epoch.time_s, "serving", cell, reason))
        return step_output(
            self.area, state, epoch.time_s, reason, tuple(unused), positions_only=self.scored
        )

    def evidence_at(
        self, state: BayesState, epoch: Epoch, rng: np.random.Generator
    ) -> tuple[BayesState, list[EvidenceUpdate], bool]:
        """Return what :meth:`step` weighs at an epoch; for explanations of it.

        The state moved to the epoch, the evidence, and whether motion was measured; with the
        generator as before the step these are its own.
        """
        spacing_m, given, state = state.particle_spacing_m, state, tracked(state)
        usable = usable_epoch(state, epoch, by_ways=self.beliefs.by_ways)
        wait = self._waits(given, usable)
        state, _ = moved(self.beliefs, state, usable.watch, usable.epoch, rng, wait)
        return *self._weighing.collected(state, usable.epoch, spacing_m), usable.is_measured

    def _waits(self, state: BayesState, usable: UsableEpoch) -> Callable[[float], bool] | None:
        # Other sources may read beliefs at any epoch.
        return None if self.more_sources else waits(self.beliefs, self._radio, state, usable)

    def for_scores(self) -> BayesPositioner:
        """Return the filter without ways, radii of 99 % and protection levels in its outputs."""
        return replace(self, scored=True)

    def warm_up(self, merged: Sequence[Epoch]) -> None:  # noqa: ARG002
        """Load the compiled kernels, and prepare the area, at the first log."""
        if not self.grid:
            _ = self._is_warm

    @cached_property
    def _is_warm(self) -> bool:
        few = replace(self.options, max_particles=64, min_particles=32)
        run_kernels(replace(self, options=few))
        return True

    def smoother(self) -> BayesSmoother | None:
        """Return a new smoother if positions are to be smoothed."""
        return BayesSmoother(self.area, self.model.motion) if self.smooth else None

    def hypotheses(self, state: BayesState) -> Hypotheses | None:
        """Return the hypotheses of the belief."""
        belief, (west, south) = belief_here(state), self.area.origin_m
        if belief is None:
            return None
        return Hypotheses(
            belief.state[0].astype(np.float64) + west,
            belief.state[1].astype(np.float64) + south,
            belief.weight.astype(np.float64),
        )
