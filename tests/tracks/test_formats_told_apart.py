"""Plain tables whose header has a word of another program's files, and maps of their columns."""

import numpy as np
import pandas as pd
import pytest
from made_recordings import MADE

from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording

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
