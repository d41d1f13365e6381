"""Tables 2 and 3 of Khalaf-Allah (2007), stepped through by hand on a tiny map, for every option.

The map, in metres on a 5 m lattice (rows from the north, as the database orders them)::

    north 10   p0(0)  p1(5)                      cell A: all six points
    north  0   p2(0)  p3(5)  p4(10)  p5(15)      cell B: p4 and p5 only
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot, nan, pi

import numpy as np
import pytest
from belief_events import Event, run
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.errors import ConfigError
from mapfilter.filters.candidate import CandidateBelief, CandidateOptions, CandidateSearch, Mode
from mapfilter.filters.contract import MotionStep, Reason, Status

RNG = np.random.default_rng(0)
POINTS = [(0.0, 10.0), (5.0, 10.0), (0.0, 0.0), (5.0, 0.0), (10.0, 0.0), (15.0, 0.0)]
LITERAL = CandidateOptions(update_length_m=5.0, tracking_length_m=0.0, switch_check="next_call")


@dataclass(frozen=True)
class Points:
    """Nearest points by looking at all of them; of equal ones the last."""

    east_m: np.ndarray
    north_m: np.ndarray

    def nearest(self, east_m, north_m, max_distance_m):
        distance = np.hypot(
            np.asarray(east_m)[:, None] - self.east_m, np.asarray(north_m)[:, None] - self.north_m
        )
        last = distance.shape[1] - 1 - np.argmin(distance[:, ::-1], axis=1)
        best = distance[np.arange(len(last)), last]
        far = best > max_distance_m
        return np.where(far, -1, last), np.where(far, np.inf, best)


def points(pairs):
    array = np.array(pairs, dtype=float).reshape(-1, 2)
    return Points(array[:, 0], array[:, 1])


MAP = {"A": points(POINTS), "B": points(POINTS[4:]), "empty": points([])}


def build(options=LITERAL):
    return CandidateSearch(MAP.get, options)


def call(filter_, belief, step_m=6.0, heading_rad=0.0, cell="A"):
    """One call of the paper's algorithm: a motion, then a serving cell."""
    belief, _ = filter_.predict(belief, MotionStep(step_m, heading_rad), RNG)
    return filter_.update(belief, cell, RNG)


def held(belief):
    return sorted(zip(belief.east_m.tolist(), belief.north_m.tolist(), strict=True))


def test_starts_with_all_points_of_the_serving_cell():
    belief = build().init("A", RNG)
    assert held(belief) == sorted(POINTS)
    assert (belief.mode, belief.travelled_m) == (Mode.GLOBAL_POSITIONING, 0.0)


def test_six_metres_east_each_call_until_one_candidate_is_left():
    filter_ = build()
    belief = filter_.init("A", RNG)
    # p5 would be at 21 and p1 at (11, 10): 6 m from the nearest point, out. The rest stay, 1 m off.
    belief, info = call(filter_, belief)
    assert held(belief) == [(5, 0), (5, 10), (10, 0), (15, 0)]
    assert (info.status, info.hypotheses, info.reason) == (Status.SEARCHING, 4, Reason.USED)
    belief, _ = call(filter_, belief)
    assert held(belief) == [(10, 0), (15, 0)]
    belief, info = call(filter_, belief)
    assert held(belief) == [(15, 0)]
    assert info.status is Status.SEARCHING, "line 6 looks at n only at the next call"
    assert np.isnan(filter_.locate(belief).east_m), "no position before tracking (section 4.2)"
    belief, info = call(filter_, belief)
    assert info.status is Status.CONVERGED
    assert filter_.locate(belief).east_m == 15.0, "lines 21-24 give up this call's motion"


def test_update_waits_until_the_resolution_is_travelled():
    filter_ = build()
    belief = filter_.init("A", RNG)
    belief, info = call(filter_, belief, step_m=3.0)
    assert info.reason is Reason.NOT_MOVED_ENOUGH
    assert held(belief) == sorted(POINTS)
    assert belief.travelled_m == 3.0
    belief, info = call(filter_, belief, step_m=3.0)
    assert info.reason is Reason.USED
    assert held(belief) == [(5, 0), (5, 10), (10, 0), (15, 0)]
    assert belief.travelled_m == 0.0, "line 18"


def test_exactly_the_resolution_counts_on_both_sides_of_the_test():
    filter_ = build()
    belief, info = call(filter_, filter_.init("A", RNG), step_m=5.0)
    assert info.reason is Reason.USED, "line 8: >="
    # p5 moves to 20, exactly 5 m from p5: line 15 keeps it (<=), and the set merges it with p4.
    assert held(belief) == [(5, 0), (5, 10), (10, 0), (15, 0)]


