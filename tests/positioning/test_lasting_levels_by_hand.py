"""Whole walks with errors of levels in the state, against a Kalman filter in plain NumPy.

The oracle shares no code with the filter: it has an error for every cell of the plan from the
start, the error of a fix in place of the place that fixes are of, and its own path loss and slope.
"""

from math import exp, log10

import numpy as np
import pytest

from mapfilter.filters.contract import MotionStep
from mapfilter.filters.gaussian import EKF
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.positioning.kalman.filter import KalmanSmoother, KalmanTracker
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.radio.cells import Cell, CellPlan

CRS, EAST, NORTH = "EPSG:32629", 500_000.0, 4_600_000.0


def plan_of(count):
    angle = 2.4 * np.arange(count)
    far_m = 700.0 + 60.0 * np.arange(count)
    return CellPlan(CRS, tuple(
        Cell(f"C{i}", f"C{i}", EAST + far_m[i] * np.cos(angle[i]), NORTH + far_m[i] * np.sin(
            angle[i]), 30.0, None, 50.0, 1800.0, "omni")
        for i in range(count)
    ))  # fmt: skip


class Oracle:
    """East, north (each with its rate, or both with the errors of headings and of the scale), the
    common error of levels, each cell's, and that of fixes."""

    def __init__(self, plan, options, *, reckoned):
        self.plan, self.options, self.reckoned = plan, options, reckoned
        self.at = [0, 1] if reckoned else [0, 2]
        self.first = 4
        self.n = self.first + 1 + len(plan.cells) + 2
        self.moved_m = np.inf

    def start(self, east_m, north_m, fix_sd_m):
        own, options = self.first, self.options
        self.x, sd = np.zeros(self.n), np.zeros(self.n)
        self.x[self.at] = east_m, north_m
        sd[:own] = options.speed_sd_mps
        if self.reckoned:
            sd[2:4] = np.radians(options.bias_sd_deg), options.scale
        # So wide that the fix decides.
        sd[self.at] = max(options.start_sd_m, 10 * fix_sd_m)
        sd[own], sd[own + 1 : -2] = options.level_offset_db, options.level_error_db
        sd[-2:] = options.fix_lasting_m
        self.p, self.sd, self.past = np.diag(sd**2), sd, []

    def move(self, elapsed_s, steps):
        options, own = self.options, self.first
        phi, q, u = np.eye(self.n), np.zeros((self.n, self.n)), np.zeros(self.n)
        if self.reckoned:
            q[:2, :2] += options.drift_m_per_sqrt_s**2 * elapsed_s * np.eye(2)
            moved_m = 0.0
            for step_m, heading in steps:
                turned, longer = self.x[2:4]
                angle = heading + turned
                turn = np.array([[np.cos(angle), -np.sin(angle)],
                                 [np.sin(angle), np.cos(angle)]])  # fmt: skip
                cross_m = step_m * np.radians(options.heading_sd_deg)
                q[:2, :2] += turn @ np.diag([options.step_sd_m**2, cross_m**2]) @ turn.T
                q[2, 2] += np.radians(options.drift_deg_per_sqrt_m) ** 2 * step_m
                # The derivatives of step (1 + k) (cos, sin)(heading + b) at the mean.
                phi[:2, 2] = step_m * (1 + longer) * turn[:, 1]
                phi[:2, 3] = step_m * turn[:, 0]
                u[:2] = step_m * (1 + longer) * turn[:, 0] - phi[:2, 2:4] @ self.x[2:4]
                moved_m += step_m
        else:
            moved_m = max(float(np.hypot(self.x[1], self.x[3])), 1.5) * elapsed_s
            t, power = elapsed_s, options.acceleration_mps_per_sqrt_s**2
            for i in (0, 2):
                phi[i, i + 1] = t
                q[i : i + 2, i : i + 2] = power * np.array([[t**3 / 3, t**2 / 2], [t**2 / 2, t]])
        kept = np.ones(self.n)
        kept[own] = exp(-moved_m / options.level_offset_memory_m)
        kept[own + 1 : -2] = exp(-moved_m / options.level_memory_m)
        kept[-2:] = exp(-elapsed_s / options.fix_lasting_s)
        phi[range(own, self.n), range(own, self.n)] = kept[own:]
        q += np.diag((1 - kept**2) * self.sd**2)
        self.past.append((self.x, self.p, phi, q, u))
        self.x, self.p = phi @ self.x + u, phi @ self.p @ phi.T + q
        self.moved_m += moved_m

    def update(self, h, noise, innovation):
        gain = self.p @ h.T @ np.linalg.inv(h @ self.p @ h.T + noise)
        left = np.eye(self.n) - gain @ h
        self.x = self.x + gain @ innovation
        self.p = left @ self.p @ left.T + gain @ noise @ gain.T

    def fix(self, east_m, north_m, variance_m2):
        h = np.zeros((2, self.n))
        h[[0, 1], self.at] = h[[0, 1], [-2, -1]] = 1.0
        white_m2 = variance_m2 * max(1 - self.options.fix_lasting_m**2 / variance_m2, 0.3)
        self.update(h, white_m2 * np.eye(2), np.array([east_m, north_m]) - h @ self.x)

    def level_of(self, i):
        """COST 231 Hata, 1800 MHz, 30 m and 1.5 m, and its slope."""
        lift = (1.1 * log10(1800.0) - 0.7) * 1.5 - (1.56 * log10(1800.0) - 0.8)
        at_km = 46.3 + 33.9 * log10(1800.0) - 13.82 * log10(30.0) - lift
        slope = 44.9 - 6.55 * log10(30.0)
        cell = self.plan.cells[i]
        off = self.x[self.at] - [cell.east_m, cell.north_m]
        far_m = np.hypot(*off)
        return 50.0 - at_km - slope * log10(far_m / 1000), -slope / np.log(10) * off / far_m**2

    def levels(self, reading):
        h, off = np.zeros((len(reading), self.n)), np.zeros(len(reading))
        for row, (i, level_dbm) in enumerate(reading.items()):
            expected, h[row, self.at] = self.level_of(i)
            h[row, [self.first, self.first + 1 + i]] = 1.0
            off[row] = level_dbm - expected - self.x[self.first] - self.x[self.first + 1 + i]
        grown = max(1.0, self.options.level_noise_memory_m / max(self.moved_m, 0.1))
        noise = self.options.level_noise_db**2 * grown * np.eye(len(reading))
        self.update(h, noise, off)
        self.moved_m = 0.0

    @property
    def place(self):
        return self.x[self.at], self.p[np.ix_(self.at, self.at)]

    def smoothed(self):
        """Return means and covariances of the position, the last first (Rauch, Tung, Striebel)."""
        x, p = self.x, self.p
        found = [self.place]
        for mean, covariance, phi, q, u in reversed(self.past):
            ahead = phi @ covariance @ phi.T + q
            # Where errors of fixes do not last, theirs is 0.
            gain = covariance @ phi.T @ np.linalg.pinv(ahead, rcond=1e-13)
            x = mean + gain @ (x - phi @ mean - u)
            p = covariance + gain @ (p - ahead) @ gain.T
            found.append((x[self.at], p[np.ix_(self.at, self.at)]))
        return found


