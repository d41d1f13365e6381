"""Where a search of an area held by tiles begins, by reports and other evidence."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from made_town import CRS, FLOOR_DBM, PIXEL_M, SIDE_M, Town, walk_log
from tiled_town import EVERY_TILE, every_pixel, far_in_coverage, reading, write_database

from mapfilter.database.store import open_database
from mapfilter.models.level_errors import LevelErrors
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.area.tile_search import (
    SearchedTiles,
    points_everywhere,
    searched_tiles,
)
from mapfilter.positioning.bayes.area.tiled_area import TiledArea
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.loop import locate
from mapfilter.positioning.merging import epochs
from mapfilter.tracks.log import make_log


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


class Peak:
    """A sharp likelihood whose place is not stated, as that of satellites."""

    def __init__(self, place_m):
        self.at_m = place_m

    def log_likelihood(self, state):
        x, y = self.at_m
        return -0.5 * ((state[0] - x) ** 2 + (state[1] - y) ** 2).astype(float) / 5.0**2


def test_a_sharp_term_is_found_between_the_places_that_are_tried(database, whole):
    tiled = TiledArea.of_database(database, side=20, search_tiles=5)
    x, y = far_in_coverage(whole, "A")
    reading = RadioReading(tiled.band_of["A"], 1.0, terms=(Peak((x, y)),))
    west, south, east, north = searched_tiles(tiled, reading, LevelErrors()).boxes_m.T
    assert ((x >= west) & (x <= east) & (y >= south) & (y <= north)).any()


@pytest.mark.parametrize(
    "extra", [{"fix": True}, {"advance": True}, {"smooth": True}], ids=lambda one: next(iter(one))
)
def test_other_evidence_is_used_alike(database, whole, town, extra):
    """Fixes, timing advances and smoothing: as on the whole area, to the last bit."""
    plain = walk_log(town, 6, 200.0)
    radio = plain.radio.copy()
    if "advance" in extra:
        radio["timing_advance"] = np.where(radio["role"] == "serving", 0.0, np.nan)
    truth = plain.truth
    gnss = truth[::10].assign(var_east_m2=64.0, var_north_m2=64.0) if "fix" in extra else None
    log = make_log(CRS, motion=plain.motion, radio=radio, gnss=gnss, truth=truth, start_utc_s=1.7e9)
    filter_ = BayesFilter(
        max_particles=4000, min_search_particles=2000, smooth=extra.get("smooth", False)
    )
    tiled = TiledArea.of_database(database, side=40, search_tiles=EVERY_TILE)
    outputs = []
    for area in (whole, tiled):
        positioner = filter_.over_area(area)
        track = locate(log, positioner, np.random.default_rng(5))
        outputs.append([track.estimate.east_m, track.estimate.north_m, track.estimate.radii_m])
    for one, other in zip(*outputs, strict=True):
        assert np.array_equal(one, other, equal_nan=True)
    assert np.unique(outputs[0][0]).size > 20


def test_a_search_lets_other_threads_look_up_between_cells_and_tiles(database, town):
    tiled = TiledArea.of_database(database, side=20, search_tiles=24)
    lock = CountingLock(tiled.tiles.lock)
    tiled.tiles.lock = lock
    walk_m = town.walk(3000.0, np.random.default_rng(8))
    place_m = walk_m[town.levels_dbm(walk_m).max(axis=1).argmax()]
    one = reading(tiled, town, place_m)
    searched = searched_tiles(tiled, one, LevelErrors())
    assert lock.released >= len(searched.boxes_m) + len(one.levels.cell)
    before, pixel = lock.released, every_pixel(tiled)
    tiled.looked_up(pixel, one.levels.cell)
    assert lock.released >= before + tiled.count


class CountingLock:
    """A lock that counts how often it was given up by who held it."""

    def __init__(self, lock):
        self.lock, self.depth, self.released = lock, 0, 0

    def __enter__(self):
        self.lock.__enter__()
        self.depth += 1

    def __exit__(self, *args):
        self.depth -= 1
        self.released += not self.depth
        self.lock.__exit__(*args)


def test_two_devices_over_one_area_are_located_as_one_after_the_other(database, town):
    """In two threads of one service, within few bytes, so that each gives up the other's tiles."""
    logs = [list(epochs(walk_log(town, seed, 150.0))) for seed in (6, 7)]

    def positions(positioner, steps):
        rng, state, found = np.random.default_rng(5), positioner.begin(), []
        for epoch in steps:
            state, output = positioner.step(state, epoch, rng)
            found.append(repr((output.fix, output.evidence)))
        return found

    def over():
        area = TiledArea.of_database(database, side=30, largest_bytes=400_000, search_tiles=12)
        few = BayesFilter(max_particles=2000, min_search_particles=1000, min_particles=500)
        return few.over_area(area)

    expected = [positions(over(), steps) for steps in logs]
    shared = over()
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda steps: positions(shared, steps), logs))
    assert found == expected
    assert expected[0] != expected[1]


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
        log = walk_log(town, seed, 1500.0, error_db=3.0)
        rng, state = np.random.default_rng(5), positioner.begin()
        for epoch in epochs(log):
            state, output = positioner.step(state, epoch, rng)
        end = log.truth.iloc[-1]
        assert output.fix.status.name == "TRACKING"
        assert np.hypot(output.fix.east_m - end["east_m"], output.fix.north_m - end["north_m"]) < 30
