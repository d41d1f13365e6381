"""``mapfilter build``: RxLev rasters and roads to a radio-route database."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from mapfilter._io import ensure_writable_folder
from mapfilter._parallel import Progress, executor_of, made_ready
from mapfilter._partial import nothing_left
from mapfilter._words import number_of
from mapfilter.check.findings import Findings
from mapfilter.check.identity_checks import check_identities
from mapfilter.config.sections import Config
from mapfilter.database.build import build, build_roads
from mapfilter.database.build_job import TASKS_A_WORKER
from mapfilter.database.estimate import BuildEstimate, dry_run
from mapfilter.database.floor import floor_notes, weak_points_note
from mapfilter.database.manifest import InputFile
from mapfilter.database.measured import Readings
from mapfilter.database.measured_files import read_checked_readings
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.database.tiles import get_ready_to_read
from mapfilter.errors import ConfigError, StoreError, fail, listed
from mapfilter.radio.plan_notes import layer_notes
from mapfilter.rasters.geotiff import READINGS_TAG, tag_of
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.workflows.inputs.world import (
    World,
    map_cover,
    planned_rasters,
    raster_cover,
    raster_world,
)
from mapfilter.workflows.outputs.pictures import NETWORK_PICTURES, clear_pictures, draw_network

_NAMED = 6
_FEW_POINTS = 0.1


@dataclass(frozen=True)
class BuildResult:
    """Counts, folder and pictures of a database that was built."""

    points: int
    """Points that receive at least one cell; without cells, all."""
    cells: int
    routable_points: int
    """Points of the roads, including those that receive no cell."""
    database: Path
    seconds: float
    """Wall time, without that of the pictures."""
    notes: tuple[str, ...] = ()
    """Changes of the inputs, such as resampling, and inputs that cover only a part of the area."""
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
    """
    began_s = time.perf_counter()
    target, section = config.database_path, config.database
    if not section.cells:
        return _build_roads(config, progress)
    # Local workers start while the inputs are read; a cluster is asked for when these are right.
    read = None if cluster is None else raster_world(config, planned_rasters(config))
    with nothing_left(target.parent), executor_of(workers, cluster) as (executor, at_once):
        made_ready(executor, at_once, get_ready_to_read)
        rasters, plan, world = read or raster_world(config, planned_rasters(config))
        ensure_writable_folder(target.parent)
        database = build(
            rasters,
            plan,
            world.route_tiles,
            target,
            margin_db=section.margin_db,
            floor_dbm=section.floor_dbm,
            tile_px=section.tile_px,
            inputs=_inputs(world),
            attribution=world.streets.attribution,
            measured=_measured(config),
            executor=executor,
            in_flight=TASKS_A_WORKER * at_once,
            writers=at_once,
            resume=resume,
            progress=progress,
        )
    counts: dict[str, Any] = database.manifest["counts"]
    floor = floor_notes(plan, section.floor_dbm)
    floor = (*floor, *weak_points_note(counts, database.floor_dbm))
    cover = (*raster_cover(config.area, world.lattice), *map_cover(world))
    return BuildResult(
        points=int(counts["points"]),
        cells=len(database.cell_ids),
        routable_points=sum(map(int, counts.values())),
        database=target,
        seconds=time.perf_counter() - began_s,
        notes=(
            *rasters.notes,
            *plan.notes,
            *layer_notes(plan),
            *_cells_notes(database),
            *floor,
            *_few_points_note(counts),
            *cover,
            *world.streets.notes,
        ),
        pictures=_draw(config, rasters, database, world),
    )


def _cells_notes(database: RadioRouteDatabase) -> list[str]:
    """Return notes on cells that are received nowhere, and on those with one identity."""
    notes = []
    received = database.level_parts
    silent = [cell_id for cell_id in database.cell_ids if cell_id not in received]
    if silent:
        notes.append(
            f"{number_of(len(silent), 'cell')} received at no point: {listed(silent, _NAMED)} "
            f"(likely: no data in the raster, or levels below database.floor_dbm = "
            f"{database.floor_dbm:g})"
        )
    found = Findings()
    check_identities(database.plan, "plan", found)
    errors = [one for one in found.found if one.severity == "error"]
    repeated = [one.evidence for one in errors if one.code == "identity-repeated"]
    return [*notes, *(evidence.removesuffix(".") for evidence in repeated)]