def walked(oracle, smoother, hears, epochs, *, level_sd_db=6.0, fixes=(0,), fix_m2=100.0):
    """Yield the positions of filter and oracle after each epoch: means and covariances."""
    rng, reckoned = np.random.default_rng(5), oracle.reckoned
    kinds = ("serving", "neighbour", "gnss", *(["motion"] if reckoned else []))
    tracker = KalmanTracker(SiteModels(oracle.plan, oracle.options), EKF)
    state = tracker.begin(kinds)
    for k in range(epochs):
        steps = [(rng.uniform(3.0, 25.0), rng.uniform(-np.pi, np.pi))] if reckoned and k else []
        if k % 5 == 4:
            steps = []
        if k:
            oracle.move(2.0, steps)
        fix = None
        if k in fixes:
            fix = GnssFix(EAST + rng.normal(0, 5), NORTH + rng.normal(0, 5), fix_m2, fix_m2, 0.0)
            if k == 0:
                oracle.start(fix.east_m, fix.north_m, np.sqrt(fix_m2))
            oracle.fix(fix.east_m, fix.north_m, fix_m2)
        reading = {}
        for i in hears(k):
            # As it is expected, and noise.
            own = oracle.x[oracle.first] + oracle.x[oracle.first + 1 + i]
            reading[i] = oracle.level_of(i)[0] + own + rng.normal(0, level_sd_db)
        if reading:
            oracle.levels(reading)
        rows = tuple(
            ReportRow("neighbour", f"C{i}", None, None, level, 0) for i, level in reading.items()
        )
        motion = tuple(MotionStep(*step) for step in steps)
        epoch = Epoch(2.0 * k, motion, radio=rows, gnss=fix)
        before, (state, found) = state, tracker.step(state, epoch, rng)
        smoother.add(before, state)
        place = np.array([found.fix.east_m, found.fix.north_m])
        yield place, found.fix.covariance_m2, *oracle.place


@pytest.mark.parametrize("reckoned", [True, False])
@pytest.mark.parametrize("lasting_m", [0.0, 6.0])
def test_walks_are_those_of_a_kalman_filter_with_an_error_for_every_cell(reckoned, lasting_m):
    """Cells come, go and come back; none gives way. Smoothed ones are the same, too."""
    options = KalmanOptions(fix_lasting_m=lasting_m, fix_lasting_share=0.0, start_sd_m=80.0)
    oracle, smoother = Oracle(plan_of(12), options, reckoned=reckoned), KalmanSmoother()

    def hears(k):
        return [] if k % 4 == 3 else [(k + j) % 12 for j in range(1 + k % 3)]

    for mean, covariance, expected, spread in walked(oracle, smoother, hears, 40, fixes=(0, 7, 21)):
        np.testing.assert_allclose(mean, expected, rtol=0, atol=1e-7)
        np.testing.assert_allclose(covariance, spread, rtol=0, atol=1e-9 * np.trace(spread))
    later = smoother.history.smoothed()[::-1]
    for found, (expected, spread) in zip(later, oracle.smoothed(), strict=True):
        at = smoother.where
        np.testing.assert_allclose(found.mean[at], expected, rtol=0, atol=1e-6)
        of_place = found.covariance[np.ix_(at, at)]
        np.testing.assert_allclose(of_place, spread, rtol=0, atol=1e-8 * np.trace(spread))


@pytest.mark.parametrize("count", [20, 40])
def test_of_more_cells_than_are_kept_no_more_is_known_than_with_an_error_for_each(count):
    """Reports of one half and of the other in turn: what was forgotten is no news."""
    oracle = Oracle(plan_of(count), KalmanOptions(start_sd_m=500.0), reckoned=True)

    def hears(k):
        return [i for i in range(count) if i % 2 == k % 2]

    made = walked(oracle, KalmanSmoother(), hears, 60, level_sd_db=0.0, fix_m2=4e4)
    for _, covariance, _, spread in made:
        assert np.linalg.eigvalsh(covariance - spread).min() > -1e-6
    # Hardly less, either.
    assert np.trace(covariance) < 1.1 * np.trace(spread)
