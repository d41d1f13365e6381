"""Constants of the map filter's model, by which the page answers "why not here?".

The page computes the terms of a radio report by itself, of whose cells' errors nothing is known
before, at a place that somebody points at: the equations of :mod:`mapfilter.models.level_errors`
and :mod:`mapfilter.models.fingerprint` for one report.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mapfilter.models.level_memory import OTHER_DBM, OTHER_SD_DB
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.state import FIRST_SPACING_M

MAP_M = 25.0
"""Distance for which streets count at a place."""


def constants(model: BayesModel) -> dict[str, Any]:
    """Return the constants of a model as the page reads them."""
    evidence, errors, area = model.evidence, model.evidence.levels, model.area
    serving, weights = evidence.serving, model.weights
    return {
        "slow_db": errors.slow_db,
        "fast_db": errors.fast_db,
        "white_db": errors.white_db,
        "device_db": errors.device_db,
        "site_share": errors.site_share,
        "common_share": errors.common_share,
        "roughness": errors.roughness,
        "fault_log_odds": errors.fault_log_odds,
        "absent_db": errors.absent_db,
        "weight": errors.weight,
        "offset_db": evidence.offset_db(FIRST_SPACING_M),
        "other_dbm": OTHER_DBM,
        "other_db2": OTHER_SD_DB**2,
        "other_rough_db2": _mean_rough_db2(area, errors.roughness),
        "serving_weight": evidence.first_m * serving.weight_per_m,
        "serving_with_levels": evidence.serving_with_levels,
        "hysteresis_db": serving.hysteresis_db,
        "sd_db": serving.sd_db,
        "fault_nats": serving.fault_nats,
        "map_sd_m": weights.sd_m,
        "map_weight_per_m": weights.weight_per_m,
        "off_cost_per_m": weights.off_cost_per_m,
        "map_m": MAP_M,
    }


def _mean_rough_db2(area: AreaFrame, share: float) -> float:
    # In an area that is held by tiles most cells are received nearly nowhere.
    if not area.cell_ids or not isinstance(area, AreaMap):
        return 0.0
    rough_db = 0.1 * area.flat_rough_db.reshape(-1, area.bands)[::97, : len(area.cell_ids)]
    return float(share * np.mean(rough_db.astype(np.float64) ** 2))
