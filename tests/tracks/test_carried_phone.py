"""Phones as they are carried: by gyroscopes with a large bias, in other pockets, turning in bags.

Sensors are those of :mod:`made_phone`, turned to the axes of a phone that moves in hand or pocket.
"""

import numpy as np
import pandas as pd
import pytest
from made_phone import Leg, Phone, walk_sensors
from scipy.spatial.transform import Rotation

from mapfilter.tracks.pdr.attitude import Attitude
from mapfilter.tracks.pdr.carried_bias import CarriedBias, bias_while_carried
from mapfilter.tracks.pdr.options import WalkOptions
from mapfilter.tracks.pdr.remounts import drifts, parted_where_remounted, swings_rad
from mapfilter.tracks.pdr.signals import inertial_signals
from mapfilter.tracks.pdr.walk import reckon_walk

LEGS = (Leg(90, 0.5, 0.0), Leg(110, 2.2, 0.0), Leg(80, -2.6, 0.0), Leg(100, -0.9, 0.0))
BIAS_DEGPS = np.array([0.8, -0.5, 0.6])
UPRIGHT = (np.pi / 2, 0.0, 0.0)


def carried(sensors, rotvec_rad, bias_degps=(0.0, 0.0, 0.0)):
    """Return the sensors of a phone of which the attitude to the walker's body is given by time.

    ``rotvec_rad`` maps seconds after the start, shape (N,), to rotation vectors, shape (N, 3).
    """
    time_s = sensors["gyroscope"]["time_s"].to_numpy()
    pose = Rotation.from_rotvec(rotvec_rad(time_s - time_s[0]))
    turning = (pose[:-1].inv() * pose[1:]).as_rotvec() / np.diff(time_s)[:, None]
    found = {}
    for name, rows in sensors.items():
        values = pose.inv().apply(rows.iloc[:, 1:].to_numpy(copy=True))
        if name == "gyroscope":
            values += np.concatenate([turning, [[0, 0, 0]]]) + np.radians(bias_degps)
        found[name] = pd.DataFrame(np.column_stack([time_s, values]), columns=rows.columns)
    return found


def poses(*given, move_s=1.0):
    """Return attitudes by time: (seconds, rotation vector) each, gone over to in a second."""

    def at(time_s):
        found = Rotation.from_rotvec(np.tile(given[0][1], (len(time_s), 1)))
        for begin_s, rotvec in given[1:]:
            share = np.clip((time_s - begin_s) / move_s, 0.0, 1.0)
            rest = (found.inv() * Rotation.from_rotvec(rotvec)).as_rotvec()
            found = found * Rotation.from_rotvec(share[:, None] * rest)
        return found.as_rotvec()

    return at


def swinging(at, degrees, hertz=0.9):
    """Return attitudes that swing about the body's right, as a thigh does."""

    def swung(time_s):
        angle = np.radians(degrees) * np.sin(2 * np.pi * hertz * time_s)
        swing = Rotation.from_rotvec(np.column_stack([angle, np.zeros((len(angle), 2))]))
        return (swing * Rotation.from_rotvec(at(time_s))).as_rotvec()

    return swung


def bias_of(sensors):
    return bias_while_carried(inertial_signals(sensors)[0])


def errors_deg(sensors, true_s, true_rad, **options):
    """Return heading errors of the steps, and their times after the start."""
    found, _ = reckon_walk(sensors, WalkOptions(declination_deg=0.0, **options))
    rows = found.motion[found.motion["step_m"] > 0]
    at_s = rows["time_s"].to_numpy()
    nearest = np.abs(at_s[:, None] - true_s).argmin(axis=1)
    off = rows["heading_rad"].to_numpy() - true_rad[nearest]
    return np.degrees((off + np.pi) % (2 * np.pi) - np.pi), at_s - true_s[0], found


@pytest.mark.parametrize("seed", range(6))
def test_the_bias_is_found_without_a_rest(seed):
    sensors, _, _ = walk_sensors(LEGS, Phone(seed=seed))
    two = poses((0.0, (0.5, 0.0, 0.0)), (100.0, (1.3, 0.4, 0.0)))
    found = bias_of(carried(sensors, two, BIAS_DEGPS))
    assert np.degrees(found.shown_radps) == pytest.approx(BIAS_DEGPS, abs=0.08)


