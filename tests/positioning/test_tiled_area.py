"""An area held by tiles is the same as one held whole, within its memory, and read with care."""

import pickle
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from made_town import CRS, FLOOR_DBM, NAMES, PIXEL_M, SIDE_M, SOUTH_M, WEST_M, Town, walk_log

from mapfilter.database import parts
from mapfilter.database.cell_levels import PointReader, part_extents
from mapfilter.database.parts import Head, write_parts
from mapfilter.database.store import open_database
from mapfilter.database.tiles import TileRows, places_table, received_levels
from mapfilter.errors import StoreError
from mapfilter.gnss.almanacs import nominal_gps
from mapfilter.gnss.orbits import gps_time
from mapfilter.lattice import Lattice
from mapfilter.models.level_errors import LevelErrors, LevelReport
from mapfilter.models.street_motion import STATES
from mapfilter.models.way_map import interpolate
from mapfilter.positioning.bayes.area import opened_area
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.area.area_tiles import HELD_BYTES
from mapfilter.positioning.bayes.area.bounded_cache import BoundedCache
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.area.tile_search import (
    SearchedTiles,
    points_everywhere,
    searched_tiles,
)
from mapfilter.positioning.bayes.area.tiled_area import TiledArea
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.bayes.sources.timing import TimingSource
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.gnss.fixes import FixTerm
from mapfilter.positioning.gnss.options import GnssOptions, TimingOptions
from mapfilter.positioning.gnss.source import GnssSource
from mapfilter.positioning.loop import locate
from mapfilter.positioning.merging import epochs
from mapfilter.radio.cells import CellPlan
from mapfilter.roads.lattice import RouteLattice
from mapfilter.simulation.satellites import ReceptionModel, receive
from mapfilter.tracks.log import make_log

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
    received = [k for k in np.argsort(-level) if level[k] > FLOOR_DBM][:4]
    bands = np.array([area.band_of[NAMES[k]] for k in received], dtype=np.int32)
    level_dbm = level[received].astype("f4")
    report = LevelReport(bands, level_dbm, NONE, NONE.astype("f4"), 0.0)
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


def far_in_coverage(whole, cell):
    """Return the point on a way, in the local frame, where a cell is weakest."""
    level_dbm = np.where(whole.on_way, whole.level_dbm[..., whole.band_of[cell]], np.inf)
    level_dbm[level_dbm < FLOOR_DBM] = np.inf
    row, col = np.unravel_index(level_dbm.argmin(), level_dbm.shape)
    return (col + 0.5) * PIXEL_M, SIDE_M - (row + 0.5) * PIXEL_M


def fixes(place_m, count=1, sigma_m=5.0):
    times = np.arange(count, dtype=float)
    east_m, north_m = WEST_M + place_m[0], SOUTH_M + place_m[1]
    columns = {"time_s": times, "east_m": east_m, "north_m": north_m}
    return pd.DataFrame({**columns, "var_east_m2": sigma_m**2, "var_north_m2": sigma_m**2})


def serving(cell, **columns):
    return pd.DataFrame({"time_s": [0.0], "role": "serving", "cell": cell, **columns})


def last_place_m(area, log):
    """Return the last position in the local frame."""
    positioner = BayesFilter(max_particles=4000, min_search_particles=4000).over_area(area)
    rng, state = np.random.default_rng(5), positioner.begin()
    for epoch in epochs(log):
        state, output = positioner.step(state, epoch, rng)
    return output.fix.east_m - WEST_M, output.fix.north_m - SOUTH_M


@pytest.mark.parametrize("cell", ["A", None])
def test_a_first_fix_decides_where_is_searched(database, whole, cell):
    """With a serving cell that is stronger elsewhere, and alone."""
    tiled = TiledArea.of_database(database, side=20, search_tiles=5)
    place_m = far_in_coverage(whole, "A")
    radio = serving(cell) if cell else None
    log = make_log(CRS, gnss=fixes(place_m), radio=radio, start_utc_s=1.7e9)
    for area in (whole, tiled):
        x, y = last_place_m(area, log)
        assert np.hypot(x - place_m[0], y - place_m[1]) < 5


def fix_term(place_m, sigma_m=5.0):
    fix = GnssFix(WEST_M + place_m[0], SOUTH_M + place_m[1], sigma_m**2, sigma_m**2, 0.0)
    return FixTerm(fix, (WEST_M, SOUTH_M))


