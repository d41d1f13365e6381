"""Tables of which nothing is read: columns, the first offending value and the likely cause."""

import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording


def refused(tmp_path, text, name="table.csv", **columns):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InputError) as error:
        read_recording(path, options=ReadOptions(columns=columns))
    (fault,) = error.value.faults
    return fault


def test_an_unknown_table_names_its_columns_and_options_for_them(tmp_path):
    fault = refused(tmp_path, "time,speed,heading,rpm\n1,2,3,4\n")
    assert len(fault.expected) < 80
    assert fault.got == "none of them, but a table with the columns time, speed, heading, rpm"
    such = "such as (speed_mps=speed for m/s, or speed_kmh=speed for km/h) and compass_deg=heading"
    assert fault.hint.endswith(such)
    fault = refused(tmp_path, "time,cell_id,level,speed\n1,2,-70,4\n")
    assert "(wheel_speed_mps=speed for m/s, or wheel_speed_kmh=speed for km/h)" in fault.hint
    fault = refused(tmp_path, "zeit,v\n1,2\n")
    assert fault.hint.startswith("a CSV without a column of times; a CSV with other names of ")
    assert fault.hint.endswith("such as lat_deg=LATITUDE and lon_deg=LONGITUDE and time=COLUMN")
    fault = refused(tmp_path, "Zeit;Lat;Lon;Zelle;RSRP\n1;2;3;4;5\n")
    assert fault.hint.endswith("such as time=COLUMN")


def test_named_columns_without_one_of_times_are_refused_with_the_option_for_it(tmp_path):
    fault = refused(tmp_path, "a,b,c\n60.1,24.9,7\n", lat_deg="a", lon_deg="b")
    assert (fault.expected, fault.got) == ("a column of times", "a, b, c")
    assert fault.hint == "--column time=COLUMN"
    assert fault.where.endswith("table.csv header")


@pytest.mark.parametrize("name", ["track.json", "track.xlsx"])
def test_other_files_are_named_by_their_suffix(tmp_path, name):
    fault = refused(tmp_path, '{"type": 1, "time": 2}\n', name)
    assert "begins with" in fault.got
    assert "CSV" in fault.hint


@pytest.mark.parametrize(
    ("text", "got"),
    [
        (
            "time,lat,lon\n1,60.1 x,24.9 x\n",
            "none in 1 row: lat: 1 value is no number, taken as missing (first '60.1 x' in line 2)",
        ),
        ("time,lat,lon\n1,,\n2,,\n", "none in 2 rows: no numbers in lat, lon"),
        ("time,lat,lon\n", "no rows"),
        (
            "time,lat,lon\n1,139.7,35.6\n2,139.8,35.6\n",
            "none in 2 rows: 2 rows: lat_deg: not degrees in -90..90 (likely: latitude and "
            "longitude swapped) (lines 2, 3; first 139.7)",
        ),
        (
            "time,wheel_speed_kmh\n1,fast\n2,slow\n",
            "none in 2 rows: wheel_speed_kmh: 2 values are no numbers, taken as missing (first "
            "'fast' in line 2)",
        ),
        (
            "time,lat,lon\n1,60,17,24,9\n",
            "none in 1 row: 1 row: more fields than 3 (likely: a separator within a field, as "
            "decimal commas) (line 2)",
        ),
    ],
)
def test_a_table_without_a_usable_row_names_columns_and_values(tmp_path, text, got):
    assert refused(tmp_path, text).got.startswith(got)


def test_a_named_column_is_named_beside_its_field(tmp_path):
    fault = refused(tmp_path, "time,Breite,lon\n1,139.7,35.6\n", lat_deg="Breite")
    assert "lat_deg (breite): not degrees" in fault.got


def test_decimal_commas_within_quotes_are_read(tmp_path):
    path = tmp_path / "phone.csv"
    path.write_text('time,lat,lon,altitude\n1,"60,1712","24,9412","1,500"\n2,"60,2","25","7"\n')
    places = read_recording(path).tables["positions"]
    assert places["lat_deg"].tolist() == [60.1712, 60.2]
    assert places["lon_deg"].tolist() == [24.9412, 25.0]
    # Which comma parts thousands is not known.
    assert pd.isna(places["altitude_m"].iloc[0])


@pytest.mark.parametrize(
    ("header", "such"),
    [
        ("position.latitude,position.longitude,updateTime", "lat_deg=position.latitude"),
        ("CUSTOM.updateTime [local],OSD.latitude,OSD.longitude", "lon_deg=osd.longitude"),
        ("position_lat,position_long,when", "lat_deg=position_lat"),
        ("Time since start of day (seconds),a,b", "'time=time since start of day (seconds)'"),
        (
            "CUSTOM.updateTime [local],OSD.latitude,OSD.longitude",
            "'time=custom.updatetime [local]'",
        ),
        ("stamp_time,message.twist.speed [m/s],a", "'wheel_speed_mps=message.twist.speed [m/s]'"),
    ],
)
def test_columns_whose_names_only_end_in_a_usual_one_are_proposed(tmp_path, header, such):
    """Placeholders stood in their place."""
    fault = refused(tmp_path, f"{header}\n1,2,3\n")
    assert such in fault.hint
    assert "LATITUDE" not in fault.hint or "lat_deg" not in such


@pytest.mark.parametrize(
    ("name", "text", "hint"),
    [
        ("drive.pos", "2026/05/01 10:00:00.000   60.17   24.94   20.1   5   9\n", "RTKLIB"),
        ("flight.ulg", "ULog", "ulog2csv"),
        ("drive.bag", "#ROSBAG V2.0\n", "rostopic echo -b BAG -p TOPIC"),
        ("flight.log", "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name\n", "mavlogdump.py, types GPS"),
        ("novatel.txt", "#BESTPOSA,COM1,0,83.5,FINESTEERING,2416,468000.000\n", "NovAtel"),
        (
            "walk.csv",
            "Type,Local Number,Message,Field 1,Value 1,Units 1\nData,0,record,timestamp,1,s\n",
            "all messages of a FIT file; export GPX, or its records alone (FitCSVTool, data",
        ),
        (
            "bus.csv",
            "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3\n1,7E8,false,Rx,0,3,03,41,0D\n",
            "raw frames of a bus",
        ),
        (
            "flight.txt",
            "2026-05-01 10:00:00.00: GPS {TimeUS : 80221069, Status : 3, Lat : 42.3, Lng : 7.1}\n",
            "mavlogdump.py, types GPS",
        ),
        (
            "flight.csv",
            "5/1/2026 12:37:41 PM,FE,1E,13,mavlink_gps_raw_int_t,time_usec,306016000,lat,4\n",
            "mavlogdump.py, types GPS",
        ),
    ],
)
def test_exports_of_other_layouts_are_named_with_the_one_that_is_read(tmp_path, name, text, hint):
    assert hint in refused(tmp_path, text, name).hint


def test_months_in_other_languages_are_named(tmp_path):
    fault = refused(tmp_path, "time,lat,lon\n01-Mai-2026 10:00:00,60,24\n")
    assert fault.hint == "a month that is not named in English; write 2026-05-01T10:00:00"


def test_times_that_are_read_are_not_said_to_be_missing(tmp_path):
    """They were named before what is wrong."""
    fault = refused(tmp_path, "time,lat,lon\n2026-05-01T10:00:00Z,north,east\n")
    assert fault.got.startswith("none in 1 row: lat: 1 value is no number")
