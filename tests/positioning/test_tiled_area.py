"""An area held by tiles is the same as one held whole, within its memory, and read with care."""

import pickle
import shutil
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from made_town import CRS, FLOOR_DBM, NAMES, PIXEL_M, SIDE_M, Town, walk_log

from mapfilter.database.cell_levels import PointReader, part_extents
from mapfilter.database.parts import Head, write_parts
from mapfilter.database.store import open_database
from mapfilter.database.tiles import TileRows, places_table, received_levels
from mapfilter.errors import StoreError
from mapfilter.geodesy import Lattice
from mapfilter.models.level_errors import LevelErrors, LevelReport
from mapfilter.models.street_motion import STATES, interpolate
from mapfilter.positioning.bayes import options
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.bayes.bounded_cache import BoundedCache
from mapfilter.positioning.bayes.evidence import RadioReading
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter, open_area
from mapfilter.positioning.bayes.tile_search import (
    SearchedTiles,
    points_everywhere,
    searched_tiles,
)
from mapfilter.positioning.bayes.tiled_area import TiledArea
from mapfilter.positioning.epochs import epochs
from mapfilter.roads.lattice import RouteLattice

EVERY_TILE = 10_000
NONE = np.zeros(0, dtype=np.int32)


def write_database(folder, town, *, gap=True):
    """Write a town's database in tiles of 60 pixels; a part of it has no street, if wanted."""
    area = town.area()
    lattice, on_way = area.lattice, area.on_way.copy()
    on_way[70:130, 20:90] &= not gap
    folder.mkdir(parents=True)

    def tiles():
        for window in lattice.tiles(60):
            top, left, rows, cols = window
            row, col = np.nonzero(on_way[top : top + rows, left : left + cols])
            way = 1 + (row + top) // 7 + 40 * ((col + left) // 31)
            away = area.distance_m[top + row, left + col] + np.float32(3.0)
            part = RouteLattice(
                lattice.window(*window), row.astype("i4"), col.astype("i4"), way,
                (way % 2).astype("i2"), ("residential", "primary"), away, way % 5 == 0,
            )  # fmt: skip
            places = places_table(part, lattice)
            place = [axis.to_numpy() for axis in (places["row"], places["col"])]
            level = area.level_dbm[place[0], place[1], : len(NAMES)].T.astype(float)
            level[level < FLOOR_DBM] = np.nan
            yield TileRows(places, received_levels(level, FLOOR_DBM))

    plan = town.plan()
    written = write_parts(folder, CRS, plan.ids, tiles(), 9)
    counts = {"points": written.received, "points_below_floor": 0, "points_off_rasters": 0}
    parameters = {"margin_db": 6.0, "floor_dbm": FLOOR_DBM, "tile_px": 60}
    Head(lattice, plan, parameters, "", (), counts).write(folder, written.parts)
    return folder


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


def every_pixel(area):
    return np.arange(area.lattice.rows * area.lattice.cols, dtype=np.int32)


def every_level(tiled):
    """Return all levels, with the two strongest, and all roughness."""
    bands = np.arange(len(tiled.cell_ids) + 2, dtype=np.int32)
    level_dbm, _ = tiled.looked_up(every_pixel(tiled), bands, rough=False)
    return level_dbm, tiled.looked_up(every_pixel(tiled), bands[:-2])[1]


def places(area, count=5000, beyond_m=120.0):
    rng, state = np.random.default_rng(1), np.zeros((STATES, count), dtype=np.float32)
    for axis, size_m in enumerate(area.size_m):
        state[axis] = rng.uniform(-beyond_m, size_m + beyond_m, count)
    return state


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
    expected = interpolate(state, ways.log_likelihood, *middle, 1 / PIXEL_M)
    assert np.array_equal(tiled.log_map_at(state, 3.0), expected)
    weight = np.random.default_rng(2).random(50, dtype=np.float32)
    for first in range(0, 5000, 50):
        some = *state[:2, first : first + 50], weight / weight.sum()
        assert tiled.matched_way(*some) == whole.matched_way(*some)


@pytest.mark.parametrize(("side", "largest_bytes"), [(40, 1 << 30), (48, 150_000)])
@pytest.mark.parametrize("levels", [True, False])
def test_a_walk_is_located_alike(database, whole, town, side, largest_bytes, levels):
    """To the last bit, and however little is held."""
    tiled = TiledArea.of_database(database, side, largest_bytes, search_tiles=EVERY_TILE)
    outputs = []
    for area in (whole, tiled):
        filter_ = BayesFilter(max_particles=4000, min_search_particles=2000, levels=levels)
        positioner = filter_.over_area(area)
        rng, state, found = np.random.default_rng(5), positioner.begin(), []
        for epoch in epochs(walk_log(town, 6, 400.0)):
            state, output = positioner.step(state, epoch, rng)
            found.append(repr((output.fix, output.evidence)))
        outputs.append(found)
    assert outputs[0] == outputs[1]
    assert len(set(outputs[0])) > 60


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
        return held.get(key, lambda: made.append(key) or key, lambda _: 100)

    for key in "abcadabe":
        assert ask(key) == key
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


