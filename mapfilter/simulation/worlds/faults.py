"""Faults of what a filter is given: cell plans, predictions and maps that are wrong.

The world itself has no faults. A fault turns what is true into what a planner's export or a map
says; each has one definition, and is drawn from a seed and its name only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from mapfilter._types import Floats32
from mapfilter.errors import ConfigError, fail
from mapfilter.geodesy import Lattice
from mapfilter.propagation.shadowing import named_rng
from mapfilter.radio.cells import Cell, CellPlan

SHARE = 0.2
"""Share of the cells that are off, moved, or biased by 10 dB; at least one cell."""
MOVED_M = 300.0
ALL_BIASED_DB, SOME_BIASED_DB = 8.0, 10.0
TURNED_DEG = 120.0
DISTRICT_DB, DISTRICT_SHARE = 6.0, 0.25
MISSING_WAYS = 0.1


@dataclass(frozen=True)
class District:
    """A disc in which all predicted levels are off.

    Parameters
    ----------
    east_m, north_m, radius_m : float
    offset_db : float
        Added to the prediction.
    """

    east_m: float
    north_m: float
    radius_m: float
    offset_db: float

    def added_to(self, level_dbm: Floats32, lattice: Lattice) -> Floats32:
        """Return levels on a lattice with the offset inside the disc."""
        row, col = np.indices(level_dbm.shape)
        east, north = lattice.east_north(row, col)
        inside = np.hypot(east - self.east_m, north - self.north_m) <= self.radius_m
        return np.asarray(level_dbm + self.offset_db * inside, dtype=np.float32)


@dataclass(frozen=True)
class GivenInputs:
    """What a filter is given, where it differs from the world.

    Parameters
    ----------
    plan : CellPlan
        From which levels are predicted.
    silent : tuple of str
        Cells of the plan that are not on air.
    offset_db : mapping of str to float
        Added to the predicted levels of a cell.
    district : District or None
        Where all predicted levels are off.
    missing_ways : float
        Share of the ways that the map lacks.
    affected : tuple of str
        Cells that the fault concerns.
    """

    plan: CellPlan
    silent: tuple[str, ...] = ()
    offset_db: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    district: District | None = None
    missing_ways: float = 0.0
    affected: tuple[str, ...] = ()

    def predicted(self, cell_id: str, level_dbm: Floats32, lattice: Lattice) -> Floats32:
        """Return the prediction of a cell as it is given."""
        shifted = np.asarray(level_dbm + self.offset_db.get(cell_id, 0.0), dtype=np.float32)
        return shifted if self.district is None else self.district.added_to(shifted, lattice)


Fault = Callable[[CellPlan, Lattice, np.random.Generator], GivenInputs]


def given_inputs(
    name: str | None, plan: CellPlan, lattice: Lattice, seed: int, variant: int = 0
) -> GivenInputs:
    """Return what is given under a fault.

    Parameters
    ----------
    name : str or None
        Out of :data:`FAULTS`; None for no fault.
    plan : CellPlan
        The true one.
    lattice : Lattice
        The area.
    seed, variant : int
        Of the draws; variants differ in which cells are affected, and how.

    Raises
    ------
    ConfigError
        There is no such fault, or the plan has no site that it could concern.
    """
    if name is None:
        return GivenInputs(plan)
    if name not in FAULTS:
        raise fail(ConfigError, "fault", ", ".join(FAULTS), repr(name))
    return FAULTS[name](plan, lattice, named_rng(seed, "fault", name, str(variant)))


def cells_off(plan: CellPlan, _area: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Switch a fifth of the cells of the plan off."""
    chosen = _some(plan, rng)
    return GivenInputs(plan, silent=chosen, affected=chosen)


