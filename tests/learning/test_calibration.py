"""Mean errors of classes of cells, likelihoods and weights, against plain formulas."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import norm

from mapfilter.learning import calibration
from mapfilter.learning.calibration import Calibration, calibrate
from mapfilter.learning.likelihood import (
    OFFSETS_DB,
    excess_db,
    log_likelihoods,
    marginal,
    posterior_offset,
    report_log_likelihood,
    report_slope,
    visit_weights,
)
from mapfilter.learning.offset_sums import OffsetSums
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


def test_derivatives_are_those_of_the_cost(monkeypatch):
    """Also by the offset of a cell that is a fault; wrong ones end a search in another place."""
    asked = []

    def searched(cost, first, **options):
        asked.append((cost, first))
        return minimize(cost, first, **options)

    monkeypatch.setattr(calibration, "minimize", searched)
    fitted((0.0, 1.0, 9.0), 40)
    cost, first = asked[0]
    for at in (first + 0.5, first + np.array([-3.0, 2.0, 0.1, 4.0, 9.0])):
        steps = 1e-5 * np.eye(at.size)
        found = [(cost(at + by)[0] - cost(at - by)[0]) / 2e-5 for by in steps]
        np.testing.assert_allclose(cost(at)[1], found, rtol=0, atol=1e-6)


def test_likelihoods_are_those_of_a_normal_error_with_outliers():
    visits = visits_of([-80.0, -100.0, -90.0], [True, False, False])
    expected = np.array([-85.0, -95.0, np.nan])
    found = log_likelihoods(visits, expected, -104.0, 8.0)
    for at, offset_db in enumerate(OFFSETS_DB):
        heard = math.log(0.9 * norm.pdf(-80.0, -85.0 + offset_db, 8.0) + 0.1 / 60.0)
        missed = math.log(0.9 * norm.cdf(-100.0, -95.0 + offset_db, 8.0) + 0.1)
        assert found[:, at] == pytest.approx([heard, missed, 0.0])


@pytest.mark.parametrize("received", [True, False])
def test_slopes_are_those_of_the_likelihood(received):
    z, step = np.linspace(-9.0, 9.0, 37), 1e-5
    are_levels = np.full(z.size, received)
    after, before = (report_log_likelihood(z + by, are_levels, 7.0) for by in (step, -step))
    found = report_slope(z, are_levels, 7.0)
    assert np.ptp(found) > 0.3
    np.testing.assert_allclose(found, (after - before) / (2 * step), rtol=0, atol=1e-8)


@pytest.mark.parametrize("sd_db", [5.0, 9.0, 14.0])
@pytest.mark.parametrize("offsets_db", [OFFSETS_DB, np.arange(-24.0, 24.5, 4.0)])
def test_sums_over_visits_are_those_of_their_likelihoods(sd_db, offsets_db):
    """Also of levels that are far from all offsets, at both ends of the range, and below it."""
    rng = np.random.default_rng(3)
    level_dbm = np.concatenate([rng.uniform(-130.0, -40.0, 300), [-900.0, 700.0, -220.0, 60.0]])
    received = rng.random(level_dbm.size) < 0.6
    expected = rng.uniform(-120.0, -50.0, level_dbm.size)
    expected[::7] = np.nan
    weight = rng.random(level_dbm.size)
    visits, sums = visits_of(level_dbm, received), OffsetSums(sd_db, offsets_db)
    each = log_likelihoods(visits, expected, -104.0, sd_db, offsets_db)
    above_db = excess_db(visits, expected, -104.0)
    assert 10 < np.isnan(above_db).sum() < 40
    found = sums.of(above_db, received, weight)
    np.testing.assert_allclose(found, weight @ each, rtol=0, atol=4e-6 * weight.sum())
    # Several cases at once, such as places of a cell.
    both = sums.of(np.stack([above_db + 3.0, above_db]), received, weight)
    np.testing.assert_allclose(both[1], found, rtol=1e-13)
    np.testing.assert_allclose(both[0], sums.of(above_db + 3.0, received, weight), rtol=1e-13)


@pytest.mark.parametrize("sd_db", [5.0, 14.0])
@pytest.mark.parametrize("received", [True, False])
def test_a_sum_is_right_between_nodes_as_well(sd_db, received):
    above_db = np.linspace(-90.0, 90.0, 1801)
    are_levels, sums = np.full(above_db.size, received), OffsetSums(sd_db, OFFSETS_DB)
    each = report_log_likelihood((above_db[:, None] - OFFSETS_DB) / sd_db, are_levels, sd_db)
    one = np.ones(1)
    found = [sums.of(above_db[[k]], are_levels[[k]], one) for k in range(above_db.size)]
    np.testing.assert_allclose(found, each, rtol=0, atol=4e-6)


def test_no_visits_add_up_to_nothing():
    none = np.zeros(0)
    assert (
        OffsetSums(8.0, OFFSETS_DB).of(none, none.astype(bool), none).tolist()
        == [0.0] * OFFSETS_DB.size
    )


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
