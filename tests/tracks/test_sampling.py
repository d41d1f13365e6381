"""Errors of displacements by velocities sampled seconds apart, against simulated drives."""

import numpy as np
import pytest

from mapfilter.tracks.joining.sampling import sampling_sd_m


def deviations(time_s, *velocities):
    east, north = np.array(velocities, dtype=float).T
    return sampling_sd_m(np.array(time_s, dtype=float), east, north)


def test_a_steady_velocity_has_no_error():
    assert deviations((0, 5, 20), (8, -3), (8, -3), (8, -3)).tolist() == [0.0, 0.0]


def test_half_of_the_squared_change_is_the_intervals_own():
    # T² / (T + 5 s) |Δv| / √12, of which an interval has 1/√2 and its neighbours 1/2.
    found = deviations((0, 6, 12, 18, 24), (0, 0), (0, 0), (3, -4), (3, -4), (3, -4))
    whole_m = 36 / 11 * 5 / 12**0.5
    assert found.tolist() == pytest.approx([whole_m / 2, whole_m / 2**0.5, whole_m / 2, 0.0])


def test_an_edge_counts_as_its_own_neighbour():
    found = deviations((0, 6, 12, 18), (0, 0), (5, 0), (5, 0), (5, 0))
    assert found[0] == pytest.approx(36 / 11 * 5 / 12**0.5 * 0.75**0.5)
    assert deviations((0, 6), (0, 0), (0, 5)).tolist() == pytest.approx([36 / 11 * 5 / 12**0.5])


def test_intervals_count_by_their_own_length():
    short, long = deviations((0, 1, 11), (0, 0), (4, 0), (8, 0))
    assert long / short == pytest.approx((100 / 15) / (1 / 6))


def test_unknown_velocities_say_nothing():
    found = deviations((0, 6, 12, 18), (0, 0), (np.nan, np.nan), (4, 0), (9, 0))
    assert np.isfinite(found).all()
    assert found[0] == 0.0
    assert found[2] > 0
    # A velocity of the neighbours that changes does not count for an interval without one.
    beside = deviations((0, 6, 12, 18, 24), (0, 0), (9, 0), (np.nan, 0), (0, 9), (9, 0))
    assert beside[[1, 2]].tolist() == [0.0, 0.0]
    assert (beside[[0, 3]] > 0).all()
    assert deviations((0.0,), (1, 1)).size == 0


@pytest.mark.parametrize("period_s", [2.0, 6.0, 10.0])
def test_stop_and_go_errs_by_about_as_much(period_s):
    """Speeds between random values, with accelerations of 1.5 m/s²."""
    rng = np.random.default_rng(3)
    tick_s = 0.1
    speed, wanted = [0.0], 8.0
    for _ in range(60_000):
        if rng.random() < tick_s / 12:
            wanted = rng.choice([0.0, 4.0, 8.0, 12.0])
        speed.append(speed[-1] + np.clip(wanted - speed[-1], -1.5 * tick_s, 1.5 * tick_s))
    speed = np.array(speed)
    gone = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * tick_s)])
    every = round(period_s / tick_s)
    sampled, at_m = speed[::every], gone[::every]
    error_m = (sampled[1:] + sampled[:-1]) / 2 * period_s - np.diff(at_m)
    stated_m = sampling_sd_m(period_s * np.arange(sampled.size), sampled, 0 * sampled)
    # Stated to all sides, while a straight street has it along the way alone.
    ratio = np.sqrt(np.mean(error_m**2) / (2 * np.mean(stated_m**2)))
    assert 0.4 < ratio < 1.3
