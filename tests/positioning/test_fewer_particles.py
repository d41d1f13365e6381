"""Narrow beliefs that have been found have fewer particles, and stay what they are."""

from dataclasses import replace

import numpy as np
import pytest
from cross_world import WALK, truth
from test_bayes_grid import FINE_M, area, blocks, log, positioner, variation

from mapfilter.filters.contract import Status
from mapfilter.filters.particle import ParticleOptions
from mapfilter.positioning.bayes.alternative import AlternativeHypothesis
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import epochs
from mapfilter.positioning.gnss.gate import GnssState

__all__ = ["area", "log"]
SEEDS, MOST = 40, 3000


def tracked(filter_, log, seed=0, count=20):
    """The belief some epochs after a known start."""
    rng = np.random.default_rng(seed)
    _, east_m, north_m, _ = truth(WALK)
    track = filter_.begin_at(float(east_m[0]), float(north_m[0]), 8.0, rng)
    assert track.status is Status.TRACKING
    for epoch in epochs(log)[1:count]:
        track, _ = filter_.step(track, epoch, rng)
    return track.belief


def with_share(filter_, share):
    options = replace(filter_.options, min_particles=MOST, narrow_share=share)
    return replace(filter_, options=options)


def test_fewer_particles_agree_with_the_grid(area, log):
    exact = blocks(tracked(positioner(area, grid=True), log), FINE_M)
    few = with_share(positioner(area, grid=False), 1 / 3)
    found = [tracked(few, log, seed) for seed in range(SEEDS)]
    assert all(MOST / 3 <= one.count < MOST for one in found)
    each = np.array([blocks(one, FINE_M) for one in found])
    error = each.std(axis=0, ddof=1) / SEEDS**0.5
    # Besides chance there is what pixels of 5 m cannot resolve.
    assert np.all(np.abs(each.mean(axis=0) - exact) <= 4 * error + 0.005)
    by_chance = 0.5 * np.sqrt(2 * exact * (1 - exact) / (np.pi * MOST / 3)).sum()
    # Between two resamplings half of the particles may count.
    assert np.mean([variation(one, exact) for one in each]) <= 2**0.5 * by_chance + 0.02


def test_all_particles_stay_without_a_share(area, log):
    assert tracked(with_share(positioner(area, grid=False), 1.0), log).count == MOST


@pytest.mark.parametrize(
    ("bins", "least"), [(1.0, 1000), (6.7, 1005), (10.0, 1500), (19.9, 2985), (20.0, 3000)]
)
def test_wide_beliefs_get_a_share_in_proportion(bins, least):
    options = ParticleOptions(min_particles=MOST, narrow_share=1 / 3, wide_bins=20.0)
    assert options.least_found(bins) == least
    assert replace(options, narrow_share=1.0).least_found(bins) == MOST


def test_who_may_have_fewer(area):
    filter_ = BayesFilter().over_area(area)
    beliefs = filter_.beliefs
    state = filter_.begin_at(100.0, 100.0, 5.0, np.random.default_rng(0))
    few, usual = beliefs.filter_of(state), ParticleOptions()
    assert few.options.narrow_share == 0.5
    assert few.options.min_particles == usual.min_particles
    other = AlternativeHypothesis(state.belief, 0.0, 0.0)
    tested = replace(state, alternative=other)
    assert beliefs.filter_of(tested).options.narrow_share == 1.0
    assert beliefs.held_otherwise.options.narrow_share == 1.0
    far = replace(state.reckoning, travelled_m=1000.0)
    for gnss, share in ((GnssState(fix_used_at_m=0.0), 1.0), (GnssState(compared_at_m=0.0), 0.5)):
        moved = replace(state, sources={**state.sources, "gnss": gnss}, reckoning=far)
        assert beliefs.filter_of(moved).options.narrow_share == share
