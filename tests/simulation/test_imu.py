"""The inertial unit: exact without errors, and with the statistics that its errors promise."""

from dataclasses import replace
from math import degrees

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import ConfigError
from mapfilter.simulation.imu import noisy_motion
from mapfilter.tracks.deadreckoning import dead_reckon
from mapfilter.tracks.imu_noise import ImuNoise

PERFECT = ImuNoise(sigma_trans_m=0.0, sigma_orient_deg=0.0)


def straight(ticks, step_m=1.4, period_s=1.0):
    at = np.arange(ticks + 1)
    return pd.DataFrame({"time_s": at * period_s, "east_m": step_m * at, "north_m": 0.0 * at})


def motions(errors, journeys, truth, seed=5):
    rng = np.random.default_rng(seed)
    tables = [noisy_motion(truth, errors, rng) for _ in range(journeys)]
    return (
        np.array([table["step_m"] for table in tables]),
        np.array([table["heading_rad"] for table in tables]),
    )


def test_chords_by_hand():
    truth = pd.DataFrame(
        {"time_s": [5.0, 6.0, 8.0], "east_m": [0.0, 3.0, 3.0], "north_m": [0.0, 4.0, 2.0]}
    )
    motion = noisy_motion(truth, PERFECT, np.random.default_rng(0))
    assert motion["time_s"].tolist() == [6.0, 8.0]
    np.testing.assert_allclose(motion["step_m"], [5.0, 2.0])
    np.testing.assert_allclose(motion["heading_rad"], [np.arctan2(4, 3), -np.pi / 2])
    assert np.isnan(motion["turn_rad"][0])
    assert motion["turn_rad"][1] == pytest.approx(-np.pi / 2 - np.arctan2(4, 3))


def test_turns_wrap():
    truth = pd.DataFrame(
        {"time_s": [0.0, 1.0, 2.0], "east_m": [0.0, -1.0, -2.0], "north_m": [0.0, 0.1, 0.0]}
    )
    turn = noisy_motion(truth, PERFECT, np.random.default_rng(0))["turn_rad"]
    assert turn[1] == pytest.approx(2 * np.arctan(0.1))


def test_a_perfect_unit_leads_back_to_the_truth():
    rng = np.random.default_rng(2)
    truth = pd.DataFrame(
        {"time_s": np.arange(500.0)} | {n: rng.normal(size=500) for n in ("east_m", "north_m")}
    )
    motion = noisy_motion(truth, PERFECT, rng)
    east, north = dead_reckon(
        truth["east_m"][0], truth["north_m"][0], motion["step_m"], motion["heading_rad"]
    )
    np.testing.assert_allclose(east, truth["east_m"][1:], atol=1e-9)
    np.testing.assert_allclose(north, truth["north_m"][1:], atol=1e-9)


def test_bias_and_scale_are_one_draw_for_each_journey():
    errors = replace(PERFECT, bias_sd_deg=degrees(0.1), scale=0.05)
    journeys = 1500
    step, heading = motions(errors, journeys, straight(3))
    np.testing.assert_allclose(heading, heading[:, :1].repeat(3, axis=1))
    np.testing.assert_allclose(step, step[:, :1].repeat(3, axis=1))
    # Four standard errors of a mean and of a standard deviation.
    scale = np.log(step[:, 0] / 1.4)
    assert abs(heading[:, 0].mean()) < 4 * 0.1 / np.sqrt(journeys)
    assert abs(heading[:, 0].std() / 0.1 - 1) < 4 / np.sqrt(2 * journeys)
    assert abs(scale.mean()) < 4 * 0.05 / np.sqrt(journeys)
    assert abs(scale.std() / 0.05 - 1) < 4 / np.sqrt(2 * journeys)
    assert abs(np.corrcoef(scale, heading[:, 0])[0, 1]) < 4 / np.sqrt(journeys)


@pytest.mark.parametrize("period_s", [0.5, 2.0])
def test_drift_grows_with_the_root_of_time_whatever_the_period(period_s):
    rate = np.radians(0.5)
    errors = replace(PERFECT, drift_deg_per_sqrt_s=degrees(rate))
    journeys, ticks = 1200, int(64 / period_s)
    _, heading = motions(errors, journeys, straight(ticks, period_s=period_s))
    for after_s in (4.0, 16.0, 64.0):
        drift = heading[:, int(after_s / period_s) - 1]
        assert abs(drift.std() / (rate * np.sqrt(after_s)) - 1) < 4 / np.sqrt(2 * journeys)
    # Increments of separate intervals are independent.
    first, second = heading[:, ticks // 2], heading[:, -1] - heading[:, ticks // 2]
    assert abs(np.corrcoef(first, second)[0, 1]) < 4 / np.sqrt(journeys)


def test_white_noise_is_drawn_once_per_interval():
    step, heading = motions(
        ImuNoise(sigma_trans_m=0.2, sigma_orient_deg=degrees(0.1)), 200, straight(100)
    )
    n = step.size
    assert abs(step.std() / 0.2 - 1) < 4 / np.sqrt(2 * n)
    assert abs(heading.std() / 0.1 - 1) < 4 / np.sqrt(2 * n)
    assert abs(np.mean((step[:, 1:] - 1.4) * (step[:, :-1] - 1.4)) / 0.04) < 4 / np.sqrt(n)


def test_as_printed_reads_equation_7_literally():
    step, _ = motions(replace(PERFECT, translation_noise="as_printed"), 1, straight(4))
    np.testing.assert_allclose(step, 2.8)


def test_every_wrong_error_is_told():
    with pytest.raises(ConfigError) as caught:
        ImuNoise(
            sigma_trans_m=-0.1,
            sigma_orient_deg=573.0,
            bias_sd_deg=np.nan,
            scale=1.0,
            translation_noise="double",  # type: ignore[arg-type]
        )
    message = str(caught.value)
    for part in ("sigma_trans_m", "0..360", "bias_sd_deg", "scale", "as_printed"):
        assert part in message
