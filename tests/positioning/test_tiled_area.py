"""An area held by tiles is the same as one held whole, within its memory."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from made_town import PIXEL_M, Town, walk_log
from tiled_town import EVERY_TILE, every_level, every_pixel, places, write_database

from mapfilter.database.store import open_database
from mapfilter.models.way_map import interpolate
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.area.area_tiles import HELD_BYTES
from mapfilter.positioning.bayes.area.bounded_cache import BoundedCache
from mapfilter.positioning.bayes.area.tile_search import (
    points_everywhere,
)
from mapfilter.positioning.bayes.area.tiled_area import TiledArea
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.merging import epochs


@pytest.fixture(scope="module")
def town():
    # A steep decay: no cell is received everywhere.
    return Town.of(3, slope=60.0)


@pytest.fixture(scope="module")
def folder(town, tmp_path_factory):
    return write_database(tmp_path_factory.mktemp("town") / "database", town)


@pytest.fixture(scope="module")
def database(folder):
    return open_database(folder)


@pytest.fixture(scope="module")
def whole(database):
    return AreaMap.of_field(database.field(), database.plan, database.floor_dbm)


def test_predicted_levels_come_with_their_roughness_unless_it_is_not_wanted(database, whole):
    tiled = TiledArea.of_database(database, side=40)
    pixel, bands = every_pixel(tiled)[::5], np.array([3, 1], dtype=np.int32)
    by_pixel = whole.flat_rough_db.reshape(pixel.size * 5, -1)[::5][:, bands]
    assert by_pixel.any()
    found, own, columns = tiled.predicted(pixel, bands, 0.5)
    np.testing.assert_array_equal(found.rough_db.reshape(-1, 2), by_pixel)
    assert (own.tolist(), columns.tolist()) == (list(range(pixel.size)), [0, 1])
    level_dbm = whole.level_dbm.reshape(pixel.size * 5, -1)[::5][:, bands]
    np.testing.assert_array_equal(found.level_dbm.reshape(-1, 2), level_dbm)
    without, _, _ = tiled.predicted(pixel, bands, 0.5, rough=False)
    assert without.rough_db.size == 0
    np.testing.assert_array_equal(without.level_dbm, found.level_dbm)


@pytest.mark.parametrize("side", [16, 37, 128, 500])
def test_every_value_is_that_of_the_whole_area(database, whole, side):
    tiled = TiledArea.of_database(database, side=side, search_tiles=EVERY_TILE)
    assert (tiled.cell_ids, tiled.carriers, tiled.sites) == (
        whole.cell_ids, whole.carriers, whole.sites)  # fmt: skip
    bands = len(whole.cell_ids) + 2
    level_dbm, rough_db = every_level(tiled)
    assert np.array_equal(level_dbm, whole.level_dbm.reshape(-1, bands))
    assert np.array_equal(rough_db, whole.flat_rough_db.reshape(-1, bands)[:, :-2])
    band = np.arange(level_dbm.shape[0]) % (bands - 2)
    at = tiled.levels_at(every_pixel(tiled)[::7], band[::7])
    assert np.array_equal(at, whole.levels_at(every_pixel(whole)[::7], band[::7]))
    # There is something to be seen: levels below the floor, and ground far from any street.
    quiet = level_dbm[:, :-2] == tiled.tiles.quiet_dbm
    assert 0.05 < quiet.mean() < 0.95
    assert whole.distance_m.max() > 100
    assert np.array_equal(points_everywhere(tiled), whole.points)
    state, ways = places(whole), BayesFilter().over_area(whole).model._ways
    middle = PIXEL_M / 2, (whole.lattice.rows - 0.5) * PIXEL_M
    expected = interpolate(*state[:2], ways.log_likelihood, *middle, 1 / PIXEL_M)
    assert np.array_equal(tiled.log_map_at(state, 3.0), expected)
    weight = np.random.default_rng(2).random(50, dtype=np.float32)
    for first in range(0, 5000, 50):
        some = *state[:2, first : first + 50], weight / weight.sum()
        assert tiled.matched_way(*some) == whole.matched_way(*some)


# Where little is held, tiles are read anew at each epoch: some show it.
@pytest.mark.parametrize(
    ("side", "largest_bytes", "length_m"), [(40, HELD_BYTES, 400.0), (48, 150_000, 120.0)]
)
@pytest.mark.parametrize("levels", [True, False])
def test_a_walk_is_located_alike(database, whole, town, side, largest_bytes, length_m, levels):
    """To the last bit, and however little is held."""
    tiled = TiledArea.of_database(database, side, largest_bytes, search_tiles=EVERY_TILE)
    outputs = []
    for area in (whole, tiled):
        filter_ = BayesFilter(max_particles=4000, min_search_particles=2000, levels=levels)
        positioner = filter_.over_area(area)
        rng, state, found = np.random.default_rng(5), positioner.begin(), []
        for epoch in epochs(walk_log(town, 6, length_m)):
            state, output = positioner.step(state, epoch, rng)
            found.append(repr((output.fix, output.evidence)))
        outputs.append(found)
    assert outputs[0] == outputs[1]
    assert len(set(outputs[0])) > 0.75 * len(outputs[0]) > 15


def test_what_is_held_stays_within_its_bytes(database, whole):
    bound = 150_000
    tiled = TiledArea.of_database(database, side=24, largest_bytes=bound)
    rng, most, pixels = np.random.default_rng(3), 0, whole.on_way.size
    bands = np.arange(len(whole.cell_ids), dtype=np.int32)
    level_dbm = whole.level_dbm.reshape(pixels, -1)
    for _ in range(12):
        pixel = rng.integers(pixels, size=200).astype(np.int32)
        found_dbm, _ = tiled.looked_up(pixel, bands)
        assert np.array_equal(found_dbm, level_dbm[pixel][:, :-2])
        held = tiled.tiles.held
        counted = sum(size for _, size in held._entries.values())
        assert held.bytes == counted
        most = max(most, held.bytes)
    assert 0.5 * bound < most <= bound


def test_what_was_asked_for_longest_ago_is_given_up_first():
    held, made = BoundedCache(3 * 400 + 99), []

    def ask(key):
        return held.get(key, lambda: made.append(key) or np.zeros(100, np.uint8))

    for key in "abcadabe":
        assert ask(key).nbytes == 100
    # d took the place of b, then b that of c; e that of d.
    assert made == list("abcdbe")
    assert "".join(held._entries) == "abe"


def test_threads_see_the_same(database, whole):
    tiled = TiledArea.of_database(database, side=24, largest_bytes=100_000)
    bands = np.arange(len(whole.cell_ids), dtype=np.int32)
    level_dbm = whole.level_dbm.reshape(whole.on_way.size, -1)
    rough_db = whole.flat_rough_db.reshape(whole.on_way.size, -1)

    def look(seed):
        pixel = np.random.default_rng(seed).integers(whole.on_way.size, size=300).astype(np.int32)
        found_dbm, found_rough = tiled.looked_up(pixel, bands)
        return np.array_equal(found_dbm, level_dbm[pixel][:, :-2]) and np.array_equal(
            found_rough, rough_db[pixel][:, :-2]
        )

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(look, range(8)))


def test_another_process_reads_for_itself(database, whole):
    tiled = TiledArea.of_database(database, side=40)
    every_level(tiled)
    again = pickle.loads(pickle.dumps(tiled))
    assert again.tiles.held.bytes == 0
    assert np.array_equal(every_level(again)[0], whole.level_dbm.reshape(whole.on_way.size, -1))
