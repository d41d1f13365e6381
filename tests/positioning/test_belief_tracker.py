"""A filter of beliefs over epochs: when it starts, what it takes, and what is reported."""
# ruff: noqa: ARG002

from dataclasses import dataclass, field
from math import isnan
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.filters.contract import Estimate, MotionStep, Reason, Status, UpdateInfo
from mapfilter.lattice import Lattice
from mapfilter.positioning.belief_tracker import BeliefTracker, TrackState
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.positioning.step_output import UnusedReading

RNG = np.random.default_rng(0)
STEP = MotionStep(1.0, 0.0)
POINTS = SimpleNamespace(
    row=np.array([0, 3], np.int32), col=np.array([0, 4], np.int32), way_id=np.array([11, 22])
)


@dataclass
class Listing:
    """A filter whose belief is the list of what it was given."""

    info: object = field(default_factory=lambda: UpdateInfo(Reason.USED, Status.SEARCHING, 5))
    moved: object = Reason.USED
    at_m: tuple = (45.0, 45.0)

    def init(self, prior, rng):
        return [("init", prior)]

    def predict(self, belief, motion, rng):
        return [*belief, motion], self.moved

    def update(self, belief, reading, rng):
        return [*belief, reading], self.info

    def locate(self, belief):
        return Estimate(*self.at_m, [[4, 1], [1, 9]], [1, 2, 3])


def tracker(given=None, **more):
    lattice = Lattice("EPSG:32632", 0.0, 50.0, 10.0, 5, 5)
    database = SimpleNamespace(lattice=lattice, points=lambda: POINTS)
    known = {"A": Reason.USED, "B": Reason.USED}
    options = {} if more.pop("usual", False) else {"ways": False}
    options |= more
    return BeliefTracker(
        given or Listing(), database, lambda cell: known.get(cell, Reason.UNKNOWN_CELL),
        lambda epoch: epoch.radio[0].cell if epoch.radio else None, "listing", **options,
    )  # fmt: skip


def epoch(*cells, time_s=3.0, motion=0, role="serving", **more):
    rows = tuple(ReportRow(role, cell, None, None, -70.0, 0) for cell in cells)
    return Epoch(time_s, (STEP,) * motion, rows, **more)


def told(output):
    return [(one.kind, one.what, one.reason) for one in output.unused]


def test_what_a_tracker_is():
    found = tracker(takes=("motion",))
    assert (found.name, found.crs, found.uses) == ("listing", "EPSG:32632", ("motion",))
    state = found.begin()
    assert (state.belief, state.status, state.hypotheses) == (None, Status.SEARCHING, 0)


@pytest.mark.parametrize(
    ("cells", "reason", "labels"),
    [
        (("X",), Reason.UNKNOWN_CELL, [("serving", "X", Reason.UNKNOWN_CELL)]),
        ((), Reason.NO_READING, []),
        ((None,), Reason.NO_SERVING_CELL, [("serving", "", Reason.NO_SERVING_CELL)]),
    ],
)
def test_it_does_not_start_without_a_known_cell(cells, reason, labels):
    state, output = tracker().step(TrackState(), epoch(*cells, motion=2), RNG)
    assert state.belief is None
    fix = output.fix
    assert (fix.time_s, fix.status, fix.reason) == (3.0, Status.SEARCHING, reason)
    assert isnan(fix.east_m)
    early = [("motion", "", Reason.NOT_STARTED)] * 2
    assert sorted(told(output), key=str) == sorted(early + labels, key=str)


def test_it_starts_and_is_updated_with_the_first_known_cell():
    state, output = tracker().step(TrackState(), epoch("A", motion=1), RNG)
    assert state.belief == [("init", "A"), "A"]
    assert (state.status, state.hypotheses) == (Status.SEARCHING, 5)
    fix = output.fix
    assert (fix.time_s, fix.east_m, fix.north_m, fix.hypotheses) == (3.0, 45.0, 45.0, 5)
    assert (fix.status, fix.reason, fix.way_id) == (Status.SEARCHING, Reason.USED, 0)
    np.testing.assert_array_equal(fix.covariance_m2, [[4.0, 1.0], [1.0, 9.0]])
    np.testing.assert_array_equal(fix.radii_m, [1.0, 2.0, 3.0])
    assert told(output) == [("motion", "", Reason.NOT_STARTED)]
    assert output.unused[0] == UnusedReading(3.0, "motion", "", Reason.NOT_STARTED)


