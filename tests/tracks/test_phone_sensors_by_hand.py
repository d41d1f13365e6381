"""Sensors of phyphox and Sensor Logger by hand: which files are such, their sensors and units."""

from pathlib import Path

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.phone_sensors import PHYPHOX, SENSOR_LOGGER
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.text import Text

NAN = np.nan
START_S = 1_777_629_600


def text(*lines):
    return Text(Path("a.csv"), "\n".join([*lines, ""]).encode())


def phyphox(head, *rows, path="a.csv"):
    reading = Reading(Path(path))
    PHYPHOX.read(text(head, *rows), reading, ReadOptions())
    return reading


def logged(head, *rows, name="a.csv"):
    """Read rows of Sensor Logger, a second apart."""
    reading = Reading(Path(name))
    lines = [f"{START_S + i}000000000,{i},{row}" for i, row in enumerate(rows)]
    SENSOR_LOGGER.read(text(f"time,seconds_elapsed,{head}", *lines), reading, ReadOptions())
    return reading


def only(reading, *names):
    ((table, (rows,)),) = reading.tables.items()
    columns = rows[list(names)].to_numpy().tolist()
    return table, [[None if value != value else value for value in row] for row in columns]


FORCES = [f"Acceleration {axis} (m/s^2)" for axis in "xyz"]
PLACES = ["Latitude (°)", "Longitude (°)"]


@pytest.mark.parametrize(
    ("names", "is_one"),
    [
        (FORCES, True),
        ([f"{axis} (m/s^2)" for axis in "xyz"], True),
        (FORCES[:2], False),
        ([*FORCES, "Absolute acceleration (m/s^2)"], True),
        ([*FORCES, *(f"Gyroscope {axis} (rad/s)" for axis in "xyz")], False),
        ([*FORCES[:2], "Acceleration z"], False),
        (["Pressure (hPa)"], True),
        (["Light (lx)"], False),
        ([*PLACES, "Height (m)", "Velocity (m/s)", "Direction (°)"], True),
        ([*PLACES, "Height (m)", "Horizontal Accuracy (m)"], True),
        ([*PLACES, "Velocity (km/h)"], False),
        ([*PLACES, "Pressure (hPa)"], False),
        ([PLACES[0], "Velocity (m/s)"], False),
        ([], False),
    ],
)
def test_what_is_of_phyphox(names, is_one):
    """Any table that has its units and its kind of columns, and times in seconds first."""
    assert PHYPHOX.matches(text(",".join(["Time (s)", *names]))) == is_one
    assert PHYPHOX.matches(text("\t".join(['"Time (s)"', *names]))) == is_one
    assert not PHYPHOX.matches(text(",".join(["Time (ms)", *names])))
    assert not PHYPHOX.matches(text(",".join([*names, "Time (s)"])))


@pytest.mark.parametrize(
    ("title", "unit", "path", "table"),
    [
        ("Acceleration", "m/s^2", "a.csv", "accelerometer"),
        ("Linear Acceleration", "m/s²", "a.csv", "linear_acceleration"),
        ("Acceleration without g", "m/s^2", "a.csv", "linear_acceleration"),
        ("Acceleration", "m/s^2", "Linear Accelerometer.csv", "linear_acceleration"),
        ("Acceleration", "m/s^2", "linear/a.csv", "accelerometer"),
        ("Gyroscope", "rad/s", "a.csv", "gyroscope"),
        ("Linear", "rad/s", "Linear.csv", "gyroscope"),
        ("Magnetic field", "µT", "a.csv", "magnetometer"),
    ],
)
def test_sensors_of_phyphox(title, unit, path, table):
    head = ",".join(["Time (s)", *(f"{title} {axis} ({unit})" for axis in "zxy")])
    found = phyphox(head, "0.5,3,1,2", path=path)
    name = {"m/s^2": "mps2", "m/s²": "mps2", "rad/s": "radps", "µT": "ut"}[unit]
    of = only(found, "time_s", *(f"{axis}_{name}" for axis in "xyz"))
    assert of == (table, [[0.5, 1, 2, 3]])
    assert (found.program, found.clock.kind) == ("phyphox", "monotonic")