def test_a_fix_alone_is_searched_for_in_the_tiles_around_it(database, whole):
    tiled = TiledArea.of_database(database, side=20, search_tiles=5)
    x, y = far_in_coverage(whole, "A")
    reading = RadioReading(terms=(fix_term((x, y)),))
    west, south, east, north = searched_tiles(tiled, reading, LevelErrors()).boxes_m.T
    away_m = np.hypot(x - np.clip(x, west, east), y - np.clip(y, south, north))
    assert away_m.min() == 0
    assert away_m.max() < 15
    # One that is too wide for the tiles of a search, or far beyond the area, leaves it everywhere.
    for other in (fix_term((x, y), 500.0), fix_term((-5000.0, y))):
        assert searched_tiles(tiled, RadioReading(terms=(other,)), LevelErrors()) is None


def test_a_fix_where_the_reported_cell_is_not_received_is_searched_for_as_well(database, whole):
    tiled = TiledArea.of_database(database, side=20, search_tiles=5)
    band = whole.band_of["A"]
    quiet = whole.on_way & (whole.level_dbm[..., band] < FLOOR_DBM)
    level_dbm = np.where(whole.on_way, whole.level_dbm[..., band], -np.inf)
    strong_row, strong_col = np.unravel_index(level_dbm.argmax(), level_dbm.shape)
    rows, cols = np.nonzero(quiet)
    k = np.hypot(rows - strong_row, cols - strong_col).argmax()
    x, y = (cols[k] + 0.5) * PIXEL_M, SIDE_M - (rows[k] + 0.5) * PIXEL_M
    reading = RadioReading(band, 1.0, terms=(fix_term((x, y)),))
    west, south, east, north = searched_tiles(tiled, reading, LevelErrors()).boxes_m.T
    inside = (x >= west) & (x <= east) & (y >= south) & (y <= north)
    assert inside.any()
    # The others are those of the cell.
    assert len(west) == 5
    x, y = (strong_col + 0.5) * PIXEL_M, SIDE_M - (strong_row + 0.5) * PIXEL_M
    assert ((x >= west) & (x <= east) & (y >= south) & (y <= north)).any()


def test_reports_are_used_after_a_first_fix_in_tiles_without_ways(database, whole):
    """None of the first hypotheses is on a way then, and one of no weight may leave the area."""
    tiled = TiledArea.of_database(database, side=4, search_tiles=9)
    row, col = np.unravel_index(whole.distance_m[40:-40, 40:-40].argmax(), (100, 100))
    place_m = (col + 40.5) * PIXEL_M, SIDE_M - (row + 40.5) * PIXEL_M
    assert not searched_tiles(
        tiled, RadioReading(terms=(fix_term(place_m, 1.0),)), LevelErrors()
    ).points.size
    times = np.arange(4.0)
    motion = pd.DataFrame({"time_s": times[1:], "step_m": 10.0, "heading_rad": 0.5})
    radio = pd.DataFrame({"time_s": times[1:], "role": "serving", "cell": "A"})
    log = make_log(CRS, motion=motion, radio=radio, gnss=fixes(place_m, sigma_m=1.0))
    positioner = BayesFilter(max_particles=400, min_search_particles=300, min_particles=200)
    rng, bound = np.random.default_rng(5), positioner.over_area(tiled)
    state = bound.begin()
    for epoch in epochs(log):
        state, output = bound.step(state, epoch, rng)
        assert not output.unused
        assert np.exp(state.belief.log_weight).sum() > 0


def test_a_timing_advance_decides_how_far_from_its_site_is_searched(database):
    """Steps of 78 m: 2 to 3 of them from the site, where the cell is not strongest."""
    tiled = TiledArea.of_database(database, side=20, search_tiles=5)
    options = TimingOptions(step_m=78.1, advance_sd_m=20.0)
    log = make_log(CRS, radio=serving("A", timing_advance=2.0), start_utc_s=1.7e9)
    (epoch,) = epochs(log)
    terms = TimingSource(tiled, options).first(epoch).terms
    searched = searched_tiles(
        tiled, RadioReading(tiled.band_of["A"], 1.0, terms=terms), LevelErrors()
    )
    east_m, north_m, _ = tiled.sites["A"]
    west, south, east, north = searched.boxes_m.T
    x, y = east_m - WEST_M, north_m - SOUTH_M
    near_m = np.hypot(x - np.clip(x, west, east), y - np.clip(y, south, north))
    far_m = np.hypot(
        np.maximum(abs(x - west), abs(x - east)), np.maximum(abs(y - south), abs(y - north))
    )
    assert (near_m < 2.5 * 78.1).all()
    assert (far_m > 2.5 * 78.1).all()


