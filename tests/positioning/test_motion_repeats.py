"""Headings that stand still, and motion rows that are delivered twice."""

from itertools import chain
from math import isfinite, nan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.sensors.repeats import MotionRepeats, without_repeats


def followed(steps, again_s=0.3):
    """Return rows kept and reason of each row, one a second; equal ones come sooner."""
    repeats, found, time_s = MotionRepeats(), [], 0.0
    for step in steps:
        row, last = (step.step_m, step.heading_rad, step.turn_rad), repeats.last
        is_second = not repeats.was_equal and np.array_equal(row, last, equal_nan=True)
        time_s += again_s if is_second else 1 - again_s if repeats.was_equal else 1.0
        repeats, kept, why = without_repeats(repeats, time_s, (step,))
        found.append((kept, why))
    return found


def walk(rows, seed=0, digits=None):
    rng = np.random.default_rng(seed)
    headings = 0.5 * np.sin(np.arange(rows) / 30) + 0.05 * rng.standard_normal(rows)
    if digits is not None:
        headings = np.radians(np.round(np.degrees(headings), digits))
    return [MotionStep(0.7, heading) for heading in headings.tolist()]


def reasons(found):
    return [why for _, why in found]


def test_headings_that_change_are_left_alone():
    steps = walk(600)
    found = followed(steps)
    assert set(reasons(found)) == {Reason.USED}
    assert [kept for kept, _ in found] == [(step,) for step in steps]


def test_a_heading_that_stands_still_is_found_within_twenty_metres_and_given_up_when_it_moves():
    before, after = walk(200), walk(50, seed=1)
    frozen = [before[-1]] * 200
    found = followed([*before, *frozen, *after])
    stuck = [k for k, why in enumerate(reasons(found)) if why is Reason.HEADING_STUCK]
    assert 200 + 8 <= stuck[0] <= 200 + 20 / 0.7
    assert stuck == list(range(stuck[0], 400))
    (step,), _ = found[stuck[0]]
    assert step.step_m == 0.7
    assert not isfinite(step.heading_rad)
    assert step.spread_m == pytest.approx(0.7, rel=0.01)


def test_a_heading_that_was_the_same_from_the_beginning_stands_still_after_three_hundred_metres():
    """Not sooner, as a street may be straight; and it counts again from where it changes."""
    after = walk(50, seed=1)
    frozen = [MotionStep(0.7, 0.123456789)] * 600
    found = followed([*frozen, *after])
    stuck = [k for k, why in enumerate(reasons(found)) if why is Reason.HEADING_STUCK]
    assert 0.7 * stuck[0] == pytest.approx(300.0, abs=1.0)
    assert stuck == list(range(stuck[0], 600))
    assert not isfinite(found[stuck[0]][0][0].heading_rad)
    long_rows = [MotionStep(30.0, 0.123456789)] * 99
    assert set(reasons(followed(long_rows, again_s=1.0))) == {Reason.USED}


@pytest.mark.parametrize("first_rad", [0.0, 0.2345678, nan])
def test_a_first_heading_of_a_sensor_that_starts_changes_nothing(first_rad):
    frozen = [MotionStep(0.7, first_rad), *[MotionStep(0.7, 0.123456789)] * 600]
    assert reasons(followed(frozen)).count(Reason.HEADING_STUCK) == pytest.approx(600 - 428, abs=3)


def test_three_hundred_metres_are_metres_whatever_the_unit_of_steps():
    repeats, stuck_at_m = MotionRepeats(), []
    for row in range(700):
        step = MotionStep(0.7 / 0.3048, 0.123456789)
        repeats, _, why = without_repeats(repeats, float(row), (step,), 0.3048)
        stuck_at_m += [0.7 * row] if why is Reason.HEADING_STUCK else []
    assert stuck_at_m[0] == pytest.approx(300.0, abs=1.0)


@pytest.mark.parametrize("heading_rad", [0.0, np.radians(37.0), 0.524])
def test_a_coarse_heading_may_be_the_same_all_along_a_street_but_not_for_ever(heading_rad):
    steps = [MotionStep(0.7, heading_rad)] * 2500
    stuck = [k for k, why in enumerate(reasons(followed(steps))) if why is Reason.HEADING_STUCK]
    assert 0.7 * stuck[0] == pytest.approx(1500.0, abs=1.0)


def test_a_street_that_is_straight_for_long_after_others_is_left_alone():
    """A made log without noise: once its headings have changed, they may repeat as before."""
    legs = [MotionStep(0.7, 0.1234567 * k) for k in range(1, 5) for _ in range(300)]
    assert Reason.HEADING_STUCK not in reasons(followed([*legs, *[legs[-1]] * 600]))


