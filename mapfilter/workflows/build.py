"""``mapfilter build``: RxLev rasters and roads to a radio-route database."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from mapfilter._io import ensure_writable_folder, sha256_file
from mapfilter._parallel import Progress, local_executor
from mapfilter.database.build import BuildEstimate, build, dry_run
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import Lattice
from mapfilter.radio.rasters import RxLevRasters, open_rasters
from mapfilter.roads.pbf import resolve_map
from mapfilter.workflows.sections import Area, Config
from mapfilter.workflows.world import World, area_lattice

ATTRIBUTION = "© OpenStreetMap contributors (ODbL)"


@dataclass(frozen=True)
class BuildResult:
    """What was built.

    Parameters
    ----------
    points, cells : int
        Points that hear at least one cell, and cells.
    routable_points : int
        Points of the roads, those that hear nothing included.
    database : Path
        The folder.
    seconds : float
        Wall time.
    """

    points: int
    cells: int
    routable_points: int
    database: Path
    seconds: float


def run_build(config: Config, *, workers: int = 1, progress: Progress | None = None) -> BuildResult:
    """Build the database of a configuration; an older one is replaced when the new one is whole.

    Raises
    ------
    MapfilterError
        Rasters, plan, map or area are wrong or do not fit each other, or the output cannot be
        written.
    """
    began_s = time.perf_counter()
    target = config.database_path
    ensure_writable_folder(target.parent)
    rasters, world = _raster_world(config)
    routes = world.routes
    with local_executor(workers) as executor:
        database = build(
            rasters,
            world.plan,
            routes,
            target,
            margin_db=config.database.margin_db,
            floor_dbm=config.database.floor_dbm,
            tile_px=config.database.tile_px,
            inputs=_inputs(config),
            attribution=ATTRIBUTION,
            executor=executor,
            progress=progress,
        )
    return BuildResult(
        int(database.manifest["counts"]["points"]),
        len(database.cell_ids),
        len(routes),
        target,
        time.perf_counter() - began_s,
    )


def run_dry_build(config: Config) -> BuildEstimate:
    """Estimate size, memory and time of a build, writing nothing.

    Raises
    ------
    MapfilterError
        As for :func:`run_build`.
    """
    rasters, world = _raster_world(config)
    section = config.database
    return dry_run(
        rasters,
        world.plan,
        world.routes,
        margin_db=section.margin_db,
        floor_dbm=section.floor_dbm,
        tile_px=section.tile_px,
    )


def _raster_world(config: Config) -> tuple[RxLevRasters, World]:
    """Return the rasters and the world on their lattice, cut to the area where one is given."""
    rasters = open_rasters(config.rasters_path)
    lattice = rasters.lattice
    if config.area.bbox is not None or config.area.southwest is not None:
        lattice = _cut(lattice, config.area, str(rasters.path))
    return rasters, World(config, lattice)


def _cut(lattice: Lattice, area: Area, name: str) -> Lattice:
    wanted = area_lattice(area.model_copy(update={"crs": lattice.crs}))
    west, south, east, north = wanted.bounds_m
    # A hair inside, so that an edge on a pixel's edge takes no pixel beyond it.
    hair_m = 1e-6 * lattice.resolution_m
    top, left = lattice.row_col(west + hair_m, north - hair_m)
    bottom, right = lattice.row_col(east - hair_m, south + hair_m)
    top, left = max(top, 0), max(left, 0)
    rows, cols = min(bottom, lattice.rows - 1) - top + 1, min(right, lattice.cols - 1) - left + 1
    if rows < 1 or cols < 1:
        covered = ", ".join(f"{value:.0f}" for value in lattice.bounds_m)
        asked = ", ".join(f"{value:.0f}" for value in wanted.bounds_m)
        expected = f"an area that overlaps the rasters {name} ({covered})"
        raise fail(InputError, "area", expected, asked, "rasters and roads of different places")
    return lattice.window(top, left, rows, cols)


def _inputs(config: Config) -> dict[str, str]:
    files = [resolve_map(config.area.map)]
    files += [path for path in (config.cells.plan, config.roads.landuse) if path is not None]
    return {path.name: sha256_file(path) for path in files}
