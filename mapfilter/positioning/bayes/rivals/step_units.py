"""The unit of steps whose speed in metres is not that of a walker.

Steps in feet that are read in metres have the speed of a cyclist, and no position fits the reports
for long. Where the speed is not a walker's, and nothing states that a vehicle moves, an alternative
reads lengths in the other unit. The two are compared as any alternative is with its belief; until
the alternative is far behind, the belief does not converge. Once an alternative in another unit
has taken over, lengths are read in that unit.
"""

from __future__ import annotations

from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.rivals.alternative import MapBelief
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.state import BayesState

_OTHER_UNIT_NATS, _OPEN_NATS = -4.0, -10.0
"""Log odds of steps being given in another unit than metres where their speed is no walker's; log
Bayes factor of an alternative in another unit above which a belief does not converge."""


def asks_for_unit(state: BayesState, main: MapBelief, other_m: float) -> bool:
    """Return whether an alternative is to start though nothing contradicts a belief.

    Parameters
    ----------
    state : BayesState
    main : MapBelief
        After the reading.
    other_m : float
        Unit in which the speed would be a walker's; 1 for metres.
    """
    if main.status is not Status.SEARCHING:
        return False
    return state.hold.step_unit_m != 1.0 or (not state.alternatives and other_m != 1.0)


def unit_of_next_m(state: BayesState, main: MapBelief, other_m: float) -> float:
    """Return the unit in which the next alternative reads lengths.

    Beside a search in another unit it is metres; beside one in metres every other alternative reads
    the other unit, and beside a position that was found every third one.
    """
    unit_m = state.hold.step_unit_m
    if main.status is not Status.SEARCHING:
        other = 1.0 if unit_m != 1.0 else other_m
        return other if state.alternatives % 3 == 2 else unit_m
    return other_m if unit_m == 1.0 and state.alternatives % 2 == 0 else 1.0


def log_odds_of_unit(unit_m: float) -> float:
    """Return the log odds of a unit of lengths before anything is measured."""
    return 0.0 if unit_m == 1.0 else _OTHER_UNIT_NATS


def is_unit_open(state: BayesState, main: MapBelief, other_m: float) -> bool:
    """Return whether an alternative that reads lengths in another unit keeps up.

    ``other_m`` is the unit in which the speed would be a walker's; 1 for metres.
    """
    other, unit_m = state.alternative, state.hold.step_unit_m
    if other is None or other.hold.step_unit_m == unit_m or (other_m == unit_m == 1.0):
        return False
    return other.log_bayes_factor(main) > _OPEN_NATS


def hold_after_takeover(state: BayesState) -> Hold:
    """Return how motion is read once the alternative has taken over."""
    return Hold() if state.alternative is None else state.alternative.hold
