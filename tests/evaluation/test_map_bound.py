"""Bounds of made radio maps whose answers are known."""

import numpy as np
import pytest
from radio_maps import FLOOR_DBM, made_map

from mapfilter.errors import ConfigError
from mapfilter.evaluation.first_fix import FirstFixOptions, first_fix, starts
from mapfilter.evaluation.map_bound import BANDS, distinctness, map_bound
from mapfilter.evaluation.position_bound import position_bound
from mapfilter.evaluation.radio_map import ErrorModel, distance_squared, received_cells


def slopes(rows, cols, *per_m):
    """Levels that fall evenly to the north and east, in dB per metre."""
    row, col = np.mgrid[:rows, :cols]
    return np.stack([-60 + 5 * (north * row + east * col) for north, east in per_m], axis=-1)


def test_the_bound_of_even_slopes_is_that_of_the_textbook():
    # Two cells that tell one direction each: J = diag(0.1², 0.05²) / 7².
    level = slopes(40, 40, (0.1, 0.0), (0.0, 0.05))
    radio = made_map(level, np.ones((40, 40), dtype=bool))
    bound = position_bound(radio, ErrorModel(7.0, 50.0, 0.0))
    assert bound.plane_m == pytest.approx(np.hypot(70, 140), rel=1e-3)


def test_errors_that_a_site_shares_tell_less_where_cells_rise_together_and_more_where_not():
    errors = ErrorModel(7.0, 50.0, 0.5)
    everywhere = np.ones((40, 40), dtype=bool)
    for second, sums in (((0.1, 0.0), 0.2), ((-0.1, 0.0), 0.0)):
        level = slopes(40, 40, (0.1, 0.0), second, (0.0, 0.1))
        radio = made_map(level, everywhere, site=[0, 0, 1])
        # 2 x 2 covariance 49 [[1, 0.5], [0.5, 1]] by hand; the third cell stands alone.
        north = (2 * 0.01 - 0.5 / 1.5 * sums**2) / (49 * 0.5)
        bound = position_bound(radio, errors)
        assert bound.plane_m == pytest.approx(np.sqrt(1 / north + 49 / 0.01), rel=1e-3)


def test_on_one_street_only_the_way_along_it_is_told():
    on_way = np.zeros((21, 60), dtype=bool)
    on_way[10] = True
    radio = made_map(slopes(21, 60, (0.2, 0.1)), on_way)
    bound = position_bound(radio, ErrorModel(7.0, 50.0, 0.0))
    assert np.isinf(bound.plane_m).all()
    assert bound.along_m == pytest.approx(70.0, rel=1e-3)


def test_distances_are_those_of_the_inverse_matrix():
    rng = np.random.default_rng(0)
    site = np.array([2, 0, 1, 0, 2, 2, 1, 0, 3])
    for _ in range(20):
        level = rng.uniform(-120, -60, site.size).astype(np.float32)
        cells, part = np.empty(7, dtype=np.int64), np.empty(7)
        count = received_cells(
            level, FLOOR_DBM, site, np.zeros(9, dtype=np.int64), 0.4, cells, part
        )
        heard = np.flatnonzero(level > FLOOR_DBM)
        strongest = heard[np.argsort(-level[heard], kind="stable")][:7]
        assert sorted(cells[:count]) == sorted(strongest)
        off_db = rng.normal(0, 10, 7)
        own = site[cells[:count]]
        matrix = 0.6 * np.eye(count) + 0.4 * (own[:, None] == own[None, :])
        whole = off_db[:count] @ np.linalg.solve(matrix, off_db[:count]) * 0.6
        assert distance_squared(off_db, part, count) == pytest.approx(whole)


def test_bits_of_two_halves():
    # Each cell serves one half alone, by levels of which all are equal.
    level = np.full((10, 40, 2), -100.0)
    level[:, :20, 0] = level[:, 20:, 1] = -60.0
    found = distinctness(made_map(level, np.ones((10, 40), dtype=bool)), ErrorModel())
    assert found.cell_bits == pytest.approx(1.0)
    assert found.level_bits == pytest.approx(0.0, abs=1e-9)


