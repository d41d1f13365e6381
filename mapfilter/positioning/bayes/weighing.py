"""The evidence of an epoch: collected from its sources, then beliefs started or weighed by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.grid import GridBelief
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.alternative import (
    AlternativeHypothesis,
    MapBelief,
    NullHypothesis,
)
from mapfilter.positioning.bayes.area_frame import AreaFrame
from mapfilter.positioning.bayes.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.carriageways import CarriagewayFilters
from mapfilter.positioning.bayes.contradicted import hold_of_next, misreads
from mapfilter.positioning.bayes.evidence import (
    Context,
    EvidenceSource,
    EvidenceUpdate,
    RadioReading,
    joined,
)
from mapfilter.positioning.bayes.first_hypotheses import Start
from mapfilter.positioning.bayes.held import own_rng
from mapfilter.positioning.bayes.mirrored import MirroredTwin
from mapfilter.positioning.bayes.radio import RadioSource
from mapfilter.positioning.bayes.rivals import Rivals, challenged, for_belief
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.bayes.step_units import (
    asks_for_unit,
    hold_after_takeover,
    is_unit_open,
    log_odds_of_unit,
    unit_of_next_m,
)
from mapfilter.positioning.bayes.transitions import (
    Resolution,
    doubted,
    resolve_alternative,
)
from mapfilter.positioning.bayes.unaided import beside_alternative, searching_alone
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.gnss.trail import Contradiction

_ALONE = 8
"""Salt of the draws of a belief that begins without positions."""


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
    def _rivals(self) -> Rivals:
        return Rivals(self.beliefs, self.sources)

    def collected(
        self, state: BayesState, epoch: Epoch, particle_spacing_m: float
    ) -> tuple[BayesState, list[EvidenceUpdate]]:
        """Ask all sources for their evidence; return the state with theirs, and the evidence."""
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
                state = replace(
                    state,
                    belief=update.belief or state.belief,
                    alternative=update.alternative or state.alternative,
                )
        if states:
            state = replace(state, sources={**state.sources, **states})
        return state, updates

    def started(
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
        belief = self.beliefs.moving_filter(state, compass=state.compass).init(prior, rng)
        states = {}
        for source in self.sources:
            belief, own = source.start(belief, epoch, state.reckoning.travelled_m)
            if own is not None:
                states[source.name] = own
        return belief, states

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
        by_map_alone = beliefs.by_map_alone(state)
        lanes, turned_rad = beliefs.by_carriageways(state), state.path.turned_rad
        if lanes is None:
            plain = by_map_alone and not state.path.is_distinctive
        else:
            plain = not lanes.mirror.proven(before, state.twin, turned_rad, lanes.places)
        doubt = plain or doubted(rules, before, state.null, state.alternative)
        other_m = beliefs.other_unit_m(state)
        doubt = doubt or is_unit_open(state, before, other_m)
        tracked = measured and before.status is Status.TRACKING
        reading = evidence.weighing(before, tracked=tracked, doubted=doubt)
        belief, info = update(before, reading, rng)
        if info.reason is Reason.NO_CANDIDATES_LEFT and not belief.count:
            return _begun_anew(state), info.reason
        if info.reason is not Reason.USED:
            return replace(state, belief=belief), info.reason
        null = challenged(rules, state.null, reading, before, belief)
        sources, alternative = state.sources, state.alternative
        if alternative is not None:
            other = alternative.belief
            terms = weighed_by(other, updates, measured=measured, alternative=True)
            terms = terms or RadioReading()
            doubt = plain or lanes is not None
            doubt = doubt or alternative.null.log_odds > rules.converge_log_odds
            terms = replace(terms, doubted=doubt)
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
        if now.taken_over and alternative is not None:
            sources = {**sources, **alternative.sources}
        alternative = now.alternative
        disputed = any(one.disputed for one in updates)
        contradiction = next((one.contradiction for one in updates if one.contradiction), None)
        disputed = disputed or asks_for_unit(state, now.belief, other_m)
        disputed = disputed or now.null.log_odds >= rules.start_log_odds or gone
        # A turned phone may be ahead only because the belief is in a wrong place.
        if (
            (state.alternative is None or misreads(alternative, state, contradiction))
            and now.status is not Status.CONVERGED
            and (disputed or beliefs.is_contested(state))
        ):
            alternative = self._alternative(state, now.belief, epoch, contradiction, rng)
        after = BayesState(
            belief=now.belief,
            status=now.status,
            contested=state.contested,
            sources=sources,
            reckoning=state.reckoning,
            heading_rad=state.heading_rad,
            compass=state.compass,
            null=null if by_map_alone and not now.taken_over else now.null,
            alternative=alternative,
            takeovers=state.takeovers + now.taken_over,
            path=state.path,
            reported=state.reported,
            watch=state.watch,
            last_fix=state.last_fix,
            recovery=None if now.taken_over else state.recovery,
            twin=state.twin,
            # Headings are read as the alternative reads them.
            hold=hold_after_takeover(state) if now.taken_over else state.hold,
            walking_rad=state.walking_rad,
            held=() if now.taken_over else state.held,
            alternatives=state.alternatives + (disputed and alternative is not now.alternative),
            unaided=beside_alternative(state, before) if now.taken_over else state.unaided,
            proven=self._proven(state, now, before),
            alone_from_m=state.alone_from_m,
            area=state.area,
        )
        if lanes is not None or state.twin is not None:
            after = replace(after, twin=self._twin_of(after, lanes, reading, rng, now.taken_over))
        more = tuple(term for one in updates for term in one.rival_terms)
        shared = replace(evidence, terms=(*evidence.terms, *more)) if more else evidence
        after = self._rivals.turned(after, shared, epoch.time_s, measured=measured)
        after = self._rivals.unaided(after, updates, epoch.time_s, measured=measured)
        if beliefs.asks_for_proof(after):
            after = self._asked_for_proof(after, epoch)
        return after, Reason.USED

    def _proven(self, state: BayesState, now: Resolution, before: MapBelief) -> bool:
        """Return whether the belief was found without positions, and has not been lost since."""
        lost = before.status is Status.TRACKING and now.belief.status is Status.SEARCHING
        if now.taken_over or lost:
            return False
        found = now.status is Status.CONVERGED and not self.beliefs.used_positions(state)
        return state.proven or found

    def _asked_for_proof(self, state: BayesState, epoch: Epoch) -> BayesState:
        """Start a belief from this epoch's report alone, without positions."""
        updates = [one.first_after(state, epoch) for one in self.sources if not one.is_position]
        reading, main = joined(updates), state.belief
        if reading is None or not isinstance(main, ParticleBelief):
            return state
        filter_ = self.beliefs.filter_of(state)
        begun = filter_.init(Start(reading, state.compass), own_rng(epoch.time_s, _ALONE))
        pulls, gone_m = self.beliefs.pulls, state.reckoning.travelled_m
        one = searching_alone(pulls, main, begun, state.hold, gone_m)
        return replace(state, unaided=(*state.unaided, one))

    def _twin_of(
        self,
        state: BayesState,
        lanes: CarriagewayFilters | None,
        reading: RadioReading,
        rng: np.random.Generator,
        taken_over: bool,
    ) -> MirroredTwin | None:
        """Return the twin after a reading: started where one is needed, None where none is."""
        main, twin = state.belief, state.twin
        if lanes is None or main is None or main.status is not Status.SEARCHING:
            return None
        if twin is None or taken_over:
            if not state.path.whole:
                return None
            prior = Start(None, compass=False, path=state.path.mirrored)
            belief = self.beliefs.filter_of(state).init(prior, rng)
            return MirroredTwin.beside(main, belief, lanes.places)
        belief, info = self.beliefs.filter_of(state).update(
            twin.belief, replace(reading, doubted=True), rng
        )
        return replace(twin, belief=belief) if info.reason is Reason.USED else None

    def _alternative(
        self,
        state: BayesState,
        main: MapBelief,
        epoch: Epoch,
        contradiction: Contradiction | None,
        rng: np.random.Generator,
    ) -> AlternativeHypothesis | None:
        """Start an alternative from this epoch's evidence alone, as if it were the first."""
        updates = [source.first_after(state, epoch) for source in self.sources]
        started = self.started(updates, state, epoch, rng)
        if started is None:
            return None
        belief, sources = started
        null = NullHypothesis()
        if self.beliefs.by_map_alone(state):
            # Many alternatives may follow each other, and each begins with the streets that fit
            # best: what speaks for a position off the map must not be forgotten with each.
            null = NullHypothesis(max(state.null.log_odds, null.log_odds))
        unit_m = unit_of_next_m(state, main, self.beliefs.other_unit_m(state))
        return AlternativeHypothesis(
            belief,
            state.reckoning.travelled_m,
            main.log_evidence + log_odds_of_unit(unit_m),
            epoch.time_s,
            sources,
            null=null,
            hold=hold_of_next(state, unit_m, contradiction),
            gnss_log_bayes_factor=0.0 if contradiction is None else contradiction.nats,
        )


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


def _begun_anew(state: BayesState) -> BayesState:
    """Return a state without its belief, of which nothing is left in the area.

    What was found out beside it, too, begins with the next one.
    """
    found = state.status in (Status.CONVERGED, Status.TRACKING, Status.UNCERTAIN)
    status = Status.LOST if found else state.status
    return replace(
        state,
        belief=None,
        status=status,
        null=NullHypothesis(),
        alternative=None,
        recovery=None,
        twin=None,
        unaided=(),
        proven=False,
    )
