"""The map's bounds against their definitions in matrices."""

import numpy as np
import pytest
from radio_maps import FLOOR_DBM, made_map

from mapfilter.evaluation.map_bound import COMPARED, distinctness
from mapfilter.evaluation.position_bound import position_bound
from mapfilter.evaluation.radio_map import ErrorModel


def strongest(level_dbm):
    heard = np.flatnonzero(level_dbm > FLOOR_DBM)
    return heard[np.argsort(-level_dbm[heard], kind="stable")][:7]


def covariance_of(site, errors):
    same = site[:, None] == site[None, :]
    share = errors.site_share
    return errors.deviation_db**2 * ((1 - share) * np.eye(site.size) + share * same)


def position_by_definition(radio, errors, street_m=25.0, narrow=0.25):
    """Fit planes to the levels around each point and put their slopes through the inverse."""
    side_m = radio.lattice.resolution_m
    reach = max(errors.correlation_m / side_m, 1.0)
    way = np.zeros(radio.on_way.shape, dtype=int)
    way[radio.row, radio.col] = radio.way_id
    place = np.column_stack([radio.row, radio.col]).astype(float)
    plane, along = [], []
    for here in place.astype(int):
        off = place - here
        squared = (off**2).sum(axis=1)
        near = squared <= reach**2
        weight = np.exp(-2 * squared[near] / reach**2)
        centred = off[near] - np.average(off[near], axis=0, weights=weight)
        scatter = (weight[:, None] * centred).T @ centred
        spread, axes = np.linalg.eigh(scatter)
        told = spread > weight.sum() * (narrow * reach / 2) ** 2
        told[1] = spread[1] > 0
        if not told[1]:
            plane.append(np.inf)
            along.append(np.inf)
            continue
        cells = strongest(radio.level_dbm[tuple(here)])
        level = radio.level_dbm[radio.row[near], radio.col[near]][:, cells].astype(float)
        inverse = axes[:, told] @ np.diag(1 / spread[told]) @ axes[:, told].T
        slope = (inverse @ (weight[:, None] * centred).T @ level).T
        whole = slope.T @ np.linalg.inv(covariance_of(radio.site[cells], errors)) @ slope
        both = told[0] and np.linalg.det(whole) > 1e-12 * np.trace(whole) ** 2
        plane.append(side_m * np.sqrt(np.trace(np.linalg.inv(whole))) if both else np.inf)
        street = squared <= max(round(street_m / side_m), 1) ** 2
        street &= near & (way[radio.row, radio.col] == way[tuple(here)])
        lengths, sides = np.linalg.eigh(off[street].T @ off[street])
        axis = sides[:, 1]
        gained = axis @ whole @ axis
        has_street = street.sum() > 1 and gained > 0
        along.append(side_m / np.sqrt(gained) if has_street else np.inf)
        if has_street and lengths[1] - lengths[0] < 1e-9:
            # Points alike in all directions have no axis.
            along[-1] = np.nan
    return np.array(plane), np.array(along)


@pytest.mark.parametrize(
    ("resolution_m", "correlation_m"), [(5.0, 31.0), (10.0, 31.0), (5.0, 2.0), (80.0, 90.0)]
)
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_position_bounds_against_the_definition(resolution_m, correlation_m, share):
    rng = np.random.default_rng(8)
    on_way = np.zeros((26, 30), dtype=bool)
    on_way[4:6] = on_way[:, 20:23] = True
    on_way[12:, 3] = True
    on_way[18:24, 8:14] = rng.random((6, 6)) < 0.8
    on_way[25, 28] = True
    way_id = np.full(on_way.shape, 1, dtype=np.int64)
    way_id[:, 20:23], way_id[12:, 3] = 2, 3
    level = rng.normal(-85, 15, (26, 30, 9)) + np.linspace(0, 10, 30)[None, :, None]
    radio = made_map(level, on_way, [0, 1, 0, 2, 1, 0, 3, 3, 2], way_id=way_id,
                     resolution_m=resolution_m)  # fmt: skip
    errors = ErrorModel(6.0, correlation_m, share)
    found = position_bound(radio, errors)
    plane, along = position_by_definition(radio, errors)
    assert np.isinf(plane).any()
    assert np.isfinite(plane).any()
    np.testing.assert_allclose(found.plane_m, plane, rtol=1e-4)
    known = ~np.isnan(along)
    assert known.sum() > 0.7 * along.size
    np.testing.assert_allclose(found.along_m[known], along[known], rtol=1e-4)


