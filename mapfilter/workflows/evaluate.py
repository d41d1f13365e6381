"""``mapfilter evaluate``: accuracy benchmarks, on any map and on published data."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any

from mapfilter._io import ensure_writable_folder
from mapfilter._json_files import write_json
from mapfilter._parallel import Progress
from mapfilter.config.sections import Config
from mapfilter.database.build import build
from mapfilter.errors import ConfigError, Faults, fail
from mapfilter.evaluation.stanford import IntegrityOptions
from mapfilter.experiments.benchmarks.cases import CASES, USUAL
from mapfilter.experiments.benchmarks.global_positioning import Batch
from mapfilter.experiments.benchmarks.plain_runs import PlainCity
from mapfilter.experiments.benchmarks.results import CaseResult
from mapfilter.experiments.benchmarks.world import (
    BUILDINGS,
    FULL,
    STREETS,
    THINNED,
    BenchmarkWorld,
    without_ways,
    write_buildings,
)
from mapfilter.experiments.sweep.world import SweepWorld, write_world
from mapfilter.propagation.models import GroundTruthErrors, PredictionModel
from mapfilter.propagation.predict import predict
from mapfilter.propagation.shadowing import named_rng
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.report.basemap import BaseMap
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.network import street_network
from mapfilter.simulation.reflections import NlosModel
from mapfilter.simulation.satellites import ReceptionModel
from mapfilter.workflows.evaluations.recorded import ALL
from mapfilter.workflows.evaluations.recorded import NAMES as RECORDED
from mapfilter.workflows.evaluations.runs import run_cases, street_base
from mapfilter.workflows.inputs.filter_choice import filter_choice
from mapfilter.workflows.inputs.world import World
from mapfilter.workflows.outputs.result_text import to_jsonable
from mapfilter.workflows.simulate import simulation_settings

OF_DATA = (ALL, *RECORDED, "single-reports")
"""Benchmarks on published data."""
NAMES = ("global-positioning", "audit", *OF_DATA)
RUNS = 20
TABLE = "table.json"
_MISSING = 0.1
_MAIN = (
    "runs",
    "success",
    "wrong",
    "switch_mean_m",
    "error_mean_m",
    "error_95_m",
    "coverage_95",
    "off_50m",
    "hazardous",
    "exceeded",
    "false_lost_per_km",
    "seconds_per_track",
)
_OF_FAULTS = (
    "runs",
    "wrong",
    "wrong_converged",
    "error_mean_m",
    "coverage_95",
    "claimed",
    "off_50m",
    "fault_wrong",
    "fault_unnoticed",
    "fault_noticed_s",
    "fault_noticed_max_s",
)


@dataclass(frozen=True)
class EvaluateResult:
    """Results of a benchmark: the map's file, points of the database, all cases, wall time."""

    map: str
    seed: int
    points: int
    cases: tuple[CaseResult, ...]
    seconds: float
    out: Path


def main_figures(case: CaseResult, names: Sequence[str] = _MAIN) -> dict[str, Any]:
    """Return the figures of a case that the table on the terminal shows."""
    return {"case": case.name, **{name: getattr(case, name) for name in names}}


def main_table(result: EvaluateResult) -> dict[str, Any]:
    """Return a result with the main figures of each case only."""
    faulty = any(isfinite(case.fault_wrong) for case in result.cases)
    names = _OF_FAULTS if faulty else _MAIN
    return {**vars(result), "cases": [main_figures(case, names) for case in result.cases]}


def check_benchmark(name: str, data: Path | None = None) -> None:
    """Check that there is such a benchmark, and data where it needs them; ConfigError if not."""
    if name not in NAMES:
        raise fail(ConfigError, "evaluate", ", ".join(NAMES), name)
    if name in OF_DATA and data is None:
        raise fail(ConfigError, "--data", "the folder of the data sets", "none")


def check_names(names: Sequence[str], known: Collection[str]) -> tuple[str, ...]:
    """Return the cases that are asked for, each once; ConfigError with all that are not known."""
    faults = Faults()
    for name in names:
        if name not in known:
            faults.add("--case", ", ".join(known), repr(name))
    faults.raise_if_any(ConfigError)
    return tuple(dict.fromkeys(names))


def check_cases(names: Sequence[str]) -> tuple[str, ...]:
    """Return the cases that are asked for, or all but those with satellites."""
    return check_names(names, CASES) or USUAL


def _check_lengths(names: Sequence[str], fixed: frozenset[str]) -> None:
    """Check that no length was set for cases that have their own."""
    own = [name for name in names if CASES[name].recovery_within_m > 0]
    if own and "length_m" in fixed:
        expected = f"none, as {' and '.join(own)} walk 800 m and 1 km"
        hint = "name the other cases with --case"
        raise fail(ConfigError, "setting journeys.length_m", expected, "one", hint)


