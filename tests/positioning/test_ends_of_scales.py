"""Ends of the scales of reports, where some rows state odd bounds."""

import numpy as np
import pytest
from made_fingerprints import CRS

from mapfilter.positioning.fingerprints.censoring import (
    OPEN,
    Bounds,
    bounded,
    bounds_of,
    likely,
)
from mapfilter.positioning.fingerprints.reports import make_reports


def _bounds(plain_dbm, ends=()):
    """Return the ends of levels and of (level, censored) pairs, a report each."""
    level_dbm = [*plain_dbm, *(dbm for dbm, _ in ends)]
    censored = [0] * len(plain_dbm) + [end for _, end in ends]
    count = len(level_dbm)
    return bounds_of(
        make_reports(CRS, range(count), ["a"] * count, level_dbm, count=count, censored=censored)
    )


LEVELS_DBM = np.linspace(-110, -61, 100)


@pytest.mark.parametrize("odd", [(-105.0, 1), (-65.0, -1)])
def test_one_odd_row_ends_no_scale(odd):
    assert _bounds(LEVELS_DBM, [odd]) == OPEN


def test_an_odd_row_leaves_the_ends_of_others():
    ends = [(-60.0, 1), (-110.0, -1), (-105.0, 1), (-65.0, -1)]
    assert _bounds(LEVELS_DBM, ends) == Bounds(-110.0, -60.0)


@pytest.mark.parametrize(("beyond", "counts"), [(5, True), (6, False)])
def test_an_end_may_have_a_twentieth_of_the_readings_beyond_it(beyond, counts):
    strong = [-80.0] * (100 - beyond) + [-50.0] * beyond
    assert _bounds(strong, [(-60.0, 1)]) == (Bounds(high_dbm=-60.0) if counts else OPEN)
    weak = [-80.0] * (100 - beyond) + [-115.0] * beyond
    assert _bounds(weak, [(-100.0, -1)]) == (Bounds(low_dbm=-100.0) if counts else OPEN)


def test_the_narrowest_of_several_ends_counts():
    ends = [(-62.0, 1), (-51.0, 1), (-113.0, -1), (-108.0, -1)]
    assert _bounds(LEVELS_DBM, ends) == Bounds(-108.0, -62.0)


def test_readings_at_an_end_are_not_beyond_it():
    assert _bounds([-60.0] * 50 + [-110.0] * 50, [(-60.0, 1), (-110.0, -1)]) == (-110.0, -60.0)


def test_bounds_alone_and_missing_levels():
    assert _bounds([], [(-85.0, 1), (-115.0, -1)]) == Bounds(-115.0, -85.0)
    assert _bounds([np.nan] * 9, [(-85.0, 1)]) == Bounds(high_dbm=-85.0)
    assert _bounds([], [(np.nan, 1), (np.nan, -1), (-85.0, 1)]) == Bounds(high_dbm=-85.0)
    assert _bounds([]) == OPEN


def test_an_end_that_is_stronger_than_the_other_is_left_open():
    """Of two technologies; where both are of one level, too."""
    for high_dbm in (-100.0, -80.0):
        assert _bounds([], [(-80.0, -1), (high_dbm, 1)]) == Bounds(high_dbm=high_dbm)


def test_reports_as_a_scale_would_have_shown_them():
    """Levels at an end are levels; what was a bound before stays one."""
    level_dbm, censored = [-120.0, -110.0, -90.0, -60.0, -50.0, np.nan, -70.0], [0] * 6 + [1]
    given = make_reports(CRS, range(7), ["a"] * 7, level_dbm, count=7, censored=censored)
    found = bounded(given, Bounds(-110.0, -60.0))
    shown_dbm = [-110.0, -110.0, -90.0, -60.0, -60.0, np.nan, -70.0]
    np.testing.assert_array_equal(found.level_dbm, shown_dbm)
    assert found.censored.tolist() == [-1, 0, 0, 0, 1, 0, 1]
    assert given.censored.tolist() == censored
    assert bounded(given, OPEN).level_dbm[:5].tolist() == level_dbm[:5]


def test_missing_levels_and_bounds_are_as_is_usual_where_they_allow_it():
    """Of a cell that is -70 dBm as a rule, and of one of -90."""
    usual_dbm = np.array([-70.0, -90.0])
    cell = np.array([0, 1, 0, 1, 0, 1, 0, 0], dtype=np.int32)
    level_dbm = np.array([np.nan, np.nan, -80.0, -80.0, -80.0, -80.0, -60.0, -75.0])
    censored = np.array([0, 0, -1, -1, 1, 1, 0, 0], dtype=np.int8)
    expected = [-70.0, -90.0, -80.0, -90.0, -70.0, -80.0, -60.0, -75.0]
    assert likely(level_dbm, censored, cell, usual_dbm).tolist() == expected
    plain = [-70.0, -90.0, -80.0, -80.0, -80.0, -80.0, -60.0, -75.0]
    assert likely(level_dbm, None, cell, usual_dbm).tolist() == plain
