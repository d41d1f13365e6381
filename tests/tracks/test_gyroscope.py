"""Noisy gyroscopes: their noise and bias at rest, and the headings and errors that follow."""

import re

import numpy as np
import pandas as pd
import pytest
from made_phone import Leg, Phone, walk_sensors

from mapfilter.tracks.pdr.gyroscope import Gyroscope, gyroscope_at_rest
from mapfilter.tracks.pdr.options import WalkOptions
from mapfilter.tracks.pdr.signals import inertial_signals
from mapfilter.tracks.pdr.steps import still
from mapfilter.tracks.pdr.vehicle import reckon_odometry
from mapfilter.tracks.pdr.walk import reckon_walk

RESTING = (Leg(60, 0.4, 8.0), Leg(60, 1.9), Leg(60, -2.0, 8.0), Leg(60, 3.0), Leg(60, 1.0, 8.0))
WALKING = tuple(Leg(60, heading, 0.0) for heading in (0.4, 1.9, -2.0, 3.0, 1.0, -0.5))
AXES = ["x_radps", "y_radps", "z_radps"]


def phone(white_degps, bias_degps, seed=1, rate_hz=100.0):
    bias = np.radians(bias_degps) * np.array([1.0, -1.0, 1.0])
    return Phone(
        rate_hz=rate_hz, rate_noise_radps=np.radians(white_degps), bias_radps=tuple(bias), seed=seed
    )


def reckoned(sensors):
    found, notes = reckon_walk(sensors, WalkOptions(declination_deg=0.0))
    assert found is not None, notes
    return found


def off_deg(found, true_s, true_rad):
    """Root mean square of headings about the true ones."""
    rows = found.motion[found.motion["step_m"] > 0]
    nearest = np.abs(rows["time_s"].to_numpy()[:, None] - true_s).argmin(axis=1)
    off = np.angle(np.exp(1j * (rows["heading_rad"].to_numpy() - true_rad[nearest])))
    return np.degrees(np.sqrt(np.mean(off**2)))


def at_rest(sensors):
    stretches, _ = inertial_signals(sensors)
    return gyroscope_at_rest(sensors, stretches, [still(one.force_mps2) for one in stretches])


@pytest.mark.parametrize(("white_degps", "rate_hz"), [(1.0, 100.0), (4.0, 100.0), (4.0, 50.0)])
def test_noise_and_bias_are_those_at_rest(white_degps, rate_hz):
    sensors, _, _ = walk_sensors(RESTING, phone(white_degps, 2.0, rate_hz=rate_hz))
    found = at_rest(sensors)
    noise_deg = np.degrees(found.noise_rad_per_sqrt_s)
    assert noise_deg == pytest.approx(white_degps / rate_hz**0.5, rel=0.05)
    np.testing.assert_allclose(np.degrees(found.bias_radps), [2.0, -2.0, 2.0], atol=0.35)
    expected_deg = np.hypot(0.15, white_degps / rate_hz**0.5)
    assert np.degrees(found.walk_rad_per_sqrt_s) == pytest.approx(expected_deg, rel=0.05)


@pytest.mark.parametrize("legs", [RESTING, WALKING])
@pytest.mark.parametrize(("white_degps", "bias_degps"), [(2.0, 1.0), (4.0, 2.0)])
def test_headings_of_a_noisy_gyroscope_are_right(legs, white_degps, bias_degps):
    """They were off by 90 degrees: no rest was found, and the compass thought to be disturbed."""
    for seed in (1, 2):
        sensors, true_s, true_rad = walk_sensors(legs, phone(white_degps, bias_degps, seed))
        found = reckoned(sensors)
        assert off_deg(found, true_s, true_rad) < 12.0
        assert not any("compass disturbed" in note for note in found.notes)


def test_a_compass_that_is_off_at_the_end_shows_no_bias():
    """The field is turned by 80 degrees in the last half minute of two."""
    sensors, true_s, true_rad = walk_sensors(WALKING[:4], phone(0.2, 0.0))
    field = sensors["magnetometer"]
    x, y = field["x_ut"].to_numpy(), field["y_ut"].to_numpy()
    turn = np.where(field["time_s"] > field["time_s"].iloc[-1] - 30, np.radians(80.0), 0.0)
    field["x_ut"] = x * np.cos(turn) - y * np.sin(turn)
    field["y_ut"] = x * np.sin(turn) + y * np.cos(turn)
    assert off_deg(reckoned(sensors), true_s, true_rad) < 10.0


