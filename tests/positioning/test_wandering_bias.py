"""The bias of a gyroscope wanders: what fixes have found of it grows old after they end."""

from math import nan, radians, sqrt

import numpy as np
import pytest

from mapfilter.filters.contract import MotionStep
from mapfilter.filters.gaussian import EKF
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.kalman.filter import KalmanTracker
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.positioning.kalman.passing import as_time_passes
from mapfilter.positioning.kalman.reckoning import RATE
from mapfilter.radio.cells import Cell, CellPlan

EAST, NORTH = 500_000.0, 4_600_000.0
PLAN = CellPlan("EPSG:32629", (
    Cell("A", "A", EAST, NORTH + 900.0, 30.0, None, 50.0, 1800.0, "omni"),
))  # fmt: skip
STATED = radians(0.05)


def rate_var_after(elapsed_s, variance, **options):
    transition, noise, shift = as_time_passes(KalmanOptions(**options), elapsed_s, variance)
    np.testing.assert_array_equal(transition, np.eye(5))
    np.testing.assert_array_equal(shift, np.zeros(5))
    assert np.count_nonzero(noise - np.diag(np.diag(noise))) == 0
    return variance + noise[RATE, RATE]


def test_what_is_known_of_a_bias_grows_old():
    assert rate_var_after(150.0, 0.0) == pytest.approx(STATED**2 * (1 - np.exp(-1)))
    assert rate_var_after(1e9, 0.0) == pytest.approx(STATED**2)
    # However often one looks.
    halfway = rate_var_after(40.0, 1e-8)
    assert rate_var_after(60.0, halfway) == pytest.approx(rate_var_after(100.0, 1e-8))
    assert rate_var_after(0.0, 1e-8) == 1e-8


def test_no_more_than_is_stated_and_than_biases_wander():
    better = radians(0.01) ** 2
    assert rate_var_after(1e9, 0.0, turn_rate_sd_deg_per_s=0.01) == pytest.approx(better)
    assert rate_var_after(1e9, 0.0, turn_rate_sd_deg_per_s=2.0) == pytest.approx(STATED**2)
    assert rate_var_after(600.0, 0.0, turn_rate_sd_deg_per_s=0.0) == 0.0
    # An offset that is not known is not known better.
    unknown = radians(1.0) ** 2
    assert rate_var_after(600.0, unknown) == unknown


def test_the_position_wanders_by_time():
    _, noise, _ = as_time_passes(KalmanOptions(drift_m_per_sqrt_s=0.5), 9.0, 1.0)
    np.testing.assert_allclose(np.diag(noise), [2.25, 2.25, 0.0, 0.0, 0.0])


def test_radius_holds_after_a_bias_has_changed():
    """Three minutes at 12 m/s, by 0.05 deg/s: 9° in the end."""
    count, last, rng = 400, 220, np.random.default_rng(3)
    way = 12.0 * np.arange(1, count + 1) + 0j
    turn = rng.normal(0, radians(0.05), count)
    turn[last:] += radians(0.05)
    options = KalmanOptions(turn_drift_deg_per_sqrt_m=0.02)
    tracker = KalmanTracker(SiteModels(PLAN, options), EKF)
    state, off_m, radii_m = tracker.begin(("motion", "gnss")), [], []
    for k, place in enumerate(way):
        fix = None
        if k < last:
            east_m, north_m = place.real + rng.normal(0, 2), place.imag + rng.normal(0, 2)
            fix = GnssFix(EAST + east_m, NORTH + north_m, 9.0, 9.0, 0.0)
        epoch = Epoch(float(k), (MotionStep(12.0, nan, turn[k]),), gnss=fix)
        state, out = tracker.step(state, epoch, np.random.default_rng(0))
        off_m.append(abs(complex(out.fix.east_m - EAST, out.fix.north_m - NORTH) - place))
        radii_m.append(out.fix.radii_m[2])
    off_m, radii_m = np.array(off_m[last:]), np.array(radii_m[last:])
    assert off_m[-1] > 60.0
    assert (off_m <= radii_m).all()
    assert radii_m[-1] < 500.0
    assert sqrt(state.belief.moments.covariance[RATE, RATE]) < STATED
