"""The candidate filter over a real database: a walk on a cross of streets, and what goes wrong."""

from dataclasses import fields, replace
from math import inf, isnan, nan

import numpy as np
import pandas as pd
import pytest
from cross_world import (
    CROSSING,
    EAST,
    LATTICE,
    NORTH,
    WAY_EAST_WEST,
    WAY_NORTH_SOUTH,
    make_database,
    walk_log,
    walk_tables,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from mapfilter.errors import InputError
from mapfilter.evaluation.accuracy import accuracy, position_errors_m
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.candidate import CandidateSearch, Mode
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning import loop
from mapfilter.positioning.candidate import CandidateFilter, cell_points
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.estimate_store import write_estimate
from mapfilter.positioning.merging import epochs
from mapfilter.positioning.step_output import UnusedReading
from mapfilter.tracks.log import make_log

# 16 steps of 1.25 m: every match lands on a lattice point, so the walk is followed exactly.
OPTIONS = CandidateFilter(update_length_m=20.0)
S, C, T, L = Status.SEARCHING, Status.CONVERGED, Status.TRACKING, Status.LOST


@pytest.fixture(scope="module")
def cross_database(tmp_path_factory):
    return make_database(tmp_path_factory.mktemp("cross"))


@pytest.fixture(scope="module")
def cross_points(cross_database):
    return cell_points(cross_database)


@pytest.fixture(scope="module")
def locate(cross_database):
    def located(log, options=OPTIONS):
        rng = np.random.default_rng(0)
        return loop.locate(log, options.over(cross_database), rng, snapshots=True)

    return located


def truth_of(log):
    return Truth(*(log.truth[name].to_numpy() for name in ("time_s", "east_m", "north_m")))


def reasons(track, kind):
    return [(u.time_s, u.what, u.reason) for u in track.estimate.unused if u.kind == kind]


def test_points_of_a_cell_are_read_once_and_follow_the_margin(cross_database, cross_points):
    counts = {cell: len(cross_points(cell)) for cell in cross_database.cell_ids}
    # Within 6 dB of the best means 60 m of difference in distance: the cells overlap.
    assert counts["W"] + counts["E"] > len(cross_database.points()) == 121
    assert counts["NW"] == 0
    assert cross_points("W") is cross_points("W")
    assert cross_points("no such cell") is None
    best = cell_points(cross_database, 0.0)
    assert len(best("W")) + len(best("E")) == 121
    assert len(cell_points(cross_database, inf)("E")) == 121
    with pytest.raises(InputError, match="margin_db"):
        cell_points(cross_database, -1.0)("W")


def test_the_turn_at_the_crossing_tells_where_one_is(locate):
    log = walk_log()
    track = locate(log)
    estimate = track.estimate
    # After 90 m east and 10 m north only the crossing fits: the fifth update, at 100 m.
    assert estimate.time_s[estimate.converged_at] == 80.0
    score = accuracy(estimate, truth_of(log))
    assert (score.switch_distance_m, score.success) == (pytest.approx(100.0), True)
    errors = position_errors_m(estimate, truth_of(log))
    assert np.isnan(errors[:80]).all()
    assert errors[80:] == pytest.approx(0.0, abs=1e-6)
    assert estimate.status == (*[S] * 80, C, *[T] * (len(estimate) - 81))
    assert estimate.unused == ()
    assert (estimate.crs, estimate.filter, estimate.start_utc_s) == (log.crs, "candidate", 1.7e9)


def test_each_position_is_matched_to_the_way_it_is_on(locate):
    estimate = locate(walk_log()).estimate
    assert set(estimate.way_id[:80]) == {0}, "no position, no way"
    north = estimate.north_m > CROSSING[1] + 5
    assert set(estimate.way_id[80:][north[80:]]) == {WAY_NORTH_SOUTH}
    east = estimate.east_m > CROSSING[0] + 5
    assert east[-150:].all()
    assert set(estimate.way_id[-150:]) == {WAY_EAST_WEST}


def test_snapshots_run_forward_and_hold_ever_fewer_candidates(locate):
    track = locate(walk_log())
    counts = [s.hypothesis_east_m.size for s in track.snapshots]
    assert counts == sorted(counts, reverse=True)
    assert len(counts) == len(set(counts)) > 3
    assert counts[0] == 92
    assert counts[-1] == 1
    times = [s.time_s for s in track.snapshots]
    assert times == sorted(times)
    assert [s.travelled_m for s in track.snapshots] == [pytest.approx(1.25 * t) for t in times]
    assert [s.status for s in track.snapshots] == [*[S] * (len(counts) - 1), C]
    for snapshot in track.snapshots:
        assert snapshot.weight.sum() == pytest.approx(1.0)
        assert snapshot.weight.size == snapshot.hypothesis_east_m.size
        assert isnan(snapshot.east_m) == (snapshot.status is S)
    last = track.snapshots[-1]
    assert (last.east_m, last.north_m) == (last.hypothesis_east_m[0], last.hypothesis_north_m[0])


def assert_same_track(a, b, upto=None):
    for column in fields(TrackEstimate):
        if column.name == "unused":
            continue
        x, y = getattr(a, column.name), getattr(b, column.name)
        x = x[:upto] if isinstance(x, tuple | np.ndarray) else x
        if isinstance(x, np.ndarray):
            assert np.array_equal(x, y, equal_nan=True), column.name
        else:
            assert x == y, column.name


def cut(log, end_s):
    tables = {name: getattr(log, name) for name in ("motion", "radio", "truth")}
    kept = {name: table[table["time_s"] <= end_s] for name, table in tables.items()}
    return make_log(log.crs, **kept, start_utc_s=log.start_utc_s)


@pytest.mark.parametrize("end_s", [0.0, 15.0, 79.0, 80.0, 81.0, 200.0])
def test_what_comes_later_changes_nothing_earlier(locate, end_s):
    log = walk_log()
    whole, part = locate(log).estimate, locate(cut(log, end_s)).estimate
    assert len(part) == end_s + 1
    assert_same_track(whole, part, len(part))


def assert_same_belief(a, b):
    for column in fields(a):
        x, y = getattr(a, column.name), getattr(b, column.name)
        assert np.array_equal(x, y, equal_nan=True), column.name


def test_a_live_stream_gives_the_same_as_a_replay(locate, cross_database, cross_points):
    log = walk_log()
    tracker, search = OPTIONS.over(cross_database), CandidateSearch(cross_points, OPTIONS)
    state, rng = tracker.begin(), np.random.default_rng(0)
    belief = search.init("W", rng)
    estimate = locate(log).estimate
    for index, epoch in enumerate(epochs(log)):
        state, output = tracker.step(state, epoch, rng)
        assert np.array_equal(
            [output.fix.east_m, output.fix.north_m],
            [estimate.east_m[index], estimate.north_m[index]],
            equal_nan=True,
        )
        assert (output.fix.status, output.fix.reason) == (
            estimate.status[index],
            estimate.reason[index],
        )
        for motion in epoch.motion:
            belief, _ = search.predict(belief, motion, rng)
        for row in epoch.radio:
            belief, _ = search.update(belief, row.cell, rng)
        assert_same_belief(state.belief, belief)


def test_the_same_input_gives_the_same_bytes(locate, cross_database, tmp_path):
    for name in "ab":
        rng = np.random.default_rng(ord(name))
        track = loop.locate(walk_log(), OPTIONS.over(cross_database), rng)
        write_estimate(track.estimate, tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    write_estimate(
        locate(walk_log(), replace(OPTIONS, update_length_m=10)).estimate, tmp_path / "c"
    )
    assert (tmp_path / "a").read_bytes() != (tmp_path / "c").read_bytes()


def with_cells(changes):
    """The walk, with other serving cells at some seconds; None leaves the report out."""
    radio = walk_tables()["radio"]
    for time_s, cell in changes.items():
        radio.loc[radio["time_s"] == time_s, "cell"] = cell
    return walk_log(radio=radio[radio["cell"] != "left out"])


def test_cells_that_do_not_help_before_the_start_are_labelled_one_by_one(locate):
    track = locate(with_cells({0.0: "foreign", 1.0: "NW", 2.0: None, 3.0: "left out"}))
    assert reasons(track, "serving") == [
        (0.0, "foreign", Reason.UNKNOWN_CELL),
        (1.0, "NW", Reason.NO_POINTS_IN_CELL),
        (2.0, "", Reason.NO_SERVING_CELL),
    ]
    # All candidates are where they are at the first report that helps; that motion is past.
    assert reasons(track, "motion") == [(t, "", Reason.NOT_STARTED) for t in (1.0, 2, 3, 4)]
    estimate = track.estimate
    assert estimate.reason[:4] == (
        Reason.UNKNOWN_CELL, Reason.NO_POINTS_IN_CELL, Reason.NO_SERVING_CELL, Reason.NO_READING,
    )  # fmt: skip
    assert estimate.status[:5] == (S,) * 5
    assert estimate.hypotheses[:5].tolist() == [0, 0, 0, 0, 92]
    assert estimate.time_s[estimate.converged_at] == 84.0, "20 m updates count from the start"
    assert track.snapshots[0].time_s == 4.0
    assert track.snapshots[-1].travelled_m == pytest.approx(100.0)


def test_unknown_cells_on_the_way_are_labelled_and_passed(locate):
    log = with_cells({40.0: "foreign", 41.0: "NW", 100.0: "foreign", 201.0: "foreign"})
    track = locate(log)
    assert reasons(track, "serving") == [
        (40.0, "foreign", Reason.UNKNOWN_CELL),
        (41.0, "NW", Reason.NO_POINTS_IN_CELL),
        (100.0, "foreign", Reason.UNKNOWN_CELL),
        (201.0, "foreign", Reason.UNKNOWN_CELL),
    ]
    assert reasons(track, "motion") == []
    errors = position_errors_m(track.estimate, truth_of(log))
    assert errors[80:] == pytest.approx(0.0, abs=1e-6)


def test_no_known_cell_at_all_stays_searching(locate):
    track = locate(with_cells({float(t): "foreign" for t in range(400)}))
    count = len(track.estimate)
    assert track.estimate.status == (S,) * count
    assert len(reasons(track, "serving")) == count
    assert len(reasons(track, "motion")) == count - 1
    assert track.snapshots == ()


def test_reports_that_stop_for_a_while_are_bridged_by_dead_reckoning(locate):
    log = with_cells({float(t): "left out" for t in range(130, 170)})
    track = locate(log)
    estimate = track.estimate
    assert len(estimate) == len(log.truth)
    assert estimate.reason[130:170] == (Reason.NO_READING,) * 40
    assert estimate.status[130:] == (T,) * (len(estimate) - 130)
    errors = position_errors_m(estimate, truth_of(log))
    assert errors[80:170] == pytest.approx(0.0, abs=1e-6)
    # Then it is matched after 52.5 m, off the lattice: half a pixel is lost in each direction.
    assert errors[170] == pytest.approx(2.5)
    assert errors[170:].max() < 6


def test_a_report_that_fails_right_after_the_switch_leaves_it_tracking(locate):
    estimate = locate(with_cells({81.0: "left out", 82.0: "left out"})).estimate
    assert estimate.status[79:84] == (S, C, T, T, T)


def test_steps_and_headings_that_are_missing_are_told(locate):
    motion = walk_tables()["motion"]
    motion.loc[motion["time_s"] == 100.0, "step_m"] = nan
    motion.loc[motion["time_s"] == 120.0, "heading_rad"] = nan
    log = walk_log(motion=motion)
    track = locate(log)
    assert reasons(track, "motion") == [(100.0, "", Reason.NO_STEP), (120.0, "", Reason.NO_HEADING)]
    errors = position_errors_m(track.estimate, truth_of(log))
    assert np.nanmax(errors) < 15
    assert errors[99] == pytest.approx(0.0, abs=1e-6)
    assert errors[100] == pytest.approx(1.25, abs=1e-6), "a step that nobody counted"


def test_motion_that_is_missing_for_a_while_loses_what_was_walked(locate):
    motion = walk_tables()["motion"]
    gap = motion["time_s"].between(10.0, 12.0)
    log = walk_log(motion=motion[~gap])
    estimate = locate(log).estimate
    assert len(estimate) == len(log.truth)
    score = accuracy(estimate, truth_of(log))
    assert score.success
    assert score.error_mean_m < 15


def test_no_motion_leaves_all_candidates(locate):
    track = locate(walk_log(motion=None))
    estimate = track.estimate
    assert set(estimate.status) == {S}
    assert set(estimate.hypotheses) == {92}
    assert set(estimate.reason) == {Reason.NOT_MOVED_ENOUGH}
    assert np.isnan(estimate.east_m).all()
    assert estimate.unused == ()
    assert len(track.snapshots) == 1


def test_no_radio_leaves_nothing_to_start_from(locate):
    track = locate(walk_log(radio=None))
    assert set(track.estimate.status) == {S}
    assert set(track.estimate.hypotheses) == {0}
    assert len(reasons(track, "motion")) == len(track.estimate) == len(walk_tables()["motion"])
    assert {reason for *_, reason in reasons(track, "motion")} == {Reason.NOT_STARTED}


def test_an_empty_log_gives_an_empty_track(locate, tmp_path):
    track = locate(make_log("EPSG:32629"))
    assert len(track.estimate) == 0
    assert (track.snapshots, track.estimate.unused) == ((), ())
    write_estimate(track.estimate, tmp_path / "empty.parquet")


def test_a_jump_off_the_map_loses_the_way_and_says_so(locate):
    motion = walk_tables()["motion"]
    motion.loc[motion["time_s"] == 40.0, "step_m"] = 5_000.0
    track = locate(walk_log(motion=motion))
    estimate = track.estimate
    assert estimate.status == (*[S] * 40, *[L] * (len(estimate) - 40))
    assert np.isnan(estimate.east_m).all()
    assert set(estimate.hypotheses[40:]) == {0}
    assert [t for t, *_ in reasons(track, "serving")] == list(range(41, len(estimate)))
    assert {r for *_, r in reasons(track, "serving")} == {Reason.NO_CANDIDATES_LEFT}
    last = track.snapshots[-1]
    assert (last.time_s, last.status, last.weight.size) == (40.0, L, 0)


def test_a_jump_off_the_map_starts_again_when_asked_to(locate):
    motion = walk_tables()["motion"]
    motion.loc[motion["time_s"] == 40.0, "step_m"] = 5_000.0
    log = walk_log(motion=motion)
    estimate = locate(log, replace(OPTIONS, when_empty="reinitialise")).estimate
    assert L not in estimate.status
    assert estimate.hypotheses[40] == 92
    assert accuracy(estimate, truth_of(log)).success


def test_a_cell_of_one_point_is_a_position_at_once(cross_database):
    class One:
        east_m, north_m = (np.array([value]) for value in LATTICE.east_north(30, 6))

        def __len__(self):
            return 1

        def nearest(self, east_m, north_m, _max_m):
            zeros = np.zeros(np.size(east_m), dtype=int)
            return zeros, np.hypot(east_m - self.east_m, north_m - self.north_m)

    log = walk_log(((EAST, 12.5), (NORTH, 10.0)))
    rng = np.random.default_rng(0)
    tracker = OPTIONS.over(cross_database)
    one = replace(tracker, filter=CandidateSearch(lambda _: One(), OPTIONS))
    track = loop.locate(log, one, rng, snapshots=True)
    assert track.estimate.status[:3] == (C, T, T)
    assert [s.status for s in track.snapshots] == [C]


def test_a_log_in_another_system_is_refused(locate):
    log = make_log("EPSG:32630", **walk_tables())
    with pytest.raises(InputError) as caught:
        locate(log)
    (fault,) = caught.value.faults
    assert (fault.where, fault.expected, fault.got) == ("log, crs", "EPSG:32629", "EPSG:32630")


def test_a_log_in_the_same_system_of_another_name_is_taken(locate):
    import pyproj

    log = replace(walk_log(), crs=pyproj.CRS("EPSG:32629").to_wkt())
    estimate = locate(log).estimate
    assert estimate.crs == "EPSG:32629"
    assert estimate.converged_at == 80


def test_what_is_not_used_comes_by_time_with_neighbours_and_fixes_told_once(locate):
    radio = walk_tables()["radio"]
    more = pd.DataFrame(
        [(0.0, "neighbour", None), (30.0, "serving", "E"), (30.0, "neighbour", "E")],
        columns=radio.columns,
    )
    fixes = pd.DataFrame({"time_s": [20.0], "east_m": 531_100.0, "north_m": 4_555_900.0})
    unused = locate(walk_log(radio=pd.concat([radio, more]), gnss=fixes)).estimate.unused
    assert unused == (
        UnusedReading(0.0, "neighbour", "", Reason.NOT_USED_BY_FILTER, 2),
        UnusedReading(20.0, "gnss", "", Reason.NOT_USED_BY_FILTER, 1),
        UnusedReading(30.0, "serving", "E", Reason.SECOND_SERVING_CELL),
    )


HEADINGS = st.floats(-3.2, 3.2)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.floats(0, 30) | st.just(nan), HEADINGS | st.just(nan),
            st.sampled_from(["W", "E", "NW", "foreign", None]),
        ),
        max_size=25,
    ),
    st.sampled_from(["fail", "reinitialise"]),
)  # fmt: skip
def test_whatever_comes_every_reading_is_used_or_told(locate, rows, when_empty):
    times = np.arange(len(rows), dtype=float)
    motion = pd.DataFrame(
        {"time_s": times, "step_m": [r[0] for r in rows], "heading_rad": [r[1] for r in rows]}
    )
    radio = pd.DataFrame({"time_s": times, "role": "serving", "cell": [r[2] for r in rows]})
    log = make_log("EPSG:32629", motion=motion.astype(float), radio=radio)
    track = locate(log, replace(OPTIONS, when_empty=when_empty))
    estimate = track.estimate
    assert len(estimate) == len(rows)
    told = {(u.time_s, u.kind) for u in estimate.unused}
    assert len(told) == len(estimate.unused)
    for time_s, cell, reason in zip(times, radio["cell"], estimate.reason, strict=True):
        used = reason in (Reason.USED, Reason.NOT_MOVED_ENOUGH)
        assert ((time_s, "serving") in told) == (not used)
        if cell in ("foreign", "NW"):
            assert not used
    located = np.isfinite(estimate.east_m)
    assert [s in (C, T) for s in estimate.status] == located.tolist()
    assert (estimate.way_id[located] > 0).all()
    assert estimate.status.count(C) <= 1


def test_the_filter_is_in_tracking_mode_when_the_track_says_so(cross_database):
    tracker, rng = OPTIONS.over(cross_database), np.random.default_rng(0)
    state, modes = tracker.begin(), []
    for epoch in epochs(walk_log()):
        state, _ = tracker.step(state, epoch, rng)
        modes.append(state.belief.mode)
    assert modes[79:81] == [Mode.GLOBAL_POSITIONING, Mode.POSITION_TRACKING]
