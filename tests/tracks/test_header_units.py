"""Units that the names of columns state: converted where they are known, refused where not."""

import numpy as np
import pandas as pd
import pytest

from mapfilter._header_units import UNITS, header_unit
from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording

TIME_S = np.arange(0.0, 10.0, 0.5)
SPEED_MPS = 8.0 + np.sin(TIME_S)
RATE_RADPS = 0.2 * np.cos(TIME_S)


def read(tmp_path, columns, **own):
    path = tmp_path / "drive.csv"
    pd.DataFrame(columns).to_csv(path, index=False)
    return read_recording(path, options=ReadOptions(columns=own))


@pytest.mark.parametrize(
    ("speed", "by", "rate", "turned"),
    [
        ("Speed [km/h]", 3.6, "yaw rate [deg/s]", 180 / np.pi),
        ("Speed (kph)", 3.6, "Yaw Rate (°/s)", 180 / np.pi),
        ("speed_mph", 1 / 0.44704, "yaw_dps", 180 / np.pi),
        ("Speed [m/s]", 1.0, "yaw [rad/s]", 1.0),
        ("v [knots]", 3600 / 1852, "w [mrad/s]", 1000.0),
        ("Speed (front left)", 1.0, "yaw", 1.0),
    ],
)
def test_odometry_is_converted_by_its_header(tmp_path, speed, by, rate, turned):
    columns = {"Time [ms]": 1000 * TIME_S, speed: by * SPEED_MPS, rate: turned * RATE_RADPS}
    found = read(tmp_path, columns, time="Time [ms]", wheel_speed_mps=speed, yaw_rate_radps=rate)
    odometry = found.tables["odometry"]
    np.testing.assert_allclose(odometry["time_s"], TIME_S)
    np.testing.assert_allclose(odometry["speed_mps"], SPEED_MPS)
    np.testing.assert_allclose(odometry["yaw_rate_radps"], RATE_RADPS)
    told = [note for note in found.notes if "by the name of its column" in note]
    assert len(told) == 1 + (by != 1.0) + (turned != 1.0)


def test_a_field_in_other_units_is_converted_to_them(tmp_path):
    columns = {"time": TIME_S, "v [m/s]": SPEED_MPS, "w [rad/s]": RATE_RADPS}
    own = {"wheel_speed_kmh": "v [m/s]", "yaw_rate_degps": "w [rad/s]"}
    odometry = read(tmp_path, columns, **own).tables["odometry"]
    np.testing.assert_allclose(odometry["speed_mps"], SPEED_MPS)
    np.testing.assert_allclose(odometry["yaw_rate_radps"], RATE_RADPS)


def test_headings_in_degrees_are_converted_with_a_word_on_their_sense(tmp_path):
    columns = {"time": TIME_S, "step_m": 1.0, "Heading (deg)": 90.0}
    found = read(tmp_path, columns, heading_rad="Heading (deg)")
    np.testing.assert_allclose(found.tables["motion"]["heading_rad"], np.pi / 2)
    (note,) = [note for note in found.notes if note.startswith("heading_rad: deg by the name")]
    assert "(a compass is compass_deg)" in note


def test_units_that_are_none_of_the_quantity_are_refused_together(tmp_path):
    columns = {"time": TIME_S, "Speed [rpm]": SPEED_MPS, "Yaw [counts]": RATE_RADPS}
    own = {"wheel_speed_mps": "Speed [rpm]", "yaw_rate_radps": "Yaw [counts]"}
    with pytest.raises(InputError) as error:
        read(tmp_path, columns, **own)
    speed, rate = sorted(map(str, error.value.faults), key=lambda fault: "yaw" in fault)
    assert "drive.csv header: expected a unit of speed (m/s, km/h, mph, knots, " in speed
    assert "for wheel_speed_mps, found rpm in speed [rpm] (likely: another quantity" in speed
    assert "a unit of rate of turning (rad/s, deg/s" in rate
    assert "found counts in yaw [counts]" in rate


def test_decibels_are_no_level(tmp_path):
    columns = {"time": TIME_S, "cell": "A", "RSRQ [dB]": -10.0}
    with pytest.raises(InputError, match=r"a unit of level \(dbm\) for level_dbm, found db"):
        read(tmp_path, columns, level_dbm="RSRQ [dB]")


