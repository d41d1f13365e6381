"""Plain tables whose header has a word of another program's files, and maps of their columns."""

import numpy as np
import pandas as pd
import pytest
from made_recordings import MADE

from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.unknown_formats import NOT_READ, other_names

COUNT = 60
TIME_S = 1_777_629_600 + np.arange(float(COUNT))
PLACE = {"Latitude": 60.1 + np.arange(COUNT) / 1e4, "Longitude": 24.9}
CELL = {"MCC": 244, "MNC": 5, "LAC": 1, "Cell Id": 1 + np.arange(COUNT) % 3, "RSSI": -80}
ATTITUDE = {"qx": 0.0, "qy": 0.0, "qz": 0.6, "qw": 0.8}


def read(tmp_path, table, **columns):
    path = tmp_path / "table.csv"
    pd.DataFrame(table).to_csv(path, index=False)
    return read_recording(path, options=ReadOptions(columns=columns))


@pytest.mark.parametrize(
    ("table", "tables"),
    [
        ({"#ID": 1, "Time": TIME_S, **PLACE}, {"positions"}),
        ({"Time": TIME_S, "ms": 0, **PLACE, **CELL}, {"positions", "radio"}),
        ({"Fix": 3, "Time": TIME_S, **PLACE, "Altitude": 9, "Course": 90, "HDOP": 1},
         {"positions"}),
        ({"Raw": 3, "Time": TIME_S, **PLACE, "Altitude": 9, "Course": 90, "HDOP": 1},
         {"positions"}),
        ({"time": TIME_S, "mcc": 244, "mnc": 5, "lac": 1, "cellid": 7, "rsrp": -80, "range": 90,
          "lat": PLACE["Latitude"], "lon": 24.9}, {"positions", "radio"}),
    ],
    ids=["Nemo", "TEMS", "GnssLogger's fixes", "its raw data", "a list of cells"],
)  # fmt: skip
def test_a_word_in_a_header_makes_no_other_format(tmp_path, table, tables):
    """Cells were lost without a word, or all rows refused."""
    found = read(tmp_path, table)
    assert (found.format, set(found.tables)) == ("csv", tables)
    assert all(len(rows) == COUNT for rows in found.tables.values())


@pytest.mark.parametrize(
    ("table", "columns", "tables"),
    [
        (
            {"Zeit": TIME_S, "Breite": PLACE["Latitude"], "Laenge": 24.9, "Hoehe": 9, **ATTITUDE},
            {"time": "Zeit", "lat_deg": "Breite", "lon_deg": "Laenge"},
            {"positions", "orientation"},
        ),
        (
            {"Time (s)": np.arange(COUNT), "v (m/s)": 8.0, "Gier (rad/s)": 0.1},
            {"time": "Time (s)", "wheel_speed_mps": "v (m/s)", "yaw_rate_radps": "Gier (rad/s)"},
            {"odometry"},
        ),
    ],
    ids=["TUM", "phyphox"],
)
def test_columns_that_are_named_go_before_a_format_that_is_told_by_little(
    tmp_path, table, columns, tables
):
    found = read(tmp_path, table, **columns)
    assert (found.format, set(found.tables)) == ("csv", tables)


def test_names_of_columns_that_have_no_effect_are_noted(tmp_path):
    name, text = MADE["towercollector"]
    (tmp_path / name).write_text(text)
    options = ReadOptions(columns={"level_dbm": "none"})
    told = "names of columns (--column) have no effect: this is a Tower Collector export"
    assert told in read_recording(tmp_path / name, options=options).notes
    options = ReadOptions(columns={"level_dbm": "none"}, shared=True)
    assert told not in read_recording(tmp_path / name, options=options).notes


@pytest.mark.parametrize("name", ["Zeit", "ZEIT"])
def test_columns_of_several_files_are_those_of_the_files_that_have_one(tmp_path, name):
    options = {
        shared: ReadOptions(columns={"time": name, "level_dbm": "Pegel"}, shared=shared)
        for shared in (False, True)
    }
    path = tmp_path / "other.csv"
    path.write_text("Uhr,Wert\n1,2\n")
    with pytest.raises(InputError, match="a recording in a known format"):
        read_recording(path, options=options[True])
    with pytest.raises(InputError, match=name):
        read_recording(path, options=options[False])
    pd.DataFrame({"Zeit": TIME_S, **PLACE}).to_csv(path, index=False)
    assert set(read_recording(path, options=options[True]).tables) == {"positions"}


