"""A made network with its visits, for tests of learning; nothing of it comes from the package."""

import math

import numpy as np
import pandas as pd

from mapfilter.database.build import build
from mapfilter.lattice import Lattice
from mapfilter.learning.patterns import Patterns
from mapfilter.learning.visits import Visits
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.lattice import RouteLattice
from mapfilter.tracks.log import make_log

CRS = "EPSG:32632"
EAST, NORTH = 500_000.0, 5_500_000.0  # on the central meridian: grid north is true north
FLOOR_DBM = -104.0
SQUARE_M = 40.0


def plan_of(sites=((300, 300), (900, 900), (300, 900)), sectors=3, indoor=((900, 300),)):
    cells = []
    for s, (x, y) in enumerate(sites, start=1):
        for j in range(sectors):
            cells.append(
                Cell(
                    f"S{s}{'ABC'[j]}",
                    f"S{s}",
                    EAST + x,
                    NORTH + y,
                    30.0,
                    j * 360.0 / sectors,
                    50.0,
                    1800.0,
                    arfcn=500 + len(cells),
                    bsic=0,
                )
            )
    for i, (x, y) in enumerate(indoor, start=1):
        cells.append(
            Cell(
                f"I{i}",
                f"I{i}",
                EAST + x,
                NORTH + y,
                4.0,
                None,
                35.0,
                1800.0,
                "omni",
                indoor=True,
                arfcn=500 + len(cells),
                bsic=0,
            )
        )
    return CellPlan(CRS, tuple(cells))


def level_dbm(cell, east_m, north_m):
    """Level by distance and a parabola for the sector, written out here as an oracle."""
    distance = np.maximum(np.hypot(east_m - cell.east_m, north_m - cell.north_m), 20.0)
    level = cell.eirp_dbm - 100.0 - 35.0 * np.log10(distance / 100.0)
    if cell.azimuth_deg is not None:
        azimuth = np.degrees(np.arctan2(east_m - cell.east_m, north_m - cell.north_m))
        off = (azimuth - cell.azimuth_deg + 180.0) % 360.0 - 180.0
        level = level - np.minimum(12.0 * (off / cell.beamwidth_deg) ** 2, 25.0)
    return level


def levels_of(plan, east_m, north_m):
    found = np.column_stack([level_dbm(cell, east_m, north_m) for cell in plan.cells])
    return np.where(found >= FLOOR_DBM, found, np.nan)


def study(given, true, rng, *, journeys=8, silent=(), error_db=6.0, phone_db=3.0, lost=()):
    """Visits on straight walks through a square of 1200 m, as received in the true network.

    Journeys in ``lost`` were located somewhere else than they were.
    """
    rows = []
    shadow = {}
    for journey in range(journeys):
        phone = phone_db * rng.standard_normal()
        # Along and across, so that each journey sees much of the area.
        for line in rng.uniform(0, 1200, 4):
            along = np.arange(0.0, 1200.0, SQUARE_M) + SQUARE_M / 2
            across = np.full(along.size, line)
            x, y = (along, across) if rng.random() < 0.5 else (across, along)
            place = (x, y)
            if journey in lost:
                place = (x + 600.0) % 1200.0, (y + 450.0) % 1200.0
            levels = [level_dbm(cell, EAST + place[0], NORTH + place[1]) for cell in true.cells]
            for n in range(along.size):
                there = place[0][n], place[1][n], [float(level[n]) for level in levels]
                rows += _visit(
                    journey, x[n], y[n], true, silent, shadow, error_db, phone, rng, there
                )
    table = np.array(rows, dtype=float)
    visits = Visits(
        table[:, 0].astype(np.int64),
        table[:, 1].astype(np.int64),
        table[:, 2].astype(np.int64),
        table[:, 3],
        table[:, 4],
        table[:, 5],
        table[:, 6].astype(bool),
    )
    key = np.stack([visits.journey, visits.square])
    _, first, place = np.unique(key, axis=1, return_index=True, return_inverse=True)
    east, north = visits.east_m[first], visits.north_m[first]
    patterns = Patterns(given, east, north, levels_of(given, east, north), FLOOR_DBM)
    return visits, patterns, place.ravel(), journeys


