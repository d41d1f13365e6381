"""A town whose database has several tiles, and its area held whole and by tiles."""

import numpy as np
from made_town import CRS, FLOOR_DBM, NAMES, PIXEL_M, SIDE_M

from mapfilter.database.parts import Head, write_parts
from mapfilter.database.tiles import TileRows, places_table, received_levels
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.bayes.sources.evidence import RadioReading
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


def reading(area, town, place_m):
    level = town.levels_dbm(np.asarray(place_m))
    received = [k for k in np.argsort(-level) if level[k] > FLOOR_DBM][:4]
    bands = np.array([area.band_of[NAMES[k]] for k in received], dtype=np.int32)
    level_dbm = level[received].astype("f4")
    report = LevelReport(bands, level_dbm, NONE, NONE.astype("f4"), 0.0)
    return RadioReading(int(bands[0]), 1.0, report)


def far_in_coverage(whole, cell):
    """Return the point on a way, in the local frame, where a cell is weakest."""
    level_dbm = np.where(whole.on_way, whole.level_dbm[..., whole.band_of[cell]], np.inf)
    level_dbm[level_dbm < FLOOR_DBM] = np.inf
    row, col = np.unravel_index(level_dbm.argmin(), level_dbm.shape)
    return (col + 0.5) * PIXEL_M, SIDE_M - (row + 0.5) * PIXEL_M