def test_bits_of_levels_are_those_of_the_bhattacharyya_coefficient():
    level = np.full((2, 50, 1), -60.0)
    level[0] = -74.0
    found = distinctness(made_map(level, np.ones((2, 50), dtype=bool)), ErrorModel(7.0, 50.0, 0.0))
    assert found.level_bits == pytest.approx(-np.log2((1 + np.exp(-(2.0**2) / 8)) / 2), rel=1e-6)


def plain_grid(size=121, period=20, width=2):
    on_way = np.zeros((size, size), dtype=bool)
    for start in range(0, size, period):
        on_way[start : start + width] = True
        on_way[:, start : start + width] = True
    return on_way


def test_a_map_of_one_level_and_equal_blocks_is_full_of_twins_and_never_clear():
    on_way = plain_grid()
    radio = made_map(np.full((*on_way.shape, 1), -60.0), on_way)
    options = FirstFixOptions(spacing_m=150.0, most_m=300.0)
    found = first_fix(radio, ErrorModel(), options, np.random.default_rng(0))
    assert np.isinf(found.cells_m).all()
    assert np.isinf(found.levels_m).all()
    assert (found.twin_error[found.twin >= 0] == 0.5).all()
    assert (found.twin >= 0).mean() > 0.9


def test_levels_that_name_every_place_are_clear_at_once_and_right():
    on_way = plain_grid()
    row, col = np.mgrid[: on_way.shape[0], : on_way.shape[1]]
    level = np.stack([-60.0 + row * 0.0, -60 - 0.3 * row, -60 - 0.3 * col], axis=-1)
    radio = made_map(level, on_way)
    found = first_fix(
        radio,
        ErrorModel(deviation_db=0.3, site_share=0.0),
        FirstFixOptions(spacing_m=150.0, most_m=300.0),
        np.random.default_rng(0),
    )
    assert (found.levels_m == 0).all()
    assert found.right.all()
    assert found.twin_error.max() < 1e-6
    assert (found.levels_bits > 6).all()


def test_information_is_never_more_than_there_was_to_know():
    rng = np.random.default_rng(3)
    on_way = plain_grid()
    radio = made_map(rng.normal(-70, 8, (*on_way.shape, 3)), on_way)
    found = first_fix(radio, ErrorModel(), FirstFixOptions(spacing_m=100.0), rng)
    assert found.cells_bits.min() >= 0
    assert max(found.cells_bits.max(), found.levels_bits.max()) <= np.log2(len(radio)) + 1e-9


def test_smaller_errors_are_clear_sooner():
    rng = np.random.default_rng(1)
    on_way = plain_grid()
    steps = rng.normal(-75, 10, (13, 13, 3)).repeat(10, axis=0).repeat(10, axis=1)
    radio = made_map(steps[:121, :121], on_way)
    metres = [
        np.minimum(
            first_fix(
                radio, ErrorModel(deviation), FirstFixOptions(60.0), np.random.default_rng(2)
            ).levels_m,
            1500,
        ).mean()
        for deviation in (2.0, 5.0, 12.0)
    ]
    assert metres[0] < metres[1] < metres[2]


def test_equal_seeds_give_equal_bounds_and_tables_say_where_nothing_was_tried():
    on_way = plain_grid()
    way_id = np.where(np.arange(121)[:, None] < 60, 7, 9) * np.ones((1, 121), dtype=np.int64)
    level = np.random.default_rng(0).normal(-70, 8, (*on_way.shape, 2))
    radio = made_map(level, on_way, way_id=way_id)
    options = FirstFixOptions(spacing_m=2000.0)
    first, again = (
        map_bound(radio, ErrorModel(), options, np.random.default_rng(5)) for _ in range(2)
    )
    assert first.by_way().equals(again.by_way())
    assert repr(first).startswith("<MapBound: ")
    assert "\n" not in repr(first)
    columns = first.at_points()
    assert list(columns) == [name for name, _ in BANDS]
    assert all(values.shape == (len(radio),) for values in columns.values())
    table = first.by_way()
    assert table["way_id"].tolist() == [7, 9]
    assert table["points"].sum() == len(radio)
    assert table["starts"].tolist() == [1, 0]
    assert np.isnan(table["cells_to_fix_m"][1])
    assert {"apart_m", "twin_error"} <= set(first.twins().columns)