def test_first_pseudoranges_decide_where_is_searched(database, whole):
    """Clock and height are unknown, and so is the place of their largest likelihood."""
    tiled = TiledArea.of_database(database, side=20, search_tiles=5)
    x, y = far_in_coverage(whole, "A")
    truth = pd.DataFrame({"time_s": [0.0], "east_m": WEST_M + x, "north_m": SOUTH_M + y})
    ranges = receive(
        truth, CRS, None, nominal_gps(gps_time(1.7e9)[0]), 1.7e9, ReceptionModel(),
        np.random.default_rng(1),
    )  # fmt: skip
    log = make_log(CRS, pseudoranges=ranges, start_utc_s=1.7e9)
    (epoch,) = epochs(log)
    terms = GnssSource(tiled, GnssOptions()).first(epoch).terms
    assert len(terms) == 1
    reading = RadioReading(tiled.band_of["A"], 1.0, terms=terms)
    west, south, east, north = searched_tiles(tiled, reading, LevelErrors()).boxes_m.T
    assert ((x >= west) & (x <= east) & (y >= south) & (y <= north)).any()


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


def test_levels_of_many_cells_are_looked_up_in_blocks(database, whole, monkeypatch):
    tiled = TiledArea.of_database(database, side=40)
    pixel = every_pixel(tiled)
    band = pixel % len(whole.cell_ids)
    most, look = [], TiledArea.looked_up

    def watched(self, pixel, cell, **options):
        most.append(pixel.size * cell.size)
        return look(self, pixel, cell, **options)

    monkeypatch.setattr(TiledArea, "looked_up", watched)
    assert np.array_equal(tiled.levels_at(pixel, band), whole.levels_at(pixel, band))
    assert max(most) < 2000


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
    monkeypatch.setattr(opened_area, "WHOLE_VALUES", values)
    assert isinstance(open_area(database), AreaMap)
    monkeypatch.setattr(opened_area, "WHOLE_VALUES", values - 1)
    assert isinstance(open_area(database), TiledArea)
    assert isinstance(BayesFilter().over(database).area, TiledArea)
    # The exact filter needs every pixel, and a database of roads alone every street.
    assert isinstance(GridFilter().over(database).area, AreaMap)
    assert isinstance(open_area(database.without_cells()), AreaMap)


def test_a_large_database_whose_cells_are_received_nowhere_is_held_whole(database, monkeypatch):
    """As one of roads alone; its cells are known, and have no levels."""
    quiet = replace(database)
    quiet.__dict__["level_parts"] = {}
    assert quiet.cell_ids
    monkeypatch.setattr(opened_area, "WHOLE_VALUES", 1)
    area = open_area(quiet)
    assert isinstance(area, AreaMap)
    assert area.cell_ids == ()
    assert area.known_ids == set(NAMES)


def test_extents_of_parts_hold_their_points(database):
    extents = part_extents(database, database.cell_ids)
    for band, cell in enumerate(database.cell_ids):
        row, col, level_dbm = database.cell_points(cell, np.inf)
        own = extents.band == band
        assert own.sum() == len(database.level_parts[cell]) == 1
        assert extents.box[own].tolist() == [[row.min(), row.max(), col.min(), col.max()]]
        assert extents.most_dbm[own] == level_dbm.max()


def _parts_read(tiled):
    return {key[1] for key in tiled.tiles.held._entries if key[0] == "part"}


def test_of_cells_in_several_parts_those_near_a_tile_are_read(town, tmp_path, monkeypatch):
    """As large databases are: all values are those of the whole, and a tile reads few parts."""
    monkeypatch.setattr(parts, "ROWS_IN_MEMORY", 1)
    database = open_database(write_database(tmp_path / "database", town))
    counts = [len(some) for some in database.level_parts.values()]
    assert min(counts) > 1
    assert max(counts) > 3
    whole = AreaMap.of_field(database.field(), database.plan, database.floor_dbm)
    tiled = TiledArea.of_database(database, side=30)
    bands = np.arange(len(whole.cell_ids), dtype=np.int32)
    corner = np.array([0, 1, tiled.lattice.cols], dtype=np.int32)
    flat = whole.level_dbm.reshape(whole.on_way.size, -1)
    assert np.array_equal(tiled.looked_up(corner, bands)[0], flat[corner][:, :-2])
    assert 0 < len(_parts_read(tiled)) < 0.5 * sum(counts)
    assert np.array_equal(every_level(tiled)[0], flat)
    ranges = [tiled.tiles.range_of(band) for band in bands.tolist()]
    most = [np.nanmax(one.most_dbm) for one in ranges]
    least = [np.nanmin(one.least_dbm) for one in ranges]
    heard = [database.cell_points(cell, np.inf)[2] for cell in whole.cell_ids]
    assert most == [some.max() for some in heard]
    assert least == [some.min() for some in heard]


