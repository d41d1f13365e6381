"""A town of blocks: crossings 100 m apart, residential and secondary streets, houses, a park."""

import numpy as np

from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.roads.network import StreetNetwork
from mapfilter.simulation.worlds.open_ground import OpenGround
from mapfilter.simulation.worlds.street_lines import StreetLines

CRS = "EPSG:32629"
WEST_M, SOUTH_M = 530_000.0, 4_555_000.0
SIZE, BLOCK_M = 11, 100.0
LATTICE = Lattice(CRS, WEST_M, SOUTH_M + 1100.0, 5.0, 220, 220)


def network():
    node = np.arange(SIZE * SIZE).reshape(SIZE, SIZE)
    pairs = [(node[:, :-1], node[:, 1:]), (node[:-1], node[1:])]
    a, b = (np.concatenate([ends[i].ravel() for ends in pairs]).astype(np.int32) for i in range(2))
    row, col = np.divmod(np.arange(SIZE * SIZE), SIZE)
    east, north = WEST_M + 50.0 + BLOCK_M * col, SOUTH_M + 50.0 + BLOCK_M * row
    along_row = np.arange(a.size) < SIZE * (SIZE - 1)
    # One way for each straight street.
    way = np.where(along_row, 100 + row[a], 200 + col[a]).astype(np.int64)
    return StreetNetwork(
        CRS,
        east,
        north,
        a,
        b,
        np.hypot(east[b] - east[a], north[b] - north[a]),
        way,
        np.where(along_row, 0, 1).astype(np.int16),
        ("residential", "secondary"),
        np.zeros(a.size, np.int8),
    )


def streets():
    return StreetLines(network())


def built():
    """A house of 40 m by 40 m in the middle of every second block; parks in the others."""
    row, col = np.indices((LATTICE.rows, LATTICE.cols))
    east, north = LATTICE.east_north(row, col)
    x, y = east - WEST_M - 50.0, north - SOUTH_M - 50.0
    middle = (np.abs(x % BLOCK_M - 50.0) < 20.0) & (np.abs(y % BLOCK_M - 50.0) < 20.0)
    even = (np.floor(x / BLOCK_M) + np.floor(y / BLOCK_M)) % 2 == 0
    return middle & even


def ground():
    houses = built()
    return OpenGround(LATTICE, ~houses, houses)


def heights_m():
    return np.where(built(), 15.0, 0.0).astype(np.float32)


def plan():
    """Two sites of three sectors, and an indoor cell."""
    cells = []
    for site, (east, north) in {"S1": (300.0, 310.0), "S2": (800.0, 790.0)}.items():
        for sector, azimuth in zip("ABC", (0.0, 120.0, 240.0), strict=True):
            number = len(cells)
            cells.append(
                Cell(
                    f"{site}{sector}", site, WEST_M + east, SOUTH_M + north, 30.0, azimuth, 52.0,
                    1800.0, arfcn=512 + number, bsic=number,
                )
            )  # fmt: skip
    cells.append(
        Cell(
            "I1", "I1", WEST_M + 600.0, SOUTH_M + 200.0, 4.0, None, 30.0, 1800.0, "omni",
            indoor=True, penetration_loss_db=10.0, arfcn=600, bsic=9,
        )
    )  # fmt: skip
    return CellPlan(CRS, tuple(cells))
