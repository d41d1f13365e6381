"""Dead reckoning of Kalman-type filters: errors that last, dead sensors, ways without headings."""

from dataclasses import replace
from math import degrees, hypot, inf, nan, radians

import numpy as np
import pytest

from mapfilter.angles import wrap_rad
from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.gaussian import EKF, UKF, Gaussian
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.positioning.kalman.alignment import Alignment
from mapfilter.positioning.kalman.filter import KalmanTracker
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.positioning.kalman.reckoning import RECKONED, Reckoning, after_each_other
from mapfilter.positioning.kalman.turned import Lasting
from mapfilter.positioning.sensors.pace import Pace
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.unmeasured import spread_m2, way_spread_m2
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.radio.cells import Cell, CellPlan

EAST, NORTH = 500_000.0, 4_600_000.0
PLAN = CellPlan("EPSG:32629", (
    Cell("A", "A", EAST, NORTH + 900.0, 30.0, None, 50.0, 1800.0, "omni"),
))  # fmt: skip
OPTIONS = KalmanOptions()
KNOWN = Gaussian(np.zeros(5), 0.01 * np.eye(5))


def walk(rng, count, *, askew_deg=0.0, longer=1.0, speed_mps=1.4):
    """Steps a second apart in streets with corners, as measured, and the true positions."""
    heading = np.cumsum(np.where(rng.random(count) < 0.02, rng.choice([-1, 1], count), 0)) * 1.57
    way = np.cumsum(speed_mps * np.exp(1j * heading))
    measured = wrap_rad(heading + radians(askew_deg) + rng.normal(0, 0.1, count))
    lengths = longer * speed_mps * (1 + rng.normal(0, 0.05, count))
    return [MotionStep(*one) for one in zip(lengths, measured, strict=True)], way


def followed(epochs, method=EKF, kinds=("motion", "gnss", "serving")):
    """Return position, 95 % radius and status after each epoch, and the reasons of unused rows."""
    tracker = KalmanTracker(SiteModels(PLAN, OPTIONS), method)
    state, rows, why, rng = tracker.begin(kinds), [], [], np.random.default_rng(0)
    for epoch in epochs:
        state, out = tracker.step(state, epoch, rng)
        fix = out.fix
        rows.append((complex(fix.east_m - EAST, fix.north_m - NORTH), fix.radii_m[2], fix.status))
        why.append({one.reason for one in out.unused if one.kind != "serving"})
    places, radii_m, statuses = zip(*rows, strict=True)
    return np.array(places), np.array(radii_m), statuses, why, state


def at(place, sd_m, rng):
    east_m, north_m = place.real + rng.normal(0, sd_m), place.imag + rng.normal(0, sd_m)
    return GnssFix(EAST + east_m, NORTH + north_m, sd_m**2, sd_m**2, 0.0)


@pytest.mark.parametrize("method", [EKF, UKF], ids=lambda one: one.name)
@pytest.mark.parametrize(("askew_deg", "longer"), [(0.0, 1.0), (-15.0, 1.05), (90.0, 0.95)])
def test_positions_find_how_a_compass_is_mounted(method, askew_deg, longer):
    """Then ten minutes without any are followed: 840 m, of which 15° alone are 220 m."""
    for seed in range(2):
        rng = np.random.default_rng(seed)
        steps, way = walk(rng, 900, askew_deg=askew_deg, longer=longer)
        fixes = [at(place, 5.0, rng) if k < 300 else None for k, place in enumerate(way)]
        made = [Epoch(float(k), (step,), gnss=fixes[k]) for k, step in enumerate(steps)]
        places, radii_m, statuses, _, state = followed(made, method)
        off_m = np.abs(places - way)[330:]
        assert off_m.max() < 60.0
        assert (off_m <= radii_m[330:]).mean() > 0.95
        assert radii_m[-1] < 220.0
        assert set(statuses[330:]) == {Status.TRACKING}
        turned_rad, scale = state.belief.moments.mean[2:4]
        assert degrees(turned_rad) == pytest.approx(-askew_deg, abs=10.0)
        # Five minutes of fixes tell it by 2 %.
        scale_sd = state.belief.moments.covariance[3, 3] ** 0.5
        assert scale == pytest.approx(1 / longer - 1, abs=2.5 * scale_sd)
        assert 0.01 < scale_sd < 0.026


