"""What of an epoch's report a Kalman-type filter can take, and why not of the rest."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from mapfilter.filters.contract import Reason
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.estimate import UnusedReading
from mapfilter.positioning.kalman.models import SiteModels
from mapfilter.tracks.schema import NEIGHBOUR, SERVING


@dataclass(frozen=True, slots=True)
class SiteReadings:
    """Readings of cells whose sites are known.

    Parameters
    ----------
    cells : tuple of str
        Whose levels were received.
    levels_dbm : tuple of float
    timed : tuple of str
        Whose timing advances were reported.
    steps : tuple of int
    unused : tuple of UnusedReading
    """

    cells: tuple[str, ...]
    levels_dbm: tuple[float, ...]
    timed: tuple[str, ...]
    steps: tuple[int, ...]
    unused: tuple[UnusedReading, ...]


def site_readings(sites: SiteModels, epoch: Epoch) -> SiteReadings:
    """Sort an epoch's report.

    A row without a cell is that cell of the plan whose carrier and BSIC it has, near the serving
    one; where there are several, it is left out.

    Parameters
    ----------
    sites : SiteModels
    epoch : Epoch
    """
    timed = {
        row.cell: int(row.timing_advance)
        for row in epoch.radio
        if row.cell is not None and isfinite(row.timing_advance)
    }
    serving = next((row.cell for row in epoch.radio if row.role == SERVING and row.cell), None)
    received: list[tuple[str, float]] = []
    unused: list[UnusedReading] = []
    for row in epoch.radio:
        name, reason = _cell(sites, row, serving)
        level = isfinite(row.level_dbm) and row.censored == 0
        if name is not None and level:
            received.append((name, row.level_dbm))
        elif name is None or name not in timed:
            kind = SERVING if row.role == SERVING else NEIGHBOUR
            unused.append(UnusedReading(epoch.time_s, kind, _what(row), reason))
    known = {name: steps for name, steps in timed.items() if name in sites.cells}
    return SiteReadings(
        tuple(name for name, _ in received), tuple(level for _, level in received), tuple(known),
        tuple(known.values()), tuple(unused),
    )  # fmt: skip


def _cell(sites: SiteModels, row: ReportRow, serving: str | None) -> tuple[str | None, Reason]:
    """Return the cell that a row is of, or None and why."""
    if row.cell is not None:
        known = row.cell in sites.cells
        return (row.cell, Reason.NOT_USED_BY_FILTER) if known else (None, Reason.UNKNOWN_CELL)
    if row.arfcn is None:
        return None, Reason.NOT_USED_BY_FILTER
    found = sites.neighbours(serving, row.arfcn, row.bsic)
    if len(found) == 1:
        return found[0], Reason.NOT_USED_BY_FILTER
    return None, Reason.AMBIGUOUS_CELL if found else Reason.UNKNOWN_CELL


def _what(row: ReportRow) -> str:
    if row.cell is not None or row.arfcn is None:
        return row.cell or ""
    return f"ARFCN {row.arfcn}, BSIC {'unknown' if row.bsic is None else row.bsic}"
