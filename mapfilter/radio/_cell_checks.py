"""What is wrong with cells, each field by itself and all cells together."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from mapfilter.errors import Faults
from mapfilter.radio._cell_rules import (
    OPTIONAL,
    POINTED,
    RANGES,
    antenna_fault,
    id_fault,
    looks_like_radians,
)

if TYPE_CHECKING:
    from mapfilter.radio.cells import Cell


def check_cells(
    cells: tuple[Cell, ...],
    where: Callable[[int, str], str],
    faults: Faults,
    *,
    ranges: bool = True,
) -> None:
    """Note what is wrong with cells: each field (unless checked already), and all together."""
    if not cells and not faults.found:
        faults.add("cell plan", "at least one cell", "none")
    first: dict[str, int] = {}
    for i, cell in enumerate(cells):
        if ranges:
            _check_fields(cell, partial(where, i), faults)
        if cell.antenna in POINTED and cell.azimuth_deg is None:
            faults.add(
                where(i, "azimuth_deg"),
                "an azimuth, as the antenna is a sector",
                "nothing",
                "azimuth left out, or the antenna is omni",
            )
        if cell.id in first:
            faults.add(where(i, "cell"), "an id used once", repr(cell.id), "a row given twice")
        first.setdefault(cell.id, i)
    azimuths = [cell.azimuth_deg for cell in cells if cell.azimuth_deg is not None]
    if looks_like_radians(azimuths):
        shown = ", ".join(f"{azimuth:g}" for azimuth in azimuths[:3])
        faults.add(
            where(0, "azimuth_deg"),
            "degrees in 0..360",
            f"{shown}, …, none above 2π",
            "radians given for degrees",
        )


def _check_fields(cell: Cell, where: Callable[[str], str], faults: Faults) -> None:
    for name in ("id", "site"):
        if wrong := id_fault(getattr(cell, name)):
            faults.add(where(name), *wrong)
    if wrong := antenna_fault(cell.antenna):
        faults.add(where("antenna"), *wrong)
    for name, allowed in RANGES.items():
        value = getattr(cell, name)
        if not allowed.holds(value) and not (value is None and name in OPTIONAL):
            hint = allowed.hint(value) if isinstance(value, int | float) else ""
            faults.add(where(name), allowed.expected, value, hint)
