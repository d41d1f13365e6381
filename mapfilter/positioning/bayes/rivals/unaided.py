"""A belief without positions, which tells whether those lead away from where the phone is.

Fixes of a receiver that is led astray slowly agree, each of them, with the belief of a second ago,
while errors of headings, steps and levels, all of which may change, take up the difference. So
beside a belief that is weighed by positions a smaller one goes on without them, from time to time
begun anew. Both predict the same motion, ways and reports. Given good positions the main belief
predicts them better, or as well; where the positions lead away, worse with each metre. The
difference of their log evidence, with the odds of such an event, decides as for a phone that may
have been turned (:mod:`mapfilter.positioning.bayes.rivals.held`).

Positions may be wrong from the start. A belief that they have found is therefore *proven* first: by
one that begins with a report alone, and converges to the same place.
"""

from __future__ import annotations

from dataclasses import replace
from math import nan

import numpy as np

from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.rivals.alternative import MapBelief, NullHypothesis
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise, smaller
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.hold_rules import PullRules
from mapfilter.positioning.bayes.state import BayesState


def without_positions(
    rules: PullRules,
    belief: ParticleBelief,
    null: NullHypothesis,
    hold: Hold,
    travelled_m: float,
    rng: np.random.Generator,
) -> HeldOtherwise:
    """Return the belief that takes no positions from here on.

    Parameters
    ----------
    rules : PullRules
    belief, null : ParticleBelief and NullHypothesis
        The main belief, and what speaks against it.
    hold : Hold
        How it reads headings.
    travelled_m : float
        By dead reckoning.
    rng : numpy.random.Generator
        For the draws of this belief alone.
    """
    own = smaller(rules, belief, 0.0, rng)
    return HeldOtherwise(own, hold, rules.log_prior, travelled_m, null)


def searching_alone(
    rules: PullRules,
    main: ParticleBelief,
    begun: ParticleBelief,
    hold: Hold,
    travelled_m: float,
) -> HeldOtherwise:
    """Return a belief that has begun with a report alone, as a rival of the main belief.

    Parameters
    ----------
    rules : PullRules
    main, begun : ParticleBelief
    hold : Hold
        How the main belief reads headings.
    travelled_m : float
        By dead reckoning.
    """
    begun = replace(begun, log_evidence=main.log_evidence)
    return HeldOtherwise(begun, hold, rules.log_prior, travelled_m, from_scratch=True)


def beside_alternative(state: BayesState, main: MapBelief) -> tuple[HeldOtherwise, ...]:
    """Return the beliefs without positions as rivals of the alternative that takes over.

    One that began as the main belief goes with that.

    Parameters
    ----------
    state : BayesState
        Before the reading by which the alternative takes over.
    main : ParticleBelief or GridBelief
        The main belief before that reading.
    """
    alternative = state.alternative
    if alternative is None:
        return ()
    least = main.log_evidence + alternative.log_bayes_factor(main)
    return tuple(
        replace(one, belief=_with_evidence(one.belief, alternative.belief, least), ahead_m=nan)
        for one in state.unaided
        if one.from_scratch
    )


def _with_evidence(belief: ParticleBelief, other: MapBelief, log_evidence: float) -> ParticleBelief:
    """Return a belief whose log evidence is as far from another's as it was from a value."""
    return replace(belief, log_evidence=other.log_evidence + belief.log_evidence - log_evidence)
