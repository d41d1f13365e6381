"""Work that is divided among threads, and steps that are halved: the same as by plain formulas."""

from itertools import pairwise

import numpy as np
import pytest

from mapfilter.filters import kalman
from mapfilter.filters.gaussian import IEKF, Gaussian, Method
from mapfilter.filters.resampling import copy_with_jitter, taken
from mapfilter.models.ranging import timing_advances
from mapfilter.models.state import POSITION
from mapfilter.positioning.kalman.models import compiled


@pytest.mark.parametrize("cuts", [(0, 7), (0, 3, 7), (0, 1024, 1030, 2500), (0, 1, 1025, 2500)])
@pytest.mark.parametrize("rows", [1, 3, 6])
def test_parts_of_the_copies_are_those_of_the_whole(cuts, rows):
    """Neither is anything written beside a part."""
    rng, count = np.random.default_rng(rows), cuts[-1]
    state = rng.standard_normal((rows, 50)).astype("f4")
    log_weight, weight = rng.random(50), rng.random(50).astype("f4")
    chosen = np.sort(rng.integers(50, size=count)).astype(np.int32)
    jitter, key = np.array([0.5, 0.0, 2.0, 1.0, 0.1, 3.0], "f4")[:rows], np.uint64(7)
    whole = np.empty((rows, count), "f4")
    copy_with_jitter(0, count, state, chosen, jitter, key, whole)
    noise = np.full((rows, count), np.nan, "f4")
    log_of, weight_of = np.full(count, np.nan), np.full(count, np.nan, "f4")
    for first, stop in pairwise(cuts):
        copy_with_jitter(first, stop, state, chosen, jitter, key, noise)
        taken(first, stop, log_weight, weight, chosen, log_of, weight_of)
        for written in (noise[0], log_of, weight_of):
            assert np.flatnonzero(np.isnan(written)).tolist() == list(range(stop, count))
    np.testing.assert_array_equal(noise, whole)
    np.testing.assert_array_equal(log_of, log_weight[chosen])
    np.testing.assert_array_equal(weight_of, weight[chosen])
    still = [r for r in range(rows) if jitter[r] == 0]
    np.testing.assert_array_equal(whole[still], state[still][:, chosen])


SITES = np.array([[-50.0, 0.0], [50.0, 0.0]])


def ranges(place):
    return np.hypot(*(SITES - place).T)


def cost(place, mean, reading, sigma_m):
    """Minus twice the log density of a place, known to 100 m before, less a constant."""
    off = (place - mean) / 100.0
    return off @ off + (((reading - ranges(place)) / sigma_m) ** 2).sum()


@pytest.mark.parametrize("seed", [15, 24, 30, 36])
def test_steps_that_lead_up_are_halved(seed):
    """Ranges that contradict each other: full steps go up in each of these, and away in one."""
    rng = np.random.default_rng(seed)
    mean, reading = rng.normal(0, 60, 2), rng.uniform(0, 150, 2)
    sigma_m = [1.0, 10.0, 30.0][seed % 3]
    model = compiled(timing_advances(POSITION, SITES, [sigma_m] * 2))
    belief, told = kalman.update(Gaussian(mean, 1e4 * np.eye(2)), model, reading, IEKF)
    assert told.used

    def value(place):
        return cost(place, mean, reading, sigma_m)

    slope = [value(belief.mean + step) - value(belief.mean - step) for step in 1e-3 * np.eye(2)]
    np.testing.assert_allclose(np.array(slope) / 2e-3, 0.0, atol=1e-5)
    assert value(belief.mean) < value(mean)
    away = (belief.mean - SITES) / ranges(belief.mean)[:, None]
    information = np.eye(2) / 1e4 + away.T @ away / sigma_m**2
    np.testing.assert_allclose(belief.covariance, np.linalg.inv(information), rtol=1e-5)
    # Beside others, each is the same as alone.
    for count in (1, 2, 3):
        few, _ = kalman.update(
            Gaussian(mean, 1e4 * np.eye(2)), model, reading, Method("few", iterations=30 + count)
        )
        np.testing.assert_allclose(few.mean, belief.mean, atol=1e-5)
