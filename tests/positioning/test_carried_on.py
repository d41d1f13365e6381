"""Positions that show a phone to be carried on while steps are fewer than usual."""

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from made_town import CRS, Town, slowed, walk_log

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.gnss.fixes import FixTerm, RejectedFixTerm
from mapfilter.positioning.loop import locate
from mapfilter.positioning.sensors.places import Places
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.sensors.watching import watched
from mapfilter.tracks.log import make_log


def places(east_m, *, every_s=2.0, step_m=0.0, variance_m2=25.0):
    found = Places()
    for index, east in enumerate(east_m):
        fix = GnssFix(east, 0.0, variance_m2, variance_m2, 0.0)
        found = found.after(index * every_s, fix, step_m)
    return found


def test_a_way_that_goes_on_beyond_the_steps_is_one():
    # 4 deviations of the distance of two positions of 5 m are 28.3 m.
    assert places([3.0 * k for k in range(10)]).carried is None
    found = places([3.0 * k for k in range(11)]).carried
    assert found == (0.0, pytest.approx(1.5))
    # The latest one that shows it: two metres a second since ten seconds.
    found = places([0.0, 1.0, -1.0, 0.0, 6.0, 12.0, 18.0, 24.0, 30.0]).carried
    assert found == (6.0, pytest.approx(3.0))


def test_steps_explain_as_much_as_they_are_long():
    found = places([3.0 * k for k in range(16)], step_m=1.0).carried
    assert found == (0.0, pytest.approx(1.5))
    assert places([3.0 * k for k in range(15)], step_m=1.0).carried is None
    assert places([3.0 * k for k in range(40)], step_m=3.0).carried is None


def test_precise_positions_err_for_long_and_coarse_ones_by_more():
    assert places([3.0 * k for k in range(10)], variance_m2=1.0).carried is None
    assert places([3.0 * k for k in range(11)], variance_m2=100.0).carried is None
    # Without a deviation 10 m are assumed: 4 of them are 56.6 m.
    assert places([3.0 * k for k in range(19)], variance_m2=np.nan).carried is None
    assert places([3.0 * k for k in range(20)], variance_m2=np.nan).carried is not None


@pytest.mark.parametrize(
    "east_m",
    [
        [0.0, 1.0, 0.0, 1.0, 0.0, 60.0, 61.0, 60.0, 61.0],
        [0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 30.0],
        [0.0, 30.0],
    ],
)
def test_a_jump_is_none(east_m):
    assert places(east_m).carried is None


def test_positions_that_go_back_and_forth_are_no_way():
    """They end 100 m away, but the middles of both halves are 5 m apart: of a way 40 m and more."""
    wandering = (0.0, 50.0, 95.0, 50.0, 10.0, 50.0, 100.0)
    assert places(wandering, every_s=3.0).carried is None
    steady = tuple(np.linspace(0.0, 100.0, 7))
    assert places(steady, every_s=3.0).carried is not None


def test_positions_too_near_in_time_held_or_old_do_not_count():
    held = Places()
    for time_s in np.arange(0.0, 60.0, 2.0):
        held = held.after(time_s, GnssFix(5.0, 0.0, 25.0, 25.0, 0.0), 0.0)
    assert len(held.rows) == 1
    quick = places([0.1 * k for k in range(100)], every_s=0.1)
    assert [row.time_s for row in quick.rows] == pytest.approx(np.arange(0.0, 9.95, 2.0))
    assert len(places(range(100)).rows) == 31
    nowhere = Places().after(0.0, GnssFix(np.nan, 0.0, 1.0, 1.0, 0.0), 2.0)
    assert nowhere == Places((), 2.0)


@pytest.mark.parametrize(
    ("far_m", "variance_m2", "left"),
    [(28.0, 25.0, False), (28.5, 25.0, True), (63.2, 225.0, False), (63.3, 225.0, True)],
)
def test_positions_are_left_beyond_the_errors_of_both(far_m, variance_m2, left):
    """Four deviations of the distance of one of 5 m and one of 5 or 15 m: 28.3 and 63.2 m."""
    found = places([0.0, 1.0])
    fix = GnssFix(0.0, far_m, variance_m2, variance_m2, 0.0)
    assert Places().after(0.0, GnssFix(0.0, 0.0, 25.0, 25.0, 0.0), 0.0).are_left_by(fix) == left
    assert not found.are_left_by(None)
    assert not Places().are_left_by(fix)


def reasons(places_m, *, walk_mps=1.4, every_s=1.0, sd_m=5.0, watch=None, carried_s=None):
    """Return, by the second, what motion is of a phone that stops after 20 s.

    Its positions are given by a function of the time, and come each so many seconds.
    """
    watch, told, variance_m2 = watch or SensorWatch(), {}, sd_m**2
    for time_s in range(1, 300):
        fix = None
        if time_s % every_s == 0 and places_m(time_s) is not None:
            # No receiver that measures gives the same position twice.
            fix = GnssFix(places_m(time_s), 0.1 * (time_s % 7), variance_m2, variance_m2, 0.0)
        step = MotionStep(walk_mps if time_s <= 20 else 0.0, 0.0)
        watch, _, (told[time_s], _) = watched(watch, Epoch(float(time_s), (step,), gnss=fix))
        watch = watch.carried() if time_s == carried_s else watch
    return told


def ride(time_s):
    """40 s at 5 m/s from 30 s on, and standing after it."""
    return 5.0 * min(max(time_s - 30, 0), 40)