def test_without_positions_the_radius_grows_as_headings_may_be_off():
    """By 10° and 3 % of the way, along a straight one, and by a random walk of the heading."""
    steps = [MotionStep(1.0, 0.3)] * 1000
    first = Epoch(0.0, gnss=GnssFix(EAST, NORTH, 1e-4, 1e-4, 0.0))
    made = [first, *(Epoch(1e-6 * k, (step,)) for k, step in enumerate(steps, 1))]
    _, _, _, _, state = followed(made)
    covariance = state.belief.moments.covariance[:2, :2]
    along, across = np.array([np.cos(0.3), np.sin(0.3)]), np.array([-np.sin(0.3), np.cos(0.3)])
    assert along @ covariance @ along == pytest.approx(30.0**2 + 1000 * 0.09, rel=1e-3)
    white = 1000 * 0.2**2
    drift = radians(0.6) ** 2 * 1000**3 / 3
    expected = (1000 * radians(10.0)) ** 2 + white + drift
    assert across @ covariance @ across == pytest.approx(expected, rel=3e-3)


def test_motion_is_linear_about_the_errors_found_so_far():
    """Its derivatives are those of the turned and lengthened step."""
    errors, step = np.array([0.7, -0.1, 0.3]), MotionStep(3.0, 0.4)

    def moved(turned, scale):
        return 3.0 * (1 + scale) * np.array([np.cos(0.4 + turned), np.sin(0.4 + turned)])

    _, (transition, _, shift), why = Reckoning().moved(step, 1.0, OPTIONS, errors)
    assert why is Reason.USED
    np.testing.assert_allclose((transition @ [0, 0, *errors] + shift)[:2], moved(*errors[:2]))
    for i, more in enumerate(1e-6 * np.eye(2)):
        slope = (moved(*(errors[:2] + more)) - moved(*(errors[:2] - more))) / 2e-6
        np.testing.assert_allclose(transition[:2, 2 + i], slope, rtol=1e-8)


@pytest.mark.parametrize("drift_deg", [0.0, 0.3, 1.2])
def test_sums_of_turns_wander_as_the_options_say(drift_deg):
    made = Reckoning(alignment=Alignment(0.4, known=True), turned_s=3.0)
    options = replace(OPTIONS, turn_drift_deg_per_sqrt_m=drift_deg)
    for step, wander_deg in (
        (MotionStep(9.0, nan, 0.1), drift_deg),
        (MotionStep(9.0, 0.2, 0.1), OPTIONS.drift_deg_per_sqrt_m),
    ):
        _, (_, noise, _), _ = made.moved(step, 8.0, options, np.zeros(3))
        assert noise[2, 2] == pytest.approx(9.0 * radians(wander_deg) ** 2)


def test_a_lasting_error_of_a_rate_turns_headings_by_its_time():
    """Where headings are sums of turns, whose direction was found."""
    made = Reckoning(alignment=Alignment(0.4, known=True), turned_s=3.0)
    step, errors = MotionStep(3.0, nan, 0.1), np.array([0.7, -0.1, 0.02])
    after, (transition, _, shift), why = made.moved(step, 8.0, OPTIONS, errors)
    assert (why, after.turned_s) == (Reason.USED, 8.0)

    def moved(turned, scale, rate):
        heading = 0.4 + 0.1 + turned + 5.0 * rate
        return 3.0 * (1 + scale) * np.array([np.cos(heading), np.sin(heading)])

    np.testing.assert_allclose((transition @ [0, 0, *errors] + shift)[:2], moved(*errors))
    for i, more in enumerate(1e-6 * np.eye(3)):
        slope = (moved(*(errors + more)) - moved(*(errors - more))) / 2e-6
        np.testing.assert_allclose(transition[:2, 2 + i], slope, rtol=1e-7)
    np.testing.assert_allclose(transition[2], [0, 0, 1, 0, 5.0])
    assert shift[2] == 0.0
    # At rest it goes on, but where a gyroscope reads nothing at all, and by a compass.
    for step_m, heading, turn, lasted_s in (
        (0.0, nan, 1e-4, 5.0), (0.0, nan, 0.0, 0.0), (3.0, 0.2, nan, 0.0), (3.0, 0.2, 0.1, 0.0)
    ):  # fmt: skip
        _, (seen, _, _), _ = made.moved(MotionStep(step_m, heading, turn), 8.0, OPTIONS, errors)
        assert seen[2, 4] == lasted_s
    first = replace(made, turned_s=nan)
    assert first.moved(step, 8.0, OPTIONS, errors)[1][0][2, 4] == 0.0


