"""A belief that is spread over two places is uncertain, and lost below half in one of them."""

from dataclasses import replace
from math import nan

import numpy as np
import pytest
from made_town import Town

from mapfilter.filters.contract import MotionStep, Status
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import Epoch

SEARCHING, TRACKING, LOST = Status.SEARCHING, Status.TRACKING, Status.LOST
UNCERTAIN = Status.UNCERTAIN


@pytest.fixture(scope="module")
def positioner():
    few = BayesFilter(
        max_particles=2000, min_search_particles=500, min_particles=200, claim_mass=0.95
    )
    return few.over_area(Town.of(1).area())


def in_places(state, *shares):
    """The state with shares of its belief in places 300 m apart."""
    place = state.belief.state.copy()
    which = np.arange(place.shape[1]) % len(shares)
    place[0], place[1] = 100.0 + 300.0 * which, 100.0
    weight = np.array(shares)[which]
    belief = replace(state.belief, state=place, log_weight=np.log(weight / weight.sum()))
    return replace(state, belief=belief)


UNMEASURED, STANDING = MotionStep(nan, nan), MotionStep(0.0, nan)


def gone_on(state, way_m):
    """The state after a way, with its belief where it was."""
    reckoning = state.reckoning
    return replace(state, reckoning=replace(reckoning, travelled_m=reckoning.travelled_m + way_m))


def statuses(positioner, *sequence, motion=UNMEASURED, way_m=0.0):
    """Status reported, and that of the belief, after epochs with beliefs of given shares.

    The standing of an epoch leaves the belief as it is given.
    """
    rng = np.random.default_rng(1)
    state = positioner.begin_at(500_100.0, 4_500_100.0, 5.0, rng)
    for time_s, shares in enumerate(sequence):
        epoch, state = Epoch(float(time_s), (motion,)), gone_on(state, way_m if time_s else 0.0)
        state, output = positioner.step(in_places(state, *shares), epoch, rng)
        yield output.fix.status, state.belief.status


@pytest.mark.parametrize("motion", [UNMEASURED, STANDING])
@pytest.mark.parametrize(("way_m", "again"), [(0.0, UNCERTAIN), (5.0, TRACKING)])
def test_a_belief_in_two_places_is_uncertain_until_it_has_gathered(
    positioner, motion, way_m, again
):
    """And has been certain for some way since."""
    leading = 0.85, 0.97, 0.9, 0.55, 0.97
    shares = ((x, 1 - x) for x in leading)
    found = list(statuses(positioner, *shares, motion=motion, way_m=way_m))
    reported = UNCERTAIN, again, UNCERTAIN, UNCERTAIN, again
    assert found == [(status, TRACKING) for status in reported]


def test_a_belief_that_is_more_probably_elsewhere_searches_again(positioner):
    found = list(statuses(positioner, (0.4, 0.3, 0.3), (0.97, 0.02, 0.01)))
    assert found == [(LOST, SEARCHING), (LOST, SEARCHING)]


def test_what_was_uncertain_is_not_held_to_the_rules_of_a_new_search(positioner):
    """The null hypothesis may be anything that does not prevail by itself."""
    rng = np.random.default_rng(2)
    state = positioner.begin_at(500_100.0, 4_500_100.0, 5.0, rng)
    state = replace(state, null=replace(state.null, log_odds=-0.1))
    state, output = positioner.step(in_places(state, 0.7, 0.3), Epoch(0.0, (UNMEASURED,)), rng)
    assert output.fix.status is UNCERTAIN
    state = gone_on(in_places(state, 0.99, 0.01), 5.0)
    state, output = positioner.step(state, Epoch(2.0, (STANDING,)), rng)
    assert output.fix.status is TRACKING


def test_a_wide_known_start_counts_as_several_places(positioner):
    rng = np.random.default_rng(3)
    state = positioner.begin_at(500_100.0, 4_500_100.0, 27.0, rng)
    # One place, which is followed, but not certain enough to be claimed.
    assert (state.belief.status, state.status) == (TRACKING, UNCERTAIN)
    state = positioner.begin_at(500_100.0, 4_500_100.0, 29.0, rng)
    assert (state.belief.status, state.status) == (SEARCHING, SEARCHING)
