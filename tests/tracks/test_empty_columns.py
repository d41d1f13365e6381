"""Columns that are empty beside others of their quantity, as in logs with fixed ones."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.angles import wrap_rad
from mapfilter.tracks.readers.formats import read_recording

START_S = 1_778_666_400.0
TIME_S = START_S + np.arange(0.0, 120.0, 0.5)
RATE_RADPS = 0.1 * np.sin(np.arange(TIME_S.size) / 20)
TURNED_RAD = np.append(0.0, np.cumsum(0.25 * (RATE_RADPS[1:] + RATE_RADPS[:-1])))
COMPASS_DEG = np.degrees(np.pi / 2 - TURNED_RAD) % 360
NONE = np.full(TIME_S.size, np.nan)


def given(field):
    """Return the values of a field on the same way."""
    return {
        "compass_deg": COMPASS_DEG,
        "heading_rad": wrap_rad(TURNED_RAD),
        "turn_rad": np.diff(TURNED_RAD, prepend=0.0),
        "turn_deg": np.degrees(np.diff(TURNED_RAD, prepend=0.0)),
        "yaw_rate_radps": RATE_RADPS,
        "yaw_rate_degps": np.degrees(RATE_RADPS),
    }[field]


def turned_rad(log):
    heading = log.motion["heading_rad"].dropna().to_numpy()
    if heading.size:
        return heading[-1] - heading[0]
    return log.motion["turn_rad"].sum()


@pytest.mark.parametrize(
    ("empty", "full"),
    [
        ("wheel_speed_kmh", "wheel_speed_mps"),
        ("wheel_speed_mps", "wheel_speed_kmh"),
        ("wheel_speed_kmh", "odometer_m"),
        ("wheel_speed_mps", "odometer_km"),
        ("odometer_m", "odometer_km"),
        ("speed_kmh", "speed_mps"),
    ],
)
def test_speeds_beside_an_empty_column(read, empty, full):
    """There was no usable row: the empty column was read."""
    way_m = 8.0 * (TIME_S - START_S)
    of = {"odometer_m": way_m, "odometer_km": way_m / 1000}
    speed = of.get(full, 8.0 * (3.6 if full.endswith("kmh") else 1.0))
    log = read(car={"time": TIME_S, empty: NONE, full: speed, "yaw_rate_radps": RATE_RADPS})
    assert log.vehicle
    assert log.motion["step_m"].sum() == pytest.approx(way_m[-1], rel=0.02)


@pytest.mark.parametrize("empty", ["yaw_rate_radps", "heading_rad"])
@pytest.mark.parametrize("full", ["compass_deg", "turn_rad", "turn_deg", "yaw_rate_degps"])
def test_directions_of_a_vehicle_beside_an_empty_column(read, empty, full):
    """They were not used: the column counted as its turns."""
    log = read(car={"time": TIME_S, "wheel_speed_mps": 8.0, empty: NONE, full: given(full)})
    assert turned_rad(log) == pytest.approx(TURNED_RAD[-1], abs=0.05)


@pytest.mark.parametrize("full", ["compass_deg", "heading_rad", "turn_rad", "yaw_rate_radps"])
def test_lengths_of_steps_beside_empty_columns_of_places(read, full):
    """There was no usable row: a file with such columns was one of places."""
    columns = {"east_m": NONE, "north_m": NONE, "step_m": 0.35, full: given(full)}
    log = read(walk={"time": TIME_S, **columns})
    assert log.motion["step_m"].sum() == pytest.approx(0.35 * TIME_S.size, rel=0.01)
    assert turned_rad(log) == pytest.approx(TURNED_RAD[-1], abs=0.05)
    assert not [note for note in log.notes if "not used" in note]


@pytest.mark.parametrize("full", ["compass_deg", "turn_rad", "yaw_rate_radps"])
def test_counted_steps_beside_an_empty_column_of_lengths(read, full):
    """They had no directions."""
    columns = {"step_m": NONE, "steps": np.arange(TIME_S.size) // 2, full: given(full)}
    log = read(walk={"time": TIME_S, **columns})
    assert turned_rad(log) == pytest.approx(TURNED_RAD[-1], abs=0.1)
    assert not [note for note in log.notes if "not used" in note]


def test_turns_of_steps_in_radians_beside_an_empty_column_of_degrees(read):
    """They were unknown."""
    columns = {"step_m": 0.35, "turn_rad": given("turn_rad"), "turn_deg": NONE}
    log = read(walk={"time": TIME_S, **columns})
    assert turned_rad(log) == pytest.approx(TURNED_RAD[-1], abs=0.01)


def test_rotation_vectors_beside_an_empty_column_of_their_scalar_part(tmp_path):
    """There was no usable row."""
    path = tmp_path / "phone.csv"
    pd.DataFrame({"time": TIME_S, "qx": 0.0, "qy": 0.0, "qz": 0.6, "qw": NONE}).to_csv(path)
    rows = read_recording(path).tables["orientation"]
    np.testing.assert_allclose(rows["qw"], 0.8)
