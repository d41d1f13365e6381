"""Parts of dead reckoning: attitude, compass, heights, vehicles; against sums and circles."""

import time

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mapfilter.tracks.pdr import standing_bias
from mapfilter.tracks.pdr.attitude import attitude
from mapfilter.tracks.pdr.heading import compass_samples, yaw_offset
from mapfilter.tracks.pdr.height import climbs, height_m
from mapfilter.tracks.pdr.signals import RATE_HZ, Signals, inertial_signals
from mapfilter.tracks.pdr.vehicle import reckon_odometry, reckon_velocity

UP = np.array([0.0, 0.0, 9.80665])


def sensor(time_s, values, unit):
    """Return the table of a sensor of three axes."""
    columns = {f"{axis}_{unit}": values[:, i] for i, axis in enumerate("xyz")}
    return pd.DataFrame({"time_s": time_s, **columns})


def turning(rate_radps, lasted_s, tilt):
    """Return the signals of a device that turns about the vertical at a constant rate."""
    time_s = np.arange(int(lasted_s * RATE_HZ)) / RATE_HZ
    count = len(time_s)
    spin = np.tile([0.0, 0.0, rate_radps], (count, 1))
    # Gravity and the axis of turning are both vertical: in the device they are constant.
    return Signals(time_s, tilt.inv().apply(np.tile(UP, (count, 1))), tilt.inv().apply(spin))


@settings(max_examples=20)
@given(st.integers(0, 10_000), st.sampled_from([-60.0, -3.0, 10.0, 90.0]))
def test_a_constant_rate_adds_up_in_any_tilt(seed, rate_dps):
    tilt = Rotation.random(random_state=seed)
    found = attitude(turning(np.radians(rate_dps), 36.0, tilt))
    turned = np.degrees(found.yaw_rad[-1] - found.yaw_rad[0])
    assert turned == pytest.approx(rate_dps * (36.0 - 1 / RATE_HZ), rel=2e-3, abs=0.1)
    assert found.section.max() == 0
    level = found.to_level.apply(tilt.inv().apply(UP))
    assert np.abs(level - UP).max() < 0.02


def test_a_swing_there_and_back_leaves_no_yaw():
    """A pocket: 40 degrees of pitch and 20 of roll, out of phase, 60 times."""
    count = int(60 * RATE_HZ)
    phase = 2 * np.pi * np.arange(count) / RATE_HZ
    angles = np.stack([0.35 * np.sin(phase), 0.17 * np.cos(phase), 0 * phase], axis=1)
    rotation = Rotation.from_rotvec(angles)
    change = (rotation[:-1].inv() * rotation[1:]).as_rotvec() * RATE_HZ
    rate = np.concatenate([change[:1], change])
    time_s = np.arange(count) / RATE_HZ
    signals = Signals(time_s, rotation.inv().apply(np.tile(UP, (count, 1))), rate)
    found = attitude(signals)
    late = found.yaw_rad[-int(5 * RATE_HZ) :].mean()
    early = found.yaw_rad[int(2 * RATE_HZ) : int(7 * RATE_HZ)].mean()
    assert abs(np.degrees(late - early)) < 2
    # The vertical rate alone, added up, does not return: the axis describes a cone.
    vertical = (rotation.apply(rate)[:, 2] / RATE_HZ).sum()
    assert abs(np.degrees(vertical)) > 100


def test_a_new_posture_is_a_new_section_and_no_turn():
    count = int(10 * RATE_HZ)
    tilt = np.clip((np.arange(2 * count) - count) / RATE_HZ, 0, 1) * np.radians(85)
    rotation = Rotation.from_rotvec(np.outer(tilt, [1.0, 0.0, 0.0]))
    rate = np.outer(np.gradient(tilt) * RATE_HZ, [1.0, 0.0, 0.0])
    time_s = np.arange(2 * count) / RATE_HZ
    force = rotation.inv().apply(np.tile(UP, (2 * count, 1)))
    found = attitude(Signals(time_s, force, rate))
    assert found.section[0] == 0
    assert found.section[-1] == 1
    assert abs(np.degrees(found.yaw_rad[-1] - found.yaw_rad[0])) < 2


