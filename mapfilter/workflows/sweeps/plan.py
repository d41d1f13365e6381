"""Plans and world of a sweep from a configuration; all faults are reported together."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._types import Floats32
from mapfilter.config.axes import vary
from mapfilter.config.sections import Config, FilterSection
from mapfilter.config.sweep import ReadingSection
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, Faults, InputError, MapfilterError, fail
from mapfilter.experiments.sweep.noises import GYRO_ERRORS, NO_TURNS, NOISE_AXES, noise_grid
from mapfilter.experiments.sweep.plan import AS_PREDICTED, Radio, Reading, SweepPlan
from mapfilter.experiments.sweep.world import SweepWorld, all_levels_dbm
from mapfilter.filters.candidate import CandidateOptions
from mapfilter.lattice import Lattice
from mapfilter.propagation.models import GroundTruthErrors
from mapfilter.propagation.shadowing import site_shadowing
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import check_against_plan
from mapfilter.roads.buildings import rasterise_heights
from mapfilter.roads.network import street_network
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.walking import WalkerModel
from mapfilter.workflows.inputs.filter_choice import filter_choice
from mapfilter.workflows.inputs.world import planned_rasters, raster_world
from mapfilter.workflows.predict import open_ground_truth
from mapfilter.workflows.simulate import simulation_settings

GROUND_TRUTH = "ground truth"


def sweep_databases(config: Config) -> dict[str, Path]:
    """Return the databases of a sweep by name: that of the folder, or the path where two agree."""
    paths = [Path(path) for path in config.sweep.databases] or [config.database_path]
    names = [path.name for path in paths]
    return {str(path) if names.count(path.name) > 1 else path.name: path for path in paths}


def sweep_plans(
    config: Config, axes: Mapping[str, Sequence[float]] | None = None
) -> tuple[tuple[SweepPlan, ...], dict[str, RadioRouteDatabase]]:
    """Return the plans of a sweep, one for each point of the varied options, and its databases.

    Parameters
    ----------
    axes : mapping of str to sequence of float, optional
        Values of numeric options by dotted key, as :func:`mapfilter.config.axes.parse_axis` returns
        them; without any there is one plan.

    Raises
    ------
    ConfigError, InputError
        With every fault: databases that are missing or damaged, of different resolutions or CRS,
        readings with one name, axes that hold a value twice or change nothing.
    """
    faults = Faults()
    databases: dict[str, RadioRouteDatabase] = {}
    paths = sweep_databases(config)
    if len(paths) < len(config.sweep.databases):
        faults.add("sweep.databases", "every folder once", "one twice")
    for name, path in paths.items():
        try:
            databases[name] = open_database(path, verify="full")
        except MapfilterError as error:
            faults.found.extend(error.faults)
    resolutions_m = {name: database.lattice.resolution_m for name, database in databases.items()}
    if len(set(resolutions_m.values())) > 1:
        faults.add("sweep.databases", "databases of one resolution", resolutions_m)
    broken = bool(faults.found)
    plans: list[SweepPlan] = []
    try:
        for values in itertools.product(*(axes or {}).values()):
            point = dict(zip(axes or {}, values, strict=True))
            plan = _plan(_varied(config, point), tuple(paths))
            plans.append(replace(plan, varied=tuple(point.items())))
        _check_effect(plans, axes or {}, faults)
    except ConfigError as error:
        faults.found.extend(error.faults)
        broken = False
    faults.raise_if_any(InputError if broken else ConfigError)
    return tuple(plans), databases


def _varied(config: Config, point: Mapping[str, float]) -> Config:
    """Return the configuration of a point; the margin of a database is read as the filter's."""
    changes = dict(point)
    if "database.margin_db" in changes:
        changes["filter.margin_db"] = changes["database.margin_db"]
    return vary(config, changes)


def _check_effect(plans: Sequence[SweepPlan], axes: Iterable[str], faults: Faults) -> None:
    """Refuse an option that none of the sweep's simulations and filters uses."""
    for key in axes:
        others = {
            replace(plan.effective, varied=tuple(pair for pair in plan.varied if pair[0] != key))
            for plan in plans
        }
        if len(others) < len(plans):
            expected = "an option that the journeys, the unit or the filters of the sweep use"
            hint = "an option of another filter, or one that [sweep] sets"
            if key.partition(".")[2] in GYRO_ERRORS:
                hint = NO_TURNS
            faults.add(f"--vary {key}", expected, "one without effect", hint)


