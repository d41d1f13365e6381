"""Which positions are claimed: the status that is reported of a belief after an epoch."""

from __future__ import annotations

from dataclasses import replace
from math import nan

from mapfilter._changes import changed
from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.certainty import Recovery, certainty
from mapfilter.positioning.bayes.state import BayesState


def judged(
    beliefs: BeliefFilters, state: BayesState, *, weighed: bool, positioned: bool
) -> BayesState:
    """Return a state that is LOST or UNCERTAIN where its position is not to be claimed.

    It is LOST while its belief is spread over more than one place: below the mass at which it
    searches again, it has to converge anew. A belief in one place that is not certain enough
    is UNCERTAIN; so is one that was lost without a new search, until it agrees again.

    Parameters
    ----------
    beliefs : BeliefFilters
    state : BayesState
    weighed : bool
        Whether a reading was used at this epoch.
    positioned : bool
        Whether a position or satellites were.
    """
    state = _in_one_place(beliefs, state)
    belief, rules, recovery = state.belief, beliefs.rules_of(state), state.recovery
    if belief is None or belief.status is Status.SEARCHING or positioned:
        recovery = None
    elif _contradicted(beliefs, state):
        recovery = Recovery()
    if belief is not None and state.status is Status.TRACKING:
        options, enough = beliefs.options_of(state), rules.claimed_from
        if recovery is not None:
            enough = max(enough, options.switch_mass)
        by_fixes = beliefs.log_odds_of_fixes(state)
        here = 1 - beliefs.left_share(state, state.watch)
        # What is enough has to be so with the probability of still being there.
        known = state.alternative, state.rivals, enough / here, by_fixes
        probability = here * certainty(rules, belief, *known)
        uncertain = probability < rules.claimed_from
        if recovery is not None and weighed:
            travelled_m = state.reckoning.travelled_m
            # An alternative is in the probability, with its odds.
            agrees = probability >= options.switch_mass
            agrees = agrees and state.null.log_odds <= rules.converge_log_odds
            recovery = recovery.after(travelled_m, options.switch_hold_m, agrees=agrees)
        if uncertain or recovery is not None:
            return changed(state, status=Status.UNCERTAIN, recovery=recovery)
    return state if recovery is state.recovery else changed(state, recovery=recovery)


def _contradicted(beliefs: BeliefFilters, state: BayesState) -> bool:
    """Return whether another hypothesis makes a position LOST, not a rest in doubt alone."""
    if state.status not in (Status.LOST, Status.OUTSIDE):
        return False
    return not state.contested or beliefs.is_contested(state)


def _in_one_place(beliefs: BeliefFilters, state: BayesState) -> BayesState:
    belief = state.belief
    if belief is None or state.status not in (Status.CONVERGED, Status.TRACKING):
        return state
    if belief.summary.mass_50m < beliefs.options.split_mass:
        belief = replace(belief, status=Status.SEARCHING, agreement_start_m=nan)
        return changed(state, belief=belief, status=Status.LOST, proven=False)
    left = beliefs.may_have_left(state) or beliefs.is_unheard(state)
    if left or beliefs.is_contested(state):
        return changed(state, status=Status.LOST, contested=True)
    return state