def cells_moved(plan: CellPlan, _area: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Place a fifth of the cells 300 m from where they stand, in any direction."""
    chosen = _some(plan, rng)
    moved = {}
    for name in chosen:
        angle = rng.uniform(0.0, 2 * np.pi)
        cell = plan[name]
        east_m = cell.east_m + MOVED_M * float(np.cos(angle))
        north_m = cell.north_m + MOVED_M * float(np.sin(angle))
        # Alone there: a mast that it does not share.
        moved[name] = replace(cell, site=f"{cell.site}-{name}", east_m=east_m, north_m=north_m)
    return GivenInputs(_with(plan, moved), affected=chosen)


def all_biased(plan: CellPlan, _area: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Predict every cell 8 dB too high or too low."""
    signs = rng.choice([-1.0, 1.0], len(plan))
    offsets = {
        name: ALL_BIASED_DB * float(sign) for name, sign in zip(plan.ids, signs, strict=True)
    }
    return GivenInputs(plan, offset_db=MappingProxyType(offsets), affected=plan.ids)


def some_biased(plan: CellPlan, _area: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Predict a fifth of the cells 10 dB too high or too low."""
    chosen = _some(plan, rng)
    signs = rng.choice([-1.0, 1.0], len(chosen))
    offsets = {name: SOME_BIASED_DB * float(sign) for name, sign in zip(chosen, signs, strict=True)}
    return GivenInputs(plan, offset_db=MappingProxyType(offsets), affected=chosen)


def sectors_swapped(plan: CellPlan, _area: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Exchange the antennas of two sectors of a site."""
    site = _site_of_sectors(plan, rng)
    first, second = (site[int(i)] for i in rng.choice(len(site), 2, replace=False))
    swapped = {first.id: _aimed_as(first, second), second.id: _aimed_as(second, first)}
    return GivenInputs(_with(plan, swapped), affected=tuple(sorted(swapped)))


def site_rotated(plan: CellPlan, _area: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Turn all sectors of a site by 120 degrees."""
    turned = {
        cell.id: replace(cell, azimuth_deg=((cell.azimuth_deg or 0.0) + TURNED_DEG) % 360.0)
        for cell in _site_of_sectors(plan, rng)
    }
    return GivenInputs(_with(plan, turned), affected=tuple(turned))


def new_cell(plan: CellPlan, _area: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Leave a cell that is on air out of the plan."""
    if len(plan) < 2:
        raise fail(ConfigError, "fault new-cell", "a plan of at least two cells", len(plan))
    gone = plan.cells[int(rng.integers(len(plan)))].id
    left = tuple(cell for cell in plan.cells if cell.id != gone)
    return GivenInputs(replace(plan, cells=left), affected=(gone,))


def ways_missing(plan: CellPlan, _area: Lattice, _rng: np.random.Generator) -> GivenInputs:
    """Leave 10 % of the ways out of the map."""
    return GivenInputs(plan, missing_ways=MISSING_WAYS)


def district_off(plan: CellPlan, lattice: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Predict 6 dB too high or too low in a disc of a quarter of the area."""
    west, south, east, north = lattice.bounds_m
    radius_m = float(np.sqrt(DISTRICT_SHARE * (east - west) * (north - south) / np.pi))
    place = rng.uniform([west, south], [east, north])
    offset_db = DISTRICT_DB * float(rng.choice([-1.0, 1.0]))
    district = District(float(place[0]), float(place[1]), radius_m, offset_db)
    return GivenInputs(plan, district=district)


FAULTS: Mapping[str, Fault] = MappingProxyType(
    {
        "cells-off": cells_off,
        "cells-moved": cells_moved,
        "cells-biased-8": all_biased,
        "cells-biased-10": some_biased,
        "sectors-swapped": sectors_swapped,
        "site-rotated": site_rotated,
        "new-cell": new_cell,
        "ways-missing": ways_missing,
        "district-6db": district_off,
    }
)
"""All faults by name."""


def _some(plan: CellPlan, rng: np.random.Generator) -> tuple[str, ...]:
    """Draw a fifth of the cells, at least one, in the plan's order."""
    count = max(1, round(SHARE * len(plan)))
    chosen = np.sort(rng.choice(len(plan), count, replace=False))
    return tuple(plan.ids[int(i)] for i in chosen)


def _site_of_sectors(plan: CellPlan, rng: np.random.Generator) -> tuple[Cell, ...]:
    """Draw a site with at least two sectors."""
    sites: dict[str, list[Cell]] = {}
    for cell in plan.cells:
        if cell.azimuth_deg is not None:
            sites.setdefault(cell.site, []).append(cell)
    wide = [cells for cells in sites.values() if len(cells) > 1]
    if not wide:
        expected = "a site with two sectors or more"
        raise fail(ConfigError, "fault of sectors", expected, "none", "set cells.sectors")
    return tuple(wide[int(rng.integers(len(wide)))])


def _aimed_as(cell: Cell, other: Cell) -> Cell:
    return replace(
        cell,
        azimuth_deg=other.azimuth_deg,
        downtilt_deg=other.downtilt_deg,
        mechanical_downtilt_deg=other.mechanical_downtilt_deg,
        beamwidth_deg=other.beamwidth_deg,
    )


def _with(plan: CellPlan, changed: Mapping[str, Cell]) -> CellPlan:
    return replace(plan, cells=tuple(changed.get(cell.id, cell) for cell in plan.cells))
