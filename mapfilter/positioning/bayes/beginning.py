"""The belief of a known start, and whether it is claimed before anything is measured."""

from __future__ import annotations

from dataclasses import replace
from math import expm1

import numpy as np

from mapfilter.filters.contract import Status
from mapfilter.filters.hypotheses import NEAR_M
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.beliefs.first_hypotheses import Start
from mapfilter.positioning.bayes.claims import judged
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.sensors.undirected import UndirectedWay

_LEAST_AT_START = 0.8
"""Share of a known start within 50 m from which on it is one place, and tracked."""


def begun_at(
    beliefs: BeliefFilters,
    begun: BayesState,
    start: tuple[float, float, float],
    rng: np.random.Generator,
) -> BayesState:
    """Return a state with the belief of a known start.

    Parameters
    ----------
    beliefs : BeliefFilters
    begun : BayesState
        Before the first epoch.
    start : tuple of float
        East, north and standard deviation in m, in the CRS of the database.
    rng : numpy.random.Generator
    """
    sd_m = start[2]
    belief = beliefs.by_compass[True].init(Start(None, True, *start), rng)
    near = -expm1(-0.5 * (NEAR_M / sd_m) ** 2) if sd_m > 0 else 1.0
    known = near > max(beliefs.options.split_mass, _LEAST_AT_START)
    status = Status.TRACKING if known else Status.SEARCHING
    belief = replace(belief, status=status)
    watch = begun.watch._replace(undirected=UndirectedWay(since_m=0.0))
    state = replace(begun, belief=belief, status=status, proven=known, watch=watch)
    # Beliefs may wait from the first epoch on, and are not judged until one is weighed.
    return judged(beliefs, state, weighed=False, positioned=False)