def changed(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 4
    path.write_bytes(bytes(data))


@pytest.mark.parametrize("part", ["points.parquet", "levels/A/part-0.parquet"])
def test_damage_is_told_when_a_tile_is_read(folder, tmp_path, part):
    shutil.copytree(folder, tmp_path / "copy")
    tiled = TiledArea.of_database(open_database(tmp_path / "copy"), side=40)
    changed(tmp_path / "copy" / part)
    with pytest.raises(StoreError, match=part.split("/")[-1]):
        every_level(tiled)


def test_a_database_that_was_replaced_is_told(folder, tmp_path):
    shutil.copytree(folder, tmp_path / "copy")
    tiled = TiledArea.of_database(open_database(tmp_path / "copy"), side=40)
    tiled.looked_up(np.zeros(1, dtype=np.int32), np.zeros(1, dtype=np.int32))
    shutil.rmtree(tmp_path / "copy")
    write_database(tmp_path / "copy", Town.of(4, slope=60.0))
    with pytest.raises(StoreError, match="it was replaced while in use; open it again"):
        every_level(tiled)


def reading(area, town, place_m):
    level = town.levels_dbm(np.asarray(place_m))
    heard = [k for k in np.argsort(-level) if level[k] > FLOOR_DBM][:4]
    bands = np.array([area.band_of[NAMES[k]] for k in heard], dtype=np.int32)
    report = LevelReport(bands, level[heard].astype("f4"), NONE, FLOOR_DBM, 0.0)
    return RadioReading(int(bands[0]), 1.0, report)


def test_a_search_begins_where_its_report_is_likely(database, town, whole):
    """In some tiles, with that of the place; everywhere if no cell is known."""
    tiled = TiledArea.of_database(database, side=20, search_tiles=24)
    rng, missed, tried = np.random.default_rng(8), 0, 0
    for place_m in town.walk(9000.0, rng)[::25]:
        there = whole.on_way[int((SIDE_M - place_m[1]) / PIXEL_M), int(place_m[0] / PIXEL_M)]
        if not there or town.levels_dbm(place_m).max() < FLOOR_DBM:
            continue
        tried += 1
        searched = searched_tiles(tiled, reading(tiled, town, place_m), LevelErrors())
        assert len(searched.boxes_m) <= 24
        west, south, east, north = searched.boxes_m.T
        x, y = searched.points[:, :, None]
        inside = (x > west) & (x < east) & (y > south) & (y < north)
        assert (inside.sum(axis=1) == 1).all()
        x, y = place_m
        missed += not ((x >= west) & (x <= east) & (y >= south) & (y <= north)).any()
    assert missed <= 1
    assert tried > 30
    assert tiled.count == 81
    for nothing in (None, RadioReading(serving_weight=1.0)):
        assert searched_tiles(tiled, nothing, LevelErrors()) is None
    assert points_everywhere(tiled).shape[1] == len(database.points())


def test_with_a_serving_cell_alone_the_tiles_are_those_where_it_is_strong(database, whole):
    tiled = TiledArea.of_database(database, side=20, search_tiles=5)
    band = tiled.band_of["A"]
    searched = searched_tiles(tiled, RadioReading(band, 1.0), LevelErrors())
    level_dbm = np.where(whole.on_way, whole.level_dbm[..., band], -np.inf)
    row, col = np.unravel_index(level_dbm.argmax(), level_dbm.shape)
    x, y = (col + 0.5) * PIXEL_M, SIDE_M - (row + 0.5) * PIXEL_M
    assert (np.hypot(searched.points[0] - x, searched.points[1] - y) < 0.1).any()


def test_places_are_drawn_in_the_tiles_and_beyond_the_edge_beside_them():
    boxes_m = np.array([[0.0, 100.0, 100.0, 200.0], [300.0, 100.0, 350.0, 300.0]])
    searched = SearchedTiles(np.empty((2, 0), "f4"), boxes_m)
    rng = np.random.default_rng(2)
    x, y = searched.anywhere(rng.random((4000, 2)))
    first = (x <= 100) & (y >= 100) & (y <= 200)
    second = (x >= 300) & (x <= 350) & (y >= 100) & (y <= 300)
    assert (first | second).all()
    assert first.mean() == pytest.approx(0.5, abs=0.03)
    assert x[first].std() == pytest.approx(100 / 12**0.5, rel=0.05)
    x, y = searched.around((1000.0, 900.0), 300.0, 500, rng)
    assert ((x >= -300) & (x <= 0) & (y >= 100) & (y <= 200)).all()
    inner = SearchedTiles(searched.points, boxes_m[1:])
    assert inner.around((1000.0, 900.0), 300.0, 500, rng).shape == (2, 0)


def test_a_walk_is_found_from_a_search_of_some_tiles(tmp_path):
    town = Town.of(3)
    database = open_database(write_database(tmp_path / "database", town, gap=False))
    tiled = TiledArea.of_database(database, side=20, search_tiles=20)
    positioner = BayesFilter().over_area(tiled)
    for seed in (21, 22):
        log = walk_log(town, seed, error_db=3.0)
        rng, state = np.random.default_rng(5), positioner.begin()
        for epoch in epochs(log):
            state, output = positioner.step(state, epoch, rng)
        end = log.truth.iloc[-1]
        assert output.fix.status.name == "TRACKING"
        assert np.hypot(output.fix.east_m - end["east_m"], output.fix.north_m - end["north_m"]) < 30


def test_large_areas_are_held_by_tiles(database, monkeypatch):
    values = database.lattice.rows * database.lattice.cols * (len(NAMES) + 2)
    assert isinstance(open_area(database), AreaMap)
    monkeypatch.setattr(options, "WHOLE_VALUES", values)
    assert isinstance(open_area(database), AreaMap)
    monkeypatch.setattr(options, "WHOLE_VALUES", values - 1)
    assert isinstance(open_area(database), TiledArea)
    assert isinstance(BayesFilter().over(database).area, TiledArea)
    # The exact filter needs every pixel, and a database of roads alone every street.
    assert isinstance(GridFilter().over(database).area, AreaMap)
    assert isinstance(open_area(database.without_cells()), AreaMap)


def test_extents_of_parts_hold_their_points(database):
    extents = part_extents(database, database.cell_ids)
    for band, cell in enumerate(database.cell_ids):
        row, col, level_dbm = database.cell_points(cell, np.inf)
        own = extents.band == band
        assert own.sum() == len(database.level_parts[cell]) == 1
        assert extents.box[own].tolist() == [[row.min(), row.max(), col.min(), col.max()]]
        assert extents.most_dbm[own] == level_dbm.max()


def test_cells_are_read_only_where_they_may_be_strong(database, whole):
    """At some places above a level, and none is missed; a limit that none reaches reads none."""
    tiled = TiledArea.of_database(database, side=20)
    bands = np.arange(len(whole.cell_ids), dtype=np.int32)
    flat = whole.level_dbm.reshape(whole.on_way.size, -1)[:, :-2]
    pixel = np.random.default_rng(4).integers(whole.on_way.size, size=500).astype(np.int32)
    limits_dbm = (0.0, -60.0, -80.0, FLOOR_DBM, FLOOR_DBM - 20)
    for limit_dbm in limits_dbm:
        share = tiled.shares_above(pixel, bands, limit_dbm)
        assert np.array_equal(share, (flat[pixel] > limit_dbm).mean(axis=0))
        assert limit_dbm < 0 or not [key for key in tiled.tiles.held._entries if key[0] == "cell"]
    some = bands[[0, 3, 5]]
    share = tiled.shares_above(pixel, some, -80.0)
    assert np.array_equal(share, (flat[pixel][:, some] > -80.0).mean(axis=0))


def test_the_nearest_point_may_be_far_beyond_the_window(tmp_path, town):
    """One point in a corner: of a window in the opposite one it is the nearest, too."""
    lattice = Lattice(CRS, 0.0, 2000.0, 5.0, 400, 400)
    one = np.zeros(1)
    part = RouteLattice(
        lattice, one.astype("i4"), one.astype("i4"), one.astype("i8") + 9, one.astype("i2"),
        ("path",), one.astype("f4"), one > 0,
    )  # fmt: skip
    level = received_levels(np.full((len(NAMES), 1), -70.0), FLOOR_DBM)
    (tmp_path / "far").mkdir()
    plan = town.plan()
    tiles = [TileRows(places_table(part, lattice), level)]
    written = write_parts(tmp_path / "far", CRS, plan.ids, tiles, 1)
    counts = {"points": 1, "points_below_floor": 0, "points_off_rasters": 0}
    parameters = {"margin_db": 6.0, "floor_dbm": FLOOR_DBM, "tile_px": 60}
    Head(lattice, plan, parameters, "", (), counts).write(tmp_path / "far", written.parts)
    database = open_database(tmp_path / "far")
    found = PointReader(database).nearest((380, 390, 20, 10))
    assert found.point.tolist() == [0]
    assert found.way_id.tolist() == [9]
    whole = AreaMap.of_field(database.field(), plan, FLOOR_DBM)
    assert np.array_equal(found.edge_m, whole.distance_m[380:, 390:])
    assert found.edge_m.max() > 5 * np.hypot(399, 399) - 20
