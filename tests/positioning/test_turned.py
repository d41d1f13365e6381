"""Headings that jump are found by positions; other faults are no jumps."""

from dataclasses import replace
from math import degrees, nan, radians

import numpy as np
import pytest

from mapfilter.angles import wrap_rad
from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.gaussian import EKF, UKF
from mapfilter.models.state import StateLayout
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.positioning.kalman.alignment import Alignment
from mapfilter.positioning.kalman.filter import KalmanSmoother, KalmanTracker
from mapfilter.positioning.kalman.lasting import extended_layout
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.positioning.kalman.reckoning import RECKONED, Reckoning
from mapfilter.positioning.kalman.redirected import jump_to
from mapfilter.positioning.kalman.turned import Lasting, RecentWay, Turn
from mapfilter.positioning.sensors.pace import Pace
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.radio.cells import Cell, CellPlan

EAST, NORTH = 500_000.0, 4_600_000.0
NONE_LASTS = Lasting(0.0, 0.0, 30.0)
PLAN = CellPlan("EPSG:32629", (
    Cell("A", "A", EAST, NORTH + 900.0, 30.0, None, 50.0, 1800.0, "omni"),
))  # fmt: skip


def walked(seed, jump_deg=0.0, *, count=900, at=200):
    """Steps of a second in streets with corners, whose headings jump at some time; and the way."""
    rng = np.random.default_rng(seed)
    heading = np.cumsum(np.where(rng.random(count) < 0.02, rng.choice([-1, 1], count), 0)) * 1.57
    way = np.cumsum(1.4 * np.exp(1j * heading))
    measured = heading + rng.normal(0, 0.1, count) + radians(jump_deg) * (np.arange(count) >= at)
    lengths = 1.4 * (1 + rng.normal(0, 0.05, count))
    return [MotionStep(*one) for one in zip(lengths, wrap_rad(measured), strict=True)], way, rng


def fix_at(place, sd_m, rng):
    off = rng.normal(0, sd_m, 2)
    return GnssFix(EAST + place.real + off[0], NORTH + place.imag + off[1], sd_m**2, sd_m**2, 0.0)


def followed(steps, fixes, *, method=EKF, heard_first=False, options=None, smoother=None):
    """Positions, 95 % radii, times of jumps that were told, and the last heading error."""
    tracker = KalmanTracker(SiteModels(PLAN, options or KalmanOptions()), method)
    state, rng = tracker.begin(("motion", "gnss", "serving")), np.random.default_rng(0)
    places, radii_m, jumps = [], [], []
    for k, (step, fix) in enumerate(zip(steps, fixes, strict=True)):
        heard = (ReportRow("serving", "A", None, None, -70.0, 0),) if heard_first and k == 0 else ()
        before = state
        state, out = tracker.step(state, Epoch(float(k), (step,), radio=heard, gnss=fix), rng)
        if smoother is not None:
            smoother.add(before, state)
        places.append(complex(out.fix.east_m - EAST, out.fix.north_m - NORTH))
        radii_m.append(out.fix.radii_m[2])
        jumps += [k for one in out.unused if one.reason is Reason.PHONE_TURNED]
    error_deg = degrees(state.belief.moments.mean[2])
    return np.array(places), np.array(radii_m), jumps, error_deg


@pytest.mark.parametrize("method", [EKF, UKF], ids=lambda one: one.name)
@pytest.mark.parametrize("jump_deg", [-40.0, 90.0, 180.0])
def test_a_phone_that_is_turned_is_followed(method, jump_deg):
    """It was 20 to 50 m off while fixes came, and hundreds afterwards; the radius was 10 m."""
    for seed in range(10, 12):
        steps, way, rng = walked(seed, jump_deg)
        fixes = [fix_at(p, 5.0, rng) if k < 300 and k % 5 == 0 else None for k, p in enumerate(way)]
        places, radii_m, jumps, error_deg = followed(steps, fixes, method=method)
        assert len(jumps) == 1
        # A smaller angle is shown by a longer way.
        assert 200 < jumps[0] <= (300 if abs(jump_deg) < 45 else 270)
        off_m = np.abs(places - way)
        assert np.median(off_m[275:300]) < 6.0
        assert (off_m <= radii_m)[300:].mean() > 0.95
        assert abs(wrap_rad(radians(error_deg + jump_deg))) < radians(20.0)


