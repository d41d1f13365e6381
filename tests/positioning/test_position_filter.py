"""The PKF against a Kalman filter by hand, and beside the filter that takes the readings."""

import numpy as np
import pytest
from fusion_world import MOVING_CLOCK_3D

from mapfilter.errors import InputError
from mapfilter.filters.gaussian import EKF
from mapfilter.filters.trials import run_trials
from mapfilter.models.motion import clock_motion, constant_velocity, together
from mapfilter.models.ranging import pseudoranges
from mapfilter.models.state import MOVING, POSITION_CLOCK_3D, StateLayout
from mapfilter.positioning.kalman.models import compiled
from mapfilter.positioning.kalman.static_fix import StaticFix, filter_fixes, static_fix

MOVING_UP = StateLayout(6, 0, 2, 4)


def test_as_a_kalman_filter_by_hand():
    rng, motion = np.random.default_rng(1), constant_velocity(1.0, 0.5)
    mean, covariance = np.array([1.0, 2.0, 3.0, 4.0]), np.diag([9.0, 1.0, 16.0, 2.0])
    fixes = []
    for k in range(6):
        root = rng.standard_normal((3, 3))
        ok = k != 3
        fixes.append(StaticFix(rng.standard_normal(3) * 10, root @ root.T + np.eye(3), ok, 1))
    found = filter_fixes(MOVING, motion, mean, covariance, fixes)
    slope = np.zeros((2, 4))
    slope[0, 0] = slope[1, 2] = 1.0
    for k, fix in enumerate(fixes):
        mean = motion.transition @ mean
        covariance = motion.transition @ covariance @ motion.transition.T + motion.noise
        if fix.ok:
            gain = (
                covariance
                @ slope.T
                @ np.linalg.inv(slope @ covariance @ slope.T + fix.covariance[:2, :2])
            )
            mean = mean + gain @ (fix.state[:2] - slope @ mean)
            covariance = covariance - gain @ slope @ covariance
        np.testing.assert_allclose(found.means[k], mean, atol=1e-9)
        np.testing.assert_allclose(found.covariances[k], covariance, atol=1e-9)
    assert found.used.tolist() == [True, True, True, False, True, True]


def test_better_than_fixes_and_worse_than_a_filter_of_the_readings():
    """With three satellites for a third of the time only the EKF learns anything."""
    rng = np.random.default_rng(2)
    away = rng.standard_normal((6, 3))
    away[:, 2] = np.abs(away[:, 2]) + 0.4
    away *= 2.2e7 / np.linalg.norm(away, axis=1)[:, None]
    motion = together([constant_velocity(1.0, [0.3, 0.3, 0.05], 3), clock_motion(1.0)])
    start = np.array([0.0, 1.0, 0.0, 1.0, 1.5, 0.0, 40.0, 0.0])
    first = np.diag([100.0, 1.0, 100.0, 1.0, 25.0, 0.1, 100.0, 1.0])
    moving, seen = (
        pseudoranges(MOVING_CLOCK_3D, away, 5.0),
        pseudoranges(POSITION_CLOCK_3D, away, 5.0),
    )
    off = {"static": [], "pkf": [], "ekf": []}
    for _ in range(4):
        state, truth, readings = start + rng.standard_normal(8) * np.sqrt(np.diag(first)), [], []
        for k in range(120):
            state = motion.sample(state, rng)
            reading = moving.sample(state, rng)
            if k % 60 >= 40:
                reading[3:] = np.nan
            truth.append(state[[0, 2, 4]])
            readings.append(reading)
        truth = np.array(truth)
        fixes = [static_fix(seen, reading, np.zeros(4)) for reading in readings]
        has = np.array([fix.ok for fix in fixes])
        assert has.mean() == pytest.approx(2 / 3, abs=0.01)
        plain = np.array([fix.state[:3] for fix in fixes])
        pkf = filter_fixes(
            MOVING_UP, constant_velocity(1.0, [0.3, 0.3, 0.05], 3), start[:6], first[:6, :6], fixes
        )
        ekf = run_trials(
            compiled(moving), motion.transition, motion.noise, EKF, start, first,
            np.array(readings)[None],
        )  # fmt: skip
        off["static"].append(np.linalg.norm(plain - truth, axis=1)[has])
        off["pkf"].append(np.linalg.norm(pkf.means[:, [0, 2, 4]] - truth, axis=1))
        off["ekf"].append(np.linalg.norm(ekf.means[0][:, [0, 2, 4]] - truth, axis=1))
    static, pkf, ekf = (np.concatenate(off[name]) for name in ("static", "pkf", "ekf"))
    assert ekf.mean() < pkf.mean()
    assert np.median(pkf) < 0.8 * np.median(static)


def test_what_does_not_fit_is_told():
    fix = StaticFix(np.zeros(2), np.eye(2), True, 1)
    motion = constant_velocity(1.0, 1.0)
    with pytest.raises(InputError, match="PKF"):
        filter_fixes(MOVING, motion, np.zeros(3), np.eye(3), [fix])
    with pytest.raises(InputError, match="components of the position"):
        filter_fixes(MOVING_UP, constant_velocity(1.0, 1.0, 3), np.zeros(6), np.eye(6), [fix])
    assert filter_fixes(MOVING, motion, np.zeros(4), np.eye(4), []).means.shape == (0, 4)
    for state, covariance in ((np.zeros(3), np.eye(2)), (np.zeros(2), np.eye(3))):
        part = StaticFix(state, covariance, True, 1)
        with pytest.raises(InputError, match="components of the position"):
            filter_fixes(MOVING_UP, constant_velocity(1.0, 1.0, 3), np.zeros(6), np.eye(6), [part])
    assert filter_fixes(MOVING, motion, np.zeros(4), np.eye(4), [fix]).used.tolist() == [True]
