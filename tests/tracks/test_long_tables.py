"""Tables with a row for each value, and with a row for each sensor: read as a table of columns."""

import tracemalloc

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.texts import text

START_S = 1_778_666_400.0
TIME_S = START_S + np.arange(90.0)
SPEED_MPS = 9.0 + 2.0 * np.sin(np.arange(90) / 9)
LAT_DEG, LON_DEG = 60.17 + 8e-5 * np.arange(90), np.full(90, 24.94)


def written(tmp_path, rows, header, name="log.csv", sep=","):
    path = tmp_path / name
    path.write_text("\n".join([header, *(sep.join(map(str, row)) for row in rows)]) + "\n")
    return path


def interleaved(*series):
    """Rows of several series, ordered by time as a logger writes them."""
    rows = [row for one in series for row in one]
    return sorted(rows, key=lambda row: float(row[0]))


def test_a_row_for_each_value_is_the_table_that_it_would_make(tmp_path):
    """It was refused, with a line of pandas."""
    series = {
        "latitude": LAT_DEG,
        "longitude": LON_DEG,
        "wheel_speed_kmh": 3.6 * SPEED_MPS,
        "yaw_rate_degps": 2 * SPEED_MPS,
        "rsrp": -90 - np.arange(90) % 5,
        "eci": np.full(90, 26385410),
    }
    rows = interleaved(
        *(zip(TIME_S, [name] * 90, values, strict=True) for name, values in series.items())
    )
    long = read_recording(written(tmp_path, rows, "time,name,value"))
    pd.DataFrame({"time": TIME_S, **series}).to_csv(tmp_path / "wide.csv", index=False)
    wide = read_recording(tmp_path / "wide.csv")
    assert list(long.tables) == list(wide.tables) == ["positions", "radio", "odometry"]
    for table, expected in wide.tables.items():
        pd.testing.assert_frame_equal(long.tables[table], expected)
    assert "a row for each value: 6 columns made of the names in name" in long.notes


@pytest.mark.parametrize("time", ["Time [s]", "Timestamp (ms)", "Elapsed time (s)"])
def test_times_whose_header_states_their_unit(tmp_path, time):
    """Such a table was of no known format."""
    scale = 1000 if "ms" in time else 1
    rows = [f"{scale * i / 4};Vehicle speed [km/h];{30 + i % 3}" for i in range(40)]
    (tmp_path / "bus.csv").write_text("\n".join([f"{time};Name;Value", *rows, ""]))
    found = read_recording(tmp_path / "bus.csv")
    assert found.format == "long"
    np.testing.assert_allclose(found.tables["odometry"]["time_s"], np.arange(40) / 4)


def test_units_of_a_column_of_their_own_count(tmp_path):
    rows = [(t, "Vehicle speed", v, "mph") for t, v in zip(range(90), SPEED_MPS, strict=True)]
    rows += [(t + 0.5, "Engine RPM", 1500, "rpm") for t in range(90)]
    path = written(tmp_path, rows, "SECONDS;PID;VALUE;UNITS", sep=";")
    found = read_recording(path)
    np.testing.assert_allclose(found.tables["odometry"]["speed_mps"], 0.44704 * SPEED_MPS)
    assert found.unread == ("engine rpm [rpm]",)
    assert not found.clock.absolute


def test_units_that_are_written_in_several_ways_make_one_column(tmp_path):
    """Every second speed was lost, or all of those whose name states the unit, too."""
    given = {"Vehicle speed": ("km/h", "KM/H"), "Vehicle speed [km/h]": ("km/h", "")}
    for name, units in given.items():
        rows = [(t, name, 30 + t % 3, units[t % 2]) for t in range(60)]
        found = read_recording(written(tmp_path, rows, "time,name,value,unit"))
        np.testing.assert_allclose(
            found.tables["odometry"]["speed_mps"], (30 + np.arange(60) % 3) / 3.6
        )


@pytest.mark.parametrize(
    ("header", "row", "columns", "table"),
    [
        ("time,type,value", ("car", 8), {"wheel_speed_mps": "value"}, "odometry"),
        ("time,name,x,y,z", ("car", 385e3, 6672e3, 1), {"east_m": "X", "north_m": "Y"}, "places"),
        ("time,lat,lon,type,value", (60, 24, "rsrp", -90), {"level_dbm": "value"}, "radio"),
    ],
)
def test_a_table_whose_values_are_a_column_of_a_field_stays_one(
    tmp_path, header, row, columns, table
):
    """Such a map was that of a plain table before tables with a row for each value were read."""
    path = written(tmp_path, [(t, *row) for t in TIME_S], header)
    found = read_recording(path, options=ReadOptions(columns=columns))
    assert found.format == "csv"
    assert len(found.tables[table]) == 90