@pytest.mark.parametrize("with_compass", [True, False])
def test_the_noise_is_stated(with_compass):
    quiet, _, _ = walk_sensors(RESTING, phone(0.1, 0.05))
    noisy, _, _ = walk_sensors(RESTING, phone(4.0, 2.0))
    if not with_compass:
        del quiet["magnetometer"], noisy["magnetometer"]
    name = "drift_deg_per_sqrt_s" if with_compass else "gyro_noise_deg_per_sqrt_s"
    found = reckoned(noisy)
    assert getattr(reckoned(quiet).imu, name) == pytest.approx(0.15, abs=0.002)
    assert getattr(found.imu, name) == pytest.approx(np.hypot(0.15, 0.4), rel=0.05)
    bias, drift = re.search(
        r"gyroscope: unusually large errors: a bias of (\S+) deg/s, which is subtracted, "
        r"and noise by which headings drift (\S+) deg/sqrt\(s\)",
        " ".join(found.notes),
    ).groups()
    assert float(bias) == pytest.approx(2 * 3**0.5, abs=0.15)
    assert float(drift) == pytest.approx(0.43, abs=0.02)
    assert not any("unusually large" in note for note in reckoned(quiet).notes)


def test_what_a_hand_sways_at_rest_is_neither_noise_nor_bias():
    sensors, _, _ = walk_sensors(RESTING, phone(0.1, 0.05))
    gyroscope = sensors["gyroscope"]
    at_s = gyroscope["time_s"].to_numpy()
    for axis, hz in zip(AXES, (1.1, 1.7, 2.3), strict=True):
        gyroscope[axis] += np.radians(1.5) * np.sin(2 * np.pi * hz * at_s)
    found = at_rest(sensors)
    assert not found.bias_radps.any()
    assert np.degrees(found.walk_rad_per_sqrt_s) < 0.17


def test_without_a_rest_and_a_compass_the_bias_may_be_that_of_data_sheets():
    sensors, _, _ = walk_sensors((Leg(150, 0.0, 0.0),), phone(0.2, 0.0))
    del sensors["magnetometer"]
    assert at_rest({}).walk_rad_per_sqrt_s == Gyroscope().walk_rad_per_sqrt_s
    assert reckoned(sensors).imu.gyro_bias_deg_per_s == pytest.approx(0.5, abs=0.005)


@pytest.mark.parametrize("bias_degps", [2.0, -2.0, 0.3])
def test_a_noisy_yaw_rate_has_its_bias_removed_and_its_noise_stated(bias_degps):
    """Rates at standstill beyond 3 deg/s were left out, so that noise hid the bias."""
    rng = np.random.default_rng(4)
    time_s = np.arange(0.0, 400.0, 0.1)
    speed = np.where(time_s % 100 < 30, 0.0, 10.0)
    rate = np.radians(bias_degps) + rng.normal(0.0, np.radians(4.0), time_s.size)
    rows = pd.DataFrame({"time_s": time_s, "speed_mps": speed, "yaw_rate_radps": rate})
    motion, imu, notes = reckon_odometry(rows)
    drift_degps = np.degrees(motion["turn_rad"].sum()) / 400.0
    # 4 deg/s in a sample are 1.26 deg in a second: 0.12 deg/s over the standstill.
    assert abs(drift_degps) < 0.3
    assert imu.gyro_noise_deg_per_sqrt_s == pytest.approx(np.hypot(0.15, 4 / 10**0.5), rel=0.1)
    assert any("noise by which headings drift 1." in note for note in notes)


@pytest.mark.parametrize("name", ["gyroscope", "magnetometer"])
def test_sensors_of_zeros_are_none(name):
    """As logs with fixed columns have of a phone without them: its walks went anywhere."""
    sensors, _, _ = walk_sensors((Leg(20, 0.3, 3), Leg(15, 1.8)), Phone())
    zeros = sensors[name].assign(**dict.fromkeys(sensors[name].columns.drop("time_s"), 0.0))
    found, _ = reckon_walk({**sensors, name: zeros})
    without, _ = reckon_walk({one: rows for one, rows in sensors.items() if one != name})
    pd.testing.assert_frame_equal(found.motion, without.motion)
    assert (found.imu, found.notes) == (without.imu, without.notes)