@pytest.mark.parametrize("askew_deg", [90.0, 180.0])
def test_how_a_compass_is_mounted_is_found_by_late_fixes(askew_deg):
    steps, way, rng = walked(21, askew_deg, count=800, at=0)
    fixes = [fix_at(p, 5.0, rng) if 300 <= k < 500 else None for k, p in enumerate(way)]
    places, radii_m, jumps, error_deg = followed(steps, fixes, heard_first=True)
    assert len(jumps) == 1
    assert jumps[0] < 360
    off_m = np.abs(places - way)[400:]
    assert off_m.max() < 30.0
    assert (off_m <= radii_m[400:]).mean() > 0.95
    assert abs(wrap_rad(radians(error_deg + askew_deg))) < radians(10.0)


@pytest.mark.parametrize("fault", ["none", "outliers", "drift", "scale", "rest", "late fixes"])
def test_other_faults_are_no_jumps(fault):
    for seed in range(30, 32):
        steps, way, rng = walked(seed, count=400)
        sd_m = 15.0 if fault == "none" else 5.0
        fixes = [fix_at(p, sd_m, rng) if k % 3 == 0 else None for k, p in enumerate(way)]
        if fault == "outliers":
            for k in range(60, 400, 45):
                fixes[k] = replace(fixes[k], north_m=fixes[k].north_m + 150.0)
        elif fault == "drift":
            # To one side by 20 m and back in five minutes, as between houses.
            fixes = [
                one and replace(one, north_m=one.north_m + 20 * np.sin(k / 50))
                for k, one in enumerate(fixes)
            ]
        elif fault == "scale":
            steps = [replace(step, step_m=1.1 * step.step_m) for step in steps]
        elif fault == "rest":
            steps = [MotionStep(0.0, step.heading_rad) for step in steps]
            fixes = [one and fix_at(0j, 5.0, rng) for one in fixes]
        elif fault == "late fixes":
            # Fixes of two seconds ago.
            fixes = [None, None, None, *fixes[:-3]]
        assert followed(steps, fixes)[2] == []


def test_a_way_is_broken_off_where_its_direction_or_length_is_not_known():
    fix, known, white = (EAST, NORTH, 25.0), (0.0, 0.01), NONE_LASTS
    way, _ = RecentWay().at_fix(0.0, fix, known, white)
    gone = way.moved(MotionStep(6.0, 0.0), 0.0)
    assert (gone.east_m, gone.north_m, len(gone.rows)) == (6.0, 0.0, 1)
    for step in (MotionStep(2.0, nan), MotionStep(nan, 0.1), MotionStep(2.0, nan, nan, 3.0)):
        assert gone.moved(step, 0.0) == RecentWay()
    assert gone.moved(MotionStep(0.0, nan), 0.0) is gone
    assert RecentWay().moved(MotionStep(6.0, 0.0), 0.0) == RecentWay()
    # Fixes close to the one before add nothing.
    near, _ = gone.moved(MotionStep(-2.0, 0.0), 0.0).at_fix(4.0, fix, known, white)
    assert len(near.rows) == 1
    again, _ = gone.at_fix(4.0, fix, known, white)
    assert len(again.rows) == 2


def test_fixes_that_are_led_away_are_no_jump():
    """Turned by 0.6 rad and drawn out by 0.38: no angle of the steps tells that way."""
    for times in (1.0, 1.38):
        way, turns, led = RecentWay(), 0, 0
        for k in range(16):
            place = times * 5.0 * k * np.exp(0.6j)
            fix = (EAST + place.real, NORTH + place.imag, 4.0)
            way, turn = way.at_fix(4.0 * k, fix, (0.0, 0.0004), NONE_LASTS)
            turns, led = turns + (turn is not None), led + way.is_led
            way = way.moved(MotionStep(5.0, 0.0), 0.0)
        if times == 1.0:
            assert (turns > 0, led) == (True, 0)
        else:
            assert turns == 0
            assert led > 2
            # Who stands is not led on by each further fix.
            shown = replace(way, east_m=way.rows[-1].way_east_m, is_led=True)
            assert not shown.at_fix(70.0, fix, (0.0, 0.0004), NONE_LASTS)[0].is_led


def test_a_jump_is_done_with_once_all_fixes_lie_on_one_way():
    way, _ = RecentWay().at_fix(0.0, (EAST, NORTH, 25.0), (0.0, 0.01), NONE_LASTS)
    way = replace(way, is_turning=True)
    for k in range(1, 8):
        off_m = 300.0 if k == 6 else 0.0
        way = way.moved(MotionStep(6.0, 0.0), 0.0)
        fix = (EAST + 6.0 * k, NORTH + off_m, 25.0)
        way, turn = way.at_fix(5.0 * k, fix, (0.0, 0.01), NONE_LASTS)
        assert turn is None
        # Too few fixes tell nothing, and of one far off it is not known yet what it tells.
        assert way.is_turning is (k < 5)
    far = replace(way, is_turning=True, rows=way.rows[:7])
    far, _ = far.moved(MotionStep(6.0, 0.0), 0.0).at_fix(
        50.0, (EAST + 48.0, NORTH, 25.0), (0.0, 0.01), NONE_LASTS
    )
    assert far.is_turning


