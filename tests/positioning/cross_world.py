"""A made cross of streets with two cells, and walks on it.

The lattice has 5 m pixels, 60 rows and 80 columns. One street runs along row 30 from column 5 to
74, the other along column 25 from row 4 to 55: arms of 100, 245, 130 and 125 m. Cell W is strong
in the west, E in the east; NW stands behind a hill and is heard nowhere on the streets.
"""

from math import pi

import numpy as np
import pandas as pd

from mapfilter.database.build import build
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.lattice import RouteLattice
from mapfilter.tracks.log import make_log

CRS = "EPSG:32629"
LATTICE = Lattice(CRS, 531_000.0, 4_556_000.0, 5.0, 60, 80)
STREET_ROW, STREET_COL = 30, 25
CROSSING = LATTICE.east_north(STREET_ROW, STREET_COL)
WAY_EAST_WEST, WAY_NORTH_SOUTH = 11, 22
EAST, NORTH, WEST, SOUTH = 0.0, pi / 2, -pi, -pi / 2
SPEED_MPS = 1.25


def make_plan():
    west, south, east, north = LATTICE.bounds_m
    places = {"W": (west, south + 150), "E": (east, south + 150), "NW": (west, north)}
    return CellPlan(
        CRS, tuple(Cell(i, i, *at, 30.0, None, 50.0, 1800.0, "omni") for i, at in places.items())
    )


def levels_dbm(cell, lattice=LATTICE):
    row, col = np.indices((lattice.rows, lattice.cols))
    if cell.id == "NW":
        return np.where((row < 3) & (col < 3), -60.0, -150.0)
    east, north = lattice.east_north(row, col)
    return -50 - 0.1 * np.hypot(east - cell.east_m, north - cell.north_m)


def make_routes():
    row = [*range(4, 56), *[STREET_ROW] * 70]
    col = [*[STREET_COL] * 52, *range(5, 75)]
    way = [*[WAY_NORTH_SOUTH] * 52, *[WAY_EAST_WEST] * 70]
    point, first = np.unique(np.array(row) * LATTICE.cols + col, return_index=True)
    count = point.size
    return RouteLattice(
        LATTICE,
        (point // LATTICE.cols).astype(np.int32),
        (point % LATTICE.cols).astype(np.int32),
        np.array(way, dtype=np.int64)[first],
        np.zeros(count, dtype=np.int16),
        ("residential",),
        np.zeros(count, dtype=np.float32),
        np.zeros(count, dtype=np.bool_),
    )


def make_database(folder):
    plan = make_plan()
    items = ((cell.id, levels_dbm(cell)) for cell in plan.cells)
    write_rasters(folder / "rxlev.tif", LATTICE, items, plan.ids)
    rasters = open_rasters(folder / "rxlev.tif")
    return build(rasters, plan, make_routes(), folder / "database", floor_dbm=-110.0)


def truth(legs):
    """Positions each second along (heading, metres) legs."""
    headings = np.concatenate([[h] * round(length / SPEED_MPS) for h, length in legs])
    start = LATTICE.east_north(STREET_ROW, 7)
    east = start[0] + np.cumsum([0.0, *(SPEED_MPS * np.cos(headings))])
    north = start[1] + np.cumsum([0.0, *(SPEED_MPS * np.sin(headings))])
    return np.arange(east.size, dtype=float), east, north, headings


def best_servers(east, north):
    """The cell that is strongest at each place."""
    cells = make_plan().cells[:2]
    distances = [np.hypot(east - cell.east_m, north - cell.north_m) for cell in cells]
    return np.array([cell.id for cell in cells])[np.argmin(distances, axis=0)]


WALK = ((EAST, 90.0), (NORTH, 90.0), (SOUTH, 90.0), (EAST, 200.0))


def walk_tables(legs=WALK):
    """Motion, radio and truth of a walk with perfect dead reckoning, 1.25 m each second."""
    time_s, east, north, headings = truth(legs)
    motion = pd.DataFrame({"time_s": time_s[1:], "step_m": SPEED_MPS, "heading_rad": headings})
    radio = pd.DataFrame({"time_s": time_s, "role": "serving", "cell": best_servers(east, north)})
    places = pd.DataFrame({"time_s": time_s, "east_m": east, "north_m": north})
    return {"motion": motion, "radio": radio, "truth": places}


def walk_log(legs=WALK, **tables):
    return make_log(CRS, **{**walk_tables(legs), **tables}, start_utc_s=1_700_000_000.0)