def refused(tmp_path, text, name="own.csv"):
    path = tmp_path / name
    path.write_bytes(text.encode())
    with pytest.raises(InputError) as caught:
        read_recording(path)
    (fault,) = caught.value.faults
    return fault.got, fault.hint


@pytest.mark.parametrize(
    ("head", "hint"),
    [
        ("name,azimuth,eirp", "a list of cells, no journey: name it as [cells] plan"),
        ("name,tilt,antenna type", "a list of cells, no journey: name it as [cells] plan"),
        ("name,eirp,power", "a CSV without a column of times"),
        ("name,height,power", "a CSV without a column of times"),
        ("id,dlc,x", "raw frames of a bus"),
        ("stamp,data bytes", "raw frames of a bus"),
        ("id,d1,d2", "raw frames of a bus"),
        ("id,d1,d3", "a CSV without a column of times"),
        ("Type, Local Number, Message,x", "all messages of a FIT file"),
        ("a,mavlink_gps,b", "messages of an autopilot"),
    ],
)
def test_what_a_table_of_no_format_most_likely_is(tmp_path, head, hint):
    got, found = refused(tmp_path, f"{head}\n1,2,3\n")
    assert found.startswith(hint)
    assert got.startswith("none of them, but a table with the columns ")


@pytest.mark.parametrize("suffix", [*NOT_READ])
def test_files_of_other_programs_are_named_by_their_suffix(tmp_path, suffix):
    got, hint = refused(tmp_path, "words of another program\n", f"own{suffix.upper()}")
    assert hint == NOT_READ[suffix]
    assert got == "none of them; it begins with 'words of another program'"
    assert refused(tmp_path, "x" * 70, f"own{suffix}")[0].endswith(f"{'x' * 60!r}")


def test_json_is_named_whatever_its_suffix(tmp_path):
    for text in ('{"time": 1}', ' [{"time": 1, "lat": 2}]'):
        got, hint = refused(tmp_path, text, "own.txt")
        assert (hint, got[:29]) == (NOT_READ[".json"], "none of them; it begins with ")


@pytest.mark.parametrize(
    ("made", "own", "other", "told"),
    [
        ("antennas", ",", ";", "an Antennas log with semicolons where commas should be"),
        ("antennas", ",", "\t", "an Antennas log with tabs where commas should be"),
        ("gnettrack", "\t", " ", "a G-NetTrack log with blanks where tabs should be"),
        ("rinex-obs", " ", ",", "a RINEX observation file with commas where blanks should be"),
    ],
)
def test_separators_of_another_kind_are_named(tmp_path, made, own, other, told):
    name, text = MADE[made]
    assert refused(tmp_path, text.replace(own, other), name)[1] == told


@pytest.mark.parametrize(
    ("names", "such"),
    [
        # Fields that names resemble; of a speed by its unit, of vehicles beside cells alone.
        (["zeit", "lattitude", "londeg"], "lat_deg=lattitude and lon_deg=londeg and time=COLUMN"),
        (["timestmp", "velocity", "lat", "lon"],
         "time=timestmp and (speed_mps=velocity for m/s, or speed_kmh=velocity for km/h)"),
        (["timestmp", "velocity", "cell"],
         "time=timestmp and (wheel_speed_mps=velocity for m/s, or wheel_speed_kmh=velocity for "
         "km/h)"),
        # By the unit alone, and by the last part of a name.
        (["time", "lat", "lon", "gier (rad/s)"], "'yaw_rate_radps=gier (rad/s)'"),
        (["time", "fahrt [km/h]", "lat", "lon"], "'wheel_speed_kmh=fahrt [km/h]'"),
        (["time", "pegel [dbm]", "lat", "lon"], "'level_dbm=pegel [dbm]'"),
        (["gps.lat", "gps.lng", "own_time"],
         "lat_deg=gps.lat and lon_deg=gps.lng and time=own_time"),
        (["time", "x:latitude", "y/long"], "lat_deg=x:latitude and lon_deg=y/long"),
        # Two of one field.
        (["time", "lattitude", "latitdue", "lon"], "lat_deg= one of lattitude, latitdue"),
        # Nothing.
        (["time", "wert"], "lat_deg=LATITUDE and lon_deg=LONGITUDE"),
        (["wert", "zahl"], "lat_deg=LATITUDE and lon_deg=LONGITUDE and time=COLUMN"),
    ],
)  # fmt: skip
def test_which_columns_a_table_without_known_names_may_have(names, such):
    told = other_names(names)
    assert told.partition("such as ")[2] == such
    assert told.startswith("a CSV without a column of times; ") == ("time" not in names)
