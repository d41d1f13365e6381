"""Errors of an inertial unit that last for seconds, and turns whose errors add up.

Intervals are four standard errors, taken from the scatter of independent journeys.
"""

from math import degrees

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import ConfigError
from mapfilter.simulation.imu import noisy_motion
from mapfilter.tracks.imu_noise import ImuNoise

NONE = {"sigma_trans_m": 0.0, "sigma_orient_deg": 0.0}
WHITE = {**NONE, "sigma_orient_deg": degrees(0.1)}


def straight(ticks, period_s=1.0, step_m=1.4):
    at = np.arange(ticks + 1)
    return pd.DataFrame({"time_s": period_s * at, "east_m": step_m * at, "north_m": 0.0 * at})


def journeys(errors, count, truth, column, seed=7):
    rng = np.random.default_rng(seed)
    return np.array([noisy_motion(truth, errors, rng)[column] for _ in range(count)])


def assert_mean(samples, expected):
    """One number of each journey, whose mean is known."""
    off = 4 * samples.std(ddof=1) / np.sqrt(samples.size)
    assert abs(samples.mean() - expected) < off, (samples.mean(), expected, off)
    assert off < 0.25 * max(expected, 1.0)


@pytest.mark.parametrize(("period_s", "lag_s"), [(1.0, 5.0), (1.0, 20.0), (0.5, 20.0), (4.0, 8.0)])
def test_heading_errors_are_correlated_over_their_time(period_s, lag_s):
    errors = ImuNoise(**WHITE, heading_correlation_s=20.0)
    error = journeys(errors, 200, straight(100, period_s), "heading_rad") / 0.1
    lag = round(lag_s / period_s)
    assert_mean((error**2).mean(axis=1), 1.0)
    assert_mean((error[:, lag:] * error[:, :-lag]).mean(axis=1), np.exp(-lag_s / 20.0))


def test_heading_errors_are_as_large_at_the_start_as_at_the_end():
    errors = ImuNoise(**WHITE, heading_correlation_s=20.0)
    error = journeys(errors, 500, straight(40), "heading_rad") / 0.1
    for at in (0, 1, 20, 39):
        assert abs(error[:, at].std() - 1.0) < 4 / np.sqrt(2 * 500)


def test_uneven_intervals_forget_by_their_time():
    time_s = np.cumsum([0.0, 1.0, 1.0, 30.0, 2.0, 60.0])
    truth = pd.DataFrame({"time_s": time_s, "east_m": time_s, "north_m": 0.0})
    errors = ImuNoise(**WHITE, heading_correlation_s=20.0)
    error = journeys(errors, 1000, truth, "heading_rad") / 0.1
    for a, b in ((0, 1), (1, 2), (2, 3), (0, 4)):
        expected = np.exp(-(time_s[b + 1] - time_s[a + 1]) / 20.0)
        assert abs(np.mean(error[:, a] * error[:, b]) - expected) < 4 * np.sqrt(2 / 1000)


def test_heading_errors_without_a_time_are_white():
    error = journeys(ImuNoise(**WHITE), 200, straight(100), "heading_rad") / 0.1
    assert_mean((error[:, 1:] * error[:, :-1]).mean(axis=1), 0.0)


def test_the_step_scale_wanders_by_its_size_and_time():
    errors = ImuNoise(**NONE, step_scale_wander=0.1, step_scale_correlation_s=15.0)
    scale = np.log(journeys(errors, 200, straight(120), "step_m") / 1.4) / 0.1
    assert_mean((scale**2).mean(axis=1), 1.0)
    assert_mean((scale[:, 15:] * scale[:, :-15]).mean(axis=1), np.exp(-1.0))
    assert_mean((scale[:, 5:] * scale[:, :-5]).mean(axis=1), np.exp(-5 / 15))
    # Another one for each journey, and no lasting one beside it.
    assert_mean(scale.mean(axis=1), 0.0)


def test_the_wandering_scale_multiplies_steps_and_lasts_beside_the_journeys_own():
    rng = np.random.default_rng(1)
    both = ImuNoise(**NONE, scale=0.05, step_scale_wander=0.1)
    steps = np.array([noisy_motion(straight(30), both, rng)["step_m"] for _ in range(800)])
    logs = np.log(steps / 1.4)
    assert abs(logs.std() / np.hypot(0.05, 0.1) - 1) < 0.1
    # After thirty seconds two thirds of a wander are forgotten, the journey's scale is not.
    shared = np.mean(logs[:, 0] * logs[:, 29])
    assert abs(shared - (0.05**2 + 0.1**2 * np.exp(-29 / 15))) < 4 * 0.0125 / np.sqrt(800)
    standing = straight(30, step_m=0.0)
    rng = np.random.default_rng(1)
    assert not noisy_motion(standing.assign(east_m=0.0), both, rng)["step_m"].any()


