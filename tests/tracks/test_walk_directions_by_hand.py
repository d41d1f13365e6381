"""Directions of walking by hand: of a compass by rows, of the device, of accelerations; errors."""

from dataclasses import asdict, replace

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.pdr.direction import (
    direction_by_acceleration,
    direction_by_device,
    forward_accelerations,
    walking_direction,
)
from mapfilter.tracks.pdr.gyroscope import Gyroscope
from mapfilter.tracks.pdr.heading import YawOffset
from mapfilter.tracks.pdr.height import Climb
from mapfilter.tracks.pdr.mean_direction import mean_direction
from mapfilter.tracks.pdr.signals import RATE_HZ
from mapfilter.tracks.pdr.walk_noise import walk_noise, walk_notes

NAN = np.nan


def directions(time_s, at_s, azimuth_deg):
    found, chord = mean_direction(*(np.array(one, float) for one in (time_s, at_s, azimuth_deg)))
    return np.round(found, 6) % 360, chord


@pytest.mark.parametrize(
    ("time_s", "at_s", "azimuth_deg", "expected"),
    [
        # After the row before, up to the row itself; of the first row 2 s.
        ([10, 12], [8, 8.01, 10, 10.01, 12], [0, 20, 40, 60, 80], [30, 70]),
        # In any order, without those that are missing, and across north.
        ([10, 12], [11.5, 11, 9.5, 9, 9.7], [350, 20, 330, 350, NAN], [340, 5]),
        # After more than 30 s, of the last 10 s.
        ([0, 30, 61], [1, 29, 51, 52, 60], [10, 30, 100, 50, 70], [10, 20, 60]),
        # The nearest one within 2 s, the earlier of two.
        ([100, 200, 300], [98, 202.01, 299], [40, 50, 60], [40, NAN, 60]),
        ([0, 1], [0, 2], [30, 50], [30, 30]),
        ([10, 12, 12.01], [10], [70], [70, 70, NAN]),
        ([10, 12, 12.01], [12.01], [70], [NAN, 70, 70]),
        ([10, 12], [3, 12.5], [20, 40], [NAN, 40]),
        ([10, 11], [3, 9.9, 20], [20, 40, 60], [40, 40]),
        ([1000, 1025], [1003, 1024], [10, 30], [NAN, 20]),
        ([10, 12], [9], [NAN], [NAN, NAN]),
    ],
)
def test_the_direction_of_a_row_is_the_mean_since_the_row_before(
    time_s, at_s, azimuth_deg, expected
):
    found, chord = directions(time_s, at_s, azimuth_deg)
    np.testing.assert_allclose(found, expected, atol=1e-5)
    np.testing.assert_array_equal(chord, 1.0)


@pytest.mark.parametrize(
    ("azimuth_deg", "expected"),
    [
        ([0, 0, 90, 90], 0.5**0.5),
        # Two show no turn, and a chord of nine tenths is noise of the compass.
        ([0, 90], 1.0),
        ([0, 0, 50], 1.0),
        ([0, 0, 60], 7**0.5 / 3),
    ],
)
def test_where_a_walker_turned_the_chord_is_shorter_than_the_way(azimuth_deg, expected):
    count = len(azimuth_deg)
    for before in (0, 3):
        # Rows before show nothing of this one.
        at_s = np.concatenate([np.full(before, 9.0), 11 + 0.1 * np.arange(count)])
        found = directions([10, 12], at_s, [0] * before + azimuth_deg)[1]
        assert found.tolist() == pytest.approx([1.0, expected])


@pytest.mark.parametrize("direction_rad", [-2.0, 0.8])
def test_a_step_speeds_up_an_eighth_of_a_period_before_it_rises(direction_rad):
    """Two steps a second; a body that sways slowly, and a device that is turned meanwhile."""
    time_s = np.arange(int(40 * RATE_HZ)) / RATE_HZ
    phase, yaw_rad = 4 * np.pi * time_s, 0.05 * time_s
    forward = 2.0 * np.cos(phase + np.pi / 4)
    aside = 3.0 * np.sin(2 * np.pi * 0.2 * time_s)
    towards = np.exp(1j * (direction_rad + yaw_rad))
    level = forward * towards + aside * 1j * towards
    force = np.stack([level.real, level.imag, 9.81 + 1.5 * np.cos(phase)], axis=1)
    found = forward_accelerations(force, yaw_rad)
    inner = slice(int(5 * RATE_HZ), -int(5 * RATE_HZ))
    np.testing.assert_allclose(np.angle(found[inner]), direction_rad, atol=0.03)
    # Of both sizes.
    np.testing.assert_allclose(np.abs(found[inner]), 3.0, rtol=0.05)


def test_a_direction_by_accelerations_is_of_5_s_of_walk_at_least():
    forward = np.where(np.arange(400) < 250, np.exp(0.4j), 50 * np.exp(2j))
    walking = np.arange(400) < 250
    assert direction_by_acceleration(forward, walking) == pytest.approx(0.4)
    assert np.isnan(direction_by_acceleration(forward, np.arange(400) < 249))


@pytest.mark.parametrize(
    ("axis", "tilt_deg", "expected_deg"),
    [
        # Flat: by the top edge. Upright: away from the screen. The cosine of 45.57 degrees is 0.7.
        *(("y", 0, 90), ("y", 45.5, 90), ("y", 45.6, 180), ("y", 134.4, 180), ("y", 134.5, NAN)),
        *(("y", -45.6, 0), ("x", 45.5, 90), ("x", 90, 90), ("x", 100, 90), ("x", -90, -90)),
        ("x", 180, NAN),
    ],
)
def test_the_direction_in_which_a_device_points(axis, tilt_deg, expected_deg):
    found = direction_by_device(Rotation.from_euler(axis, tilt_deg, degrees=True))
    assert np.degrees(found) == pytest.approx(expected_deg, abs=1e-9, nan_ok=True)


