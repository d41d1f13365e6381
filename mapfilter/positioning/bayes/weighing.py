"""The evidence of an epoch: collected from its sources, then beliefs are weighed by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mapfilter._changes import changed
from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.grid import GridBelief
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.beliefs.new_beliefs import NewBeliefs
from mapfilter.positioning.bayes.carriageways import CarriagewayFilters
from mapfilter.positioning.bayes.rivals.alternative import (
    AlternativeHypothesis,
    MapBelief,
    NullHypothesis,
)
from mapfilter.positioning.bayes.rivals.contradicted import misreads
from mapfilter.positioning.bayes.rivals.rivals import Rivals, challenged, for_belief
from mapfilter.positioning.bayes.rivals.step_units import (
    asks_for_unit,
    hold_after_takeover,
    is_unit_open,
)
from mapfilter.positioning.bayes.rivals.transitions import (
    Resolution,
    doubted,
    resolve_alternative,
)
from mapfilter.positioning.bayes.rivals.unaided import beside_alternative
from mapfilter.positioning.bayes.rivals.yards import off_nats_per_m
from mapfilter.positioning.bayes.sources.evidence import (
    Context,
    EvidenceSource,
    EvidenceUpdate,
    RadioReading,
    joined,
)
from mapfilter.positioning.bayes.sources.radio import RadioSource
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch


@dataclass(frozen=True)
class Weighing:
    """Sources of evidence, and the beliefs that are weighed by them.

    Parameters
    ----------
    beliefs : BeliefFilters
    radio : RadioSource
        One of the sources: it decides when a report is due.
    sources : tuple of EvidenceSource
        In the order in which their unused readings are reported.
    """

    beliefs: BeliefFilters
    radio: RadioSource
    sources: tuple[EvidenceSource, ...]

    @cached_property
    def new_beliefs(self) -> NewBeliefs:
        """What starts further beliefs, and the first one."""
        return NewBeliefs(self.beliefs, self.sources)

    @cached_property
    def _rivals(self) -> Rivals:
        return Rivals(self.beliefs, self.sources)

    def collected(
        self, state: BayesState, epoch: Epoch, particle_spacing_m: float
    ) -> tuple[BayesState, list[EvidenceUpdate]]:
        """Ask all sources for their evidence; return the state with theirs, and the evidence.

        The state has no belief where a position has refuted it.
        """
        given = state
        history = state.sources[self.radio.name]
        due = bool(epoch.radio) and self.radio.due(history, state.reckoning.travelled_m)
        context, updates, states = Context(particle_spacing_m, due), [], {}
        for source in self.sources:
            if state.belief is None:
                update = source.first_after(state, epoch)
            else:
                update = source.update(state, epoch, context)
            updates.append(update)
            if update.state is not state.sources[source.name]:
                states[source.name] = update.state
            if update.belief or update.alternative:
                state = changed(
                    state,
                    belief=update.belief or state.belief,
                    alternative=update.alternative or state.alternative,
                )
        if any(update.refuted for update in updates):
            return self.collected(given.begun_anew(), epoch, particle_spacing_m)
        if states:
            state = changed(state, sources={**state.sources, **states})
        return state, updates

    def weighed(
        self,
        state: BayesState,
        before: MapBelief,
        updates: list[EvidenceUpdate],
        epoch: Epoch,
        rng: np.random.Generator,
        *,
        measured: bool,
    ) -> tuple[BayesState, Reason]:
        """Weigh the belief and its alternative; start, prefer or drop the alternative.

        ``measured`` is whether motion was.
        """
        evidence = joined(updates)
        if evidence is None:
            return state, Reason.USED
        beliefs, area = self.beliefs, self.beliefs.model.area
        update, rules = beliefs.filter_of(state).update, beliefs.rules_of(state)
        lanes = beliefs.by_carriageways(state)
        doubt = self._doubt(state, before, lanes, measured=measured)
        tracked = measured and before.status is Status.TRACKING
        reading = evidence.weighing(before, tracked=tracked, doubted=doubt.main)
        belief, info = update(before, reading, rng)
        if info.reason is Reason.NO_CANDIDATES_LEFT and not belief.count:
            return state.begun_anew(), info.reason
        if info.reason is not Reason.USED:
            return changed(state, belief=belief), info.reason
        off_nats = off_nats_per_m(beliefs, state)
        null = challenged(rules, state.null, reading, before, belief, off_nats)
        alternative = state.alternative
        if alternative is not None:
            terms = weighed_by(alternative.belief, updates, measured=measured, alternative=True)
            terms = replace(terms or RadioReading(), doubted=doubt.alternative)
            other, _ = update(alternative.belief, terms, rng)
            own = challenged(rules, alternative.null, terms, alternative.belief, other)
            alternative = replace(alternative, belief=other, null=own)
        gone = not _holds(area, belief)
        now = resolve_alternative(
            rules,
            state.status,
            belief,
            null,
            alternative,
            state.reckoning.travelled_m,
            at_edge=area.at_edge(belief.summary.mean),
            gone=gone,
        )
        after = self._resolved(state, before, now, null, alternative)
        contradiction = next((one.contradiction for one in updates if one.contradiction), None)
        disputed = self._is_disputed(state, now, updates, gone=gone)
        # A turned phone may be ahead only because the belief is in a wrong place.
        if (
            (state.alternative is None or misreads(now.alternative, state, contradiction))
            and now.status is not Status.CONVERGED
            and (disputed or beliefs.is_contested(state))
        ):
            begun = self.new_beliefs.alternative(state, now.belief, epoch, contradiction, rng)
            started = disputed and begun is not now.alternative
            count = state.alternatives + started
            after = changed(after, alternative=begun, alternatives=count)
        if lanes is not None or state.twin is not None:
            twin = self.new_beliefs.twin(after, lanes, reading, rng, now.taken_over)
            after = changed(after, twin=twin)
        more = tuple(term for one in updates for term in one.rival_terms)
        shared = replace(evidence, terms=(*evidence.terms, *more)) if more else evidence
        after = self._rivals.turned(after, shared, epoch.time_s, measured=measured)
        after = self._rivals.unaided(after, updates, epoch.time_s, measured=measured)
        if beliefs.asks_for_look(before, after, taken_over=now.taken_over):
            after = self.new_beliefs.looking_around(after, epoch.time_s)
        if beliefs.asks_for_proof(after):
            after = self.new_beliefs.asked_for_proof(after, epoch)
        return after, Reason.USED

    def _doubt(
        self,
        state: BayesState,
        before: MapBelief,
        lanes: CarriagewayFilters | None,
        *,
        measured: bool,
    ) -> _Doubt:
        """Return for which beliefs it is too early to converge, before they are weighed."""
        beliefs, rules = self.beliefs, self.beliefs.rules_of(state)
        if lanes is None:
            plain = beliefs.by_map_alone(state) and not state.path.is_distinctive
        else:
            turned_rad = state.path.turned_rad
            plain = not lanes.mirror.proven(before, state.twin, turned_rad, lanes.places)
        # Hypotheses that spread to all sides agree on a place by chance.
        plain = plain or not (measured or beliefs.is_positioned(state))
        alternative = state.alternative
        main = plain or doubted(rules, before, state.null, alternative)
        main = main or is_unit_open(state, before, beliefs.other_unit_m(state))
        other = plain or lanes is not None
        if alternative is not None:
            other = other or alternative.null.log_odds > rules.converge_log_odds
        return _Doubt(main, other)

    def _is_disputed(
        self, state: BayesState, now: Resolution, updates: list[EvidenceUpdate], *, gone: bool
    ) -> bool:
        """Return whether anything asks for a belief elsewhere."""
        beliefs = self.beliefs
        return (
            gone
            or any(one.disputed for one in updates)
            or asks_for_unit(state, now.belief, beliefs.other_unit_m(state))
            or now.null.log_odds >= beliefs.rules_of(state).start_log_odds
            # Who is lost on ways without directions comes to no other place.
            or beliefs.goes_by_ways(state)
        )

    def _resolved(
        self,
        state: BayesState,
        before: MapBelief,
        now: Resolution,
        null: NullHypothesis,
        weighed: AlternativeHypothesis | None,
    ) -> BayesState:
        """Return the state after a belief and its alternative, with odds, were weighed."""
        taken_over = now.taken_over
        by_map_alone = self.beliefs.by_map_alone(state)
        sources = state.sources
        if taken_over and weighed is not None:
            sources = {**sources, **weighed.sources}
        return BayesState(
            belief=now.belief,
            status=now.status,
            contested=state.contested,
            sources=sources,
            reckoning=state.reckoning,
            heading_rad=state.heading_rad,
            compass=state.compass,
            null=null if by_map_alone and not taken_over else now.null,
            alternative=now.alternative,
            takeovers=state.takeovers + taken_over,
            path=state.path,
            reported=state.reported,
            watch=state.watch,
            last_fix=state.last_fix,
            recovery=None if taken_over else state.recovery,
            twin=state.twin,
            # Headings are read as the alternative reads them.
            hold=hold_after_takeover(state) if taken_over else state.hold,
            walking_rad=state.walking_rad,
            straight=state.straight,
            held=() if taken_over else state.held,
            half_turns=state.half_turns.anew() if taken_over else state.half_turns,
            alternatives=state.alternatives,
            unaided=beside_alternative(state, before) if taken_over else state.unaided,
            proven=self._proven(state, now, before),
            alone_from_m=state.alone_from_m,
            area=state.area,
            leg=state.leg,
        )

    def _proven(self, state: BayesState, now: Resolution, before: MapBelief) -> bool:
        """Return whether the belief was found without positions, and has not been lost since."""
        lost = before.status is Status.TRACKING and now.belief.status is Status.SEARCHING
        if now.taken_over or lost:
            return False
        found = now.status is Status.CONVERGED and not self.beliefs.used_positions(state)
        return state.proven or found


class _Doubt(NamedTuple):
    """Whether it is too early to converge, whatever is read now."""

    main: bool
    alternative: bool


def weighed_by(
    belief: MapBelief,
    updates: Sequence[EvidenceUpdate],
    *,
    measured: bool,
    alternative: bool = False,
) -> RadioReading | None:
    """Return the evidence as a belief is weighed by it; None without any."""
    reading = joined(updates, alternative=alternative)
    return None if reading is None else for_belief(reading, belief, measured=measured)


def _holds(area: AreaFrame, belief: MapBelief) -> bool:
    """Return whether most of a belief lies in the area; weights take longer than all places."""
    if isinstance(belief, GridBelief):
        # Its pixels are the area's.
        return belief.count > 0
    east_m, north_m = belief.state[0], belief.state[1]
    if east_m.size and area.holds_all(east_m, north_m):
        return True
    return area.holds(east_m, north_m, belief.weight)
