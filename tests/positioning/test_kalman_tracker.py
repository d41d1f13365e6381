"""Kalman-type filters as filters over logs: what they begin with, and what smoothing replaces."""

from dataclasses import replace

import numpy as np
import pytest

from mapfilter.filters.contract import Status
from mapfilter.filters.gaussian import EKF
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.kalman.filter import KalmanFilter, KalmanSmoother, KalmanTracker
from mapfilter.positioning.kalman.models import SiteModels
from mapfilter.radio.cells import CellPlan

CRS, EAST_M, NORTH_M = "EPSG:32629", 500_000.0, 4_600_000.0
PLAN = CellPlan(CRS, ())
OPTIONS = KalmanFilter(start_sd_m=30.0, drift_m_per_sqrt_s=4.0, fix_lasting_share=0.0, smooth=True)
RNG = np.random.default_rng(0)


@pytest.mark.parametrize(
    ("kinds", "lasting_m", "size", "north"),
    [({"motion", "gnss"}, 0.0, 5, 1), ({"gnss"}, 0.0, 4, 2), ({"motion"}, 0.5, 7, 1),
     ({"serving"}, 0.5, 6, 2)],
)  # fmt: skip
def test_a_velocity_stands_in_for_dead_reckoning(kinds, lasting_m, size, north):
    """Else errors of headings and steps, and where errors of fixes last, the place that they are
    of, are parts of the state."""
    layout = (
        KalmanFilter(fix_lasting_m=lasting_m, fix_lasting_share=0.0)
        .over_sites(PLAN)
        .begin(kinds)
        .layout
    )
    assert (layout.size, layout.east, layout.north) == (size, 0, north)


def test_positions_are_smoothed_where_that_is_asked_for():
    assert KalmanFilter().over_sites(PLAN).smoother() is None
    assert KalmanTracker(SiteModels(PLAN, OPTIONS), EKF).smoother() is None
    assert isinstance(OPTIONS.over_sites(PLAN).smoother(), KalmanSmoother)


def test_smoothed_positions_replace_those_since_the_start():
    """Rauch-Tung-Striebel on each axis, by hand; before the first fix there is nothing."""
    tracker, smoother = OPTIONS.over_sites(PLAN), KalmanSmoother()
    fixes = [None, GnssFix(EAST_M, NORTH_M, 25.0, 25.0, 0.0),
             GnssFix(EAST_M + 12.0, NORTH_M - 8.0, 36.0, 36.0, 0.0)]  # fmt: skip
    state, found = tracker.begin(), []
    for time_s, fix in enumerate(fixes):
        before = state
        state, output = tracker.step(state, Epoch(float(time_s), gnss=fix), RNG)
        smoother.add(before, state)
        found.append(output.fix)
    assert len(smoother.history.beliefs) == 2
    assert smoother.where == [0, 1]
    # Before the first fix, ten of its deviations.
    first_m2 = 1 / (1 / 2500.0 + 1 / 25.0)
    moved_m2 = first_m2 + 16.0
    gain = moved_m2 / (moved_m2 + 36.0)
    last_m2 = (1 - gain) * moved_m2
    assert found[2].east_m - EAST_M == pytest.approx(12.0 * gain)
    back = first_m2 / moved_m2
    estimate = TrackEstimate.of_fixes(CRS, "ekf", found)
    later = smoother.smoothed(estimate, RNG)
    np.testing.assert_allclose(later.east_m[1:] - EAST_M, [back * 12.0 * gain, 12.0 * gain])
    np.testing.assert_allclose(later.north_m[1:] - NORTH_M, [-back * 8.0 * gain, -8.0 * gain])
    smoothed_m2 = first_m2 + back**2 * (last_m2 - moved_m2)
    np.testing.assert_allclose(later.covariance_m2[1], smoothed_m2 * np.eye(2), atol=1e-9)
    assert np.isnan(later.east_m[0])
    assert len(later) == 3
    assert later.fix(1).status is found[1].status is Status.CONVERGED
    # An epoch without a belief is not recorded, even where the state tells a motion.
    assert state.motion is not None
    smoother.add(state, replace(state, belief=None))
    smoother.add(state, replace(state, motion=None))
    assert len(smoother.history.beliefs) == 2
