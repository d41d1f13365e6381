"""Neighbours without any identity: equal readings of a report are of several cells."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.log import make_log
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.store import read_log, write_log

CRS = "EPSG:32635"


def report(time_s=0.0, serving_dbm=-60.0, neighbours_dbm=(-90.0, -90.0, -95.0), **names):
    """One report: its serving cell, and neighbours that nothing names unless given."""
    count = len(neighbours_dbm)
    return pd.DataFrame(
        {
            "time_s": time_s,
            "role": ["serving", *["neighbour"] * count],
            "cell": ["A", *[None] * count],
            "level_dbm": [serving_dbm, *neighbours_dbm],
            **{name: pd.array([None, *[value] * count], "Int64") for name, value in names.items()},
        }
    )


def levels(log):
    return log.radio["level_dbm"].tolist()


@pytest.mark.parametrize("names", [{}, {"arfcn": 700}])
def test_equal_readings_of_a_report_are_kept(names, tmp_path):
    log = make_log(CRS, radio=pd.concat([report(**names), report(1.0, **names)]))
    assert levels(log) == [-60.0, -90.0, -90.0, -95.0] * 2
    assert log.notes == ()
    write_log(log, tmp_path / "log")
    assert levels(read_log(tmp_path / "log")) == levels(log)


@pytest.mark.parametrize("times", [2, 3])
def test_a_report_that_comes_several_times_is_one(times):
    log = make_log(CRS, radio=pd.concat([report()] * times + [report(1.0)]))
    assert levels(log) == [-60.0, -90.0, -90.0, -95.0] * 2
    assert log.notes == (f"radio: {4 * (times - 1)} exact duplicate rows dropped",)


def test_a_neighbour_that_is_named_is_one_cell():
    log = make_log(CRS, radio=report(arfcn=700, bsic=11))
    assert levels(log) == [-60.0, -90.0, -95.0]


def test_a_reading_that_was_repeated_with_a_part_of_the_report_is_one():
    """Where the serving cell's row comes twice, two equal neighbours are one."""
    rows = report(neighbours_dbm=(-90.0, -95.0))
    log = make_log(CRS, radio=pd.concat([rows, rows.iloc[:2]]))
    assert levels(log) == [-60.0, -90.0, -95.0]


def test_recordings_keep_them_as_well(tmp_path):
    rows = pd.concat([report(float(second)) for second in range(30)])
    for times in (1, 2):
        file = tmp_path / f"{times}.csv"
        pd.concat([rows] * times).to_csv(file, index=False)
        read = read_recording(file).tables["radio"]
        assert np.array_equal(read.groupby("time_s").size(), np.full(30, 4))