def _plan(config: Config, databases: tuple[str, ...]) -> SweepPlan:
    section, settings = config.sweep, simulation_settings(config)
    readings, reports = _readings(config), settings.reports
    # No candidate filter uses neighbours, and the serving cell does not depend on them.
    if all(one.choice.name == "candidate" for one in readings):
        reports = replace(reports, max_neighbours=0)
    noise = {
        name: _axis(getattr(section, name), getattr(settings.imu, name)) for name in NOISE_AXES
    }
    return SweepPlan(
        readings=readings,
        databases=databases,
        noises=noise_grid(**noise, others=settings.imu),
        radios=_radios(config),
        report_periods_s=_axis(section.report_period_s, reports.report_period_s),
        imu_periods_s=_axis(section.imu_period_s, settings.imu.period_s),
        routes=section.routes,
        draws=section.draws,
        journey=settings.journey,
        reports=reports,
        seed=section.seed,
    )


def _axis(values: Sequence[float] | None, otherwise: float) -> tuple[float, ...]:
    return tuple(map(float, values)) if values is not None else (float(otherwise),)


def _radios(config: Config) -> tuple[Radio, ...]:
    errors_db = config.sweep.prediction_error_db
    if errors_db is not None:
        return tuple(
            Radio(f"{GROUND_TRUTH} {error_db:g} dB", float(error_db)) for error_db in errors_db
        )
    if config.journeys.of(ReportModel).radio == AS_PREDICTED:
        return (Radio(),)
    return (Radio(GROUND_TRUTH, math.nan),)


def _readings(config: Config) -> tuple[Reading, ...]:
    named = config.sweep.readings or (ReadingSection(name=config.filter.name),)
    readings = []
    for one in named:
        given: dict[str, Any] = one.model_dump(exclude_none=True, exclude={"name", "filter"})
        if one.filter is not None:
            given["name"] = one.filter
        section = FilterSection(**{**config.filter.model_dump(), **given})
        if section.name != "candidate":
            readings.append(Reading(one.name, filter_choice(section)))
            continue
        lengths_m = config.sweep.update_length_m
        if lengths_m is None or one.update_length_m is not None:
            options = section.of(CandidateOptions)
            lengths_m = (options.update_length_m,)
        for length_m in map(float, lengths_m):
            chosen = section.model_copy(update={"update_length_m": length_m})
            readings.append(Reading(one.name, filter_choice(chosen), length_m))
    return tuple(readings)


def sweep_world(config: Config, radios: Sequence[Radio]) -> SweepWorld:
    """Read streets, cells and levels, as ``simulate`` takes them.

    A prediction error adds a correlated field of that deviation, with the correlation,
    the share of sites and the seed of ``[prediction.ground_truth]``, to the predicted levels.

    Raises
    ------
    MapfilterError
        The area, map, plan or rasters are wrong, or the ground truth is not predicted yet.
    """
    names = {radio.name for radio in radios}
    opened = {
        real: open_ground_truth(config) if real else planned_rasters(config)
        for real in sorted({name == GROUND_TRUTH for name in names})
    }
    lattices = [rasters.lattice for rasters in opened.values()]
    if len(set(lattices)) > 1:
        expected = "ground truth rasters on the lattice of the predicted ones"
        raise fail(InputError, str(config.ground_truth_path), expected, "another")
    for real in opened:
        opened[real], plan, world = raster_world(config, opened[real])
        check_against_plan(opened[real], plan)
    lattice = world.lattice
    levels_dbm = {real: all_levels_dbm(rasters, plan) for real, rasters in opened.items()}
    received = {
        radio.name: _predicted(config, radio, levels_dbm[radio.name == GROUND_TRUTH], lattice, plan)
        for radio in radios
    }
    on_pavement = config.journeys.of(WalkerModel).beside != "centre"
    heights_m = rasterise_heights(world.buildings, lattice) if on_pavement else None
    network = street_network(world.ways, world.routes)
    return SweepWorld(network, plan, lattice, received, heights_m)


def _predicted(
    config: Config,
    radio: Radio,
    predicted_dbm: Floats32,
    lattice: Lattice,
    plan: CellPlan,
) -> Floats32:
    if radio.name in (AS_PREDICTED, GROUND_TRUTH):
        return predicted_dbm
    truth = config.prediction.ground_truth.of(GroundTruthErrors)
    fields = site_shadowing(
        plan,
        lattice,
        radio.prediction_error_db,
        truth.correlation_m,
        truth.site_share,
        truth.seed,
        stream="reality",
    )
    wrong_db = np.stack([field_db for _, field_db in fields])
    return np.asarray(predicted_dbm + wrong_db, dtype=np.float32)
