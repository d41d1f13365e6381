"""The world of a sweep: the configuration's streets and cells, and the levels that are heard."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mapfilter._types import Floats32
from mapfilter.errors import InputError, fail
from mapfilter.experiments.sweep.plan import AS_PREDICTED, Radio
from mapfilter.experiments.sweep.world import SweepWorld
from mapfilter.geodesy import Lattice, same_crs
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.rasters import RxLevRasters, check_against_plan, open_rasters
from mapfilter.radio.shadowing import site_shadowing
from mapfilter.roads.buildings import rasterise_heights
from mapfilter.roads.network import street_network
from mapfilter.workflows.cover import check_cells_near
from mapfilter.workflows.reality import check_reality, check_reality_there
from mapfilter.workflows.sections import Config
from mapfilter.workflows.sweep_plan import REALITY
from mapfilter.workflows.world import World, planned_rasters


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
