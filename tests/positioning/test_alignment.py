"""Motion with turns only: two fixes find which way its headings lie, then it is reckoned."""

from math import degrees, inf, nan, pi, radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.angles import wrap_rad
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.filters.gaussian import EKF, UKF
from mapfilter.models.state import StateLayout
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.kalman.alignment import Alignment, Direction
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.filter import KalmanSmoother, KalmanTracker
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.positioning.kalman.redirected import turned_to
from mapfilter.radio.cells import CellPlan

EAST, NORTH = 500_000.0, 4_600_000.0
SITES = SiteModels(CellPlan("EPSG:32629", ()), KalmanOptions())


def turned(turns_rad, step_m=5.0):
    return [MotionStep(step_m, nan, float(turn)) for turn in turns_rad]


def gone(alignment, steps):
    for step in steps:
        alignment, _ = alignment.headed(step)
    return alignment


@given(
    turns_rad=st.lists(st.floats(-0.3, 0.3), min_size=12, max_size=40),
    first_rad=st.floats(-pi, pi),
)
def test_two_fixes_tell_how_headings_are_turned(turns_rad, first_rad):
    headings = first_rad + np.cumsum(turns_rad)
    way = 5.0 * np.exp(1j * headings).sum()
    alignment = gone(Alignment(), turned(turns_rad[:1]))
    alignment, found = alignment.at_fix(EAST, NORTH, 0.5)
    assert found is None
    alignment = gone(alignment, turned(turns_rad[1:]))
    way -= 5.0 * np.exp(1j * headings[0])
    alignment, found = alignment.at_fix(EAST + way.real, NORTH + way.imag, 0.5)
    if abs(way) < 30.0:
        assert found is None
        assert not alignment.known
        return
    assert alignment.known
    assert abs(wrap_rad(found.turned_rad - first_rad)) < 1e-6
    assert found.sd_rad == pytest.approx(np.hypot(0.5 * 2**0.5 / abs(way), radians(3.0)))
    # From there on each step has a heading.
    _, step = alignment.headed(MotionStep(5.0, nan, 0.0))
    assert abs(wrap_rad(step.heading_rad + found.turned_rad - headings[-1])) < 1e-6


def test_fixes_that_contradict_the_way_tell_nothing():
    first, _ = gone(Alignment(), turned([0.0])).at_fix(EAST, NORTH, 2.0)
    after = gone(first, turned([0.0] * 20))
    # 100 m by the steps; a fix 160 m away is the first one of another attempt.
    again, found = after.at_fix(EAST + 160.0, NORTH, 2.0)
    assert (found, again.first, again.way_m) == (None, (EAST + 160.0, NORTH), 0.0)
    assert after.at_fix(EAST + 90.0, NORTH, 2.0)[1] is not None
    # Coarse fixes need a longer way.
    assert after.at_fix(EAST + 90.0, NORTH, 20.0) == (after, None)


def test_a_way_that_leads_back_begins_anew():
    first, _ = gone(Alignment(), turned([0.0])).at_fix(EAST, NORTH, 2.0)
    circled = gone(first, turned([pi / 8] * 112))
    assert circled.way_m == 560.0
    again, found = circled.at_fix(EAST + 1.0, NORTH, 2.0)
    assert (found, again.first) == (None, (EAST + 1.0, NORTH))


@pytest.mark.parametrize(
    ("step", "known"),
    [
        (MotionStep(5.0, nan, nan), False),
        (MotionStep(0.0, nan, nan), True),
        (MotionStep(9.0, nan, nan, 9.0, turned_sd_rad=0.3), True),
        (MotionStep(99.0, nan, nan, 90.0, turned_sd_rad=0.6), False),
        (MotionStep(0.0, nan, 0.4), True),
    ],
)
def test_turns_that_are_missing_open_the_direction_again(step, known):
    alignment = Alignment(0.5, known=True)
    assert alignment.headed(step)[0].known is known
    # Small ones add up.
    small = MotionStep(9.0, nan, nan, 9.0, turned_sd_rad=0.3)
    assert gone(alignment, [small] * 3).known
    assert not gone(alignment, [small] * 4).known