def test_positions_and_pressures_of_phyphox():
    head = "Time (s),Latitude (°),Longitude (°),Height (m),Velocity (m/s),Direction (°),"
    head += "Horizontal Accuracy (m)"
    names = ["time_s", "lat_deg", "lon_deg", "altitude_m", "speed_mps", "course_deg", "accuracy_m"]
    found = phyphox(head, "0.5,60,25,12,3,4,5")
    assert only(found, *names) == ("positions", [[0.5, 60, 25, 12, 3, 4, 5]])
    found = phyphox("Time (s),X (hPa)", "0.5,1013.25")
    assert only(found, "time_s", "pressure_hpa") == ("barometer", [[0.5, 1013.25]])


def test_axes_that_are_missing_are_told():
    with pytest.raises(InputError, match="axes x, y and z of an accelerometer") as raised:
        phyphox("Time (s),Gyroscope x (rad/s),Gyroscope y (rad/s)", "0,1,2")
    assert str(raised.value).startswith("a.csv header: ")
    assert str(raised.value).endswith("found gyroscope x, gyroscope y")
    with pytest.raises(InputError, match="expected axes x, y and z"):
        phyphox("Time (s),a x (lx),a y (lx),a z (lx)", "0,1,2,3")


HEAD = "Time (s)," + ",".join(f"Gyroscope {axis} (rad/s)" for axis in "xyz")


@pytest.mark.parametrize(
    ("events", "times"),
    [
        # From each start on the system's time, also before the first one.
        (["START,1,{0}", "PAUSE,3,{2}", "START,3,{500}"], [-1, 0, 500, 501]),
        (["START,1,", "START,3,{500}"], [497, 498, 500, 501]),
        (["PAUSE,1,{0}"], None),
        (["START,,{0}"], None),
    ],
)
def test_times_beside_phyphox(tmp_path, events, times):
    stamps = {seconds: START_S + seconds for seconds in (0, 2, 500)}
    for seconds, stamp in stamps.items():
        events = [event.replace(f"{{{seconds}}}", str(stamp)) for event in events]
    (tmp_path / "meta").mkdir()
    lines = ["event,experiment time,system time", *events, ""]
    (tmp_path / "meta" / "time.csv").write_text("\n".join(lines))
    found = phyphox(HEAD, *(f"{at},1,2,3" for at in (0, 1, 3, 4)), path=tmp_path / "a.csv")
    _, rows = only(found, "time_s")
    if times is None:
        assert rows == [[0], [1], [3], [4]]
        told = "meta/time.csv without a usable start; times count from an unknown one"
    else:
        assert rows == [[START_S + time] for time in times]
        told = "times are UTC by meta/time.csv"
    assert found.notes == [told]
    assert found.clock.kind == ("utc" if times else "monotonic")


@pytest.mark.parametrize(
    ("names", "is_one"),
    [
        *((f"time,seconds_elapsed,{name}", True) for name in ("x", "latitude", "pressure", "qx")),
        *((f"time,seconds_elapsed,{name}", True) for name in ("steps", "magneticBearing")),
        ("time,seconds_elapsed,lux", False),
        ("time,x,y,z", False),
        ("seconds_elapsed,x,y,z", False),
    ],
)
def test_what_is_of_sensor_logger(names, is_one):
    assert SENSOR_LOGGER.matches(text(names)) == is_one


@pytest.mark.parametrize(
    ("name", "provider"),
    [
        ("Location.csv", "fused"),
        ("LocationGps.csv", "gps"),
        ("LocationNetwork.csv", "network"),
        ("LocationGps-2.csv.gz", "gps"),
        ("gps-location.csv", "fused"),
    ],
)
def test_positions_of_sensor_logger(name, provider):
    """-1 is an unknown speed or direction."""
    head = "latitude,longitude,altitude,horizontalAccuracy,speed,bearing"
    found = logged(head, "60,25,12,4,3,90", "60,25,12,4,0,0", "60,25,12,4,-1,-1", name=name)
    names = ["time_s", "lat_deg", "lon_deg", "altitude_m", "accuracy_m", "speed_mps", "course_deg"]
    assert only(found, *names)[1] == [
        [START_S, 60, 25, 12, 4, 3, 90],
        [START_S + 1, 60, 25, 12, 4, 0, 0],
        [START_S + 2, 60, 25, 12, 4, None, None],
    ]
    assert only(found, "provider") == ("positions", [[provider]] * 3)
    assert (found.clock.kind, found.notes) == ("utc", [])


