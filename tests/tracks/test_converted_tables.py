"""Tables that converters write of receivers, flight logs, bags and watches, by their own names."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.texts import text

COUNT = 40
TIME_S = 1_777_629_590.0 + np.arange(COUNT)
LAT, LON = 60.17 + 1e-5 * np.arange(COUNT), 24.94 + 2e-5 * np.arange(COUNT)
SPEED, COURSE = 8.0 + 0.01 * np.arange(COUNT), 45.0
FIT_S = 631_065_600
SEMICIRCLES = 2**31 / 180
UTC = pd.to_datetime(TIME_S, unit="s")

ARDUPILOT = {
    "timestamp": TIME_S,
    "TimeUS": 80e6 + 1e6 * np.arange(COUNT),
    "Status": 3,
    "NSats": 15,
    "GMS": 1000 * (np.arange(COUNT) + 5),
    "GWk": 2416,
    "Lat": LAT,
    "Lng": LON,
    "Alt": 16.0,
    "Spd": SPEED,
    "GCrs": COURSE,
}
PX4 = {
    "timestamp": 12_000_000 + 1_000_000 * np.arange(COUNT),
    "time_utc_usec": (1e6 * TIME_S).astype(np.int64),
    "lat": np.round(1e7 * LAT).astype(int),
    "lon": np.round(1e7 * LON).astype(int),
    "alt": 16_000,
    "eph": 1.2,
    "fix_type": 3,
    "vel_m_s": SPEED,
    "cog_rad": np.radians(COURSE),
}
PX4_IN_DEGREES = {
    **{name: PX4[name] for name in ("timestamp", "time_utc_usec", "eph", "fix_type", "vel_m_s")},
    "latitude_deg": LAT,
    "longitude_deg": LON,
    "altitude_msl_m": 16.0,
}
GPSLOGGER = {
    "time": UTC.strftime("%Y-%m-%dT%H:%M:%SZ"),
    "lat": LAT,
    "lon": LON,
    "elevation": 16.0,
    "accuracy": 1.2,
    "bearing": COURSE,
    "speed": SPEED,
    "ageofdgpsdata": np.nan,
    "dgpsid": np.nan,
}
NAV_PVT = {
    "iTOW": 1000 * (np.arange(COUNT) + 5),
    "year": UTC.year,
    "month": UTC.month,
    "day": UTC.day,
    "hour": UTC.hour,
    "min": UTC.minute,
    "second": UTC.second,
    "nano": 0,
    "lon": LON,
    "lat": LAT,
    "hMSL": 16_000,
    "hAcc": 1200,
    "gSpeed": 1000 * SPEED,
    "headMot": COURSE,
}
BAG = {
    "%time": (TIME_S * 1e9).astype(np.int64),
    "field.header.seq": np.arange(COUNT),
    "field.latitude": LAT,
    "field.longitude": LON,
    "field.altitude": 16.0,
}
WATCH = {
    "record.timestamp[s]": (TIME_S - FIT_S).astype(int),
    "record.position_lat[semicircles]": np.round(LAT * SEMICIRCLES).astype(int),
    "record.position_long[semicircles]": np.round(LON * SEMICIRCLES).astype(int),
    "record.altitude[m]": 16.0,
    "record.speed[m/s]": SPEED,
    "record.heart_rate[bpm]": 90,
}
ARDUPILOT_OF_WEEKS = {name: ARDUPILOT[name] for name in ARDUPILOT if name != "timestamp"}
ARDUPILOT_OF_WEEKS["GMS"] = (1000 * (TIME_S + 18 - 315_964_800 - 2416 * 604_800)).astype(int)
TABLES = {
    "weeks": ARDUPILOT_OF_WEEKS,
    "ardupilot": ARDUPILOT,
    "px4": PX4,
    "px4-degrees": PX4_IN_DEGREES,
    "gpslogger": GPSLOGGER,
    "nav-pvt": NAV_PVT,
    "bag": BAG,
    "watch": WATCH,
}


def read(tmp_path, columns, **own):
    path = tmp_path / "converted.csv"
    pd.DataFrame(columns).to_csv(path, index=False)
    return read_recording(path, options=ReadOptions(columns=own))


@pytest.mark.parametrize("program", TABLES)
def test_positions_are_read_by_the_names_of_the_program(tmp_path, program):
    """They were refused, or lost their speeds."""
    found = read(tmp_path, TABLES[program])
    places = found.tables["positions"]
    assert found.clock.kind == ("gps" if program == "weeks" else "utc")
    np.testing.assert_allclose(places["time_s"], TIME_S, atol=1e-3)
    np.testing.assert_allclose(places["lat_deg"], LAT, atol=2e-7)
    np.testing.assert_allclose(places["lon_deg"], LON, atol=2e-7)
    np.testing.assert_allclose(places["altitude_m"], 16.0)
    if program != "bag":
        np.testing.assert_allclose(places["speed_mps"], SPEED, atol=1e-3)
    if program in ("weeks", "ardupilot", "nav-pvt", "gpslogger"):
        np.testing.assert_allclose(places["course_deg"], COURSE)
    if program in ("px4", "px4-degrees", "nav-pvt", "gpslogger"):
        np.testing.assert_allclose(places["accuracy_m"], 1.2)


def test_fractions_of_seconds_and_days_are_those_of_the_receiver(tmp_path):
    """Its seconds are rounded, so that their fraction may be negative."""
    nano = np.where(np.arange(COUNT) % 2, 200_000_000, -1000)
    found = read(tmp_path, NAV_PVT | {"nano": nano})
    np.testing.assert_allclose(found.tables["positions"]["time_s"], TIME_S + 1e-9 * nano, atol=1e-6)


def test_times_in_parts_without_a_receivers_clock_are_local(tmp_path):
    parts = {name: NAV_PVT[name] for name in ("year", "month", "day", "hour", "min", "second")}
    table = {**parts, "latitude": LAT, "longitude": LON}
    found = read(tmp_path, table)
    assert found.clock.kind == "local"
    np.testing.assert_allclose(found.tables["positions"]["time_s"], TIME_S)
    bad = {**table, "month": np.where(np.arange(COUNT) == 3, 13, UTC.month)}
    assert len(read(tmp_path, bad).tables["positions"]) == COUNT - 1


def test_odometry_of_a_bag_is_that_of_the_vehicle(tmp_path):
    rate = 0.1 * np.sin(np.arange(COUNT))
    columns = {
        "%time": (TIME_S * 1e9).astype(np.int64),
        "field.child_frame_id": "base_link",
        "field.twist.twist.linear.x": SPEED,
        "field.twist.twist.angular.z": rate,
    }
    odometry = read(tmp_path, columns).tables["odometry"]
    np.testing.assert_allclose(odometry["speed_mps"], SPEED)
    np.testing.assert_allclose(odometry["yaw_rate_radps"], rate)
    # Without a frame of its own the velocity may be that to the east.
    del columns["field.child_frame_id"]
    with pytest.raises(InputError, match="expected a recording in a known format"):
        read(tmp_path, columns)


def test_columns_that_a_user_names_keep_their_names(tmp_path):
    found = read(tmp_path, BAG, time="%time", lat_deg="field.latitude", lon_deg="field.longitude")
    np.testing.assert_allclose(found.tables["positions"]["lat_deg"], LAT)


@pytest.mark.parametrize(
    ("unit", "factor"), [("degE7", 1e7), ("1e-7 deg", 1e7), ("semicircles", SEMICIRCLES)]
)
def test_degrees_in_whole_numbers_are_read_by_their_unit(tmp_path, unit, factor):
    columns = {
        "time": UTC.strftime("%Y-%m-%dT%H:%M:%SZ"),
        f"lat [{unit}]": np.round(factor * LAT).astype(int),
        f"lon [{unit}]": np.round(factor * LON).astype(int),
    }
    places = read(tmp_path, columns).tables["positions"]
    np.testing.assert_allclose(places["lat_deg"], LAT, atol=2e-7)
    np.testing.assert_allclose(places["time_s"], TIME_S)


def test_whole_numbers_without_a_unit_name_both_that_they_may_have(tmp_path):
    """Those of a watch, taken for degrees times 1e7, lay ten degrees off."""
    table = {"time": TIME_S, "lat": WATCH["record.position_lat[semicircles]"], "lon": 1e7 * LON}
    with pytest.raises(InputError, match=r"name the column lat \[degE7\]; or semicircles of FIT"):
        read(tmp_path, table)


JAMMED = np.arange(COUNT) >= COUNT // 2


@pytest.mark.parametrize(
    ("table", "column", "fix", "none"),
    [
        (PX4, "fix_type", 3, 0),
        (PX4, "fix_type", 3, 1),
        (ARDUPILOT, "Status", 4, 1),
        (NAV_PVT, "fixType", 3, 1),
        (NAV_PVT, "gnssFixOk", 1, 0),
        (NAV_PVT, "gnssFixOk", True, False),
        (BAG, "field.status.status", 0, -1),
        ({"time": TIME_S, "latitude": LAT, "longitude": LON}, "fix_type", 1, 0),
        ({"time": TIME_S, "latitude": LAT, "longitude": LON}, "fix", "3D", "NO_FIX"),
        ({"time": TIME_S, "latitude": LAT, "longitude": LON}, "fix_quality", 1, 0),
        ({"time": TIME_S, "latitude": LAT, "longitude": LON}, "Valid", "TRUE", "FALSE"),
    ],
)
def test_positions_that_a_receiver_states_to_be_none_are_left_out(
    tmp_path, table, column, fix, none
):
    """While it is jammed it repeats the last one, which was taken for measured."""
    states = pd.Series([fix] * COUNT, dtype=object).where(~JAMMED, none)
    found = read(tmp_path, {**table, column: states})
    np.testing.assert_allclose(found.tables["positions"]["time_s"], TIME_S[~JAMMED], atol=1e-3)
    assert [(one.count, one.reason) for one in found.unusable] == [
        (JAMMED.sum(), f"no fix, by column {column.lower()}")
    ]
    assert not any(column.lower() in text for text in found.unread)


@pytest.mark.parametrize("states", [0, 1, np.arange(COUNT) % 2, "gps"])
def test_states_that_tell_nothing_of_a_fix_leave_all_positions(tmp_path, states):
    """Of a column that is always 0 nothing is known; one in which 1 is the best is a flag."""
    table = {"time": TIME_S, "latitude": LAT, "longitude": LON, "fix_type": states}
    places = read(tmp_path, table).tables["positions"]
    assert len(places) == (COUNT if np.ndim(states) == 0 else COUNT // 2)


@pytest.mark.parametrize("column", ["fix", "gps_fix"])
@pytest.mark.parametrize("best", [2, 4, 5])
def test_a_quality_of_a_fix_of_1_is_a_position(tmp_path, column, best):
    """As in GGA of NMEA, of receivers with corrections: it was taken for none."""
    states = np.where(JAMMED, 1, best)
    table = {"time": TIME_S, "latitude": LAT, "longitude": LON, column: states}
    assert len(read(tmp_path, table).tables["positions"]) == COUNT
    table[column] = np.where(JAMMED, 1, 3)
    assert len(read(tmp_path, table).tables["positions"]) == (~JAMMED).sum()


def test_a_valid_date_is_no_fix(tmp_path):
    """That of NAV-PVT stays while a receiver is jammed, and went before the kind of fix."""
    table = {**NAV_PVT, "valid": 55, "fixType": np.where(JAMMED, 0, 3)}
    assert len(read(tmp_path, table).tables["positions"]) == (~JAMMED).sum()


def test_flags_may_have_decimals(tmp_path):
    """A table with gaps is written so."""
    states = np.where(JAMMED, 0.0, 1.0)
    table = {"time": TIME_S, "latitude": LAT, "longitude": LON, "gps_valid": states}
    assert len(read(tmp_path, table).tables["positions"]) == (~JAMMED).sum()


def test_motion_in_rows_without_a_fix_counts(tmp_path):
    table = {"time": TIME_S, "lat": LAT, "lon": LON, "wheel_speed_mps": SPEED}
    found = read(tmp_path, {**table, "fix_type": np.where(JAMMED, 0, 3)})
    assert len(found.tables["odometry"]) == COUNT
    assert len(found.tables["positions"]) == (~JAMMED).sum()


@pytest.mark.parametrize(
    ("lat", "lon", "sign"),
    [("{:.6f}°", "{:.6f} °", 1), ("{:.6f} N", "{:.6f}E", 1), ("{:.6f}° S", "{:.6f}W", -1)],
)
def test_degrees_with_their_sign_or_hemisphere_are_read(tmp_path, lat, lon, sign):
    """They were no numbers."""
    columns = {"time": TIME_S, "lat": map(lat.format, LAT), "lon": map(lon.format, LON)}
    places = read(tmp_path, columns).tables["positions"]
    np.testing.assert_allclose(places["lat_deg"], sign * LAT, atol=1e-6)
    np.testing.assert_allclose(places["lon_deg"], sign * LON, atol=1e-6)


def test_degrees_with_a_letter_are_noted_once_of_all_parts(tmp_path, monkeypatch):
    """Each part of a large file has another first value."""
    monkeypatch.setattr(text, "_PART_BYTES", 200)
    columns = {"time": TIME_S, "lat": map("{:.6f} N".format, LAT), "lon": LON}
    found = read(tmp_path, columns)
    assert len(found.tables["positions"]) == COUNT
    noted = [note for note in found.notes if "with a sign or a letter" in note]
    assert noted == ["lat: degrees with a sign or a letter, as in 60.170000 N"]


def test_letters_of_the_other_axis_are_no_degrees(tmp_path):
    columns = {"time": TIME_S, "lat": [f"{one} E" for one in LAT], "lon": LON}
    with pytest.raises(InputError, match="lat: 40 values are no numbers"):
        read(tmp_path, columns)


@pytest.mark.parametrize("date", ["2026-05-01", "01.05.2026", "20260501", "2026/05/01"])
@pytest.mark.parametrize("names", ["date,hour,min,sec", "Date,Hour,Minute,Second", "date,hh,mm,ss"])
def test_hours_minutes_and_seconds_follow_a_date(tmp_path, names, date):
    """Each position was of midnight, as the date alone was taken for the time."""
    rows = [f"{date},23,59,{second}.5,60.1{second:04d},24.9" for second in range(57, 60)]
    rows += [f"{'02'.join(date.rsplit('01', 1))},0,0,0.5,60.10060,24.9"]
    path = tmp_path / "drive.csv"
    path.write_text("\n".join([f"{names},lat,lon", *rows]) + "\n")
    log = mf.read_log(path, zone="+00:00")
    assert log.gnss["time_s"].tolist() == [0.5, 1.5, 2.5, 3.5]


def test_a_date_that_is_not_understood_is_told_beside_hours(tmp_path):
    (tmp_path / "drive.csv").write_text("date,hour,min,sec,lat,lon\n01/05/2026,23,59,1,60.1,24.9\n")
    with pytest.raises(InputError, match="day or month first"):
        mf.read_log(tmp_path / "drive.csv")


@pytest.mark.parametrize("date", ["13/05/2026", "05-13-2026"])
def test_dates_in_other_orders_keep_minutes_and_seconds(tmp_path, date):
    """Each position was of the whole hour."""
    rows = [f"{date},10,{minute},5.5,60.1{minute:04d},24.9" for minute in range(3)]
    path = tmp_path / "drive.csv"
    path.write_text("\n".join(["date,hour,min,sec,lat,lon", *rows]) + "\n")
    log = mf.read_log(path, zone="+00:00")
    assert log.gnss["time_s"].tolist() == [0.5, 60.5, 120.5]
    assert log.start_utc_s == pd.Timestamp("2026-05-13T10:00:05Z").timestamp()


def test_the_zone_of_a_date_does_not_move_it(tmp_path):
    """Times were of the day before."""
    rows = "2026-05-01 00:00:00+02:00,10,0,1,60.1,24.9\n"
    (tmp_path / "drive.csv").write_text(f"date,hour,min,sec,lat,lon\n{rows}")
    log = mf.read_log(tmp_path / "drive.csv", zone="+02:00")
    assert (
        log.start_utc_s + log.gnss["time_s"].iloc[0]
        == pd.Timestamp("2026-05-01T08:00:01Z").timestamp()
    )


@pytest.mark.parametrize(
    ("head", "row"),
    [
        ("header.stamp.sec,header.stamp.nanosec", "{},500000000"),
        ("ts", "{}.5"),
        ("time_stamp", "{}.5"),
        ("Event Time", "{}.5"),
        ("epoch", "{}.5"),
        (
            "UTC_Nano,UTC_Year,UTC_Month,UTC_Day,UTC_Hour,UTC_Minute,UTC_Second",
            "500000000,2026,5,13,8,0,0{at}",
        ),
    ],
)
def test_times_of_converters_by_their_names(tmp_path, head, row):
    """Of all of them a table was without a column of times."""
    start_s = 1_778_659_200  # 2026-05-13T08:00:00Z
    rows = [row.format(start_s + at, at=at) + f",60.17{at},24.94" for at in range(3)]
    path = tmp_path / "fix.csv"
    path.write_text("\n".join([f"{head},GPS_Latitude,GPS_Longitude", *rows]) + "\n")
    found = read_recording(path)
    assert found.tables["positions"]["time_s"].tolist() == [start_s + at + 0.5 for at in range(3)]
    assert found.clock.kind == "utc"


def test_a_table_without_names_is_said_to_be_one(tmp_path):
    """Its values were listed as names of columns, of which some should be named."""
    path = tmp_path / "log.csv"
    path.write_text("1778659200000;60.1686;24.938;-80\n1778659201000;60.1687;24.938;-81\n")
    with pytest.raises(InputError, match="a table without a line of names: write one above it"):
        read_recording(path)
