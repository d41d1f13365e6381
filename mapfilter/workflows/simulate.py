"""``mapfilter simulate``: journeys with truth, along the streets of the area."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mapfilter._io import atomic_dir
from mapfilter._parallel import Progress
from mapfilter._words import number_of
from mapfilter.config.sections import Config
from mapfilter.errors import OutputError, fail, listed
from mapfilter.radio.layers import SHARED_CARRIER
from mapfilter.rasters.raster_set import check_against_plan
from mapfilter.roads.network import street_network
from mapfilter.simulation.journeys import JourneyPlan
from mapfilter.simulation.level_samplers import level_sampler
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.simulate import SimulationSettings, simulate_journeys
from mapfilter.simulation.walking import WalkerModel, inside_buildings
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.log_folders import is_log
from mapfilter.tracks.store import check_log_replaceable, write_log
from mapfilter.workflows.inputs.world import planned_rasters, raster_cover, raster_world
from mapfilter.workflows.predict import open_ground_truth


@dataclass(frozen=True)
class SimulateResult:
    """Number, length and folder of simulated journeys."""

    logs: int
    """Journeys times draws."""
    track_m: float
    """True length of each journey."""
    path: Path
    """Folder that holds one log folder for each."""
    notes: tuple[str, ...] = ()
    """Which journeys receive nothing, and how rasters were read."""
    partial: bool = False
    """Whether none of the journeys receives anything."""


def run_simulate(config: Config, progress: Progress | None = None) -> SimulateResult:
    """Simulate journeys and write their logs; a folder of older logs is replaced as a whole."""
    settings = simulation_settings(config)
    as_predicted = settings.reports.radio == "as_predicted"
    rasters = planned_rasters(config) if as_predicted else open_ground_truth(config)
    rasters, plan, world = raster_world(config, rasters)
    check_against_plan(rasters, plan)
    _check_replaceable(config.track_path)
    network = street_network(world.ways, world.routes)
    levels = level_sampler(rasters, plan.ids, world.lattice.bounds_m, plan=plan)
    total, silent = settings.journeys * settings.draws, []
    with atomic_dir(config.track_path) as folder:
        track_m = 0.0
        centred = settings.journey.walker.beside == "centre"
        inside = None if centred else inside_buildings(world.heights_m, world.lattice)
        seed = config.journeys.seed
        journeys = simulate_journeys(network, levels, plan, settings, seed, inside)
        for done, (name, log) in enumerate(journeys, start=1):
            write_log(log, folder / name)
            track_m = log.truth_length_m
            if log.radio.empty:
                silent.append(name)
            if progress is not None:
                progress(done, total)
    notes = [*rasters.notes, *raster_cover(config.area, world.lattice)]
    nameless = sum(
        cell.arfcn is None and (cell.bsic is None or cell.technology not in SHARED_CARRIER)
        for cell in plan.cells
    )
    if nameless and settings.reports.max_neighbours:
        cells = number_of(nameless, "cell has", "cells have")
        notes.append(
            f"{cells} no carrier and code (arfcn, bsic) in the plan: as neighbours they are "
            "reported without a name, and filters cannot use them"
        )
    if silent:
        notes.append(f"no cell is received in {len(silent)} of {total} journeys ({listed(silent)})")
    return SimulateResult(total, track_m, config.track_path, tuple(notes), len(silent) == total)


def _check_replaceable(folder: Path) -> None:
    """Check that a folder to be replaced holds nothing but logs that mapfilter wrote."""
    for inner in sorted(folder.iterdir()) if folder.is_dir() else ():
        if not is_log(inner):
            expected = "a folder of logs, or nothing yet"
            hint = "a mistyped path; simulated logs need a folder of their own"
            raise fail(OutputError, str(folder), expected, f"other files ({inner.name})", hint)
        check_log_replaceable(inner)


def simulation_settings(config: Config) -> SimulationSettings:
    """Return the settings of journeys, inertial unit and reports of a configuration."""
    section = config.journeys
    return SimulationSettings(
        journeys=section.count,
        draws=section.draws,
        journey=JourneyPlan(
            length_m=section.length_m,
            profile=config.roads.profile,
            speed_mps=section.speed_mps,
            walker=section.of(WalkerModel),
        ),
        imu=config.imu.of(ImuNoise),
        reports=section.of(ReportModel),
    )
