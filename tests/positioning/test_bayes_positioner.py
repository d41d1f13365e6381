"""Single steps of the map filter: what starts it, what is reported, and what is left out."""
# ruff: noqa: ARG002

import sys
from dataclasses import replace
from math import inf, log, nan, sqrt
from unittest.mock import patch

import numpy as np
import pytest
from small_area import SOUTH_M, WEST_M, make_area

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.particle import ParticleOptions
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.sources.evidence import EvidenceSource, EvidenceUpdate, FixedTerm
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow

FEW = ParticleOptions(max_particles=300, min_search_particles=200, min_particles=100)
POSITIONER = BayesPositioner(BayesModel(make_area()), FEW)
EAST_M, NORTH_M = WEST_M + 35.0, SOUTH_M + 45.0
STEP = MotionStep(1.0, 0.0)
FIX = GnssFix(EAST_M, NORTH_M, 9.0, 9.0, 0.0)


def rng():
    return np.random.default_rng(1)


def at_start(sd_m=3.0, positioner=POSITIONER, **changes):
    return replace(positioner.begin_at(EAST_M, NORTH_M, sd_m, rng()), **changes)


def stepped(state, time_s=1.0, positioner=POSITIONER, **given):
    return positioner.step(state, Epoch(time_s, **given), rng())


def told(output):
    return [(one.time_s, one.kind, one.what, one.reason) for one in output.unused]


def row(cell, role="serving", level_dbm=-70.0, **more):
    return ReportRow(role, cell, more.get("arfcn"), None, level_dbm, 0)


@pytest.mark.parametrize(
    ("split_mass", "sd_m", "status"),
    [
        # Within 50 m lies 1 - exp(-(50 / sd)² / 2); 0.8 of it at 50 / sqrt(2 log 5) m.
        (0.5, 0.999 * 50 / sqrt(2 * log(5)), Status.TRACKING),
        (0.5, 1.001 * 50 / sqrt(2 * log(5)), Status.SEARCHING),
        (0.9, 0.999 * 50 / sqrt(2 * log(10)), Status.TRACKING),
        (0.9, 1.001 * 50 / sqrt(2 * log(10)), Status.SEARCHING),
        (0.5, 0.0, Status.TRACKING),
    ],
)
def test_a_known_start_is_tracked_where_it_is_one_place(split_mass, sd_m, status):
    given = replace(POSITIONER, options=replace(FEW, split_mass=split_mass))
    state = at_start(sd_m, given)
    assert state.belief.status is status
    # With so little of it there, it is followed but not claimed.
    followed = status is Status.TRACKING and sd_m > 0
    assert state.status is (Status.UNCERTAIN if followed else status)
    assert state.belief.count == 300


def test_a_known_start_lies_about_its_place():
    state = at_start(8.0)
    held = POSITIONER.hypotheses(state)
    assert held.east_m.mean() == pytest.approx(EAST_M, abs=2.5)
    assert held.north_m.mean() == pytest.approx(NORTH_M, abs=2.5)
    assert held.east_m.std() == pytest.approx(8.0, rel=0.2)
    assert held.weight.sum() == pytest.approx(1.0, abs=1e-5)
    assert held.weight.dtype == held.east_m.dtype == np.float64
    assert POSITIONER.hypotheses(POSITIONER.begin()) is None


class Silent(EvidenceSource):
    """A source of its own, which adds as much to the likelihood of all hypotheses."""

    name, kinds = "silent", frozenset({"tdoa"})

    def first(self, epoch):
        return EvidenceUpdate(None)

    def update(self, state, epoch, context):
        return EvidenceUpdate(7, (FixedTerm(np.full(1, -3.0)),))


def without_cells():
    """The same over an area of streets alone."""
    area = replace(
        make_area(), cell_ids=(), level_dbm=np.zeros((7, 9, 2), dtype=np.float32), carriers={}
    )
    return BayesPositioner(BayesModel(area), FEW)


