"""Surveys of hardly anything: one reading, and levels that are all the same."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.survey.leave_out import leave_out
from mapfilter.survey.measured_map import fit_survey
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.options import SurveyOptions


def drive(level_dbm):
    """One drive to the east, a reading of one cell every 20 m."""
    count = len(level_dbm)
    at = np.arange(count, dtype=float)
    nothing = np.zeros(count, dtype=np.int32)
    return Measurements(
        *("EPSG:32635", ("A",), {}, ("drive",), nothing, nothing, at),
        *(385_000.0 + 20 * at, np.full(count, 6_672_000.0)),
        *(np.array(level_dbm, dtype=float), np.full(count, 5.0)),
    )


@pytest.mark.parametrize("count", [5, 30])
def test_levels_that_are_all_the_same_have_a_deviation(count):
    same, options = drive([-110.0] * count), SurveyOptions(method="knn", trend="mean")
    cell = fit_survey(same, options).cells["A"]
    places = cell.points.east_m[:3] + 7.0, cell.points.north_m[:3]
    mean_dbm, deviation_db = cell.predict(*places)
    np.testing.assert_allclose(mean_dbm, -110.0, atol=0.1)
    np.testing.assert_allclose(deviation_db, 1 / np.sqrt(12))
    found = leave_out(same, options).validation
    assert np.isfinite(found.deviation_factor)
    assert found.within_1_deviation == 1.0


def test_one_reading_leaves_nothing_to_calibrate_where_it_is_left_out():
    predicted = {"A": lambda east_m, north_m: -80.0 + 0 * (east_m + north_m)}
    options = SurveyOptions(min_points=1)
    assert len(leave_out(drive([-70.0]), options, predicted=predicted)) == 0
    nothing = drive([-70.0]).where(np.zeros(1, dtype=np.bool_))
    with pytest.raises(InputError, match="at least 1 squares, found 0 cells"):
        fit_survey(nothing, options, predicted=predicted)
