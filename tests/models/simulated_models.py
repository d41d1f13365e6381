"""Kernels of a graphics processor beside those of the processor, in numba's simulator.

Run by :mod:`test_device_kernels` in a process of its own. What the kernels of the processor are
given is that of :mod:`test_model_kernel_parts`.
"""

from math import nan

import numpy as np
import pytest
from numba import config
from test_model_kernel_parts import (
    BANDS,
    COLS,
    FRAME,
    PIXEL_M,
    ROWS,
    Particles,
    absence,
    ageing,
    levels,
    pixels,
    serving,
)

from mapfilter import _cuda
from mapfilter.models import cuda_motion, cuda_reports, fingerprint
from mapfilter.models.fingerprint import BoundReading, bound_table
from mapfilter.models.level_kernels import Prediction
from mapfilter.models.street_motion import MotionErrors, move
from mapfilter.models.way_map import MapWeights, WayMap, weigh_by_ways

assert config.ENABLE_CUDASIM
BLOCK, COUNT = 32, 70
"""Threads of a block, and hypotheses: more than one block, the last of which is not full."""
SIZE_M = COLS * PIXEL_M, ROWS * PIXEL_M


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch):
    """The simulator starts all threads of a block, also those that have nothing to do."""
    monkeypatch.setattr(_cuda, "_THREADS", BLOCK)


def prediction(p):
    return Prediction(p.level_dbm, p.rough, BANDS, 0.3)


def done(one):
    """Return particles after a kernel of the processor, and what it was given."""
    p = Particles(COUNT)
    kernel, given, changed = one(p)
    kernel(0, COUNT, *given)
    return p, given, changed


@pytest.mark.parametrize("step_m", [1.4, -0.7, 0.0])
@pytest.mark.parametrize(("more", "rows"), [(0, 1.0), (1, 1.0), (0, 4.0)])
def test_motion(step_m, more, rows):
    p, key = Particles(COUNT), np.uint64(2**63 + 11)
    state = np.vstack([p.state[:8], p.state[:more] - 7.0])
    errors = MotionErrors(disturbances_per_m=0.3, rate_rad_per_m=0.02, rescales_per_m=0.3)
    found = np.full_like(state, nan)
    cuda_motion.move(state, step_m, 2.5, errors, key, found, 0.2, rows)
    expected = move(state, step_m, 2.5, errors, key, 0.2, rows)
    np.testing.assert_allclose(found, expected, rtol=2e-6, atol=1e-5)
    assert step_m == 0 or np.abs(found[:2] - state[:2]).max() > 0.5


@pytest.mark.parametrize("beyond", [-0.18, nan])
def test_map(beyond):
    p, factors = Particles(COUNT), MapWeights().over(9.0)
    state, weighed = p.state.copy(), p.log_weight.copy()
    # The edges themselves are inside, and hypotheses sure to be on or off the map count as such.
    for array in (state, p.state):
        array[0, :4], array[1, :4] = (0.0, SIZE_M[0], 20.0, 20.0), (30.0, 30.0, 0.0, SIZE_M[1])
        array[4, 4:6] = 0.0, 1.0
    cuda_motion.weigh_by_ways(state, p.map, PIXEL_M, SIZE_M, factors, beyond, weighed)
    expected = np.full(COUNT, nan)
    ways = WayMap(p.map, PIXEL_M, *SIZE_M)
    weigh_by_ways(0, COUNT, p.state, ways, factors, beyond, p.log_weight, expected)
    np.testing.assert_allclose(state, p.state, rtol=2e-6, atol=1e-6)
    np.testing.assert_allclose(weighed, expected, rtol=0, atol=5e-6)
    assert np.ptp(weighed - p.log_weight) > 0.1


def test_pixels():
    p, _, (expected,) = done(pixels)
    found = np.full(COUNT, -1, np.int32)
    cuda_reports.pixels(p.state, FRAME, found)
    np.testing.assert_array_equal(found, expected)
    assert len(np.unique(found)) > 30


def test_ageing():
    p, (given,), (expected,) = done(ageing)
    kept, usual = np.ascontiguousarray(p.kept), given.fault_log_odds
    cuda_reports.age(kept, given.decay, given.fault_keep, usual)
    np.testing.assert_allclose(kept, expected, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("cell", [0, 1, 3])
def test_the_serving_cell(cell):
    """The best and the second best level of all cells are in the last two bands."""
    p, found = Particles(COUNT), Particles(COUNT)
    level = p.level_dbm.reshape(-1, BANDS)
    level[:, -1:-3:-1] = np.sort(level[:, :-2], axis=1)[:, -2:]
    _, given, _ = serving(p)
    pixel, _, bands, table, weight, odds, other, _ = given
    given[2], before = bands._replace(serving=cell), odds.copy()
    fingerprint.weigh_by_serving(0, COUNT, *given)
    best = prediction(p), cell, bands.strongest, table, weight, before, other, found.log_weight
    cuda_reports.weigh_by_serving(pixel, *best)
    np.testing.assert_allclose(before, odds, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(found.log_weight, p.log_weight, rtol=0, atol=1e-5)


def test_levels():
    p, (*_, predicted, terms, weight, _), _ = done(levels)
    found = Particles(COUNT)
    kept = np.ascontiguousarray(found.kept)
    cuda_reports.weigh_by_levels(kept, p.pixel, predicted, terms, weight, found.log_weight)
    np.testing.assert_allclose(found.log_weight, p.log_weight, rtol=0, atol=2e-5)
    np.testing.assert_allclose(kept, p.kept, rtol=1e-4, atol=2e-4)


def test_absence():
    p, (*_, predicted, terms, table, weight, _), _ = done(absence)
    found = Particles(COUNT)
    kept = np.ascontiguousarray(found.kept)
    cuda_reports.weigh_by_absence(kept, p.pixel, predicted, terms, table, weight, found.log_weight)
    np.testing.assert_allclose(found.log_weight, p.log_weight, rtol=0, atol=2e-5)
    np.testing.assert_allclose(kept, p.kept, rtol=1e-4, atol=2e-4)


@pytest.mark.parametrize("censored", [-1, 0, 1])
@pytest.mark.parametrize("sd_db", [2.0, 9.0])
@pytest.mark.parametrize("cells", [(1,), (3, 0, 2)])
def test_bounds(censored, sd_db, cells):
    p, expected = Particles(COUNT), Particles(COUNT).log_weight
    bound = BoundReading(np.array(cells, np.int32), -84.0, censored, sd_db, 0.4)
    given = p.level_dbm, BANDS, bound, bound_table()
    fingerprint.weigh_by_bound(p.pixel, *given, expected)
    cells = bound.cells
    cuda_reports.weigh_by_bound(p.pixel, prediction(p), bound, cells, bound_table(), p.log_weight)
    np.testing.assert_allclose(p.log_weight, expected, rtol=0, atol=2e-5)
