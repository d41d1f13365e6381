"""The Bayes map filter over a database that a survey made: measured levels and serving cells.

The values were chosen on one part of the Ottawa recordings; see :doc:`/explanation/ottawa`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import hypot
from typing import Any

import numpy as np

from mapfilter._types import Floats32, Ints
from mapfilter.database.field import RadioField
from mapfilter.database.measured import MeasuredParts
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.models.fingerprint import ServingWeights
from mapfilter.models.measured_map import MeasuredMapOptions, MeasuredRows, ServingStatistics
from mapfilter.options import NotNegative, Options, Positive
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.maker import Maker
from mapfilter.positioning.bayes.sources.measured_model import MeasuredMapModel
from mapfilter.radio.cells import Cell

SURVEYED: Mapping[str, float] = {
    "level_error_db": 5.0,
    "level_correlation_m": 100.0,
    "device_error_db": 2.0,
    "level_weight": 0.5,
    "switch_mass": 0.95,
    "switch_hold_m": 60.0,
    "claim_mass": 0.95,
}
"""Defaults over surveyed levels, where they differ. Tracks of receivers are as wide as streets with
their houses, so that a belief in one place is wide, too; it is asked for over a longer way."""
SURVEYED_WAYS: Mapping[str, float] = {"map_sd_m": 16.0}
"""Defaults where the ways are tracks of receivers, and no street map."""

_LTE_SITE, _LTE_CELLS = 256, (1 << 16, 1 << 28)
_LEAST_SERVED = 20


@dataclass(frozen=True, slots=True)
class SurveyedEvidence(Options):
    """How serving cells and levels count over a survey.

    Which cell serves is decided once, and levels of another day err together over long stretches.

    Parameters
    ----------
    serving_weight_per_m : float
        Weight of a serving cell for each metre travelled.
    measurement_db : float
        Deviation of a level besides the error of the map.
    unmeasured_db : float
        Deviation of a level where its cell was not measured.
    """

    serving_weight_per_m: NotNegative = 1 / 150
    measurement_db: Positive = 3.0
    unmeasured_db: Positive = 8.0


def over_survey(
    bound: BayesPositioner,
    database: RadioRouteDatabase,
    measured: MeasuredParts,
    options: SurveyedEvidence | None = None,
    serving_map: MeasuredMapOptions | None = None,
) -> BayesPositioner:
    """Return a filter that compares reports with what a survey measured.

    Parameters
    ----------
    bound : BayesPositioner
        The filter over the area of the database.
    measured : MeasuredParts
        Of the database.
    """
    options, area = options or SurveyedEvidence(), bound.model.whole
    sd_db = measured.deviations.spread(area.cell_ids, area.on_way)
    evidence = bound.model.evidence
    levels = replace(evidence.levels, white_db=options.measurement_db)
    if len(measured.deviations):
        usual_db = float(np.median(measured.deviations.deviation_db))
        lasting_db = max(usual_db**2 - levels.white_db**2, 1.0) ** 0.5
        before_db = hypot(levels.slow_db, levels.fast_db)
        slow_db, fast_db = (lasting_db * db / before_db for db in (levels.slow_db, levels.fast_db))
        levels = replace(levels, slow_db=slow_db, fast_db=fast_db)
    weights = ServingWeights(weight_per_m=options.serving_weight_per_m)
    model = MeasuredMapModel(
        area,
        bound.model.motion,
        bound.model.weights,
        evidence=replace(evidence, serving=weights, levels=levels),
        remember=bound.model.remember,
        threads=bound.model.threads,
        serving_model=_statistics(measured, area, database, serving_map),
        level_sd_db=_known(sd_db, options.unmeasured_db),
    )
    return replace(bound, model=model)


def filled_field(field: RadioField, measured: MeasuredParts) -> RadioField:
    """Return a field with a cell's mean level where it was not measured and has no trend.

    Not measured is not the same as not received.
    """
    surveyed = {
        measured.deviations.cell_ids[number] for number in np.unique(measured.deviations.cell)
    }
    level_dbm = field.level_dbm.copy()
    for band, cell_id in enumerate(field.cell_ids):
        own = level_dbm[..., band]
        if cell_id in surveyed and np.isnan(own).any():
            own[np.isnan(own)] = np.nanmean(own[field.on_way])
    return replace(field, level_dbm=level_dbm)


def site_of(cell: Cell) -> str:
    """Return the site of a cell: of LTE by its identity, else as the plan names it."""
    least, most = _LTE_CELLS
    by_identity = cell.technology in (None, "LTE") and cell.ci is not None
    if by_identity and cell.ci is not None and least <= cell.ci < most:
        return f"{cell.mcc}-{cell.mnc}-{cell.ci // _LTE_SITE}"
    return cell.site


def _known(sd_db: Floats32, otherwise_db: float) -> Floats32:
    return np.where(np.isfinite(sd_db), sd_db, np.float32(otherwise_db)).astype(np.float32)


def _statistics(
    measured: MeasuredParts,
    area: AreaMap,
    database: RadioRouteDatabase,
    options: MeasuredMapOptions | None,
) -> ServingStatistics | None:
    """Return how often each cell served where; None where too few reports tell."""
    served = measured.readings.some(measured.readings.serving)
    if len(served) < _LEAST_SERVED:
        return None
    band = np.array([area.band_of.get(cell_id, -1) for cell_id in served.cell_ids], dtype=np.int64)
    rows = MeasuredRows(band[served.cell], served.east_m, served.north_m, served.timing_advance)
    names = [site_of(database.plan[cell_id]) for cell_id in area.cell_ids]
    sites: Ints = np.unique(names, return_inverse=True)[1]
    return ServingStatistics.of_rows(rows, area.lattice, sites, options or MeasuredMapOptions())


def over_measured(
    area: AreaMap,
    usual: Mapping[str, float],
    database: RadioRouteDatabase,
    measured: MeasuredParts,
    options: Any,
) -> BayesPositioner:
    """Return the filter over what a survey measured, which can be made again of other options.

    Parameters
    ----------
    area : AreaMap
        Of the database.
    usual : mapping of str to float
        Options that take the place of those that have their defaults.
    database : RadioRouteDatabase
    measured : MeasuredParts
    options : BayesFilter
    """
    bound = over_survey(options.with_usual(usual).over_area(area), database, measured)
    make = partial(over_measured, area, usual, database, measured)
    return replace(bound, maker=Maker(options, make))