def test_a_compass_needs_no_alignment():
    alignment = gone(Alignment(), turned([0.1] * 5))
    alignment, step = alignment.headed(MotionStep(1.0, 0.7))
    assert (alignment, step.heading_rad) == (Alignment(), 0.7)
    assert Alignment().at_fix(EAST, NORTH, 1.0) == (Alignment(), None)


def test_a_direction_takes_the_place_of_the_error_of_headings():
    belief = SumBelief.start([1.0, 2.0, 0.1, 0.0], np.eye(4) + 0.2)
    found = belief.predict(*turned_to(Direction(2.5, 0.1), StateLayout(4, 0, 1)))
    np.testing.assert_allclose(found.means[0], [1.0, 2.0, 2.5, 0.0])
    expected = np.eye(4) + 0.2
    expected[2] = expected[:, 2] = 0.0
    expected[2, 2] = 0.01
    np.testing.assert_allclose(found.covariances[0], expected)


@pytest.mark.parametrize("method", [EKF, UKF], ids=lambda one: one.name)
def test_a_drive_is_reckoned_by_its_turns_where_fixes_end(method):
    """A minute of fixes, then four without: 2.4 km."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        turns = np.where(rng.random(600) < 0.03, rng.choice([-1.5, 1.5], 600), 0.0)
        headings = rng.uniform(-pi, pi) + np.cumsum(turns)
        way = np.cumsum(5.0 * np.exp(1j * headings))
        measured = turns + rng.normal(0, radians(0.1), 600)
        state = (tracker := KalmanTracker(SITES, method)).begin(("motion", "gnss"))
        off_m, radii_m, why = [], [], []
        for k in range(600):
            fix = None
            if k < 120 and k % 2 == 0:
                at = way[k] + 5.0 * complex(*rng.normal(0, 1, 2))
                fix = GnssFix(EAST + at.real, NORTH + at.imag, 25.0, 25.0, 0.0)
            step = MotionStep(5.0 * 1.01, nan, float(measured[k]))
            state, out = tracker.step(state, Epoch(0.5 * k, (step,), gnss=fix), rng)
            place = complex(out.fix.east_m - EAST, out.fix.north_m - NORTH)
            off_m.append(abs(place - way[k]))
            radii_m.append(out.fix.radii_m[2])
            why += [(k, one.reason) for one in out.unused]
        # Without a heading at first, then with one.
        assert max(k for k, reason in why if reason is Reason.NO_HEADING) < 60
        # A gyroscope turns by 2° in four minutes, and steps are 1 % too long.
        assert np.max(off_m[130:]) < 120.0
        assert (np.array(off_m) <= radii_m)[60:].mean() > 0.9
        error = wrap_rad(headings[0] - turns[0] - state.belief.moments.mean[2])
        assert abs(degrees(error)) < 8.0
        assert state.reckoning.headless_m < inf


def test_what_was_before_a_missing_turn_is_smoothed_without_the_direction_after_it():
    """A corner is missing among the turns; fixes find the direction of those after it."""
    rng, missing = np.random.default_rng(1), (120, 121)
    turns = np.zeros(200)
    turns[40], turns[80], turns[120], turns[160] = 1.5, -1.5, 1.5, -1.5
    way = np.cumsum(5.0 * np.exp(1j * (0.7 + np.cumsum(turns))))
    state = (tracker := KalmanTracker(SITES, EKF)).begin(("motion", "gnss"))
    smoother, off_m = KalmanSmoother(), []
    for k in range(200):
        at = way[k] + 5.0 * complex(*rng.normal(0, 1, 2))
        fix = GnssFix(EAST + at.real, NORTH + at.imag, 25.0, 25.0, 0.0) if k % 4 == 0 else None
        step = MotionStep(5.0, nan, nan if k in missing else float(turns[k]))
        before = state
        state, out = tracker.step(state, Epoch(0.5 * k, (step,), gnss=fix), rng)
        smoother.add(before, state)
        off_m.append(abs(complex(out.fix.east_m - EAST, out.fix.north_m - NORTH) - way[k]))
    assert state.reckoning.alignment.known
    later = np.array([belief.mean[:2] for belief in smoother.history.smoothed()])
    smoothed = later[:, 0] - EAST + 1j * (later[:, 1] - NORTH)
    smoothed_m = np.abs(smoothed - way)[60:120]
    assert smoothed_m.mean() < np.mean(off_m[60:120])
    assert smoothed_m.max() < 8.0
