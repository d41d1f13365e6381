"""Which positions are claimed: the status that is reported of a belief after an epoch."""

from __future__ import annotations

from dataclasses import replace
from math import nan

from mapfilter._changes import changed
from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.certainty import Recovery, certainty, is_elsewhere
from mapfilter.positioning.bayes.rivals.alternative import MapBelief
from mapfilter.positioning.bayes.state import BayesState

_AGAIN_M = 5.0
"""Way from the last doubt on which a position has to be certain: at a rest nothing but levels tells
whether it is one, and along some streets they do not change."""


def judged(
    beliefs: BeliefFilters, state: BayesState, *, weighed: bool, positioned: bool
) -> BayesState:
    """Return a state that is LOST or UNCERTAIN where its position is not to be claimed.

    It is LOST while its belief is spread over more than one place: below the mass at which it
    searches again, it has to converge anew. A belief in one place that is not certain enough
    is UNCERTAIN; so is one that was lost without a new search, or was uncertain, until it has
    agreed for some way.

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
    belief, recovery = state.belief, state.recovery
    if belief is None or belief.status is Status.SEARCHING or positioned:
        recovery = None
    elif _contradicted(beliefs, state):
        recovery = Recovery()
    if belief is not None and state.status is Status.TRACKING:
        claimed, recovery = _claim(beliefs, state, recovery, weighed=weighed, kept=not positioned)
        if not claimed:
            return changed(state, status=Status.UNCERTAIN, recovery=recovery)
    return state if recovery is state.recovery else changed(state, recovery=recovery)


def tracked(state: BayesState) -> BayesState:
    """Return a state as TRACKING where only its last report was in doubt, and not its belief."""
    if not (state.contested or state.status is Status.UNCERTAIN):
        return state
    return changed(state, status=Status.TRACKING, contested=False)


def _claim(
    beliefs: BeliefFilters,
    state: BayesState,
    recovery: Recovery | None,
    *,
    weighed: bool,
    kept: bool,
) -> tuple[bool, Recovery | None]:
    """Return whether a tracked position is claimed, and what it recovers from afterwards.

    What is uncertain is claimed at once when it is certain where ``kept`` is false.
    """
    belief, rules, options = state.belief, beliefs.rules_of(state), beliefs.options_of(state)
    travelled_m = state.reckoning.travelled_m
    assert belief is not None
    agreed = rules.claimed_from
    if recovery is not None and recovery.lost:
        agreed = max(agreed, options.switch_mass)
    here = 1 - beliefs.left_share(state, state.watch)
    # What is enough has to be so with the probability of still being there.
    by_fixes = beliefs.log_odds_of_fixes(state)
    known = state.alternative, state.rivals, agreed / here, by_fixes
    probability = here * certainty(rules, belief, *known)
    certain = probability >= rules.claimed_from and not _is_tested(beliefs, state, belief)
    if recovery is not None and not recovery.lost:
        recovery = recovery.after(travelled_m, _AGAIN_M, agrees=certain)
    elif recovery is not None and weighed:
        # An alternative is in the probability, with its odds.
        agrees = probability >= options.switch_mass
        agrees = agrees and state.null.log_odds <= rules.converge_log_odds
        recovery = recovery.after(travelled_m, options.switch_hold_m, agrees=agrees)
    if recovery is None and kept and not certain:
        # That may be so though it agrees as a search does: a claim asks for more.
        recovery = Recovery(travelled_m, lost=False)
    return certain and recovery is None, recovery


def _is_tested(beliefs: BeliefFilters, state: BayesState, belief: MapBelief) -> bool:
    """Return whether an alternative elsewhere is tested, as readings contradicted the belief.

    A search from scratch pays for all places that it might be in. So its odds say little against
    a belief that went astray, until it has found one. Positions leave no such doubt.
    """
    if state.alternative is None or beliefs.used_positions(state):
        return False
    return is_elsewhere(state.alternative, belief)


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
