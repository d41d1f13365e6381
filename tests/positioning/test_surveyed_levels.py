"""Reports whose levels are those of a survey's maps: which are replaced, and which stay."""

from types import SimpleNamespace

import numpy as np
import pytest
from made_fingerprints import CRS

from mapfilter.positioning.fingerprints import survey_levels
from mapfilter.positioning.fingerprints.reports import Reports
from mapfilter.positioning.fingerprints.survey_levels import as_measurements, surveyed_levels

FIRST = np.array([0, 2, 3, 3, 6])
CELL = np.array([2, 0, 0, 1, 2, 0], dtype=np.int32)
LEVEL_DBM = np.array([-70.0, -71.0, np.nan, -73.0, -74.0, -75.0])
REPORT = np.array([0, 0, 1, 3, 3, 3])


def reports():
    return Reports(
        CRS, ("A", "B", "C"), FIRST, CELL, LEVEL_DBM, np.full(6, 0.5), np.zeros(6, np.int8),
        np.full(4, -1, np.int32), np.full(4, np.nan), np.array([5.0, 6.0, 7.0, 8.0]),
        np.array([100.0, 200.0, 300.0, 400.0]), np.array([10.0, 20.0, 30.0, 40.0]),
        np.array([7, 3, 3, 3], dtype=np.int32),
    )  # fmt: skip


def test_readings_with_a_level_are_measurements():
    found = as_measurements(reports())
    known = np.isfinite(LEVEL_DBM)
    assert (found.crs, found.cell_ids) == (CRS, ("A", "B", "C"))
    np.testing.assert_array_equal(found.cell, CELL[known])
    np.testing.assert_array_equal(found.level_dbm, LEVEL_DBM[known])
    np.testing.assert_array_equal(found.east_m, 100.0 * (REPORT[known] + 1))
    np.testing.assert_array_equal(found.north_m, 10.0 * (REPORT[known] + 1))
    np.testing.assert_array_equal(found.time_s, REPORT[known] + 5.0)
    # Sessions are the blocks that have a reading.
    assert found.sessions == ("block 3", "block 7")
    assert found.session.tolist() == [1, 1, 0, 0, 0]


class Map:
    def __init__(self, offset_db):
        self.offset_db = offset_db

    def predict(self, east_m, north_m):
        return -east_m / 10 + self.offset_db, north_m / 10


def test_levels_of_surveyed_cells_are_those_of_their_maps(monkeypatch):
    asked = []

    def fitted(_, options):
        asked.append(options)
        return SimpleNamespace(cells={"A": Map(0.0), "C": Map(-3.0)})

    monkeypatch.setattr(survey_levels, "fit_survey", fitted)
    given = reports()
    found = surveyed_levels(given)
    # Of A and C where they were measured; B and missing levels stay as they are.
    expected = [-13.0, -10.0, np.nan, -73.0, -43.0, -40.0]
    np.testing.assert_allclose(found.level_dbm, expected)
    np.testing.assert_allclose(found.sd_db, [1.0, 1.0, 0.5, 0.5, 4.0, 4.0])
    np.testing.assert_array_equal(given.level_dbm, LEVEL_DBM)
    np.testing.assert_array_equal(found.cell, CELL)
    (options,) = asked
    assert (options.trend, options.square_m) == ("mean", 5.0)
    assert (options.most_points, options.min_points) == (400, 3)


def test_without_a_survey_reports_stay_as_they_are():
    """Each cell was received in two squares at most."""
    given = reports()
    assert surveyed_levels(given) is given


def test_other_errors_are_none_of_a_survey(monkeypatch):
    def broken(*_):
        raise ValueError("a fault of the program")

    monkeypatch.setattr(survey_levels, "fit_survey", broken)
    with pytest.raises(ValueError, match="a fault"):
        surveyed_levels(reports())
