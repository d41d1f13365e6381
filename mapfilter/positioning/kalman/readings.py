"""Levels and timing advances of an epoch's report that a Kalman-type filter can use."""

from __future__ import annotations

from math import inf, isfinite
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats
from mapfilter.filters.contract import Reason
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.positioning.kalman.models import SiteModels
from mapfilter.positioning.step_output import UnusedReading
from mapfilter.tracks.schema import NEIGHBOUR, SERVING


class SiteReadings(NamedTuple):
    """Levels and timing advances (in steps) of cells whose sites are known, and unused rows."""

    cells: tuple[str, ...]
    levels_dbm: tuple[float, ...]
    timed: tuple[str, ...]
    steps: tuple[int, ...]
    unused: tuple[UnusedReading, ...]


def site_readings(sites: SiteModels, epoch: Epoch) -> SiteReadings:
    """Return the readings of an epoch's report.

    The serving cell comes first, then its neighbours from the strongest down: a filter begins at
    the first one, and has room for the errors of only so many.

    A row without a cell identity is assigned to the cell of the plan with its carrier and BSIC,
    near the serving cell; where there are several, it is left out. Of a cell that is reported twice
    the first level and the first timing advance in that order count.
    """
    rows = sorted(epoch.radio, key=_rank)
    timed: dict[str, int] = {}
    for row in rows:
        if row.cell is not None and isfinite(row.timing_advance):
            timed.setdefault(row.cell, int(row.timing_advance))
    serving = next((row.cell for row in rows if row.role == SERVING and row.cell), None)
    received: dict[str, float] = {}
    unused: list[UnusedReading] = []
    for row in rows:
        name, reason = _cell(sites, row, serving)
        level = isfinite(row.level_dbm) and row.censored == 0
        if level and name in received:
            unused.append(UnusedReading(epoch.time_s, row.role, row.name, Reason.SECOND_READING))
        elif name is not None and level:
            received[name] = row.level_dbm
        elif name is None or name not in timed:
            kind = SERVING if row.role == SERVING else NEIGHBOUR
            unused.append(UnusedReading(epoch.time_s, kind, row.name, reason))
    known = {name: steps for name, steps in timed.items() if name in sites.cells}
    levels = tuple(received), tuple(received.values())
    return SiteReadings(*levels, tuple(known), tuple(known.values()), tuple(unused))


def _rank(row: ReportRow) -> tuple[bool, float]:
    """Return what the rows of a report are sorted by."""
    if row.role == SERVING:
        return False, 0.0
    return True, -row.level_dbm if isfinite(row.level_dbm) else inf


def _cell(sites: SiteModels, row: ReportRow, serving: str | None) -> tuple[str | None, Reason]:
    """Return the cell that a row is of, or None and why."""
    if row.cell is not None:
        known = row.cell in sites.cells
        return (row.cell, Reason.NOT_USED_BY_FILTER) if known else (None, Reason.UNKNOWN_CELL)
    if row.arfcn is None:
        return None, Reason.NO_CELL
    found = sites.neighbours(serving, row.arfcn, row.bsic)
    if len(found) == 1:
        return found[0], Reason.NOT_USED_BY_FILTER
    return None, Reason.AMBIGUOUS_CELL if found else Reason.UNKNOWN_CELL


def fix_covariance_m2(fix: GnssFix, usual_sd_m: float) -> Floats:
    """Return the covariance of a fix, (2, 2); that of a usual one where no law has the stated."""
    cross_m2 = fix.cov_east_north_m2 if isfinite(fix.cov_east_north_m2) else 0.0
    stated = np.array([[fix.var_east_m2, cross_m2], [cross_m2, fix.var_north_m2]])
    is_valid = np.isfinite(stated).all() and stated[0, 0] > 0 and np.linalg.det(stated) > 0
    return stated if is_valid else usual_sd_m**2 * np.eye(2)