@pytest.mark.parametrize(
    ("prediction", "expected"),
    [
        # 3 m north then 3 m east: the vector (3, 3) ...
        ("displacement", (5.0, 5.0)),
        # ... or, as line 10 prints it, 6 m along the last heading: (6, 0).
        ("last_heading", (5.0, 0.0)),
    ],
)
def test_travelled_distance_as_vector_or_along_the_last_heading(prediction, expected):
    square = points([(0, 0), (5, 0), (0, 5), (5, 5)])
    options = replace(LITERAL, prediction=prediction)
    filter_ = CandidateSearch({"A": square}.get, options)
    belief = CandidateBelief(Mode.GLOBAL_POSITIONING, np.array([0.0, 99]), np.array([0.0, 99]))
    belief, _ = call(filter_, belief, 3.0, pi / 2)
    belief, _ = call(filter_, belief, 3.0, 0.0)
    assert held(belief) == [expected]


def test_duplicates_become_one_in_a_set_and_stay_in_a_list():
    # 5 m east: p4 and p5 both match p5; p0 and p1 both match p1.
    a_set, _ = call(build(), build().init("A", RNG), 5.0)
    assert held(a_set) == [(5, 0), (5, 10), (10, 0), (15, 0)]
    listing = build(replace(LITERAL, duplicates="list"))
    a_list, info = call(listing, listing.init("A", RNG), 5.0)
    assert held(a_list) == [(5, 0), (5, 10), (5, 10), (10, 0), (15, 0), (15, 0)]
    assert info.hypotheses == 6


def test_mean_of_the_candidates_left_counts_duplicates_of_a_list():
    options = replace(LITERAL, duplicates="list", threshold=6, switch_check="next_call")
    filter_ = build(options)
    belief = CandidateBelief(
        Mode.GLOBAL_POSITIONING, np.array([0.0, 15.0, 15.0]), np.array([0.0, 0.0, 0.0])
    )
    belief, _ = call(filter_, belief)
    assert filter_.locate(belief).east_m == 10.0


def test_threshold_switches_to_the_mean_of_what_is_left():
    filter_ = build(replace(LITERAL, threshold=2))
    belief = filter_.init("A", RNG)
    for _ in range(2):
        belief, info = call(filter_, belief)
    assert held(belief) == [(10, 0), (15, 0)]
    belief, info = call(filter_, belief)
    assert (info.status, filter_.locate(belief).east_m) == (Status.CONVERGED, 12.5)


def test_exactly_at_the_threshold_it_switches_or_as_printed_stalls():
    filter_ = build(replace(LITERAL, at_threshold="stall"))
    belief = filter_.init("A", RNG)
    for _ in range(3):
        belief, _ = call(filter_, belief)
    for _ in range(4):
        belief, info = call(filter_, belief)
        assert (held(belief), info.status) == ([(15, 0)], Status.SEARCHING)
    stricter = build(replace(LITERAL, at_threshold="stall", threshold=2))
    _, info = stricter.update(replace(belief, travelled_m=0.0), "A", RNG)
    assert info.status is Status.CONVERGED, "1 < 2"


def test_switch_in_the_same_call_loses_no_motion():
    filter_ = build(replace(LITERAL, switch_check="same_call"))
    belief = filter_.init("A", RNG)
    statuses = []
    for _ in range(3):
        belief, info = call(filter_, belief)
        statuses.append(info.status)
    assert statuses == [Status.SEARCHING, Status.SEARCHING, Status.CONVERGED]
    assert filter_.locate(belief).east_m == 15.0


@pytest.mark.parametrize("option", ["fail", "reinitialise"])
def test_no_candidate_left_fails_or_starts_again(option):
    filter_ = build(replace(LITERAL, when_empty=option))
    belief, info = call(filter_, filter_.init("A", RNG), step_m=40.0)
    if option == "fail":
        assert (info.status, info.hypotheses) == (Status.LOST, 0)
        later, info = call(filter_, belief)
        assert (info.reason, later.mode) == (Reason.NO_CANDIDATES_LEFT, Mode.FAILED)
    else:
        assert (info.status, held(belief)) == (Status.SEARCHING, sorted(POINTS))


