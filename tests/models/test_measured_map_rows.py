"""Maps of what was heard against sums over rows, written out."""

from math import exp, log, pi, sqrt

import numpy as np
import pytest

from mapfilter.lattice import Lattice
from mapfilter.models.measured_map import MeasuredMapOptions, MeasuredRows, ServingStatistics

NAN = float("nan")
ROWS, COLS, SIDE_M = 12, 15, 10.0
LATTICE = Lattice("EPSG:32629", 500.0, 1120.0, SIDE_M, ROWS, COLS)
SITE = np.array([0, 1, 0, 2])
# Cell, column, row, timing advance.
TOLD = (
    (0, 3, 4, 5.0),
    (0, 4, 4, 6.0),
    (0, 9, 8, NAN),
    (1, 3, 5, 2.0),
    (1, 3, 5, 9.0),
    (2, 10, 9, 7.0),
    (-1, 5, 5, 3.0),
    (0, 0, 0, 4.0),
    (3, 14, 11, NAN),
)


def rows(told=TOLD):
    cell, col, row, advance = (np.array(column) for column in zip(*told, strict=True))
    east = 500.0 + SIDE_M * (col + 0.3)
    north = 1120.0 - SIDE_M * (row + 0.6)
    return MeasuredRows(cell, east, north, advance.astype(float))


def kernel(sigma):
    """Weights of a Gaussian at whole pixels, cut at three deviations, that sum to one."""
    reach = int(3.0 * sigma + 0.5)
    weight = {k: exp(-0.5 * (k / sigma) ** 2) for k in range(-reach, reach + 1)}
    total = sum(weight.values())
    return {k: w / total for k, w in weight.items()}


def spread(told, value, row, col, reach_m):
    """Sum of values over rows, each by its kernel, scaled to one at its own place."""
    sigma = reach_m / SIDE_M
    weight = kernel(sigma)
    scale = 2 * pi * max(sigma, 1 / sqrt(2 * pi)) ** 2
    return scale * sum(
        value(one) * weight.get(row - one[2], 0.0) * weight.get(col - one[1], 0.0) for one in told
    )


def expected(band, row, col, options):
    """Log share, timing advance and deviation of a cell at a pixel, by the documented formulas."""

    def at(told, power=0):
        return spread(told, lambda one: one[3] ** power, row, col, options.reach_m)

    prior = options.prior_rows
    count = [0.5 + sum(one[0] == c for one in TOLD) for c in range(SITE.size)]
    often = [c / sum(count) for c in count]
    mates = [c for c in range(SITE.size) if SITE[c] == SITE[band]]
    usual, total = sum(often[c] for c in mates), at(TOLD) + prior
    by_site = (at([one for one in TOLD if one[0] in mates]) + prior * usual) / total
    by_cell = (at([one for one in TOLD if one[0] == band]) + prior * often[band]) / total
    share = (1 - options.site_part) * by_cell + options.site_part * by_site * often[band] / usual
    told = [one for one in TOLD if one[0] in mates and one[3] == one[3]]
    moments = []
    for power in (1, 2):
        usually = sum(one[3] ** power for one in told) / len(told) if told else NAN
        for which in (told, [one for one in told if one[0] == band]):
            usually = (at(which, power) + prior * usually) / (at(which) + prior)
        moments.append(usually)
    variance = max(moments[1] - moments[0] ** 2, 0.0) + options.rounding_steps**2
    return log(share), moments[0], sqrt(variance)


PIXELS = ((4, 3), (5, 3), (0, 0), (11, 14), (8, 9), (6, 7), (9, 12))


@pytest.mark.parametrize(
    "options",
    [
        MeasuredMapOptions(),
        MeasuredMapOptions(reach_m=12.0, prior_rows=2.5, site_part=0.4, rounding_steps=0.8),
        # A kernel narrower than a pixel counts rows of the pixel itself as one each.
        MeasuredMapOptions(reach_m=2.0, prior_rows=0.5, site_part=0.0, rounding_steps=0.25),
    ],
    ids=("usual", "other", "narrow"),
)
def test_maps_are_sums_over_rows(options):
    maps = ServingStatistics.of_rows(rows(), LATTICE, SITE, options)
    for found in (maps.log_share, maps.advance_steps, maps.deviation_steps):
        assert found.shape == (4, ROWS * COLS)
        assert found.dtype == np.float32
    for band in range(4):
        for row, col in PIXELS:
            at = row * COLS + col
            found = [
                float(m[band, at])
                for m in (maps.log_share, maps.advance_steps, maps.deviation_steps)
            ]
            assert found == pytest.approx(expected(band, row, col, options), rel=2e-4, nan_ok=True)


def test_shares_of_all_cells_and_of_foreign_ones_sum_to_at_most_one():
    maps = ServingStatistics.of_rows(rows(), LATTICE, SITE, MeasuredMapOptions())
    total = np.exp(maps.log_share.astype(float)).sum(axis=0)
    assert total.max() <= 1 + 1e-6
    # A row of a foreign cell lies at (5, 5); where nothing was heard all goes by the prior.
    assert total[5 * COLS + 5] < 0.95


def test_rows_beyond_the_lattice_do_not_count():
    outside = ((0, -1, 4, 9.0), (1, 3, -1, 9.0), (2, COLS, 4, 9.0), (3, 3, ROWS, 9.0))
    maps = [
        ServingStatistics.of_rows(rows(told), LATTICE, SITE, MeasuredMapOptions())
        for told in (TOLD, TOLD + outside)
    ]
    np.testing.assert_array_equal(maps[0].log_share, maps[1].log_share)
    np.testing.assert_array_equal(maps[0].advance_steps, maps[1].advance_steps)


def test_the_usual_options():
    assert MeasuredMapOptions() == MeasuredMapOptions(30.0, 1.0, 0.1, 0.5)
    assert MeasuredMapOptions(30.0, 1.0, 0.1, 0.5).prior_rows == 1.0


def made():
    return ServingStatistics(
        np.array([[-1.0, -2.0, -3.0], [-4.0, -5.0, -6.0]], dtype=np.float32),
        np.array([[4.0, 5.0, NAN], [1.0, 2.0, 3.0]], dtype=np.float32),
        np.array([[0.5, 2.0, NAN], [1.0, 1.0, 0.25]], dtype=np.float32),
    )


def test_a_served_cell_is_looked_up():
    assert made().log_serving(1, np.array([2, 0], dtype=np.int32)).tolist() == [-6.0, -4.0]


def test_a_timing_advance_is_a_clipped_gaussian():
    pixel = np.array([0, 1, 2], dtype=np.int32)
    found = made().log_advance(0, pixel, 4.5)
    # One and a quarter of a deviation away; nothing is known of the third place.
    assert found.tolist() == pytest.approx([-0.5 + log(2), -0.03125 - log(2), 0.0], abs=1e-6)
    assert found.dtype == np.float32
    # Beyond four deviations it costs 8.
    found = made().log_advance(1, pixel, -2.5)
    assert found.tolist() == pytest.approx([-0.5 * 3.5**2, -8.0, -8.0 + log(4)], abs=1e-6)