def test_the_spread_of_a_way_without_direction_adds_up_to_that_of_a_way_that_forgets_it():
    before = walk(200)
    found = followed([*before, *[before[-1]] * 1000])
    spread_m = [kept[0].spread_m for kept, why in found if why is Reason.HEADING_STUCK]
    way_m = 0.7 * len(spread_m)
    # Of a persistent walk with the length L: 2 L (way - L (1 - exp(-way / L))).
    expected_m2 = 2 * 84 * (way_m - 84 * (1 - np.exp(-way_m / 84)))
    assert np.sum(np.square(spread_m)) == pytest.approx(expected_m2, rel=1e-6)


def test_a_row_that_stands_still_as_a_whole_is_found_though_it_turns():
    """With the same turn in each row beside one heading."""
    before = [MotionStep(0.7, step.heading_rad, 0.01) for step in walk(200)]
    frozen = [MotionStep(0.7, before[-1].heading_rad, 0.123)] * 100
    found = reasons(followed([*before, *frozen], again_s=1.0))
    assert Reason.HEADING_STUCK not in found[:208]
    assert set(found[230:]) == {Reason.HEADING_STUCK}


def test_a_gyroscope_that_goes_on_keeps_its_turns():
    before, rng = walk(200), np.random.default_rng(3)
    heading_rad = before[-1].heading_rad
    turning = [MotionStep(0.7, heading_rad, turn) for turn in rng.normal(0.01, 0.02, 200).tolist()]
    assert set(reasons(followed([*before, *turning]))) == {Reason.USED}


@pytest.mark.parametrize("seed", range(20))
def test_whole_degrees_that_repeat_now_and_then_are_no_fault(seed):
    found = followed(walk(1500, seed=seed, digits=0))
    assert reasons(found).count(Reason.HEADING_STUCK) == 0


@pytest.mark.parametrize("digits", [0, 1, 2])
@pytest.mark.parametrize("seed", range(5))
def test_smooth_rounded_headings_of_a_vehicle_on_straight_roads_are_no_fault(seed, digits):
    """Turns every 18 s, then ten minutes of motorway; the error lasts for 20 s."""
    rng = np.random.default_rng(seed)
    rows = 1500
    lasting = np.zeros(rows)
    for k in range(1, rows):
        lasting[k] = np.exp(-1 / 20) * lasting[k - 1] + 0.16 * rng.standard_normal()
    legs = np.repeat(rng.uniform(-180, 180, rows // 18 + 1), 18)[:rows]
    road = np.where(np.arange(rows) < 900, legs, 37.0)
    headings = np.radians(np.round(road + lasting, digits))
    steps = [MotionStep(14.0, heading) for heading in headings.tolist()]
    assert set(reasons(followed(steps))) <= {Reason.USED}


def test_a_made_log_of_straight_legs_is_left_alone():
    legs = [[MotionStep(0.7, quarter * np.pi / 2)] * 100 for quarter in (0, 1, 2, 1, 0, 3)]
    assert set(reasons(followed(chain(*legs)))) == {Reason.USED}


def test_rests_do_not_count():
    still = [MotionStep(0.0, 0.3)] * 500
    assert set(reasons(followed([*walk(200), *still, *walk(50)]))) == {Reason.USED}


def test_rows_that_come_twice_count_once_after_eight_pairs():
    once = walk(300)
    twice = list(chain(*([step, step] for step in once[100:200])))
    found = followed([*once[:100], *twice, *once[200:]])
    dropped = [k for k, why in enumerate(reasons(found)) if why is Reason.DELIVERED_TWICE]
    assert dropped == list(range(100 + 15, 100 + 200, 2))
    assert all(found[k][0] == () for k in dropped)
    assert sum(len(kept) for kept, _ in found) == 300 + 7


def test_a_sensor_that_is_read_twice_as_often_as_it_measures_keeps_its_rows():
    once = walk(300)
    found = followed(chain(*([step, step] for step in once)), again_s=0.5)
    assert set(reasons(found)) == {Reason.USED}


def test_pairs_with_unknown_turns_or_headings_are_pairs_too():
    steps = [MotionStep(0.6 + 0.001 * k, nan, 0.001 * k) for k in range(50)]
    found = followed(chain(*([step, step] for step in steps)))
    assert reasons(found).count(Reason.DELIVERED_TWICE) == 50 - 7


@settings(deadline=None)
@given(st.lists(st.tuples(st.sampled_from([0.0, 0.7, nan]), st.sampled_from([0.1, 0.2, nan]))))
def test_all_rows_but_second_deliveries_keep_their_length(rows):
    for step, (kept, why) in zip(rows, followed(MotionStep(*row) for row in rows), strict=True):
        lengths = [one.step_m for one in kept]
        if why is Reason.DELIVERED_TWICE:
            assert lengths == []
        else:
            np.testing.assert_equal(lengths, [step[0]])
