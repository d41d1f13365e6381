"""Radii hold as often as they should, and poor matches get larger ones."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapfilter.positioning.fingerprints.regions import LEVELS, Errors, calibrate, coverage


def drawn(rng, count, blocks=10, between=0.0):
    """Errors that grow with the spread, and with the mismatch beyond that."""
    spread_m = rng.gamma(2.0, 10.0, count)
    mismatch = rng.uniform(0, 1, count)
    block = rng.integers(0, blocks, count)
    factor = np.exp(between * rng.standard_normal(blocks))[block]
    error_m = factor * (spread_m + 5) * (1 + 4 * mismatch**4) * rng.rayleigh(0.8, count)
    return Errors(error_m, spread_m, mismatch, block)


def held(regions, errors):
    radii_m = regions.radii_m(errors.spread_m, errors.mismatch)
    return (errors.error_m[:, None] <= radii_m).mean(axis=0)


@pytest.mark.parametrize("seed", range(5))
def test_radii_hold_new_errors_as_often_as_stated(seed):
    rng = np.random.default_rng(seed)
    regions = calibrate(drawn(rng, 2000))
    np.testing.assert_allclose(held(regions, drawn(rng, 20_000)), LEVELS, atol=0.025)


def test_poor_matches_get_larger_radii_and_are_held_as_often():
    rng = np.random.default_rng(8)
    regions, new = calibrate(drawn(rng, 3000)), drawn(rng, 30_000)
    poor = new.mismatch > regions.edges[-1]
    np.testing.assert_allclose(held(regions, new.where(poor)), LEVELS, atol=0.04)
    low, high = regions.radii_m(np.array([20.0, 20.0]), np.array([0.0, 1.0]))
    assert (high > 1.5 * low)[2]


def test_blocks_that_differ_widen_the_radii():
    alike, apart = [], []
    for seed in range(12):
        regions = calibrate(drawn(np.random.default_rng(seed), 800, between=0.6))
        new = drawn(np.random.default_rng(1000 + seed), 8000, blocks=400, between=0.6)
        apart.append(held(regions, new)[2])
        plain = drawn(np.random.default_rng(seed), 800, between=0.6)
        one = Errors(plain.error_m, plain.spread_m, plain.mismatch, np.zeros(800, dtype=np.int64))
        alike.append(held(calibrate(one), new)[2])
    assert np.mean(apart) > np.mean(alike) + 0.005
    assert 0.92 < np.mean(apart) < 0.99


def test_coverage_is_judged_without_the_own_block():
    rng = np.random.default_rng(4)
    errors = drawn(rng, 600, blocks=3)
    # One block is twenty times worse than the others: they cannot calibrate it.
    worse = np.where(errors.block == 0, 20.0, 1.0)
    changed = Errors(worse * errors.error_m, errors.spread_m, errors.mismatch, errors.block)
    shares = []
    for block in range(3):
        out = changed.block == block
        shares.append(held(calibrate(changed.where(~out)), changed.where(out)) * out.sum())
    np.testing.assert_allclose(coverage(changed), np.sum(shares, axis=0) / 600)
    assert coverage(changed)[2] < 0.8
    assert coverage(errors)[2] == pytest.approx(0.95, abs=0.03)


def test_one_block_has_no_coverage():
    errors = drawn(np.random.default_rng(0), 50, blocks=1)
    assert np.isnan(coverage(errors)).all()


@settings(max_examples=20)
@given(
    seed=st.integers(0, 10_000),
    count=st.integers(1, 150),
    blocks=st.integers(1, 8),
    scale=st.sampled_from([1.0, 0.0, 1e-9, 1e6]),
)
def test_radii_are_finite_and_nested(seed, count, blocks, scale):
    rng = np.random.default_rng(seed)
    errors = drawn(rng, count, blocks)
    errors = Errors(scale * errors.error_m, errors.spread_m, errors.mismatch, errors.block)
    radii_m = calibrate(errors).radii_m(np.array([0.0, 1.0, 1e4]), np.array([-1e9, 0.5, 1e9]))
    assert np.isfinite(radii_m).all()
    assert (np.diff(radii_m, axis=1) >= 0).all()


def test_without_classes_the_radius_is_the_conformal_quantile():
    # Nineteen errors: the 95 % radius is the 19th of 20 possible ranks, the largest.
    error_m = np.arange(1.0, 20.0)
    errors = Errors(error_m, np.zeros(19), np.zeros(19), np.zeros(19, dtype=np.int64))
    radii_m = calibrate(errors).radii_m(np.zeros(1), np.zeros(1))
    np.testing.assert_allclose(radii_m, [[10.0, 14.0, 19.0]])
