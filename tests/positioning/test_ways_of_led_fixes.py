"""Fixes that may be led in a Kalman-type filter: what their way tells."""

from math import log

import numpy as np
import pytest

from mapfilter.filters.contract import MotionStep, Status
from mapfilter.filters.gaussian import Gaussian
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.kalman.coast import Coast
from mapfilter.positioning.kalman.coasting import Coasting
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.radio.cells import CellPlan

EAST, NORTH, SPEED_MPS = 500_000.0, 4_600_000.0, 10.0
CLAIMED = (Status.TRACKING, Status.CONVERGED)


def drive(seed, count):
    """Wheels and a yaw rate of a drive around blocks, a second each, and where it leads."""
    rng = np.random.default_rng(seed)
    turns = np.zeros(count)
    for corner in range(30, count - 5, 33):
        turns[corner : corner + 4] = rng.choice([-1, 1]) * np.pi / 8
    way = np.cumsum(SPEED_MPS * np.exp(1j * (0.7 + np.cumsum(turns))))
    seen = turns + np.radians(0.05) + rng.normal(0, np.radians(0.1), count)
    return [MotionStep(0.99 * SPEED_MPS, np.nan, float(one)) for one in seen], way, rng


def usual(rng, count):
    """Errors of 2.5 m that are averages over half a minute, and white ones of 1.5 m."""
    noise = rng.normal(0, 2.5, count + 49) + 1j * rng.normal(0, 2.5, count + 49)
    slow = np.convolve(noise, np.ones(50) / np.sqrt(50), "valid")
    return slow + rng.normal(0, 1.5, count) + 1j * rng.normal(0, 1.5, count)


def followed(steps, fixes, way, method="ekf"):
    """Distances from the truth, 95 % radii and claims."""
    options = KalmanFilter(method=method, turn_drift_deg_per_sqrt_m=0.06)
    tracker = options.over_sites(CellPlan("EPSG:32629", ()))
    state, rng, found = tracker.begin({"gnss", "motion"}), np.random.default_rng(0), []
    for k, (step, fix) in enumerate(zip(steps, fixes, strict=True)):
        given = None
        if np.isfinite(fix):
            given = GnssFix(EAST + fix.real, NORTH + fix.imag, 9.0, 9.0, 0)
        state, out = tracker.step(state, Epoch(float(k), (step,), gnss=given), rng)
        place = complex(out.fix.east_m - EAST, out.fix.north_m - NORTH)
        found.append((abs(place - way[k]), out.fix.radii_m[2], out.fix.status in CLAIMED))
    return tuple(np.array(one) for one in zip(*found, strict=True))


@pytest.mark.parametrize("method", ["ekf", "ukf"])
def test_a_vehicle_is_not_led_away_by_half_a_metre_per_second(method):
    """It was claimed wrongly for up to a third of the time, and for long after its end."""
    steps, way, rng = drive(1, 760)
    fixes, led = way + usual(rng, 760), slice(330, 630)
    fixes[led] += 0.5 * np.arange(300) * np.exp(2.3j)
    off_m, radii_m, claimed = followed(steps, fixes, way, method)
    assert claimed[60:330].all()
    assert (claimed & (off_m > 50))[led].mean() < 0.05
    assert (off_m <= radii_m)[480:630].mean() > 0.9
    assert claimed[640:].all()
    assert off_m[640:].max() < 15.0


def test_fixes_after_a_long_gap_soon_have_a_small_radius():
    """Their way shows how far headings were off by the end of the gap.

    It was 67 m for most of the first minute.
    """
    steps, way, rng = drive(6, 760)
    fixes = way + usual(rng, 760)
    fixes[330:630] = np.nan
    off_m, radii_m, claimed = followed(steps, fixes, way)
    assert claimed[632:].all()
    assert off_m[632:].max() < 15.0
    assert np.median(radii_m[640:690]) < 15.0


def by_all(rows, places, noise_m2, mean, covariance):
    """Mean and covariance by all readings at once."""
    seen, whole = np.vstack(rows), np.concatenate(places)
    information = np.linalg.inv(covariance) + seen.T @ seen / noise_m2
    after = np.linalg.inv(information)
    return after @ (np.linalg.solve(covariance, mean) + seen.T @ whole / noise_m2), after


