"""The noise and the bias of a vehicle's gyroscope while it stands, by hand and by chance."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.log_options import fitted_to_log
from mapfilter.tracks.checks.turn_noise import turns_at_standstill
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.log import make_log

USUAL_DEG = 0.15
"""Random walk of a usual gyroscope, per root second."""


def drive(seed=0, *, count=400, every_s=1.0, noise_deg=0.5, bias_deg=0.2, speed_mps=10.0):
    """Rows of a vehicle that stands for a quarter of the time, with noise per root second."""
    rng = np.random.default_rng(seed)
    stands = np.arange(count) % 100 < 25
    turn_deg = bias_deg * every_s + noise_deg * every_s**0.5 * rng.standard_normal(count)
    # On the way it turns.
    turn_deg += np.where(stands, 0.0, rng.normal(0, 10, count))
    return pd.DataFrame(
        {
            "time_s": every_s * np.arange(count),
            "step_m": np.where(stands, 0.0, speed_mps * every_s),
            "heading_rad": np.nan,
            "turn_rad": np.radians(turn_deg),
        }
    )


@pytest.mark.parametrize("every_s", [0.2, 1.0, 3.0])
@pytest.mark.parametrize(("noise_deg", "bias_deg"), [(0.05, 0.0), (0.5, 0.2), (2.0, -1.0)])
def test_noise_and_bias_are_found_whatever_the_rate(every_s, noise_deg, bias_deg):
    rows = drive(every_s=every_s, noise_deg=noise_deg, bias_deg=bias_deg, count=1000)
    found = turns_at_standstill(rows)
    walk_deg = np.degrees(found.walk_rad_per_sqrt_s)
    assert walk_deg == pytest.approx(np.hypot(USUAL_DEG, noise_deg), rel=0.15)
    # A median of 250 rows.
    sd_deg = 1.25 * noise_deg / every_s**0.5 / 250**0.5
    assert np.degrees(found.bias_radps) == pytest.approx(bias_deg, abs=3 * sd_deg)


def test_few_rows_a_short_time_pauses_and_gated_turns_show_nothing():
    assert turns_at_standstill(drive(count=19)) is None
    assert turns_at_standstill(drive(count=25, every_s=0.5)) is None
    assert turns_at_standstill(drive(every_s=6.0)) is None
    rows = drive()
    gated = rows.assign(turn_rad=rows["turn_rad"].where(rows["step_m"] > 0, 0.0))
    assert turns_at_standstill(gated) is None
    # So do those that are held now and then, or rounded: they would show no noise at all.
    held = rows.assign(turn_rad=rows["turn_rad"].where(rows.index % 5 < 2, 0.0))
    assert turns_at_standstill(held) is None
    rounded = rows.assign(turn_rad=(rows["turn_rad"] / 0.1).round() * 0.1)
    assert turns_at_standstill(rounded) is None
    offset = rows.assign(turn_rad=(rows["turn_rad"] / 0.1).round() * 0.1 + 0.01)
    assert turns_at_standstill(offset) is None
    assert turns_at_standstill(rows.assign(turn_rad=np.nan)) is None
    assert turns_at_standstill(rows[rows["step_m"] > 0]) is None
    # A turn of the vehicle on a turntable, and one row that is wrong, are few.
    odd = rows.assign(turn_rad=rows["turn_rad"].where(rows.index != 5, 3.0))
    plain, with_odd = turns_at_standstill(rows), turns_at_standstill(odd)
    assert with_odd.walk_rad_per_sqrt_s == pytest.approx(plain.walk_rad_per_sqrt_s, rel=0.05)


def given(rows, **parts):
    return make_log("EPSG:32632", motion=rows, start_utc_s=1.7e9, **parts)


def test_kalman_type_filters_take_them_where_the_log_states_nothing():
    found, notes = fitted_to_log(KalmanFilter(), given(drive(bias_deg=0.8)))
    walk_deg = np.degrees(turns_at_standstill(drive(bias_deg=0.8)).walk_rad_per_sqrt_s)
    assert found.turn_drift_deg_per_sqrt_m == pytest.approx(walk_deg / 10**0.5)
    assert found.turn_rate_sd_deg_per_s == pytest.approx(0.8, abs=0.2)
    (note,) = [one for one in notes if "standstill" in one]
    assert note.startswith("errors of turns as they are at standstill: turn_drift_deg_per_sqrt_m")
    # A small bias is what is assumed anyway.
    found, _ = fitted_to_log(KalmanFilter(), given(drive(bias_deg=0.0, noise_deg=0.1)))
    assert found.turn_rate_sd_deg_per_s == KalmanFilter().turn_rate_sd_deg_per_s
    assert found.turn_drift_deg_per_sqrt_m < 0.1


def test_else_they_do_not():
    plain = KalmanFilter()
    imu = ImuNoise(1.0, 0.1, 1.0, turns="gyro", gyro_noise_deg_per_sqrt_s=0.4)
    headings = drive().assign(heading_rad=0.3)
    walk = drive(speed_mps=1.4)
    for log in (given(headings), given(walk)):
        assert fitted_to_log(plain, log)[0].turn_drift_deg_per_sqrt_m == 0.3
    stated = fitted_to_log(plain, given(drive(), imu=imu))[0].turn_drift_deg_per_sqrt_m
    assert stated == pytest.approx(0.4 / 10**0.5)
    asked = KalmanFilter(turn_drift_deg_per_sqrt_m=0.2)
    assert fitted_to_log(asked, given(drive()))[0].turn_drift_deg_per_sqrt_m == 0.2
