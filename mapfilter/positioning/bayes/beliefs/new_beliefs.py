"""Beliefs that start from the evidence of an epoch: the first one, and those beside it.

Beside it start an alternative, the twin of a mirrored path, and one that takes no positions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.beliefs.first_hypotheses import Start
from mapfilter.positioning.bayes.carriageways import CarriagewayFilters
from mapfilter.positioning.bayes.rivals.alternative import (
    AlternativeHypothesis,
    MapBelief,
    NullHypothesis,
)
from mapfilter.positioning.bayes.rivals.contradicted import hold_of_next
from mapfilter.positioning.bayes.rivals.mirrored import MirroredTwin
from mapfilter.positioning.bayes.rivals.nearby import looking_around
from mapfilter.positioning.bayes.rivals.own_draws import Purpose, own_rng
from mapfilter.positioning.bayes.rivals.step_units import (
    log_odds_of_unit,
    unit_of_next_m,
)
from mapfilter.positioning.bayes.rivals.unaided import searching_alone
from mapfilter.positioning.bayes.sources.evidence import (
    EvidenceSource,
    EvidenceUpdate,
    RadioReading,
    joined,
)
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.gnss.trail import Contradiction


@dataclass(frozen=True)
class NewBeliefs:
    """What starts beliefs.

    Parameters
    ----------
    beliefs : BeliefFilters
    sources : tuple of EvidenceSource
        As of :class:`~mapfilter.positioning.bayes.weighing.Weighing`.
    """

    beliefs: BeliefFilters
    sources: tuple[EvidenceSource, ...]

    def from_evidence(
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

    def asked_for_proof(self, state: BayesState, epoch: Epoch) -> BayesState:
        """Start a belief from this epoch's report alone, without positions."""
        updates = [one.first_after(state, epoch) for one in self.sources if not one.is_position]
        reading, main = joined(updates), state.belief
        if reading is None or not isinstance(main, ParticleBelief):
            return state
        filter_ = self.beliefs.filter_of(state)
        begun = filter_.init(Start(reading, state.compass), own_rng(epoch.time_s, Purpose.ALONE))
        pulls, gone_m = self.beliefs.pulls, state.reckoning.travelled_m
        one = searching_alone(pulls, main, begun, state.hold, gone_m)
        return replace(state, unaided=(*state.unaided, one))

    def looking_around(self, state: BayesState, time_s: float) -> BayesState:
        """Start a belief about the place that a search has found."""
        main, (west_m, south_m) = state.belief, self.beliefs.model.area.origin_m
        assert isinstance(main, ParticleBelief), "only particles have rivals"
        east_m, north_m = main.summary.mean[:2]
        holds, gone_m = self.beliefs.holds, state.reckoning.travelled_m
        place = west_m + east_m, south_m + north_m, holds.misplaced_sd_m
        prior = Start(None, state.compass, *place)
        rng = own_rng(time_s, Purpose.AROUND)
        begun = self.beliefs.around.init(prior, rng)
        one = looking_around(holds, main, begun, state.hold, gone_m, rng)
        return replace(state, held=(*state.held, one))

    def twin(
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

    def alternative(
        self,
        state: BayesState,
        main: MapBelief,
        epoch: Epoch,
        contradiction: Contradiction | None,
        rng: np.random.Generator,
    ) -> AlternativeHypothesis | None:
        """Start an alternative from this epoch's evidence alone, as if it were the first."""
        updates = [source.first_after(state, epoch) for source in self.sources]
        started = self.from_evidence(updates, state, epoch, rng)
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
