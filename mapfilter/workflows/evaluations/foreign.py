"""``mapfilter evaluate global-positioning --world foreign|harsh|sensors``."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np

from mapfilter._io import atomic_dir, ensure_writable_folder
from mapfilter._json_files import write_json
from mapfilter._parallel import Progress
from mapfilter._types import Floats
from mapfilter.config.load import given_keys
from mapfilter.config.sections import Config
from mapfilter.errors import ConfigError, Faults
from mapfilter.evaluation.stanford import IntegrityOptions
from mapfilter.experiments.benchmarks.foreign import (
    GROUND,
    STREETS,
    VARIANTS,
    ForeignWorld,
    RouteRuns,
    database_name,
    write_ground,
)
from mapfilter.experiments.benchmarks.global_positioning import Batch
from mapfilter.experiments.benchmarks.world import ways_gone, without_ways
from mapfilter.experiments.benchmarks.world_cases import CASES_OF, SENSORS, OtherWorld
from mapfilter.experiments.sweep.world import SweepWorld, write_world
from mapfilter.propagation.models import PredictionModel
from mapfilter.propagation.predict import predict
from mapfilter.propagation.shadowing import named_rng
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.roads.network import street_network
from mapfilter.roads.route_points import inside_areas
from mapfilter.simulation.level_samplers import array_sampler
from mapfilter.simulation.worlds.faults import GivenInputs, given_inputs
from mapfilter.simulation.worlds.open_ground import OpenGround
from mapfilter.simulation.worlds.radio import planners_offsets_db
from mapfilter.simulation.worlds.sensor_faults import NO_FAULT
from mapfilter.simulation.worlds.street_lines import StreetLines
from mapfilter.tracks.store import write_log
from mapfilter.workflows.evaluate import (
    EvaluateResult,
    build_as_set,
    check_names,
    ground,
    written,
)
from mapfilter.workflows.evaluations.runs import run_cases
from mapfilter.workflows.evaluations.settings import load_benchmark
from mapfilter.workflows.inputs.filter_choice import filter_choice
from mapfilter.workflows.inputs.world import World

_DEFINED = "is part of the world, which has one definition"
_REFUSED: Mapping[str, str] = {
    "journeys": _DEFINED,
    "imu": _DEFINED,
    "prediction.ground_truth": _DEFINED,
}
_LENGTH = "journeys.length_m"
_DRIVE_TEST = 4000


def other_world(name: str | None) -> OtherWorld | None:
    """Return the world of a name, where it is one of these."""
    return next((world for world in get_args(OtherWorld) if world == name), None)


def load_foreign(
    file: Path | None, settings: Sequence[str], *, out: Path | None = None
) -> tuple[Config, frozenset[str]]:
    """Load the configuration of a foreign world: prediction and filter are the plain world's.

    Parameters
    ----------
    file, settings, out
        As for :func:`mapfilter.config.load.load_config`.

    Returns
    -------
    config : Config
    fixed : frozenset of str
        What the cases must not change, as it was set.

    Raises
    ------
    ConfigError
        A setting is wrong or has no meaning here.
    """
    config, fixed = load_benchmark("plain", file, settings, out=out)
    faults = Faults()
    for key in given_keys(file, settings):
        for name, why in _REFUSED.items():
            if key != _LENGTH and (key == name or key.startswith(f"{name}.")):
                faults.add(f"setting {key}", "none, as the world does not take it", "one", why)
    if config.roads.profile != "walking":
        faults.add("setting roads.profile", "walking", config.roads.profile)
    faults.raise_if_any(ConfigError)
    return config, fixed


def run_foreign(
    config: Config,
    world: OtherWorld,
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
) -> EvaluateResult:
    """Predict, build, and run the cases of a foreign world on a map.

    Parameters
    ----------
    config, fixed
        From :func:`load_foreign`.
    world : {"foreign", "harsh", "sensors"}
    out, runs, seed, workers, resume, progress, one_case
        As for :func:`mapfilter.workflows.evaluate.run_global_positioning`.
    cases : sequence of str
        Of the world; all if there is none.

    Raises
    ------
    MapfilterError
        The map, the box or a case is wrong, or the output cannot be written.
    """
    began_s = time.perf_counter()
    wanted = check_names(cases, CASES_OF[world]) or tuple(CASES_OF[world])
    choice = filter_choice(config.filter)
    ensure_writable_folder(out)
    area = World.of(config)
    made, points = prepare(area, world, out / "world", seed, wanted, runs)
    if "length_m" in fixed:
        made = replace(made, length_m=config.journeys.length_m)
    integrity = config.integrity.of(IntegrityOptions)
    found = run_cases(
        Batch(made, choice, wanted, 0, runs, fixed, integrity, one_case),
        out,
        workers=workers,
        resume=resume,
        progress=progress,
        base=ground(area, made.streets),
        pooled=frozenset(SENSORS) - {NO_FAULT},
    )
    return written(config, seed, points, found, began_s, out)


def prepare(
    world: World, name: OtherWorld, folder: Path, seed: int, cases: Sequence[str], runs: int
) -> tuple[ForeignWorld, int]:
    """Write the city, and the databases that are given of it under the faults of some cases.

    Returns
    -------
    world : ForeignWorld
    points : int
        Of the database without faults.
    """
    folder.mkdir(parents=True, exist_ok=True)
    network = street_network(world.ways, world.routes)
    streets = SweepWorld(network, world.plan, world.lattice, {}, world.heights_m)
    write_world(streets, folder / STREETS)
    write_ground(open_ground(world), folder / GROUND)
    faults = dict.fromkeys(CASES_OF[name][case].fault for case in cases)
    plain = given_inputs(None, world.plan, world.lattice, seed)
    databases = [database_name(None, 0)]
    points = _database(world, plain, folder / databases[0], seed, 0)
    for fault in faults:
        for variant in range(min(VARIANTS, runs) if fault is not None else 0):
            given = given_inputs(fault, world.plan, world.lattice, seed, variant)
            _database(world, given, folder / database_name(fault, variant), seed, variant)
        if fault is not None:
            # Of few runs some variants are not built; the first one tells what all are made of.
            databases.append(database_name(fault, 0))
    offsets_db = _drive_test(world, StreetLines(network), seed)
    made = ForeignWorld(name, folder, seed, offsets_db=offsets_db, databases=tuple(databases))
    return made, points


def write_journeys(world: ForeignWorld, case: str, count: int, folder: Path) -> GivenInputs:
    """Write the logs of a case, with their truth; all have the first variant of its fault.

    The database that belongs to them is ``world.folder / database_name(fault, 0)``.

    Parameters
    ----------
    world : ForeignWorld
        From :func:`prepare`, with the databases of this case.
    count : int
        Journeys, each with a walk and a radio of its own.
    folder : Path
        Gets a folder for each log.

    Returns
    -------
    GivenInputs
        What is wrong with the database, to compare findings with; the ways that it lacks stand in
        :func:`missing_ways_file`.

    Raises
    ------
    OutputError
        The folder cannot be written.
    """
    with atomic_dir(folder) as into:
        for number in range(count):
            # Routes of the first variant only.
            _, log = RouteRuns(world, number * VARIANTS).run(CASES_OF[world.name][case])
            write_log(log, into / f"journey-{number:04d}")
    return world.given(CASES_OF[world.name][case], 0)


def missing_ways_file(database: Path) -> Path:
    """Return the file beside a database with the ids of the ways that it lacks, ``missing``.

    The database without faults has the points of these ways.
    """
    return database.with_name(f"{database.name}-ways.json")


def open_ground(world: World) -> OpenGround:
    """Return where neither a building nor water is; bridges are open."""
    built = np.asarray(world.heights_m > 0)
    wet = np.zeros(built.shape, dtype=bool)
    source = world.streets.source if world.landuse is None else None
    if source is not None and source.water is not None and source.bridges is not None:
        wet = inside_areas(source.water, world.lattice)
        wet &= source.bridges.reaching(world.lattice)[0] < 0
    return OpenGround(world.lattice, ~built & ~wet, built)


def _database(world: World, given: GivenInputs, folder: Path, seed: int, variant: int) -> int:
    """Build the database that is given, and return how many points it has."""
    config, lattice = world.config, world.lattice
    model = config.prediction.of(PredictionModel)
    levels = predict(given.plan, lattice, world.heights_m, model, antennas=world.antennas)
    rasters_path = folder.with_name(f"{folder.name}.tif")
    shifted = ((name, given.predicted(name, level, lattice)) for name, level in levels)
    write_rasters(rasters_path, lattice, shifted, given.plan.ids)
    routes = world.routes
    if given.missing_ways > 0:
        half_m, share = config.roads.half_width_m, given.missing_ways
        gone = ways_gone(world.ways, share, named_rng(seed, "missing ways", str(variant)))
        routes = without_ways(
            routes, world.ways, share, half_m, named_rng(seed, "missing ways", str(variant))
        )
        write_json(missing_ways_file(folder), {"missing": gone.tolist()})
    return build_as_set(config, rasters_path, given.plan, routes, folder)


def _drive_test(world: World, streets: StreetLines, seed: int) -> tuple[float, float]:
    """Return by how much the prediction exceeds the world's levels on the streets."""
    east, north = world.routes.east_north_m
    rng = named_rng(seed, "drive test")
    chosen = rng.choice(east.size, min(_DRIVE_TEST, east.size), replace=False)
    model = world.config.prediction.of(PredictionModel)
    cells = predict(world.plan, world.lattice, world.heights_m, model, antennas=world.antennas)
    levels = array_sampler(np.stack([level for _, level in cells]), world.lattice)
    places = east[chosen], north[chosen]
    predicted: Floats = np.asarray(levels(*places), dtype=np.float64)
    return planners_offsets_db(
        world.plan, world.lattice, world.heights_m, streets, predicted, *places
    )
