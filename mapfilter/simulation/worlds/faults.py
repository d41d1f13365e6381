"""Faults of what a filter is given: cell plans, predictions and maps that are wrong.

The world itself has no faults. A fault turns what is true into what a planner's export or a map
says; each has one definition, and is drawn from a seed and its name only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from mapfilter._types import Floats32
from mapfilter.errors import ConfigError, fail
from mapfilter.lattice import Lattice
from mapfilter.propagation.shadowing import named_rng
from mapfilter.radio.cells import Cell, CellPlan

SHARE = 0.2
"""Share of the cells that are off, moved, or biased by 10 dB; at least one cell."""
MOVED_M = 300.0
ALL_BIASED_DB, SOME_BIASED_DB = 8.0, 10.0
BIASED_TOGETHER = 0.1
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
    by_fault : mapping of str to tuple of str
        Cells that each fault concerns, by its name.
    """

    plan: CellPlan
    silent: tuple[str, ...] = ()
    offset_db: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    district: District | None = None
    missing_ways: float = 0.0
    by_fault: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def affected(self) -> tuple[str, ...]:
        """Cells that any fault concerns, in the order of the faults."""
        return tuple(dict.fromkeys(cell for cells in self.by_fault.values() for cell in cells))

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
    chosen = _some(plan.ids, SHARE, rng)
    return GivenInputs(plan, silent=chosen, by_fault={"cells-off": chosen})


def cells_moved(plan: CellPlan, _area: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Place a fifth of the cells 300 m from where they stand, in any direction."""
    chosen = _some(plan.ids, SHARE, rng)
    moved = {}
    for name in chosen:
        angle = rng.uniform(0.0, 2 * np.pi)
        cell = plan[name]
        east_m = cell.east_m + MOVED_M * float(np.cos(angle))
        north_m = cell.north_m + MOVED_M * float(np.sin(angle))
        # Alone there: a mast that it does not share.
        moved[name] = replace(cell, site=f"{cell.site}-{name}", east_m=east_m, north_m=north_m)
    return GivenInputs(_with(plan, moved), by_fault={"cells-moved": chosen})


def all_biased(plan: CellPlan, _area: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Predict every cell 8 dB too high or too low."""
    offset_db = _biased(plan.ids, ALL_BIASED_DB, rng)
    return GivenInputs(plan, offset_db=offset_db, by_fault={"cells-biased-8": plan.ids})


def some_biased(plan: CellPlan, _area: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Predict a fifth of the cells 10 dB too high or too low."""
    chosen = _some(plan.ids, SHARE, rng)
    offset_db = _biased(chosen, SOME_BIASED_DB, rng)
    return GivenInputs(plan, offset_db=offset_db, by_fault={"cells-biased-10": chosen})


def sectors_swapped(plan: CellPlan, _area: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Exchange the antennas of two sectors of a site."""
    (site,) = _sites_of_sectors(plan, 1, rng)
    swapped = _swapped(site, rng)
    return GivenInputs(_with(plan, swapped), by_fault={"sectors-swapped": tuple(sorted(swapped))})


def site_rotated(plan: CellPlan, _area: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Turn all sectors of a site by 120 degrees."""
    (site,) = _sites_of_sectors(plan, 1, rng)
    turned = _turned(site)
    return GivenInputs(_with(plan, turned), by_fault={"site-rotated": tuple(turned)})


def new_cell(plan: CellPlan, _area: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Leave a cell that is on air out of the plan."""
    if len(plan) < 2:
        raise fail(ConfigError, "fault new-cell", "a plan of at least two cells", len(plan))
    gone = plan.cells[int(rng.integers(len(plan)))].id
    left = tuple(cell for cell in plan.cells if cell.id != gone)
    return GivenInputs(replace(plan, cells=left), by_fault={"new-cell": (gone,)})


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


def faults_together(plan: CellPlan, _area: Lattice, rng: np.random.Generator) -> GivenInputs:
    """Swap two sectors, rotate another site, switch a cell off, bias a tenth, cut 10 % of the ways.

    No cell has two of these faults.
    """
    first, second = _sites_of_sectors(plan, 2, rng)
    swapped, turned = _swapped(first, rng), _turned(second)
    left = [name for name in plan.ids if name not in swapped and name not in turned]
    if len(left) < 2:
        expected = "two cells beside two sectors and a site of them"
        raise fail(ConfigError, "fault faults-together", expected, len(left), "set cells.sites")
    off = left.pop(int(rng.integers(len(left))))
    count = min(max(1, round(BIASED_TOGETHER * len(plan))), len(left))
    biased = tuple(left[int(i)] for i in np.sort(rng.choice(len(left), count, replace=False)))
    return GivenInputs(
        _with(plan, {**swapped, **turned}),
        silent=(off,),
        offset_db=_biased(biased, SOME_BIASED_DB, rng),
        missing_ways=MISSING_WAYS,
        by_fault={
            "sectors-swapped": tuple(sorted(swapped)),
            "site-rotated": tuple(turned),
            "cells-off": (off,),
            "cells-biased-10": biased,
        },
    )


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
        "faults-together": faults_together,
    }
)
"""All faults by name."""


def _some(names: Sequence[str], share: float, rng: np.random.Generator) -> tuple[str, ...]:
    """Draw a share of the cells, at least one, in the plan's order."""
    count = max(1, round(share * len(names)))
    return tuple(names[int(i)] for i in np.sort(rng.choice(len(names), count, replace=False)))


def _biased(names: Sequence[str], offset_db: float, rng: np.random.Generator) -> dict[str, float]:
    """Draw the sign of each cell's offset."""
    signs = rng.choice([-1.0, 1.0], len(names))
    return {name: offset_db * float(sign) for name, sign in zip(names, signs, strict=True)}


def _sites_of_sectors(
    plan: CellPlan, count: int, rng: np.random.Generator
) -> list[tuple[Cell, ...]]:
    """Draw sites with at least two sectors."""
    sites: dict[str, list[Cell]] = {}
    for cell in plan.cells:
        if cell.azimuth_deg is not None:
            sites.setdefault(cell.site, []).append(cell)
    wide = [tuple(cells) for cells in sites.values() if len(cells) > 1]
    if len(wide) < count:
        expected = f"{count} or more sites with two sectors or more"
        hint = "set cells.sites and cells.sectors"
        raise fail(ConfigError, "fault of sectors", expected, len(wide), hint)
    return [wide[int(i)] for i in rng.choice(len(wide), count, replace=False)]


def _swapped(site: tuple[Cell, ...], rng: np.random.Generator) -> dict[str, Cell]:
    first, second = (site[int(i)] for i in rng.choice(len(site), 2, replace=False))
    return {first.id: _aimed_as(first, second), second.id: _aimed_as(second, first)}


def _turned(site: tuple[Cell, ...]) -> dict[str, Cell]:
    return {
        cell.id: replace(cell, azimuth_deg=((cell.azimuth_deg or 0.0) + TURNED_DEG) % 360.0)
        for cell in site
    }


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
