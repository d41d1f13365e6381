"""Columns of a plain CSV that are found by quantity and unit in their headers."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording

TIME_S = np.arange(0.0, 20.0, 0.5)
SPEED_MPS = 8.0 + np.sin(TIME_S)
RATE_RADPS = 0.2 * np.cos(TIME_S)
PLACES = {"latitude": 60.0 + 1e-5 * TIME_S, "longitude": 24.0 + 1e-5 * TIME_S}


def read(tmp_path, columns, **own):
    path = tmp_path / "drive.csv"
    pd.DataFrame(columns).to_csv(path, index=False)
    return read_recording(path, options=ReadOptions(columns=own))


@pytest.mark.parametrize(
    ("speed", "by"),
    [
        ("Speed [km/h]", 3.6),
        ("Speed (km/h)", 3.6),
        ("velocity_kmh", 3.6),
        ("speed_km_h", 3.6),
        ("speed_mph", 1 / 0.44704),
        ("Speed (OBD)(km/h)", 3.6),
        ("VehicleSpeed (miles per hour)", 1 / 0.44704),
        ("GPS Speed (Meters/second)", 1.0),
        ("Wheel speed [m/s]", 1.0),
        ("Vehicle Speed Sensor [km/h]", 3.6),
    ],
)
@pytest.mark.parametrize(
    ("rate", "turned"),
    [
        ("turn_rate_deg_s", 180 / np.pi),
        ("Yaw rate [deg/s]", 180 / np.pi),
        ("Turn rate (degrees per second)", 180 / np.pi),
        ("yaw-rate [rad/s]", 1.0),
    ],
)
def test_a_vehicle_is_found_by_its_headers(tmp_path, speed, by, rate, turned):
    found = read(tmp_path, {"Time (s)": TIME_S, speed: by * SPEED_MPS, rate: turned * RATE_RADPS})
    odometry = found.tables["odometry"]
    np.testing.assert_allclose(odometry["speed_mps"], SPEED_MPS)
    np.testing.assert_allclose(odometry["yaw_rate_radps"], RATE_RADPS)
    for column in (speed, rate):
        told = f"by the name of its column ({column.lower()})"
        assert sum(told in note for note in found.notes) == 1
    assert not found.unread


def test_speeds_alone_are_a_vehicles(tmp_path):
    found = read(tmp_path, {"time": TIME_S, "Speed [km/h]": 3.6 * SPEED_MPS})
    np.testing.assert_allclose(found.tables["odometry"]["speed_mps"], SPEED_MPS)
    assert "speed: taken for a vehicle's, as there are no positions beside it" in found.notes


def test_positions_are_found_by_their_headers(tmp_path):
    columns = {
        "Timestamp [ms]": 1000 * TIME_S,
        "Latitude [deg]": PLACES["latitude"],
        "Longitude (°)": PLACES["longitude"],
        "Altitude (ft)": 100 / 0.3048,
        "Horizontal accuracy [m]": 4.0,
        "Bearing [deg]": 45.0,
        "Speed (knots)": SPEED_MPS * 3600 / 1852,
    }
    places = read(tmp_path, columns).tables["positions"]
    np.testing.assert_allclose(places["time_s"], TIME_S)
    np.testing.assert_allclose(places["lon_deg"], PLACES["longitude"])
    np.testing.assert_allclose(places["altitude_m"], 100.0)
    np.testing.assert_allclose(places["accuracy_m"], 4.0)
    np.testing.assert_allclose(places["course_deg"], 45.0)
    np.testing.assert_allclose(places["speed_mps"], SPEED_MPS)


def test_walks_and_sensors_are_found_by_their_headers(tmp_path):
    columns = {"time": TIME_S, "steps": np.arange(40), "Heading [deg]": 90.0}
    columns |= {f"Gyroscope {axis} (deg/s)": 180 / np.pi for axis in "XYZ"}
    columns |= {f"accel_{axis} [g]": 1.0 for axis in "xyz"}
    found = read(tmp_path, columns | {"Pressure (kPa)": 101.3, "RSRP [dBm]": -90})
    assert set(found.tables["compass"]["magnetic_deg"]) == {90.0}
    np.testing.assert_allclose(found.tables["gyroscope"]["z_radps"], 1.0)
    np.testing.assert_allclose(found.tables["accelerometer"]["x_mps2"], 9.80665)
    np.testing.assert_allclose(found.tables["barometer"]["pressure_hpa"], 1013.0)
    assert set(found.tables["radio"]["level_dbm"]) == {-90.0}


def test_a_column_that_is_named_or_usual_goes_first(tmp_path):
    columns = {"time": TIME_S, "wheel_speed_mps": SPEED_MPS, "Vehicle speed [km/h]": 0.0}
    found = read(tmp_path, columns | {"Wheel speed [mph]": 1.0})
    np.testing.assert_allclose(found.tables["odometry"]["speed_mps"], SPEED_MPS)
    assert found.unread == ("vehicle speed [km/h]", "wheel speed [mph]")
    found = read(tmp_path, columns, wheel_speed_mps="Vehicle speed [km/h]")
    assert not found.tables["odometry"]["speed_mps"].any()


@pytest.mark.parametrize(
    ("column", "likely"),
    [
        ("velocity", "velocity (speed_mps or speed_kmh?)"),
        ("Speed [%]", "speed [%]"),
        ("turn rate", "turn rate (yaw_rate_radps or yaw_rate_degps?)"),
        ("heading", "heading (course_deg?)"),
        ("engine speed [rpm]", "engine speed [rpm]"),
        ("level [dB]", "level [db]"),
    ],
)
def test_what_is_ambiguous_is_named_and_not_used(tmp_path, column, likely):
    found = read(tmp_path, {"time": TIME_S, **PLACES, column: 1.0})
    assert found.unread == (likely,)
    (note,) = [note for note in found.ignored if note.startswith("columns not used: ")]
    if likely.endswith("?)"):
        option = f"{likely.split('(')[1].split(' or ')[0].rstrip('?)')}={column}"
        assert f"(likely: --column {option}" in note or f"(likely: --column '{option}'" in note
        assert (" for m/s, or " in note or " for rad/s, or " in note) == (" or " in likely)


def test_fields_that_are_of_no_use_beside_the_others_are_named(tmp_path):
    found = read(tmp_path, {"time": TIME_S, **PLACES, "compass_deg": 1.0, "turn_rad": 0.0})
    assert found.unread == ("compass_deg", "turn_rad")


def test_speeds_in_rows_without_positions_are_named(tmp_path):
    places = {name: np.where(TIME_S < 5, values, np.nan) for name, values in PLACES.items()}
    found = read(tmp_path, {"time": TIME_S, **places, "Speed [km/h]": 3.6 * SPEED_MPS})
    (note,) = [note for note in found.ignored if "speed" in note]
    assert note.startswith("speed [km/h]: 30 of 40 speeds without a position in the row, not used")
    assert note.endswith("--column 'wheel_speed_mps=speed [km/h]'")
    named = read(
        tmp_path,
        {"time": TIME_S, **places, "Speed [km/h]": 3.6 * SPEED_MPS},
        wheel_speed_mps="Speed [km/h]",
    )
    assert len(named.tables["odometry"]) == 40
    assert not any("without a position" in note for note in named.notes)


@pytest.mark.parametrize("header", ["Time (UTC)", "timestamp_utc", "UTC time", "utc"])
def test_a_header_states_that_times_are_utc(tmp_path, header):
    times = pd.Timestamp("2026-05-01 08:00:00") + pd.to_timedelta(TIME_S, unit="s")
    found = read(tmp_path, {header: times, **PLACES})
    assert found.clock.kind == "utc"
    assert found.tables["positions"]["time_s"].iloc[0] == pytest.approx(1777622400.0, abs=1e-6)


@pytest.mark.parametrize("header", ["Cell name", "CellName", "cell_name"])
def test_a_column_of_names_of_cells_is_suggested_where_no_other_one_tells_them(tmp_path, header):
    cells = {"time": TIME_S, "rsrp": -80.0, header: "A1"}
    assert read(tmp_path, cells).unread == (f"{header.lower()} (cell?)",)
    assert read(tmp_path, {**cells, "ci": 7}).unread == (header.lower(),)


def test_a_file_without_anything_that_is_known_is_refused(tmp_path):
    with pytest.raises(InputError):
        read(tmp_path, {"time": TIME_S, "velocity": 1.0})


@pytest.mark.parametrize(
    ("date", "time"),
    [("28.05.2026", "23:26:4{}"), ("2026-05-28", "23:26:4{}"), ("", "28-May-2026 23:26:4{}.0")],
)
def test_dates_and_times_as_loggers_write_them(tmp_path, date, time):
    columns = {"Date": date} if date else {}
    rows = {"Time": [time.format(k) for k in range(9)], "lat": PLACES["latitude"][:9], "lon": 24.0}
    path = tmp_path / "walk.csv"
    pd.DataFrame({**columns, **rows}).assign(**columns).to_csv(path, index=False)
    found = read_recording(path, options=ReadOptions(zone="Europe/Helsinki"))
    np.testing.assert_allclose(found.tables["positions"]["time_s"], 1.78e9 + np.arange(9))
    assert not found.unread
    assert ("time: columns date and time" in found.notes) == bool(date)


def dated(folder, *dates, midnight=False):
    """Write times of day beside columns of dates under other names; read them."""
    path, at = folder / "walk.csv", ["23:59:5{}", "00:00:0{}"] if midnight else ["23:26:4{}"]
    rows = [f"{time.format(k)},60.1,24.{k}" for time in at for k in range(9)]
    names = "".join(f"{name}," for name, _ in dates)
    values = "".join(f"{value}," for _, value in dates)
    text = "\n".join(f"{values}{row}" for row in rows)
    path.write_text(f"{names}Uhrzeit,lat,lon\n{text}\n")
    options = ReadOptions(zone="Europe/Helsinki", columns={"time": "Uhrzeit"})
    return read_recording(path, options=options)


@pytest.mark.parametrize(
    ("name", "date"), [("Datum", "28.05.2026"), ("Fecha", "2026-05-28"), ("Jour", "2026/05/28")]
)
def test_a_column_of_dates_is_known_by_its_values(tmp_path, name, date):
    found = dated(tmp_path, (name, date))
    np.testing.assert_allclose(found.tables["positions"]["time_s"], 1.78e9 + np.arange(9))
    assert f"time: columns {name.lower()} and uhrzeit" in found.notes
    assert not found.unread


def test_a_date_of_another_name_that_stays_over_midnight_goes_on(tmp_path):
    found = dated(tmp_path, ("Datum", "28.05.2026"), midnight=True)
    assert np.diff(found.tables["positions"]["time_s"]).max() == pytest.approx(2.0)
    assert any("the date stays the same over midnight" in note for note in found.notes)


@pytest.mark.parametrize("beside", [{}, {"ns": "N", "ew": "E"}])
def test_whole_times_that_run_back_by_a_day_are_no_midnight(tmp_path, beside):
    """A later day before an earlier one, as of two files put together."""
    times = [f"2026-05-0{day} 1{day}:00:{k:02d}" for day in (2, 1) for k in range(20)]
    found = read(tmp_path, {"time": times, **PLACES, **beside})
    assert np.ptp(found.tables["positions"]["time_s"]) == 25 * 3600 + 19
    assert not any("midnight" in note for note in found.notes)


@pytest.mark.parametrize("version", ["4.2.15", "10.1.120", "1-2-30"])
def test_numbers_of_versions_are_no_dates(tmp_path, version):
    found = dated(tmp_path, ("Datum", "28.05.2026"), ("App", version))
    assert "time: columns datum and uhrzeit" in found.notes
    with pytest.raises(InputError, match="a time of day without its date"):
        dated(tmp_path, ("App", version))


def test_of_two_columns_of_dates_neither_is_taken(tmp_path):
    with pytest.raises(InputError, match="a time of day without its date"):
        dated(tmp_path, ("Datum", "28.05.2026"), ("Stand", "01.05.2026"))


def test_counted_steps_are_found_by_words(tmp_path):
    found = read(tmp_path, {"time": TIME_S, "Step count": np.arange(40), "Heading (°)": 90.0})
    assert {"steps", "compass"} <= set(found.tables)


def test_an_export_of_a_cars_diagnosis_is_read(tmp_path):
    path = tmp_path / "trackLog.csv"
    head = "GPS Time, Device Time, Longitude, Latitude,GPS Speed (Meters/second), Bearing, G(x),"
    clock = "Thu May 28 23:26:4{0} GMT+03:00 2026,28-May-2026 23:26:4{0}.000"
    rows = "".join(f"{clock.format(k)},24.9,60.1,10.0,90,0.1,36\n" for k in range(9))
    path.write_text(f"{head}Speed (OBD)(km/h)\n{rows}")
    found = read_recording(path)
    np.testing.assert_allclose(found.tables["odometry"]["speed_mps"], 10.0)
    np.testing.assert_allclose(found.tables["positions"]["speed_mps"], 10.0)
    assert found.unread == ("device time", "g(x)")
    assert found.clock.kind == "utc"
    start_s = pd.Timestamp("2026-05-28T20:26:40Z").timestamp()
    assert found.tables["positions"]["time_s"].tolist() == [start_s + k for k in range(9)]


def test_units_behind_values_are_those_of_a_header(tmp_path):
    """Levels were refused, and speeds not read."""
    rows = [
        f"{1_778_666_400 + i},60.17,24.94,7,8,{-90 - i % 3} dBm,18 km/h,{i} m" for i in range(9)
    ]
    path = tmp_path / "phone.csv"
    path.write_text("\n".join(["time,lat,lon,lac,ci,rsrp,Speed,Altitude", *rows]) + "\n")
    found = read_recording(path)
    assert found.tables["radio"]["level_dbm"].tolist() == [-90 - i % 3 for i in range(9)]
    assert found.tables["positions"]["speed_mps"].to_numpy() == pytest.approx(5.0)
    assert found.tables["positions"]["altitude_m"].tolist() == list(range(9))
    assert "rsrp: dbm behind its values" in found.notes
    assert "taken as missing" not in " ".join(found.notes)


@pytest.mark.parametrize(("last", "count"), [("-90", 4), ("-90 km/h", 3), ("-90 dB", 3)])
def test_values_with_another_unit_than_the_first_are_none(tmp_path, last, count):
    path = tmp_path / "phone.csv"
    path.write_text(f"time,ci,rsrp\n1,8,-90 dBm\n2,8,-91 dBm\n3,8,-92dBm\n4,8,{last}\n")
    assert read_recording(path).tables["radio"]["level_dbm"].notna().sum() == count


def test_a_unit_that_contradicts_the_header_is_none(tmp_path):
    path = tmp_path / "drive.csv"
    path.write_text("time,wheel speed (km/h)\n1,9 m/s\n2,8 m/s\n3,7 m/s\n")
    with pytest.raises(InputError, match="3 values are no numbers"):
        read_recording(path)
