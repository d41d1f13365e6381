"""The plan of a sweep from a configuration; everything that is wrong with it is told together."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._types import Floats32
from mapfilter.config.sections import Config, FilterSection, ReadingSection
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, Faults, InputError, MapfilterError, fail
from mapfilter.experiments.sweep.plan import (
    AS_PREDICTED,
    Radio,
    Reading,
    SweepPlan,
    noise_grid,
)
from mapfilter.experiments.sweep.world import SweepWorld
from mapfilter.geodesy import Lattice, same_crs
from mapfilter.propagation.shadowing import site_shadowing
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import RxLevRasters, check_against_plan, open_rasters
from mapfilter.roads.buildings import rasterise_heights
from mapfilter.roads.network import street_network
from mapfilter.workflows.cover import check_cells_near
from mapfilter.workflows.filters import filter_choice
from mapfilter.workflows.predict import check_reality, check_reality_there
from mapfilter.workflows.simulate import simulation_settings
from mapfilter.workflows.world import World, planned_rasters

REALITY = "reality"


def sweep_databases(config: Config) -> dict[str, Path]:
    """Return the databases of a sweep by name: that of the folder, or the path where two agree."""
    paths = [Path(path) for path in config.sweep.databases] or [config.database_path]
    names = [path.name for path in paths]
    return {str(path) if names.count(path.name) > 1 else path.name: path for path in paths}


def sweep_plan(config: Config) -> tuple[SweepPlan, dict[str, RadioRouteDatabase]]:
    """Return the plan of a configuration's sweep, and its databases by name, checked.

    Raises
    ------
    ConfigError, InputError
        With every fault: databases that are missing or damaged, of different resolutions or CRS,
        readings with one name, axes that hold a value twice.
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
    _check_resolutions(databases, faults)
    plan = None
    try:
        plan = _plan(config, tuple(paths))
    except ConfigError as error:
        faults.found.extend(error.faults)
    if plan is None or faults.found:
        faults.raise_if_any(ConfigError if plan is None else InputError)
        raise AssertionError
    return plan, databases


def _check_resolutions(databases: Mapping[str, RadioRouteDatabase], faults: Faults) -> None:
    found = {name: database.lattice.resolution_m for name, database in databases.items()}
    if len(set(found.values())) > 1:
        faults.add("sweep.databases", "databases of one resolution", found)


def _plan(config: Config, databases: tuple[str, ...]) -> SweepPlan:
    section, imu, settings = config.sweep, config.imu, simulation_settings(config)
    readings = _readings(config)
    # No candidate filter uses neighbours, and what serves does not depend on them.
    neighbours = 0 if all(one.choice.name == "candidate" for one in readings) else None
    reports = settings.reports
    if neighbours is not None:
        reports = replace(reports, max_neighbours=neighbours)
    return SweepPlan(
        readings=readings,
        databases=databases,
        noises=noise_grid(
            _axis(section.sigma_trans_m, imu.sigma_trans_m),
            _axis(section.sigma_orient_deg, imu.sigma_orient_deg),
            _axis(section.bias_sd_deg, imu.bias_sd_deg),
            _axis(section.drift_deg_per_sqrt_s, imu.drift_deg_per_sqrt_s),
            _axis(section.scale, imu.scale),
        ),
        radios=_radios(config),
        report_periods_s=_axis(section.report_period_s, config.journeys.report_period_s),
        imu_periods_s=_axis(section.imu_period_s, imu.period_s),
        routes=section.routes,
        draws=section.draws,
        length_m=settings.journey.length_m,
        profile=settings.journey.profile,
        speed_mps=settings.journey.speed_mps,
        reports=reports,
        imu=settings.imu,
        walker=settings.journey.walker,
        seed=section.seed,
    )


def _axis(values: Sequence[float] | None, otherwise: float) -> tuple[float, ...]:
    return tuple(map(float, values)) if values is not None else (float(otherwise),)


def _radios(config: Config) -> tuple[Radio, ...]:
    errors_db = config.sweep.prediction_error_db
    if errors_db is not None:
        return tuple(Radio(f"{REALITY} {error_db:g} dB", float(error_db)) for error_db in errors_db)
    if config.journeys.radio == AS_PREDICTED:
        return (Radio(),)
    return (Radio(REALITY, math.nan),)


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
            lengths_m = (section.update_length_m,)
        for length_m in map(float, lengths_m):
            chosen = section.model_copy(update={"update_length_m": length_m})
            readings.append(Reading(one.name, filter_choice(chosen), length_m))
    return tuple(readings)


def sweep_world(config: Config, radios: Sequence[Radio]) -> SweepWorld:
    """Read streets, cells and levels, as ``simulate`` takes them.

    A prediction error adds a correlated field of that deviation, with the correlation,
    the share of sites and the seed of ``[prediction.reality]``, to the predicted levels.

    Raises
    ------
    MapfilterError
        The area, map, plan or rasters are wrong, or reality is wanted and not predicted yet.
    """
    names = {radio.name for radio in radios}
    if REALITY in names:
        check_reality_there(config)
        check_reality(config)
    world = World.of(config)
    opened = {
        real: open_rasters(config.reality_path) if real else planned_rasters(config)
        for real in sorted({name == REALITY for name in names})
    }
    for rasters in opened.values():
        check_against_plan(rasters, world.plan)
        if not same_crs(rasters.lattice.crs, world.lattice.crs):
            expected = f"{world.lattice.crs}, the CRS of the area"
            where, found = f"{rasters.path}, CRS", rasters.lattice.crs
            raise fail(InputError, where, expected, found, "another zone: set area.crs")
    lattices = [rasters.lattice for rasters in opened.values()]
    if len(set(lattices)) > 1:
        expected = "rasters that play reality on the lattice of the predicted ones"
        raise fail(InputError, str(config.reality_path), expected, "another")
    check_cells_near(world.plan, world.lattice, str(config.cells.plan or "cells"))
    levels_dbm = {real: _levels(rasters, world.plan) for real, rasters in opened.items()}
    heard = {
        radio.name: _heard(
            config, radio, levels_dbm[radio.name == REALITY], lattices[0], world.plan
        )
        for radio in radios
    }
    on_pavement = config.journeys.beside != "centre"
    heights_m = rasterise_heights(world.buildings, lattices[0]) if on_pavement else None
    network = street_network(world.ways, world.routes)
    return SweepWorld(network, world.plan, lattices[0], heard, heights_m)


def _levels(rasters: RxLevRasters, plan: CellPlan) -> Floats32:
    return np.asarray(rasters.read_levels_dbm(plan, None, plan.ids), dtype=np.float32)


def _heard(
    config: Config,
    radio: Radio,
    predicted_dbm: Floats32,
    lattice: Lattice,
    plan: CellPlan,
) -> Floats32:
    if radio.name in (AS_PREDICTED, REALITY):
        return predicted_dbm
    reality = config.prediction.reality
    fields = site_shadowing(
        plan,
        lattice,
        radio.prediction_error_db,
        reality.correlation_m,
        reality.site_share,
        reality.seed,
        stream="reality",
    )
    wrong_db = np.stack([field_db for _, field_db in fields])
    return np.asarray(predicted_dbm + wrong_db, dtype=np.float32)
