"""An area that is held whole: its levels with the two strongest, its ways and carriageways."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from mapfilter.database.field import RadioField
from mapfilter.lattice import Lattice
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.radio.cells import Cell, CellPlan

LATTICE = Lattice("EPSG:32632", 0.0, 20.0, 10.0, 2, 3)
LEVELS_DBM = np.array([
    [[-60.0, -70.0, -65.0], [-90.0, np.nan, -80.0], [np.nan, np.nan, np.nan]],
    [[-50.0, -50.0, -99.0], [np.nan, -88.0, np.nan], [-75.0, -70.0, np.nan]],
])  # fmt: skip
TO_WAY_M = np.array([[0.0, 4.0, 12.0], [1.0, 3.0, 30.0]], dtype=np.float32)
HALF_WIDTH_M = np.array([[5.0, 5.0, 10.0], [1.0, 12.0, 4.0]], dtype=np.float32)
WAY = np.array([[7, 7, 0], [9, 9, 7]])
QUIET_DBM = -116.0


def area(cells=3):
    level_dbm = LEVELS_DBM[..., :cells].astype(np.float32)
    names, on_way = ("A", "B", "C")[:cells], TO_WAY_M < 4.5
    field = RadioField(LATTICE, names, level_dbm, TO_WAY_M, HALF_WIDTH_M, WAY, on_way)
    return AreaMap.of_field(field, CellPlan(LATTICE.crs, ()), -110.0)


@pytest.mark.parametrize("cells", [0, 1, 2, 3])
def test_levels_and_the_two_strongest_of_them(cells):
    """Where a cell is below the floor a level 6 dB below it is assumed."""
    found = area(cells)
    known = np.where(np.isnan(LEVELS_DBM), QUIET_DBM, LEVELS_DBM)[..., :cells]
    np.testing.assert_array_equal(found.level_dbm[..., :cells], known)
    assert found.level_dbm.shape == (2, 3, cells + 2)
    for row, col in np.ndindex(2, 3):
        best = [*sorted(known[row, col].tolist(), reverse=True), QUIET_DBM, QUIET_DBM]
        assert found.level_dbm[row, col, cells:].tolist() == best[:2]
    pixel, band = np.array([0, 3, 4]), np.array([cells, cells, cells + 1])
    expected = found.level_dbm.reshape(6, -1)[pixel, band]
    np.testing.assert_array_equal(found.levels_at(pixel, band), expected)
    assert found.flat_level_dbm.shape == (6 * (cells + 2),)


def partitioned(values, kth, axis):
    """Order no more than what is asked for: what is larger comes in descending order."""
    assert axis == -1
    found = np.sort(values, axis=-1)
    found[..., kth + 1 :] = found[..., :kth:-1].copy()
    return found


@pytest.mark.parametrize("partition", [np.partition, partitioned])
def test_the_two_strongest_of_many_cells(monkeypatch, partition):
    monkeypatch.setattr(np, "partition", partition)
    levels_dbm = np.random.default_rng(1).permutation(96).reshape(2, 3, 16) - 120.0
    names = tuple("ABCDEFGHIJKLMNOP")
    ways = TO_WAY_M, HALF_WIDTH_M, WAY, TO_WAY_M < 4.5
    field = RadioField(LATTICE, names, levels_dbm.astype(np.float32), *ways)
    found = AreaMap.of_field(field, CellPlan(LATTICE.crs, ()), -130.0)
    strongest = np.sort(levels_dbm, axis=-1)[..., :-3:-1]
    np.testing.assert_array_equal(found.level_dbm[..., 16:], strongest)


def test_the_two_strongest_of_each_layer():
    """Layers of three, two and one cells, of which some are nowhere near the others' level."""
    rng = np.random.default_rng(4)
    levels_dbm = np.round(rng.uniform(-115.0, -60.0, (2, 3, 6)), 1).astype(np.float32)
    levels_dbm[0, 1, [0, 3]] = np.nan
    names, arfcn = tuple("ABCDEF"), (100, 200, 100, 200, 100, 300)
    cells = tuple(
        Cell(n, n, 0.0, 0.0, 30.0, None, 30.0, 1800.0, "omni", technology="LTE", arfcn=a)
        for n, a in zip(names, arfcn, strict=True)
    )
    ways = TO_WAY_M, HALF_WIDTH_M, WAY, TO_WAY_M < 4.5
    found = AreaMap.of_field(
        RadioField(LATTICE, names, levels_dbm, *ways), CellPlan(LATTICE.crs, cells), -110.0
    )
    assert (found.bands, found.level_dbm.shape) == (12, (2, 3, 12))
    assert found.layer_of.tolist() == [0, 1, 0, 1, 0, 2]
    assert [found.strongest(band) for band in range(6)] == [6, 8, 6, 8, 6, 10]
    for (row, col), layer in product(np.ndindex(2, 3), range(3)):
        own = [k for k in range(6) if arfcn[k] == 100 * (layer + 1)]
        heard = [float(levels_dbm[row, col, k]) for k in own]
        best = sorted((QUIET_DBM if np.isnan(v) else v for v in heard), reverse=True)
        top = found.level_dbm[row, col, 6 + 2 * layer : 8 + 2 * layer]
        assert top.tolist() == [*best, QUIET_DBM][:2]


