"""Percentiles over tracks: by hand, and intervals that hold what they say."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.evaluation.track_percentiles import percentile_of_tracks, ratio_of_tracks


def test_by_hand_and_failures_are_worst():
    errors = np.array([[3.0, 1.0, np.nan], [2.0, 5.0, 4.0]])
    every = np.ones((2, 3), dtype=bool)
    assert percentile_of_tracks(errors, every, 0.5).value == 3.0
    assert percentile_of_tracks(errors, every, 5 / 6).value == 5.0
    assert np.isnan(percentile_of_tracks(errors, every, 0.9).value)
    known = np.isfinite(errors)
    assert percentile_of_tracks(errors, known, 0.9).value == 5.0
    assert percentile_of_tracks(errors, known, 0.9).epochs == 5


def test_intervals_end_where_too_much_fails():
    """Ten tracks of which one fails: with two of them among those drawn, 90 % is a failure."""
    errors = np.tile(np.arange(1.0, 11.0), (10, 1))
    errors[0] = np.nan
    found = percentile_of_tracks(errors, np.ones(errors.shape, dtype=bool), 0.9)
    assert (found.value, found.low) == (10.0, 9.0)
    assert np.isnan(found.high)


def test_nothing_counted():
    found = percentile_of_tracks(np.ones((2, 3)), np.zeros((2, 3), dtype=bool), 0.9)
    assert np.isnan([found.value, found.low, found.high]).all()
    assert found.epochs == 0


def test_intervals_hold_the_truth():
    """Tracks that differ among themselves; the 90 % point of their mixture is known."""
    rng = np.random.default_rng(12)
    scale = rng.exponential(1.0, 400_000)
    truth = np.quantile(scale * rng.exponential(1.0, scale.size), 0.9)
    inside = 0
    for _ in range(60):
        errors = rng.exponential(1.0, (40, 1)) * rng.exponential(1.0, (40, 30))
        found = percentile_of_tracks(errors, np.ones(errors.shape, dtype=bool), 0.9)
        inside += found.low <= truth <= found.high
    # 95 % of 60, less what a bootstrap of 40 tracks lacks.
    assert inside >= 50


def test_ratios_are_of_pairs():
    rng = np.random.default_rng(13)
    one = rng.exponential(1.0, (30, 1)) * rng.exponential(1.0, (30, 50))
    every = np.ones(one.shape, dtype=bool)
    half = ratio_of_tracks(0.5 * one, one, every, 0.9)
    assert (half.value, half.low, half.high) == pytest.approx((0.5, 0.5, 0.5))


def test_what_does_not_fit():
    with pytest.raises(InputError, match="tracks by epochs"):
        percentile_of_tracks(np.ones((2, 3)), np.ones((3, 2), dtype=bool), 0.9)
    with pytest.raises(InputError, match="share"):
        percentile_of_tracks(np.ones((2, 3)), np.ones((2, 3), dtype=bool), 90.0)
