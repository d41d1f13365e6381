"""Powers of cells from which losses are taken: a default would shift every level."""

from __future__ import annotations

from mapfilter.config.sections import Config
from mapfilter.errors import InputError, fail, listed
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.workflows.inputs.planned_cells import own_layout

_NAMED = 3


def cells_without_eirp(config: Config, rasters: RxLevRasters, plan: CellPlan) -> list[str]:
    """Return the cells whose rasters hold losses and whose EIRP is a default that nobody set.

    A value for ``cells.eirp_dbm`` in the configuration is taken as it is.
    """
    cells = config.cells
    if rasters.quantity != "loss" or cells.plan is None or own_layout(cells):
        return []
    if "eirp_dbm" in cells.model_fields_set:
        return []
    held = set(rasters.cell_ids)
    return [cell.id for cell in plan.cells if cell.id in held and "eirp_dbm" in cell.assumes]


def check_eirp_stated(config: Config, rasters: RxLevRasters, plan: CellPlan) -> None:
    """Raise InputError where a default EIRP would be taken for cells whose rasters hold losses."""
    if without := cells_without_eirp(config, rasters, plan):
        expected = "an EIRP for each cell, as levels are EIRP less the losses of the rasters"
        got = f"none for {len(without)} of {len(plan)} cells ({listed(without, _NAMED)})"
        hint = (
            "a column left out or called otherwise: name it in cells.columns.eirp_dbm, or set "
            "cells.eirp_dbm, which is then taken for all cells without one"
        )
        raise fail(InputError, f"{config.cells.plan}, eirp_dbm", expected, got, hint)