def test_candidates_are_matched_to_the_cell_that_serves_now():
    filter_ = build()
    belief, _ = call(filter_, filter_.init("A", RNG), cell="B")
    # Only p4 and p5 are B's: from p3 (11 → p4) and p4 (16 → p5); p2 at 6 is 4 m from p4 and stays.
    assert held(belief) == [(10, 0), (15, 0)]


def test_unknown_and_empty_cells_leave_the_belief_alone():
    filter_ = build()
    start = filter_.init("A", RNG)
    for cell, reason in (("X", Reason.UNKNOWN_CELL), ("empty", Reason.NO_POINTS_IN_CELL)):
        belief, info = filter_.update(start, cell, RNG)
        assert belief is start
        assert info.reason is reason


def test_tracking_matches_to_the_nearest_point_however_far():
    filter_ = build()
    belief = CandidateBelief(Mode.POSITION_TRACKING, np.array([15.0]), np.array([0.0]))
    belief, info = call(filter_, belief, 100.0)
    assert (held(belief), info.status) == ([(15, 0)], Status.TRACKING)


def test_tracking_at_every_step_freezes_on_the_lattice_as_printed():
    """1.4 m snap back to the point they came from; the update length mends it."""
    literal, longer = build(), build(replace(LITERAL, tracking_length_m=None))
    a = b = CandidateBelief(Mode.POSITION_TRACKING, np.array([0.0]), np.array([0.0]))
    for _ in range(8):
        a, _ = call(literal, a, 1.4)
        b, _ = call(longer, b, 1.4)
    assert held(a) == [(0, 0)]
    assert held(b) == [(10, 0)], "two updates of 5.6 m"
    assert literal.locate(a).east_m == 0.0


def test_between_updates_the_position_moves_with_dead_reckoning():
    filter_ = build(replace(LITERAL, tracking_length_m=5.0))
    belief = CandidateBelief(Mode.POSITION_TRACKING, np.array([5.0]), np.array([0.0]))
    belief, info = call(filter_, belief, 3.0, pi / 2)
    assert info.reason is Reason.NOT_MOVED_ENOUGH
    located = filter_.locate(belief)
    assert (located.east_m, located.north_m) == (pytest.approx(5.0), pytest.approx(3.0))


def test_ties_take_the_last_point_and_a_hit_matches_exactly():
    filter_ = build()
    belief = CandidateBelief(Mode.POSITION_TRACKING, np.array([2.5]), np.array([0.0]))
    hit = CandidateBelief(Mode.POSITION_TRACKING, np.array([4.0]), np.array([0.0]))
    tied, _ = filter_.update(replace(belief, travelled_m=5.0), "A", RNG)
    exact, _ = call(filter_, hit, 1.0)
    assert held(tied) == [(5, 0)]
    assert held(exact) == [(5, 0)]


def test_missing_step_or_heading_is_told_and_changes_nothing():
    filter_ = build()
    start = filter_.init("A", RNG)
    assert filter_.predict(start, MotionStep(nan, 0.0), RNG) == (start, Reason.NO_STEP)
    assert filter_.predict(start, MotionStep(1.0, nan), RNG) == (start, Reason.NO_HEADING)


def test_negative_noisy_step_counts_as_distance_and_moves_back():
    belief, _ = build().predict(build().init("A", RNG), MotionStep(-2.0, 0.0), RNG)
    assert (belief.travelled_m, belief.shift_east_m) == (2.0, -2.0)


@pytest.mark.parametrize("prediction", ["displacement", "last_heading"])
def test_standing_still_changes_nothing(prediction):
    filter_ = build(replace(LITERAL, update_length_m=0.0, prediction=prediction))
    start = filter_.init("A", RNG)
    belief, info = call(filter_, start, 0.0)
    assert held(belief) == held(start)
    assert info.reason is Reason.USED
    belief, _ = filter_.update(start, "A", RNG)
    assert held(belief) == held(start)


@pytest.mark.parametrize("prediction", ["displacement", "last_heading"])
def test_tracking_moves_by_signed_steps_whatever_the_prediction(prediction):
    """Table 3, line 4: a noisy step below zero goes back; noise about zero goes nowhere."""
    filter_ = build(replace(LITERAL, prediction=prediction, tracking_length_m=6.0))
    belief = CandidateBelief(Mode.POSITION_TRACKING, np.array([10.0]), np.array([0.0]))
    back, _ = call(filter_, belief, -6.0)
    assert held(back) == [(5, 0)], "10 - 6 = 4, and p3 is 1 m off"
    still = belief
    for step_m in (0.5, -0.5) * 6:
        still, info = call(filter_, still, step_m)
    assert info.reason is Reason.USED
    assert held(still) == [(10, 0)], "the steps sum to zero, their lengths to 6 m"