def run_global_positioning(
    config: Config,
    out: Path,
    *,
    runs: int,
    seed: int,
    cases: Sequence[str] = (),
    workers: int = 2,
    resume: bool = False,
    progress: Progress | None = None,
    fixed: frozenset[str] = frozenset(),
    one_case: bool = False,
    pictures: bool = True,
) -> EvaluateResult:
    """Predict, build, and run the cases of the benchmark on a map.

    Parameters
    ----------
    config, fixed
        From :func:`mapfilter.workflows.evaluations.settings.load_benchmark`.
    out : Path
        Gets the world, the finished batches, ``table.json`` and ``pictures``.
    runs, seed : int
        Routes for each case; seed of routes, ground truth and noise.
    cases : sequence of str
        All without satellites if there is none.
    workers : int
        Local processes.
    resume : bool
        Keep what the same benchmark has finished.
    progress : callable, optional
        Called with batches done and batches in all.
    one_case : bool
        Each route has one of the cases, drawn, instead of all.
    pictures : bool
        Whether to draw them, unless ``output.pictures`` is "none".

    Raises
    ------
    MapfilterError
        The map, the box or a case is wrong, or the output cannot be written.
    """
    began_s = time.perf_counter()
    wanted = check_cases(cases)
    choice = filter_choice(config.filter)
    _check_lengths(wanted, fixed)
    ensure_writable_folder(out)
    area = World.of(config)
    world, points = _world(area, out / "world", seed)
    city = PlainCity(world, seed)
    integrity = config.integrity.of(IntegrityOptions)
    found = run_cases(
        Batch(city, choice, wanted, 0, runs, fixed, integrity, one_case),
        out,
        workers=workers,
        resume=resume,
        progress=progress,
        base=ground(area, city.streets) if pictures else None,
    )
    return written(config, seed, points, found, began_s, out)


def ground(area: World, streets: SweepWorld) -> BaseMap | None:
    """Return what the pictures of a benchmark are drawn on; None where none are wanted."""
    if area.config.output.pictures == "none":
        return None
    return street_base(streets, area.streets.attribution)


def written(
    config: Config, seed: int, points: int, found: Sequence[CaseResult], began_s: float, out: Path
) -> EvaluateResult:
    """Write the table of a benchmark that began at a time, and return its result."""
    name, seconds = Path(config.area.map).name, time.perf_counter() - began_s
    result = EvaluateResult(name, seed, points, tuple(found), seconds, out)
    write_json(out / TABLE, to_jsonable(result))
    return result


def build_as_set(
    config: Config, rasters: Path, plan: CellPlan, routes: RouteLattice, folder: Path
) -> int:
    """Build a database of rasters by the settings of a configuration; return its points."""
    database = build(
        open_rasters(rasters),
        plan,
        routes,
        folder,
        margin_db=config.database.margin_db,
        floor_dbm=config.database.floor_dbm,
        tile_px=config.database.tile_px,
    )
    return int(database.manifest["counts"]["points"])


def _world(world: World, folder: Path, seed: int) -> tuple[BenchmarkWorld, int]:
    """Predict the cells, and build a database of all ways and one that lacks every tenth."""
    folder.mkdir(parents=True, exist_ok=True)
    config = world.config
    model, antennas = config.prediction.of(PredictionModel), world.antennas
    rasters_path = folder / "rxlev.tif"
    levels = predict(world.plan, world.lattice, world.heights_m, model, antennas=antennas)
    write_rasters(rasters_path, world.lattice, levels, world.plan.ids)
    rng = named_rng(seed, "missing ways")
    thinned = without_ways(world.routes, world.ways, _MISSING, config.roads.half_width_m, rng)
    count = build_as_set(config, rasters_path, world.plan, world.routes, folder / FULL)
    build_as_set(config, rasters_path, world.plan, thinned, folder / THINNED)
    write_buildings(world.buildings, folder / BUILDINGS)
    network = street_network(world.ways, world.routes)
    streets = SweepWorld(network, world.plan, world.lattice, {}, world.heights_m)
    write_world(streets, folder / STREETS)
    errors = config.prediction.ground_truth.of(GroundTruthErrors)
    settings = simulation_settings(config)
    settings = replace(settings, reports=replace(settings.reports, radio="ground_truth"))
    reception = ReceptionModel(nlos=NlosModel() if config.journeys.nlos_satellites else None)
    return BenchmarkWorld(folder, model, errors, settings, antennas, reception), count