def test_starts_are_one_to_a_square():
    radio = made_map(np.full((40, 40, 1), -60.0), np.ones((40, 40), dtype=bool))
    assert starts(radio, 50.0).size == 16
    assert starts(radio, 5.0).size == 1600


def test_looks_along_a_path_are_those_of_the_best_estimate_of_a_mean():
    # The matrix form of the same, on a fine grid.
    place_m = np.linspace(0.0, 300.0, 601)
    matrix = np.exp(-np.abs(place_m[:, None] - place_m[None, :]) / 50.0)
    assert np.linalg.solve(matrix, np.ones(601)).sum() == pytest.approx(4.0, rel=1e-4)
    assert ErrorModel(7.0, 50.0).looks(300.0) == 4.0


def test_impossible_settings_are_all_told_at_once():
    with pytest.raises(ConfigError) as told:
        ErrorModel(0.0, -1.0, 1.0)
    assert len(told.value.faults) == 3
    with pytest.raises(ConfigError) as told:
        FirstFixOptions(spacing_m=0.0, journeys=0, most_m=1e9, mass=0.2)
    assert len(told.value.faults) == 4


def test_a_report_holds_the_cells_of_the_strongest_one_s_layer():
    layer, site = np.array([1, 0, 1, 0, 1]), np.array([0, 0, 1, 1, 2])
    level = np.array([-90.0, -60.0, -70.0, -80.0, FLOOR_DBM], dtype=np.float32)
    cells, part = np.empty(7, dtype=np.int64), np.empty(7)
    count = received_cells(level, FLOOR_DBM, site, layer, 0.4, cells, part)
    assert cells[:count].tolist() == [1, 3]
    level[0] = -50.0
    count = received_cells(level, FLOOR_DBM, site, layer, 0.4, cells, part)
    assert cells[:count].tolist() == [0, 2]


def test_copies_of_all_cells_on_a_second_carrier_bound_nothing_better():
    on_way = plain_grid()
    level = slopes(*on_way.shape, (0.1, 0.0), (0.0, 0.05), (-0.05, 0.05))
    both = np.concatenate([level, level - 4.0], axis=-1)
    options = FirstFixOptions(spacing_m=200.0, most_m=300.0)
    one, two, taken_for_one = (
        map_bound(
            made_map(levels, on_way, layer=layers), ErrorModel(), options, np.random.default_rng(4)
        )
        for levels, layers in ((level, [0] * 3), (both, [0] * 3 + [1] * 3), (both, [0] * 6))
    )
    assert np.array_equal(two.position.plane_m, one.position.plane_m)
    assert np.array_equal(two.distinct.cell_bits, one.distinct.cell_bits)
    assert np.array_equal(two.distinct.level_bits, one.distinct.level_bits)
    assert np.array_equal(two.fix.cells_m, one.fix.cells_m)
    better = np.median(taken_for_one.position.plane_m) / np.median(one.position.plane_m)
    assert better == pytest.approx(np.sqrt(0.5))
    assert taken_for_one.distinct.level_bits.mean() > one.distinct.level_bits.mean()


def test_a_cell_serves_where_it_is_strong_within_its_layer():
    # The second carrier is 20 dB weaker all over, and has a border of its own.
    level = np.full((4, 40, 3), -60.0)
    level[..., 1:] = FLOOR_DBM
    level[:, :10, 1] = level[:, 10:, 2] = -80.0
    on_way = np.ones((4, 40), dtype=bool)
    first, point = made_map(level, on_way, layer=[0, 1, 1]).points_by_cell()
    assert np.diff(first).tolist() == [160, 40, 120]
    assert set(point[first[1] : first[2]] % 40) == set(range(10))
    first, _ = made_map(level, on_way).points_by_cell()
    assert np.diff(first).tolist() == [160, 0, 0]