@pytest.mark.parametrize(
    ("field", "column", "unit"),
    [
        ("time", "Time [UTC]", None),
        ("time", "timestamp (us)", "us"),
        ("lat_deg", "Latitude (WGS84)", None),
        ("lat_deg", "Latitude [°]", "deg"),
        ("altitude_m", "altitude (ft)", "ft"),
        ("acc_x", "acc_x [g]", "g"),
        ("acc_x", "Acc X (m/s^2)", "m/s2"),
        ("gyr_z", "gyro z [deg s⁻¹]", "deg/s"),
        ("yaw_rate_degps", "Gierrate [Grad/s]", "deg/s"),
        ("compass_deg", "Kompass (Grad)", "deg"),
        ("mag_x", "mag x [µT]", "ut"),
        ("level_dbm", "RSRP [dBm]", "dbm"),
        ("level_dbm", "rsrp_dbm", "dbm"),
        ("wheel_speed_mps", "Speed (m/min)", ""),
        ("wheel_speed_mps", "Speed [-]", None),
        ("ci", "Cell [eci]", None),
    ],
)
def test_units_of_names(field, column, unit):
    found = header_unit(field, column)
    assert (found.unit if found is not None else None) == unit


def test_factors_of_one_quantity_agree():
    for field, column, factor in (
        ("wheel_speed_mps", "v [km/h]", 1 / 3.6),
        ("wheel_speed_kmh", "v [km/h]", 1.0),
        ("yaw_rate_degps", "w (rpm)", 6.0),
        ("step_m", "step_cm", 0.01),
        ("pressure_hpa", "p [kPa]", 10.0),
    ):
        assert header_unit(field, column).factor == pytest.approx(factor)
    assert all(next(iter(units.values())) == 1.0 for units in UNITS.values())


PLACE = {"Latitude (deg)": 60.1 + TIME_S / 1e4, "Longitude (deg)": 25.0}
ROTATION = {f"Gyr {axis} (rad/s)": 0.1 for axis in "xyz"}
FORCE = {f"Acc {axis} (m/s^2)": 9.8 for axis in "xyz"}


@pytest.mark.parametrize(
    ("columns", "tables"),
    [
        ({"Vehicle speed (m/s)": SPEED_MPS, "Yaw rate (rad/s)": RATE_RADPS}, {"odometry"}),
        ({"Wheel speed (m/s)": SPEED_MPS}, {"odometry"}),
        (
            {**PLACE, "Wheel speed (m/s)": SPEED_MPS, "Yaw rate (rad/s)": RATE_RADPS},
            {"positions", "odometry"},
        ),
        ({**PLACE, "Speed (km/h)": 3.6 * SPEED_MPS}, {"positions"}),
        ({**PLACE, "Pressure (hPa)": 1000.0}, {"positions", "barometer"}),
        ({**ROTATION, **FORCE}, {"gyroscope", "accelerometer"}),
        ({"acc_x (m/s2)": 0.1, "acc_y (m/s2)": 0.1, "acc_z (m/s2)": 9.8}, {"accelerometer"}),
    ],
    ids=lambda given: "-".join(sorted(given)),
)
def test_units_in_parentheses_alone_make_no_file_of_phyphox(tmp_path, columns, tables):
    """Other columns than those of one sensor were lost, refused, or km/h were m/s."""
    found = read(tmp_path, {"Time (s)": TIME_S, **columns})
    assert found.format == "csv"
    assert set(found.tables) == tables
    for name in {"odometry", "positions"} & tables:
        speed = found.tables[name]["speed_mps"].dropna()
        assert speed.empty or speed.tolist() == pytest.approx(SPEED_MPS)


@pytest.mark.parametrize(
    "columns",
    [
        {"Latitude (°)": 60.1 + TIME_S / 1e4, "Longitude (°)": 25.0, "Height (m)": 10.0,
         "Velocity (m/s)": SPEED_MPS, "Direction (°)": 90.0, "Horizontal Accuracy (m)": 5.0,
         "Vertical Accuracy (°)": 3.0},
        {"X (hPa)": 1000.0},
        ROTATION | {"Absolute (rad/s)": 0.2},
        {f"Linear Acceleration {axis} (m/s^2)": 0.1 for axis in "xyz"},
    ],
    ids=list,
)  # fmt: skip
def test_files_of_phyphox_are_known_by_the_columns_of_one_sensor(tmp_path, columns):
    found = read(tmp_path, {"Time (s)": TIME_S, **columns})
    assert found.format == "phyphox"
    assert len(found.tables) == 1