def test_gravity_alone_shows_it_where_the_phone_lies_in_two_ways():
    sensors, _, _ = walk_sensors(LEGS)
    del sensors["magnetometer"]
    two = poses((0.0, (0.0, 0.0, 0.0)), (100.0, UPRIGHT))
    found = bias_of(carried(sensors, two, BIAS_DEGPS))
    assert np.degrees(found.bias_radps) == pytest.approx(BIAS_DEGPS, abs=0.1)
    # In one way nothing is shown about the vertical: half a degree a second is left.
    flat = bias_of(carried(sensors, poses((0.0, (0.0, 0.0, 0.0))), BIAS_DEGPS))
    assert np.degrees(flat.bias_radps[:2]) == pytest.approx(BIAS_DEGPS[:2], abs=0.05)
    up, right = np.array([[0.0, 0.0, 1.0]]), np.array([[1.0, 0.0, 0.0]])
    assert 0.4 < np.degrees(flat.sd_about_radps(up)) <= 0.5
    assert np.degrees(flat.sd_about_radps(right)) < 0.05
    both = flat.sd_about_radps(np.concatenate([up, right]))
    assert both**2 == pytest.approx(np.diag(flat.covariance)[[0, 2]].mean())


def test_a_usual_bias_is_left_to_the_smoother():
    sensors, _, _ = walk_sensors(LEGS)
    found = bias_of(carried(sensors, poses((0.0, UPRIGHT)), (0.15, -0.1, 0.1)))
    assert not found.shown_radps.any()
    assert CarriedBias(np.radians([0.0, 0.31, 0.0]), np.zeros((3, 3))).shown_radps.any()
    assert not CarriedBias(np.radians([0.0, 0.29, 0.0]), np.zeros((3, 3))).shown_radps.any()


def test_without_a_gyroscope_or_in_a_few_seconds_nothing_is_shown():
    sensors, _, _ = walk_sensors((Leg(12, 0.0, 0.0),))
    assert not bias_of(carried(sensors, poses((0.0, UPRIGHT)), BIAS_DEGPS)).bias_radps.any()
    del sensors["gyroscope"]
    assert not bias_of(sensors).bias_radps.any()


def test_a_magnet_that_comes_and_goes_hides_nothing():
    sensors, _, _ = walk_sensors(LEGS)
    sensors = carried(sensors, poses((0.0, (0.6, 0.0, 0.0))), BIAS_DEGPS)
    near = np.sin(sensors["magnetometer"]["time_s"].to_numpy() / 9.0) > 0.8
    sensors["magnetometer"].loc[near, "x_ut"] += 25.0
    assert np.degrees(bias_of(sensors).shown_radps) == pytest.approx(BIAS_DEGPS, abs=0.15)


def test_headings_with_a_large_bias_are_those_of_the_walk():
    sensors, true_s, true_rad = walk_sensors(LEGS)
    two = poses((0.0, (0.6, 0.0, 0.0)), (110.0, (0.6, 0.0, 0.0)))
    off, _, found = errors_deg(carried(sensors, two, BIAS_DEGPS), true_s, true_rad)
    assert np.quantile(np.abs(off), 0.95) < 8
    assert any("a bias of 1.1 deg/s, which is subtracted" in note for note in found.notes)


@pytest.mark.parametrize("with_compass", [True, False])
@pytest.mark.parametrize("turned_deg", [100.0, 180.0, -130.0])
def test_a_phone_put_back_with_another_side_ahead(with_compass, turned_deg):
    sensors, true_s, true_rad = walk_sensors(LEGS)
    if not with_compass:
        del sensors["magnetometer"]
    turned = Rotation.from_rotvec([0, 0, np.radians(turned_deg)]) * Rotation.from_rotvec(UPRIGHT)
    at = swinging(poses((0.0, UPRIGHT), (true_s[150] - true_s[0], turned.as_rotvec())), 14.0)
    pocket = carried(sensors, at)
    found, _ = reckon_walk(pocket, WalkOptions(declination_deg=0.0))
    rows = found.motion[found.motion["step_m"] > 0]
    at_s = rows["time_s"].to_numpy()
    nearest = np.abs(at_s[:, None] - true_s).argmin(axis=1)
    if with_compass:
        heading = rows["heading_rad"].to_numpy()
    else:
        heading = np.nancumsum(found.motion["turn_rad"])[found.motion["step_m"] > 0]
    off = heading - true_rad[nearest]
    turns = np.abs(at_s[:, None] - true_s[[90, 200, 280]]).min(axis=1) < 2
    settled = (np.abs(at_s - true_s[150]) > 3) & ~turns
    off = np.degrees(np.angle(np.exp(1j * (off - (0.0 if with_compass else off[5])))))[settled]
    assert np.abs(off).max() < 15