@pytest.mark.parametrize("rate_deg_per_s", [0.0, 0.05, -0.1])
def test_positions_find_the_bias_of_a_gyroscope(rate_deg_per_s):
    """Ten minutes after the last one 0.1 deg/s would be 60° off."""
    for seed in range(2):
        rng = np.random.default_rng(seed)
        _, way = walk(rng, 1200, speed_mps=8.0)
        moves = np.diff(way, prepend=way[0] - 8.0)
        turn = wrap_rad(np.diff(np.angle(moves), prepend=0.0)) + rng.normal(0, 1e-3, 1200)
        turn += radians(rate_deg_per_s)
        steps = [MotionStep(8.0, nan, one) for one in turn]
        fixes = [at(place, 5.0, rng) if k < 600 else None for k, place in enumerate(way)]
        made = [Epoch(float(k), (step,), gnss=fixes[k]) for k, step in enumerate(steps)]
        places, radii_m, _, _, state = followed(made)
        off_m = np.abs(places - way)[630:]
        assert (off_m <= radii_m[630:]).mean() > 0.95
        assert off_m.max() < 400.0
        mean, sd = state.belief.moments.mean[4], state.belief.moments.covariance[4, 4] ** 0.5
        assert abs(mean + radians(rate_deg_per_s)) < 3 * sd
        assert sd < radians(0.05)


def test_two_motions_are_one():
    rng = np.random.default_rng(3)
    first, second = ((rng.normal(size=(4, 4)), np.diag(rng.random(4)), rng.normal(size=4))
                     for _ in range(2))  # fmt: skip
    transition, noise, shift = after_each_other(first, second)
    state, covariance = rng.normal(size=4), np.diag(rng.random(4))
    once, spread = first[0] @ state + first[2], first[0] @ covariance @ first[0].T + first[1]
    np.testing.assert_allclose(transition @ state + shift, second[0] @ once + second[2])
    np.testing.assert_allclose(
        transition @ covariance @ transition.T + noise,
        second[0] @ spread @ second[0].T + second[1],
    )


@pytest.mark.parametrize("dead", [False, True])
def test_an_odometer_of_zeros_with_a_corner_is_dead(dead):
    """30 s around a corner at 8 m/s; or a rest of 30 s, which is one."""
    rng = np.random.default_rng(5)
    lost = np.isin(np.arange(300), np.arange(200, 230))
    heading = np.where(np.arange(300) > 210, 1.57, 0.0) * dead
    way = np.cumsum(np.where(lost & (not dead), 0.0, 8.0) * np.exp(1j * heading))
    turn = np.diff(heading, prepend=0.0) + rng.normal(0, 1e-3, 300)
    steps = [
        MotionStep(0.0 if gone else 8.0, nan, one) for gone, one in zip(lost, turn, strict=True)
    ]
    fixes = [at(place, 5.0, rng) if k < 180 else None for k, place in enumerate(way)]
    made = [Epoch(float(k), (step,), gnss=fixes[k]) for k, step in enumerate(steps)]
    places, radii_m, _, why, _ = followed(made)
    stuck = [k for k, one in enumerate(why) if Reason.MOTION_STUCK in one]
    assert stuck == (list(range(211, 230)) if dead else [])
    off_m = np.abs(places - way)
    assert (off_m[230:] <= radii_m[230:]).all()
    assert (off_m[-1] > 100.0) == dead
    assert radii_m[-1] > 350.0 if dead else radii_m[-1] < 200.0


def test_a_way_without_headings_is_straight_for_a_while():
    """Until a fix or a heading comes; a hundred steps are no random walk of a hundred."""
    made, gone_m2 = Reckoning(), 0.0
    for _ in range(100):
        made, (_, noise, shift), why = made.moved(MotionStep(1.0, nan), 1.0, OPTIONS, np.zeros(3))
        gone_m2 += noise[0, 0] + noise[1, 1]
        assert (why, shift.any()) == (Reason.NO_HEADING, False)
    assert made.headless_m == 100.0
    assert gone_m2 == pytest.approx(way_spread_m2(100.0))
    assert gone_m2 > 100 * 30.0
    assert made.moved(MotionStep(1.0, 0.0), 1.0, OPTIONS, np.zeros(3))[0].headless_m == 0.0
    fixed, _ = made.fixed(7.0, GnssFix(EAST, NORTH), np.eye(2), KNOWN, Lasting(0.0, 0.0, 30.0))
    # One that is rejected says nothing.
    assert (fixed.headless_m, fixed.fixed_s) == (100.0, -inf)
    fixed = fixed.positioned(7.0)
    assert (fixed.headless_m, fixed.fixed_s) == (0.0, 7.0)


