"""The summary by arrays is the compiled one, within rounding."""

import numpy as np
import pytest
import strict_arrays
from hypothesis import given, settings
from hypothesis import strategies as st

from mapfilter.filters.array_summary import summarise_arrays
from mapfilter.filters.hypotheses import Bins, summarise

BINS = Bins(0.0, 0.0, 25.0, 40, 30)


def cloud(seed, places, count, spread_m):
    """A cloud about some places, not all of it in the bins, with weights from 1e-6 up."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform((0.0, 0.0), (1000.0, 750.0), (places, 2))
    mass = rng.dirichlet(np.full(places, 0.7))
    of_place = rng.choice(places, count, p=mass)
    place = middle[of_place] + spread_m * rng.standard_normal((count, 2))
    state = np.vstack([place.T, rng.normal(0, 0.3, (3, count))]).astype(np.float32)
    weight = rng.gamma(0.5, size=count) + 1e-6
    return state, (weight / weight.sum()).astype(np.float32)


def assert_agree(found, expected):
    np.testing.assert_allclose(found.mean, expected.mean, atol=1e-3)
    np.testing.assert_allclose(found.covariance_m2, expected.covariance_m2, rtol=1e-3, atol=1e-2)
    np.testing.assert_allclose(found.radii_m, expected.radii_m, rtol=1e-3, atol=1e-2)
    assert found.mass_50m == pytest.approx(expected.mass_50m, abs=1e-5)
    np.testing.assert_allclose(found.runners_up, expected.runners_up, atol=1e-5)
    assert found.entropy_bits == pytest.approx(expected.entropy_bits, abs=1e-4)


@given(
    seed=st.integers(0, 2**32 - 1),
    places=st.integers(1, 4),
    count=st.integers(1, 3000),
    spread_m=st.sampled_from([0.0, 3.0, 20.0, 300.0]),
)
@settings(max_examples=60)
def test_the_summary_is_the_compiled_one(seed, places, count, spread_m):
    state, weight = cloud(seed, places, count, spread_m)
    expected = summarise(state, weight, BINS)
    assert_agree(summarise_arrays(state, weight, BINS), expected)
    there = [strict_arrays.asarray(one) for one in (state, weight)]
    assert_agree(summarise_arrays(*there, BINS), expected)


def test_far_away_hypotheses_lie_in_the_last_ring():
    state = np.array([[500.0, 30_500.0], [300.0, 300.0]], dtype=np.float32)
    weight = np.array([0.6, 0.4], dtype=np.float32)
    assert_agree(summarise_arrays(state, weight, BINS), summarise(state, weight, BINS))


def test_a_share_that_a_ring_reaches_exactly_ends_with_it():
    """Half of the belief is here, half of it 100 m away."""
    state = np.array([[500.0, 600.0], [300.0, 300.0]], dtype=np.float32)
    weight = np.array([0.5, 0.5], dtype=np.float32)
    found = summarise_arrays(state, weight, BINS)
    assert found.radii_m[0] == pytest.approx((1 / 30) ** 2)
    assert_agree(found, summarise(state, weight, BINS))


def test_shares_that_rounding_leaves_out_lie_beyond_the_last_ring():
    state, weight = np.full((2, 2), 300.0, np.float32), np.array([0.5, 0.4], np.float32)
    assert_agree(summarise_arrays(state, weight, BINS), summarise(state, weight, BINS))
