"""Tables with a row for each value by hand: their columns, names, units and rows."""

from pathlib import Path

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.long_tables import (
    FORMAT,
    _is_nothing,
    _layout,
    _sensor,
    _widened,
    _with_unit,
    has_columns_of,
)
from mapfilter.tracks.readers.texts.separated_values import header_columns
from mapfilter.tracks.readers.texts.text import Text

NAN = np.nan


def wide(*lines, own=()):
    """Return names and numbers of the columns that are made of a table, and its lines."""
    reading = Reading(Path("a.csv"))
    rows = header_columns("\n".join([*lines, ""]).encode(), reading)
    found, made = _widened(rows, _layout(rows.names), own)
    return {name: found.number(name).tolist() for name in found.names}, (made, found.line, reading)


@pytest.mark.parametrize(
    ("names", "layout"),
    [
        ("time,name,value", ("time", "name", {"": "value"}, "", ())),
        ("seconds,pid,value,units", ("seconds", "pid", {"": "value"}, "units", ())),
        ("time_ms,sensor,x,y,z", ("time_ms", "sensor", {a: a for a in "xyz"}, "", ())),
        (
            "t_ns,timestamp_ns,sensor_type,value_0,value_1,value_2,acc",
            (
                "timestamp_ns",
                "sensor_type",
                {"x": "value_0", "y": "value_1", "z": "value_2"},
                "",
                ("t_ns", "acc"),
            ),
        ),
        # A single value goes before axes; a column that is there twice is none beside.
        ("time,type,value,x,y,z", ("time", "type", {"": "value"}, "", ("x", "y", "z"))),
        ("time,name,value,a,a,b", ("time", "name", {"": "value"}, "", ("b",))),
        ("time,name,x,y", None),
        ("time,value", None),
        ("name,value", None),
    ],
)
def test_columns_of_such_a_table(names, layout):
    found = _layout(names.split(","))
    if layout is None:
        assert found is None
    else:
        assert (found.time, found.kind, found.values, found.unit, found.beside) == layout


@pytest.mark.parametrize(
    ("lines", "matches"),
    [
        (["time,name,value", "0,speed,1"], True),
        # With positions beside names and values only where names are columns of a log, too.
        (["time,lat,lon,name,value", "0,60,25,temperature,1"], False),
        (["time,lat,lon,name,value", "0,60,25,wheel_speed_mps,1"], True),
        (["time,lat,lon,name,value", "0,60,25,step_m,1", "", "0,60,25,heading_rad,1"], True),
        (["time,speed,lat"], False),
    ],
)
def test_what_is_such_a_table(lines, matches):
    assert FORMAT.matches(Text(Path("a.csv"), "\n".join(lines).encode())) == matches


def test_columns_of_names_or_values():
    text = Text(Path("a.csv"), b"time,Name,Value,other\n")
    assert has_columns_of(text, ["NAME"])
    assert has_columns_of(text, ["other", "value"])
    assert not has_columns_of(text, ["other", "time"])
    assert not has_columns_of(Text(Path("a.csv"), b"time,value\n"), ["value"])


def test_a_row_for_each_time():
    """A name again at a time is a row of its own; of each row the first line counts."""
    columns, (made, line, reading) = wide(
        *("time,name,value,k", "1,a,5,7", "1,b,6,8", "2,a,7,9", "2,A,8,9", "1,c,4,9", "3,,1,9")
    )
    assert made == ["a", "b", "c"]
    assert columns["time"] == [1, 2, 2, 3]
    assert columns["a"] == pytest.approx([5, 7, 8, NAN], nan_ok=True)
    assert columns["b"] == pytest.approx([6, NAN, NAN, NAN], nan_ok=True)
    assert columns["c"] == pytest.approx([4, NAN, NAN, NAN], nan_ok=True)
    assert columns["k"] == [7, 9, 9, 9]
    assert line.tolist() == [2, 4, 5, 7]
    assert reading.notes == ["a row for each value: 3 columns made of the names in name"]
    assert {why: some[0].tolist() for why, some in reading._refused.items()} == {
        "no name in column name": [7]
    }


def test_cells_of_one_time_are_rows_of_their_own():
    columns, _ = wide("time,ci,name,value", "1,7,a,5", "1,8,a,6", "1,7,b,4")
    assert columns["ci"] == [7, 8]
    assert columns["a"] == [5, 6]
    assert columns["b"] == pytest.approx([4, NAN], nan_ok=True)


