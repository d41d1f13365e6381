"""Reports: made of logs and tables, joined, thinned and renamed without losing a reading."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_fingerprints import CRS, reports_at

from mapfilter.errors import InputError
from mapfilter.positioning.fingerprints.joining import joined_reports
from mapfilter.positioning.fingerprints.log_reports import reports_of_log
from mapfilter.positioning.fingerprints.reports import make_reports
from mapfilter.tracks.log import make_log
from mapfilter.tracks.scans import SCAN_S, scan_of_rows


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
    assert "1 reading left out: cell unknown" in reports.notes


def radio_rows(*rows, technology=None):
    names = ["time_s", "cell", "level_dbm", "role"]
    found = pd.DataFrame([(*row, "neighbour")[:4] for row in rows], columns=names)
    return found if technology is None else found.assign(technology=technology)


def test_readings_a_few_milliseconds_apart_are_one_report():
    rows = [(10.0, "a", -70.0), (10.004, "b", -75.0), (10.3, "c", -80.0), (12.0, "a", -71.0)]
    truth = pd.DataFrame({"time_s": [10.0, 20.0], "east_m": [5e5, 5e5 + 100], "north_m": 1e6})
    reports = reports_of_log(make_log(CRS, radio=radio_rows(*rows), truth=truth))
    assert as_sets(reports) == [{("a", -70.0), ("b", -75.0), ("c", -80.0)}, {("a", -71.0)}]
    np.testing.assert_allclose(reports.time_s, [10 + 0.304 / 3, 12.0])
    np.testing.assert_allclose(reports.east_m, [5e5 + 3.04 / 3, 5e5 + 20])
    assert "readings of one scan, less than 1 s apart, are one report" in reports.notes


def test_neighbours_without_an_identity_begin_no_report():
    """The second one was taken for a cell that is reported again."""
    rows = [(10.0, "a", -70.0, "serving"), (10.01, None, -80.0), (10.02, None, -85.0)]
    rows += [(10.03, "b", -75.0), (10.48, "a", -70.0, "serving"), (10.49, None, -80.0)]
    assert scan_of_rows(make_log(CRS, radio=radio_rows(*rows)).radio).tolist() == [0] * 4 + [1] * 2


def test_a_cell_that_is_reported_again_begins_a_report():
    rows = [(0.48 * i, name, -70.0 - i) for i in range(4) for name in "ab"]
    reports = reports_of_log(make_log(CRS, radio=radio_rows(*rows)))
    assert as_sets(reports) == [{("a", -70.0 - i), ("b", -70.0 - i)} for i in range(4)]
    assert reports.notes == ()


def test_another_serving_cell_begins_a_report_unless_of_another_technology():
    rows = [(0.0, "a", -70.0, "serving"), (0.4, "b", -70.0, "serving"), (0.5, "c", -9.0)]
    reports = reports_of_log(make_log(CRS, radio=radio_rows(*rows)))
    assert [len(one) for one in as_sets(reports)] == [1, 2]
    families = ["LTE", "NR", "LTE"]
    reports = reports_of_log(make_log(CRS, radio=radio_rows(*rows, technology=families)))
    assert [len(one) for one in as_sets(reports)] == [3]


def test_of_advertisements_the_mean_level_counts():
    rows = [(0.0, "a", -70.0), (0.1, "b", -60.0), (0.3, "a", -74.0), (0.9, "a", -72.0)]
    rows += [(1.0, "a", -80.0), (1.1, "a", np.nan), (1.2, "c", np.nan)]
    reports = reports_of_log(make_log(CRS, radio=radio_rows(*rows, technology="BLE")))
    assert as_sets(reports)[0] == {("a", -72.0), ("b", -60.0)}
    cells, levels = reports.readings(1)
    assert [reports.cell_ids[i] for i in cells] == ["a", "c"]
    np.testing.assert_array_equal(levels, [-80.0, np.nan])
    assert not any("twice" in note for note in reports.notes)


@settings(max_examples=60)
@given(
    st.lists(
        st.tuples(st.integers(0, 60), st.sampled_from("abcd"), st.sampled_from(["LTE", "BLE"])),
        min_size=1,
        max_size=40,
    )
)
def test_scans_keep_order_length_and_cells(rows):
    rows = sorted((i / 10, cell, family) for i, cell, family in rows)
    radio = pd.DataFrame(rows, columns=["time_s", "cell", "technology"])
    radio = radio.assign(role="neighbour", arfcn=None, bsic=None)
    scan = scan_of_rows(radio)
    assert scan[0] == 0
    assert set(np.diff(scan)) <= {0, 1}
    for number in range(scan.max() + 1):
        own = radio[scan == number]
        assert np.ptp(own["time_s"]) < SCAN_S
        once = own[own["technology"] == "LTE"].groupby("cell")["time_s"].nunique()
        assert (once <= 1).all()
        if number:
            # It had to begin: too late for the scan before, or a cell of it was there.
            before = radio[scan == number - 1]
            began_s = own["time_s"].iloc[0]
            at_once = own[(own["time_s"] == began_s) & (own["technology"] == "LTE")]
            late = began_s - before["time_s"].iloc[0] >= SCAN_S
            cells = set(before[before["technology"] == "LTE"]["cell"])
            assert late or cells & set(at_once["cell"])
            assert before["time_s"].iloc[-1] < began_s


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


def test_a_single_reading_that_was_left_out_is_added_to_those_of_other_logs():
    notes = ["1 reading left out: cell unknown", "3 readings left out: cell unknown", "steps"]
    parts = [make_reports(CRS, [0], ["a"], [-60.0], count=1, notes=[one]) for one in notes]
    of_four = "4 readings left out: cell unknown"
    assert joined_reports(parts).notes == (of_four, "steps")
    assert joined_reports([parts[0]] * 2).notes == ("2 readings left out: cell unknown",)
    assert joined_reports([parts[0]]).notes == ("1 reading left out: cell unknown",)


def test_logs_of_two_zones_are_not_joined():
    one = make_reports("EPSG:32635", [0], ["a"], [-60.0], count=1)
    other = make_reports("EPSG:32636", [0], ["a"], [-60.0], count=1)
    with pytest.raises(InputError, match="EPSG:32635"):
        joined_reports([one, other])
    with pytest.raises(InputError, match="at least one log"):
        joined_reports([])
