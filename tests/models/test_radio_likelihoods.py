"""Likelihoods of serving cells and of bounds against the scalar oracle."""

import numpy as np
import pytest
import scalar_oracle as oracle

from mapfilter.models import fingerprint
from mapfilter.models.fingerprint import (
    BoundReading,
    RasterFrame,
    ServingWeights,
)

ROWS, COLS, CELLS, RESOLUTION_M = 6, 9, 4, 10.0
BANDS = CELLS + 2


def raster(seed=0, low=-110.0, high=-50.0):
    """Levels in quarters of a dB, then the best and the second best of each pixel."""
    rng = np.random.default_rng(seed)
    level = np.round(4 * rng.uniform(low, high, (ROWS * COLS, CELLS))) / 4
    ordered = np.sort(level, axis=1)
    return np.column_stack([level, ordered[:, -1], ordered[:, -2]]).astype(np.float32)


EVERY = np.arange(ROWS * COLS, dtype=np.int32)


def by_serving(table, cell, weights, weight=1.0, before=0.0, odds=None):
    """Log-likelihoods, added to what is there; a fault is next to impossible without its odds."""
    found = np.full(EVERY.size, before)
    odds = np.full(EVERY.size, -80.0, dtype=np.float32) if odds is None else odds
    margins = fingerprint.serving_table(weights)
    bands = fingerprint.ServingBands(BANDS, cell, BANDS - 2, BANDS - 1)
    given = bands, margins, weight, odds, -weights.fault_nats
    fingerprint.weigh_by_serving(0, EVERY.size, EVERY, table.reshape(-1), *given, found)
    return found


@pytest.mark.parametrize("cell", range(CELLS))
def test_a_serving_cell_counts_by_its_margin_over_the_best_other_cell(cell):
    # Margins within 64 dB in steps of the table are exact but for single precision.
    table, weights = raster(), ServingWeights(hysteresis_db=3.0, sd_db=7.0)
    expected = [oracle.serving_log_likelihood(row[:CELLS], cell, weights) for row in table]
    np.testing.assert_allclose(by_serving(table, cell, weights), expected, rtol=2e-6, atol=1e-7)
    # A quarter of the places are such where the cell itself is the best.
    assert (table[:, cell] == table[:, CELLS]).sum() > 5


def test_the_best_cell_is_not_compared_with_itself():
    table, weights = np.full((ROWS * COLS, BANDS), -100.0, dtype=np.float32), ServingWeights()
    table[:, :CELLS] = [-60.0, -75.0, -90.0, -90.0]
    table[:, CELLS:] = [-60.0, -75.0]
    best, second = (by_serving(table, cell, weights)[0] for cell in (0, 1))
    assert best == pytest.approx(oracle.log_normal_cdf((15.0 + 2.0) / 9.0), rel=1e-6)
    assert second == pytest.approx(oracle.log_normal_cdf((-15.0 + 2.0) / 9.0), rel=1e-6)


def test_a_serving_weight_is_an_exponent_and_adds_to_what_is_there():
    table, weights = raster(), ServingWeights()
    once = by_serving(table, 2, weights)
    found = by_serving(table, 2, weights, 0.25, before=-1.0)
    np.testing.assert_allclose(found, -1.0 + 0.25 * once, rtol=1e-6)