def test_literal_tracking_matches_at_every_call_also_standing():
    filter_ = build(replace(LITERAL, threshold=2))
    belief = filter_.init("A", RNG)
    for _ in range(3):
        belief, info = call(filter_, belief)
    assert (info.status, filter_.locate(belief).east_m) == (Status.CONVERGED, 12.5)
    belief, _ = filter_.update(belief, "A", RNG)
    assert held(belief) == [(15, 0)], "the mean of two points is no point; of equals the last"


def test_bad_options_are_told_together():
    with pytest.raises(ConfigError) as caught:
        CandidateOptions(tracking_length_m=-1, update_length_m=nan, threshold=0)
    assert len(caught.value.faults) == 3


# An oracle: Table 2 transcribed line by line, with weights 1/distance and an actual sort.


def table_2(cells, calls, alpha, resolution):
    """Return the candidates after every call, as the paper's pseudo-code does it."""
    belief, travelled, mode, told = list(cells[calls[0][2]]), 0.0, 0, []
    for trans, theta, cell in calls:
        database = cells[cell]
        if mode == 0 and len(belief) > alpha:
            travelled += hypot(trans * np.cos(theta), trans * np.sin(theta))
            if travelled >= resolution:
                new = []
                for x, y in belief:
                    xp, yp = x + travelled * np.cos(theta), y + travelled * np.sin(theta)
                    weight = [
                        np.inf if (d := hypot(xp - xj, yp - yj)) == 0 else 1 / d
                        for xj, yj in database
                    ]
                    q = sorted(range(len(database)), key=lambda j, w=weight: w[j])[-1]
                    if (0.0 if weight[q] == np.inf else 1 / weight[q]) <= resolution:
                        new.append(database[q])
                belief, travelled = [p for p in database if p in new], 0.0
        elif mode == 0 and 0 < len(belief) <= alpha:
            mode = 1
            belief = [tuple(np.mean(belief, axis=0))]
        told.append(sorted(belief))
    return told


@st.composite
def worlds(draw):
    grid = [(5.0 * x, 5.0 * y) for y in range(5, -1, -1) for x in range(6)]
    cells = {
        name: [p for p in grid if draw(st.integers(0, 9)) < 7] or grid[:1] for name in ("A", "B")
    }
    # Odd lengths keep distances away from exact ties, where rounding decides.
    step = st.integers(100, 900).map(lambda n: n / 100 + 0.0037)
    calls = draw(
        st.lists(
            st.tuples(step, st.floats(-3.1, 3.1), st.sampled_from(["A", "B"])),
            min_size=1,
            max_size=8,
        )
    )
    return cells, calls


@given(worlds())
def test_equals_the_pseudo_code_line_by_line(world):
    cells, calls = world
    maps = {name: points(pairs) for name, pairs in cells.items()}
    options = replace(LITERAL, prediction="last_heading")
    filter_ = CandidateSearch(maps.get, options)
    events = [
        Event(float(i), MotionStep(trans, theta), cell)
        for i, (trans, theta, cell) in enumerate(calls)
    ]
    expected = table_2(cells, calls, options.threshold, filter_.resolution_m)
    belief = filter_.init(calls[0][2], RNG)
    for told, taken in zip(expected, run(filter_, belief, events, RNG), strict=True):
        if taken.belief.mode is Mode.POSITION_TRACKING:
            break
        assert held(taken.belief) == told


@given(worlds())
def test_candidates_are_always_distinct_points_of_some_cell_and_never_grow(world):
    cells, calls = world
    maps = {name: points(pairs) for name, pairs in cells.items()}
    filter_ = CandidateSearch(maps.get, LITERAL)
    everywhere = {p for pairs in cells.values() for p in pairs}
    belief = filter_.init(calls[0][2], RNG)
    for trans, theta, cell in calls:
        before = belief
        copies = before.east_m.copy(), before.north_m.copy()
        belief, _ = call(filter_, belief, trans, theta, cell)
        assert np.array_equal(before.east_m, copies[0])
        assert np.array_equal(before.north_m, copies[1])
        assert belief.east_m.size <= before.east_m.size
        if belief.mode is Mode.GLOBAL_POSITIONING:
            now = held(belief)
            assert set(now) <= everywhere
            assert len(set(now)) == len(now)
