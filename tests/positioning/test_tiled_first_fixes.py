"""Where a search of an area held by tiles begins after first fixes, distances and satellites."""

import numpy as np
import pandas as pd
import pytest
from made_town import CRS, FLOOR_DBM, PIXEL_M, SIDE_M, SOUTH_M, WEST_M, Town
from tiled_town import far_in_coverage, write_database

from mapfilter.database.store import open_database
from mapfilter.gnss.almanacs import nominal_gps
from mapfilter.gnss.orbits import gps_time
from mapfilter.models.level_errors import LevelErrors
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.area.tile_search import (
    searched_tiles,
)
from mapfilter.positioning.bayes.area.tiled_area import TiledArea
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.bayes.sources.timing import TimingSource
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.gnss.fixes import FixTerm
from mapfilter.positioning.gnss.options import GnssOptions, TimingOptions
from mapfilter.positioning.gnss.source import GnssSource
from mapfilter.positioning.merging import epochs
from mapfilter.simulation.satellites import ReceptionModel, receive
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