def test_values_of_several_cells_at_a_time_are_not_mixed(tmp_path):
    """The level of a second cell was that of the first, where the first one had none."""
    rows = []
    for t in TIME_S:
        rows += [(t, 244, 91, 30, 257, "rsrq", -11), (t, 244, 91, 30, 258, "rsrp", -97)]
        rows += [(t, 244, 91, 30, 259, "rsrp", -80), (t, 244, 91, 30, 259, "rsrq", -9)]
    found = read_recording(written(tmp_path, rows, "time,mcc,mnc,tac,ci,name,value"))
    radio = found.tables["radio"].dropna(subset="level_dbm")
    assert set(zip(radio["ci"], radio["level_dbm"], strict=True)) == {(258, -97), (259, -80)}


@pytest.mark.parametrize("header", ["time,name,value", "time,name,x,y,z"])
def test_many_names_at_many_times_fit_into_memory(tmp_path, header):
    """Where each of 150 names was a column in memory, 30,000 rows took more than 40 MB."""
    more = (0.1, 0.2) if "x" in header else ()
    rows = [(t / 10, f"n{t % 150}" if t % 150 else "gyroscope", 1, *more) for t in range(30_000)]
    rows += [(9000 + t, "pressure", 1013 + t % 2, *(0,) * len(more)) for t in range(9)]
    path = written(tmp_path, rows, header)
    tracemalloc.start()
    found = read_recording(path)
    used_bytes = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(found.tables["barometer"]) == 9
    assert used_bytes < 25e6, used_bytes


def test_names_are_mapped_as_columns_are(tmp_path):
    rows = [(t, "Geschwindigkeit", f"{v:.3f}") for t, v in zip(TIME_S, SPEED_MPS, strict=True)]
    path = written(tmp_path, rows, "time,sensor,value")
    with pytest.raises(InputError, match=r"names in column sensor .* geschwindigkeit .*--column"):
        read_recording(path)
    found = read_recording(path, options=ReadOptions(columns={"wheel_speed_mps": rows[0][1]}))
    np.testing.assert_allclose(found.tables["odometry"]["speed_mps"], SPEED_MPS, atol=5e-4)


def test_lines_are_those_of_the_file(tmp_path):
    rows = [row for t in range(60) for row in ((t, "rpm", 1), (t, "vehicle speed (km/h)", 30))]
    rows[41] = (20, "vehicle speed (km/h)", "3o")
    rows.insert(60, (30, "", 5))
    found = read_recording(written(tmp_path, rows, "time,name,value"))
    (bad,) = found.unusable
    assert (bad.reason, bad.lines) == ("no name in column name", (62,))
    # A row for each time: that of time 20 begins with the row of rpm, in line 42.
    assert any("first '3o' in line 42" in note for note in found.notes)
    assert len(found.tables["odometry"]) == 59


@pytest.mark.parametrize(
    "names",
    [
        ("accelerometer", "gyroscope", "magnetic_field", "pressure"),
        ("android.sensor.accelerometer", "android.sensor.gyroscope", "TYPE_MAGNETIC_FIELD", "p"),
        ("LSM6DSO Accelerometer", "LSM6DSO Gyroscope", "AK0991X Magnetometer", "pressure"),
    ],
)
@pytest.mark.parametrize("by_sensor", [False, True])
def test_a_row_for_each_sensor(tmp_path, names, by_sensor):
    values = [(0.1, 0.2, 9.8), (0.01, 0.02, 0.03), (1, 20, -43), (1013.2, 0, 0)]
    parts = [
        [(f"{t:.0f}", name, *(v + k % 3 if i == 2 and j < 3 else v for i, v in enumerate(value)))
         for k, t in enumerate(1000 * TIME_S)]
        for j, (name, value) in enumerate(zip(names, values, strict=True))
    ]  # fmt: skip
    rows = [row for part in parts for row in part] if by_sensor else interleaved(*parts)
    found = read_recording(written(tmp_path, rows, "timestamp,sensor,x,y,z")).tables
    for j, table in enumerate(("accelerometer", "gyroscope", "magnetometer")):
        np.testing.assert_allclose(found[table].iloc[0, 1:].to_numpy(dtype=float), values[j])
        np.testing.assert_allclose(found[table]["time_s"], TIME_S)
    assert ("barometer" in found) == (names[3] == "pressure")


def test_units_of_axes_and_sensors_of_one_value(tmp_path):
    """Degrees a second were taken for radians, g for m/s²; a pressure with zeros was unknown."""
    rows = []
    for i, t in enumerate(TIME_S):
        rows += [(t, "gyroscope", 1, 2, i % 3, "deg/s"), (t, "accelerometer", 0, 0.1, 1, "g")]
        rows += [(t, "pressure", 1013 + i % 2, *(("0.0000", "nan") if i % 2 else ("", "0")), "hPa")]
    found = read_recording(written(tmp_path, rows, "time,sensor,x,y,z,unit")).tables
    np.testing.assert_allclose(found["gyroscope"]["y_radps"], np.radians(2))
    np.testing.assert_allclose(found["accelerometer"]["z_mps2"], 9.80665)
    assert set(found["barometer"]["pressure_hpa"]) == {1013, 1014}


