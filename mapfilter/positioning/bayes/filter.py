"""Global positioning by the Bayes map filter, one epoch after another, live or in replay.

:meth:`BayesPositioner.step` moves the beliefs by dead reckoning, asks each source of evidence
(:mod:`mapfilter.positioning.bayes.evidence`) for the epoch's log-likelihood terms, starts a belief
or weighs it with them, and reports. Equal epochs and seeds give equal bytes.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import expm1, isfinite, nan
from typing import Any

import numpy as np

from mapfilter.filters.contract import BeliefFilter, MotionStep, Reason, Status
from mapfilter.filters.grid import GridBelief, GridFilter
from mapfilter.filters.hypotheses import NEAR_M
from mapfilter.filters.particle import ParticleFilter, ParticleOptions
from mapfilter.models.fingerprint import BoundReading
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.street_motion import remounted
from mapfilter.positioning.bayes.alternative import (
    AlternativeHypothesis,
    AlternativeRules,
    MapBelief,
    NullHypothesis,
    doubted,
    report,
    resolve_alternative,
)
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.bayes.evidence import (
    Context,
    EvidenceSource,
    EvidenceUpdate,
    RadioReading,
    joined,
)
from mapfilter.positioning.bayes.grid import StreetGrid
from mapfilter.positioning.bayes.map_source import MapSource
from mapfilter.positioning.bayes.model import BayesModel, Start
from mapfilter.positioning.bayes.path import RecentPath
from mapfilter.positioning.bayes.radio import RadioSource, name_of
from mapfilter.positioning.bayes.sensors import UNMEASURED, watched
from mapfilter.positioning.bayes.smoothing import BayesSmoother
from mapfilter.positioning.bayes.state import BayesState, step_output
from mapfilter.positioning.bayes.timing import TimingSource
from mapfilter.positioning.epochs import Epoch, headed
from mapfilter.positioning.estimate import StepOutput, UnusedReading
from mapfilter.positioning.filter import ALL_KINDS, Filter, Hypotheses, Kind
from mapfilter.positioning.gnss.gate import GnssState
from mapfilter.positioning.gnss.options import GnssOptions, TimingOptions
from mapfilter.positioning.gnss.source import FirstFix, GnssSource

_TOLD_ELSEWHERE = (Reason.USED, Reason.NOT_MOVED_ENOUGH, Reason.NO_READING, Reason.STALE_RADIO)
_MORE_PARTICLES, _MORE_SEARCHING = 6, 3
"""Factors of the numbers of particles where headings are unknown."""
_POSITIONED_M = 200.0
"""Distance from the last position that was measured after which the map is the evidence again."""


@dataclass(frozen=True)
class BayesPositioner(Filter[BayesState]):
    """The map filter over an area.

    ``grid`` replaces particles by the exact filter on a grid; ``smooth`` smooths positions by the
    whole log. ``more_sources`` are sources of evidence besides the built-in ones. ``positioned``
    holds the options and rules that take the place of the others as long as positions or satellites
    are measured; None for the same ones.
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

    @property
    def crs(self) -> str:
        """CRS of the area."""
        return self.area.lattice.crs

    @property
    def area(self) -> AreaMap:
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
    def sources(self) -> tuple[EvidenceSource, ...]:
        """Kinds of measurement, in the order in which their unused readings are reported."""
        area = self.area
        return (
            GnssSource(area, self.satellites, clock=not self.grid),
            TimingSource(area, self.timing, self.model.timed_by_sites),
            FirstFix(area.origin_m),
            self._radio,
            *self.more_sources,
            *((MapSource(),) if self._map_may_start else ()),
        )

    @property
    def _map_may_start(self) -> bool:
        """Whether the map alone may start a belief: there are no cells; a grid needs a start."""
        return not self.area.cell_ids and not self.grid

    def _by_map_alone(self, state: BayesState) -> bool:
        """Whether the map alone is the evidence: no position was measured for some way."""
        if not self._map_may_start:
            return False
        gnss: GnssState = state.sources[GnssSource.name]
        return state.reckoning.travelled_m - gnss.used_at_m > _POSITIONED_M

    def _rules_of(self, state: BayesState) -> AlternativeRules:
        """Return the rules for the evidence that there is."""
        if self.positioned is None or self._by_map_alone(state):
            return self.rules
        return self.positioned[1]

    def _filter_of(self, state: BayesState) -> BeliefFilter[Start, Any, RadioReading]:
        """Return the filter of a single belief for the evidence that there is."""
        if self.positioned is None or self._by_map_alone(state):
            return self.filters[state.compass]
        return self._filters_positioned[state.compass]

    @cached_property
    def _radio(self) -> RadioSource:
        return RadioSource(self.area, self.model.evidence, self.model.usual_serving)

    @cached_property
    def filters(self) -> dict[bool, BeliefFilter[Start, Any, RadioReading]]:
        """The filters of a single belief, for headings with and without a compass."""
        if self.grid:
            model = replace(self.model, remember=False)
            grids = {compass: StreetGrid(model, compass) for compass in (True, False)}
            return {compass: GridFilter(grid, self.options) for compass, grid in grids.items()}
        return self._particle_filters(self.options)

    @cached_property
    def _filters_positioned(self) -> dict[bool, BeliefFilter[Start, Any, RadioReading]]:
        return self._particle_filters(self.positioned[0] if self.positioned else self.options)

    def _particle_filters(
        self, known: ParticleOptions
    ) -> dict[bool, BeliefFilter[Start, Any, RadioReading]]:
        # Every place times every heading: most of them die out after a few steps.
        most = _MORE_PARTICLES * known.max_particles
        searching = _MORE_SEARCHING * known.min_search_particles
        unknown = replace(known, max_particles=most, min_search_particles=searching)
        return {
            True: ParticleFilter(self.model, known),
            False: ParticleFilter(self.model, unknown),
        }

    def begin(self, kinds: Collection[Kind] = ALL_KINDS) -> BayesState:  # noqa: ARG002
        """Return the state before the first epoch."""
        return BayesState(sources={source.name: source.begin() for source in self.sources})

    def begin_at(
        self, east_m: float, north_m: float, sd_m: float, rng: np.random.Generator
    ) -> BayesState:
        """Return the state at a known start, in the CRS of the database.

        It is tracked from there, unless ``sd_m`` is so large that it counts as several places.
        """
        belief = self.filters[True].init(Start(None, True, east_m, north_m, sd_m), rng)
        near = -expm1(-0.5 * (NEAR_M / sd_m) ** 2) if sd_m > 0 else 1.0
        least = max(self.options.split_mass, self.rules.unclear_below_mass)
        status = Status.TRACKING if near > least else Status.SEARCHING
        return replace(self.begin(), belief=replace(belief, status=status), status=status)

    def step(
        self, state: BayesState, epoch: Epoch, rng: np.random.Generator
    ) -> tuple[BayesState, StepOutput]:
        """Process one epoch."""
        epoch, repeated = _with_a_new_fix(state, epoch)
        unclear, spacing_m = state.unclear, state.particle_spacing_m
        if unclear:
            state = replace(state, status=Status.TRACKING, unclear=False)
        before = state.status
        heard = epoch.radio
        watch, epoch, (motion, radio) = watched(state.watch, epoch)
        state, unused = self._moved(replace(state, watch=watch), epoch, rng)
        if motion is not Reason.USED:
            unused = [UnusedReading(epoch.time_s, "motion", "", motion)]
        if radio is not Reason.USED:
            unused += [UnusedReading(epoch.time_s, row.role, name_of(row), radio) for row in heard]
        if repeated:
            unused.append(UnusedReading(epoch.time_s, "gnss", "", Reason.REPEATED_FIX))
        state, updates = self._collected(state, epoch, spacing_m)
        unused += [reading for update in updates for reading in update.unused]
        reasons = (update.reason for update in updates if update.reason is not None)
        reason = next(reasons, Reason.NO_READING)
        if radio is not Reason.USED:
            reason = radio
        if state.belief is None:
            started = self._started(updates, state, epoch, rng)
            if started is not None:
                belief, sources = started
                state = replace(state, belief=belief, sources={**state.sources, **sources})
        else:
            measured = motion not in UNMEASURED
            state, why = self._weighed(state, state.belief, updates, epoch, rng, measured=measured)
            reason = reason if why is Reason.USED else why
            if state.belief is not None:
                belief, status = report(before, state.belief, state.status)
                state = replace(state, belief=belief, status=status)
                state = self._in_one_place(state, measured=measured, was_unclear=unclear)
        gnss: GnssState = state.sources[GnssSource.name]
        if epoch.fix is not None and gnss.was_used(epoch.time_s):
            state = replace(state, last_fix=epoch.fix)
        if reason not in _TOLD_ELSEWHERE:
            cell = next((str(row.cell) for row in epoch.radio if row.cell is not None), "")
            unused.append(UnusedReading(epoch.time_s, "serving", cell, reason))
        return step_output(self.area, state, epoch.time_s, reason, tuple(unused))

    def evidence_at(
        self, state: BayesState, epoch: Epoch, rng: np.random.Generator
    ) -> tuple[BayesState, list[EvidenceUpdate], bool]:
        """Return what :meth:`step` weighs at an epoch; for explanations of it.

        The state moved to the epoch, the evidence, and whether motion was measured; with the
        generator as before the step these are its own.
        """
        epoch, _ = _with_a_new_fix(state, epoch)
        spacing_m = state.particle_spacing_m
        watch, epoch, (motion, _) = watched(state.watch, epoch)
        moved, _ = self._moved(replace(state, watch=watch), epoch, rng)
        return *self._collected(moved, epoch, spacing_m), motion not in UNMEASURED

    def warm_up(self, merged: Sequence[Epoch]) -> None:  # noqa: ARG002
        """Load the compiled kernels, and prepare the area."""
        if self.grid:
            return
        model, rng = self.model, np.random.default_rng(0)
        west, south = model.area.origin_m
        small = replace(self, options=replace(self.options, max_particles=64, min_particles=32))
        state = small.begin_at(west, south, 1.0, rng)
        state, _ = small.step(state, Epoch(0.0, (MotionStep(1.0, 0.0),)), rng)
        if state.belief is not None and model.area.cell_ids:
            small.filters[True].update(state.belief, _every_kind(), rng)

    def smoother(self) -> BayesSmoother | None:
        """Return a new smoother if positions are to be smoothed."""
        return BayesSmoother(self.area, self.model.motion) if self.smooth else None

    def hypotheses(self, state: BayesState) -> Hypotheses | None:
        """Return the hypotheses of the belief."""
        belief, (west, south) = state.belief, self.area.origin_m
        if belief is None:
            return None
        return Hypotheses(
            belief.state[0].astype(np.float64) + west,
            belief.state[1].astype(np.float64) + south,
            belief.weight.astype(np.float64),
        )

    def _moved(
        self, state: BayesState, epoch: Epoch, rng: np.random.Generator
    ) -> tuple[BayesState, list[UnusedReading]]:
        """Move the beliefs by the epoch's dead reckoning."""
        unused: list[UnusedReading] = []
        for raw in epoch.motion:
            step, heading_rad = headed(raw, state.heading_rad)
            belief, compass, alternative = state.belief, state.compass, state.alternative
            reckoning, why, path = state.reckoning, Reason.NOT_STARTED, state.path
            if self._map_may_start:
                known = isfinite(raw.heading_rad) == compass or not path.here.travelled_m
                path = (path if known else RecentPath()).moved(step)
                why = Reason.USED if isfinite(step.step_m) else Reason.NO_STEP
            if belief is None:
                # An unmeasured way says nothing of the compass.
                compass = compass if isfinite(raw.spread_m) else isfinite(raw.heading_rad)
            else:
                turned = isfinite(raw.heading_rad) or isfinite(raw.spread_m)
                if compass and not turned and reckoning.travelled_m == 0:
                    # Nothing has moved yet, so headings can still be relative to the first one.
                    compass, belief = False, self._without_compass(belief, rng)
                predict = self.filters[compass].predict
                belief, why = predict(belief, step, rng)
                belief = self._remounted(belief, abs(step.step_m), rng)
                reckoning = reckoning.moved(step)
                if alternative is not None:
                    other, _ = predict(alternative.belief, step, rng)
                    alternative = replace(alternative, belief=other)
            if why is not Reason.USED:
                unused.append(UnusedReading(epoch.time_s, "motion", "", why))
            still = step.step_m == 0 and belief is state.belief
            same = path is state.path and compass == state.compass and alternative is None
            if still and same and heading_rad == state.heading_rad:
                # Standing still changes nothing, and takes most epochs of a long log.
                continue
            state = replace(
                state,
                belief=belief,
                reckoning=reckoning,
                heading_rad=heading_rad,
                compass=compass,
                alternative=alternative,
                path=path,
            )
        return state, unused

    def _remounted(self, belief: MapBelief, length_m: float, rng: np.random.Generator) -> MapBelief:
        """Turn the phone of some hypotheses, once a position is tracked.

        A search would find more places that fit.
        """
        if isinstance(belief, GridBelief) or belief.status is not Status.TRACKING:
            return belief
        if not (length_m > 0 and self.model.motion.remounts_per_m > 0):
            return belief
        state = remounted(belief.state, length_m, self.model.motion, rng)
        return belief if state is belief.state else replace(belief, state=state)

    def _collected(
        self, state: BayesState, epoch: Epoch, particle_spacing_m: float
    ) -> tuple[BayesState, list[EvidenceUpdate]]:
        """Ask all sources for their evidence; return the state with theirs, and the evidence."""
        history = state.sources[self._radio.name]
        due = bool(epoch.radio) and self._radio.due(history, state.reckoning.travelled_m)
        context, updates, states = Context(particle_spacing_m, due), [], {}
        for source in self.sources:
            if state.belief is None:
                update = source.first_after(state, epoch)
            else:
                update = source.update(state, epoch, context)
            updates.append(update)
            states[source.name] = update.state
            if update.belief or update.alternative:
                state = replace(
                    state,
                    belief=update.belief or state.belief,
                    alternative=update.alternative or state.alternative,
                )
        if any(own is not state.sources[name] for name, own in states.items()):
            state = replace(state, sources=states)
        return state, updates

    def _started(
        self,
        updates: list[EvidenceUpdate],
        state: BayesState,
        epoch: Epoch,
        rng: np.random.Generator,
    ) -> tuple[MapBelief, dict[str, Any]] | None:
        """Start a belief from evidence; also return the states of sources that depend on it."""
        reading = joined(updates)
        if reading is None:
            return None
        path = next((one.path for one in updates if one.path is not None), None)
        prior = Start(reading, state.compass, path=path)
        belief = self.filters[state.compass].init(prior, rng)
        states = {}
        for source in self.sources:
            belief, own = source.start(belief, epoch, state.reckoning.travelled_m)
            if own is not None:
                states[source.name] = own
        return belief, states

    def _weighed(
        self,
        state: BayesState,
        before: MapBelief,
        updates: list[EvidenceUpdate],
        epoch: Epoch,
        rng: np.random.Generator,
        *,
        measured: bool,
    ) -> tuple[BayesState, Reason]:
        """Weigh the belief and its alternative; start, prefer or drop the alternative."""
        reading = weighed_by(before, updates, measured=measured)
        if reading is None:
            return state, Reason.USED
        update, rules = self._filter_of(state).update, self._rules_of(state)
        by_map_alone = self._by_map_alone(state)
        plain = by_map_alone and not state.path.is_distinctive
        doubt = plain or doubted(rules, before, state.null, state.alternative)
        doubt = doubt or self.area.at_edge(before.summary.mean)
        reading = replace(reading, doubted=doubt)
        belief, info = update(before, reading, rng)
        if info.reason is not Reason.USED:
            return replace(state, belief=belief), info.reason
        null = _challenged(rules, state.null, reading, before, belief)
        sources, alternative = state.sources, state.alternative
        if alternative is not None:
            own_reading = weighed_by(
                alternative.belief, updates, measured=measured, alternative=True
            )
            terms = own_reading or RadioReading()
            doubt = plain or alternative.null.log_odds > rules.converge_log_odds
            terms = replace(terms, doubted=doubt)
            other, _ = update(alternative.belief, terms, rng)
            own = _challenged(rules, alternative.null, terms, alternative.belief, other)
            alternative = replace(alternative, belief=other, null=own)
        travelled_m = state.reckoning.travelled_m
        at_edge = self.area.at_edge(belief.summary.mean)
        gone = not self.area.holds(belief.state[0], belief.state[1], belief.weight)
        now = resolve_alternative(
            rules,
            state.status,
            belief,
            null,
            alternative,
            travelled_m,
            at_edge=at_edge,
            gone=gone,
        )
        if now.taken_over and alternative is not None:
            sources = {**sources, **alternative.sources}
        alternative = now.alternative
        disputed = any(one.disputed for one in updates)
        if (
            state.alternative is None
            and now.status is not Status.CONVERGED
            and (now.null.log_odds >= rules.start_log_odds or disputed or gone)
        ):
            alternative = self._alternative(state, now.belief, epoch, rng)
        after = replace(
            state,
            belief=now.belief,
            status=now.status,
            sources=sources,
            null=null if by_map_alone and not now.taken_over else now.null,
            alternative=alternative,
            takeovers=state.takeovers + now.taken_over,
        )
        return after, Reason.USED

    def _in_one_place(self, state: BayesState, *, measured: bool, was_unclear: bool) -> BayesState:
        """Return a state that is LOST while its belief is spread over more than one place.

        Below the mass at which it searches again, it has to converge anew. Motion that is not
        measured spreads it to all sides, so it is LOST earlier, but kept as found: it is clear
        again when it has gathered.
        """
        belief, rules = state.belief, self._rules_of(state)
        if belief is None or state.status not in (Status.CONVERGED, Status.TRACKING):
            return state
        mass = belief.summary.mass_50m
        if mass < self.options.split_mass:
            belief = replace(belief, status=Status.SEARCHING, agreement_start_m=nan)
            return replace(state, belief=belief, status=Status.LOST)
        least = 0.0 if measured else rules.unclear_below_mass
        if was_unclear:
            least = rules.clear_from_mass
        return state if mass >= least else replace(state, status=Status.LOST, unclear=True)

    def _alternative(
        self, state: BayesState, main: MapBelief, epoch: Epoch, rng: np.random.Generator
    ) -> AlternativeHypothesis | None:
        """Start an alternative from this epoch's evidence alone, as if it were the first."""
        updates = [source.first_after(state, epoch) for source in self.sources]
        started = self._started(updates, state, epoch, rng)
        if started is None:
            return None
        belief, sources = started
        null = NullHypothesis()
        if self._by_map_alone(state):
            # Many alternatives may follow each other, and each begins with the streets that fit
            # best: what speaks for a position off the map must not be forgotten with each.
            null = NullHypothesis(max(state.null.log_odds, null.log_odds))
        return AlternativeHypothesis(
            belief,
            state.reckoning.travelled_m,
            main.log_evidence,
            epoch.time_s,
            sources,
            null=null,
        )

    def _without_compass(self, belief: MapBelief, rng: np.random.Generator) -> MapBelief:
        """Spread a belief over all headings."""
        if isinstance(belief, GridBelief):
            grid = StreetGrid(replace(self.model, remember=False), compass=False)
            count = grid.bias_rad.size
            on, off = (
                np.repeat(mass.sum(axis=0, keepdims=True) / count, count, axis=0)
                for mass in (belief.on, belief.off)
            )
            return replace(belief, on=on, off=off, model=grid)
        state = self.model.any_heading(belief.state, _MORE_PARTICLES, rng)
        log_weight = np.tile(belief.log_weight, _MORE_PARTICLES) - np.log(_MORE_PARTICLES)
        kept = np.tile(belief.kept, (1, _MORE_PARTICLES))
        return replace(belief, state=state, log_weight=log_weight, kept=kept)


