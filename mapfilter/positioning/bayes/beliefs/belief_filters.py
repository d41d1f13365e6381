"""The filters and rules of single beliefs, by the evidence that there is at an epoch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf, isfinite

import numpy as np

from mapfilter._device import PROCESSOR, Device
from mapfilter.filters.contract import Status
from mapfilter.filters.particle import ParticleBelief, ParticleOptions
from mapfilter.positioning.bayes.beliefs.made_filters import (
    MapFilter,
    around_filter,
    grid_filters,
    over_headings,
    particle_filters,
    smaller_filter,
)
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.carriageways import CarriagewayFilters
from mapfilter.positioning.bayes.rivals.alternative import AlternativeRules, MapBelief
from mapfilter.positioning.bayes.rivals.compared import is_ahead
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules, PullRules, RivalRules
from mapfilter.positioning.bayes.rivals.rides import rides_unheard, rode
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.gnss.source import GnssSource, gnss_of
from mapfilter.positioning.sensors.watch import SensorWatch

_FOLLOWED, _SOUGHT = (Status.TRACKING,), (Status.SEARCHING, Status.LOST, Status.OUTSIDE)
_LED_LOG_ODDS, _PROVEN_LOG_ODDS = -3.0, -6.0
"""Log odds of a belief that is wrong to fixes that are, where these lie apart from those before: of
one that was found by positions, and of one that was found without them, too."""
_ABANDONED_BY_WAYS_M, _POSITIONED_M = 3000.0, 200.0
"""Distance after which an undecided alternative is abandoned without directions; that from the last
position that was measured after which the map is the evidence again."""


@dataclass(frozen=True)
class BeliefFilters:
    """Filters of a single belief over an area.

    Parameters
    ----------
    model : BayesModel
    options, rules : ParticleOptions and AlternativeRules
        Where the map is the evidence, or there are cells.
    grid : bool
        Whether beliefs are masses on a grid in place of particles.
    positioned : tuple or None
        Options and rules that take the place of the others as long as positions are measured.
    carriageways : CarriagewayFilters or None
        What takes the place of model, options and rules of a vehicle while nothing but turns and
        the map locate it.
    holds : HoldRules
        When a phone may have been turned.
    pulls : PullRules
        When positions may have been pulled away.
    device : Device
        Where masses on a grid lie.
    """

    model: BayesModel
    options: ParticleOptions = field(default_factory=ParticleOptions)
    rules: AlternativeRules = field(default_factory=AlternativeRules)
    grid: bool = False
    positioned: tuple[ParticleOptions, AlternativeRules] | None = None
    carriageways: CarriagewayFilters | None = None
    holds: HoldRules = field(default_factory=HoldRules)
    pulls: PullRules = field(default_factory=PullRules)
    device: Device = PROCESSOR

    @cached_property
    def map_may_start(self) -> bool:
        """Whether the map alone may start a belief: there are no cells; a grid needs a start."""
        return not self.model.area.cell_ids and not self.grid

    def by_map_alone(self, state: BayesState) -> bool:
        """Return whether the map alone is the evidence: no position was used for some way."""
        return self.map_may_start and not self.is_positioned(state)

    def is_positioned(self, state: BayesState) -> bool:
        """Return whether a position was used some way ago, or later.

        One that the alternative used counts as well: it is to be found by positions, too.
        """
        used_at_m, other = gnss_of(state).used_at_m, state.alternative
        if other is not None and GnssSource.name in other.sources:
            used_at_m = max(used_at_m, other.sources[GnssSource.name].used_at_m)
        return state.reckoning.travelled_m - used_at_m <= _POSITIONED_M

    def by_carriageways(
        self, state: BayesState, *, compass: bool | None = None
    ) -> CarriagewayFilters | None:
        """Return what locates a vehicle by its turns and the map, if nothing else has yet.

        ``compass`` is whether headings are a compass's; None for what the state holds.
        """
        compass = state.compass if compass is None else compass
        if self.carriageways is None or compass or not self.map_may_start:
            return None
        return None if gnss_of(state).met else self.carriageways

    def moving_filter(self, state: BayesState, *, compass: bool) -> MapFilter:
        """Return the filter that starts and moves beliefs."""
        if self.by_carriageways(state, compass=compass) is not None:
            return self._by_carriageways
        return self.by_compass[compass]

    @property
    def by_ways(self) -> bool:
        """Whether steps without any direction follow the ways."""
        return self.model.motion.corners_per_m > 0 and not self.grid

    def goes_by_ways(self, state: BayesState) -> bool:
        """Return whether there were steps, none of them with a direction, and no positions."""
        return self.followed_ways(state) and not gnss_of(state).met

    def followed_ways(self, state: BayesState) -> bool:
        """Return whether hypotheses have followed the ways, as no step had a direction."""
        if not self.by_ways:
            return False
        way = state.watch.undirected
        return way.is_blind and not way.directed

    def rules_of(self, state: BayesState) -> AlternativeRules:
        """Return the rules for the evidence that there is."""
        rules = self._settings_of(state)[1]
        # By ways alone it takes longer until a place is found.
        by_ways = self.goes_by_ways(state)
        return replace(rules, abandon_after_m=_ABANDONED_BY_WAYS_M) if by_ways else rules

    def options_of(self, state: BayesState) -> ParticleOptions:
        """Return the numbers of particles and the switch rule for the evidence that there is."""
        return self._settings_of(state)[0]

    def _settings_of(self, state: BayesState) -> tuple[ParticleOptions, AlternativeRules]:
        lanes = self.by_carriageways(state)
        if lanes is not None:
            return lanes.options, lanes.rules
        if self.positioned is None or self.by_map_alone(state):
            return self.options, self.rules
        return self.positioned

    def filter_of(self, state: BayesState) -> MapFilter:
        """Return the filter of a single belief for the evidence that there is."""
        if self.by_carriageways(state) is not None:
            return self._by_carriageways
        if self.positioned is None or self.by_map_alone(state):
            return self.by_compass[state.compass]
        return self._positioned_by_compass[state.compass]

    @cached_property
    def by_compass(self) -> dict[bool, MapFilter]:
        """The filters of a single belief, for headings with and without a compass."""
        if self.grid:
            return grid_filters(self.model, self.options, self.device)
        return particle_filters(self.model, self.options)

    @cached_property
    def _by_carriageways(self) -> MapFilter:
        assert self.carriageways is not None
        lanes = self.carriageways
        return particle_filters(lanes.model, lanes.options)[False]

    @cached_property
    def held_otherwise(self) -> MapFilter:
        """The filter of beliefs in which the phone was turned: smaller ones."""
        return smaller_filter(self.model, self.options, self.holds)

    @cached_property
    def around(self) -> MapFilter:
        """The filter of a belief about the place that a search has found."""
        return around_filter(self.model, self.options, self.holds)

    @cached_property
    def alone(self) -> MapFilter:
        """The filter of beliefs without positions that began as the belief: smaller ones, too."""
        return smaller_filter(self.model, self.options, self.pulls)

    @cached_property
    def _positioned_by_compass(self) -> dict[bool, MapFilter]:
        known = self.positioned[0] if self.positioned else self.options
        return particle_filters(self.model, known)

    def is_contested(self, state: BayesState) -> bool:
        """Return whether a rival is ahead: a turned phone, or a belief without positions."""
        return self._is_ahead(self.holds, state, state.held) or self.is_pulled(state)

    def is_pulled(self, state: BayesState) -> bool:
        """Return whether the belief without positions is ahead: they may have been pulled away."""
        return self._is_ahead(self.pulls, state, state.found_alone)

    def _is_ahead(
        self, rules: RivalRules, state: BayesState, rivals: Sequence[HeldOtherwise]
    ) -> bool:
        main = state.belief
        if not rivals or not isinstance(main, ParticleBelief):
            return False
        return is_ahead(rules, rivals, main, state.reckoning.travelled_m)

    def log_odds_of_fixes(self, state: BayesState) -> float:
        """Return the log odds, beforehand, of an alternative at fixes that contradict the belief.

        They are those of a belief that is wrong to fixes that are; -inf without such fixes.
        """
        found = gnss_of(state).trail.contradiction
        if found is None:
            return -inf
        if found.goes_on:
            return 0.0
        # Dead reckoning does not lead there, so these may be put elsewhere.
        return _PROVEN_LOG_ODDS if state.proven else _LED_LOG_ODDS

    def positions_lead(self, state: BayesState) -> bool:
        """Return whether positions lead the belief, and a rival without them is to be begun."""
        if any(not one.from_scratch for one in state.unaided):
            return False
        return state.status is Status.TRACKING and self._is_led(state)

    def asks_for_proof(self, state: BayesState) -> bool:
        """Return whether positions weigh a belief that has not been found without them."""
        if state.proven or any(one.from_scratch for one in state.unaided):
            return False
        return self._is_led(state)

    def asks_for_look(self, before: MapBelief, state: BayesState, *, taken_over: bool) -> bool:
        """Return whether a belief has just found a place, by radio and a compass alone."""
        main = state.belief
        if not self.holds.watched or not state.compass or not isinstance(main, ParticleBelief):
            return False
        found = main.status in (Status.CONVERGED, Status.TRACKING)
        anew = before.status is Status.SEARCHING or taken_over
        return found and anew and not self.is_positioned(state)

    def used_positions(self, state: BayesState) -> bool:
        """Return whether a position or satellites have been used so far."""
        return isfinite(gnss_of(state).used_at_m)

    def _is_led(self, state: BayesState) -> bool:
        # Without directions a belief without positions would soon be anywhere.
        if not self.pulls.watched or state.belief is None or state.watch.undirected.is_blind:
            return False
        found = state.belief.status is Status.TRACKING
        if state.status not in (_FOLLOWED if found else _SOUGHT):
            return False
        return self.used_positions(state) and not gnss_of(state).rejecting

    def other_unit_m(self, state: BayesState) -> float:
        """Return a further unit in which steps may be given, by their speed; 1 for none.

        That is where they are a walker's by all that is stated, but not by their speed.
        """
        if not self.holds.watched or not state.compass or gnss_of(state).met:
            return 1.0
        return state.watch.pace.other_unit_m

    def may_have_left(self, state: BayesState) -> bool:
        """Return whether a walker may have left its position though no step is counted."""
        rest = state.watch.rest
        return rest is not None and rest.is_doubtful and self._rests_unseen(state)

    def left_share(self, state: BayesState, watch: SensorWatch) -> float:
        """Return the probability that a walker has left its position though no step is counted.

        ``watch`` is that of the epoch.
        """
        if watch.rest is None or not self._rests_unseen(state):
            return 0.0
        return watch.rest.left_share(watch.times.epoch_s)

    def _rests_unseen(self, state: BayesState) -> bool:
        """Return whether no position tells of a walker whether it rests."""
        return self.holds.watched and state.reckoning.travelled_m > gnss_of(state).used_at_m

    def may_be_anywhere(self, state: BayesState, watch: SensorWatch, time_s: float) -> bool:
        """Return whether a walker rode before an epoch; ``watch`` is that of after it."""
        return self.holds.watched and rode(state, watch, time_s)

    def is_unheard(self, state: BayesState) -> bool:
        """Return whether a walker may ride unheard."""
        return self.holds.watched and rides_unheard(state)

    def without_compass(self, belief: MapBelief, rng: np.random.Generator) -> MapBelief:
        """Spread a belief over all headings."""
        return over_headings(self.model, belief, self.device, rng)