def test_sensors_by_androids_numbers(tmp_path):
    rows = [
        (f"{t:.0f}", kind, 0.1, 0.2, z) for t in 1000 * TIME_S for kind, z in ((1, 9.8), (4, 0))
    ]
    rows = [(*row[:4], row[4] + i % 2 / 10) for i, row in enumerate(rows)]
    assert {"accelerometer", "gyroscope"} == set(
        read_recording(written(tmp_path, rows, "timestamp,sensor_type,x,y,z")).tables
    )
    # Numbers in another column are those of something.
    with pytest.raises(InputError, match="names in column sensor"):
        read_recording(written(tmp_path, rows, "timestamp,sensor,x,y,z", "b.csv"))


def test_uncalibrated_and_linear_sensors_are_not_taken_for_the_others(tmp_path):
    kinds = ("accelerometer", "accelerometer_uncalibrated", "linear_acceleration")
    rows = [(t, kind, k, 0.1, 9.8) for t in TIME_S for k, kind in enumerate(kinds)]
    found = read_recording(written(tmp_path, rows, "time,sensor,x,y,z"))
    assert list(found.tables) == ["accelerometer"]
    assert set(found.tables["accelerometer"]["x_mps2"]) == {0}
    assert any("accelerometer_uncalibrated_x" in name for name in found.unread)


def test_a_table_of_columns_with_a_name_and_a_value_stays_one(tmp_path):
    """Each row of it has a position; names in it are no quantities."""
    rows = [(t, a, b, "Aleksanterinkatu", i) for i, (t, a, b) in
            enumerate(zip(TIME_S, LAT_DEG, LON_DEG, strict=True))]  # fmt: skip
    found = read_recording(written(tmp_path, rows, "time,lat,lon,name,value"))
    assert found.format == "csv"
    assert len(found.tables["positions"]) == 90


def test_more_names_than_anything_has_are_refused(tmp_path):
    rows = [(t, f"n{t}", 1) for t in range(1200)]
    with pytest.raises(InputError, match=r"at most 1000 different names, found 1200"):
        read_recording(written(tmp_path, rows, "time,name,value"))


def test_a_drive_of_car_scanner(tmp_path):
    """Its header misspells the longitude, and its positions stand in every row."""
    rows = []
    for t, v, lat, lon in zip(range(90), SPEED_MPS, LAT_DEG, LON_DEG, strict=True):
        place = f'"{lat:.7f}";"{lon:.7f}";'
        rows.append((f'"{t + 36000:.3f}"', '"Speed (GPS)"', f'"{3.6 * v:.2f}"', '"km/h"', place))
        rows.append((f'"{t + 36000.2:.3f}"', '"Vehicle speed"', '"31"', '"km/h"', place))
    header = '"SECONDS";"PID";"VALUE";"UNITS";"LATITUDE";"LONGTITUDE";'
    log = mf.read_log(written(tmp_path, rows, header, sep=";"))
    assert len(log.gnss) == 90
    assert log.motion["step_m"].sum() == pytest.approx(89 * 31 / 3.6, rel=1e-6)


@pytest.mark.parametrize("parts", [False, True])
def test_seconds_of_the_day_go_on_after_midnight(tmp_path, monkeypatch, parts):
    """The file was refused as that of two journeys."""
    second = (86_350.5 + np.arange(200)) % 86_400
    columns = {"time": second, "Vehicle speed [km/h]": 30.0 + np.arange(200) % 3}
    pd.DataFrame(columns).to_csv(tmp_path / "wide.csv", index=False)
    if parts:
        monkeypatch.setattr(text, "_PART_BYTES", 512)
    times = [read_recording(tmp_path / "wide.csv").tables["odometry"]["time_s"]]
    rows = [(s, "Vehicle speed", 30 + i % 3, "km/h") for i, s in enumerate(second)]
    path = written(tmp_path, rows, "SECONDS;PID;VALUE;UNITS", sep=";")
    times.append(read_recording(path).tables["odometry"]["time_s"])
    for found in times:
        np.testing.assert_allclose(found, 86_350.5 + np.arange(200))


def test_seconds_of_the_day_go_on_after_two_midnights_in_parts(tmp_path, monkeypatch):
    """From the part after the second midnight on, times were those of the first day again."""
    second = np.arange(80_000.0, 300_000.0, 100.0)
    columns = {"time": second % 86_400, "Vehicle speed [km/h]": 30.0 + np.arange(2200) % 3}
    pd.DataFrame(columns).to_csv(tmp_path / "a.csv", index=False)
    for size in (8192, 1 << 24):
        monkeypatch.setattr(text, "_PART_BYTES", size)
        found = read_recording(tmp_path / "a.csv").tables["odometry"]["time_s"]
        np.testing.assert_allclose(found, second)


def test_a_counter_of_seconds_that_begins_anew_at_noon_is_no_midnight(tmp_path):
    second = np.append(50_000 + np.arange(50.0), np.arange(50.0))
    columns = {"time": second, "Vehicle speed [km/h]": 30.0 + np.arange(100) % 3}
    pd.DataFrame(columns).to_csv(tmp_path / "a.csv", index=False)
    found = read_recording(tmp_path / "a.csv")
    assert found.tables["odometry"]["time_s"].max() == 50_049
    assert any("times go backwards" in note for note in found.notes)
