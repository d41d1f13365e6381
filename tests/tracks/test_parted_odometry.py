"""A vehicle's speeds in one file and its yaw rates in another, and headings beside speeds."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.angles import wrap_rad
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
@pytest.mark.parametrize("lengths", ["wheel_speed_mps", "odometer_m"])
def test_headings_beside_a_vehicles_lengths_are_those_of_its_motion(read, field, lengths):
    """Their differences were taken for a gyroscope's, with a bias of one row at standstill."""
    heading = 5.5 + TURNED_RAD
    speed = np.where(np.arange(TIME_S.size) < 8, 0.0, SPEED_MPS)
    along = speed if lengths == "wheel_speed_mps" else 0.2 * np.cumsum(speed)
    given = heading if field == "heading_rad" else np.degrees(np.pi / 2 - heading) % 360
    log = read(drive={"time": TIME_S, lengths: along, field: given})
    off = wrap_rad(log.motion["heading_rad"].to_numpy() - heading)
    # Grid north is not true north.
    assert np.ptp(off) < 0.04
    assert np.abs(off).max() < (0.04 if field == "heading_rad" else 0.1)
    assert log.motion["turn_rad"].isna().all()
    assert log.vehicle
    assert (log.imu.turns, log.imu.bias_sd_deg) == ("headings", 10.0)
    assert f"drive.csv: {field}: headings of the vehicle" in log.notes
    assert not [n for n in log.notes if "not used" in n or "unknown" in n or "bias" in n]


def test_headings_in_rows_of_their_own(read):
    heading = np.where(np.arange(TIME_S.size) % 2, np.nan, 1.0 + TURNED_RAD)
    speed = np.where(np.arange(TIME_S.size) % 2, SPEED_MPS, np.nan)
    log = read(drive={"time": TIME_S, "wheel_speed_mps": speed, "heading_rad": heading})
    off = wrap_rad(log.motion["heading_rad"].to_numpy() - 1.0 - TURNED_RAD[1::2])
    assert np.abs(off).max() < 0.05
    assert not log.motion["step_m"].isna().any()


def test_beside_headings_yaw_rates_of_another_file_are_not_used(read):
    drive = {"time": TIME_S, "wheel_speed_mps": SPEED_MPS, "heading_rad": 1.0 + TURNED_RAD}
    log = read(drive=drive, gyro={"time": TIME_S, "yaw_rate_radps": -RATE_RADPS})
    off = wrap_rad(log.motion["heading_rad"].to_numpy() - 1.0 - TURNED_RAD)
    assert np.abs(off).max() < 0.05
    assert "gyro.csv: yaw rates not used, the speeds have headings" in log.notes


def test_the_scatter_of_headings_is_their_error(read):
    rng = np.random.default_rng(4)
    noisy = 1.0 + TURNED_RAD + np.radians(6.0) * rng.standard_normal(TURNED_RAD.size)
    log = read(drive={"time": TIME_S, "wheel_speed_mps": SPEED_MPS, "heading_rad": noisy})
    assert log.imu.sigma_orient_deg == pytest.approx(6.0, rel=0.2)


def test_azimuths_of_a_vehicle_in_radians_are_noted(read):
    azimuth = (np.pi / 2 - 40 * TURNED_RAD / np.ptp(TURNED_RAD)) % (2 * np.pi)
    log = read(drive={"time": TIME_S, "wheel_speed_mps": SPEED_MPS, "compass_deg": azimuth})
    assert any("radians for degrees?" in note for note in log.notes)


def test_headings_seconds_apart_are_used(read):
    heading = np.degrees(np.pi / 2 - TURNED_RAD[::25]) % 360
    log = read(drive={"time": TIME_S[::25], "wheel_speed_mps": 8.0, "heading_deg": heading})
    assert log.motion["heading_rad"].notna().all()


@pytest.mark.parametrize("field", ["turn_rad", "turn_deg"])
@pytest.mark.parametrize("lengths", ["wheel_speed_mps", "odometer_m"])
def test_turns_from_row_to_row_beside_a_vehicles_lengths(read, field, lengths):
    """They were not used, and the way was spread to all sides."""
    turn = np.diff(TURNED_RAD, prepend=0.0)
    along = SPEED_MPS if lengths == "wheel_speed_mps" else 0.2 * np.cumsum(SPEED_MPS)
    given = turn if field == "turn_rad" else np.degrees(turn)
    log = read(drive={"time": TIME_S, lengths: along, field: given})
    np.testing.assert_allclose(turned_rad(log), TURNED_RAD, atol=1e-6)
    assert "drive.csv: turns are those from row to row" in log.notes
    assert not [n for n in log.notes if "not used" in n or "unknown" in n or "no yaw rates" in n]