def test_seconds_are_times():
    assert [*wide("seconds,name,value", "1,a,5")[0]] == ["time_s", "a"]
    assert "seconds" in wide("seconds,name,value", "1,a,5", own=["seconds"])[0]


def test_axes_of_sensors():
    """A sensor of which y and z are nothing has one value."""
    lines = ["0,accelerometer,1,2,9.8", "0,gyroscope,3,0,0", "0,pressure,1013,0,0.00"]
    lines += ["1,accelerometer,2,3,9.7", "1,gyroscope,4,0,0.5", "1,pressure,1014,,nan"]
    columns, (made, _, _) = wide("time,sensor,x,y,z", *lines)
    assert columns["accelerometer_x"] == [1, 2]
    assert columns["accelerometer_z"] == [9.8, 9.7]
    assert columns["gyroscope_z"] == [0, 0.5]
    assert columns["pressure"] == [1013, 1014]
    assert len(made) == 7


def test_two_sensors_of_one_kind_keep_their_names():
    lines = ["0,accelerometer,1,2,9.8", "0,accelerometer wake,3,4,9.9"]
    _, (made, _, _) = wide("time,sensor,x,y,z", *lines)
    assert made == [
        *("accelerometer_x", "accelerometer_y", "accelerometer_z"),
        *("accelerometer wake_x", "accelerometer wake_y", "accelerometer wake_z"),
    ]


@pytest.mark.parametrize(
    ("word", "column", "sensor"),
    [
        ("android.sensor.accelerometer", "sensor", "accelerometer"),
        ("TYPE_GYROSCOPE", "type", "gyroscope"),
        ("Magnetic field", "sensor", "magnetometer"),
        ("LSM6 Gyroscope", "sensor", "gyroscope"),
        ("linear acceleration", "sensor", "linear_acceleration"),
        ("accelerometer_uncalibrated", "sensor", "accelerometer_uncalibrated"),
        ("linear_accelerometer", "sensor", "linear_accelerometer"),
        ("game rotation vector", "sensor", "game_rotation_vector"),
        ("geomagnetic rotation", "sensor", "geomagnetic_rotation"),
        # Android's numbers of types.
        ("1", "sensor_type", "accelerometer"),
        ("2", "sensor type", "magnetometer"),
        ("4", "type", "gyroscope"),
        ("6", "sensortype", "pressure"),
        ("5", "type", "5"),
        ("1", "sensor", "1"),
    ],
)
def test_names_of_sensors(word, column, sensor):
    assert _sensor(word, column) == sensor


@pytest.mark.parametrize("word", ["", "0", "000", "-0", "0.0", "0,00", "nan", "NaN", "n/a", "None"])
def test_missing_values_and_zeros_are_nothing(word):
    assert _is_nothing(word)
    assert not _is_nothing(f"{word}1")


@pytest.mark.parametrize(
    ("name", "unit", "own", "full"),
    [
        ("wheel_speed", "km/h", (), "wheel_speed [km/h]"),
        ("wheel_speed", "", (), "wheel_speed"),
        ("wheel_speed", "km/h", ("wheel_speed",), "wheel_speed"),
        # A name that states its unit keeps it.
        ("wheel_speed_mps", "km/h", (), "wheel_speed_mps"),
        ("other", "V", (), "other [V]"),
    ],
)
def test_units_of_names(name, unit, own, full):
    assert _with_unit(name, unit, own) == full


def test_names_that_count_something_are_refused():
    lines = [f"{i},{i},1" for i in range(1001)]
    with pytest.raises(
        InputError, match="at most 1000 different names, found 1001 different names"
    ):
        wide("time,name,value", *lines)


def test_names_that_no_csv_has():
    reading = Reading(Path("a.csv"))
    with pytest.raises(InputError) as raised:
        FORMAT.read(Text(Path("a.csv"), b"time,name,value\n0,zeta,1\n"), reading, ReadOptions())
    assert str(raised.value) == (
        "a.csv: expected names in column name that are known as columns of a CSV, found zeta "
        "(likely: --column FIELD=NAME names them, as wheel_speed_kmh one of speeds in km/h)"
    )
