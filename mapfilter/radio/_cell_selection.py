"""Which rows of a cell list count."""

from __future__ import annotations

from mapfilter.errors import InputError, fail
from mapfilter.radio._cell_table import Row


def once(rows: list[Row], notes: tuple[str, ...]) -> tuple[list[Row], tuple[str, ...]]:
    """Return the first row of each cell, and the notes with what was left out."""
    first: dict[str, Row] = {}
    for row in rows:
        first.setdefault(row.values["id"], row)
    if len(first) < len(rows):
        notes += (f"{len(rows) - len(first)} rows of cells told already left out",)
    return list(first.values()), notes


def within(
    rows: list[Row],
    bounds_m: tuple[float, float, float, float],
    notes: tuple[str, ...],
    where: str,
) -> tuple[list[Row], tuple[str, ...]]:
    """Return the rows in a box and the notes with what was left out.

    Raises
    ------
    InputError
        There are none.
    """
    west, south, east, north = bounds_m
    inside = [
        row
        for row in rows
        if west <= row.values["east_m"] <= east and south <= row.values["north_m"] <= north
    ]
    if rows and not inside:
        bounds = ", ".join(f"{value:.0f}" for value in bounds_m)
        raise fail(InputError, where, f"cells in {bounds}", "none", "cells of another area")
    if len(inside) < len(rows):
        notes += (f"{len(rows) - len(inside)} of {len(rows)} cells left out: far from the area",)
    return inside, notes