def turned(errors, count, ticks, period_s=1.0):
    """Errors of the heading by added turns on a straight walk, (journeys, intervals - 1)."""
    turns = journeys(errors, count, straight(ticks, period_s), "turn_rad")
    assert np.isnan(turns[:, 0]).all()
    return np.cumsum(turns[:, 1:], axis=1)


@pytest.mark.parametrize("period_s", [0.5, 1.0, 2.0])
def test_a_gyros_noise_adds_up_with_the_root_of_time(period_s):
    rate = np.radians(0.2)
    errors = ImuNoise(**NONE, turns="gyro", gyro_noise_deg_per_sqrt_s=degrees(rate))
    count = 500
    error = turned(errors, count, round(128 / period_s) + 1, period_s)
    for after_s in (2.0, 32.0, 128.0):
        deviation = error[:, round(after_s / period_s) - 1].std()
        assert abs(deviation / (rate * np.sqrt(after_s)) - 1) < 4 / np.sqrt(2 * count)


def test_a_gyros_bias_adds_up_with_time():
    rate = np.radians(0.05)
    errors = ImuNoise(**NONE, turns="gyro", gyro_bias_deg_per_s=degrees(rate))
    error = turned(errors, 500, 101, 2.0)
    for interval in (1, 10, 100):
        deviation = error[:, interval - 1].std()
        assert abs(deviation / (rate * 2.0 * interval) - 1) < 4 / np.sqrt(2 * 500)
    # A constant rate: the journey's own.
    np.testing.assert_allclose(error[:, 99], 100 * error[:, 0], rtol=1e-9)


def test_a_gyro_knows_nothing_of_the_compasss_errors():
    compass = {"sigma_orient_deg": degrees(0.3), "bias_sd_deg": degrees(0.3)}
    errors = ImuNoise(sigma_trans_m=0.0, **compass, turns="gyro")
    corner = pd.DataFrame(
        {"time_s": [0.0, 1.0, 2.0, 3.0], "east_m": [0, 5, 5, 0], "north_m": [0, 0, 5, 5]}
    )
    motion = noisy_motion(corner, errors, np.random.default_rng(2))
    np.testing.assert_allclose(motion["turn_rad"][1:], [np.pi / 2, np.pi / 2])
    assert np.ptp(motion["heading_rad"] - [0.0, np.pi / 2, -np.pi]) > 0.05


def test_turns_of_headings_cancel():
    """However long one walks, the sum of turns is off by two heading errors only."""
    errors = ImuNoise(**WHITE, gyro_noise_deg_per_sqrt_s=57.0, gyro_bias_deg_per_s=57.0)
    count = 500
    error = turned(errors, count, 201)
    for interval in (1, 50, 200):
        deviation = error[:, interval - 1].std()
        assert abs(deviation / (0.1 * np.sqrt(2)) - 1) < 4 / np.sqrt(2 * count)


def test_a_turn_of_a_gyro_wraps_and_standing_turns_nothing():
    truth = pd.DataFrame(
        {
            "time_s": np.arange(6.0),
            "east_m": [0.0, -1.0, -1.0, -1.0, -2.0, -3.0],
            "north_m": [0.0, 0.1, 0.1, 0.1, 0.0, -0.1],
        }
    )
    turn = noisy_motion(truth, ImuNoise(**NONE, turns="gyro"), np.random.default_rng(0))["turn_rad"]
    expected = [0.0, 0.0, 2 * np.arctan(0.1), 0.0]
    np.testing.assert_allclose(turn[1:], expected, atol=1e-12)


def test_the_same_draws_scale_with_the_errors():
    truth = straight(50)

    def motion(**errors):
        return noisy_motion(truth, ImuNoise(**{**NONE, **errors}), np.random.default_rng(3))

    small, large = (
        motion(sigma_orient_deg=degrees(s), heading_correlation_s=20.0) for s in (0.01, 0.03)
    )
    np.testing.assert_allclose(large["heading_rad"], 3 * small["heading_rad"])
    gyro = {"turns": "gyro", "gyro_noise_deg_per_sqrt_s": degrees(0.01)}
    np.testing.assert_allclose(
        motion(**gyro)["turn_rad"][1:],
        motion(**gyro, sigma_trans_m=0.2, sigma_orient_deg=degrees(0.1))["turn_rad"][1:],
    )


def test_wrong_choices_and_values_are_refused():
    with pytest.raises(ConfigError) as caught:
        ImuNoise(turns="magnet", heading_correlation_s=-1.0, gyro_bias_deg_per_s=np.inf)  # type: ignore[arg-type]
    for part in ("'headings' or 'gyro'", "heading_correlation_s", "gyro_bias_deg_per_s"):
        assert part in str(caught.value)
