"""Write a database anew with other levels, cells or further points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mapfilter._io import atomic_dir
from mapfilter._parallel import Progress
from mapfilter._types import Floats32, Ints
from mapfilter.database.manifest import InputFile, check_database_replaceable
from mapfilter.database.measured import merged_parts
from mapfilter.database.parts import Head, write_parts
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.database.tiles import TileRows, places_table, received_levels, tile_windows
from mapfilter.errors import InputError, fail
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.layers import layer_numbers
from mapfilter.roads.lattice import RouteLattice


def routes_of(database: RadioRouteDatabase) -> RouteLattice:
    """Return the points of a database as the route lattice that they were built from."""
    points = database.points()
    codes, names = points.way_class
    return RouteLattice(
        database.lattice,
        points.row,
        points.col,
        points.way_id,
        codes.astype(np.int16),
        names,
        points.distance_to_way_m,
        points.on_square,
        database.attribution,
    )


def levels_of(database: RadioRouteDatabase) -> Floats32:
    """Return the levels of all cells at all points, shape (cells, points); NaN below the floor."""
    point = database.points().point
    found = np.full((len(database.plan), point.size), np.nan, dtype=np.float32)
    for number, cell_id in enumerate(database.cell_ids):
        row, col, level_dbm = database.cell_points(cell_id, np.inf)
        at = np.searchsorted(point, row.astype(np.int64) * database.lattice.cols + col)
        found[number, at] = level_dbm
    return found


def rewrite(
    database: RadioRouteDatabase,
    out: Path | str,
    plan: CellPlan,
    routes: RouteLattice,
    level_dbm: Floats32,
    *,
    inputs: Sequence[InputFile] = (),
    progress: Progress | None = None,
) -> RadioRouteDatabase:
    """Write a database with other cells, points or levels, and open it.

    Lattice, margin, floor and attribution stay; the inputs of the new database are the old one and
    what is given.

    Parameters
    ----------
    plan : CellPlan
        Its cells.
    routes : RouteLattice
        Its points, on the database's lattice.
    level_dbm : (cells, points) array
        Levels at the points; NaN and what lies below the floor are left out.
    inputs : sequence of InputFile
        What the change was made from.

    Raises
    ------
    InputError
        No level is above the floor.
    OutputError
        The folder cannot be written, or holds other files than a database.
    """
    out = Path(out)
    check_database_replaceable(out)
    parameters = database.manifest["parameters"]
    windows = tile_windows(database.lattice, parameters["tile_px"])
    old = InputFile("database", database.path.name, database.generation)
    with atomic_dir(out) as folder:
        layer = layer_numbers(plan.cells)
        tiles = _tiles(database.lattice, windows, routes, level_dbm, database.floor_dbm, layer)
        crs, ids = database.lattice.crs, plan.ids
        written = write_parts(folder, crs, ids, tiles, len(windows), progress=progress)
        if written.received == 0:
            raise fail(InputError, str(out), "a level above the floor", "none")
        counts = {
            "points": written.received,
            "points_below_floor": written.below_floor,
            "points_off_rasters": None,
            "points_without_level": written.points - written.received - written.below_floor,
        }
        measured = database.measured()
        if measured is not None:
            measured = merged_parts([measured], [(0, 0)], plan.ids, database.plan.ids)
        head = Head(
            database.lattice,
            plan,
            parameters,
            database.attribution,
            (old, *inputs),
            counts,
            measured,
        )
        head.write(folder, written.parts)
    return open_database(out)


def _tiles(
    lattice: Lattice,
    windows: Sequence[tuple[int, int, int, int]],
    routes: RouteLattice,
    level_dbm: Floats32,
    floor_dbm: float,
    layer: Ints,
) -> Iterator[TileRows]:
    for top, left, rows, cols in windows:
        inside = (routes.row >= top) & (routes.row < top + rows)
        inside &= (routes.col >= left) & (routes.col < left + cols)
        own = np.flatnonzero(inside)
        part = _part(routes, own)
        places = places_table(part, lattice)
        order = np.searchsorted(part.point, places["point"].to_numpy())
        levels = level_dbm[:, own][:, order].astype(np.float64)
        yield TileRows(places, received_levels(levels, floor_dbm, layer))


def _part(routes: RouteLattice, own: Ints) -> RouteLattice:
    return replace(
        routes,
        row=routes.row[own],
        col=routes.col[own],
        way_id=routes.way_id[own],
        way_class=routes.way_class[own],
        distance_to_way_m=routes.distance_to_way_m[own],
        on_square=routes.on_square[own],
    )
