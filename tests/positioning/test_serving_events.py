"""A log's tables merged into one stream: order, what is used and what is told."""

from math import nan

import numpy as np
import pandas as pd
import pytest
from cross_world import CRS
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.epochs import serving_events
from mapfilter.positioning.estimate import UnusedReading
from mapfilter.testing import Event
from mapfilter.tracks.log import make_log


def motion(*rows):
    return pd.DataFrame(rows, columns=["time_s", "step_m", "heading_rad", "turn_rad"], dtype=float)


def radio(*rows):
    return pd.DataFrame(rows, columns=["time_s", "role", "cell"])


def merged(**tables):
    return serving_events(make_log(CRS, **tables))


def test_motion_and_report_of_one_time_are_one_event_and_others_keep_their_own():
    found = merged(
        motion=motion((1, 1.5, 0.25, 0.1), (2, 1.25, -0.5, 0), (4, 2, 1, 0)),
        radio=radio((0.5, "serving", "A"), (2, "serving", "B"), (3, "serving", "A")),
    )
    assert found.unused == ()
    assert found.events == (
        Event(0.5, None, "A"),
        Event(1.0, MotionStep(1.5, 0.25, 0.1), None),
        Event(2.0, MotionStep(1.25, -0.5, 0.0), "B"),
        Event(3.0, None, "A"),
        Event(4.0, MotionStep(2.0, 1.0, 0.0), None),
    )


def test_of_several_motions_at_one_time_the_last_carries_the_report():
    found = merged(
        motion=motion((1, 1.0, 0, 0), (1, 2.0, 0, 0), (1, 3.0, 0, 0)),
        radio=radio((1, "serving", "A")),
    )
    assert [(e.motion.step_m, e.reading) for e in found.events] == [
        (1.0, None), (2.0, None), (3.0, "A"),
    ]  # fmt: skip


def test_a_second_serving_cell_is_told_and_the_first_is_used():
    found = merged(radio=radio((1, "serving", "A"), (1, "serving", "B"), (2, "serving", "B")))
    assert [(e.time_s, e.reading) for e in found.events] == [(1.0, "A"), (2.0, "B")]
    assert found.unused == (UnusedReading(1.0, "serving", "B", Reason.SECOND_SERVING_CELL),)


def test_reports_without_a_serving_cell_are_told_and_make_no_event():
    found = merged(
        motion=motion((1, 1.0, 0, 0)),
        radio=radio((1, "serving", None), (2, "neighbour", "N"), (3, "serving", None)),
    )
    assert found.events == (Event(1.0, MotionStep(1.0, 0.0, 0.0), None),)
    assert [(u.time_s, u.kind, u.reason) for u in found.unused] == [
        (1.0, "serving", Reason.NO_SERVING_CELL),
        (2.0, "serving", Reason.NO_SERVING_CELL),
        (3.0, "serving", Reason.NO_SERVING_CELL),
        (2.0, "neighbour", Reason.NOT_USED_BY_FILTER),
    ]


def test_a_named_serving_cell_beside_an_unnamed_one_is_used():
    found = merged(radio=radio((1, "serving", None), (1, "serving", "A")))
    assert [e.reading for e in found.events] == ["A"]
    assert found.unused == ()


def test_neighbours_and_fixes_are_told_once_with_their_number():
    fixes = pd.DataFrame({"time_s": [4.0, 5.0, 6.0], "east_m": 5.3e5, "north_m": 4.5e6})
    found = merged(
        radio=radio((1, "serving", "A"), (1, "neighbour", None), (2, "neighbour", "A"),
                    (2, "serving", "A")),
        gnss=fixes,
    )  # fmt: skip
    assert [e.time_s for e in found.events] == [1.0, 2.0]
    assert found.unused == (
        UnusedReading(1.0, "neighbour", "2 rows", Reason.NOT_USED_BY_FILTER),
        UnusedReading(4.0, "gnss", "3 rows", Reason.NOT_USED_BY_FILTER),
    )


def test_missing_steps_and_headings_stay_in_the_stream():
    (event,) = merged(motion=motion((1, nan, nan, nan))).events
    assert np.isnan([event.motion.step_m, event.motion.heading_rad, event.motion.turn_rad]).all()


def test_an_empty_log_has_no_events():
    assert merged() == serving_events(make_log(CRS, radio=radio()))
    assert merged().events == ()
    assert merged().unused == ()


TIMES = st.sampled_from([0.0, 0.48, 0.96, 1.0, 2.0])


@given(
    st.lists(st.tuples(TIMES, st.floats(0, 3), st.floats(-3, 3)), max_size=12, unique=True),
    st.lists(
        st.tuples(TIMES, st.sampled_from(["serving", "neighbour"]), st.sampled_from("AB")),
        max_size=12,
        unique=True,
    ),
)
def test_every_row_is_an_event_or_is_told(moves, reports):
    found = merged(
        motion=motion(*((t, s, h, 0.0) for t, s, h in moves)),
        radio=radio(*reports).astype({"time_s": float}),
    )
    times = [event.time_s for event in found.events]
    assert times == sorted(times)
    told = [event.motion.step_m for event in found.events if event.motion is not None]
    assert told == [s for _, s, _ in sorted(moves, key=lambda move: move[0])]
    used = [event for event in found.events if event.reading is not None]
    second = [u for u in found.unused if u.reason is Reason.SECOND_SERVING_CELL]
    assert len(used) + len(second) == sum(role == "serving" for _, role, _ in reports)
    assert len({event.time_s for event in used}) == len(used)
    nothing = {u.time_s for u in found.unused if u.reason is Reason.NO_SERVING_CELL}
    assert nothing == {t for t, _, _ in reports} - {event.time_s for event in used}


@pytest.mark.parametrize("seed", range(3))
def test_the_order_of_the_rows_in_the_file_does_not_matter(seed):
    rng = np.random.default_rng(seed)
    moves = motion(*((t, 1.0 + t, 0.0, 0.0) for t in range(6)))
    reports = radio(*((float(t), "serving", "AB"[t % 2]) for t in range(6)))
    shuffled = merged(motion=moves.iloc[rng.permutation(6)], radio=reports.iloc[rng.permutation(6)])
    assert shuffled == merged(motion=moves, radio=reports)