def test_a_phone_that_turns_slowly_in_a_bag_is_followed():
    sensors, true_s, true_rad = walk_sensors(LEGS)

    def at(time_s):
        turned = Rotation.from_rotvec(np.outer(np.radians(0.4) * time_s, [0, 0, 1]))
        return (turned * Rotation.from_rotvec([1.0, 0.3, 0.0])).as_rotvec()

    off, _, _ = errors_deg(carried(sensors, swinging(at, 9.0)), true_s, true_rad)
    # It turns by 84 degrees.
    assert np.quantile(np.abs(off), 0.9) < 12


def test_a_swinging_phone_points_where_it_may():
    """Upright in a pocket, its back 35 degrees off the way: a hand would hold it so."""
    sensors, true_s, true_rad = walk_sensors(LEGS)
    turned = Rotation.from_rotvec([0, 0, np.radians(35)]) * Rotation.from_rotvec(UPRIGHT)
    pose = poses((0.0, turned.as_rotvec()))
    pocket, _, _ = errors_deg(carried(sensors, swinging(pose, 14.0)), true_s, true_rad)
    held, _, _ = errors_deg(carried(sensors, swinging(pose, 2.0)), true_s, true_rad)
    assert abs(np.median(pocket)) < 8
    assert abs(np.median(held)) == pytest.approx(35, abs=8)


def attitude_of(to_level, section=None):
    count = len(to_level)
    section = np.zeros(count, dtype=np.int64) if section is None else section
    reference = Rotation.identity(int(section.max()) + 1)
    return Attitude(to_level, np.zeros(count), section, reference)


def test_swings_are_the_median_of_a_posture_where_it_walks():
    time_s = np.arange(0.0, 60.0, 0.02)
    angle = np.radians(np.where(time_s < 30, 4.0, 20.0)) * np.sin(2 * np.pi * 0.9 * time_s)
    level = Rotation.from_rotvec(np.column_stack([angle, 0 * angle, 0 * angle]))
    section = (time_s >= 30).astype(np.int64)
    found = np.degrees(swings_rad(attitude_of(level, section), np.ones(3000, bool)))
    # The mean over 3 s swings a little, too.
    assert found == pytest.approx(np.array([4.0, 20.0]) / 2**0.5, rel=0.15)
    assert not swings_rad(attitude_of(level, section), np.zeros(3000, bool)).any()


def forward_of(*parts, noise_rad=0.0):
    rng = np.random.default_rng(3)
    angle = np.concatenate([np.full(count, np.radians(degrees)) for count, degrees in parts])
    return np.exp(1j * (angle + noise_rad * rng.standard_normal(len(angle))))


@pytest.mark.parametrize(
    ("parts", "cuts"),
    [
        (((2000, 10.0), (2000, 75.0)), [2000]),
        (((2000, 10.0), (2000, 65.0)), []),
        (((1500, 0.0), (1200, 120.0), (1500, -120.0)), [1500, 2700]),
        (((999, 0.0),), []),
        # Too little beside it.
        (((200, 0.0), (2000, 120.0)), []),
    ],
)
def test_postures_end_where_the_direction_jumps(parts, cuts):
    forward = forward_of(*parts, noise_rad=0.3)
    count = len(forward)
    turned = attitude_of(Rotation.identity(count))
    parted = parted_where_remounted(turned, forward, np.ones(count, bool))
    assert np.flatnonzero(np.diff(parted.section)) == pytest.approx(np.array(cuts) - 1, abs=25)
    assert len(parted.reference) == parted.section.max() + 1 == len(cuts) + 1
    if not cuts:
        assert parted is turned


def test_accelerations_without_a_direction_show_no_jump():
    forward = forward_of((2000, 0.0), (2000, 120.0), noise_rad=1.4)
    turned = attitude_of(Rotation.identity(4000))
    assert parted_where_remounted(turned, forward, np.ones(4000, bool)) is turned


def test_drifts_are_those_from_the_mean_of_each_posture():
    time_s = np.arange(0.0, 400.0, 0.02)
    angle = np.radians(0.2 * (time_s % 200))
    section = (time_s >= 200).astype(np.int64)
    turned = attitude_of(Rotation.identity(len(time_s)), section)
    walking = np.ones(len(time_s), bool)
    found = np.degrees(drifts(turned, np.exp(1j * angle), walking))
    expected = 0.2 * (time_s % 200) - 20.0
    inner = (time_s % 200 > 70) & (time_s % 200 < 130)
    assert found[inner] == pytest.approx(expected[inner], abs=0.5)
    # At the ends there are but rows of one side.
    assert np.abs(found - expected).max() < 6
    assert not drifts(turned, np.exp(1j * angle), ~walking).any()
