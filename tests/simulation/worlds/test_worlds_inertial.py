"""Dead reckoning of the foreign world against its stated errors; intervals of four errors."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from mapfilter.angles import wrap_rad
from mapfilter.simulation.worlds.inertial import (
    InertialModel,
    compass_error_rad,
    counted_m,
    disturbance_rad,
    gyro_error_rad,
    motion_table,
)

PERFECT = InertialModel(
    heading_sd_deg=0.0, step_wander=0.0, missed=0.0, gyro_noise_deg_per_sqrt_s=0.0
)


def straight(seconds=600, speed_mps=1.4):
    time = np.arange(seconds + 1.0)
    return pd.DataFrame({"time_s": time, "east_m": 5e5 + speed_mps * time, "north_m": 4.5e6})


def around(seconds=600):
    """Once around a circle of 100 m, at 1.4 m/s."""
    time = np.arange(seconds + 1.0)
    angle = 1.4 * time / 100.0
    east, north = 5e5 + 100.0 * np.cos(angle), 4.5e6 + 100.0 * np.sin(angle)
    return pd.DataFrame({"time_s": time, "east_m": east, "north_m": north})


def moved(model, truth=None, seed=0):
    return motion_table(straight() if truth is None else truth, model, np.random.default_rng(seed))


def ticks(count=600):
    return np.arange(1.0, count + 1.0)


def test_a_perfect_unit_reports_the_truth():
    motion = moved(PERFECT, around())
    assert motion["step_m"].sum() == pytest.approx(840.0, abs=1.0)
    assert motion["turn_rad"].iloc[1:].to_numpy() == pytest.approx(0.014, abs=1e-4)
    assert np.isnan(motion["turn_rad"].iloc[0])
    assert motion["time_s"].tolist() == list(ticks())
    expected = wrap_rad(np.pi / 2 + 0.014 * (ticks() - 0.5))
    assert wrap_rad(motion["heading_rad"] - expected) == pytest.approx(0.0, abs=1e-6)


def test_distances_are_whole_steps():
    steps = moved(PERFECT)["step_m"] / 0.7
    assert steps.to_numpy() == pytest.approx(np.round(steps))
    assert steps.mean() == pytest.approx(2.0, abs=0.01)


def test_at_rest_no_steps_are_counted():
    motion = moved(PERFECT, straight(speed_mps=0.0))
    assert (motion["step_m"] == 0).all()


def test_missed_steps():
    model = replace(PERFECT, missed=0.03)
    found = counted_m(np.full(50_000, 1.4), ticks(50_000), model, np.random.default_rng(1))
    assert found.sum() / 70_000 == pytest.approx(0.97, abs=4 * np.sqrt(0.03 / 100_000))


def test_the_step_length_of_a_journey():
    model = replace(PERFECT, step_range=0.15)
    scale = [
        counted_m(np.full(300, 1.4), ticks(300), model, np.random.default_rng(seed)).sum() / 420
        for seed in range(500)
    ]
    assert 0.85 <= min(scale) < 0.88
    assert 1.12 < max(scale) <= 1.155
    assert np.mean(scale) == pytest.approx(1.0, abs=4 * 0.15 / np.sqrt(3 * 500))


def test_the_step_scale_of_a_data_sheet():
    model = replace(PERFECT, scale_sd=0.05)
    scale = [
        counted_m(np.full(300, 1.4), ticks(300), model, np.random.default_rng(seed)).sum() / 420
        for seed in range(500)
    ]
    assert np.std(np.log(scale)) == pytest.approx(0.05, rel=4 / np.sqrt(1000))


def test_the_compass_has_its_deviation_and_lasts():
    model = InertialModel(heading_sd_deg=6.0, heading_white=0.5, heading_correlation_s=8.0)
    error = np.degrees(compass_error_rad(ticks(60_000), model, np.random.default_rng(2)))
    assert error.std() == pytest.approx(6.0, rel=0.05)
    for lag in (1, 8, 20):
        correlation = np.corrcoef(error[:-lag], error[lag:])[0, 1]
        assert correlation == pytest.approx(0.5 * np.exp(-lag / 8.0), abs=0.05)


def test_the_lasting_heading_error_and_its_drift():
    model = replace(PERFECT, bias_sd_deg=10.0, drift_deg_per_sqrt_s=0.2)
    drawn = np.degrees(
        [compass_error_rad(ticks(), model, np.random.default_rng(seed)) for seed in range(1500)]
    )
    assert drawn[:, 0].std() == pytest.approx(10.0, rel=4 / np.sqrt(3000))
    walked = (drawn[:, -1] - drawn[:, 0]).std()
    assert walked == pytest.approx(0.2 * np.sqrt(599), rel=4 / np.sqrt(3000))


def test_the_gyro_drifts():
    """A rate error of 15 degrees a minute at the start, which walks."""
    model = replace(PERFECT, gyro_sd_deg_per_min=15.0, gyro_walk_deg_per_min=3.0)
    drawn = np.degrees(
        [gyro_error_rad(ticks(), model, np.random.default_rng(seed)) for seed in range(1500)]
    )
    assert (60 * drawn[:, 0]).std() == pytest.approx(15.0, rel=4 / np.sqrt(3000))
    walk = (60 * (drawn[:, -1] - drawn[:, 0])).std()
    assert walk == pytest.approx(3.0 * np.sqrt(599 / 60), rel=4 / np.sqrt(3000))


def test_the_noise_of_the_gyro():
    model = replace(PERFECT, gyro_noise_deg_per_sqrt_s=0.3)
    error = np.degrees(gyro_error_rad(ticks(40_000), model, np.random.default_rng(3)))
    assert error.std() == pytest.approx(0.3, rel=4 / np.sqrt(80_000))


def test_magnetic_disturbances_are_forty_degrees_for_twenty_seconds():
    model = replace(PERFECT, disturbed_every_m=400.0)
    turned = np.degrees(
        disturbance_rad(np.full(20_000, 1.4), ticks(20_000), model, np.random.default_rng(4))
    )
    assert np.abs(turned).max() == pytest.approx(40.0)
    assert turned.min() == pytest.approx(-40.0)
    on = np.abs(turned) > 0
    begins = np.flatnonzero(np.diff(np.concatenate([[0], on, [0]])) > 0)
    lengths = np.flatnonzero(np.diff(np.concatenate([[0], on, [0]])) < 0) - begins
    assert np.median(lengths) in (19, 20)
    expected = 28_000.0 / 400.0
    assert begins.size == pytest.approx(expected, abs=4 * np.sqrt(expected))


def test_no_disturbances_at_rest_or_when_there_are_none():
    rng = np.random.default_rng(5)
    assert not disturbance_rad(np.full(100, 1.4), ticks(100), PERFECT, rng).any()
    often = replace(PERFECT, disturbed_every_m=10.0)
    assert not disturbance_rad(np.zeros(100), ticks(100), often, rng).any()


def test_fused_headings_follow_the_gyro_soon_and_the_compass_late():
    """A compass that is 30 degrees off, and a perfect gyro; then a gyro that drifts."""
    model = replace(PERFECT, headings="fused", fusion_s=60.0, gyro_sd_deg_per_min=6.0)
    error = np.degrees(moved(model, straight(1200), seed=6)["heading_rad"])
    drawn = np.degrees(gyro_error_rad(ticks(1200), model, np.random.default_rng(6).spawn(4)[2]))
    rate = drawn[0]
    # In the steady state the pull towards the compass balances the rate error.
    assert error.iloc[-1] == pytest.approx(rate * 60.0, rel=0.05)
    assert error.iloc[5] == pytest.approx(rate * 6, rel=0.1)


def test_turns_of_a_fused_unit_are_the_gyros():
    """Free of the compass and of disturbances."""
    model = replace(PERFECT, headings="fused", heading_sd_deg=20.0, disturbed_every_m=50.0)
    motion = moved(model, around())
    assert motion["turn_rad"].iloc[1:].to_numpy() == pytest.approx(0.014, abs=1e-4)
    assert np.abs(wrap_rad(np.diff(motion["heading_rad"]))).max() > 0.1


@pytest.mark.parametrize(
    ("change", "column", "same"),
    [
        ({"missed": 0.1}, "step_m", "heading_rad"),
        ({"step_range": 0.1}, "step_m", "heading_rad"),
        ({"heading_sd_deg": 9.0}, "heading_rad", "step_m"),
        ({"bias_sd_deg": 9.0}, "heading_rad", "step_m"),
        ({"disturbed_every_m": 50.0}, "heading_rad", "step_m"),
    ],
)
def test_each_error_changes_its_own_column_only(change, column, same):
    before, after = moved(InertialModel(), seed=7), moved(InertialModel(**change), seed=7)
    assert not before[column].equals(after[column])
    assert before[same].equals(after[same])