def test_sources_stand_in_the_order_of_their_reports():
    names = ["gnss", "timing", "first fix", "radio"]
    assert [one.name for one in POSITIONER.sources] == names
    assert "pseudorange" in POSITIONER.sources[0].kinds
    streets = without_cells()
    assert [one.name for one in streets.sources] == [*names, "map"]
    on_grid = replace(streets, grid=True)
    assert [one.name for one in on_grid.sources] == names
    assert on_grid.sources[0].kinds == {"gnss"}
    more = replace(streets, more_sources=(Silent(),))
    assert [one.name for one in more.sources] == [*names, "silent", "map"]
    assert set(more.begin().sources) == {*names, "silent", "map"}
    assert "motion" in POSITIONER.uses
    assert {"serving", "neighbour", "gnss", "pseudorange"} < POSITIONER.uses
    assert (POSITIONER.name, on_grid.name, streets.crs) == ("bayes", "grid", "EPSG:32629")


def test_terms_of_another_source_are_added_and_its_state_is_kept():
    given = replace(POSITIONER, more_sources=(Silent(),))
    state, _ = stepped(at_start(positioner=given), positioner=given)
    assert state.sources["silent"] == 7
    assert state.belief.log_evidence == pytest.approx(-3.0)


@pytest.mark.parametrize(
    ("before", "contested", "after"),
    [
        (Status.TRACKING, False, Status.TRACKING),
        # LOST by another way of holding the phone, or in doubt: the belief itself was not.
        (Status.LOST, True, Status.TRACKING),
        # Nobody judges it without a reading.
        (Status.UNCERTAIN, False, Status.UNCERTAIN),
        (Status.LOST, False, Status.LOST),
        (Status.CONVERGED, False, Status.TRACKING),
    ],
)
@pytest.mark.parametrize("motion", [(), (STEP,)])
def test_the_status_without_a_reading(before, contested, after, motion):
    state, output = stepped(at_start(status=before, contested=contested), motion=motion)
    assert (state.status, output.fix.status, state.contested) == (after, after, False)
    assert (output.fix.reason, told(output)) == (Reason.NO_READING, [])


def test_motion_moves_the_belief():
    begun = at_start()
    state, output = stepped(begun, motion=(MotionStep(10.0, 0.0),))
    assert output.fix.east_m == pytest.approx(EAST_M + 10.0, abs=3.0)
    assert state.reckoning.travelled_m == 10.0
    still, _ = stepped(begun)
    assert still.belief is begun.belief


@pytest.mark.parametrize(
    ("rows", "starts", "labels", "reason"),
    [
        ((row("A"),), True, [], Reason.USED),
        ((row("X"),), False, [("serving", "X", Reason.UNKNOWN_CELL)], Reason.UNKNOWN_CELL),
        ((row("E"),), False, [("serving", "E", Reason.NO_POINTS_IN_CELL)],
         Reason.NO_POINTS_IN_CELL),
        # Named by the first cell of the report, with its levels used.
        ((row("A", "neighbour"),), True, [("serving", "A", Reason.NO_SERVING_CELL)],
         Reason.NO_SERVING_CELL),
        ((row(None),), False, [("serving", "", Reason.NO_SERVING_CELL)], Reason.NO_SERVING_CELL),
        ((row(None, arfcn=60), row("B", "neighbour")), True,
         [("serving", "B", Reason.NO_SERVING_CELL)], Reason.NO_SERVING_CELL),
        ((row("A"), row("B")), True, [("serving", "B", Reason.SECOND_SERVING_CELL)], Reason.USED),
        ((), False, [], Reason.NO_READING),
    ],
)  # fmt: skip
def test_what_starts_a_belief_and_what_is_left_out(rows, starts, labels, reason):
    state, output = stepped(POSITIONER.begin(), radio=rows)
    assert (state.belief is not None) is starts
    assert told(output) == [(1.0, *one) for one in labels]
    assert output.fix.reason is reason
    assert state.status is Status.SEARCHING


def test_motion_before_a_start_is_not_started():
    _, output = stepped(POSITIONER.begin(), motion=(STEP, STEP))
    assert told(output) == [(1.0, "motion", "", Reason.NOT_STARTED)] * 2