def test_bits_of_every_point_against_the_definition():
    rng = np.random.default_rng(4)
    level = rng.normal(-80, 12, (9, 14, 5))
    level[2, :4] = -150.0
    level[2, :4, 1] = -90.0
    on_way = rng.random((9, 14)) < 0.7
    radio = made_map(level, on_way, [0, 0, 1, 1, 2])
    errors = ErrorModel(7.0, 50.0, 0.4)
    found = distinctness(radio, errors)
    at = radio.level_dbm[radio.row, radio.col].astype(float)
    best = at.max(axis=1)
    for i, server in enumerate(radio.server):
        own = np.flatnonzero((at[:, server] >= best - 6) & (at[:, server] > FLOOR_DBM))
        cells = strongest(radio.level_dbm[radio.row[i], radio.col[i]])
        off = at[i, cells] - at[own][:, cells]
        inverse = np.linalg.inv(covariance_of(radio.site[cells], errors))
        overlap = np.exp(-np.einsum("hi,ij,hj->h", off, inverse, off) / 8).mean()
        assert found.cell_bits[i] == pytest.approx(np.log2(len(radio) / own.size))
        least = -np.log2(max(overlap, 1 / len(radio)))
        assert found.level_bits[i] == pytest.approx(least, abs=1e-5)


def test_of_a_large_cell_places_are_compared_that_are_spread_evenly():
    count = 3 * COMPARED
    level = np.full((1, count, 1), -60.0)
    level[0, count // 2 :] = -100.0
    radio = made_map(level, np.ones((1, count), dtype=bool), [0])
    found = distinctness(radio, ErrorModel(2.0, 50.0, 0.0))
    # Half of the places are alike, whichever half: one bit.
    np.testing.assert_allclose(found.level_bits, 1.0, atol=1e-6)


def test_points_of_a_cell_are_within_the_margin_and_above_the_floor():
    level = np.array([[[-70.0, -76.0], [-70.0, -76.5], [-110.0, -105.0], [-109.5, -110.0]]])
    radio = made_map(level, np.ones((1, 4), dtype=bool), [0, 1])
    first, point = radio.points_by_cell()
    assert first.tolist() == [0, 3, 5]
    assert point.tolist() == [0, 1, 3, 0, 2]
    assert len(radio) == 4


@pytest.mark.parametrize("across_db", [0.0, 0.3])
def test_levels_that_do_not_change_along_a_street_tell_no_place_on_it(across_db):
    row = np.arange(3)[:, None, None]
    level = np.float32([-70.1, -83.7]) - np.float32(across_db) * row * np.ones((1, 20, 1))
    on_way, way_id = np.ones((3, 20), dtype=bool), 1 + row[..., 0] * np.ones((1, 20), dtype=int)
    radio = made_map(level, on_way, [0, 0], way_id=way_id)
    found = position_bound(radio, ErrorModel(7.0, 30.0, 0.5))
    assert np.isinf(found.along_m).all()
    assert np.isinf(found.plane_m).all()


@pytest.mark.parametrize("factor", [1e-4, 1e4])
def test_bounds_are_proportional_to_the_errors(factor):
    rng = np.random.default_rng(2)
    radio = made_map(rng.normal(-80, 10, (12, 12, 3)), np.ones((12, 12), dtype=bool), [0, 1, 1])
    one = position_bound(radio, ErrorModel(7.0, 30.0, 0.3))
    other = position_bound(radio, ErrorModel(7.0 * factor, 30.0, 0.3))
    assert np.isfinite(one.plane_m).all()
    np.testing.assert_allclose(other.plane_m, factor * one.plane_m, rtol=1e-9)
    np.testing.assert_allclose(other.along_m, factor * one.along_m, rtol=1e-9)


def test_cells_that_rise_alike_tell_one_direction_only():
    row, col = np.mgrid[:12, :12]
    level = np.stack([-60.0 - row - 2 * col, -70.0 - 2 * row - 4 * col], axis=-1)
    radio = made_map(level, np.ones((12, 12), dtype=bool), [0, 1])
    assert np.isinf(position_bound(radio, ErrorModel(7.0, 30.0, 0.0)).plane_m).all()


def test_no_place_is_told_by_more_bits_than_there_are_points():
    # Every place is unlike all others; most are not among the 500 that stand for the cell.
    count = 2 * COMPARED
    level = (-60 - 0.02 * np.arange(count)).reshape(1, count, 1)
    radio = made_map(level, np.ones((1, count), dtype=bool), [0])
    bits = distinctness(radio, ErrorModel(1e-4, 50.0, 0.0)).level_bits
    np.testing.assert_allclose(np.unique(bits.round(6)), np.log2([COMPARED, count]), atol=1e-6)