@pytest.mark.parametrize("field", ["yaw_rate_radps", "yaw_rate_degps"])
def test_yaw_rates_beside_steps_of_known_lengths_are_their_turns(read, field):
    """They were not used, and the way was spread to all sides."""
    rate = RATE_RADPS if field == "yaw_rate_radps" else np.degrees(RATE_RADPS)
    log = read(walk={"time": TIME_S, "step_m": 0.3, field: rate})
    np.testing.assert_allclose(turned_rad(log), TURNED_RAD, atol=1e-6)
    assert "walk.csv: turns are those of a yaw rate" in log.notes
    assert not [note for note in log.notes if "not used" in note or "unknown" in note]


@pytest.mark.parametrize("field", ["compass_deg", "heading_rad", "turn_rad"])
def test_yaw_rates_of_steps_beside_an_empty_column(read, field):
    """They were not used: the column counted as their direction."""
    given = {"step_m": 0.3, field: np.nan, "yaw_rate_radps": RATE_RADPS}
    log = read(walk={"time": TIME_S, **given})
    np.testing.assert_allclose(turned_rad(log), TURNED_RAD, atol=1e-6)
    assert not [note for note in log.notes if "yaw_rate" in note or "unknown" in note]


@pytest.mark.parametrize("field", ["compass_deg", "heading_rad", "heading_deg", "turn_rad"])
def test_directions_in_rows_of_their_own_are_those_of_steps(read, field):
    """They were not used, with a note that there are none."""
    compass_deg = np.degrees(np.pi / 2 - TURNED_RAD - 3.0) % 360
    turn = np.diff(TURNED_RAD, prepend=0.0)
    given = {"heading_rad": wrap_rad(TURNED_RAD + 3.0), "turn_rad": turn}.get(field, compass_deg)
    steps = pd.DataFrame({"time": TIME_S[2::4] + 0.01, "step_m": 0.7})
    rows = pd.concat([pd.DataFrame({"time": TIME_S, field: given}), steps])
    log = read(walk=rows.sample(frac=1.0, random_state=3))
    assert log.motion["step_m"].sum() == pytest.approx(0.7 * len(steps))
    if field == "turn_rad":
        own = turned_rad(log) + TURNED_RAD[2]
        np.testing.assert_allclose(own, np.interp(steps["time"], TIME_S, TURNED_RAD), atol=1e-3)
        assert "walk.csv: turns are those of rows beside those of steps" in log.notes
    else:
        off = wrap_rad(log.motion["heading_rad"] - TURNED_RAD[2::4] - 3.0)
        assert np.ptp(off) < 0.1
        assert np.abs(off).max() < 0.15
        assert f"walk.csv: {field}: of rows beside those of steps" in log.notes
    assert not [note for note in log.notes if "no headings" in note]


@pytest.mark.parametrize("steps", ["steps", "step_m"])
def test_speeds_and_a_yaw_rate_beside_steps_are_a_walkers(read, steps):
    """They were taken for a vehicle's."""
    of_steps = {"steps": np.arange(TIME_S.size) // 3, "step_m": 0.23}[steps]
    log = read(walk={"time": TIME_S, steps: of_steps, "speed_mps": 1.2, "yaw_rate": RATE_RADPS})
    assert not log.vehicle
    assert not [note for note in log.notes if "vehicle" in note]
    assert turned_rad(log)[-1] == pytest.approx(TURNED_RAD[-1], abs=0.05)


def test_headings_of_steps_go_before_their_yaw_rates(read):
    given = {"step_m": 0.3, "heading_rad": 1.0 + TURNED_RAD, "yaw_rate_radps": RATE_RADPS}
    log = read(walk={"time": TIME_S, **given})
    assert log.motion["turn_rad"].isna().all()
    assert any("columns not used: yaw_rate_radps" in note for note in log.notes)


@pytest.mark.parametrize(("stood", "learnt"), [(1, False), (4, False), (60, True)])
def test_a_bias_is_learnt_of_enough_rows_at_standstill(read, stood, learnt):
    """One row gave it with an error of 0.04 deg/s."""
    # The last row of a standstill does not count.
    speed = np.where(np.arange(TIME_S.size) < stood + 1, 0.0, SPEED_MPS)
    rng = np.random.default_rng(2)
    rate = np.where(speed > 0, RATE_RADPS, 0.0) + 0.02 + rng.normal(0.0, 0.01, speed.size)
    log = read(drive={"time": TIME_S, "wheel_speed_mps": speed, "yaw_rate_radps": rate})
    bias_radps = np.nansum(log.motion["turn_rad"]) - np.sum(rate[1:] + rate[:-1]) * 0.1
    assert (abs(bias_radps) > 3.0) == learnt
    words = "at standstill" if learnt else "too few to learn the bias"
    assert any(words in note for note in log.notes)
    assert (log.imu.gyro_bias_deg_per_s < 0.2) == learnt


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
    assert blind[706:755].all()
    assert not blind[:690].any()
    assert not blind[770:].any()
