"""How certain a position is, with all that competes with it, against sums by hand."""

from dataclasses import replace
from math import exp, inf, log
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.filters.contract import Status
from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.certainty import Recovery, certainty
from mapfilter.positioning.bayes.claims import judged
from mapfilter.positioning.bayes.rivals.alternative import AlternativeHypothesis, AlternativeRules
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.nearby import share_near
from mapfilter.positioning.bayes.state import BayesState

RULES = AlternativeRules()
BINS = Bins.over((0.0, 0.0, 2000.0, 2000.0))


def belief(*places, log_evidence=-50.0):
    """A hundred hypotheses, shared evenly by places (east, m), all at 1000 m north."""
    east_m = np.resize(np.array(places, dtype=np.float32), 100)
    state = np.stack([east_m, np.full(100, 1000.0, dtype=np.float32)])
    empty = np.empty((0, 100), dtype=np.float32)
    log_weight = np.full(100, -np.log(100.0))
    return ParticleBelief(state, log_weight, BINS, empty, log_evidence=log_evidence)


def turned(log_odds, *places, prior=-2.0):
    own = belief(*places, log_evidence=-50.0 + log_odds - prior)
    return HeldOtherwise(own, Hold(1.0, 3.0), prior, 0.0)


def test_without_rivals_it_is_the_mass_near_the_leading_hypothesis():
    assert certainty(RULES, belief(500.0)) == pytest.approx(1.0)
    assert certainty(RULES, belief(500.0, 500.0, 500.0, 900.0)) == pytest.approx(0.75)


@pytest.mark.parametrize("log_odds", [-3.0, 0.0, 2.0])
def test_a_turned_phone_counts_by_its_odds_where_it_is_elsewhere(log_odds):
    main, odds = belief(500.0), exp(log_odds)
    assert certainty(RULES, main, rivals=[turned(log_odds, 700.0)]) == pytest.approx(1 / (1 + odds))
    assert certainty(RULES, main, rivals=[turned(log_odds, 540.0)]) == pytest.approx(1.0)
    half = turned(log_odds, 520.0, 600.0)
    assert certainty(RULES, main, rivals=[half]) == pytest.approx((1 + odds / 2) / (1 + odds))
    # Two of them add up, and so does what the belief has elsewhere.
    spread = belief(500.0, 500.0, 500.0, 900.0)
    both = [turned(log_odds, 700.0), turned(log_odds, 510.0)]
    expected = (0.75 + odds) / (1 + 2 * odds)
    assert certainty(RULES, spread, rivals=both) == pytest.approx(expected)


def test_improbable_rivals_make_no_difference():
    improbable = [turned(-12.0, 700.0)]
    assert certainty(RULES, belief(500.0), rivals=improbable) == pytest.approx(1.0, abs=1e-5)
    assert certainty(RULES, belief(500.0), rivals=[turned(900.0, 700.0)]) < 1e-9


@pytest.mark.parametrize(("enough", "looked_at"), [(0.9, False), (0.95, True), (1.0, True)])
def test_where_a_rival_lies_is_looked_at_only_where_it_may_matter(enough, looked_at):
    """Odds of 0.06 leave 0.94 wherever the rival is; with half of it near there are 0.97."""
    rival, odds = turned(log(0.06), 520.0, 600.0), 0.06
    found = certainty(RULES, belief(500.0), rivals=[rival], enough=enough)
    assert found == pytest.approx((1 + looked_at * odds / 2) / (1 + odds))
    assert ("weight" in rival.belief.__dict__) == looked_at


def rival(log_odds, *places):
    """A belief in which the phone was turned, with these log odds to the bit."""
    return SimpleNamespace(belief=belief(*places), log_odds=lambda _: log_odds, is_look=False)


def test_limits_that_are_met_exactly():
    main = belief(500.0)
    assert certainty(RULES, main, rivals=[rival(-9.0, 700.0)]) == main.summary.mass_50m
    # As probable as what is enough: where the rival lies is not looked at.
    even, bound = rival(0.0, 500.0), main.summary.mass_50m / 2
    assert certainty(RULES, main, rivals=[even], enough=bound) == bound
    assert certainty(RULES, main, rivals=[even], enough=bound + 1e-9) == pytest.approx(1.0)


def test_a_position_is_claimed_again_after_it_has_agreed_for_some_way():
    assert Recovery().after(100.0, 20.0, agrees=True) == Recovery(100.0)
    assert Recovery(100.0).after(119.9, 20.0, agrees=True) == Recovery(100.0)
    assert Recovery(100.0).after(120.0, 20.0, agrees=True) is None
    assert Recovery().after(100.0, 0.0, agrees=True) is None
    assert np.isnan(Recovery(100.0).after(130.0, 20.0, agrees=False).agrees_from_m)
    doubted = Recovery(100.0, lost=False)
    assert doubted.after(119.9, 20.0, agrees=True) == doubted
    assert doubted.after(120.0, 20.0, agrees=True) is None
    assert doubted.after(130.0, 20.0, agrees=False) == Recovery(130.0, lost=False)


