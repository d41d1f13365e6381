"""Motion, outages and least squares of the benchmarks on recordings."""

import itertools
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.errors import InputError
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.recorded import kitti, mountain_view, smartloc
from mapfilter.experiments.recorded.least_squares import least_squares_positions
from mapfilter.experiments.recorded.outages import (
    HEADING,
    PLACE,
    PLACE_HEADING,
    Outages,
    coasted_errors_m,
    errors_at,
    errors_between,
    errors_from_true_begin,
    log_without,
    without,
)
from mapfilter.experiments.recorded.scoring import score_journey
from mapfilter.filters.contract import Reason, Status
from mapfilter.geodesy import project
from mapfilter.gnss.sky import ecef_from_lonlat
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.step_output import Fix
from mapfilter.tracks.log import make_log

CRS = "EPSG:32632"


def _curve(count=200, step_m=2.0):
    """A drive on a spiral: exact chords, headings in the middle between them."""
    heading = 0.3 + np.cumsum(np.linspace(0.0, 0.05, count))
    middle = heading - np.append(0.0, np.diff(heading)) / 2
    step = np.append(0.0, np.full(count - 1, step_m))
    east, north = (
        455000 + np.cumsum(step * np.cos(middle)),
        5.4e6 + np.cumsum(step * np.sin(middle)),
    )
    wrapped = (heading + np.pi) % (2 * np.pi) - np.pi
    return pd.DataFrame(
        {
            "time_s": 0.1 * np.arange(count),
            "east_m": east,
            "north_m": north,
            "heading_rad": wrapped,
        }
    )


def test_perfect_motion_leads_along_the_truth():
    truth = _curve()
    motion = kitti.perfect_motion(truth)
    assert kitti.reckoning_errors_m(truth, motion).max() < 1e-6
    assert np.abs(motion["turn_rad"]).max() < 0.1


def test_drift_is_between_one_and_four_per_cent_of_the_way():
    truth = _curve(500)
    motion = kitti.perfect_motion(truth)
    length = motion["step_m"].sum()
    shares = []
    for seed in range(200):
        moved = kitti.with_drift(motion, np.random.default_rng(seed))
        shares.append((moved["step_m"].sum() - length) / length)
    # Uniform between 1 and 4 %: a root mean square of 2.65 %, less what the wandering averages out.
    assert 0.012 < np.std(shares) < 0.03
    assert abs(np.mean(shares)) < 0.006


def test_a_later_start_begins_without_motion():
    truth = _curve()
    log = kitti.log_from(truth, kitti.perfect_motion(truth), 50, CRS)
    assert len(log.motion) == len(log.truth) == 150
    assert log.motion["step_m"].iloc[0] == log.motion["turn_rad"].iloc[0] == 0.0
    assert log.motion["step_m"].iloc[1] == pytest.approx(2.0)


def test_odometry_has_a_row_for_each_frame(tmp_path):
    file = tmp_path / "slam-00.csv"
    kitti.perfect_motion(_curve(count=50)).to_csv(file, index=False)
    assert len(kitti.read_odometry(file, 50)) == 50
    with pytest.raises(InputError, match="expected 51 rows, as the truth, found 50"):
        kitti.read_odometry(file, 51)


def test_a_drive_without_an_outage_is_neither_right_nor_wrong():
    assert smartloc.is_right(np.array([20.0, 24.0, np.inf]), 25.0)
    assert smartloc.is_right(np.array([26.0]), 25.0) is False
    assert smartloc.is_right(np.empty(0), 25.0) is None


