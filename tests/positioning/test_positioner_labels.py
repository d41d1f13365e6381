"""What the map filter's steps tell of motion and radio: readings left out, phones turned, rests."""

from dataclasses import replace
from math import nan

import numpy as np
import pytest
from small_area import SOUTH_M, WEST_M, make_area

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.particle import ParticleOptions
from mapfilter.models.street_motion import BIAS
from mapfilter.positioning.bayes import filter as tested
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.certainty import Recovery
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.rivals.alternative import NullHypothesis
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.sources import usable
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.undirected import UndirectedWay
from mapfilter.positioning.sensors.watch import SensorWatch

FEW = ParticleOptions(max_particles=300, min_search_particles=200, min_particles=100)
POSITIONER = BayesPositioner(BayesModel(make_area()), FEW)
EAST_M, NORTH_M = WEST_M + 35.0, SOUTH_M + 45.0
STEP, ROW = MotionStep(1.0, 0.0), ReportRow("serving", "A", None, None, -70.0, 0)
FIX = GnssFix(EAST_M, NORTH_M, 9.0, 9.0, 0.0)


def stepped(time_s=1.0, *, given=None, **changes):
    rng = np.random.default_rng(1)
    state = replace(POSITIONER.begin_at(EAST_M, NORTH_M, 3.0, rng), **changes)
    return POSITIONER.step(state, Epoch(time_s, **(given or {})), rng)


def told(output):
    return [(one.kind, one.what, one.reason) for one in output.unused]


def test_a_known_start_has_the_headings_of_a_compass():
    """Off by 10 degrees as a rule, not by any angle."""
    belief = POSITIONER.begin_at(EAST_M, NORTH_M, 3.0, np.random.default_rng(2)).belief
    assert belief.state[BIAS].std() == pytest.approx(np.radians(10.0), rel=0.15)


@pytest.mark.parametrize("radio", [Reason.USED, Reason.STALE_RADIO])
@pytest.mark.parametrize("motion", [Reason.USED, Reason.MOTION_STUCK])
def test_sensors_that_do_not_measure_are_told_with_their_rows(monkeypatch, motion, radio):
    """Whatever of them is left in the epoch."""
    watch = SensorWatch()

    def watched(before, epoch, step_unit_m):
        # Of a known start a way leads off from there.
        assert before.undirected.since_m == 0
        assert (before._replace(undirected=UndirectedWay()), step_unit_m) == (SensorWatch(), 1.0)
        return watch, replace(epoch, radio=() if radio is not Reason.USED else epoch.radio), (
            motion, radio,
        )  # fmt: skip

    monkeypatch.setattr(usable, "watched", watched)
    neighbour = ReportRow("neighbour", None, 61, 2, -80.0, 0)
    state, output = stepped(given={"motion": (STEP,), "radio": (ROW, neighbour)})
    expected = [] if motion is Reason.USED else [("motion", "", motion)]
    if radio is not Reason.USED:
        expected += [("serving", "A", radio), ("neighbour", "ARFCN 61, BSIC 2", radio)]
    assert told(output) == expected
    assert output.fix.reason is radio
    directed = UndirectedWay(rows=True, directed=True, since_m=0.0, heading_rad=0.0)
    assert state.watch == watch._replace(undirected=directed)


def test_a_serving_cell_that_is_not_used_is_named_and_no_neighbour():
    rows = replace(ROW, role="neighbour"), replace(ROW, cell="X")
    assert told(stepped(given={"radio": rows})[1])[-1] == ("serving", "X", Reason.UNKNOWN_CELL)


def test_a_report_whose_serving_cell_has_no_name_is_named_by_another():
    rows = replace(ROW, role="neighbour"), replace(ROW, cell=None)
    label = "serving", ROW.cell, Reason.NO_SERVING_CELL
    assert told(stepped(given={"radio": rows})[1])[-1] == label


@pytest.mark.parametrize(
    ("changes", "left", "motion", "label"),
    [
        # A phone that was turned is ahead: told with each step.
        ({"contested": True}, False, True, Reason.PHONE_TURNED),
        ({"contested": True}, False, False, None),
        # Or it may have been carried on though no step is counted.
        ({"contested": True}, True, False, Reason.MOTION_STUCK),
        ({}, True, False, None),
        # It has taken over; headings as measured have come back; or lengths are in feet.
        ({"hold": Hold(1.0, 3.0)}, False, False, Reason.PHONE_TURNED),
        ({"hold": Hold()}, False, True, None),
        ({"hold": Hold(step_unit_m=0.3)}, False, True, Reason.OTHER_UNIT),
        ({"hold": Hold(1.0, 3.0, 0.3)}, False, True, Reason.OTHER_UNIT),
    ],
)
@pytest.mark.parametrize("before", [Hold(), Hold(-1.0, 0.5)])
def test_how_motion_is_read_is_told(monkeypatch, changes, left, motion, label, before):
    if "hold" not in changes:
        changes = {"hold": before, **changes}
    monkeypatch.setattr(tested, "judged", lambda _, state, **__: replace(state, **changes))
    # A belief that waits is not judged.
    monkeypatch.setattr(tested, "waits", lambda *_: None)
    monkeypatch.setattr(BeliefFilters, "may_have_left", lambda *_: left)
    _, output = stepped(given={"motion": (STEP,) if motion else ()}, hold=before)
    assert told(output) == ([("motion", "", label)] if label else [])
    monkeypatch.setattr(
        usable, "watched", lambda watch, epoch, _: (watch, epoch, (Reason.NO_STEP, Reason.USED))
    )
    _, output = stepped(given={"motion": (STEP,) if motion else ()}, hold=before)
    # Of motion that is not measured no more is told, but for its unit.
    own = [("motion", "", Reason.NO_STEP)]
    assert told(output) == own + ([("motion", "", label)] if label is Reason.OTHER_UNIT else [])


@pytest.mark.parametrize("given", [{}, {"radio": (ROW,)}])
def test_only_a_reading_brings_a_lost_position_back(given):
    """It agrees from the first reading on: 20 m of way are asked for."""
    doubted = {"status": Status.UNCERTAIN, "recovery": Recovery(), "null": NullHypothesis(-12.0)}
    state, _ = stepped(given=given, **doubted)
    assert state.status is Status.UNCERTAIN
    assert state.recovery.agrees_from_m == pytest.approx(0.0 if given else nan, nan_ok=True)


@pytest.mark.parametrize(
    ("given", "measured_m", "ends"),
    # A counter that stands still stays in doubt, slow steps do not.
    [({}, 5.0, False), ({"gnss": FIX}, 5.0, True), ({"gnss": FIX}, 0.0, False)],
)
def test_a_position_that_was_used_ends_what_slow_steps_have_to_show(given, measured_m, ends):
    watch = SensorWatch(moving_s=0.0, rest=Rest(0.0, pace_mps=1.5, measured_m=measured_m))
    state, _ = stepped(2.0, given=given, watch=watch)
    assert (state.watch.rest is None) is ends
    assert state.watch.moving_s == (2.0 if ends else 0.0)
