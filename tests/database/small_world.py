"""A small world: an L-shaped street, a square, three cells, and rasters of known levels."""

import json
from dataclasses import dataclass

import numpy as np
import shapely

from mapfilter._json_files import sealed
from mapfilter.database.build import build
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.route_points import route_lattice
from mapfilter.roads.ways import Squares, Ways

CRS = "EPSG:32629"
LATTICE = Lattice(CRS, 531_000.0, 4_556_000.0, 5.0, 40, 50)
FLOOR_DBM = -90.0
IDS = ("S1.A", "S1.B", "I 1")


def make_plan(ids=IDS, **changes):
    west, south, east, north = LATTICE.bounds_m
    places = [(west + 40, north - 30), (east - 30, north - 50), (west + 120, south + 40)]
    return CellPlan(
        CRS,
        tuple(
            Cell(i, "S", *places[n % 3], 30.0, None, 50.0, 1800.0, antenna="omni", **changes)
            for n, i in enumerate(ids)
        ),
    )


def levels_of(plan, lattice=LATTICE, seed=3):
    """Distance law and noise; the second cell has no data in the north-west."""
    rng = np.random.default_rng(seed)
    row, col = np.divmod(np.arange(lattice.rows * lattice.cols), lattice.cols)
    east, north = lattice.east_north(row, col)
    for n, cell in enumerate(plan.cells):
        distance = np.hypot(east - cell.east_m, north - cell.north_m) + 10
        level = -30 - 30 * np.log10(distance) + rng.normal(0, 4, row.size)
        level = level.reshape(lattice.rows, lattice.cols)
        if n == 1:
            level[:15, :15] = np.nan
        yield cell.id, np.round(level, 2)


def make_routes(lattice=LATTICE):
    west, _, _, north = LATTICE.bounds_m
    corners = np.add([(5, -20), (200, -20), (200, -180)], (west, north))
    ways = Ways(
        CRS, np.array([77]), np.array([0], np.int16), ("residential",),
        np.array([shapely.LineString(corners)]), np.array([False]), np.array([0], np.int8),
    )  # fmt: skip
    place = shapely.box(west + 60, north - 120, west + 110, north - 70)
    return route_lattice(ways, Squares(CRS, np.array([5]), np.array([place])), None, lattice)


@dataclass(frozen=True)
class World:
    plan: CellPlan
    routes: RouteLattice
    rasters: RxLevRasters
    levels_dbm: np.ndarray


def make_world(folder):
    """Write the rasters into a folder."""
    plan = make_plan()
    items = list(levels_of(plan))
    write_rasters(folder / "rxlev.tif", LATTICE, iter(items), plan.ids)
    levels_dbm = np.stack([values for _, values in items])
    return World(plan, make_routes(), open_rasters(folder / "rxlev.tif"), levels_dbm)


def make_database(world, folder):
    """Build the database of a world in tiles of 16 pixels."""
    out = folder / "database"
    return build(world.rasters, world.plan, world.routes, out, floor_dbm=FLOOR_DBM, tile_px=16)


def contents(folder):
    """The bytes of all files in a folder."""
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def change_manifest(folder, **changes):
    manifest = json.loads((folder / "manifest.json").read_text())
    (folder / "manifest.json").write_text(json.dumps(sealed({**manifest, **changes})))
