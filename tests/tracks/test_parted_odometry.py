"""A vehicle's speeds in one file and its yaw rates in another, and headings beside speeds."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.sensors import read_sensors
from mapfilter.workflows.convert import run_convert

START_S = 1_778_666_400.0
TIME_S = START_S + np.arange(0.0, 300.0, 0.2)
SPEED_MPS = np.maximum(8.0 + 6.0 * np.sin(np.arange(TIME_S.size) / 60), 2.5)
RATE_RADPS = 0.15 * np.sin(np.arange(TIME_S.size) / 45)
TURNED_RAD = np.append(0.0, np.cumsum(0.1 * (RATE_RADPS[1:] + RATE_RADPS[:-1])))


def turned_rad(log):
    return np.cumsum(log.motion["turn_rad"].fillna(0.0).to_numpy())


@pytest.mark.parametrize("apart_s", [0.0, 0.07])
@pytest.mark.parametrize("every", [1, 5])
def test_speeds_and_yaw_rates_of_two_files(read, every, apart_s):
    """A file of yaw rates alone was refused, as of no known format."""
    speeds = {"time": TIME_S[::every], "wheel_speed_mps": SPEED_MPS[::every]}
    rates = np.interp(TIME_S + apart_s, TIME_S, RATE_RADPS)
    log = read(obd=speeds, gyro={"time": TIME_S + apart_s, "yaw_rate_degps": np.degrees(rates)})
    assert log.vehicle
    assert log.motion["step_m"].sum() == pytest.approx(0.2 * SPEED_MPS.sum(), rel=0.01)
    at = np.searchsorted(TIME_S, START_S + log.motion["time_s"])
    off = turned_rad(log)[1:-1] - TURNED_RAD[np.minimum(at, TIME_S.size - 1)][1:-1]
    assert np.ptp(off) < 0.06
    assert "odometry: yaw rates are those of gyro.csv" in log.notes
    assert not [note for note in log.notes if "not used" in note]


@pytest.mark.parametrize("parted", [False, True])
def test_noisy_yaw_rates_that_come_more_often_than_speeds_are_all_used(read, parted):
    """Those at the times of speeds were, and headings drifted by their noise, by 20 degrees."""
    dense_s = START_S + np.arange(0.0, 300.0, 0.02)
    true = np.interp(dense_s, TIME_S, RATE_RADPS)
    noisy = true + np.random.default_rng(8).normal(0.0, 0.02, true.size)
    at = np.arange(dense_s.size) % 50 == 0
    speed = np.interp(dense_s, TIME_S, SPEED_MPS)
    if parted:
        rates = {"time": dense_s, "yaw_rate_radps": noisy}
        log = read(obd={"time": dense_s[at], "wheel_speed_mps": speed[at]}, gyro=rates)
    else:
        speeds = np.where(at, speed, np.nan)
        log = read(can={"time": dense_s, "wheel_speed_mps": speeds, "yaw_rate_radps": noisy})
    turned = np.append(0.0, np.cumsum(0.01 * (true[1:] + true[:-1])))
    off = turned_rad(log) - np.interp(START_S + log.motion["time_s"], dense_s, turned)
    assert len(log.motion) == at.sum()
    assert np.degrees(np.abs(off).max()) < 8


def test_yaw_rates_that_speeds_have_themselves_are_not_replaced(read):
    own = {"time": TIME_S, "wheel_speed_mps": SPEED_MPS, "yaw_rate_radps": RATE_RADPS}
    log = read(obd=own, gyro={"time": TIME_S, "yaw_rate_radps": -RATE_RADPS})
    np.testing.assert_allclose(turned_rad(log)[-1], TURNED_RAD[-1], atol=0.1)
    assert "gyro.csv: yaw rates not used, the speeds have their own" in log.notes


def test_yaw_rates_alone_are_no_motion(read):
    places = {"time": TIME_S[::5], "lat": 60 + 1e-5 * np.arange(300), "lon": 25.0}
    log = read(gyro={"time": TIME_S, "yaw_rate_radps": RATE_RADPS}, fixes=places)
    assert (len(log.motion), len(log.gnss)) == (0, 300)
    assert "gyro.csv: yaw rates without speeds (wheel_speed_mps): no motion" in log.notes


def test_raw_odometry_of_a_converted_log_has_both(tmp_path):
    pd.DataFrame({"time": TIME_S, "wheel_speed_mps": SPEED_MPS}).to_csv(tmp_path / "obd.csv")
    pd.DataFrame({"time": TIME_S, "yaw_rate_radps": RATE_RADPS}).to_csv(tmp_path / "gyro.csv")
    run_convert([tmp_path / "obd.csv", tmp_path / "gyro.csv"], tmp_path / "log")
    rows = read_sensors(tmp_path / "log")["odometry"]
    np.testing.assert_allclose(rows["speed_mps"], SPEED_MPS)
    np.testing.assert_allclose(rows["yaw_rate_radps"], RATE_RADPS)


@pytest.mark.parametrize("field", ["heading_deg", "compass_deg", "heading_rad"])
def test_a_heading_beside_the_speed_of_wheels_tells_how_they_turn(read, field):
    """It was not used, and the way was spread to all sides."""
    heading = 5.5 + TURNED_RAD
    if field != "heading_rad":
        heading = np.degrees(np.pi / 2 - heading) % 360
    log = read(drive={"time": TIME_S, "wheel_speed_mps": SPEED_MPS, field: heading})
    np.testing.assert_allclose(turned_rad(log)[2:-2], TURNED_RAD[2:-2], atol=0.03)
    assert f"drive.csv: yaw rates are those by which {field} changes" in log.notes
    assert not [note for note in log.notes if "not used" in note or "unknown" in note]


def test_headings_too_far_apart_tell_no_turns(read):
    heading = np.degrees(np.pi / 2 - TURNED_RAD[::25]) % 360
    log = read(drive={"time": TIME_S[::25], "wheel_speed_mps": 8.0, "heading_deg": heading})
    assert log.motion["turn_rad"].isna()[1:].all()
    assert any("heading_deg: no two values within 2 s" in note for note in log.notes)
    assert not any("yaw rates are those" in note for note in log.notes)


def test_a_heading_beside_positions_may_be_their_course(read):
    places = {"lat": 60 + 2e-5 * np.arange(TIME_S.size), "lon": 25.0}
    heading = np.degrees(np.pi / 2 - TURNED_RAD) % 360
    log = read(drive={"time": TIME_S, **places, "wheel_speed_mps": 10.0, "heading_deg": heading})
    assert log.motion["turn_rad"].isna().all() or not log.motion["turn_rad"].any()
    assert any("columns not used: heading_deg" in note for note in log.notes)


def test_over_rows_of_headings_far_apart_nothing_is_known(read):
    heading = np.degrees(np.pi / 2 - TURNED_RAD) % 360
    heading[700:760] = np.nan
    log = read(drive={"time": TIME_S, "wheel_speed_mps": SPEED_MPS, "heading_deg": heading})
    blind = log.motion["step_m"].isna().to_numpy()
    assert blind[705:755].all()
    assert not blind[:690].any()
    assert not blind[770:].any()
