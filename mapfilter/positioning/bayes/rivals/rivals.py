"""Rivals that began as the belief is, weighed beside it: one of them may take over.

They are the beliefs in which the phone was turned (:mod:`mapfilter.positioning.bayes.rivals.held`),
and the one that takes no positions (:mod:`mapfilter.positioning.bayes.rivals.unaided`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mapfilter._changes import changed
from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.beliefs.made_filters import MapFilter
from mapfilter.positioning.bayes.certainty import Recovery
from mapfilter.positioning.bayes.rivals.alternative import (
    AlternativeRules,
    MapBelief,
    NullHypothesis,
)
from mapfilter.positioning.bayes.rivals.compared import after_takeover, is_ahead, still_open, winner
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold_rules import PullRules
from mapfilter.positioning.bayes.rivals.nearby import confirms
from mapfilter.positioning.bayes.rivals.own_draws import Purpose, own_rng
from mapfilter.positioning.bayes.sources.evidence import (
    EvidenceSource,
    EvidenceUpdate,
    FixedTerm,
    RadioReading,
    joined,
)
from mapfilter.positioning.bayes.state import BayesState

_SAYS_NOTHING = FixedTerm(np.zeros(1))


@dataclass(frozen=True)
class Rivals:
    """Weighing of the rivals of a belief, after that.

    Parameters
    ----------
    beliefs : BeliefFilters
    sources : tuple of EvidenceSource
    """

    beliefs: BeliefFilters
    sources: tuple[EvidenceSource, ...]

    def turned(
        self, state: BayesState, evidence: RadioReading, time_s: float, *, measured: bool
    ) -> BayesState:
        """Weigh the beliefs in which the phone was turned; one may take over."""
        main = state.belief
        if not state.held or not isinstance(main, ParticleBelief):
            return state
        rules, holds = self.beliefs.rules_of(state), self.beliefs.holds
        rng = own_rng(time_s, Purpose.WEIGHED)
        around, smaller = self.beliefs.around, self.beliefs.held_otherwise
        # Pseudoranges are compared with the main belief alone, whose total likelihood they leave.
        evidence = evidence.for_other_hypotheses()
        weighed = [
            self._weighed(
                state, one, around if one.is_look else smaller, evidence, rng, measured=measured
            )
            for one in state.held
        ]
        found = [one for one in weighed if one is not None and not confirms(holds, one, main)]
        held = still_open(holds, found, main, state.reckoning.travelled_m)
        refuted = (one for one, now in zip(state.held, weighed, strict=True) if now is None)
        half_turns = state.half_turns.after(found, held, main).with_refuted(refuted)
        state = changed(state, half_turns=half_turns)
        best = winner(holds, held, main, rules.converge_log_odds)
        if best is None:
            return changed(state, held=held)
        own = {one.name: one.beside_other(state.sources[one.name]) for one in self.sources}
        return changed(_taken_over(state, best, own), held=after_takeover(held, best))

    def unaided(
        self,
        state: BayesState,
        updates: Sequence[EvidenceUpdate],
        time_s: float,
        *,
        measured: bool,
    ) -> BayesState:
        """Weigh the belief without positions by all but these; it may take over.

        What positions tell is not in the log evidence of the main belief: only how well it
        predicts everything else with them is.
        """
        main = state.belief
        if not state.unaided or not isinstance(main, ParticleBelief):
            return state
        pulls, gone_m, proven = self.beliefs.pulls, state.reckoning.travelled_m, state.proven
        # A belief that is torn between positions and reports may search anew.
        found = main.status is Status.TRACKING
        rivals = [
            one
            for one in state.unaided
            if found or one.from_scratch or is_ahead(pulls, (one,), main, gone_m)
        ]
        others = [
            update
            for source, update in zip(self.sources, updates, strict=True)
            if not source.is_position
        ]
        # With positions alone the main belief settles what the way has cost it, and so must these.
        evidence = joined(others) or RadioReading(terms=(_SAYS_NOTHING,))
        rng, rules = own_rng(time_s, Purpose.UNAIDED_WEIGHED), self.beliefs.rules_of(state)
        smaller = self.beliefs.alone
        left: list[HeldOtherwise] = []
        for one in rivals:
            filter_ = self.beliefs.filter_of(state) if one.from_scratch else smaller
            weighed = self._weighed(state, one, filter_, evidence, rng, measured=measured)
            if one.from_scratch and _proves(pulls, weighed, main):
                proven = True
            elif weighed is not None:
                kind = pulls.of(from_scratch=one.from_scratch)
                still = still_open(kind, (weighed,), main, gone_m)
                left += still
                # What has not come out ahead for so long has been tried.
                proven = proven or (one.from_scratch and not still)
        best = winner(pulls, left, main, rules.converge_log_odds)
        if best is None:
            return changed(state, unaided=tuple(left), proven=proven)
        own = {one.name: one.distrusted(state.sources[one.name], time_s) for one in self.sources}
        taken_over = _taken_over(state, best, own)
        return changed(taken_over, held=(), proven=True, alone_from_m=best.start_m)

    def _weighed(
        self,
        state: BayesState,
        one: HeldOtherwise,
        filter_: MapFilter,
        evidence: RadioReading,
        rng: np.random.Generator,
        *,
        measured: bool,
    ) -> HeldOtherwise | None:
        """Weigh one of them; None where none of its hypotheses explains a reading."""
        rules = self.beliefs.rules_of(state)
        reading = for_belief(evidence, one.belief, measured=measured)
        if one.from_scratch:
            reading = replace(reading, doubted=one.null.log_odds > rules.converge_log_odds)
        belief, info = filter_.update(one.belief, reading, rng)
        if info.reason is Reason.NO_READING:
            # Nothing but pseudoranges: they say nothing of it.
            return one
        if info.reason is not Reason.USED:
            return None
        null = challenged(rules, one.null, reading, one.belief, belief)
        if belief.status is Status.CONVERGED:
            belief = replace(belief, status=Status.TRACKING)
        return changed(one, belief=belief, null=null)


def _proves(rules: PullRules, one: HeldOtherwise | None, main: ParticleBelief) -> bool:
    """Return whether a belief that began with a report alone speaks for the main belief.

    It has come to the same place and is behind, or it is far behind wherever it is.
    """
    if one is None:
        return False
    lead = one.log_bayes_factor(main)
    found = one.belief.status is Status.TRACKING and not one.is_elsewhere(main)
    return lead <= rules.search_threshold or (found and lead <= rules.abandon_threshold)


def _taken_over(state: BayesState, best: HeldOtherwise, own: dict[str, Any]) -> BayesState:
    """Return a state whose belief has been replaced by a rival, with the states of sources."""
    return changed(
        state,
        belief=best.belief,
        status=Status.TRACKING,
        sources={**state.sources, **own},
        null=best.null,
        alternative=state.alternative and state.alternative.beside(best.log_prior),
        takeovers=state.takeovers + 1,
        recovery=Recovery(),
        hold=best.hold,
        unaided=(),
    )


def for_belief(reading: RadioReading, belief: MapBelief, *, measured: bool) -> RadioReading:
    """Return a reading as a belief is weighed by it; ``measured`` is whether motion was."""
    return replace(reading, tracked=measured and belief.status is Status.TRACKING)


def challenged(
    rules: AlternativeRules,
    null: NullHypothesis,
    reading: RadioReading,
    before: MapBelief,
    after: MapBelief,
    off_nats_per_m: float = 0.0,
) -> NullHypothesis:
    """Return the null hypothesis beside a belief after a reading.

    A metre costs it what the map has cost the belief, up to ``off_nats_per_m``, or what it costs by
    the rules where that is more.
    """
    other = 0.0
    if reading.levels is not None and after.shared is not None:
        other = after.shared.other_log_likelihood
    gained = after.log_evidence - before.log_evidence
    searching = before.status is Status.SEARCHING
    least = rules.least_log_odds(searching=searching)
    nats_per_m, way_m = rules.map_nats_per_m, after.travelled_m - null.travelled_m
    if off_nats_per_m > nats_per_m and way_m > 0 and isinstance(before, ParticleBelief):
        by_map = -float(np.logaddexp.reduce(before.log_weight))
        nats_per_m = max(nats_per_m, min(by_map / way_m, off_nats_per_m))
    return null.after(reading, other, gained, after.travelled_m, nats_per_m, least)
