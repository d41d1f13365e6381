"""``mapfilter build``: RxLev rasters and roads to a radio-route database."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path

from mapfilter._io import ensure_writable_folder
from mapfilter._parallel import Progress, executor_of
from mapfilter.config.inputs import Area
from mapfilter.config.sections import Config
from mapfilter.database.build import build
from mapfilter.database.estimate import BuildEstimate, dry_run
from mapfilter.database.manifest import InputFile
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import Lattice, projected_crs, same_crs
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.workflows.pictures import NETWORK_PICTURES, clear_pictures, draw_network
from mapfilter.workflows.streets import pixels_on
from mapfilter.workflows.world import (
    World,
    area_lattice,
    check_cells_near,
    check_scale,
    map_cover,
    planned_rasters,
    raster_cover,
)

PIXELS_A_TASK = 10_000_000
MOST_TILES_A_TASK = 64
_TASKS_A_WORKER = 4


@dataclass(frozen=True)
class BuildResult:
    """What was built.

    Parameters
    ----------
    points, cells : int
        Points that receive at least one cell, and cells.
    routable_points : int
        Points of the roads, including those that receive no cell.
    database : Path
        The folder.
    seconds : float
        Wall time, without that of the pictures.
    notes : tuple of str
        What was done to the inputs, such as rasters resampled, and what covers the area in part.
    pictures : tuple of Path
        What was drawn of the database, in the folder ``pictures`` of the output.
    """

    points: int
    cells: int
    routable_points: int
    database: Path
    seconds: float
    notes: tuple[str, ...] = ()
    pictures: tuple[Path, ...] = ()


def run_build(
    config: Config,
    *,
    workers: int = 1,
    cluster: str | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> BuildResult:
    """Build the database of a configuration; an older one is replaced when the new one is whole.

    Parameters
    ----------
    workers : int
        Local processes.
    cluster : str, optional
        Address of a Dask scheduler whose workers do it instead, or "local:N"; they must reach the
        rasters by the same paths.
    resume : bool
        Go on where a build of the same inputs was cut short.

    Raises
    ------
    MapfilterError
        Rasters, plan, map or area are wrong or do not fit each other, or the output cannot be
        written.
    """
    began_s = time.perf_counter()
    target = config.database_path
    rasters, plan, world = _raster_world(config)
    check_cells_near(plan, world.lattice, str(config.cells.plan or "cells"))
    ensure_writable_folder(target.parent)
    tiles_a_task = 1
    if cluster is not None:
        pixels = config.database.tile_px**2 * len(plan.ids)
        tiles_a_task = min(max(PIXELS_A_TASK // pixels, 1), MOST_TILES_A_TASK)
    with executor_of(workers, cluster) as (executor, at_once):
        database = build(
            rasters,
            plan,
            world.route_tiles,
            target,
            margin_db=config.database.margin_db,
            floor_dbm=config.database.floor_dbm,
            tile_px=config.database.tile_px,
            inputs=_inputs(world),
            attribution=world.streets.attribution,
            executor=executor,
            in_flight=_TASKS_A_WORKER * at_once,
            tiles_a_task=tiles_a_task,
            writers=at_once,
            resume=resume,
            progress=progress,
        )
    seconds = time.perf_counter() - began_s
    return BuildResult(
        int(database.manifest["counts"]["points"]),
        len(database.cell_ids),
        sum(int(database.manifest["counts"][name]) for name in database.manifest["counts"]),
        target,
        seconds,
        (
            *rasters.notes,
            *raster_cover(config.area, world.lattice),
            *map_cover(world),
            *world.streets.notes,
        ),
        _draw(config, rasters, database, world),
    )


def run_dry_build(config: Config) -> BuildEstimate:
    """Estimate size, memory and time of a build, writing nothing.

    Raises
    ------
    MapfilterError
        As for :func:`run_build`.
    """
    began_s = time.perf_counter()
    rasters, plan, world = _raster_world(config)
    check_cells_near(plan, world.lattice, str(config.cells.plan or "cells"))
    section, routes = config.database, world.route_tiles
    _inputs(world)
    reading_s = time.perf_counter() - began_s
    estimate = dry_run(
        rasters,
        plan,
        routes,
        margin_db=section.margin_db,
        floor_dbm=section.floor_dbm,
        tile_px=section.tile_px,
    )
    # A build reads the same map, plan and headers first.
    return replace(estimate, seconds=estimate.seconds + reading_s)


def _raster_world(config: Config) -> tuple[RxLevRasters, CellPlan, World]:
    """Return rasters, plan, and the world on the rasters' lattice, cut to the area if one is given.

    The rasters are then read as if they held no more than that: a database is of the area that it
    was built for, and merged it has no word beyond it. A plan by rule is laid out over the whole
    rasters, as when they were predicted.
    """
    rasters = planned_rasters(config)
    lattice, area = rasters.lattice, config.area
    if area.crs is not None:
        wanted = projected_crs(area.crs, "area.crs")
        if not same_crs(wanted, lattice.crs):
            expected = f"{wanted}, the CRS of the area"
            raise fail(InputError, f"{rasters.path}, CRS", expected, lattice.crs, "another zone")
    check_scale(lattice.crs, lattice.bounds_m, f"{rasters.path}, CRS")
    whole = World(config, lattice)
    if not area.has_box:
        return rasters, whole.plan, whole
    cut = _cut(lattice, area, str(rasters.path))
    if cut == lattice:
        return rasters, whole.plan, whole
    return replace(rasters, lattice=cut), whole.plan, World(config, cut)


def _cut(lattice: Lattice, area: Area, name: str) -> Lattice:
    wanted = area_lattice(area.model_copy(update={"crs": lattice.crs}))
    found = pixels_on(lattice, wanted.bounds_m)
    if found is None:
        covered = ", ".join(f"{value:.0f}" for value in lattice.bounds_m)
        asked = ", ".join(f"{value:.0f}" for value in wanted.bounds_m)
        expected = f"an area that overlaps the rasters {name} ({covered})"
        raise fail(InputError, "area", expected, asked, "rasters and roads of different places")
    return lattice.window(*found)


def _draw(
    config: Config, rasters: RxLevRasters, database: RadioRouteDatabase, world: World
) -> tuple[Path, ...]:
    """Draw the database; pictures of an older one are removed in any case."""
    folder = config.pictures_path
    if config.output.pictures == "none":
        clear_pictures(folder, NETWORK_PICTURES)
        return ()
    return draw_network(
        rasters,
        database,
        folder,
        area=world.lattice,
        landuse=world.landuse,
        buildings=world.buildings if config.roads.cut_buildings else None,
    )


def _inputs(world: World) -> list[InputFile]:
    plan = world.config.surveyed_plan or world.config.cells.plan
    files = (*world.streets.files, *((("plan", plan),) if plan is not None else ()))
    return [InputFile.of(name, path) for name, path in files]
