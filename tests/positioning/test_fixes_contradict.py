"""Fixes that agree with each other against a belief, by hand and in a made town."""

from dataclasses import replace
from functools import cache
from math import exp, inf, nan, pi, radians

import numpy as np
import pytest
from made_filters import STATE, UPDATES, Beliefs, belief, rival, weighed
from made_town import CRS, Town, walk_log

from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.certainty import certainty
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.rivals.alternative import AlternativeRules
from mapfilter.positioning.bayes.rivals.contradicted import hold_of_next, misreads
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.gnss.source import GnssSource
from mapfilter.positioning.gnss.state import GnssState
from mapfilter.positioning.gnss.trail import Contradiction, FixTrail
from mapfilter.positioning.loop import locate
from mapfilter.tracks.log import make_log

AHEAD = Contradiction(0.1, radians(5.0), 4, goes_on=True)
TURNED = Contradiction(radians(90.0), radians(5.0), 4, goes_on=True, nats=8.0)
JUMPED = AHEAD._replace(goes_on=False)


@pytest.mark.parametrize(
    ("hold", "found", "next_hold"),
    [
        (Hold(), None, Hold()),
        (Hold(-1.0, 0.5), None, Hold()),
        # As the belief reads them where fixes lie ahead, and from there on where they are turned.
        (Hold(-1.0, 0.5), AHEAD, Hold(-1.0, 0.5)),
        (Hold(-1.0, 0.5), AHEAD._replace(sd_rad=radians(11.0)), Hold()),
        (Hold(), TURNED, Hold(1.0, pi / 2)),
        (Hold(-1.0, 0.5), TURNED, Hold(-1.0, 0.5 + pi / 2)),
        (Hold(1.0, pi / 2), TURNED._replace(turned_rad=-pi / 2), Hold()),
    ],
)
def test_the_next_alternative_reads_headings_as_fixes_tell(hold, found, next_hold):
    state = BayesState(hold=hold)
    assert hold_of_next(state, 1.0, found) == next_hold
    assert hold_of_next(state, 0.3, found) == replace(next_hold, step_unit_m=0.3)
    assert hold_of_next(replace(state, compass=False), 1.0, found) == Hold()


@pytest.mark.parametrize(
    ("offset_deg", "found", "wrongly"),
    [(0.0, TURNED, True), (40.0, TURNED, False), (0.0, AHEAD, False), (70.0, AHEAD, True),
     (0.0, None, False), (70.0, AHEAD._replace(sd_rad=radians(11.0)), False)],
)  # fmt: skip
def test_an_alternative_that_reads_headings_otherwise_is_begun_anew(offset_deg, found, wrongly):
    other, state = rival(hold=Hold(1.0, radians(offset_deg))), BayesState()
    assert misreads(other, state, found) is wrongly
    assert not misreads(None, state, found)
    assert not misreads(other, replace(state, compass=False), found)
    assert misreads(rival(hold=Hold(-1.0)), state, AHEAD)


def test_an_alternative_begins_with_what_the_fixes_give():
    update = UPDATES[0]._replace(disputed=True, contradiction=TURNED)
    found, _ = weighed(Beliefs(), STATE, [update])
    assert found.alternative.hold == Hold(1.0, pi / 2)
    assert found.alternative.gnss_log_bayes_factor == 8.0
    # One that reads headings as they are makes room for it.
    found, _ = weighed(Beliefs(), replace(STATE, alternative=rival(-9.0)), [update])
    assert found.alternative.hold == Hold(1.0, pi / 2)
    kept = rival(-9.0, hold=Hold(1.0, 1.5))
    found, _ = weighed(Beliefs(), replace(STATE, alternative=kept), [update])
    assert found.alternative.hold == kept.hold


def state_with(found, *, proven=False, **changes):
    own = GnssState(fix_used_at_m=10.0, trail=FixTrail(contradiction=found))
    return BayesState(proven=proven, sources={GnssSource.name: own}, **changes)


@pytest.mark.parametrize(
    ("found", "proven", "log_odds"),
    [(None, False, -inf), (AHEAD, False, 0.0), (AHEAD, True, 0.0), (JUMPED, False, -3.0),
     (JUMPED, True, -6.0)],
)  # fmt: skip
def test_fixes_that_lie_apart_from_those_before_may_be_put_elsewhere(found, proven, log_odds):
    filters = BeliefFilters(model=None)
    assert filters.log_odds_of_fixes(state_with(found, proven=proven)) == log_odds


