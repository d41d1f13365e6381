"""A made network with its visits, for tests of learning; nothing of it comes from the package."""

import math

import numpy as np

from mapfilter.learning.patterns import Patterns
from mapfilter.learning.visits import Visits
from mapfilter.radio.cells import Cell, CellPlan

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
            there = (x + 600.0) % 1200.0, (y + 450.0) % 1200.0
            for n in range(along.size):
                rows += _visit(
                    journey,
                    x[n],
                    y[n],
                    true,
                    silent,
                    shadow,
                    error_db,
                    phone,
                    rng,
                    (there[0][n], there[1][n]) if journey in lost else (x[n], y[n]),
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
    """Rows of one visit: what is received at ``place`` is said to be of (x, y)."""
    square = math.floor(place[0] / SQUARE_M), math.floor(place[1] / SQUARE_M)
    number = math.floor(x / SQUARE_M) * 100 + math.floor(y / SQUARE_M)
    east, north = EAST + place[0], NORTH + place[1]
    found = []
    for c, cell in enumerate(true.cells):
        if (c, square) not in shadow:
            shadow[c, square] = error_db * rng.standard_normal()
        level = float(level_dbm(cell, np.array([east]), np.array([north]))[0])
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
