"""A second look at the place that a search has found: it may be another one near by.

A search that converges has chosen among many places by the same reports, of which errors of levels
last for a hundred metres. So it may have chosen a parallel street, and what has died out of it
meanwhile does not come back. A belief therefore begins about the place that was found, which knows
nothing of the way there, and is weighed beside the main one by what is measured from then on, as a
rival is of a phone that was turned (:mod:`mapfilter.positioning.bayes.rivals.held`). Where the
place is right it comes to the same one soon; where it is not, it finds the right one, if that is
near, and takes over.
"""

from __future__ import annotations

from dataclasses import replace
from math import log

import numpy as np

from mapfilter.filters.hypotheses import NEAR_M
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.street_motion import BIAS
from mapfilter.positioning.bayes.rivals.alternative import MapBelief
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules

_LEAST_SHARE = 1e-6


def looking_around(
    rules: HoldRules,
    main: ParticleBelief,
    begun: ParticleBelief,
    hold: Hold,
    travelled_m: float,
    rng: np.random.Generator,
) -> HeldOtherwise:
    """Return a belief that has begun about the place that a search has found, as its rival.

    Half of its hypotheses have heading errors of the main belief, which may be those of a phone
    that was turned during the search.

    Parameters
    ----------
    rules : HoldRules
    main, begun : ParticleBelief
    hold : Hold
        How the main belief reads headings.
    travelled_m : float
        By dead reckoning.
    rng : numpy.random.Generator
        For the draws of this belief alone.
    """
    near, state = share_near(begun, main), begun.state.copy()
    share = np.exp(main.log_weight - main.log_weight.max())
    as_main = rng.choice(share.size, state[BIAS, ::2].size, p=share / share.sum())
    state[BIAS, ::2] = main.state[BIAS, as_main]
    begun = replace(begun, state=state, log_evidence=main.log_evidence)
    log_prior = _log_odds(rules.misplaced_probability)
    return HeldOtherwise(begun, hold, log_prior, travelled_m, from_scratch=True, near_at_start=near)


def confirms(rules: HoldRules, one: HeldOtherwise, main: ParticleBelief) -> bool:
    """Return whether a second look has come to the place of the main belief."""
    return one.is_look and share_near(one.belief, main) >= rules.confirm_mass


def misplaced_log_odds(one: HeldOtherwise, main: ParticleBelief) -> float:
    """Return the log odds, by a second look, that the main belief is in another place.

    The look's own places are compared with each other, not its evidence with that of the main
    belief, which has known the errors of levels and steps for some time.
    """
    share = share_near(one.belief, main)
    return one.log_prior - _log_odds(share) + _log_odds(one.near_at_start)


def _log_odds(share: float) -> float:
    share = min(max(share, _LEAST_SHARE), 1 - _LEAST_SHARE)
    return log(share / (1 - share))


def share_near(one: ParticleBelief, main: MapBelief) -> float:
    """Return the share of a belief within 50 m of the leading hypothesis of another."""
    east_m, north_m = main.summary.mean[:2]
    gone_east_m, gone_north_m = one.state[0] - east_m, one.state[1] - north_m
    near = gone_east_m * gone_east_m + gone_north_m * gone_north_m <= NEAR_M**2
    return float(np.dot(one.weight, near))