def _visit(journey, x, y, true, silent, shadow, error_db, phone, rng, place):
    """Rows of one visit: what is received at ``place``, levels of all cells, is said of (x, y)."""
    square = math.floor(place[0] / SQUARE_M), math.floor(place[1] / SQUARE_M)
    number = math.floor(x / SQUARE_M) * 100 + math.floor(y / SQUARE_M)
    found = []
    for c, cell in enumerate(true.cells):
        if (c, square) not in shadow:
            shadow[c, square] = error_db * rng.standard_normal()
        level = place[2][c]
        level += shadow[c, square] + phone + 2.0 * rng.standard_normal()
        found.append(-np.inf if cell.id in silent else level)
    order = np.argsort(found)[::-1][:7]
    bound = max(found[order[-1]], FLOOR_DBM)
    rows = []
    for c in range(len(true)):
        heard = c in order and found[c] >= FLOOR_DBM
        level = found[c] if heard else bound
        rows.append((journey, c, number, EAST + x, NORTH + y, level, heard))
    return rows


LATTICE = Lattice(CRS, EAST, NORTH + 1200.0, 20.0, 60, 60)


def streets():
    """Streets every 200 m, along and across, as points of 20 m."""
    row, col = np.mgrid[0:60, 0:60]
    on = (row % 10 == 5) | (col % 10 == 5)
    row, col = (axis[on].astype(np.int32) for axis in (row, col))
    count = row.size
    return RouteLattice(
        LATTICE,
        row,
        col,
        np.arange(1, count + 1),
        np.zeros(count, np.int16),
        ("footway",),
        np.zeros(count, np.float32),
        np.zeros(count, bool),
    )


def database_of(plan, folder):
    """The radio-route database that is built of a plan by the oracle's levels."""
    row, col = np.mgrid[0:60, 0:60]
    levels = levels_of(plan, *(axis.ravel() for axis in LATTICE.east_north(row, col)))
    layers = (
        (name, levels[:, i].reshape(60, 60).astype(np.float32)) for i, name in enumerate(plan.ids)
    )
    folder.mkdir(parents=True)
    write_rasters(folder / "r.tif", LATTICE, layers, plan.ids)
    out = folder / "database"
    return build(open_rasters(folder / "r.tif"), plan, streets(), out, floor_dbm=FLOOR_DBM)


def log_of(true, rng, *, silent=(), blocks=12, levels=True, crs=CRS):
    """A walk of some blocks along the streets, a report every 10 m."""
    corner = rng.integers(0, 6, 2)
    heading, corners = None, [corner]
    for _ in range(blocks):
        ways = [np.array(w) for w in ((0, 1), (1, 0), (0, -1), (-1, 0))]
        able = [w for w in ways if np.all((corner + w >= 0) & (corner + w <= 5))]
        able = [w for w in able if heading is None or not np.array_equal(w, -heading)]
        heading = able[rng.integers(len(able))]
        corner = corner + heading
        corners.append(corner)
    turns = np.array(corners) * 200.0 + 100.0
    at = np.arange(0.0, 200.0 * blocks + 0.1, 10.0)
    along = np.arange(len(turns)) * 200.0
    x, y = (np.interp(at, along, turns[:, axis]) for axis in (0, 1))
    # The middle of the street's pixels.
    east, north = EAST + x + 10.0, NORTH + y - 10.0
    moved = np.column_stack([np.diff(east), np.diff(north)])
    turned = np.arctan2(moved[:, 1], moved[:, 0]) + 0.05 * rng.standard_normal(len(moved))
    time_s = np.arange(at.size) * 8.0
    motion = pd.DataFrame(
        {
            "time_s": time_s[1:],
            "step_m": np.hypot(*moved.T) * (1 + 0.02 * rng.standard_normal(len(moved))),
            "heading_rad": (turned + math.pi) % (2 * math.pi) - math.pi,
        }
    )
    truth = pd.DataFrame({"time_s": time_s, "east_m": east, "north_m": north})
    level = np.column_stack([level_dbm(cell, east, north) for cell in true.cells])
    level = level + 3.0 * rng.standard_normal() + 5.0 * rng.standard_normal(level.shape)
    level[:, [true.index(name) for name in silent]] = -np.inf
    rows = []
    for i in range(at.size):
        order = np.argsort(-level[i])[:7]
        for rank, c in enumerate(c for c in order.tolist() if level[i, c] >= FLOOR_DBM):
            cell = true.cells[c]
            serving = rank == 0
            rows.append(
                {
                    "time_s": time_s[i],
                    "role": "serving" if serving else "neighbour",
                    "cell": cell.id if serving else None,
                    "arfcn": cell.arfcn,
                    "bsic": cell.bsic,
                    "level_dbm": round(level[i, c], 1) if levels else np.nan,
                }
            )
    return make_log(crs, motion=motion, radio=pd.DataFrame(rows), truth=truth)
