"""``mapfilter evaluate``: accuracy benchmarks, on any map and on published data."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mapfilter._io import ensure_writable_folder, write_json
from mapfilter._parallel import Progress, local_executor
from mapfilter.config.sections import Config
from mapfilter.database.build import build
from mapfilter.database.sources import LatticeRoutes
from mapfilter.errors import ConfigError, Faults, fail
from mapfilter.experiments.benchmarks.cases import CASES, USUAL
from mapfilter.experiments.benchmarks.global_positioning import benchmark
from mapfilter.experiments.benchmarks.scores import CaseResult
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
from mapfilter.propagation.predict import predict
from mapfilter.propagation.shadowing import named_rng
from mapfilter.rasters.geotiff import write_rasters
from mapfilter.rasters.raster_set import open_rasters
from mapfilter.roads.network import street_network
from mapfilter.simulation.reflections import NlosModel
from mapfilter.simulation.satellites import ReceptionModel
from mapfilter.workflows.filters import filter_choice
from mapfilter.workflows.jsonable import to_jsonable
from mapfilter.workflows.predict import ground_truth_errors, prediction_model
from mapfilter.workflows.simulate import simulation_settings
from mapfilter.workflows.world import World

NAMES = ("global-positioning", "audit", "ottawa")
RUNS = 20
TABLE = "table.json"
_MISSING = 0.1


@dataclass(frozen=True)
class EvaluateResult:
    """What a benchmark found.

    Parameters
    ----------
    map : str
        Name of the map's file.
    seed : int
    points : int
        Of the database.
    cases : tuple of CaseResult
    seconds : float
        Wall time.
    out : Path
    """

    map: str
    seed: int
    points: int
    cases: tuple[CaseResult, ...]
    seconds: float
    out: Path


def check_benchmark(name: str, data: Path | None = None) -> None:
    """See that there is such a benchmark, and data where it needs them.

    Raises
    ------
    ConfigError
        There is not.
    """
    if name not in NAMES:
        raise fail(ConfigError, "evaluate", ", ".join(NAMES), name)
    if name == "ottawa" and data is None:
        raise fail(ConfigError, "--data", "the folder of the data sets", "none")


def check_cases(names: Sequence[str]) -> tuple[str, ...]:
    """Return the cases that are asked for, or all but those with satellites.

    Raises
    ------
    ConfigError
        There is no such case.
    """
    faults = Faults()
    for name in names:
        if name not in CASES:
            faults.add("--case", ", ".join(CASES), repr(name))
    faults.raise_if_any(ConfigError)
    return tuple(dict.fromkeys(names)) or USUAL


def _check_lengths(names: Sequence[str], fixed: frozenset[str]) -> None:
    """See that no length was set for cases that have their own."""
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
) -> EvaluateResult:
    """Predict, build, and run the cases of the benchmark on a map.

    Parameters
    ----------
    config, fixed
        From :func:`mapfilter.workflows.evaluate_settings.load_benchmark`.
    out : Path
        Gets the world, the finished batches and ``table.json``.
    runs : int
        Routes for each case.
    seed : int
        Of routes, reality and noise.
    cases : sequence of str
        All without satellites if there is none.
    workers : int
        Local processes.
    resume : bool
        Keep what the same benchmark has finished.
    progress : callable, optional
        Called with batches done and batches in all.

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
    world, points = _world(World.of(config), out / "world", seed)
    with local_executor(workers) as executor:
        found = benchmark(
            world,
            choice,
            wanted,
            runs,
            seed,
            out,
            executor=executor,
            in_flight=2 * workers,
            resume=resume,
            progress=progress,
            fixed=fixed,
        )
    result = EvaluateResult(
        Path(config.area.map).name, seed, points, tuple(found), time.perf_counter() - began_s, out
    )
    write_json(out / TABLE, to_jsonable(result))
    return result


def _world(world: World, folder: Path, seed: int) -> tuple[BenchmarkWorld, int]:
    """Predict the cells, and build a database of all ways and one that lacks every tenth."""
    folder.mkdir(parents=True, exist_ok=True)
    config = world.config
    model, antennas = prediction_model(config.prediction), world.antennas
    rasters_path = folder / "rxlev.tif"
    levels = predict(world.plan, world.lattice, world.heights_m, model, antennas=antennas)
    write_rasters(rasters_path, world.lattice, levels, world.plan.ids)
    rasters = open_rasters(rasters_path)
    rng = named_rng(seed, "missing ways")
    thinned = without_ways(world.routes, world.ways, _MISSING, config.roads.half_width_m, rng)
    count = 0
    for name, routes in ((FULL, world.routes), (THINNED, thinned)):
        database = build(
            rasters,
            world.plan,
            LatticeRoutes(routes),
            folder / name,
            margin_db=config.database.margin_db,
            floor_dbm=config.database.floor_dbm,
            tile_px=config.database.tile_px,
        )
        count = count or int(database.manifest["counts"]["points"])
    write_buildings(world.buildings, folder / BUILDINGS)
    network = street_network(world.ways, world.routes)
    streets = SweepWorld(network, world.plan, world.lattice, {}, world.heights_m)
    write_world(streets, folder / STREETS)
    errors, settings = ground_truth_errors(config.prediction), simulation_settings(config)
    settings = replace(settings, reports=replace(settings.reports, radio="reality"))
    reception = ReceptionModel(nlos=NlosModel() if config.journeys.nlos_satellites else None)
    return BenchmarkWorld(folder, model, errors, settings, antennas, reception), count