def test_rotations_are_kept_when_sensors_are_brought_to_one_rate():
    """A rate of sharp pulses: what it adds up to survives 200 Hz, 33 Hz and uneven times."""
    rng = np.random.default_rng(2)
    for rate_hz in (200.0, 33.0):
        time = np.sort(np.arange(0, 30, 1 / rate_hz) + rng.uniform(0, 0.3 / rate_hz))
        pulses = np.zeros((len(time), 3))
        pulses[rng.integers(2, len(time) - 2, 20), 2] = rng.normal(0, 8, 20)
        true = np.trapezoid(pulses[:, 2], time)
        gyroscope = pd.DataFrame(
            {"time_s": time, **dict(zip(["x_radps", "y_radps", "z_radps"], pulses.T, strict=True))}
        )
        force = pd.DataFrame({"time_s": time, "x_mps2": 0.0, "y_mps2": 0.0, "z_mps2": 9.8})
        (signals,), _ = inertial_signals({"accelerometer": force, "gyroscope": gyroscope})
        assert signals.rate_radps[:, 2].sum() / RATE_HZ == pytest.approx(true, abs=1e-9)


def samples(north_rad, count=120):
    time_s = np.arange(count * 10) / 10
    north = np.broadcast_to(north_rad, len(time_s))
    level = np.stack([30 * np.cos(north), 30 * np.sin(north), np.full(len(time_s), -40.0)], axis=1)
    return time_s, level


def test_the_offset_of_a_steady_compass_is_its_angle():
    time_s, level = samples(0.7)
    compass = compass_samples(time_s, level)
    none = np.full(len(compass.time_s), np.nan)
    found = yaw_offset(compass, none, none)
    np.testing.assert_allclose(found.offset_rad, np.pi / 2 - 0.7, atol=1e-6)
    np.testing.assert_allclose(compass.dip_rad, np.arctan2(40, 30))
    np.testing.assert_allclose(compass.size_ut, 50)
    assert not found.disturbed.any()
    assert np.degrees(found.sd_rad).max() < 15