def test_a_serving_cell_may_be_at_fault():
    """The mixture over both, and the odds of the fault given the reading, by Bayes' rule."""
    table, weights, weight = raster(), ServingWeights(fault_nats=1.1), 0.4
    prior = np.linspace(0.01, 0.9, EVERY.size)
    odds = np.log(prior / (1 - prior)).astype(np.float32)
    found = by_serving(table, 1, weights, weight, odds=odds)
    sound = np.array([oracle.serving_log_likelihood(row[:CELLS], 1, weights) for row in table])
    right, wrong = (1 - prior) * np.exp(weight * sound), prior * np.exp(-1.1 * weight)
    np.testing.assert_allclose(found, np.log(right + wrong), rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(odds, np.clip(np.log(wrong / right), -8, 8), rtol=1e-4, atol=1e-4)


def test_readings_against_a_cell_make_its_fault_certain_and_then_cost_the_same_everywhere():
    table, weights = raster(), ServingWeights()
    table[:, :CELLS] = [-60.0, -110.0, -110.0, -110.0]
    table[:, CELLS:] = [-60.0, -110.0]
    odds = np.full(EVERY.size, -2.75, dtype=np.float32)
    costs = [by_serving(table, 1, weights, 0.3, odds=odds)[0] for _ in range(12)]
    assert costs[0] < -0.8
    np.testing.assert_allclose(costs[-1], -0.3 * weights.fault_nats, rtol=0.01)
    np.testing.assert_array_equal(odds, 8.0)


def test_margins_beyond_the_table_count_as_its_ends():
    table = raster()
    table[:, :CELLS] = [-20.0, -120.0, -120.0, -120.0]
    table[:, CELLS:] = [-20.0, -120.0]
    weights = ServingWeights()
    lowest = oracle.log_normal_cdf((-64.0 + weights.hysteresis_db) / weights.sd_db)
    assert by_serving(table, 1, weights)[0] == pytest.approx(lowest, rel=1e-6)
    assert by_serving(table, 0, weights)[0] == pytest.approx(0.0, abs=1e-6)


def by_bound(table, cells, level_dbm, censored, sd_db=9.0, weight=1.0):
    found = np.zeros(EVERY.size)
    bound = BoundReading(np.array(cells, dtype=np.int32), level_dbm, censored, sd_db, weight)
    table, bounds = table.reshape(-1), fingerprint.bound_table()
    fingerprint.weigh_by_bound(EVERY, table, BANDS, bound, bounds, found)
    return found


@pytest.mark.parametrize("censored", [-1, 1])
@pytest.mark.parametrize("cells", [(1,), (3, 0), (0, 1, 2, 3)])
def test_a_bound_is_the_probability_of_its_side(censored, cells):
    # A deviation of 8 dB and levels in quarters lie on the steps of the table.
    table, level_dbm, weight = raster(3), -78.5, 0.6
    expected = [
        weight * oracle.bound_log_likelihood(level_dbm, [float(row[c]) for c in cells], censored, 8)
        for row in table
    ]
    found = by_bound(table, cells, level_dbm, censored, 8.0, weight)
    np.testing.assert_allclose(found, expected, rtol=2e-5, atol=2e-6)


def test_a_level_below_the_scale_is_likelier_where_the_prediction_is_low():
    table = np.full((ROWS * COLS, BANDS), -70.0, dtype=np.float32)
    table[0] = -130.0
    quiet, loud = by_bound(table, (0,), -110.5, -1)[:2]
    assert quiet > -0.05
    assert loud < -5.0
    quiet, loud = by_bound(table, (0,), -80.5, 1)[:2]
    assert quiet < -5.0
    assert -0.2 < loud < -0.1


@pytest.mark.parametrize("cells", [(2,), (1, 3), (0, 1, 2)])
def test_an_ambiguous_level_is_the_mean_over_its_candidates(cells):
    # Deviations stay below the 4 at which the kernel clips them.
    table, level_dbm = raster(4, -95.0, -65.0), -80.0
    expected = [
        0.5 * oracle.bound_log_likelihood(level_dbm, [float(row[c]) for c in cells], 0, 9.0)
        for row in table
    ]
    found = by_bound(table, cells, level_dbm, 0, weight=0.5)
    np.testing.assert_allclose(found, expected, rtol=2e-5, atol=2e-6)


def test_an_ambiguous_level_far_from_all_candidates_counts_as_four_deviations():
    table = np.full((ROWS * COLS, BANDS), -60.0, dtype=np.float32)
    for level_dbm in (-110.0, -10.0):
        assert by_bound(table, (0, 1), level_dbm, 0, 9.0)[0] == pytest.approx(-8.0, rel=1e-5)


def pixels(state):
    frame = RasterFrame(0.0, ROWS * RESOLUTION_M, 1 / RESOLUTION_M, ROWS, COLS)
    return fingerprint.pixels(state, frame)


def hypotheses(count=400, seed=5):
    """Places within the raster and up to 20 m beyond it."""
    rng = np.random.default_rng(seed)
    state = np.zeros((5, count), dtype=np.float32)
    state[0] = rng.uniform(-20.0, COLS * RESOLUTION_M + 20.0, count)
    state[1] = rng.uniform(-20.0, ROWS * RESOLUTION_M + 20.0, count)
    state[2] = rng.uniform(-3.0, 3.0, count)
    state[3] = rng.normal(0.0, 0.2, count)
    return state


def off_edge(east_m, north_m):
    """Whether a place is so far from pixel edges that single precision cannot matter."""
    within = np.array([east_m, north_m]) / RESOLUTION_M
    return bool(np.all(np.abs(within - np.round(within)) > 1e-4))


def test_each_hypothesis_has_the_pixel_that_holds_it_or_that_of_the_edge():
    state, compared = hypotheses(), 0
    for place, found in zip(state[:2].T.astype(float), pixels(state), strict=True):
        if off_edge(*place):
            row, col = oracle.pixel_of(*place, RESOLUTION_M, ROWS, COLS)
            assert found == row * COLS + col
            compared += 1
    assert compared > 390
