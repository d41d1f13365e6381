"""Kernels that take their numbers in groups, at sizes about those of a group, by plain formulas."""

import numpy as np
import pytest

from mapfilter._kernels import draw_key
from mapfilter.filters._rao_blackwell import Entries, copies, means, move, sums
from mapfilter.filters._square_root import cholesky_lanes
from mapfilter.filters.kalman import smooth
from mapfilter.filters.resampling import normalise, systematic

ABOUT_256 = (1, 2, 255, 256, 257, 511, 512, 513, 700)


@pytest.mark.parametrize("size", [*range(1, 34), 255, 256, 257])
def test_weights_of_any_number_sum_to_one(size):
    rng = np.random.default_rng(size)
    given = rng.normal(-300.0, 4.0, size + 9)
    # What lies beyond the last weight is no weight.
    log_weight, weight = given[:size].copy(), np.full(size, np.nan, np.float32)
    if size > 4:
        log_weight[rng.integers(size)] = -np.inf
    exact = np.exp(log_weight - log_weight.max())
    total = exact.sum()
    log_total, effective = normalise(log_weight, weight)
    assert log_total == pytest.approx(np.log(total) + given[:size][np.isfinite(log_weight)].max())
    np.testing.assert_allclose(weight, exact / total, rtol=2e-5, atol=1e-9)
    np.testing.assert_allclose(np.exp(log_weight), exact / total, rtol=2e-5, atol=1e-12)
    assert effective == pytest.approx(total**2 / (exact**2).sum(), rel=2e-5)


@pytest.mark.parametrize("place", range(17))
def test_the_one_weight_that_is_left_counts_wherever_it_is(place):
    log_weight, weight = np.full(17, -np.inf), np.empty(17, np.float32)
    log_weight[place] = -5.0
    assert normalise(log_weight, weight) == (-5.0, 1.0)
    assert np.flatnonzero(weight > 1e-30).tolist() == [place]
    chosen = np.empty(4, np.int32)
    systematic(weight, 0.5, chosen)
    assert set(chosen.tolist()) == {place}


@pytest.mark.parametrize("count", ABOUT_256)
def test_particles_of_any_number_are_moved(count):
    rng = np.random.default_rng(count)
    state, change = rng.normal(size=(3, count)), np.array([[0, 2.0, 0], [0, 0, 0], [0.5, 0, -1]])
    key, entries = draw_key(rng), Entries.of(change)
    still = move(state, entries, np.zeros((3, 2)), key)
    np.testing.assert_allclose(still, state + change @ state, atol=1e-12)
    noise = move(np.zeros((3, count)), entries, np.eye(3), key)
    assert np.unique(noise).size == noise.size, "no number is used twice"
    assert np.abs(noise).max() < 6
    np.testing.assert_allclose(move(state, entries, np.eye(3), key), still + noise, atol=1e-6)


@pytest.mark.parametrize("sources", [1, 2, 3, 4, 5])
def test_the_noise_of_each_source_is_normal_and_its_own(sources):
    rng = np.random.default_rng(sources)
    gain = rng.normal(size=(4, sources))
    moved = move(np.zeros((4, 40_000)), Entries.of(np.zeros((4, 4))), gain, draw_key(rng))
    np.testing.assert_allclose(moved.mean(axis=1), 0.0, atol=0.07)
    np.testing.assert_allclose(np.cov(moved), gain @ gain.T, atol=0.15)


@pytest.mark.parametrize("count", ABOUT_256)
def test_moments_of_any_number_of_particles(count):
    rng = np.random.default_rng(count)
    state, weight = rng.normal(1e6, 3.0, (3, count)), rng.random(count).astype(np.float32)
    share = weight.astype(float) / weight.astype(float).sum()
    mean, spread = sums(state, weight)
    exact = state @ share
    np.testing.assert_allclose(means(state, weight), exact, atol=1e-5)
    np.testing.assert_allclose(mean, exact, atol=1e-5)
    off = state - exact[:, None]
    np.testing.assert_allclose(spread, (off * share) @ off.T, atol=1e-5)
    chosen = rng.integers(count, size=count + 3).astype(np.int32)
    np.testing.assert_array_equal(copies(state, chosen), state[:, chosen])


@pytest.mark.parametrize("lanes", [1, 3, 64])
@pytest.mark.parametrize("size", [1, 2, 5])
def test_factors_beside_each_other(size, lanes):
    rng = np.random.default_rng(size)
    root = rng.normal(size=(lanes, size, size)) + 2 * np.eye(size)
    matrix = root @ root.transpose(0, 2, 1)
    given = matrix.transpose(1, 2, 0).copy()
    cholesky_lanes(given)
    found = np.tril(given.transpose(2, 0, 1))
    np.testing.assert_allclose(found, np.linalg.cholesky(matrix), atol=1e-9)


def test_singular_matrices_have_factors_and_negative_ones_none():
    direction = np.array([1.0, 2.0, -1.0])
    singular = np.outer(direction, direction)
    rounded = singular - 1e-15 * np.diag([0, 4.0, 0])
    small, large = singular - np.diag([0, 1e-9, 0]), singular - np.diag([0, 9.0, 0])
    given = np.ascontiguousarray(np.stack([singular, rounded, small, large], axis=-1))
    cholesky_lanes(given)
    for lane in (0, 1):
        factor = np.tril(given[..., lane])
        np.testing.assert_allclose(factor @ factor.T, singular, atol=1e-12)
    for lane in (2, 3):
        assert np.isnan(given[1, 1, lane]), "clearly negative"


def test_what_is_known_exactly_has_a_factor_of_zeros():
    """The first of three has no variance, and no covariance with the others."""
    given = np.array([[0.0, 0.0, 0.0], [0.0, 4.0, 6.0], [0.0, 6.0, 25.0]])[..., None].copy()
    cholesky_lanes(given)
    np.testing.assert_array_equal(np.tril(given[..., 0]), [[0, 0, 0], [0, 2, 0], [0, 3, 4]])


def test_smoothed_covariances_are_symmetric_to_the_last_digit():
    rng = np.random.default_rng(2)
    root = rng.normal(size=(2, 6, 3, 3))
    covariances = root @ root.transpose(0, 1, 3, 2) + 0.1 * np.eye(3)
    phi = np.eye(3) + 0.3 * rng.normal(size=(3, 3))
    smoothed = smooth(phi, 0.2 * np.eye(3), rng.normal(size=(2, 6, 3)), covariances)
    np.testing.assert_array_equal(smoothed.covariances, np.swapaxes(smoothed.covariances, -1, -2))