@pytest.mark.parametrize(
    ("pressures", "hpa", "are_kilopascal"),
    [
        # By their median, from 30 to 110.
        (["101.325"], [1013.25], True),
        (["30"], [300], True),
        (["110"], [1100], True),
        (["1013.25"], [1013.25], False),
        (["101", "102", "400"], [1010, 1020], True),
        (["101", "400", "500"], [400, 500], False),
    ],
)
def test_pressures_in_kilopascal(pressures, hpa, are_kilopascal):
    found = logged("pressure", *pressures)
    assert only(found, "pressure_hpa") == ("barometer", [[pytest.approx(one)] for one in hpa])
    told = "barometer: pressures in kPa, turned into hPa"
    assert found.notes == [told] * are_kilopascal


@pytest.mark.parametrize("pressure", ["29.9", "110.1", ""])
def test_other_pressures_are_none(pressure):
    assert logged("pressure", pressure).tables == {}


def test_other_sensors_of_sensor_logger():
    found = logged("qz,qy,qx,qw", "0.1,0.2,0.3,0.4")
    names = ["time_s", "qx", "qy", "qz", "qw"]
    assert only(found, *names) == ("orientation", [[START_S, 0.3, 0.2, 0.1, 0.4]])
    assert only(logged("steps", "7", "9"), "time_s", "count") == (
        "steps",
        [[START_S, 7], [START_S + 1, 9]],
    )
    assert only(logged("magneticBearing", "355"), "magnetic_deg") == ("compass", [[355]])
    with pytest.raises(
        InputError, match="expected columns of a sensor or of positions, found time"
    ):
        logged("x,y", "1,2")


@pytest.mark.parametrize(
    ("name", "table"),
    [
        ("TotalAcceleration.csv", "accelerometer"),
        ("AccelerometerUncalibrated.csv", "accelerometer"),
        ("Accelerometer.csv", "linear_acceleration"),
        ("Gravity.csv", "gravity"),
        ("GyroscopeUncalibrated.csv", "gyroscope"),
        ("Gyroscope-2.csv", "gyroscope"),
        ("MagnetometerUncalibrated.csv", "magnetometer"),
        ("Magnetometer.csv", "magnetometer"),
        ("wrist_motion-gyroscope.csv", "gyroscope"),
    ],
)
def test_sensors_by_the_name_of_their_file(name, table):
    found = logged("z,y,x", "3,2,1", name=name)
    unit = {"gyroscope": "radps", "magnetometer": "ut"}.get(table, "mps2")
    of = only(found, "time_s", *(f"{axis}_{unit}" for axis in "xyz"))
    assert of == (table, [[START_S, 1, 2, 3]])
    assert found.notes == []


@pytest.mark.parametrize(
    ("length", "table"),
    [
        # What a phone at rest measures: of the earth's gravity, and of its field.
        (8.4, None),
        (8.6, "accelerometer"),
        (11.4, "accelerometer"),
        (11.6, None),
        (14.9, None),
        (15.1, "magnetometer"),
        (89.9, "magnetometer"),
        (90.1, None),
    ],
)
def test_a_sensor_by_its_values(length, table):
    """By the median length, of 0.6, 0.48 and 0.64 times it."""
    row = f"{0.6 * length},{-0.48 * length},{0.64 * length}"
    rows = [row, row, "0,0,0", ",,"]
    if table is None:
        with pytest.raises(InputError, match=r"sensor, such as Gyroscope\.csv, found a\.csv"):
            logged("x,y,z", *rows)
        return
    found = logged("x,y,z", *rows)
    assert [*found.tables] == [table]
    assert found.notes == [f"taken for a {table} by its values (median {length:.1f})"]