@pytest.mark.parametrize(
    ("device_deg", "accelerations_deg", "pose", "expected_deg", "sd_deg"),
    [
        *((10, 49.9, "auto", 10, 8), (10, 50.1, "auto", 50.1, 20), (10, NAN, "auto", 10, 8)),
        *((170, -155, "auto", 170, 8), (170, -145, "auto", -145, 20)),
        *((10, 120, "device", 10, 8), (10, 20, "any", 20, 20), (10, NAN, "any", NAN, 180)),
        *((NAN, 20, "auto", 20, 20), (NAN, 20, "device", 20, 20), (NAN, NAN, "auto", NAN, 180)),
    ],
)
def test_the_device_counts_where_accelerations_agree_within_40_degrees(
    device_deg, accelerations_deg, pose, expected_deg, sd_deg
):
    found = walking_direction(np.radians(device_deg), np.radians(accelerations_deg), pose)
    assert np.degrees(found) == pytest.approx((expected_deg, sd_deg), nan_ok=True)


ROWS = pd.DataFrame(
    {
        "time_s": [0.0, 0.5, 1.1, 1.5, 3.0, 4.0],
        "step_m": [0.0, 0.6, 0.8, 0.7, 0.0, 0.7],
        "disturbed": [1.0, 0.0, 1.0, 0.0, 1.0, 0.0],
    }
)


def errors(sway_deg=3.0, sd_deg=8.0, rows=ROWS, **kind):
    sd_rad = np.radians([3.0, 4.0])
    offset = YawOffset(
        np.arange(2.0),
        np.zeros(2),
        sd_rad,
        0.1,
        np.radians(0.02),
        np.zeros(2, bool),
        np.radians(21),
    )
    return walk_noise(rows, offset, np.radians(sd_deg), np.radians(sway_deg), **kind)


USUAL = ImuNoise(
    # Between steps 0.6, 0.4 and 2.5 s; a tenth of their mean length of 0.7 m.
    period_s=0.6,
    sigma_trans_m=0.07,
    scale=0.1,
    step_scale_wander=0.06,
    step_scale_correlation_s=15.0,
)
GYROSCOPE = Gyroscope(noise_rad_per_sqrt_s=np.radians(1.0))
WALK_DEG = np.degrees(GYROSCOPE.walk_rad_per_sqrt_s)
# Lasting: the offset's, the direction's, and 5 degrees of any compass.
LASTING = {"bias_sd_deg": (12.5 + 64 + 25) ** 0.5}
DRIFTING = LASTING | {"drift_deg_per_sqrt_s": WALK_DEG}
TURNS = {
    "turns": "gyro",
    "gyro_noise_deg_per_sqrt_s": WALK_DEG,
    "gyro_bias_deg_per_s": 0.02,
}


@pytest.mark.parametrize(
    ("sway_deg", "compass", "gyroscope", "expected"),
    [
        (3.0, True, GYROSCOPE, {"sigma_orient_deg": 3.0, **DRIFTING}),
        (0.9, True, GYROSCOPE, {"sigma_orient_deg": 1.0, **DRIFTING}),
        # Without a gyroscope the spread of the compass, of which much lasts for seconds.
        (3.0, True, None, {"sigma_orient_deg": 21.0, "heading_correlation_s": 6.0, **LASTING}),
        (3.0, False, GYROSCOPE, {"sigma_orient_deg": 3.0, **TURNS}),
        (999.0, False, GYROSCOPE, {"sigma_orient_deg": 180.0, **TURNS}),
    ],
)
def test_the_errors_of_a_walk(sway_deg, compass, gyroscope, expected):
    found = errors(sway_deg, compass=compass, gyroscope=gyroscope)
    assert asdict(found) == pytest.approx(asdict(replace(USUAL, **expected)))


def test_a_walk_of_a_single_step_has_two_steps_a_second():
    found = errors(rows=ROWS[:2], compass=True, gyroscope=None)
    assert (found.period_s, found.sigma_trans_m) == pytest.approx((0.5, 0.06))


def test_a_direction_that_nothing_shows_is_any_one():
    assert errors(sd_deg=400.0, compass=True, gyroscope=GYROSCOPE).bias_sd_deg == 180.0


def test_notes_on_a_walk():
    found = (Climb(10.0, 22.0, -3.4, "lift"), Climb(30.0, 41.0, 5.0, "stairs"))
    words = walk_notes(ROWS, 2, found, compass=True)
    assert words == [
        "motion: 4 steps, 3 m",
        "compass disturbed for 25% of the steps, gyroscope used there",
        "2 gaps of the sensors: motion unknown there",
        "lift: -3.4 m in 12 s",
        "stairs: +5.0 m in 11 s",
    ]
    ten = pd.DataFrame({"step_m": np.full(10, 0.7), "disturbed": np.arange(10) < 1})
    assert walk_notes(ten, 0, (), compass=True) == ["motion: 10 steps, 7 m"]
    unknown = walk_notes(ten, 0, (), compass=False)
    assert unknown[1].startswith("no compass (magnetometer): turns only")
    assert len(unknown) == 2
