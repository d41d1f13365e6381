"""Mean errors of classes of cells, likelihoods and weights, against plain formulas."""

import math

import numpy as np
import pytest
from scipy.stats import norm

from mapfilter.learning.calibration import Calibration, calibrate
from mapfilter.learning.likelihood import (
    OFFSETS_DB,
    log_likelihoods,
    marginal,
    posterior_offset,
    visit_weights,
)
from mapfilter.learning.visits import Visits


def visits_of(level_dbm, received, cell=None, square=None):
    count = len(level_dbm)
    zero = np.zeros(count, dtype=np.int64)
    return Visits(
        np.arange(count),
        zero if cell is None else np.array(cell),
        zero if square is None else np.array(square),
        np.zeros(count),
        np.zeros(count),
        np.array(level_dbm, dtype=float),
        np.array(received),
    )


def drawn(offsets_db, visits, rng, *, offset_db=-4.0, slope_db=5.0, bound_db=-60.0):
    """Excess of levels over their prediction; what is below the bound is not heard."""
    cell = np.repeat(np.arange(len(offsets_db)), visits)
    distance = 10 ** rng.uniform(1.7, 3.0, cell.size)
    mean = offset_db + slope_db * np.log10(distance / 300.0) + np.array(offsets_db)[cell]
    excess = mean + 6.0 * rng.standard_normal(cell.size)
    received = excess >= bound_db
    return np.where(received, excess, bound_db), received, cell, distance


def fitted(offsets_db, visits, seed=0, **options):
    excess, received, cell, distance = drawn(
        offsets_db, visits, np.random.default_rng(seed), **options
    )
    weight = np.full(cell.size, 0.3)
    return calibrate(excess, received, cell, distance, weight, 6.0, Calibration())


def test_offset_and_slope_of_sound_cells_are_found():
    found = fitted((0.0, 1.0, -1.0, 0.5), 300)
    assert found.offset_db == pytest.approx(-4.0, abs=1.0)
    assert found.slope_db == pytest.approx(5.0, abs=2.0)
    assert found.at(np.array([300.0])) == pytest.approx(found.offset_db)
    assert found.at(np.array([3000.0])) == pytest.approx(found.offset_db + found.slope_db)


@pytest.mark.parametrize("fault_db", [-10.0, 10.0])
def test_a_faulty_cell_with_most_of_the_visits_does_not_draw_its_class(fault_db):
    found = fitted((0.0, 0.0, fault_db), (100, 100, 700))
    assert found.offset_db == pytest.approx(-4.0, abs=2.0)


def test_levels_that_are_not_heard_count():
    # Of what lies around the bound only the upper half is heard.
    found = fitted((0.0, 0.0, 0.0), 400, bound_db=-4.0, slope_db=0.0)
    assert found.offset_db == pytest.approx(-4.0, abs=1.0)


def test_too_few_levels_change_nothing():
    start = Calibration(1.5, -2.0)
    few = np.zeros(5), np.ones(5, dtype=bool), np.zeros(5, dtype=int), np.full(5, 100.0)
    assert calibrate(*few, np.ones(5), 6.0, start) is start


def test_likelihoods_are_those_of_a_normal_error_with_outliers():
    visits = visits_of([-80.0, -100.0, -90.0], [True, False, False])
    expected = np.array([-85.0, -95.0, np.nan])
    found = log_likelihoods(visits, expected, -104.0, 8.0)
    for at, offset_db in enumerate(OFFSETS_DB):
        heard = math.log(0.9 * norm.pdf(-80.0, -85.0 + offset_db, 8.0) + 0.1 / 60.0)
        missed = math.log(0.9 * norm.cdf(-100.0, -95.0 + offset_db, 8.0) + 0.1)
        assert found[:, at] == pytest.approx([heard, missed, 0.0])


def test_offsets_are_integrated_and_estimated_as_in_closed_form():
    # One level of N(b, 4²) about 6 dB, b of N(0, 3²).
    by_offset = norm.logpdf(6.0, OFFSETS_DB, 4.0)
    assert marginal(by_offset, 3.0) == pytest.approx(norm.logpdf(6.0, 0.0, 5.0), abs=0.01)
    mean, sd = posterior_offset(by_offset, 3.0)
    assert mean == pytest.approx(6.0 * 9.0 / 25.0, abs=0.02)
    assert sd == pytest.approx(12.0 / 5.0, abs=0.02)


def test_visits_of_one_square_count_less_than_their_number():
    visits = visits_of([0.0] * 5, [True] * 5, cell=[0, 0, 0, 1, 0], square=[7, 7, 7, 7, 8])
    alone = 0.5
    assert visit_weights(visits) == pytest.approx(
        [alone / 2.4, alone / 2.4, alone / 2.4, alone, alone]
    )
    assert visit_weights(visits.where(np.zeros(0, dtype=int))).size == 0