def test_distances_are_to_the_edges_of_ways():
    found = area()
    np.testing.assert_array_equal(found.distance_m, [[0.0, 0.0, 2.0], [0.0, 0.0, 26.0]])
    assert found.carriageway_m is None
    assert found.of_carriageways() is None


def test_carriageways_are_narrower_than_their_streets():
    """Three tenths of half the width, at least 2 m, and no more than that half."""
    found = area(0)
    np.testing.assert_array_equal(found.distance_m, [[0.0, 0.0, 2.0], [0.0, 0.0, 26.0]])
    expected = [[0.0, 2.0, 9.0], [0.0, 0.0, 28.0]]
    np.testing.assert_allclose(found.carriageway_m, expected)
    lanes = found.of_carriageways()
    np.testing.assert_allclose(lanes.distance_m, expected)
    assert lanes.lattice is found.lattice


def test_points_are_the_middles_of_pixels_on_ways():
    found = area()
    np.testing.assert_array_equal(found.points, [[5.0, 15.0, 5.0, 15.0], [15.0, 15.0, 5.0, 5.0]])
    assert found.points.dtype == np.float32
    assert found.way_ids.tolist() == [0, 7, 9]
    np.testing.assert_array_equal(found.way_rank, [[1, 1, 0], [2, 2, 1]])
    # 5 m beside an edge at a deviation of 5 m, as the docstring of the model has it.
    beside = replace(found, distance_m=np.array([[0.0, 5.0, 60.0]], dtype=np.float32))
    np.testing.assert_allclose(beside.log_map(5.0), [[0.0, -0.49, -5.51]], atol=0.005)


@pytest.mark.parametrize(
    ("places", "weights", "way", "share"),
    [
        ([(5.0, 15.0), (25.0, 5.0), (5.0, 5.0)], [0.3, 0.2, 0.5], 7, 0.5),
        ([(5.0, 15.0), (15.0, 5.0), (5.0, 5.0)], [0.3, 0.2, 0.5], 9, 0.7),
        ([(25.0, 15.0), (15.0, 5.0)], [0.6, 0.4], 0, 0.6),
        # Beyond the area the pixel at its edge counts.
        ([(-30.0, 35.0), (35.0, -20.0), (15.0, 5.0)], [0.3, 0.3, 0.4], 7, 0.6),
        ([(9.99, 9.99), (10.01, 10.01)], [0.4, 0.6], 7, 0.6),
        # Weights that are rounded up are no more than all of the belief.
        ([(5.0, 5.0)], [1.1], 9, 1.0),
    ],
)
def test_the_way_that_holds_the_most_of_a_belief(places, weights, way, share):
    east_m, north_m = np.array(places, dtype=np.float32).T
    found = area().matched_way(east_m, north_m, np.array(weights, dtype=np.float32))
    assert found == (way, pytest.approx(share))


def test_roughness_is_the_deviation_of_levels_about_a_pixel():
    """Pixels of 50 m: of three by three, in tenths of a dB, and no more than a byte holds."""
    coarse = replace(area(), lattice=Lattice("EPSG:32632", 0.0, 100.0, 50.0, 2, 3))
    found = coarse.flat_rough_db.reshape(2, 3, 5)
    assert found.dtype == np.uint8
    padded = np.pad(coarse.level_dbm, ((1, 1), (1, 1), (0, 0)), "symmetric")
    for row, col in np.ndindex(2, 3):
        deviation_db = padded[row : row + 3, col : col + 3].std(axis=(0, 1))
        np.testing.assert_allclose(found[row, col], np.minimum(10 * deviation_db, 255), atol=1.01)