@pytest.mark.parametrize("is_aside", [False, True])
def test_what_a_way_tells_by_hand(is_aside):
    """Two fixes, 100 m of way between them, of an unknown heading error."""
    mean = np.array([5.0, -3.0, 0.1, 0.01, 0.0])
    covariance = np.diag([25.0, 16.0, 1e-2, 1e-4, 1e-8])
    start = Coast.of(10.0, Gaussian(mean, covariance), 2.0, mean[:2], is_aside=is_aside)
    first = start.heard(70.0, np.array([12.0, 4.0]), 4.5 * np.eye(2))
    motion = np.eye(5), np.zeros((5, 5)), np.array([100.0, 0, 0, 0, 0])
    motion[0][:2, 2:4] = [[0.0, 100.0], [100.0, 0.0]]
    moved = first.moved(motion, first.mean[:5])
    found = moved.heard(80.0, np.array([110.0, 20.0]), 4.5 * np.eye(2))
    # The same for the state at the start: both times are of one speed, or of one place aside.
    wide = np.zeros((7, 7))
    wide[:5, :5], by2 = covariance, 3600.0 if is_aside else 1.0 + 1e-4 * 60
    wide[5:, 5:] = by2 * np.eye(2)
    row, later = np.eye(2, 7), np.eye(2, 7)
    row[:, 5:] = (1.0 if is_aside else 60.0) * np.eye(2)
    later[:, 5:] = (1.0 if is_aside else 70.0) * np.eye(2)
    later[:, :5] = motion[0][:2]
    if is_aside:
        places = [np.array([12.0, 4.0]), np.array([110.0, 20.0]) - [100.0, 0.0]]
        by, known = by_all([row, later], places, 9.0, np.append(mean, [0, 0]), wide)
        np.testing.assert_allclose(found.mean[2:], by[2:], atol=1e-9)
        np.testing.assert_allclose(found.covariance[5:, 5:], known[5:, 5:], atol=1e-9)
        most = known[5:, 5:]
        nats = 0.5 * by[5:] @ np.linalg.solve(most, by[5:])
        nats += 0.5 * log(np.linalg.det(most) / 3600.0**2)
        assert found.nats == pytest.approx(nats)
    else:
        # After the first fix the speed may have changed by a little.
        by, known = by_all([row], [np.array([12.0, 4.0])], 9.0, np.append(mean, [0, 0]), wide)
        known[5:, 5:] += 1e-4 * 10 * np.eye(2)
        place = [np.array([110.0, 20.0]) - [100.0, 0.0]]
        by, known = by_all([later], place, 9.0, by, known)
        np.testing.assert_allclose(found.mean[2:], by[2:], atol=1e-9)
        np.testing.assert_allclose(found.covariance[5:, 5:], known[5:, 5:], atol=1e-9)
    assert found.heard_s == 80.0


def test_a_corner_tells_a_heading_error_from_fixes_that_are_led():
    """Both move fixes to the side of a straight way."""
    belief = Gaussian(np.zeros(5), np.diag([4.0, 4.0, 0.1**2, 1e-6, 1e-12]))
    straight = bent = Coast.of(0.0, belief, 1.0, np.zeros(2))
    for k in range(1, 121):
        for corner, one in ((False, straight), (True, bent)):
            north = corner and k > 60
            motion = np.eye(5), np.zeros((5, 5)), np.zeros(5)
            motion[2][1 if north else 0] = 1.4
            motion[0][0 if north else 1, 2] = -1.4 if north else 1.4
            after = one.moved(motion, np.zeros(5))
            if k >= 60 and k % 15 == 0:
                gone = [84.0, 1.4 * (k - 60)] if north else [1.4 * k, 0.0]
                # North by 0.3 m/s.
                after = after.heard(float(k), np.add(gone, [0.0, 0.3 * k]), 4.0 * np.eye(2))
            straight, bent = (straight, after) if corner else (after, bent)
    assert straight.covariance[6, 6] > 4 * bent.covariance[6, 6]
    assert bent.mean[6] == pytest.approx(0.3, abs=0.03)
    assert bent.nats > straight.nats + 3


def test_the_way_of_fixes_is_used_each_quarter_of_a_minute():
    belief = Gaussian(np.zeros(5), np.diag([9.0, 9.0, 1e-3, 1e-4, 1e-8]))
    state, times_s = Coasting(kept=(Coast.of(0.0, belief, 1.0, np.zeros(2)),)), set()
    for k in range(1, 121):
        state = state.compared(float(k), np.zeros(2), 9.0 * np.eye(2), belief, 1.0)
        times_s.add(state.kept[0].heard_s)
    # Younger ones go by motion alone, for what it tells of errors between houses.
    assert times_s == {-np.inf, 55.0, 70.0, 85.0, 100.0, 115.0}