def test_what_a_rate_adds_is_in_the_way_and_not_in_the_error():
    way, _ = RecentWay().at_fix(0.0, (EAST, NORTH, 25.0), (0.1, 0.01), NONE_LASTS)
    way = way.moved(MotionStep(0.0, nan), 0.2).moved(MotionStep(6.0, 0.3), 0.1)
    assert complex(way.east_m, way.north_m) == pytest.approx(6.0 * np.exp(0.6j))
    way, _ = way.at_fix(5.0, (EAST + 6.0, NORTH, 25.0), (0.5, 0.02), NONE_LASTS)
    assert way.rows[-1].turned_rad == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("variance_m2", "lasting", "after_s", "expected_m2"),
    [(25.0, NONE_LASTS, 5.0, 7.5**2), (400.0, NONE_LASTS, 5.0, 400.0),
     (100.0, Lasting(0.0, 6.0, 30.0), 5.0, 100.0),
     (100.0, Lasting(6.0, 0.0, 30.0), 5.0, 100.0), (25.0, NONE_LASTS, 0.5, 7.5**2)],
)  # fmt: skip
def test_noise_and_what_lasts_are_kept_apart_and_fixes_may_be_late(
    variance_m2, lasting, after_s, expected_m2
):
    way, _ = RecentWay().at_fix(0.0, (EAST, NORTH, variance_m2), (0.0, 0.01), lasting)
    assert way.rows[0].variance_m2 == max(variance_m2, 7.5**2)
    gone = way.moved(MotionStep(6.0, 0.0), 0.0)
    way, _ = gone.at_fix(after_s, (EAST + 6.0, NORTH, variance_m2), (0.0, 0.01), lasting)
    late_m2 = (2 * 6.0 / after_s) ** 2
    assert way.rows[1].variance_m2 == pytest.approx(expected_m2 + late_m2)
    assert (way.rows[1].usual_m, way.rows[1].beyond_m) == lasting[:2]


def test_what_usually_lasts_counts_once_a_jump_is_found():
    """It is found by the same fix, and known less well."""
    found = {}
    for usual_m in (0.0, 5.0):
        rng, way = np.random.default_rng(4), RecentWay()
        for k in range(12):
            fix = fix_at(6.0j * k, 5.0, rng)
            place = fix.east_m, fix.north_m, 25.0
            way, turn = way.at_fix(6.0 * k, place, (0.0, 0.01), Lasting(usual_m, 0.0, 30.0))
            if turn is not None:
                found[usual_m] = k, turn
                break
            way = way.moved(MotionStep(6.0, 0.0), 0.0)
    assert found[0.0][0] == found[5.0][0]
    plain, lasting = found[0.0][1], found[5.0][1]
    assert plain.turned_rad == lasting.turned_rad == pytest.approx(np.pi / 2, abs=0.4)
    # 7.5 m and the way of two seconds; what lasts changes hardly from one fix to the next.
    last = found[0.0][0]
    apart_s = 6.0 * np.abs(np.subtract.outer(np.arange(last + 1), np.arange(last + 1)))
    noise = np.diag([7.5**2, *[7.5**2 + 4.0] * last])
    middle = np.arange(last + 1) - last / 2
    at_end = 1 / (last + 1) + middle * middle[-1] / (middle @ middle)
    for turn, both_m2 in ((plain, noise), (lasting, noise + 25.0 * np.exp(-apart_s / 30.0))):
        assert turn.sd_m == pytest.approx(np.sqrt(at_end @ both_m2 @ at_end), rel=1e-6)
    assert lasting.sd_m > 1.2 * plain.sd_m
    assert lasting.sd_rad > 1.1 * plain.sd_rad


