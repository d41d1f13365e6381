"""Levels of a report, by names that their cells keep from one report to the next."""

from __future__ import annotations

from math import isfinite

from mapfilter.positioning.epochs import ReportRow


def levels_of(rows: tuple[ReportRow, ...]) -> list[tuple[str, float]]:
    """Return the levels of a report by their cells."""
    return [
        (_name(row), row.level_dbm) for row in rows if isfinite(row.level_dbm) and row.censored == 0
    ]


def _name(row: ReportRow) -> str:
    """Return a name that a cell has whether it serves or not: neighbours have a code alone."""
    is_coded = row.arfcn is not None and row.bsic is not None
    return f"{row.arfcn}/{row.bsic}" if is_coded or row.cell is None else row.cell
