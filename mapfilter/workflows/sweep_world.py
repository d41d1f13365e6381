"""The world of a sweep: the configuration's streets and cells, and the levels that are heard."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mapfilter.errors import InputError, fail
from mapfilter.experiments.sweep.plan import AS_PREDICTED, Radio, SweepPlan
from mapfilter.experiments.sweep.world import SweepWorld
from mapfilter.geodesy import Lattice, same_crs
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.rasters import RxLevRasters, check_against_plan, open_rasters
from mapfilter.radio.shadowing import site_shadowing
from mapfilter.roads.network import street_network
from mapfilter.workflows.cover import check_cells_near
from mapfilter.workflows.reality import check_reality, check_reality_there
from mapfilter.workflows.sections import Config
from mapfilter.workflows.sweep_plan import REALITY
from mapfilter.workflows.world import World, planned_rasters


def sweep_world(config: Config, plan: SweepPlan) -> SweepWorld:
    """Read streets, cells and levels, as ``simulate`` takes them.

    A prediction error of the plan adds a correlated field of that deviation, with the correlation,
    the share of sites and the seed of ``[prediction.reality]``, to the predicted levels.

    Raises
    ------
    MapfilterError
        The area, map, plan or rasters are wrong, or reality is wanted and not predicted yet.
    """
    names = {radio.name for radio in plan.radios}
    if REALITY in names:
        check_reality_there(config)
        check_reality(config)
    world = World.of(config)
    rasters = open_rasters(config.reality_path) if names == {REALITY} else planned_rasters(config)
    check_against_plan(rasters, world.plan)
    check_cells_near(world.plan, world.lattice, str(config.cells.plan or "cells"))
    if not same_crs(rasters.lattice.crs, world.lattice.crs):
        expected = f"{world.lattice.crs}, the CRS of the area"
        where = f"{rasters.path}, CRS"
        raise fail(InputError, where, expected, rasters.lattice.crs, "another zone: set area.crs")
    network = street_network(world.ways, world.routes)
    predicted = _levels(rasters, world.plan)
    levels = {
        radio.name: _heard(config, radio, predicted, rasters.lattice, world.plan)
        for radio in plan.radios
    }
    return SweepWorld(network, world.plan, rasters.lattice, levels)


def _levels(rasters: RxLevRasters, plan: CellPlan) -> NDArray[np.float32]:
    return np.asarray(rasters.read_levels_dbm(plan, None, plan.ids), dtype=np.float32)


def _heard(
    config: Config,
    radio: Radio,
    predicted_dbm: NDArray[np.float32],
    lattice: Lattice,
    plan: CellPlan,
) -> NDArray[np.float32]:
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
