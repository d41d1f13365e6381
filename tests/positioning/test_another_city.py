"""Walks through the map's own town are found; those through another one are never claimed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_town import Town, slowed, walk_log

from mapfilter.filters.contract import Status
from mapfilter.models.street_motion import OFF, STATES
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.loop import locate

CLAIMED = (Status.CONVERGED, Status.TRACKING)
TOWN, OTHERS = Town.of(1), (Town.of(2), Town.of(3))
WALKS = 8


@pytest.fixture(scope="module")
def positioner():
    few = BayesFilter(max_particles=4000, min_search_particles=3000, min_particles=800)
    return few.over_area(TOWN.area())


def found(positioner, log, seed=0):
    log = slowed(log)
    estimate = locate(log, positioner, np.random.default_rng(seed)).estimate
    truth = log.truth
    off_m = np.hypot(estimate.east_m - truth["east_m"], estimate.north_m - truth["north_m"])
    claimed = np.array([status in CLAIMED for status in estimate.status])
    return estimate, np.asarray(off_m), claimed


def test_walks_through_the_maps_own_town_are_found(positioner):
    logs = [walk_log(TOWN, seed, error_db=3.0) for seed in range(WALKS)]
    walks = [found(positioner, log, seed) for seed, log in enumerate(logs)]
    switches = [estimate.converged_at for estimate, _, _ in walks]
    # Within 1.2 km, with a fifth of the usual number of particles.
    assert sum(at is not None for at in switches) >= 4
    for (_, off_m, claimed), at in zip(walks, switches, strict=True):
        assert at is None or off_m[at] < 50
        assert not claimed.any() or off_m[claimed].mean() < 25


def test_smoothing_brings_tracks_nearer(positioner):
    gains = []
    for seed in (0, 2, 4):
        log = walk_log(TOWN, seed, error_db=3.0)
        forward = found(positioner, log, seed)
        smoothed = found(replace(positioner, smooth=True), log, seed)
        assert forward[0].status == smoothed[0].status
        if forward[2].any():
            # Of the whole walk, also before the filter had converged.
            gains.append((np.median(smoothed[1]), np.nanmedian(forward[1])))
    assert len(gains) >= 2
    for after_m, before_m in gains:
        assert after_m < before_m


def test_a_belief_that_is_doubted_or_off_the_map_does_not_converge(positioner):
    model, mean = BayesModel(positioner.area), np.zeros(STATES)
    for off, doubted, expected in (
        (0.0, False, True), (0.49, False, True), (0.5, False, False), (0.0, True, False),
    ):  # fmt: skip
        mean[OFF] = off
        summary = SimpleNamespace(mean=mean)
        assert model.can_converge(summary, RadioReading(doubted=doubted)) is expected


@pytest.mark.parametrize(("levels", "at_most"), [(True, 1), (False, 1)])
def test_walks_through_another_town_are_hardly_ever_claimed(positioner, levels, at_most):
    """The same names of cells, other streets, sites and headings; with few particles."""
    claims, outside = [], 0
    for number, other in enumerate(OTHERS):
        for seed in range(WALKS - 2):
            log = walk_log(other, seed, turned_rad=0.6, levels=levels)
            estimate, _, claimed = found(positioner, log, seed)
            outside += Status.OUTSIDE in estimate.status
            if claimed.any():
                claims.append((number, seed))
    assert len(claims) <= at_most, claims
    assert outside >= 4