def are(told, reason, first_s, last_s):
    return all(told[time_s] is reason for time_s in range(first_s, last_s))


@pytest.mark.parametrize(("every_s", "ends_s"), [(1, 115), (3, 118), (15, 135)])
def test_a_ride_ends_where_positions_stand(every_s, ends_s):
    def sparse_at_rest(time_s):
        return ride(time_s) if time_s < 72 or time_s % every_s == 0 else None

    told = reasons(sparse_at_rest)
    assert are(told, Reason.USED, 1, 35)
    assert are(told, Reason.MOTION_STUCK, 45, 105)
    assert are(told, Reason.USED, ends_s, 300)


def test_one_that_levels_have_shown_ends_there_too():
    """As does one that a Kalman-type filter found by its own rule."""
    told = reasons(lambda _: 0.0, carried_s=60)
    assert are(told, Reason.USED, 1, 60)
    assert told[61] is Reason.MOTION_STUCK
    assert are(told, Reason.USED, 104, 300)


@pytest.mark.parametrize(
    ("places_m", "sd_m"),
    [
        # No position any more; a walk after the ride, which coarse positions could not show.
        (lambda time_s: ride(time_s) if time_s < 60 else None, 5.0),
        (lambda time_s: 20.0 * min(max(time_s - 30, 0), 20) + 1.4 * max(time_s - 50, 0), 20.0),
    ],
)
def test_where_positions_cannot_show_a_stand_it_may_go_on(places_m, sd_m):
    assert are(reasons(places_m, sd_m=sd_m), Reason.MOTION_STUCK, 60, 300)


@pytest.mark.parametrize(("drift_mps", "stuck"), [(0.8, False), (3.0, True)])
def test_slow_positions_do_not_show_that_wheels_are_dead(drift_mps, stuck):
    told = reasons(lambda time_s: drift_mps * time_s, walk_mps=10.0)
    assert are(told, Reason.MOTION_STUCK if stuck else Reason.USED, 80, 300)


@pytest.mark.parametrize(("heard", "may"), [({"A": (-70.0, 1)}, False), ({}, True)])
def test_levels_that_end_show_no_stand(heard, may):
    rest = Rest(0.0, left_nats=-6.0, present=heard, pace_mps=1.4)
    assert rest.may_be_carried_at(1.0) is may
    assert replace(rest, left_nats=-4.0).may_be_carried_at(1.0)


def test_the_more_a_rejected_fix_repeats_the_one_before_the_less_rivals_gain():
    fix = FixTerm(GnssFix(0.0, 0.0, 25.0, 25.0, 0.0), (0.0, 0.0))
    state = np.zeros((5, 3), dtype=np.float32)
    state[0] = [0.0, 15.0, 40.0]
    gained = RejectedFixTerm(fix, 9.0, 0.1).log_likelihood(state)
    assert gained == pytest.approx([0.9, 0.45, 0.0])


TOWN = Town.of(1)
AREA = TOWN.area()


def given(seed, steps, levels):
    """Return a walk with a position of 5 m each second; ``steps`` of its middle are as counted."""
    log = slowed(walk_log(TOWN, seed, 900.0, levels=levels))
    rng = np.random.default_rng((seed, 3))
    time_s = np.arange(0.0, log.truth["time_s"].iloc[-1])
    east_m, north_m = (np.interp(time_s, log.truth["time_s"], log.truth[name])
                       for name in ("east_m", "north_m"))  # fmt: skip
    fixes = pd.DataFrame(
        {"time_s": time_s, "east_m": east_m + rng.normal(0, 5, time_s.size),
         "north_m": north_m + rng.normal(0, 5, time_s.size),
         "var_east_m2": 25.0, "var_north_m2": 25.0, "cov_east_north_m2": 0.0}
    )  # fmt: skip
    moved = log.motion.assign(step_m=log.motion["step_m"])
    middle = (moved["time_s"] > 300) & (moved["time_s"] <= 420)
    moved.loc[middle, "step_m"] *= steps
    return make_log(
        CRS, motion=moved, radio=log.radio, gnss=fixes, truth=log.truth, start_utc_s=1.7e9
    )


@cache
def found(seed, steps, levels=True):
    log = given(seed, steps, levels)
    estimate = locate(log, BayesFilter().over_area(AREA), np.random.default_rng(5)).estimate
    east_m, north_m = (np.interp(estimate.time_s, log.truth["time_s"], log.truth[name])
                       for name in ("east_m", "north_m"))  # fmt: skip
    error_m = np.hypot(estimate.east_m - east_m, estimate.north_m - north_m)
    claimed = np.array([one in (Status.TRACKING, Status.CONVERGED) for one in estimate.status])
    return estimate, error_m, claimed


@pytest.mark.parametrize("steps", [0.0, 0.2])
@pytest.mark.parametrize("seed", [0, 1])
def test_who_is_carried_on_among_positions_is_followed(seed, steps):
    estimate, error_m, claimed = found(seed, steps)
    during = (estimate.time_s > 300) & (estimate.time_s < 450)
    assert not (claimed & (error_m > 50)).any()
    assert np.median(error_m[during]) < 15
    why = {one.reason for one in estimate.unused if one.kind == "motion"}
    assert Reason.MOTION_STUCK in why


def test_positions_say_so_within_their_errors_only():
    estimate, error_m, _ = found(0, 1.0)
    assert not any(one.reason is Reason.MOTION_STUCK for one in estimate.unused)
    assert error_m[estimate.time_s > 300].max() < 25
