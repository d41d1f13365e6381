"""A town of fifteen by fifteen crossings, 100 m apart, with ten cells whose levels fall off."""

import numpy as np

from mapfilter.experiments.sweep.world import SweepWorld
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.roads.network import StreetNetwork

CRS = "EPSG:32629"
WEST_M, SOUTH_M = 530_000.0, 4_555_000.0
SIZE = 15


def network():
    node = np.arange(SIZE * SIZE).reshape(SIZE, SIZE)
    pairs = [(node[:, :-1], node[:, 1:]), (node[:-1], node[1:])]
    a, b = (np.concatenate([ends[i].ravel() for ends in pairs]).astype(np.int32) for i in range(2))
    row, col = np.divmod(np.arange(SIZE * SIZE), SIZE)
    shift = np.random.default_rng(1).uniform(-20, 20, (2, SIZE * SIZE))
    east = WEST_M + 50.0 + 100.0 * col + shift[0]
    north = SOUTH_M + 50.0 + 100.0 * row + shift[1]
    return StreetNetwork(
        CRS,
        east,
        north,
        a,
        b,
        np.hypot(east[b] - east[a], north[b] - north[a]),
        1000 + np.arange(a.size, dtype=np.int64),
        np.zeros(a.size, np.int16),
        ("residential",),
        np.zeros(a.size, np.int8),
    )


def plan():
    places = np.random.default_rng(2).uniform(100, 1400, (10, 2))
    return CellPlan(
        CRS,
        tuple(
            Cell(
                f"C{i}", f"S{i}", WEST_M + east, SOUTH_M + north, 30.0, None, 55.0, 1800.0,
                "omni", arfcn=512 + i, bsic=i,
            )
            for i, (east, north) in enumerate(places)
        ),
    )  # fmt: skip


def streets():
    lattice = Lattice(CRS, WEST_M, SOUTH_M + 1500.0, 10.0, 150, 150)
    return SweepWorld(network(), plan(), lattice, {})


def levels(east_m, north_m):
    """-20 - 35 log10(d / 10 m), at least 20 m away."""
    cells = plan().cells
    away = np.hypot(
        np.asarray(east_m)[:, None] - [cell.east_m for cell in cells],
        np.asarray(north_m)[:, None] - [cell.north_m for cell in cells],
    )
    return -20 - 35 * np.log10(np.maximum(away, 20) / 10)
