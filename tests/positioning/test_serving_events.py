"""What of a log reaches a filter of serving cells: order, what is used and what is labelled."""
# ruff: noqa: ARG002

from dataclasses import dataclass, field
from math import nan
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from cross_world import CRS
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.filters.contract import Estimate, MotionStep, Reason, Status, UpdateInfo
from mapfilter.positioning.belief_tracker import BeliefTracker
from mapfilter.positioning.epochs import serving_cell
from mapfilter.positioning.loop import locate
from mapfilter.positioning.step_output import UnusedReading
from mapfilter.tracks.log import make_log

NOWHERE = Estimate(0.0, 0.0, np.zeros((2, 2)), np.zeros(3))


@dataclass
class Recording:
    """Writes down what it is given."""

    prior: list = field(default_factory=list)
    events: list = field(default_factory=list)

    def init(self, prior, rng):
        self.prior.append(prior)
        return 0

    def predict(self, belief, motion, rng):
        self.events.append(motion)
        return belief, Reason.USED

    def update(self, belief, reading, rng):
        self.events.append(reading)
        return belief, UpdateInfo(Reason.USED, Status.SEARCHING, 1)

    def locate(self, belief):
        return NOWHERE


def motion(*rows):
    return pd.DataFrame(rows, columns=["time_s", "step_m", "heading_rad", "turn_rad"], dtype=float)


def radio(*rows):
    return pd.DataFrame(rows, columns=["time_s", "role", "cell"])


def merged(**tables):
    """Return what reached the filter, and the estimate."""
    recording = Recording()
    database = SimpleNamespace(lattice=SimpleNamespace(crs=CRS))
    tracker = BeliefTracker(
        recording,
        database,
        lambda _: Reason.USED,
        serving_cell,
        "recording",
        takes=("motion", "serving"),
        ways=False,
    )
    log = make_log(CRS, **tables)
    return recording, locate(log, tracker, np.random.default_rng(0)).estimate


def test_one_moves_first_and_measures_then():
    found, estimate = merged(
        motion=motion((1, 1.5, 0.25, 0.1), (2, 1.25, -0.5, 0), (4, 2, 1, 0)),
        radio=radio((0.5, "serving", "A"), (2, "serving", "B"), (3, "serving", "A")),
    )
    assert estimate.unused == ()
    assert found.prior == ["A"]
    assert found.events == [
        "A", MotionStep(1.5, 0.25, 0.1), MotionStep(1.25, -0.5, 0.0), "B", "A",
        MotionStep(2.0, 1.0, 0.0),
    ]  # fmt: skip
    assert estimate.time_s.tolist() == [0.5, 1.0, 2.0, 3.0, 4.0]
    assert estimate.reason == (Reason.USED, Reason.NO_READING, Reason.USED, Reason.USED,
                               Reason.NO_READING)  # fmt: skip


def test_of_several_motions_at_one_time_all_come_before_the_report():
    found, estimate = merged(
        motion=motion((1, 1.0, 0, 0), (1, 2.0, 0, 0), (1, 3.0, 0, 0)),
        radio=radio((0, "serving", "B"), (1, "serving", "A")),
    )
    steps = [getattr(event, "step_m", event) for event in found.events]
    assert steps == ["B", 1.0, 2.0, 3.0, "A"]
    assert len(estimate) == 2


def test_what_was_travelled_before_the_start_is_labelled():
    found, estimate = merged(
        motion=motion((1, 1.0, 0, 0), (2, 2.0, 0, 0), (3, 3.0, 0, 0)),
        radio=radio((2, "serving", "A")),
    )
    assert [getattr(event, "step_m", event) for event in found.events] == ["A", 3.0]
    assert estimate.unused == tuple(
        UnusedReading(time_s, "motion", "", Reason.NOT_STARTED) for time_s in (1.0, 2.0)
    )


def test_a_second_serving_cell_is_labelled_and_the_first_is_used():
    found, estimate = merged(
        radio=radio((1, "serving", "A"), (1, "serving", "B"), (2, "serving", "B"))
    )
    assert found.events == ["A", "B"]
    assert estimate.unused == (UnusedReading(1.0, "serving", "B", Reason.SECOND_SERVING_CELL),)