def test_ways_before_and_after_a_fix_go_the_same_way():
    """A belief that took them apart lags behind, by no more than a way that nothing parts."""

    def gone(made, steps):
        for _ in range(steps):
            made, _, _ = made.moved(MotionStep(1.0, nan), 1.0, OPTIONS, np.zeros(3))
        return made

    def fixed(made, time_s, east_m=0.0):
        fix = GnssFix(EAST + east_m, NORTH)
        after, _ = made.fixed(time_s, fix, np.eye(2), KNOWN, Lasting(0.0, 0.0, 30.0))
        return after.positioned(time_s)

    here = GnssFix(EAST, NORTH)
    first = fixed(gone(Reckoning(), 60), 1.0)
    assert gone(Reckoning(), 60).astray_m2(here, 1.0) == 0.0
    made = gone(first, 40)
    parted_m2 = (way_spread_m2(60.0) + way_spread_m2(40.0)) / 2
    assert made.astray_m2(here, 1.0) == pytest.approx(way_spread_m2(100.0) / 2 - parted_m2)
    assert made.astray_m2(here, 1.0) > 500.0
    assert gone(fixed(made, 2.0), 40).astray_m2(here, 1.0) > made.astray_m2(here, 1.0)
    headed, _, _ = made.moved(MotionStep(1.0, 0.0), 1.0, OPTIONS, np.zeros(3))
    assert gone(fixed(headed, 2.0), 40).astray_m2(here, 1.0) == 0.0
    # Fixes that go farther than the way contradict it.
    assert made.astray_m2(GnssFix(EAST + 63.0, NORTH), 1.0) > 500.0
    assert made.astray_m2(GnssFix(EAST + 65.0, NORTH), 1.0) == 0.0
    assert made.astray_m2(GnssFix(EAST + 65.0, NORTH), 4.0) > 500.0
    turning, _, _ = made.moved(MotionStep(1.0, nan, 0.1), 1.0, OPTIONS, np.zeros(3))
    assert turning.astray_m2(here, 1.0) == 0.0


@pytest.mark.parametrize("fault", ["paused", "ended", "no length"])
def test_dead_sensors_do_not_leave_a_narrow_belief_behind(fault):
    """One goes straight on for a minute while motion is not measured; then it is again."""
    rng = np.random.default_rng(2)
    steps = [MotionStep(1.4, 0.0 + rng.normal(0, 0.05)) for _ in range(300)]
    way = 1.4 * np.arange(1, 301) + 0j
    made = []
    for k, step in enumerate(steps):
        fix = at(way[k], 5.0, rng) if k < 150 else None
        heard = (ReportRow("serving", "A", None, None, nan, 0),)
        if 150 <= k < 210:
            if fault == "paused":
                continue
            step = None if fault == "ended" else MotionStep(nan, 0.0)
        made.append(Epoch(float(k), () if step is None else (step,), radio=heard, gnss=fix))
    places, radii_m, _, why, _ = followed(made)
    expected = {"paused": Reason.MOTION_MISSING, "ended": Reason.MOTION_MISSING,
                "no length": Reason.NO_STEP}[fault]  # fmt: skip
    assert any(expected in one for one in why)
    truth = np.array([way[round(epoch.time_s)] for epoch in made])
    late = slice(-80, None)
    off_m = np.abs(places - truth)[late]
    assert off_m.min() > 40.0
    assert (off_m <= radii_m[late]).all()
    # All is well before.
    assert np.abs(places - truth)[100:149].max() < 10.0
    assert radii_m[149] < 14.0


def test_one_step_that_nothing_can_have_gone_is_none():
    rng = np.random.default_rng(2)
    steps, way = walk(rng, 100)
    steps[80] = MotionStep(5000.0, steps[80].heading_rad)
    made = [Epoch(float(k), (step,)) for k, step in enumerate(steps)]
    made[0] = Epoch(0.0, gnss=at(way[0], 1.0, rng))
    places, radii_m, _, why, _ = followed(made)
    assert why[80] == {Reason.IMPOSSIBLE_STEP}
    assert (np.abs(places - way) <= radii_m).mean() > 0.95
    assert np.abs(places - way).max() < 30.0


