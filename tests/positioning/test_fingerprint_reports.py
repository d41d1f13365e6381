"""Reports: made of logs and tables, joined, thinned and renamed without losing a reading."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_fingerprints import CRS, reports_at

from mapfilter.errors import InputError
from mapfilter.positioning.fingerprints.reports import (
    joined_reports,
    make_reports,
    reports_of_log,
)
from mapfilter.tracks.log import make_log


def as_sets(reports):
    """Return each report as a set of cells and levels."""
    return [
        {(reports.cell_ids[c], float(v)) for c, v in zip(*reports.readings(i), strict=True)}
        for i in range(len(reports))
    ]


@settings(max_examples=40)
@given(
    readings=st.lists(
        st.tuples(st.integers(0, 5), st.sampled_from("abcde"), st.integers(-100, -40)), max_size=30
    ),
    seed=st.integers(0, 100),
)
def test_readings_stay_with_their_report(readings, seed):
    strongest = {}
    for report, cell, level in readings:
        key = report, cell
        strongest[key] = max(level, strongest.get(key, -1000))
    report, cell, level = zip(*readings, strict=True) if readings else ((), (), ())
    made = make_reports(CRS, list(report), list(cell), list(level), count=6)
    expected = [
        {(c, float(v)) for (r, c), v in strongest.items() if r == number} for number in range(6)
    ]
    assert as_sets(made) == expected
    order = np.random.default_rng(seed).permutation(6)[:4]
    assert as_sets(made.some(order)) == [expected[i] for i in order]
    assert as_sets(made.compact()) == expected
    named, unknown = made.named_as(["e", "b"])
    assert as_sets(named) == [{pair for pair in one if pair[0] in "be"} for one in expected]
    assert unknown.tolist() == [sum(pair[0] not in "be" for pair in one) for one in expected]
    twice = joined_reports([made, made])
    assert as_sets(twice) == expected + expected


def test_a_log_becomes_a_report_for_each_time():
    radio = pd.DataFrame(
        {
            "time_s": [0.0, 0.0, 0.0, 5.0, 100.0],
            "role": ["serving", "neighbour", "neighbour", "serving", "neighbour"],
            "cell": ["a", "b", None, "b", "a"],
            "level_dbm": [-70.0, -80.0, -90.0, np.nan, -75.0],
            "timing_advance": [3, None, None, None, None],
        }
    )
    truth = pd.DataFrame(
        {"time_s": [0.0, 10.0, 90.0], "east_m": [500_000.0, 500_020.0, 500_100.0], "north_m": 1e6}
    )
    reports = reports_of_log(make_log(CRS, radio=radio, truth=truth), block=4)
    assert reports.time_s.tolist() == [0.0, 5.0, 100.0]
    assert [len(one) for one in as_sets(reports)] == [2, 1, 1]
    assert [reports.cell_ids[i] if i >= 0 else "" for i in reports.serving] == ["a", "b", ""]
    np.testing.assert_array_equal(reports.timing_advance, [3, np.nan, np.nan])
    # Between two known positions; not after the last.
    np.testing.assert_allclose(reports.east_m, [500_000, 500_010, np.nan])
    assert (reports.block == 4).all()
    assert "1 readings left out: cell unknown" in reports.notes


def test_no_position_is_interpolated_over_a_long_gap():
    radio = pd.DataFrame({"time_s": [50.0, 90.0], "role": "serving", "cell": "a"})
    truth = pd.DataFrame({"time_s": [0.0, 90.0], "east_m": [5e5, 6e5], "north_m": 1e6})
    reports = reports_of_log(make_log(CRS, radio=radio, truth=truth))
    np.testing.assert_allclose(reports.east_m, [np.nan, 6e5])


def test_reports_without_position_or_reading_are_no_database():
    level = np.array([[-60.0, np.nan], [np.nan, np.nan], [-70.0, -80.0]])
    places = np.array([[0.0, 0.0], [1.0, 1.0], [np.nan, 2.0]])
    placed = reports_at(places, level, names=("a", "b")).placed()
    assert len(placed) == 1
    assert placed.cell_ids == ("a",)
    assert placed.notes == ("2 reports left out: no position, or nothing received",)


def test_only_counts_of_what_was_left_out_are_added_up():
    notes = ("3 dB steps", "2 readings left out: cell unknown")
    one = make_reports(CRS, [0], ["a"], [-60.0], count=1, notes=notes)
    joined = joined_reports([one, one])
    assert joined.notes == ("3 dB steps", "4 readings left out: cell unknown")


def test_logs_of_two_zones_are_not_joined():
    one = make_reports("EPSG:32635", [0], ["a"], [-60.0], count=1)
    other = make_reports("EPSG:32636", [0], ["a"], [-60.0], count=1)
    with pytest.raises(InputError, match="EPSG:32635"):
        joined_reports([one, other])
    with pytest.raises(InputError, match="at least one log"):
        joined_reports([])
