"""Smoothed positions whose fixes state larger and smaller errors in turn, as one Gaussian."""

from math import exp

import numpy as np

from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.kalman.filter import KalmanFilter, KalmanSmoother
from mapfilter.radio.cells import CellPlan

EAST, NORTH, STEP_M = 500_000.0, 4_600_000.0, 2.0
OPTIONS = KalmanFilter(
    smooth=True, bias_sd_deg=0.0, drift_deg_per_sqrt_m=0.0, scale=0.0, turn_rate_sd_deg_per_s=0.0,
    heading_sd_deg=1e-9, fix_lasting_share=0.6, fix_lasting_s=20.0, start_sd_m=300.0,
)  # fmt: skip
STATED_M = [5.0, 5.0, 9.0, 9.0, 3.0, 12.0, 12.0, 4.0, 4.0, 6.0]


def jointly(places_m, stated_m):
    """Means and variances of east after all fixes: conditioned on them all at once.

    Position and lasting error are sums of independent normal numbers, a column each.
    """
    count = len(places_m)
    place, error = np.zeros(4 * count + 4), np.zeros(4 * count + 4)
    rows, read, white_m2 = [], [], []
    lasting_m, share = np.sqrt(0.6 * OPTIONS.fix_sd_m**2), 0.6
    place[0], error[1] = OPTIONS.start_sd_m, lasting_m
    kept = exp(-1 / OPTIONS.fix_lasting_s)
    for k, stated in enumerate(stated_m):
        if k:
            place[4 * k] = np.hypot(OPTIONS.step_sd_m, OPTIONS.drift_m_per_sqrt_s)
            error = kept * error
            error[4 * k + 1] = np.sqrt(1 - kept**2) * lasting_m
        wanted_m = np.sqrt(share) * stated
        if k == 0 and wanted_m > lasting_m:
            error[2], lasting_m = np.sqrt(wanted_m**2 - lasting_m**2), wanted_m
        elif wanted_m > lasting_m:
            more_m2 = (1 - kept**2) * (wanted_m**2 - lasting_m**2)
            error[4 * k + 2], lasting_m = np.sqrt(more_m2), np.sqrt(lasting_m**2 + more_m2)
        else:
            error, lasting_m = error * wanted_m / lasting_m, wanted_m
        rows.append(place.copy())
        read.append(place + error)
        white_m2.append(stated**2 - lasting_m**2)
    rows, read = np.array(rows), np.array(read)
    gain = rows @ read.T @ np.linalg.inv(read @ read.T + np.diag(white_m2))
    predicted_m = places_m[0] + STEP_M * np.arange(count)
    means_m = predicted_m + gain @ (places_m - predicted_m)
    return means_m, np.diag(rows @ rows.T - gain @ read @ rows.T)


def test_positions_are_those_of_one_gaussian():
    rng = np.random.default_rng(1)
    places_m = STEP_M * np.arange(10) + rng.normal(0, 1.0, 10) * STATED_M / 2
    tracker, smoother = OPTIONS.over_sites(CellPlan("EPSG:32629", ())), KalmanSmoother()
    state = tracker.begin({"gnss", "motion"})
    for k, stated_m in enumerate(STATED_M):
        fix = GnssFix(EAST + places_m[k], NORTH, stated_m**2, stated_m**2, 0.0)
        step, before = (MotionStep(STEP_M, 0.0),) if k else (), state
        state, _ = tracker.step(state, Epoch(float(k), step, gnss=fix), rng)
        smoother.add(before, state)
    means_m, variances_m2 = jointly(places_m, STATED_M)
    later = smoother.history.smoothed()
    np.testing.assert_allclose([one.mean[0] - EAST for one in later], means_m, atol=1e-5)
    np.testing.assert_allclose([one.covariance[0, 0] for one in later], variances_m2, rtol=1e-5)
