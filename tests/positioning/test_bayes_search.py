"""A search that has lost the true place notices it, and goes on from scratch."""

from dataclasses import replace
from math import nan

import numpy as np
import pytest
from cross_world import make_database, walk_log
from true_places import error_m

from mapfilter.errors import ConfigError
from mapfilter.filters.contract import Status
from mapfilter.filters.particle import ParticleOptions
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.rivals.alternative import AlternativeRules, NullHypothesis
from mapfilter.positioning.loop import locate
from mapfilter.positioning.merging import epochs

FEW = BayesFilter(max_particles=4000, min_search_particles=2000, min_particles=500)


@pytest.fixture(scope="module")
def area(tmp_path_factory):
    return open_area(make_database(tmp_path_factory.mktemp("search")))


@pytest.mark.parametrize("seed", range(3))
def test_a_search_without_the_true_place_is_taken_over(area, seed):
    positioner = FEW.over_area(area)
    log, rng = walk_log(), np.random.default_rng(seed)
    track, switches = positioner.begin(), []
    for number, epoch in enumerate(epochs(log)):
        if number == 30:
            state = track.belief.state.copy()
            state[:2] = state[:2, :1] + np.array([[200.0], [0.0]], dtype=np.float32)
            astray = replace(
                track.belief, state=state, status=Status.SEARCHING, agreement_start_m=nan
            )
            track = replace(track, belief=astray, status=Status.SEARCHING)
        track, news = positioner.step(track, epoch, rng)
        if news.fix.status is Status.CONVERGED:
            switches.append(error_m(log, news.fix))
        assert news.fix.status is not Status.LOST
    assert track.takeovers >= 1
    assert len(switches) == 1
    assert switches[0] < 20


def test_beside_an_alternative_the_null_hypothesis_starts_anew_and_goes_its_own_way(area):
    """Only the main belief has been carried off the streets where it is measured."""
    positioner, log, rng = FEW.over_area(area), walk_log(), np.random.default_rng(1)
    track, pairs = positioner.begin(), []
    for number, epoch in enumerate(epochs(log)[:90]):
        if number == 30:
            state = track.belief.state.copy()
            state[:2] = state[:2, :1] + np.array([[200.0], [0.0]], dtype=np.float32)
            astray = replace(
                track.belief, state=state, status=Status.SEARCHING, agreement_start_m=nan
            )
            high = replace(track.null, log_odds=9.0)
            track = replace(
                track, belief=astray, status=Status.SEARCHING, null=high, alternative=None
            )
        before = track
        track, _ = positioner.step(track, epoch, rng)
        if number < 30 or before.alternative is None:
            continue
        if track.alternative is None:
            break
        pairs.append((before.alternative.null, track.alternative.null, track.null))
    assert pairs
    # The one beside the alternative is not the main one, which stays high.
    assert pairs[0][0] == NullHypothesis()
    for before, after, main in pairs:
        assert abs(after.log_odds - before.log_odds) < 3
        assert after.travelled_m < main.travelled_m
    assert pairs[0][1].log_odds < pairs[0][2].log_odds - 4
    # Taking over, it comes along.
    assert track.takeovers == 1
    assert track.null.log_odds < 3


def test_a_belief_does_not_converge_beside_a_null_hypothesis(area):
    never = AlternativeRules(start_log_odds=1e9, converge_log_odds=-1e6)
    positioner = replace(FEW.over_area(area), rules=never)
    estimate = locate(walk_log(), positioner, np.random.default_rng(0)).estimate
    assert set(estimate.status) == {Status.SEARCHING}
    assert estimate.mass_50m[-1] > 0.99


def test_copies_part_by_no_less_than_nothing():
    with pytest.raises(ConfigError, match="searching_jitter"):
        ParticleOptions(searching_jitter=(-1.0,))