def _few_points_note(counts: Mapping[str, int]) -> list[str]:
    """Return a note where less than a tenth of the points of the roads have a level."""
    points, roads = counts["points"], sum(counts.values())
    if points >= _FEW_POINTS * roads:
        return []
    return [
        f"{points} of {roads} points of the roads have a level above the floor (likely: levels "
        "that are too weak, as by another rasters.factor or floor, or rasters of another place): "
        "mapfilter check -c FILE compares levels with the plan's EIRP"
    ]


def _build_roads(config: Config, progress: Progress | None) -> BuildResult:
    """Build a database without cells."""
    began_s = time.perf_counter()
    world, target = World.of(config), config.database_path
    with nothing_left(target.parent):
        ensure_writable_folder(target.parent)
        database = build_roads(
            world.route_tiles,
            target,
            tile_px=config.database.tile_px,
            inputs=[InputFile.of(role, path) for role, path in world.streets.files],
            attribution=world.streets.attribution,
            progress=progress,
        )
    clear_pictures(config.pictures_path, NETWORK_PICTURES)
    points = int(database.manifest["counts"]["points"])
    return BuildResult(
        points=points,
        cells=0,
        routable_points=points,
        database=target,
        seconds=time.perf_counter() - began_s,
        notes=(*map_cover(world), *world.streets.notes),
    )


def run_dry_build(config: Config) -> BuildEstimate:
    """Estimate size, memory and time of a build, writing nothing."""
    if not config.database.cells:
        hint = "a database of roads alone is built in little more time than they are read in"
        raise fail(ConfigError, "database.cells", "true for --dry-run", "false", hint)
    began_s = time.perf_counter()
    rasters, plan, world = raster_world(config, planned_rasters(config))
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


def _measured(config: Config) -> tuple[Readings, RxLevRasters] | None:
    """Return what the survey that made the rasters measured; None where it was not kept.

    Raises
    ------
    StoreError
        The readings, the levels and the deviations are not of one survey.
    """
    if config.surveyed_plan is None or not config.readings_path.exists():
        return None
    if not config.deviation_path.exists():
        return None
    readings_sha256 = tag_of(config.rasters_path, READINGS_TAG)
    if tag_of(config.deviation_path, READINGS_TAG) != readings_sha256:
        expected, hint = f"the survey of {config.rasters_path.name}", "run mapfilter predict again"
        raise fail(StoreError, str(config.deviation_path), expected, "another one", hint)
    readings = read_checked_readings(config.readings_path, readings_sha256)
    return readings, open_rasters(config.deviation_path)


def draw_database(config: Config) -> tuple[Path, ...]:
    """Draw the database that was built by a configuration.

    Pictures of an older one are removed in any case.
    """
    rasters, _, world = raster_world(config, planned_rasters(config))
    return _draw(config, rasters, open_database(config.database_path), world)


def _draw(
    config: Config, rasters: RxLevRasters, database: RadioRouteDatabase, world: World
) -> tuple[Path, ...]:
    """Draw the database; pictures of an older one are removed in any case."""
    folder = config.pictures_path
    if config.output.pictures == "none":
        clear_pictures(folder, NETWORK_PICTURES)
        return ()
    buildings = world.buildings if config.roads.cut_buildings else None
    area, landuse = world.lattice, world.landuse
    with nothing_left(folder):
        return draw_network(
            rasters, database, folder, area=area, landuse=landuse, buildings=buildings
        )


def _inputs(world: World) -> list[InputFile]:
    plan = world.config.surveyed_plan or world.config.cells.plan
    files = (*world.streets.files, *((("plan", plan),) if plan is not None else ()))
    return [InputFile.of(name, path) for name, path in files]
