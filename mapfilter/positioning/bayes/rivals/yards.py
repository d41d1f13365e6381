"""Vehicles off the roads, in yards, car parks and petrol stations: driven slowly.

Off the map a metre costs a vehicle more than it costs the null hypothesis, as vehicles keep to
roads. Whoever drives as slowly as through a yard may be in one, so there a metre off the map costs
both the same: it is no evidence against a position that was found.
"""

from __future__ import annotations

from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.state import BayesState

_SLOW_MPS = 6.0
"""Speed up to which one drives off the roads: 22 km/h."""
_MOST_NATS_PER_M = 0.15
"""What a metre off the roads costs a vehicle by default; a stricter map may still refute."""


def off_nats_per_m(beliefs: BeliefFilters, state: BayesState) -> float:
    """Return what a metre off the map costs the null hypothesis besides a found position; else 0.

    Without cells nothing but the map can refute a position.

    Parameters
    ----------
    beliefs : BeliefFilters
    state : BayesState
        After an epoch's motion.
    """
    if state.belief is None or state.belief.status is not Status.TRACKING:
        return 0.0
    pace, unit_m = state.watch.pace, state.hold.step_unit_m
    is_slow = unit_m * min(pace.last_mps, pace.speed_mps) <= _SLOW_MPS
    is_yard = is_slow and bool(beliefs.model.area.cell_ids)
    return min(beliefs.model.weights.off_cost_per_m, _MOST_NATS_PER_M) if is_yard else 0.0