def test_an_area_of_more_pixels_than_32_bits_count_is_refused(database):
    lattice = replace(database.lattice, rows=50_000, cols=50_000)
    with pytest.raises(StoreError, match="less than 2147483648 pixels"):
        TiledArea.of_database(replace(database, lattice=lattice))


def test_cells_are_read_only_where_they_may_be_strong(database, whole):
    """At some places above a level, and none is missed; a limit that none reaches reads none."""
    tiled = TiledArea.of_database(database, side=20)
    bands = np.arange(len(whole.cell_ids), dtype=np.int32)
    flat = whole.level_dbm.reshape(whole.on_way.size, -1)[:, :-2]
    pixel = np.random.default_rng(4).integers(whole.on_way.size, size=500).astype(np.int32)
    limits_dbm = (0.0, -60.0, -80.0, FLOOR_DBM, FLOOR_DBM - 20)
    for limit_dbm in limits_dbm:
        share = tiled.shares_above(pixel, bands, np.full(bands.size, limit_dbm, dtype=np.float32))
        assert np.array_equal(share, (flat[pixel] > limit_dbm).mean(axis=0))
        assert limit_dbm < 0 or not _parts_read(tiled)
    some = bands[[0, 3, 5]]
    share = tiled.shares_above(pixel, some, np.full(some.size, -80.0, dtype=np.float32))
    assert np.array_equal(share, (flat[pixel][:, some] > -80.0).mean(axis=0))


def test_layers_count_in_the_size_of_an_area(database, monkeypatch):
    cells = tuple(
        replace(cell, technology="LTE", arfcn=k) for k, cell in enumerate(database.plan.cells)
    )
    given = replace(database, plan=CellPlan(CRS, cells))
    values = given.lattice.rows * given.lattice.cols * 3 * len(cells)
    monkeypatch.setattr(opened_area, "WHOLE_VALUES", values)
    found = open_area(given)
    assert isinstance(found, AreaMap)
    assert found.level_dbm.size == values
    monkeypatch.setattr(opened_area, "WHOLE_VALUES", values - 1)
    assert isinstance(open_area(given), TiledArea)


def test_tiles_have_the_two_strongest_of_each_layer(database):
    """Of two carriers of LTE and GSM: all levels and all roughness are those of the whole."""
    kinds = ("LTE", 1300), ("LTE", 1300), ("LTE", 1300), ("GSM", 20), ("LTE", 3050), ("LTE", 3050)
    cells = tuple(
        replace(cell, technology=technology, arfcn=arfcn)
        for cell, (technology, arfcn) in zip(database.plan.cells, kinds, strict=True)
    )
    given = replace(database, plan=CellPlan(CRS, cells))
    whole = AreaMap.of_field(given.field(), given.plan, given.floor_dbm)
    tiled = TiledArea.of_database(given, side=30)
    assert tiled.layers == whole.layers == (0, 0, 0, 1, 2, 2)
    assert tiled.bands == whole.bands == 12
    assert [tiled.strongest(band) for band in range(6)] == [6, 6, 6, 8, 10, 10]
    level_dbm, rough_db = tiled.looked_up(every_pixel(whole), np.arange(12, dtype=np.int32))
    assert np.array_equal(level_dbm, whole.level_dbm.reshape(-1, 12))
    heard = level_dbm.max(axis=0) > tiled.tiles.quiet_dbm
    assert heard.tolist() == [True] * 9 + [False] + [True] * 2
    assert np.array_equal(rough_db, whole.flat_rough_db.reshape(-1, 12))
    again = pickle.loads(pickle.dumps(tiled.tiles))
    assert again.layers == tiled.layers


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


def test_a_database_without_points_has_no_nearest(database, monkeypatch):
    reader = PointReader(database)
    monkeypatch.setattr(reader._reader, "read", lambda _: {})
    with pytest.raises(StoreError, match="expected points of the database, found none"):
        reader.nearest((0, 0, 20, 20))