@pytest.mark.parametrize("lead", [-4.0, 0.0, 2.0])
def test_what_else_is_measured_decides_about_an_alternative_at_the_fixes(lead):
    """Their own part of its lead does not: they are in the odds beforehand."""
    rules, main = AlternativeRules(), belief(log_evidence=-10.0)
    other = rival(lead, gnss_log_bayes_factor=5.0)
    assert other.log_bayes_factor(main) == lead + 5.0
    for by_fixes in (0.0, -3.0, -6.0):
        odds = max(exp(lead + by_fixes), exp(lead + 5.0 - 8.0))
        found = certainty(rules, main, other, by_fixes=by_fixes)
        assert found == pytest.approx(1 / (1 + odds))
    assert certainty(rules, main, None, by_fixes=0.0) == 1.0


@pytest.mark.parametrize(
    ("found", "before", "after"),
    # One nat a fix and three at most; two, and twelve, of a way that goes on.
    [(None, 0.5, 1.5), (None, 2.9, 3.0), (JUMPED, 2.9, 3.0), (AHEAD, 0.5, 2.5), (AHEAD, 11.0, 12.0),
     (None, 11.0, 11.0)],
)  # fmt: skip
def test_fixes_whose_way_goes_on_count_for_more(found, before, after):
    area = Town.of(1).area()
    source = GnssSource(area, BayesFilter().over_area(area).satellites)
    other = rival(gnss_log_bayes_factor=before, start_s=100.0)
    found = source._weighted(found, proven=False)
    assert source._supported(other, 1.0, 100.0, found).gnss_log_bayes_factor == after
    assert source._weighted(AHEAD, proven=False).nats == 8.0
    assert source._weighted(AHEAD._replace(fixes=9), proven=False).nats == 12.0
    assert source._weighted(JUMPED, proven=False).nats == 0.0
    # Beside a belief that was found without positions these may lead away.
    assert source._weighted(AHEAD, proven=True).nats == 0.0


@pytest.mark.parametrize(("other_m", "alone"), [(nan, True), (90.0, True), (110.0, False)])
def test_positions_that_the_alternative_uses_are_measured_too(other_m, alone):
    """Over roads alone: 200 m after the last one the map is the evidence."""
    filters = BeliefFilters(model=None)
    filters.__dict__["map_may_start"] = True
    other = None if np.isnan(other_m) else rival(sources={"gnss": GnssState(fix_used_at_m=other_m)})
    reckoning = replace(BayesState().reckoning, travelled_m=301.0)
    assert filters.by_map_alone(state_with(None, reckoning=reckoning, alternative=other)) is alone


# In a made town: a fix of 5 m every third step of 5 m, and a compass that is askew.
TOWN = Town.of(1)
AREA = TOWN.area()


@cache
def located(seed, askew_deg, moved_m=0.0):
    """Return the errors of a walk's positions, and which of them are claimed."""
    log = walk_log(TOWN, seed, 1500.0, turned_rad=radians(askew_deg), levels=False)
    rng, truth = np.random.default_rng((seed, 7)), log.truth.iloc[::3]
    moved = moved_m * ((truth["time_s"] > 120) & (truth["time_s"] < 180))
    fixes = truth.assign(
        east_m=truth["east_m"] + moved + rng.normal(0, 5, len(truth)),
        north_m=truth["north_m"] + rng.normal(0, 5, len(truth)),
        var_east_m2=25.0, var_north_m2=25.0, cov_east_north_m2=0.0,
    )  # fmt: skip
    given = make_log(CRS, motion=log.motion, radio=log.radio, gnss=fixes, truth=log.truth)
    filter_ = BayesFilter(claim_mass=0.95).over_area(AREA)
    found = locate(given, filter_, np.random.default_rng(5)).estimate
    error_m = np.hypot(
        found.east_m - log.truth["east_m"].to_numpy(),
        found.north_m - log.truth["north_m"].to_numpy(),
    )
    claimed = np.array([one in (Status.TRACKING, Status.CONVERGED) for one in found.status])
    return error_m, claimed


@pytest.mark.parametrize("askew_deg", [90.0, -180.0])
def test_a_compass_that_is_askew_is_found_by_fixes(askew_deg):
    wrong = right = count = 0
    for seed in range(3):
        error_m, claimed = located(seed, askew_deg)
        wrong += int((claimed & (error_m > 50)).sum())
        right += int((claimed & (error_m <= 50)).sum())
        count += len(claimed)
    assert right > 0.8 * count
    assert wrong < 10


def test_fixes_that_are_put_elsewhere_for_a_while_are_not_followed():
    for seed in range(3):
        error_m, claimed = located(seed, 0.0, 400.0)
        assert claimed.mean() > 0.8
        assert error_m[claimed].max() < 50
