"""Columns that make no reports are refused with every fault, and odd types are read as meant."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import MapfilterError
from mapfilter.positioning.fingerprints.reports import make_reports

CRS = "EPSG:32635"


def made(report=(0, 0, 1), cell=("a", "b", "a"), level_dbm=(-50.0, -60.0, -70.0), **more):
    return make_reports(more.pop("crs", CRS), report, cell, level_dbm, **{"count": 2} | more)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"crs": "EPSG:4326"}, r"^reports, crs: expected a projected CRS in metres, found WGS 84"),
        ({"count": 2.0}, r"^make_reports, count: expected a whole number >= 0, found 2.0$"),
        ({"count": -2}, r"^make_reports, count: expected a whole number >= 0, found -2$"),
        ({"report": (0, 0, 2)}, r"^reading 3, report: expected a whole number in 0..1, found 2$"),
        ({"report": (0, -1, 1)}, r"^reading 2, report: expected a whole number in 0..1, found -1$"),
        ({"report": (0.5, 0, 1)}, r"^reading 1, report: expected a whole .*, found 0.5$"),
        ({"report": (np.nan, 0, 1)}, r"^reading 1, report: expected a whole .*, found nothing$"),
        ({"report": (0, 0)}, r"^readings, cell: expected one for each of 2 in report, found 3\n"),
        ({"cell": ("a", None, "a")}, r"^reading 2, cell: expected the id of .*, found nothing"),
        ({"cell": ("a", np.nan, "a")}, r"^reading 2, cell: expected the id of .*, found nothing"),
        ({"cell": ("a", "b", "")}, r"^reading 3, cell: expected the id of .*, found ''"),
        ({"cell": np.array(["", "b", "c"])}, r"^reading 1, cell: expected the id of .*, found ''"),
        ({"cell": pd.array(["a", "b", None], dtype="string")}, r"^reading 3, cell: expected"),
        ({"level_dbm": (50.0, 60.0, 70.0)}, r"found 50.0 \(likely: a lost sign \(70 for -70 dBm\)"),
        ({"level_dbm": (20, 30, 25)}, r"found 20 \(likely: raw RXLEV given for dBm\)"),
        ({"level_dbm": (100, -60, -70)}, r"^reading 1, .*, found 100 \(likely: what stands for a"),
        ({"level_dbm": (-np.inf, -60, -70)}, r"^reading 1, level_dbm: .*, found -inf$"),
        ({"level_dbm": ("loud", -60, -70)}, r"^readings, level_dbm: expected numbers, found could"),
        ({"report": (), "cell": "a"}, r"^readings, cell: expected a column of values, found 'a'\n"),
        ({"level_dbm": -60.0}, r"^readings, level_dbm: expected a column of values, found -60.0$"),
        ({"sd_db": np.array(3.0)}, r"^readings, sd_db: expected a column of values, found array"),
        ({"time_s": 5.0}, r"^reports, time_s: expected a column of values, found 5.0$"),
        ({"count": 0}, r"^reading 1, report: expected no reading where count is 0, found 0\n"),
        ({"sd_db": (1.0,)}, r"^readings, sd_db: expected one for each of 3 in report, found 1$"),
        ({"time_s": (1, 2, 3)}, r"^reports, time_s: expected one for each of 2 reports, found 3$"),
        ({"places": np.zeros((3, 2))}, r"^reports, places: expected one for each of 2 reports"),
        ({"places": np.zeros((2, 3))}, r"^reports, places: .* \(2, 2\), found the shape \(2, 3\)$"),
    ],
)
def test_columns_that_make_no_reports_are_refused(given, message):
    with pytest.raises(MapfilterError, match=message):
        made(**given)


def test_many_faults_are_counted():
    with pytest.raises(MapfilterError) as caught:
        made(report=[7] * 9, cell=["a"] * 9, level_dbm=[-300.0] * 9)
    report, level = (
        [one for one in caught.value.faults if one.where.endswith(name)]
        for name in ("report", "level_dbm")
    )
    assert [one.got for one in report] == ["7", "7", "7", "6 more readings like these"]
    assert [one.got for one in level] == ["-300.0"] * 3 + ["6 more readings like these"]
    with pytest.raises(MapfilterError) as caught:
        made(level_dbm=[-300.0] * 3)
    assert [one.got for one in caught.value.faults] == ["-300.0"] * 3


def test_what_columns_hold_is_looked_at_once_they_are_of_one_length():
    with pytest.raises(MapfilterError) as caught:
        made(report=(0, 0, 9), cell=("a", ""))
    assert [one.where for one in caught.value.faults] == ["readings, cell"]
    with pytest.raises(MapfilterError) as caught:
        made(report=(0, 0, 9), cell=("a", "", "a"))
    wrong = ["reading 3, report", "reading 2, cell"]
    assert [one.where for one in caught.value.faults] == wrong


@pytest.mark.parametrize(
    "cell", [[12, 12, 7], [12.0, 12.0, 7.0], pd.Series([12, 12, 7], index=[9, 9, 9], dtype="Int64")]
)
def test_numbers_name_transmitters_as_in_a_log(cell):
    found = made(report=(0, 1, 1), cell=cell)
    assert found.cell_ids == ("12", "7")
    assert found.cell.tolist() == [0, 0, 1]


@pytest.mark.parametrize("serving", [[12, 7], [12.0, 7.0], np.array([12.0, 7.0])])
def test_numbers_name_serving_cells_as_they_name_transmitters(serving):
    found = made(report=(0, 1, 1), cell=[12.0, 12.0, 7.0], serving=serving)
    assert found.cell_ids == ("12", "7")
    assert found.serving.tolist() == [0, 1]


@pytest.mark.parametrize("none", ["", None, np.nan, pd.NA])
def test_a_report_may_have_no_serving_cell(none):
    found = made(serving=["a", none])
    assert found.cell_ids == ("a", "b")
    assert found.serving.tolist() == [0, -1]


def test_types_of_pandas_are_read():
    found = made(
        report=pd.array([0, 0, 1], dtype="Int64"),
        cell=pd.Categorical(["a", "b", "a"]),
        level_dbm=pd.Series([-50.0, None, -70.0], dtype="Float64"),
        places=pd.DataFrame({"east_m": [1.0, 2.0], "north_m": [3.0, 4.0]}),
    )
    np.testing.assert_array_equal(found.level_dbm, [-50.0, np.nan, -70.0])
    assert found.places.tolist() == [[1.0, 3.0], [2.0, 4.0]]


def test_levels_a_little_above_zero_among_others_are_kept():
    assert made(level_dbm=(3.0, -60.0, -70.0)).level_dbm.tolist() == [3.0, -60.0, -70.0]


def test_no_readings_make_empty_reports():
    found = made((), (), ())
    assert (len(found), found.cell_ids, len(found.cell)) == (2, (), 0)
