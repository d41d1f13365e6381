"""Headings that jump are found by positions; other faults are no jumps."""

from dataclasses import replace
from math import degrees, nan, radians

import numpy as np
import pytest

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.filters.gaussian import EKF, UKF, Gaussian
from mapfilter.geodesy import wrap_rad
from mapfilter.models.state import StateLayout
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.positioning.kalman.filter import KalmanSmoother, KalmanTracker
from mapfilter.positioning.kalman.lasting import extended_layout
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.positioning.kalman.reckoning import RECKONED, jump_to
from mapfilter.positioning.kalman.turned import RecentWay, Turn, _Stretches
from mapfilter.radio.cells import Cell, CellPlan

EAST, NORTH = 500_000.0, 4_600_000.0
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
        state, out = tracker.step(state, Epoch(float(k), (step,), radio=heard, fix=fix), rng)
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
    for seed in range(10, 13):
        steps, way, rng = walked(seed, jump_deg)
        fixes = [fix_at(p, 5.0, rng) if k < 300 and k % 5 == 0 else None for k, p in enumerate(way)]
        places, radii_m, jumps, error_deg = followed(steps, fixes, method=method)
        assert jumps
        assert 200 < jumps[0] <= 270
        off_m = np.abs(places - way)
        assert np.median(off_m[275:300]) < 6.0
        assert (off_m <= radii_m)[300:].mean() > 0.95
        assert abs(wrap_rad(radians(error_deg + jump_deg))) < radians(20.0)


@pytest.mark.parametrize("askew_deg", [90.0, 180.0])
def test_how_a_compass_is_mounted_is_found_by_late_fixes(askew_deg):
    steps, way, rng = walked(21, askew_deg, count=800, at=0)
    fixes = [fix_at(p, 5.0, rng) if 300 <= k < 500 else None for k, p in enumerate(way)]
    places, radii_m, jumps, error_deg = followed(steps, fixes, heard_first=True)
    assert jumps
    assert jumps[0] < 340
    off_m = np.abs(places - way)[400:]
    assert off_m.max() < 30.0
    assert (off_m <= radii_m[400:]).mean() > 0.95
    assert abs(wrap_rad(radians(error_deg + askew_deg))) < radians(10.0)


@pytest.mark.parametrize("fault", ["none", "outliers", "drift", "scale", "rest", "late fixes"])
def test_other_faults_are_no_jumps(fault):
    for seed in range(30, 34):
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


def test_stretches_are_least_squares():
    """Each by the matrix of its rows: east and north of a fix, by four unknowns."""
    rng = np.random.default_rng(7)
    way = np.cumsum(rng.normal(5, 3, (12, 2)), axis=0)
    turned = 1.1 * np.exp(0.8j) * (way[:, 0] + 1j * way[:, 1])
    fixes = np.stack([turned.real, turned.imag], 1) + rng.normal(0, 2, (12, 2)) + [EAST, NORTH]
    rows = np.column_stack([way, fixes, np.full(12, 60.0), np.zeros((12, 2))])
    found = _Stretches.of(rows)
    for first in range(7):
        x, y = way[first:].T
        one, zero = np.ones_like(x), np.zeros_like(x)
        matrix = np.vstack([np.stack([one, zero, x, -y], 1), np.stack([zero, one, y, x], 1)])
        given = np.concatenate([fixes[first:, 0] - EAST, fixes[first:, 1] - NORTH])
        (east, north, a, b), left, _, _ = np.linalg.lstsq(matrix, given, rcond=None)
        assert found.factor[first] == pytest.approx(complex(a, b), rel=1e-9)
        covariance = 60.0 * np.linalg.inv(matrix.T @ matrix)
        size = abs(complex(a, b))
        assert found.sd_rad[first] == pytest.approx(np.sqrt(covariance[2, 2]) / size, rel=1e-9)
        assert found.fits[first] == (left[0] <= 2.0 * 60.0 * (2 * (12 - first) - 4))
        turn = found.turn(first, complex(*way[-1]), 12 - first)
        place = complex(east, north) + complex(a, b) * complex(*way[-1])
        assert (turn.east_m - EAST, turn.north_m - NORTH) == pytest.approx(
            (place.real, place.imag), rel=1e-6
        )
        at = np.array([1.0, 0.0, way[-1, 0], -way[-1, 1]])
        assert turn.sd_m == pytest.approx(np.sqrt(at @ covariance @ at), rel=1e-6)
        assert turn.turned_rad == pytest.approx(np.angle(complex(a, b)))
    assert not found.fits[7:].any()


def test_a_way_is_broken_off_where_its_direction_or_length_is_not_known():
    way, _ = RecentWay().at_fix(EAST, NORTH, 5.0, 0.0, 0.1)
    gone = way.moved(MotionStep(6.0, 0.0))
    assert (gone.east_m, gone.north_m, len(gone.rows)) == (6.0, 0.0, 1)
    for step in (MotionStep(2.0, nan), MotionStep(nan, 0.1), MotionStep(2.0, nan, nan, 3.0)):
        assert gone.moved(step) == RecentWay()
    assert gone.moved(MotionStep(0.0, nan)) is gone
    assert RecentWay().moved(MotionStep(6.0, 0.0)) == RecentWay()
    # Fixes close to the one before add nothing.
    again, _ = gone.moved(MotionStep(-2.0, 0.0)).at_fix(EAST, NORTH, 5.0, 0.0, 0.1)
    assert len(again.rows) == 1
    again, _ = gone.at_fix(EAST, NORTH, 5.0, 0.0, 0.1)
    assert len(again.rows) == 2


def test_a_jump_is_a_motion_of_all_that_it_has_led_astray():
    belief = Gaussian(np.arange(9.0), np.eye(9))
    turn = Turn(1.5, 0.1, 100.0, 200.0, 4.0)
    layout = replace(extended_layout(RECKONED), size=9)
    transition, noise, shift = jump_to(turn, belief, layout, lasts=True)
    np.testing.assert_array_equal(transition, np.eye(9))
    np.testing.assert_array_equal(shift, [100, 199, -0.5, 0, 0, 100, 199, 0, 0])
    expected = np.zeros((9, 9))
    for one in ((0, 0), (0, 5), (5, 5), (5, 0)):
        expected[one], expected[one[0] + 1, one[1] + 1] = 16.0, 16.0
    expected[2, 2] = 0.01
    np.testing.assert_allclose(noise, expected)
    _, own, moved = jump_to(turn, belief, StateLayout(9, 0, 1), lasts=False)
    assert not own[5:, 5:].any()
    assert not moved[5:].any()


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
