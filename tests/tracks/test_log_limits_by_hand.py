"""Limits of a track log by hand: ranges of columns, and how far tables and steps may differ."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import Faults
from mapfilter.geodesy import project
from mapfilter.tracks.checks.clock_notes import week_fault
from mapfilter.tracks.checks.log_checks import check_clocks, check_steps, ends_early, odd_start
from mapfilter.tracks.column_values import TableFaults, column_values
from mapfilter.tracks.joining.geographic import in_metres
from mapfilter.tracks.schema import SCHEMA
from mapfilter.tracks.tables import tidy_table

TURN_RAD = 6.283185307

RANGES = [
    *(("motion", "step_m", -1e6, 1e6), ("motion", "turn_rad", -TURN_RAD, TURN_RAD)),
    *(("motion", "heading_rad", -TURN_RAD, TURN_RAD), ("motion", "sampling_sd_m", 0, 1e6)),
    *(("radio", "arfcn", 0, 3_279_165), ("radio", "bsic", 0, 1007), ("radio", "mcc", 0, 999)),
    *(("radio", "level_dbm", -200, 0), ("radio", "censored", -1, 1), ("radio", "mnc", 0, 999)),
    *(("radio", "timing_advance", 0, 3846), ("radio", "level_step_db", 0, 60)),
    *(("radio", "lac", 0, 16_777_215), ("radio", "ci", 0, 68_719_476_735)),
    *(("gnss", "time_s", -1e11, 1e11), ("gnss", "east_m", -1e8, 1e8)),
    *(("gnss", "north_m", -1e8, 1e8), ("gnss", "var_east_m2", 0, 1e16)),
    *(("gnss", "var_north_m2", 0, 1e16), ("gnss", "cov_east_north_m2", -1e16, 1e16)),
    *(("pseudoranges", "pseudorange_m", 1.5e7, 6e7), ("pseudoranges", "sigma_m", 1e-3, 1e5)),
    *(("pseudoranges", "x_m", -6e7, 6e7), ("tdoa", "difference_m", -2e5, 2e5)),
    *(("tdoa", "sigma_m", 1e-3, 1e5), ("tdoa", "reference_sigma_m", 1e-3, 1e5)),
]


@pytest.mark.parametrize(("table", "name", "low", "high"), RANGES)
def test_values_beside_the_ends_of_a_column_are_refused(table, name, low, high):
    column = next(one for one in SCHEMA[table] if one.name == name)
    whole = column.kind == "integer"
    beside = 1 if whole else 1e-6 * (high - low)
    values = [low, high, low - beside, high + beside]
    found = TableFaults("made", 1 + np.arange(4), Faults())
    column_values(column, pd.DataFrame({name: values}), found)
    faults = "\n".join(map(str, found.faults.found))
    assert [f"row {row}, {name}" in faults for row in (1, 2, 3, 4)] == [False, False, True, True]


@pytest.mark.parametrize(
    ("technology", "name", "most", "hint"),
    [
        ("GSM", "bsic", 63, ""),
        ("UMTS", "arfcn", 16_383, ""),
        ("LTE", "timing_advance", 1282, "metres for steps"),
        ("LTE", "bsic", 503, ""),
    ],
)
def test_codes_of_a_log_are_those_of_their_technology(technology, name, most, hint):
    """Each row by its own: the last two are of a technology that has larger ones, and of none."""
    rows = {"time_s": np.arange(4.0), "role": "serving", "level_dbm": -80.0, "cell": "a"}
    rows |= {"technology": [technology, technology, "CDMA", None], name: [most, most + 1] * 2}
    faults = Faults()
    tidy_table("radio", pd.DataFrame(rows), "radio.csv", faults)
    found = [fault for fault in faults.found if f"0..{most} in {technology}" in fault.expected]
    assert [fault.where for fault in found] == [f"radio.csv row 2, {name}"]
    assert found[0].hint == hint


def faults_of(check, *given):
    faults = Faults()
    check(*given, faults)
    return "\n".join(map(str, faults.found))


def table(*times_s):
    return pd.DataFrame({"time_s": np.concatenate(times_s)})


@pytest.mark.parametrize(("gap_s", "apart"), [(600.0, False), (600.5, True)])
def test_tables_may_begin_ten_minutes_after_another_ends(gap_s, apart):
    tables = {"motion": table(np.arange(100.0)), "radio": table(99 + gap_s + np.arange(50.0))}
    found = faults_of(check_clocks, tables, {})
    assert bool(found) == apart
    assert ("seconds of the day, or Unix time, in one of them" in found) == apart


@pytest.mark.parametrize(
    ("times", "told"), [(300, True), (299, False), (3000, True), (3001, False)]
)
def test_times_of_a_thousandth_of_others_are_milliseconds(times, told):
    tables = {"motion": table(times * np.arange(100.0)), "radio": table(np.arange(100.0))}
    assert ("milliseconds for s in motion" in faults_of(check_clocks, tables, {})) == told


@pytest.mark.parametrize(
    ("before_s", "whole_s", "early"),
    [(30.0, 100.0, False), (30.5, 100.0, True), (60.0, 600.0, False), (60.5, 600.0, True)],
)
def test_rows_end_early_by_30_s_and_a_tenth(before_s, whole_s, early):
    assert ends_early(before_s, whole_s) == early


@pytest.mark.parametrize(
    ("gap_s", "weeks"),
    [
        # 1024 weeks and less than a day to either side; twice as many.
        *((619_315_200.0, 1), (619_401_599.0, 1), (619_228_801.0, 1), (1_238_630_400.0, 2)),
        *((619_401_600.0, 0), (86_399.0, 0), (300_000_000.0, 0)),
    ],
)
def test_dates_1024_weeks_apart(gap_s, weeks):
    expected = f"--offset FILE={619_315_200 * weeks}" if weeks else ""
    assert week_fault(gap_s).endswith(expected)
    assert bool(week_fault(gap_s)) == bool(weeks)


@pytest.mark.parametrize(
    ("start_s", "told"),
    [
        # 1 January 1980 and 1 January 2100, in UTC.
        *((315_532_800.0, ""), (315_532_799.0, "begin in 1979"), (4_102_444_799.0, "")),
        (4_102_444_800.0, "begin in 2100"),
    ],
)
def test_usual_years_of_a_start(start_s, told):
    notes = odd_start(start_s, {"motion": table(np.arange(10.0))}, "log")
    assert len(notes) == bool(told)
    assert told in "".join(notes)


def steps(step_m, step_s=1.0, truth=()):
    rows = table(step_s * np.arange(float(len(step_m)))).assign(step_m=step_m)
    empty = pd.DataFrame({"time_s": [], "east_m": [], "north_m": []})
    places = pd.DataFrame(truth, columns=["time_s", "east_m", "north_m"]) if truth else empty
    faults = Faults()
    notes = check_steps({"motion": rows, "truth": places, "gnss": empty}, "motion", faults)
    return "\n".join([*map(str, faults.found), *notes])


def test_steps_beyond_100_mps_in_the_median_are_of_another_unit():
    assert steps(np.full(40, 100.0)) == ""
    assert "101 m/s in the median" in steps(np.full(40, 101.0))
    assert steps(np.full(9, 101.0)) == ""


def test_more_than_two_thirds_backwards_are_the_other_sign():
    assert steps(np.repeat([-1.0, 1.0], [20, 10])) == ""
    assert "21 negative steps of 30" in steps(np.repeat([-1.0, 1.0], [21, 9]))


def test_less_than_2_cm_a_second_over_a_minute_are_kilometres():
    assert steps(np.full(62, 0.0201)) == ""
    assert "only 1.18 m in 61 s; kilometres for metres?" in steps(np.full(62, 0.019))
    assert steps(np.full(60, 0.019)) == ""
    assert steps(np.zeros(62)) == ""


@pytest.mark.parametrize(
    ("times", "told"), [(99.0, False), (101.0, True), (1199.0, True), (1201.0, False)]
)
def test_positions_100_to_1200_times_the_way_apart_are_kilometres(times, told):
    """Steps of 0.05 m over 40 s, or 2 m in all, are slower than 0.1 m/s."""
    truth = [(0.0, 0.0, 0.0), (39.0, 2.0 * times, 0.0)]
    found = steps(np.full(40, 0.05), truth=truth)
    assert ("kilometres given for metres" in found) == told


def test_steps_that_only_grow_are_a_distance_or_a_counter():
    grown = 10.5 + 1.25 * np.arange(25.0)
    assert "distance since the start; give its differences" in steps(grown)
    assert "a counter of steps" in steps(np.arange(1.0, 26.0))
    # Of 19 rows, or 19 s, nothing is said, as of a car that speeds up.
    assert steps(grown[:19]) == ""
    assert steps(grown[:20]) == ""
    assert steps(grown[:21]) != ""


def test_degrees_without_any_other_column_are_placed():
    """Their times may be an index."""
    faults, crs = Faults(), "EPSG:32633"
    degrees = pd.DataFrame({"lat_deg": [50.08, 50.081], "lon_deg": [14.42, 14.421]})
    found = in_metres("truth", degrees, "truth", crs, faults)
    east_m, north_m = project(crs, degrees["lon_deg"], degrees["lat_deg"])
    assert found.rows["east_m"].to_numpy() == pytest.approx(east_m, abs=1e-6)
    assert found.rows["north_m"].to_numpy() == pytest.approx(north_m, abs=1e-6)
    assert faults.found == []
    # One of the two is none.
    assert in_metres("truth", degrees[["lat_deg"]], "truth", crs, faults).rows.shape == (2, 1)
