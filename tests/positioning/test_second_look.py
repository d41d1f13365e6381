"""A second look at the place that a search has found, by hand and on walks through a made town."""

from dataclasses import replace
from functools import cache
from math import exp, log

import numpy as np
import pytest
from made_filters import STATE, TRACKING, Beliefs, belief, gaining, rival, weighed
from made_town import SOUTH_M, WEST_M, Town, walk_log
from true_places import error_m

from mapfilter.filters.contract import Status
from mapfilter.models.street_motion import BIAS
from mapfilter.positioning.bayes.beliefs.new_beliefs import NewBeliefs
from mapfilter.positioning.bayes.certainty import certainty
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.rivals.alternative import AlternativeRules
from mapfilter.positioning.bayes.rivals.compared import still_open, winner
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules
from mapfilter.positioning.bayes.rivals.nearby import (
    confirms,
    looking_around,
    misplaced_log_odds,
    share_near,
)
from mapfilter.positioning.merging import epochs
from mapfilter.serving.state_file import decode, encode

RULES, CLAIMED = HoldRules(), (Status.CONVERGED, Status.TRACKING)


def some(*places, log_evidence=-10.0, status=Status.SEARCHING):
    """Hypotheses at places (east, m), all 400 m north."""
    one = belief(status, log_evidence)
    state = np.zeros((8, len(places)), dtype=np.float32)
    state[0], state[1] = places, 400.0
    log_weight = np.full(len(places), -log(len(places)))
    empty = np.empty((0, len(places)), dtype=np.float32)
    return replace(one, state=state, log_weight=log_weight, kept=empty)


def look(*places, start=0.2, gained=0.0, status=Status.SEARCHING):
    own = some(*places, log_evidence=-10.0 + gained, status=status)
    return HeldOtherwise(
        own, Hold(), log(0.02 / 0.98), 100.0, from_scratch=True, near_at_start=start
    )


def test_the_odds_of_another_place_are_those_of_bayes():
    """Two places: by the look's own shares the readings are 0.25 / (4 / 9) as likely near by."""
    one, main = look(500, 800, 800, 800, 800, start=0.4), some(500)
    near_likelihood, else_likelihood = 0.2 / 0.4, 0.8 / 0.6
    expected = 0.02 * else_likelihood / (0.98 * near_likelihood)
    assert exp(misplaced_log_odds(one, main)) == pytest.approx(expected)


def test_before_anything_is_read_they_are_the_usual_ones():
    one = look(500, 900, 900, 900, start=0.25)
    assert misplaced_log_odds(one, some(500)) == pytest.approx(log(0.02 / 0.98))


@pytest.mark.parametrize("places", [(500, 500), (900, 900)])
def test_they_are_finite_where_all_agree(places):
    odds = misplaced_log_odds(look(*places), some(500))
    assert (odds < -15) if places[0] == 500 else (odds > 8)


def test_a_second_look_counts_by_its_places_and_not_by_its_evidence():
    """It has learnt nothing of levels yet, so what it predicts is behind or ahead by chance."""
    main = some(500, status=TRACKING)
    for gained in (-20.0, 0.0, 20.0):
        one = look(500, 800, 800, 800, 800, start=0.4, gained=gained)
        odds = exp(misplaced_log_odds(one, main))
        found = certainty(AlternativeRules(), main, rivals=[one])
        assert found == pytest.approx(1 / (1 + odds))


def test_it_confirms_a_place_from_its_share_on():
    main = some(500)
    near, away = [520.0] * 20, [900.0]
    assert confirms(RULES, look(*near, *away), main)
    assert not confirms(RULES, look(*near[2:], *away), main)
    # Other rivals at the same place say nothing of it.
    assert not confirms(RULES, replace(look(*near), near_at_start=float("nan")), main)


def test_half_of_it_has_headings_as_the_belief():
    main, begun = some(500, 500), some(*np.linspace(300, 700, 8))
    main.state[BIAS], begun.state[BIAS] = 3.0, -0.25
    rng = np.random.default_rng(1)
    one = looking_around(RULES, main, begun, Hold(-1.0, 0.5), 70.0, rng)
    assert sorted(one.belief.state[BIAS].tolist()) == [-0.25] * 4 + [3.0] * 4
    assert begun.state[BIAS].tolist() == [-0.25] * 8
    assert (one.hold, one.start_m, one.is_look) == (Hold(-1.0, 0.5), 70.0, True)
    assert one.near_at_start == share_near(begun, main) == 2 / 8
    assert one.log_bayes_factor(main) == 0.0


@pytest.mark.parametrize(
    ("gained", "east_m", "status", "wins"),
    [
        (4.0, 800.0, TRACKING, True),
        (3.9, 800.0, TRACKING, False),
        (9.0, 540.0, TRACKING, False),
        (9.0, 800.0, Status.SEARCHING, False),
    ],
)
def test_it_takes_over_where_it_has_found_another_place_that_explains_more(
    gained, east_m, status, wins
):
    one, main = look(east_m, gained=gained, status=status), some(500)
    assert (winner(RULES, [one], main, 0.0) is one) == wins


@pytest.mark.parametrize(
    ("gained", "east_m", "travelled_m", "stays"),
    [
        (-24.9, 500.0, 499.0, True),
        (-25.1, 500.0, 499.0, False),
        (0.0, 500.0, 500.0, False),
        # Another place is looked at for longer.
        (0.0, 800.0, 1299.0, True),
        (0.0, 800.0, 1300.0, False),
    ],
)
def test_how_long_it_stays(gained, east_m, travelled_m, stays):
    one = look(east_m, gained=gained)
    found = still_open(RULES, [one], some(500), travelled_m)
    assert [x.belief for x in found] == ([one.belief] if stays else [])