def test_units_are_the_files_of_the_folder(tmp_path):
    for name in ("truth/03.csv", "truth/09.csv", "odometry/slam-09.csv", "odometry/other-09.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("")
    assert kitti.units(tmp_path) == [
        ("03", "made", kitti.STARTS),
        ("09", "other-09", kitti.STARTS),
        ("09", "slam-09", kitti.STARTS),
    ]


@given(st.floats(0, 100), st.floats(1, 100), st.floats(0, 100), st.floats(0, 1000))
def test_outages_follow_each_other_and_end_in_time(first_s, length_s, pause_s, until_s):
    spans = Outages(first_s, length_s, pause_s).within(until_s)
    for begin, end in spans:
        assert end - begin == pytest.approx(length_s)
        assert first_s <= begin <= end <= until_s
    for before, after in itertools.pairwise(spans):
        assert after[0] - before[1] == pytest.approx(pause_s, abs=1e-9)
    assert (until_s >= first_s + length_s) == bool(spans)


def test_rows_in_outages_are_left_out():
    table = pd.DataFrame({"time_s": [0.0, 1.0, 2.0, 3.0, 4.0]})
    assert without(table, [(1.0, 3.0)])["time_s"].tolist() == [0.0, 1.0, 4.0]
    log = make_log(CRS, gnss=table.assign(east_m=455000.0, north_m=5.4e6))
    assert len(log_without(log, [(0.0, 10.0)]).gnss) == 1


def test_errors_at_the_ends_and_of_coasting():
    truth = _curve()
    known = Truth.of_table(truth)
    motion = kitti.perfect_motion(truth)
    assert coasted_errors_m(motion, known, [(8.0, 12.0), (10.0, 19.0)]) == pytest.approx(
        [0.0, 0.0], abs=0.05
    )
    longer = motion.assign(step_m=1.1 * motion["step_m"])
    (error_m,) = coasted_errors_m(longer, known, [(8.0, 12.0)])
    chord_m = np.hypot(
        *(truth[["east_m", "north_m"]].iloc[120] - truth[["east_m", "north_m"]].iloc[80])
    )
    assert error_m == pytest.approx(0.1 * chord_m, rel=0.2)


def _fix(time_s, east_m, north_m, radius_m):
    radii = np.array([radius_m / 4, radius_m / 2, radius_m])
    status = Status.TRACKING if np.isfinite(east_m) else Status.SEARCHING
    return Fix(time_s, east_m, north_m, np.eye(2), radii, status, 1, 1.0, 0, 0.0, Reason.USED)


def test_a_place_that_is_none_is_infinitely_far_off():
    truth = Truth(np.arange(10.0), np.zeros(10), np.zeros(10))
    fixes = [_fix(0.0, np.nan, np.nan, np.nan), _fix(2.0, 3.0, 4.0, 6.0), _fix(4.0, 3.0, 4.0, 4.0)]
    estimate = TrackEstimate.of_fixes(CRS, "bayes", fixes)
    errors_m, held = errors_at(estimate, truth, [1.0, 3.0, 9.0])
    assert errors_m.tolist() == [np.inf, 5.0, 5.0]
    assert held.tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("turned_rad", "scale", "expected"),
    [
        # 30 m off at the beginning, the direction right, and the length.
        (0.0, 1.0, {PLACE: 0.0, HEADING: 30.0, PLACE_HEADING: 0.0}),
        # A chord of 2 sin(0.1) of 100 m; with the true direction the first 30 m stay.
        (0.2, 1.0, {PLACE: 200 * np.sin(0.1), HEADING: 30.0, PLACE_HEADING: 0.0}),
        (0.0, 1.1, {PLACE: 10.0, HEADING: np.hypot(30, 10), PLACE_HEADING: 10.0}),
    ],
    ids=["place", "direction", "length"],
)
def test_an_error_after_an_outage_is_made_of_place_direction_and_length(
    turned_rad, scale, expected
):
    """100 m eastwards from 0 s to 100 s, by an estimate that begins 30 m too far north."""
    truth = Truth(np.arange(101.0), 5e5 + np.arange(101.0), np.full(101, 5e6))
    way_m = scale * np.arange(101.0)
    fixes = [
        _fix(t, 5e5 + gone * np.cos(turned_rad), 5e6 + 30 + gone * np.sin(turned_rad), 9.0)
        for t, gone in enumerate(way_m)
    ]
    estimate = TrackEstimate.of_fixes(CRS, "bayes", fixes)
    found = errors_from_true_begin(estimate, truth, [(0.0, 100.0)])
    assert {name: float(each[0]) for name, each in found.items()} == pytest.approx(
        expected, abs=1e-6
    )


def test_without_a_position_no_beginning_is_right():
    truth = Truth(np.arange(101.0), 5e5 + np.arange(101.0), np.full(101, 5e6))
    fixes = [_fix(20.0, np.nan, np.nan, np.nan), _fix(90.0, 5e5, 5e6, 9.0)]
    estimate = TrackEstimate.of_fixes(CRS, "bayes", fixes)
    found = errors_from_true_begin(estimate, truth, [(10.0, 95.0), (30.0, 95.0)])
    assert all(np.isinf(each).all() for each in found.values())


