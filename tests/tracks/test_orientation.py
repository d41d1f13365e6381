"""Headings and turns of a device that states its attitude as quaternions."""

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

import mapfilter as mf
from mapfilter.angles import wrap_rad
from mapfilter.errors import InputError
from mapfilter.tracks.pdr.options import WalkOptions
from mapfilter.tracks.pdr.orientation import compass_of_orientation, turning_of_orientation
from mapfilter.tracks.readers.formats import read_recording

TIME_S = 1_778_666_400.0 + np.arange(0.0, 120.0, 0.5)
HEADING_RAD = np.cumsum(np.where((TIME_S // 20) % 2 == 0, 0.06, -0.02))
"""Of the way, counter-clockwise from east."""
FLAT = Rotation.identity()
UPRIGHT = Rotation.from_rotvec([np.pi / 2, 0, 0])
POCKET = Rotation.from_rotvec([0.4, -1.9, 2.2])


def attitudes(held):
    """The attitude of a device whose y axis points along the way where it is held flat."""
    yaw = HEADING_RAD - np.pi / 2
    return (Rotation.from_rotvec(np.outer(yaw, [0, 0, 1])) * held).as_quat()


def orientation(held, sign=1):
    columns = dict(zip(("qx", "qy", "qz", "qw"), sign * attitudes(held).T, strict=True))
    return pd.DataFrame({"time_s": TIME_S, **columns})


@pytest.mark.parametrize("held", [FLAT, UPRIGHT, POCKET])
@pytest.mark.parametrize("turned", [0.0, 2.0])
def test_turns_are_those_of_the_way_however_it_is_held(held, turned):
    rows = orientation(held)
    # Another direction of x, as without a compass, and a sign that means nothing.
    other = Rotation.from_rotvec([0, 0, turned]) * Rotation.from_quat(rows.iloc[:, 1:].to_numpy())
    rows.iloc[:, 1:] = other.as_quat() * np.where(np.arange(len(rows)) % 3, 1, -1)[:, None]
    found = turning_of_orientation({"orientation": rows}).between(TIME_S)
    np.testing.assert_allclose(found[1:], np.diff(HEADING_RAD), atol=1e-9)


def test_rows_far_apart_say_nothing_of_the_turn_between():
    rows = orientation(FLAT).drop(index=range(50, 60))
    turn = turning_of_orientation({"orientation": rows}).between(TIME_S)
    assert np.flatnonzero(np.isnan(turn)).tolist() == [0, *range(50, 61)]


@pytest.mark.parametrize("held", [FLAT, UPRIGHT])
def test_where_a_device_in_the_hand_points(held):
    azimuth = compass_of_orientation({"orientation": orientation(held)})["magnetic_deg"]
    apart = azimuth - (90 - np.degrees(HEADING_RAD))
    np.testing.assert_allclose((apart + 180) % 360 - 180, 0, atol=1e-6)
    down = Rotation.from_rotvec([0, np.pi, 0])
    assert compass_of_orientation({"orientation": orientation(down)})["magnetic_deg"].isna().all()


NAMES = {
    "qx": ("qx", "qy", "qz", "qw"),
    "quat": ("quat_x", "quat_y", "quat_z", "quat_w"),
    "vector": ("rotation_vector_x", "rotation_vector_y", "rotation_vector_z"),
}


@pytest.mark.parametrize("names", NAMES)
def test_counted_steps_turn_by_it(tmp_path, names):
    """There was no motion: which way the steps went was unknown."""
    quaternion = attitudes(FLAT)
    quaternion *= np.where(quaternion[:, 3:] < 0, -1, 1)
    parts = dict(zip(NAMES[names], quaternion.T, strict=False))
    table = {"time": TIME_S, "steps": np.arange(len(TIME_S)), **parts}
    pd.DataFrame(table).to_csv(tmp_path / "a.csv", index=False)
    log = mf.read_log(tmp_path / "a.csv")
    np.testing.assert_allclose(log.motion["turn_rad"][1:], np.diff(HEADING_RAD), atol=1e-6)
    assert log.motion["heading_rad"].isna().all()
    assert any("heading at the start is unknown" in note for note in log.notes)
    assert any("without qw" in note for note in log.notes) == (names == "vector")
    ahead = mf.read_log(tmp_path / "a.csv", walk=WalkOptions(pose="device", declination_deg=10.0))
    apart = ahead.motion["heading_rad"] - HEADING_RAD + np.radians(10)
    np.testing.assert_allclose(np.angle(np.exp(1j * apart.iloc[3:-3])), 0, atol=0.07)
    assert not any("has no effect" in note for note in ahead.notes)


@pytest.mark.parametrize("rates", [{}, {"gyr_x": 0.3, "gyr_y": -0.2, "gyr_z": 0.1}])
def test_a_vehicle_turns_by_it(tmp_path, rates):
    """Beside speeds of the wheels it was not used: directions were unknown.

    So they are with a gyroscope that nothing shows the vertical of.
    """
    table = orientation(POCKET).rename(columns={"time_s": "time"}).assign(wheel_speed_mps=8.0)
    table = table.assign(**rates)
    table.to_csv(tmp_path / "a.csv", index=False)
    log = mf.read_log(tmp_path / "a.csv")
    turned = HEADING_RAD[-1] - HEADING_RAD[0]
    assert log.motion["turn_rad"].sum() == pytest.approx(turned, abs=0.01)
    assert any("turns are those of the phone's orientation" in note for note in log.notes)
    assert not any("gyroscope" in note for note in log.notes)


def test_angles_for_a_quaternion_are_refused(tmp_path):
    table = orientation(FLAT).rename(columns={"time_s": "time"})
    table[["qx", "qy", "qz"]] = table[["qx", "qy", "qz"]] * 90 + 5
    table.to_csv(tmp_path / "a.csv", index=False)
    with pytest.raises(InputError, match=r"row 2, qx.*length 1, found \d.*angles"):
        read_recording(tmp_path / "a.csv")
    table = orientation(FLAT).rename(columns={"time_s": "time"})
    table.loc[7, ["qx", "qy", "qz", "qw"]] = 0.0
    table.to_csv(tmp_path / "a.csv", index=False)
    (bad,) = read_recording(tmp_path / "a.csv").unusable
    assert bad.lines == (9,)


def test_a_phone_without_an_attitude_writes_zeros(tmp_path):
    """Its whole file was refused."""
    zeros = dict.fromkeys(("qx", "qy", "qz", "qw"), 0.0)
    table = pd.DataFrame({"time": TIME_S, "wheel_speed_mps": 8.0, **zeros})
    table.to_csv(tmp_path / "a.csv", index=False)
    found = read_recording(tmp_path / "a.csv")
    assert list(found.tables) == ["odometry"]


@pytest.mark.parametrize("column", ["bearing", "course_deg", "Course [deg]"])
def test_a_course_beside_a_speed_alone_gives_headings(tmp_path, column):
    """Positions were left out, or never written; the course was not used."""
    azimuth = (90 - np.degrees(HEADING_RAD)) % 360
    speed = np.where(np.arange(len(TIME_S)) // 40 == 3, 0.0, 7.0)
    # A receiver that stands gives any course.
    azimuth[speed == 0] = np.random.default_rng(4).uniform(0, 360, int((speed == 0).sum()))
    table = {"time": TIME_S, "GPS speed (m/s)": speed, column: azimuth}
    pd.DataFrame(table).to_csv(tmp_path / "a.csv", index=False)
    log = mf.read_log(tmp_path / "a.csv")
    moves = (log.motion["step_m"] > 0).to_numpy()
    off = wrap_rad(log.motion["heading_rad"].to_numpy() - HEADING_RAD)
    assert np.abs(off[moves]).max() < 0.1
    assert not log.motion["step_m"].isna().any()
    assert moves.sum() > 0.8 * len(TIME_S)