def test_a_belief_that_has_just_converged_has_one_beside_it():
    around, priors = gaining(-2.0), []
    around.init = lambda prior, _: (priors.append(prior), some(480, 520, 700, 900))[1]
    state = replace(STATE, belief=some(500, 500, status=TRACKING))
    state, _ = weighed(Beliefs(looks=True, around=around), state)
    (one,) = state.held
    assert (one.is_look, one.start_m, one.near_at_start) == (True, 40.0, 0.5)
    # About the place of the belief, in the CRS of the area, without any reading.
    (prior,) = priors
    assert (prior.reading, prior.east_m, prior.north_m) == (None, 1500.0, 2400.0)
    assert (prior.sd_m, prior.compass) == (RULES.misplaced_sd_m, True)
    assert not weighed(Beliefs(), STATE)[0].held


@pytest.mark.parametrize(("east_m", "stays"), [(800.0, True), (520.0, False)])
def test_it_is_weighed_by_a_filter_of_its_own_until_it_confirms_the_belief(east_m, stays):
    beliefs = Beliefs(around=gaining(-3.0), held_otherwise=gaining(-1.0))
    own = replace(belief(Status.SEARCHING, -11.0, east_m=east_m), travelled_m=0.0)
    one = HeldOtherwise(own, Hold(), -3.9, 20.0, from_scratch=True, near_at_start=0.2)
    found, _ = weighed(beliefs, replace(STATE, held=(one,)))
    assert [left.belief.log_evidence for left in found.held] == ([-14.0] if stays else [])
    assert len(beliefs.around.readings) == 1
    assert not beliefs.held_otherwise.readings
    # It may not converge before its own null hypothesis is refuted.
    assert beliefs.around.readings[0].doubted


@pytest.mark.parametrize("wins", [True, False])
def test_an_alternative_that_takes_over_asks_for_one(wins):
    beliefs, asked = Beliefs(filter=gaining(-2.0, status=TRACKING)), []
    beliefs.asks_for_look = lambda before, _, *, taken_over: asked.append((before, taken_over))
    given = replace(STATE, alternative=rival(9.0 if wins else -9.0, status=TRACKING))
    found, _ = weighed(beliefs, given)
    assert found.takeovers == wins
    assert asked == [(STATE.belief, wins)]


TOWN = Town.of(2)
FILTER = BayesFilter().over_area(TOWN.area())
NEW = NewBeliefs(FILTER.beliefs, FILTER.sources)
SEEDS = range(1, 6)


def beside(log):
    """The start of a walk, moved to the next parallel street, 70 to 150 m away."""
    start, later = log.truth[["east_m", "north_m"]].to_numpy()[[0, 5]]
    across = 1 if abs(later[0] - start[0]) > abs(later[1] - start[1]) else 0
    lines = (TOWN.east_m + WEST_M, TOWN.north_m + SOUTH_M)[across]
    apart = np.abs(lines - start[across])
    start[across] = lines[np.argsort(apart)[1]]
    return start


@cache
def followed(looking, seed, *, right):
    """Follow a walk from where a search has led, with and without a second look."""
    log, rng = walk_log(TOWN, seed, 900.0, error_db=3.0), np.random.default_rng(seed)
    place = log.truth[["east_m", "north_m"]].to_numpy()[0] if right else beside(log)
    state, rows = FILTER.begin_at(*place, 5.0, rng), []
    if looking:
        state = NEW.looking_around(state, 0.0)
    for epoch in epochs(log):
        state, output = FILTER.step(state, epoch, rng)
        rows.append((error_m(log, output.fix), output.fix.status in CLAIMED))
    errors_m, claimed = np.array(rows).T
    return errors_m, claimed > 0


def test_a_search_that_took_a_parallel_street_is_claimed_less_and_found_sooner():
    """Five walks; positions are compared over the second half of each."""
    wrong, near = {}, {}
    for looking in (True, False):
        found = [followed(looking, seed, right=False) for seed in SEEDS]
        wrong[looking] = np.mean([np.mean(on & (off_m > 50)) for off_m, on in found])
        near[looking] = np.mean([np.mean(off_m[len(off_m) // 2 :] < 50) for off_m, _ in found])
    assert wrong[True] < 0.5 * wrong[False]
    assert near[True] > near[False]


def test_a_search_that_took_the_right_place_is_claimed_after_some_way():
    claimed = {}
    for looking in (True, False):
        found = [followed(looking, seed, right=True) for seed in SEEDS]
        assert np.mean([np.mean(on & (off_m > 50)) for off_m, on in found]) < 0.02
        claimed[looking] = np.mean([on.mean() for _, on in found])
    assert 0.5 * claimed[False] < claimed[True] < claimed[False]


def test_a_state_that_looks_goes_on_from_a_file():
    log, rng = walk_log(TOWN, 3, error_db=3.0), np.random.default_rng(3)
    start = log.truth.iloc[0]
    state = NEW.looking_around(FILTER.begin_at(start["east_m"], start["north_m"], 5.0, rng), 0.0)
    kept = decode(encode({"state": state}), "made")["state"]
    other = np.random.default_rng(3)
    other.bit_generator.state = rng.bit_generator.state
    for epoch in epochs(log)[:30]:
        (state, output), (kept, again) = (
            FILTER.step(one, epoch, own) for one, own in ((state, rng), (kept, other))
        )
        assert output.fix == again.fix
    assert any(one.is_look for one in kept.held)