def alternative(log_bayes_factor, *places):
    other = belief(*places, log_evidence=log_bayes_factor)
    return AlternativeHypothesis(other, 0.0, -50.0)


def test_an_alternative_counts_by_the_threshold_at_which_it_takes_over():
    main = belief(500.0)
    assert RULES.lost_threshold == 8.0
    assert certainty(RULES, main, alternative(8.0, 900.0)) == pytest.approx(0.5)
    assert certainty(RULES, main, alternative(6.0, 900.0)) == pytest.approx(1 / (1 + exp(-2)))
    assert certainty(RULES, main, alternative(8.0, 530.0)) == pytest.approx(1.0)
    assert certainty(RULES, main, alternative(-5.0, 900.0)) == pytest.approx(1.0, abs=1e-5)


def test_a_rival_counts_from_one_in_eight_thousand_on_and_at_most_by_thirty_nats():
    main = belief(500.0)
    for log_odds, odds in ((-8.9, exp(-8.9)), (-9.1, 0.0), (20.0, exp(20.0)), (31.0, exp(30.0))):
        share = pytest.approx(1 / (1 + odds), rel=1e-6, abs=0.0)
        assert certainty(RULES, main, rivals=[turned(log_odds, 700.0)]) == share
        assert certainty(RULES, main, alternative(8.0 + log_odds, 900.0)) == share


@pytest.mark.parametrize(
    ("log_odds", "east_m", "north_m", "counts"),
    [(0.0, 30.0, 40.0, False), (0.0, 30.0, 40.1, True), (0.0, -30.1, -40.0, True),
     (-9.0, 900.0, 0.0, False)],
)  # fmt: skip
def test_an_alternative_counts_beyond_fifty_metres(log_odds, east_m, north_m, counts):
    main = SimpleNamespace(summary=SimpleNamespace(mean=(0.0, 0.0), mass_50m=1.0))
    there = SimpleNamespace(summary=SimpleNamespace(mean=(east_m, north_m)))
    other = SimpleNamespace(belief=there, log_bayes_factor=lambda _: 8.0 + log_odds)
    assert certainty(RULES, main, other) == (0.5 if counts else 1.0)


def test_the_share_near_a_place_is_that_within_fifty_metres_to_all_sides():
    main = SimpleNamespace(summary=SimpleNamespace(mean=np.array([100.0, 200.0, 7.0])))
    away = [(0, 0), (30, 40), (-30, -40), (40, -30), (30, 41), (-41, 30), (0, -51), (51, 0)]
    state = np.zeros((3, 8), dtype=np.float32)
    state[0] = [100 + east_m for east_m, _ in away]
    state[1] = [200 + north_m for _, north_m in away]
    weight = 2.0 ** -np.arange(1, 9)
    one = SimpleNamespace(state=state, weight=weight)
    assert share_near(one, main) == 1 / 2 + 1 / 4 + 1 / 8 + 1 / 16


def test_masses_on_a_grid_are_not_compared_with_turned_phones():
    """Their beliefs are of hypotheses, and a grid has none beside it."""
    grid = SimpleNamespace(summary=SimpleNamespace(mass_50m=0.9))
    assert certainty(RULES, grid, rivals=[turned(2.0, 700.0)]) == 0.9


@pytest.mark.parametrize(
    ("left_share", "status"),
    [(0.0, Status.TRACKING), (0.02, Status.TRACKING), (0.051, Status.UNCERTAIN)],
)
def test_a_rest_in_doubt_counts_beside_rivals_where_they_lie(left_share, status):
    """Odds of 0.05 leave 0.952 wherever the rival is, but it is in the very place."""
    main = replace(belief(500.0), status=Status.TRACKING)
    beliefs = SimpleNamespace(
        options=SimpleNamespace(split_mass=0.5),
        rules_of=lambda _: AlternativeRules(claimed_from=0.95),
        options_of=lambda _: SimpleNamespace(switch_mass=0.95, switch_hold_m=20.0),
        may_have_left=lambda _: False,
        is_unheard=lambda _: False,
        is_contested=lambda _: False,
        log_odds_of_fixes=lambda _: -inf,
        left_share=lambda *_: left_share,
    )
    state = BayesState(belief=main, status=Status.TRACKING, held=(turned(log(0.05), 500.0),))
    assert judged(beliefs, state, weighed=True, positioned=False).status is status