def test_who_may_have_left_is_lost_until_a_fix_comes():
    rest = Rest(100.0, is_doubtful=True)
    made = Reckoning(SensorWatch(rest=rest), fixed_s=90.0)
    assert made.may_have_left
    assert not Reckoning(SensorWatch(rest=rest), fixed_s=101.0).may_have_left
    assert not Reckoning(SensorWatch(rest=Rest(100.0)), fixed_s=90.0).may_have_left
    assert not Reckoning().may_have_left
    # A vehicle at a light stands.
    driven = SensorWatch(rest=Rest(100.0, is_doubtful=True, pace_mps=9.0))
    assert not Reckoning(driven, fixed_s=90.0).may_have_left


def test_a_rest_in_doubt_is_told_and_its_way_is_missing_once_steps_are_counted():
    """Levels say neither: half of a minute's way at 1.4 m/s, less 12 m that were measured."""
    rest = Rest(100.0, pace_mps=1.4, is_doubtful=True, measured_m=12.0, still_nats=-5.0)
    pace = Pace(160.0, 100.0, 100, 1.0, rests=True, speed_mps=1.4, recent_mps=1.4)
    made = Reckoning(SensorWatch(pace, 100.0, 160.0, rest), fixed_s=90.0)
    step = MotionStep(1.4, 0.3)
    fixed = made.positioned(150.0)
    for before, expected in ((made, 1), (fixed, 0), (replace(made, fixed_s=130.0), 0)):
        after, seen, unused = before.watched(Epoch(161.0, (step,)))
        assert (seen.motion[-1], len(seen.motion), unused) == (step, 1 + expected, [])
        assert not after.may_have_left
    missed = made.watched(Epoch(161.0, (step,)))[1].motion[0]
    missed_mps = 1.4 - 12.0 / 61.0
    assert missed.spread_m**2 == pytest.approx(spread_m2(missed_mps, 61.0) / 2)
    assert missed.step_m == pytest.approx(61.0 * missed_mps / 2)
    after, seen, unused = made.watched(Epoch(161.0, (MotionStep(0.0, 0.3),)))
    assert [one.reason for one in unused] == [Reason.MOTION_STUCK]
    assert (len(seen.motion), after.may_have_left) == (1, True)


def test_the_heading_error_goes_on_over_a_way_that_was_not_measured():
    """As a compass wanders; without one as headings do that turns add up to."""
    for step, deg in (
        (MotionStep(80.0, 0.1), 0.6),
        (MotionStep(80.0, nan), 0.3),
        (MotionStep(80.0, nan, nan, 70.0), 0.3),
    ):
        _, (_, noise, _), _ = Reckoning().moved(step, 1.0, OPTIONS, np.zeros(3))
        assert noise[2, 2] == pytest.approx(80.0 * radians(deg) ** 2)


def test_a_report_that_stands_still_while_one_walks_is_not_used():
    rng = np.random.default_rng(1)
    made = []
    for k in range(400):
        level = -70.0 + (rng.normal(0, 4) if k < 100 else 0.5)
        heard = tuple(
            ReportRow("neighbour", name, None, None, level - i, 0) for i, name in enumerate("AAAA")
        )
        fix = GnssFix(EAST, NORTH, 25.0, 25.0, 0.0) if k == 0 else None
        made.append(Epoch(float(k), (MotionStep(1.4, 0.01 * k),), radio=heard, gnss=fix))
    tracker = KalmanTracker(SiteModels(PLAN, OPTIONS), EKF)
    state, stale = tracker.begin(("motion", "neighbour", "gnss")), 0
    for epoch in made:
        state, out = tracker.step(state, epoch, rng)
        is_stale = any(one.reason is Reason.STALE_RADIO for one in out.unused)
        assert (out.fix.reason is Reason.STALE_RADIO) is is_stale
        stale += is_stale
    assert stale > 100


def test_the_layout_has_errors_behind_the_position():
    assert (RECKONED.size, RECKONED.east, RECKONED.north) == (5, 0, 1)
    assert (
        hypot(*Reckoning().moved(MotionStep(5.0, 1.0), 1.0, OPTIONS, np.zeros(3))[1][2][:2]) == 5.0
    )


@pytest.mark.parametrize("heading_rad", [0.4, nan])
def test_a_step_that_is_a_sum_has_the_noise_of_what_it_sums(heading_rad):
    begun, errors = Reckoning(alignment=Alignment(0.4, known=True)), np.zeros(3)
    each, whole = (
        begun.moved(MotionStep(rows * 1.4, heading_rad, 0.0, rows=rows), 1.0, OPTIONS, errors)
        for rows in (1.0, 3.0)
    )
    assert each[2] is whole[2] is Reason.USED
    np.testing.assert_allclose(whole[1][1][:2, :2], 3 * each[1][1][:2, :2], rtol=1e-12)