def test_least_squares_finds_a_place_and_leaves_out_three_satellites():
    place = ecef_from_lonlat(13.37, 52.5, 80.0)
    rng = np.random.default_rng(3)
    up = place / np.linalg.norm(place)
    rows = []
    for time_s, count in ((0.0, 7), (1.0, 3), (2.0, 5)):
        for number in range(count):
            aside = rng.standard_normal(3)
            satellite = 2.66e7 * (up + 0.6 * aside) / np.linalg.norm(up + 0.6 * aside)
            away_m = float(np.linalg.norm(satellite - place)) + 1234.5
            rows.append((time_s, f"G{number + 1:02d}", away_m, *satellite))
    columns = ["time_s", "satellite", "pseudorange_m", "x_m", "y_m", "z_m"]
    time_s, east, north = least_squares_positions(pd.DataFrame(rows, columns=columns), "EPSG:32633")
    true_east, true_north = project("EPSG:32633", [13.37], [52.5])
    assert time_s.tolist() == [0.0, 2.0]
    assert np.hypot(east - true_east[0], north - true_north[0]).max() < 1e-3


def test_errors_of_a_vehicle_take_the_headings_away():
    heading = np.array([np.nan, 3.1, -3.1, -3.0])
    motion = pd.DataFrame(
        {
            "time_s": [0.0, 1.0, 2.0, 3.0],
            "step_m": 10.0,
            "heading_rad": heading,
            "turn_rad": np.nan,
        }
    )
    moved = mountain_view.with_errors(motion, np.random.default_rng(0))
    assert moved["heading_rad"].isna().all()
    assert moved["step_m"].nunique() == 1
    assert abs(moved["step_m"].iloc[0] / 10 - 1) < 0.1
    assert np.abs(moved["turn_rad"].to_numpy() - [0.0, 0.0, 0.0832, 0.1]).max() < 0.02


def _track(places):
    """Epochs at 10 s, 11 s, …; NaN is no position."""
    fixes = [_fix(10.0 + i, east_m, 0.0, 3.0) for i, east_m in enumerate(places)]
    return TrackEstimate.of_fixes(CRS, "bayes", fixes)


def test_missing_positions_are_errors_and_not_covered():
    estimate = _track([1.0, np.nan, 9.0, 2.0, np.nan])
    truth = Truth(np.array([0.0, 13.5]), np.zeros(2), np.zeros(2))
    # The last epoch lies after the truth, so nobody knows; the first after 10 s is asked for.
    errors_m, held = errors_between(estimate, truth, 10.0, 20.0)
    assert errors_m.tolist() == [np.inf, 9.0, 2.0]
    assert held.tolist() == [False, False, True]


def test_before_the_first_epoch_there_is_no_position():
    truth = Truth(np.array([0.0, 20.0]), np.zeros(2), np.zeros(2))
    errors_m, held = errors_at(_track([1.0, 2.0]), truth, [5.0, 10.0, 12.0])
    assert errors_m.tolist() == [np.inf, 1.0, 2.0]
    assert held.tolist() == [False, True, True]


def test_what_lies_in_a_gap_of_the_truth_is_no_missing_position():
    """The truth is at 0, 10 and 50 s, and at 50 m from 10 s on: a gap of 100 m."""
    truth = Truth(np.array([0.0, 10.0, 50.0]), np.array([0.0, 50.0, 150.0]), np.zeros(3))
    estimate = _track([50.0, 51.0, np.nan])
    errors_m, _ = errors_between(estimate, truth, 9.0, 20.0)
    assert errors_m.tolist() == [0.0]
    # Asked for by its time, the way between is a straight line: 2.5 m each second.
    errors_m, _ = errors_at(estimate, truth, [11.0, 12.0])
    assert errors_m.tolist() == [1.5, np.inf]


@pytest.mark.parametrize(
    ("at_s", "east_m", "expected"),
    [(10.0, 60.0, (True, False)), (10.0, 101.0, (False, True)), (20.0, 900.0, (None, None))],
)
def test_a_claim_in_a_gap_of_the_truth_is_neither_right_nor_wrong(at_s, east_m, expected):
    truth = Truth(np.array([0.0, 10.0, 50.0]), np.array([0.0, 50.0, 150.0]), np.zeros(3))
    fix = replace(_fix(at_s, east_m, 0.0, 3.0), status=Status.CONVERGED)
    estimate = TrackEstimate.of_fixes(CRS, "bayes", [fix])
    for asked in (None, lambda claimed, wrong: claimed and not wrong):
        found = score_journey("part", "bayes", "unit", estimate, truth, asked=asked)
        assert (found.claimed, (found.success, found.wrong)) == (True, expected)
