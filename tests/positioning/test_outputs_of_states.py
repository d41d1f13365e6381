"""The output of a state: position, way, levels and runner-up, and nothing where there is none."""

from dataclasses import fields
from math import isnan, nan
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.hypotheses import BeliefSummary
from mapfilter.positioning.bayes.beliefs.legs import NO_LEG
from mapfilter.positioning.bayes.outputs import step_output
from mapfilter.positioning.bayes.state import BayesState

AREA = SimpleNamespace(origin_m=(1000.0, 2000.0), matched_way=lambda *_: (7, 0.75))
PLACES = np.array([[30.0, 31.0, 29.0], [40.0, 40.0, 41.0]], dtype=np.float32)
SUMMARY = BeliefSummary(
    np.array([30.0, 40.0, 0.5]), np.array([[4.0, 1.0], [1.0, 9.0]]), np.array([1.0, 2.0, 3.0]),
    0.9, np.array([[70.0, 80.0, 0.08], [5.0, 6.0, 0.02]]), 1.5,
)  # fmt: skip


def belief(summary=SUMMARY, count=3):
    weight = np.full(3, 1 / 3, dtype=np.float32)
    return SimpleNamespace(
        summary=summary, count=count, state=PLACES, weight=weight, log_evidence=-4.0
    )


def state(belief, status=Status.TRACKING, reported=None):
    null = SimpleNamespace(probability=0.125)
    return SimpleNamespace(
        belief=belief,
        status=status,
        null=null,
        reported=reported,
        leg=NO_LEG,
        with_output=lambda one: one,
    )


def output_of(given, **more):
    return step_output(AREA, given, 5.0, Reason.USED, (), **more)


def test_a_position_is_that_of_the_belief_in_the_areas_system():
    _, found = output_of(state(belief()))
    fix = found.fix
    assert (fix.time_s, fix.east_m, fix.north_m) == (5.0, 1030.0, 2040.0)
    assert (fix.status, fix.reason, fix.hypotheses) == (Status.TRACKING, Reason.USED, 3)
    assert (fix.mass_50m, fix.way_id, fix.way_probability) == (0.9, 7, 0.75)
    np.testing.assert_array_equal(fix.radii_m, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(fix.covariance_m2, SUMMARY.covariance_m2)
    assert fix.protection_m >= fix.radius_99_m > 0
    assert found.tail.p_none == 0.125
    # The runner-up, in the same system.
    assert found.evidence == (1070.0, 2080.0, 0.08, 1.5, -4.0)


def test_a_way_is_that_of_the_places_by_their_weights():
    asked = []
    area = SimpleNamespace(
        origin_m=(0.0, 0.0), matched_way=lambda *given: asked.append(given) or (7, 0.75)
    )
    held = belief()
    step_output(area, state(held), 5.0, Reason.USED, ())
    ((east_m, north_m, weight),) = asked
    np.testing.assert_array_equal([east_m, north_m], PLACES)
    assert weight is held.weight


@pytest.mark.parametrize("given", [state(belief(), Status.OUTSIDE), state(None, Status.SEARCHING)])
def test_outside_and_before_the_start_there_is_no_position(given):
    _, found = output_of(given)
    fix = found.fix
    assert isnan(fix.east_m)
    assert isnan(fix.north_m)
    assert np.isnan(fix.radii_m).all()
    assert (fix.hypotheses, fix.way_id, fix.status) == (0, 0, given.status)
    assert isnan(fix.mass_50m)
    assert isnan(fix.protection_m)
    assert found.tail is None
    assert np.isnan(found.evidence[:4]).all()
    np.testing.assert_equal(found.evidence[4], -4.0 if given.belief else nan)


def test_without_a_runner_up_its_mass_is_zero():
    alone = SUMMARY._replace(runners_up=np.empty((0, 3)))
    _, found = output_of(state(belief(alone)))
    np.testing.assert_equal(found.evidence, (nan, nan, 0.0, 1.5, -4.0))


def test_positions_alone_have_neither_ways_nor_levels():
    _, found = output_of(state(belief()), positions_only=True)
    assert found.fix.east_m == 1030.0
    assert found.fix.way_id == 0
    assert np.isnan(
        [found.fix.way_probability, found.fix.radius_99_m, found.fix.protection_m]
    ).all()
    assert found.tail is None


def test_what_was_summarised_is_not_summarised_again():
    held = belief()
    reported, before = output_of(state(held))
    again = state(held, reported=reported)
    same, found = step_output(AREA, again, 6.0, Reason.NOT_MOVED_ENOUGH, ("unused",))
    assert same is again
    assert (found.fix.time_s, found.fix.reason) == (6.0, Reason.NOT_MOVED_ENOUGH)
    assert (found.fix.east_m, found.evidence) == (before.fix.east_m, before.evidence)
    assert (found.unused, found.tail) == (("unused",), before.tail)
    for other in (state(belief(), reported=reported), state(held, Status.LOST, reported)):
        changed, _ = output_of(other)
        assert changed is not other


def test_a_state_before_the_first_epoch_has_nothing():
    state = BayesState()
    assert (state.belief, state.alternative, state.reported, state.twin) == (None,) * 4
    assert (state.alternatives, state.takeovers, state.held) == (0, 0, ())
    assert (state.status, state.contested, state.compass) == (Status.SEARCHING, False, True)
    assert np.isnan([state.heading_rad, state.walking_rad]).all()
    assert state.particle_spacing_m == 5.0


def test_an_output_is_added_to_all_else_that_a_state_has():
    names = [one.name for one in fields(BayesState) if one.name != "reported"]
    given = BayesState(**{name: object() for name in names})
    found = given.with_output("output")
    assert found.reported == "output"
    assert all(getattr(found, name) is getattr(given, name) for name in names)


@pytest.mark.parametrize(
    ("count", "bins", "spacing_m"),
    # Three tenths of 64 bins of 625 m² are streets: 12 000 m².
    [(100, 64.0, 120.0**0.5), (3000, 64.0, 2.0), (5400, 64.0, 1.5), (9, 1.0, 20.833333**0.5),
     (0, 64.0, 5.0)],
)  # fmt: skip
def test_hypotheses_are_a_few_metres_apart_along_the_streets(count, bins, spacing_m):
    summary = SimpleNamespace(effective_bins=bins)
    own = SimpleNamespace(count=count, bins=SimpleNamespace(size_m=25.0), summary=summary)
    assert BayesState(belief=own).particle_spacing_m == pytest.approx(spacing_m)


def test_another_probability_of_no_hypothesis_is_summarised_again():
    held = belief()
    reported, _ = output_of(state(held))
    other = state(held, reported=reported)
    other.null = SimpleNamespace(probability=0.25)
    changed, found = output_of(other)
    assert changed is not other
    assert found.tail.p_none == 0.25


def test_a_belief_without_hypotheses_has_a_way_and_neither_mass_nor_levels():
    empty = SUMMARY._replace(runners_up=np.empty((0, 3)), entropy_bits=nan)
    _, found = output_of(state(belief(empty, count=0)))
    assert (found.fix.way_id, found.fix.hypotheses, found.tail) == (7, 0, None)
    assert np.isnan([found.fix.mass_50m, found.fix.protection_m, found.evidence[2]]).all()
    assert found.evidence[4] == -4.0
