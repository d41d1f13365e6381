"""What a cloud of positions says."""

import numpy as np
import pytest

from mapfilter.filters.hypotheses import Bins, empty_summary, summarise

BINS = Bins.over((0.0, 0.0, 3000.0, 2000.0))


def cloud(*groups, rows=5, seed=0):
    """Normal clouds of (east, north, sd, count, mass)."""
    rng, parts, weights = np.random.default_rng(seed), [], []
    for east, north, sd, count, mass in groups:
        part = np.zeros((rows, count))
        part[0], part[1] = rng.normal(east, sd, count), rng.normal(north, sd, count)
        parts.append(part)
        weights.append(np.full(count, mass / count))
    return np.concatenate(parts, axis=1).astype(np.float32), np.concatenate(weights).astype("f4")


def test_one_normal_cloud():
    state, weight = cloud((1500.0, 700.0, 4.0, 20_000, 1.0))
    said = summarise(state, weight, BINS)
    np.testing.assert_allclose(said.mean[:2], [1500, 700], atol=0.2)
    np.testing.assert_allclose(np.diag(said.covariance_m2), [16, 16], rtol=0.05)
    # Rayleigh: sd · √(-2 ln(1 - share)).
    np.testing.assert_allclose(said.radii_m, 4 * np.sqrt(-2 * np.log([0.5, 0.33, 0.05])), rtol=0.03)
    assert said.mass_50m == pytest.approx(1.0, abs=1e-3)
    assert not len(said.runners_up)


def test_leader_and_runners_up():
    groups = ((300.0, 300.0, 8.0, 500, 0.3), (2500.0, 1500.0, 8.0, 200, 0.6),
              (1000.0, 1800.0, 8.0, 900, 0.1))  # fmt: skip
    said = summarise(*cloud(*groups), BINS)
    np.testing.assert_allclose(said.mean[:2], [2500, 1500], atol=2)
    assert said.mass_50m == pytest.approx(0.6, abs=1e-3)
    np.testing.assert_allclose(said.runners_up[:, 2], [0.3, 0.1], atol=0.02)
    np.testing.assert_allclose(said.runners_up[:, :2], [[300, 300], [1000, 1800]], atol=25)
    # 60 % lie at the leader; 67 and 95 % reach to the others.
    assert said.radii_m[0] < 30
    assert said.radii_m[1] > 1400
    assert said.radii_m[2] > 1400


def test_entropy_counts_bins():
    east = np.repeat(np.arange(8) * 25 + 12.5, 10)
    state = np.zeros((5, 80), dtype=np.float32)
    state[0], state[1] = east, 112.5
    said = summarise(state, np.full(80, 1 / 80, dtype=np.float32), BINS)
    assert said.entropy_bits == pytest.approx(3.0, abs=1e-4)
    assert said.effective_bins == pytest.approx(8.0, rel=1e-3)


def test_positions_beyond_the_area_are_counted_at_its_edge():
    state, weight = cloud((-500.0, 5000.0, 1.0, 50, 1.0))
    assert summarise(state, weight, BINS).entropy_bits == pytest.approx(0.0, abs=1e-4)


def test_nothing_says_nothing():
    said = empty_summary(5)
    assert np.isnan(said.mean).all()
    assert said.mass_50m == 0