def test_reports_without_a_serving_cell_are_labelled_and_have_a_fix_all_the_same():
    found, estimate = merged(
        motion=motion((1, 1.0, 0, 0)),
        radio=radio((0, "serving", "A"), (1, "serving", None), (2, "neighbour", "N"),
                    (3, "serving", None)),
    )  # fmt: skip
    assert found.events == ["A", MotionStep(1.0, 0.0, 0.0)]
    assert [(u.time_s, u.kind, u.reason) for u in estimate.unused] == [
        (1.0, "serving", Reason.NO_SERVING_CELL),
        (2.0, "neighbour", Reason.NOT_USED_BY_FILTER),
        (2.0, "serving", Reason.NO_SERVING_CELL),
        (3.0, "serving", Reason.NO_SERVING_CELL),
    ]
    assert estimate.reason[1:] == (Reason.NO_SERVING_CELL,) * 3


def test_a_named_serving_cell_beside_an_unnamed_one_is_used():
    found, estimate = merged(radio=radio((1, "serving", None), (1, "serving", "A")))
    assert found.events == ["A"]
    assert estimate.unused == ()


def test_neighbours_and_fixes_are_labelled_once_with_their_number():
    fixes = pd.DataFrame({"time_s": [4.0, 5.0, 6.0], "east_m": 5.3e5, "north_m": 4.5e6})
    found, estimate = merged(
        radio=radio((1, "serving", "A"), (1, "neighbour", None), (2, "neighbour", "A"),
                    (2, "serving", "A")),
        gnss=fixes,
    )  # fmt: skip
    assert found.events == ["A", "A"]
    assert estimate.time_s.tolist() == [1.0, 2.0]
    assert estimate.unused == (
        UnusedReading(1.0, "neighbour", "", Reason.NOT_USED_BY_FILTER, 2),
        UnusedReading(4.0, "gnss", "", Reason.NOT_USED_BY_FILTER, 3),
    )


def test_missing_steps_and_headings_reach_the_filter():
    found, _ = merged(motion=motion((1, nan, nan, nan)), radio=radio((0, "serving", "A")))
    event = found.events[-1]
    assert np.isnan([event.step_m, event.heading_rad, event.turn_rad]).all()


def test_an_empty_log_has_no_epochs():
    for tables in ({}, {"radio": radio()}):
        found, estimate = merged(**tables)
        assert (found.prior, found.events, len(estimate), estimate.unused) == ([], [], 0, ())


TIMES = st.sampled_from([0.0, 0.48, 0.96, 1.0, 2.0])
# Different headings stay different when they are brought between -pi and pi.
HEADINGS = st.integers(-3000, 3000).map(lambda heading: heading / 1000)


@given(
    st.lists(st.tuples(TIMES, st.floats(0, 3), HEADINGS), max_size=12, unique=True),
    st.lists(
        st.tuples(TIMES, st.sampled_from(["serving", "neighbour"]), st.sampled_from("AB")),
        max_size=12,
        unique=True,
    ),
)
def test_every_row_is_used_or_labelled(moves, reports):
    found, estimate = merged(
        motion=motion(*((t, s, h, 0.0) for t, s, h in moves)),
        radio=radio(*reports).astype({"time_s": float}),
    )
    reasons = [u.reason for u in estimate.unused]
    steps = [event.step_m for event in found.events if isinstance(event, MotionStep)]
    in_order = [s for _, s, _ in sorted(moves, key=lambda move: move[0])]
    early = reasons.count(Reason.NOT_STARTED)
    assert steps == in_order[early:]
    used = [event for event in found.events if isinstance(event, str)]
    second = reasons.count(Reason.SECOND_SERVING_CELL)
    assert len(used) + second == sum(role == "serving" for _, role, _ in reports)
    nothing = {u.time_s for u in estimate.unused if u.reason is Reason.NO_SERVING_CELL}
    assert nothing == {t for t, _, _ in reports} - {
        t for t, role, _ in reports if role == "serving"
    }
    assert estimate.time_s.tolist() == sorted({row[0] for row in (*moves, *reports)})


@pytest.mark.parametrize("seed", range(3))
def test_the_order_of_the_rows_in_the_file_does_not_matter(seed):
    rng = np.random.default_rng(seed)
    moves = motion(*((t, 1.0 + t, 0.0, 0.0) for t in range(6)))
    reports = radio(*((float(t), "serving", "AB"[t % 2]) for t in range(6)))
    shuffled, _ = merged(
        motion=moves.iloc[rng.permutation(6)], radio=reports.iloc[rng.permutation(6)]
    )
    assert shuffled == merged(motion=moves, radio=reports)[0]
