"""What a survey's readings say against its plan and its prediction, before it is fitted to them.

A calibration takes any offset and any pattern away: a mistake of the measurements or of the plan
would not be seen in its result.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mapfilter._words import number_of
from mapfilter.errors import listed
from mapfilter.radio.cells import CellPlan
from mapfilter.survey.exchanged_sectors import Exchange, exchanged_sectors
from mapfilter.survey.level_trend import OFFSET_DEVIATION_DB, Covariate
from mapfilter.survey.measured_map import Survey
from mapfilter.survey.measured_points import Points

LARGEST_OFFSET_DB = OFFSET_DEVIATION_DB
"""More than a calibration expects of one cell: a car or a body takes 5 to 10 dB, a model that was
never tuned errs by as much, and readings of serving cells alone are some 5 dB too strong."""

_LEAST_POINTS = 30
_ALIKE_DEG = 20.0
_NAMED = 6


def plan_faults(
    survey: Survey, plan: CellPlan | None, predicted: Mapping[str, Covariate] | None
) -> tuple[str, ...]:
    """Return notes on sectors that are exchanged, and on levels far from those predicted.

    Parameters
    ----------
    survey : Survey
    plan : CellPlan or None
        Of the cells whose antennas are known.
    predicted : mapping of str to callable, optional
        The levels that the survey calibrates.
    """
    points = {cell_id: cell.points for cell_id, cell in survey.cells.items()}
    exchanges: tuple[Exchange, ...] = ()
    if plan is not None:
        plan = plan.to_crs(survey.crs)
        exchanges = exchanged_sectors(points, plan, survey.shadowing, predicted)
    notes = [_exchanged(exchanges)] if exchanges else []
    if predicted is not None:
        meant = {a: b for exchange in exchanges for a, b in exchange.points_as.items()}
        notes += _offset(points, {one: predicted[meant.get(one, one)] for one in points})
    return tuple(notes)


def _exchanged(exchanges: Sequence[Exchange]) -> str:
    pairs = [f"{a} where {b} points" for one in exchanges for a, b in one.points_as.items()]
    turns_deg = np.array([turn for one in exchanges for turn in one.turns_deg])
    off_deg = (turns_deg - turns_deg[0] + 180.0) % 360.0 - 180.0
    by = ""
    if turns_deg.size > 1 and bool((np.abs(off_deg) <= _ALIKE_DEG).all()):
        turn_deg = turns_deg[0] + float(np.mean(off_deg))
        more = "more" if turn_deg > 0 else "less"
        by = f", as if azimuths were {abs(turn_deg):.0f}° {more}"
    odds = max(sum(one.log_odds) for one in exchanges)
    sites = number_of(len(exchanges), "site")
    return (
        f"levels contradict the plan's sectors at {sites}: those of {listed(pairs, _NAMED)}{by} "
        f"(log odds up to {odds:.0f}; likely: cells exchanged in the measurements, or azimuths in "
        "the plan)"
    )


def _offset(points: Mapping[str, Points], predicted: Mapping[str, Covariate]) -> list[str]:
    """Return a note on an offset over all that is beyond a plausible one."""
    if sum(map(len, points.values())) < _LEAST_POINTS:
        return []
    offsets_db = [
        float(np.nanmedian(some.level_dbm - predicted[cell_id](some.east_m, some.north_m)))
        for cell_id, some in points.items()
    ]
    offset_db = float(np.nanmedian(offsets_db))
    if not abs(offset_db) > LARGEST_OFFSET_DB:
        return []
    side = "below" if offset_db < 0 else "above"
    return [
        f"levels are {abs(offset_db):.0f} dB {side} the prediction (median of "
        f"{number_of(len(points), 'cell')}), which is calibrated away: more than the "
        f"{LARGEST_OFFSET_DB:g} dB that a car, a body and the model explain (likely: another "
        "quantity, such as RSRP for the power of a carrier, an attenuator, or an EIRP that is "
        "not theirs)"
    ]