@pytest.mark.parametrize(("by_fix", "starts"), [(True, True), (False, False)])
def test_it_starts_by_a_fix_where_that_is_asked_for(by_fix, starts):
    given = epoch("X", gnss=GnssFix(1.0, 2.0))
    state, _ = tracker(start_by_fix=by_fix).step(TrackState(), given, RNG)
    assert (state.belief is not None) is starts
    usual, _ = tracker().step(TrackState(), given, RNG)
    assert usual.belief is None
    alone, _ = tracker(start_by_fix=True).step(TrackState(), epoch("X"), RNG)
    assert alone.belief is None


def test_it_moves_first_and_measures_then():
    begun = TrackState([], Status.TRACKING, 3)
    state, output = tracker().step(begun, epoch("A", motion=2), RNG)
    assert state.belief == [STEP, STEP, "A"]
    assert told(output) == []
    given = Listing(moved=Reason.NO_READING)
    _, output = tracker(given).step(begun, epoch("A", motion=2), RNG)
    assert told(output) == [("motion", "", Reason.NO_READING)] * 2


@pytest.mark.parametrize(
    ("before", "after"),
    [(Status.CONVERGED, Status.TRACKING), (Status.SEARCHING, Status.SEARCHING),
     (Status.LOST, Status.LOST), (Status.TRACKING, Status.TRACKING)],
)  # fmt: skip
def test_without_a_measurement_converged_becomes_tracking(before, after):
    state, output = tracker().step(TrackState([], before, 3), epoch(motion=1), RNG)
    assert (state.status, output.fix.status) == (after, after)
    assert (state.hypotheses, output.fix.hypotheses) == (3, 3)
    assert output.fix.reason is Reason.NO_READING


@pytest.mark.parametrize(
    ("reason", "labelled"),
    [(Reason.USED, False), (Reason.NOT_MOVED_ENOUGH, False), (Reason.NO_POINTS_IN_CELL, True)],
)
def test_why_a_serving_cell_was_not_used_is_reported(reason, labelled):
    given = Listing(UpdateInfo(reason, Status.CONVERGED, 9))
    state, output = tracker(given).step(TrackState([], Status.LOST, 3), epoch("B"), RNG)
    assert (state.status, state.hypotheses) == (Status.CONVERGED, 9)
    assert output.fix.reason is reason
    assert told(output) == ([("serving", "B", reason)] if labelled else [])


def test_no_reading_is_labelled_twice():
    given = Listing(UpdateInfo(Reason.NO_SERVING_CELL, Status.SEARCHING, 1))
    _, output = tracker(given).step(TrackState([]), epoch("N", role="neighbour"), RNG)
    assert told(output) == [("serving", "", Reason.NO_SERVING_CELL)]


def test_the_first_of_several_serving_cells_counts():
    state, output = tracker().step(TrackState([]), epoch("B", "A", "X"), RNG)
    assert state.belief == ["B"]
    second = [("serving", cell, Reason.SECOND_SERVING_CELL) for cell in ("A", "X")]
    assert told(output) == second


@pytest.mark.parametrize(
    ("given", "fault"),
    [(Listing(info="well"), "update returns"), (Listing(moved=None), "predict returns")],
)
def test_what_breaks_the_contract_is_a_type_error(given, fault):
    with pytest.raises(TypeError, match=fault):
        tracker(given).step(TrackState([]), epoch("A", motion=1), RNG)
    other = Listing()
    other.locate = lambda _: (1.0, 2.0)
    with pytest.raises(TypeError, match="Estimate, not tuple"):
        tracker(other).step(TrackState([]), epoch("A"), RNG)


@pytest.mark.parametrize(("at_m", "way_id"), [((6.0, 44.0), 11), ((41.0, 12.0), 22)])
def test_positions_are_matched_to_the_way_of_the_nearest_point(at_m, way_id):
    """Points at the north-west corner of 50 m, and 40 m east and 30 m south of it."""
    found = tracker(Listing(at_m=at_m), usual=True)
    found.warm_up(())
    assert "_points" in found.__dict__
    _, output = found.step(TrackState([]), epoch("A"), RNG)
    assert output.fix.way_id == way_id
    plain = tracker()
    plain.warm_up(())
    assert "_points" not in plain.__dict__
