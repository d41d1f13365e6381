"""Reports that repeat themselves while the phone moves: a radio that stands still.

A modem that has died repeats its last report to the last digit; one that works repeats a level now
and then.
"""

from __future__ import annotations

from math import isfinite

from mapfilter.positioning.epochs import ReportRow
from mapfilter.positioning.sensors.reported_levels import levels_of

_NATS_PER_M, _MOST_ROWS = 0.12, 3
"""Gain, for each level of at most three, from a report that repeats the last one: by the metres
between them."""
_NATS_PER_REPORT, _NATS_PER_LEVEL = 1.9, 0.9
"""The most that a repeated report gains: of a single level, which a modem that works repeats in one
of seven to ten reports 10 to 20 m apart; several levels may repeat together, as slow modems renew
them together."""
STALE_NATS = 8.0
"""Sum from which on a report is stale."""


def repeated_nats(
    nats: float, report: tuple[ReportRow, ...], radio: tuple[ReportRow, ...], moved_m: float
) -> float:
    """Return how much reports speak for a radio that stands still.

    Parameters
    ----------
    nats : float
        The same after the last report.
    report, radio : tuple of ReportRow
        The last report and the present one.
    moved_m : float
        Distance between them.
    """
    if not _equal(radio, report):
        return 0.0
    # Beyond the end of its scale a level stays the same anywhere.
    levels = min(len(levels_of(radio)), _MOST_ROWS)
    most = max(_NATS_PER_REPORT, _NATS_PER_LEVEL * levels)
    return nats + min(levels * _NATS_PER_M * moved_m, most) if levels else 0.0


def _equal(report: tuple[ReportRow, ...], before: tuple[ReportRow, ...]) -> bool:
    if len(report) != len(before):
        return False
    for row, other in zip(report, before, strict=True):
        level_dbm, other_dbm = row.level_dbm, other.level_dbm
        # Nearly all pairs differ in the level of their first rows.
        if level_dbm != other_dbm and (isfinite(level_dbm) or isfinite(other_dbm)):
            return False
        if row is not other and _key(row) != _key(other):
            return False
    return True


def _key(row: ReportRow) -> tuple[object, ...]:
    measured = [x if isfinite(x) else None for x in (row.level_dbm, row.timing_advance)]
    return row.role, row.cell, row.arfcn, row.bsic, row.censored, *measured