def test_reports_close_to_the_last_one_are_not_labelled():
    state, first = stepped(at_start(), radio=(row("A"),))
    assert first.fix.reason is Reason.USED
    _, output = stepped(state, 2.0, radio=(row("A"),), motion=(STEP,))
    assert output.fix.reason is Reason.NOT_MOVED_ENOUGH
    assert ("serving", Reason.NOT_MOVED_ENOUGH) not in [(k, why) for _, k, _, why in told(output)]


def test_a_fix_that_repeats_itself_is_no_new_one():
    state, output = stepped(at_start(), gnss=FIX)
    assert state.last_fix == FIX
    assert told(output) == []
    again, output = stepped(state, 2.0, gnss=FIX)
    assert told(output) == [(2.0, "gnss", "", Reason.REPEATED_FIX)]
    assert again.sources["gnss"].compared_at_s == 1.0
    other = replace(FIX, east_m=EAST_M + 0.01)
    later, output = stepped(again, 3.0, gnss=other)
    assert told(output) == []
    # It is compared again only after 10 m or 10 s, so the last one that was used stays.
    assert later.last_fix == FIX
    later, _ = stepped(again, 13.0, gnss=other)
    assert later.last_fix == other


@pytest.mark.parametrize("east_m", [nan, inf])
def test_a_fix_without_a_position_is_no_fix(east_m):
    for fix in (replace(FIX, east_m=east_m), replace(FIX, north_m=east_m)):
        state, output = stepped(at_start(), gnss=fix)
        assert (state.last_fix, told(output)) == (None, [])
        assert state.sources["gnss"].compared_at_s == -inf
        assert stepped(POSITIONER.begin(), gnss=fix)[0].belief is None


def test_a_fix_far_away_is_rejected_and_not_kept():
    state, output = stepped(at_start(), gnss=replace(FIX, east_m=EAST_M + 500.0))
    assert told(output) == [(1.0, "gnss", "", Reason.REJECTED_BY_EVIDENCE)]
    assert state.last_fix is None


def test_scores_need_no_ways_and_levels():
    scored = POSITIONER.for_scores()
    assert scored.scored
    assert not POSITIONER.scored
    _, output = stepped(at_start(), positioner=scored, motion=(STEP,))
    _, whole = stepped(at_start(), motion=(STEP,))
    assert (output.fix.east_m, output.fix.north_m) == (whole.fix.east_m, whole.fix.north_m)
    assert np.isnan(output.fix.radius_99_m)
    assert np.isfinite(whole.fix.radius_99_m)
    assert (output.fix.way_id, whole.fix.way_id) == (0, 7)


def test_what_is_weighed_at_an_epoch_may_be_asked_for():
    begun = at_start(status=Status.UNCERTAIN)
    epoch = Epoch(1.0, (STEP,), (row("A"),), gnss=FIX)
    state, updates, measured = POSITIONER.evidence_at(begun, epoch, rng())
    after, _ = POSITIONER.step(begun, epoch, rng())
    assert measured
    assert state.status is Status.TRACKING
    assert state.reckoning.travelled_m == after.reckoning.travelled_m == 1.0
    gnss, _, _, radio = updates
    assert len(gnss.terms) == 2
    assert radio.radio.serving == 0
    # A fix that repeats itself is none.
    again = POSITIONER.evidence_at(replace(begun, last_fix=FIX), epoch, rng())[1]
    assert again[0].terms == ()


@pytest.mark.parametrize(
    "kernel",
    ["models.street_motion._move", "positioning.bayes.beliefs.model.weigh_by_ways"],
)
def test_kernels_of_motion_are_loaded_although_a_first_step_waits(kernel):
    module, _, name = f"mapfilter.{kernel}".rpartition(".")
    with patch.object(sys.modules[module], name, wraps=getattr(sys.modules[module], name)) as asked:
        replace(POSITIONER).warm_up(())
    assert asked.called


def test_kernels_are_loaded_before_particles_move_and_for_no_grid():
    warmed, on_grid = replace(POSITIONER), replace(POSITIONER, grid=True)
    for one in (warmed, on_grid, without_cells()):
        one.warm_up(())
    assert "_is_warm" in warmed.__dict__
    assert "_is_warm" not in on_grid.__dict__
    assert warmed.smoother() is None
    assert replace(POSITIONER, smooth=True).smoother() is not None