@pytest.mark.parametrize("rate_deg_per_s", [0.3, 1.0])
def test_a_rate_of_turns_that_was_found_is_no_jump(rate_deg_per_s):
    """Its sum over the stretches that are compared is 20 to 100 degrees."""
    steps, way, rng = walked(5, count=600)
    heading = np.angle(np.diff(way, prepend=way[0] - 1.4))
    turns = wrap_rad(np.diff(heading, prepend=0.0)) + radians(rate_deg_per_s)
    steps = [MotionStep(one.step_m, nan, turn) for one, turn in zip(steps, turns, strict=True)]
    fixes = [fix_at(p, 5.0, rng) if k % 5 == 0 and k < 450 else None for k, p in enumerate(way)]
    options = KalmanOptions(turn_rate_sd_deg_per_s=rate_deg_per_s)
    places, radii_m, jumps, _ = followed(steps, fixes, options=options)
    assert jumps == []
    assert (np.abs(places - way) <= radii_m)[450:].mean() > 0.95


def test_a_jump_forgets_the_place_and_the_error_before_it():
    turn = Turn(1.5, 0.1, 100.0, 200.0, 4.0, (0.2, -0.1))
    layout = replace(extended_layout(RECKONED), size=9)
    transition, noise, shift = jump_to(turn, layout, 5.0)
    np.testing.assert_array_equal(np.diag(transition), [0, 0, 0, 1, 1, 0, 0, 1, 1])
    np.testing.assert_array_equal(transition, np.diag(np.diag(transition)))
    np.testing.assert_array_equal(shift, [100, 200, 1.5, 0, 0, 100, 200, 0, 0])
    expected = np.zeros((9, 9))
    for one in ((0, 0), (0, 5), (5, 5), (5, 0)):
        # Of the place that fixes are of what lasts of their errors, too.
        variance_m2 = 41.0 if one == (5, 5) else 16.0
        expected[one] = expected[one[0] + 1, one[1] + 1] = variance_m2
    expected[2, 2] = 0.01
    for east in (0, 5):
        expected[2, [east, east + 1]] = expected[[east, east + 1], 2] = 0.2, -0.1
    np.testing.assert_allclose(noise, expected)
    _, own, moved = jump_to(turn, StateLayout(9, 0, 1), None)
    assert not own[5:].any()
    assert not moved[5:].any()


def test_a_jump_is_no_loss():
    """What fixes said against the wrong heading is no reason to call the position lost."""
    steps, way, rng = walked(12, 180.0, count=320)
    fixes = [fix_at(p, 3.0, rng) if k % 4 == 0 else None for k, p in enumerate(way)]
    tracker = KalmanTracker(SiteModels(PLAN, KalmanOptions()), EKF)
    state, found = tracker.begin(("motion", "gnss")), []
    for k, (step, fix) in enumerate(zip(steps, fixes, strict=True)):
        state, out = tracker.step(state, Epoch(float(k), (step,), gnss=fix), rng)
        turned = any(one.reason is Reason.PHONE_TURNED for one in out.unused)
        found.append((turned, out.fix.status, len(state.recent_nis)))
    (at,) = [k for k, (turned, _, _) in enumerate(found) if turned]
    assert found[at][1:] == (Status.TRACKING, 0)
    assert Status.LOST not in {status for _, status, _ in found[at:]}


@pytest.mark.parametrize(("speed_mps", "kept"), [(1.4, 2), (9.0, 0)])
def test_the_gyroscope_of_a_vehicle_is_not_turned_in_the_hand(speed_mps, kept):
    way, _ = RecentWay().at_fix(0.0, (EAST, NORTH, 25.0), (0.0, 0.01), NONE_LASTS)
    way, _ = way.moved(MotionStep(9.0, 0.0), 0.0).at_fix(
        5.0, (EAST + 9.0, NORTH, 25.0), (0.0, 0.01), NONE_LASTS
    )
    watch = SensorWatch(Pace(speed_mps=speed_mps))
    made = Reckoning(watch, alignment=Alignment(0.1, known=True), turned_s=4.0, recent=way)
    for step, rows in ((MotionStep(9.0, nan, 0.1), kept), (MotionStep(9.0, 0.2), 2)):
        after, _, _ = made.moved(step, 6.0, KalmanOptions(), np.zeros(3))
        assert len(after.recent.rows) == rows


def test_what_was_before_a_jump_is_smoothed_without_it():
    steps, way, rng = walked(11, 90.0, count=320)
    fixes = [fix_at(p, 5.0, rng) if k % 5 == 0 else None for k, p in enumerate(way)]
    smoother = KalmanSmoother()
    places, _, jumps, _ = followed(steps, fixes, smoother=smoother)
    later = np.array([belief.mean[:2] for belief in smoother.history.smoothed()])
    smoothed = later[:, 0] - EAST + 1j * (later[:, 1] - NORTH)
    off_m = np.abs(smoothed - way)
    assert off_m[:150].max() < 6.0
    assert off_m[jumps[0] :].max() < 15.0
    assert off_m.mean() < np.abs(places - way).mean()