@given(st.floats(-np.pi, np.pi), st.floats(-0.002, 0.002))
@settings(max_examples=25)
def test_a_drifting_gyroscope_is_followed(angle_rad, drift_radps):
    """The level frame turns with the drift: seen in it, the north turns back by it."""
    time_s, level = samples(angle_rad - drift_radps * np.arange(6000) / 10, 600)
    compass = compass_samples(time_s, level)
    none = np.full(len(compass.time_s), np.nan)
    found = yaw_offset(compass, none, none)
    true = np.pi / 2 - angle_rad + drift_radps * compass.time_s
    apart = (found.offset_rad - true + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(apart)[100:-100].max() < np.radians(6)
    assert np.abs(apart).mean() < np.radians(3)


def test_the_spread_is_that_of_the_compass_where_it_was_used():
    second = np.arange(3000) // 10
    swing_rad = np.radians(6.0) * (-1.0) ** second
    # 20 s beside something of iron that turns the field and leaves its size.
    aside_rad = np.where((second >= 150) & (second < 170), np.radians(80.0), 0.0)
    compass = compass_samples(*samples(0.7 + swing_rad + aside_rad, 300))
    none = np.full(len(compass.time_s), np.nan)
    found = yaw_offset(compass, none, none)
    np.testing.assert_array_equal(np.flatnonzero(found.disturbed), np.arange(150, 170))
    assert np.degrees(found.spread_rad) == pytest.approx(6.0, abs=0.3)
    # Any direction, where there was no compass.
    assert yaw_offset(compass, none, none, use_compass=False).spread_rad == np.pi


def test_the_less_compass_the_less_certain():
    time_s, level = samples(0.7, 300)
    sds = []
    for known in (3000, 600, 100):
        part = level.copy()
        part[known:] = np.nan
        compass = compass_samples(time_s, part)
        none = np.full(len(compass.time_s), np.nan)
        sds.append(yaw_offset(compass, none, none).sd_rad.mean())
    assert sds[0] < sds[1] < sds[2]


def pressure(height):
    """Invert the barometric formula of ISO 2533 in the form of its gas constants."""
    return 1013.25 * (1 - 0.0065 * height / 288.15) ** (9.80665 * 0.0289644 / (8.31446 * 0.0065))


@pytest.mark.parametrize("height", [-400.0, 0.0, 12.5, 1500.0])
def test_heights_are_those_of_the_standard_atmosphere(height):
    found = height_m(np.array([pressure(100.0), pressure(100.0 + height)]))
    assert found[1] == pytest.approx(height, rel=2e-3, abs=0.01)


def building(profile, rate_hz=10.0, noise_hpa=0.02, seed=3):
    """Return a barometer that follows (seconds, height) points."""
    seconds, heights = np.array(profile).T
    time_s = np.arange(seconds[0], seconds[-1], 1 / rate_hz)
    hpa = pressure(np.interp(time_s, seconds, heights))
    hpa += noise_hpa * np.random.default_rng(seed).standard_normal(len(time_s))
    return pd.DataFrame({"time_s": time_s, "pressure_hpa": hpa})


def test_stairs_and_lifts():
    profile = [(0, 0), (60, 0), (80, 6), (160, 6), (175, 24), (300, 24), (315, 20), (360, 20)]
    steps_s = np.concatenate([np.arange(5, 160, 0.6), np.arange(180, 360, 0.6)])
    up, lift, down = climbs(building(profile), steps_s)
    assert (up.kind, lift.kind, down.kind) == ("stairs", "lift", "stairs")
    assert up.rise_m == pytest.approx(6, abs=0.8)
    assert lift.rise_m == pytest.approx(18, abs=0.8)
    assert down.rise_m == pytest.approx(-4, abs=0.8)
    assert up.begin_s == pytest.approx(60, abs=3)
    assert lift.end_s == pytest.approx(175, abs=3)


def test_a_landing_does_not_part_stairs():
    profile = [(0, 0), (60, 0), (70, 3), (75, 3), (85, 6), (120, 6)]
    (stairs,) = climbs(building(profile), np.arange(0, 120, 0.6))
    assert stairs.rise_m == pytest.approx(6, abs=0.8)
    assert stairs.end_s - stairs.begin_s == pytest.approx(25, abs=4)


def test_weather_doors_and_noise_are_no_climbs():
    weather = building([(0, 0), (1800, 12)])
    assert climbs(weather, np.arange(0, 1800, 0.6)) == ()
    door = building([(0, 0), (120, 0)])
    door.loc[door["time_s"].between(60, 61), "pressure_hpa"] += 0.8
    assert climbs(door, np.arange(0, 120, 0.6)) == ()
    assert climbs(building([(0, 0), (120, 0)], noise_hpa=0.06), np.zeros(0)) == ()
    assert climbs(door.iloc[:2], np.zeros(0)) == ()
    assert climbs(door.assign(pressure_hpa=np.nan), np.zeros(0)) == ()


def drive(bias_radps, stands=True, rate_hz=10.0):
    """Return odometry round a circle of 60 m, its true turns, with a stand of 20 s twice."""
    speed = np.concatenate([np.zeros(200), np.full(1200, 6.0), np.zeros(200), np.full(1200, 6.0)])
    if not stands:
        speed = speed[speed > 0]
    time_s = np.arange(len(speed)) / rate_hz
    rate = speed / 60.0
    noise = np.random.default_rng(4).normal(0, 0.002, len(speed))
    rows = pd.DataFrame(
        {
            "time_s": time_s,
            "speed_mps": speed,
            "yaw_rate_radps": rate + bias_radps + noise,
            "speed_sd_mps": 0.05,
            "yaw_rate_sd_radps": 0.002,
        }
    )
    return rows, np.trapezoid(rate, time_s)


def test_a_vehicles_bias_is_learnt_while_it_stands():
    rows, true_rad = drive(0.004)
    motion, imu, notes = reckon_odometry(rows)
    lasted_s = np.ptp(rows["time_s"])
    assert motion["step_m"].sum() == pytest.approx(np.trapezoid(rows["speed_mps"], rows["time_s"]))
    assert abs(motion["turn_rad"].sum() - true_rad) < 0.1 * 0.004 * lasted_s
    assert imu.turns == "gyro"
    assert imu.gyro_bias_deg_per_s < 0.08
    assert "bias +0.2" in notes[0]
    unlearnt, loose, notes = reckon_odometry(drive(0.004, stands=False)[0])
    assert abs(unlearnt["turn_rad"].sum() - drive(0.0, stands=False)[1]) > 0.9 * 0.004 * 239
    assert loose.gyro_bias_deg_per_s > imu.gyro_bias_deg_per_s
    assert "never stands" in notes[0]


def test_odometry_of_months_takes_no_longer_than_its_rows():
    rows, _ = drive(0.004)
    rows = rows.iloc[::2].assign(time_s=lambda r: np.arange(len(r)) * 3000.0)
    began_s = time.process_time()
    motion, _, _ = reckon_odometry(rows)
    assert time.process_time() - began_s < 5.0
    assert len(motion) == len(rows)


def test_longer_spans_of_a_long_recording_learn_the_same_bias(monkeypatch):
    rows, true_rad = drive(0.004)
    monkeypatch.setattr(standing_bias, "_MOST_SPANS", 60)
    motion, _, notes = reckon_odometry(rows)
    assert abs(motion["turn_rad"].sum() - true_rad) < 0.15 * 0.004 * np.ptp(rows["time_s"])
    assert "bias +0.2" in notes[0]


def test_a_stand_after_driving_teaches_the_bias_once_the_body_has_settled():
    rows, true_rad = drive(0.004)
    rows = rows.iloc[300:].reset_index(drop=True)
    true_rad -= 10.0 * 6.0 / 60.0
    began = int(np.flatnonzero(rows["speed_mps"] == 0)[0])
    # The body swings back in the first 0.4 s.
    rows.loc[began : began + 3, "yaw_rate_radps"] -= 0.03
    motion, _, _ = reckon_odometry(rows)
    lasted_s = np.ptp(rows["time_s"])
    found_radps = (motion["turn_rad"].sum() - true_rad) / lasted_s
    assert abs(found_radps) < 0.15 * 0.004


def test_a_turntable_is_no_bias():
    """A yaw rate of 20 degrees a second at standstill is motion, not an error of the sensor."""
    rows, true_rad = drive(0.0)
    rows.loc[rows["time_s"].between(5, 15), "yaw_rate_radps"] += np.radians(20)
    motion, _, _ = reckon_odometry(rows)
    assert motion["turn_rad"].sum() == pytest.approx(true_rad + np.radians(200), abs=0.3)


def test_odometry_without_yaw_rate_has_steps_only():
    rows, _ = drive(0.0)
    motion, _, notes = reckon_odometry(rows.assign(yaw_rate_radps=np.nan))
    assert motion["turn_rad"].iloc[1:].isna().all()
    assert motion["step_m"].sum() > 1000
    assert "no yaw rate" in notes[0]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_speed_of_a_receiver_and_a_gyroscope_in_any_pose(seed):
    """A circle of 60 m at 6 m/s, from east to the north; the course is noisy."""
    rng = np.random.default_rng(seed)
    mount = Rotation.random(random_state=seed)
    time_s = np.arange(0, 150, 0.02)
    speed = np.where(time_s < 20, 0.0, 6.0)
    rate = speed / 60.0
    heading = np.cumsum(rate) * 0.02
    spin = np.stack([0 * rate, 0 * rate, rate], axis=1)
    seen = mount.inv().apply(spin) + np.array([0.004, -0.003, 0.005])
    seen += rng.normal(0, 0.003, seen.shape)
    force = mount.inv().apply(np.tile(UP, (len(seen), 1))) + rng.normal(0, 0.1, seen.shape)
    sensors = {
        "gyroscope": sensor(time_s, seen, "radps"),
        "accelerometer": sensor(time_s, force, "mps2"),
    }
    second = time_s[50::50]
    course = np.interp(second, time_s, heading) + rng.normal(0, 0.1, len(second))
    course = (course + np.pi) % (2 * np.pi) - np.pi
    driven = np.interp(second, time_s, speed)
    course[driven < 1] = np.nan
    columns = {"time_s": second, "speed_mps": driven, "heading_rad": course}
    sensors["velocity"] = pd.DataFrame(columns)
    motion, imu, notes = reckon_velocity(sensors)
    middle = np.interp(motion["time_s"] - 0.5, time_s, heading)
    apart = (motion["heading_rad"] - middle + np.pi) % (2 * np.pi) - np.pi
    assert np.degrees(np.abs(apart[25:])).max() < 6
    assert motion["turn_rad"].sum() == pytest.approx(heading[-1] - heading[0], abs=0.13)
    assert motion["step_m"].sum() == pytest.approx(6.0 * 130, rel=0.02)
    assert imu.turns == "headings"
    assert "bias" in notes[0]


def test_speeds_without_sensors_are_not_reckoned():
    speeds = pd.DataFrame({"time_s": [0.0, 1.0], "speed_mps": 5.0, "heading_rad": 0.0})
    assert reckon_velocity({"velocity": speeds}) is None
    assert reckon_velocity({}) is None