def _with_a_new_fix(state: BayesState, epoch: Epoch) -> tuple[Epoch, bool]:
    """Return an epoch without a fix that has no position, or repeats the last one that was used.

    Also returns whether it was repeated.
    """
    fix = epoch.fix
    if fix is None:
        return epoch, False
    repeated = fix.repeats(state.last_fix)
    known = isfinite(fix.east_m) and isfinite(fix.north_m)
    return (epoch if known and not repeated else replace(epoch, fix=None)), repeated


def weighed_by(
    belief: MapBelief,
    updates: Sequence[EvidenceUpdate],
    *,
    measured: bool,
    alternative: bool = False,
) -> RadioReading | None:
    """Return the evidence as a belief is weighed by it; None without any."""
    reading = joined(updates, alternative=alternative)
    tracked = measured and belief.status is Status.TRACKING
    return reading if reading is None else replace(reading, tracked=tracked)


def _challenged(
    rules: AlternativeRules,
    null: NullHypothesis,
    reading: RadioReading,
    before: MapBelief,
    after: MapBelief,
) -> NullHypothesis:
    """Return the null hypothesis beside a belief after a reading."""
    other = 0.0
    if reading.levels is not None and after.shared is not None:
        other = after.shared.other_log_likelihood
    gained = after.log_evidence - before.log_evidence
    searching = before.status is Status.SEARCHING
    least = rules.least_log_odds(searching=searching)
    return null.after(reading, other, gained, after.travelled_m, rules.map_nats_per_m, least)


def _every_kind() -> RadioReading:
    one, none = np.full(1, -60, dtype=np.float32), np.zeros(1, dtype=np.int32)
    levels = LevelReport(none, one, none, -100.0, 1.0)
    return RadioReading(0, 1.0, levels, (BoundReading(none, -60.0, 1, 8.0, 1.0),))
