"""Compiled arithmetic of level errors is that of the same formulas over arrays, to the last bit."""

import numpy as np
import pytest

from mapfilter.models.level_covariance import absence_gains, aged, sequential_updates
from mapfilter.models.level_kernels import Prediction, gained, rough_squares, shares_above

SLOTS = 5
SIZE = 2 * SLOTS + 1


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def covariance_of(rng):
    root = rng.normal(0.0, 4.0, (SIZE, SIZE))
    return root @ root.T


def column_of(covariance, slot):
    return covariance[:, slot] + covariance[:, SLOTS + slot] + covariance[:, -1]


def test_errors_decay_towards_the_prior(rng):
    now, prior = covariance_of(rng), covariance_of(rng)
    dbm, db2 = rng.normal(-90.0, 5.0, SLOTS), rng.uniform(10.0, 200.0, SLOTS)
    found = aged(now, prior, 0.9, 0.4, (dbm, -90.0, 0.7), (db2, 225.0, 0.49))
    decay = np.array([0.9] * SLOTS + [0.4] * SLOTS + [1.0])
    both = np.outer(decay, decay)
    expected = (
        now * both + prior * (1 - both),
        decay.astype(np.float32),
        -90.0 + (dbm + 90.0) * 0.7,
        225.0 + (db2 - 225.0) * 0.49,
    )
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)
        assert one.dtype == other.dtype


def test_levels_update_one_after_the_other(rng):
    covariance, slot = covariance_of(rng), np.array([3, 0, 4], dtype=np.int32)
    level = np.array([-70.0, -81.0, -95.0], dtype=np.float32)
    rough = np.array([1.0, 2.0, 3.0])
    dbm, db2 = rng.normal(-90.0, 5.0, SLOTS), rng.uniform(10.0, 200.0, SLOTS)
    exact, left_dbm, left_db2 = covariance.copy(), dbm.copy(), db2.copy()
    gain, variance, other = sequential_updates(covariance, slot, level, 12.0, rough, dbm, db2, 1e-4)
    for k, s in enumerate(slot):
        column = column_of(exact, s)
        own = column[s] + column[SLOTS + s] + column[-1] + 12.0
        by = column / own
        exact -= np.outer(by, column)
        assert variance[k] == np.float32(own)
        np.testing.assert_array_equal(gain[k], np.where(np.abs(by) < 1e-4, 0.0, by).astype("f4"))
        off, spread = level[k] - left_dbm[s], left_db2[s] + rough[k]
        assert other[k] == np.float32(-0.5 * off * off / spread - 0.5 * np.log(spread))
        left_dbm[s] += left_db2[s] / spread * off
        left_db2[s] *= 1 - left_db2[s] / spread
    np.testing.assert_array_equal(covariance, exact)
    np.testing.assert_array_equal(dbm, left_dbm)
    np.testing.assert_array_equal(db2, left_db2)


def test_absent_cells_leave_the_covariance(rng):
    covariance, slot = covariance_of(rng), np.array([1, 2], dtype=np.int32)
    before = covariance.copy()
    gain, variance = absence_gains(covariance, slot, 20.0, 0.4)
    np.testing.assert_array_equal(covariance, before)
    for k, s in enumerate(slot):
        column = column_of(before, s)
        own = column[s] + column[SLOTS + s] + column[-1] + 20.0
        by = column / own
        assert variance[k] == np.float32(own)
        np.testing.assert_array_equal(gain[k], np.where(np.abs(by) < 0.4, 0.0, by).astype("f4"))
        assert (np.abs(by) < 0.4).any()


@pytest.mark.parametrize("every", [1, 3])
def test_some_hypotheses_stand_for_all(rng, every):
    levels = rng.uniform(-110.0, -60.0, (40, 6)).astype(np.float32)
    rough = rng.integers(0, 255, (40, 6)).astype(np.uint8)
    pixel, cell = rng.integers(0, 40, 301).astype(np.int32), np.array([4, 0, 2], dtype=np.int32)
    predicted = Prediction(levels.ravel(), rough.ravel(), 6, 1.0)
    some = pixel[::every]
    limit_dbm = np.array([-85.0, -70.0, -100.0], dtype=np.float32)
    above = levels[some][:, cell] > limit_dbm
    np.testing.assert_array_equal(
        shares_above(pixel, every, predicted, cell, limit_dbm), above.mean(axis=0)
    )
    found = rough_squares(pixel, every, predicted, cell)
    np.testing.assert_array_equal(found, ((0.1 * rough[some][:, cell]) ** 2).T)


def test_what_has_no_weight_gains_nothing():
    before = np.array([-1.0, -np.inf, -2.0])
    after = np.array([-0.5, -np.inf, -np.inf])
    assert gained(before, after, 0.7).tolist() == [0.35, 0.0, 0.0]
