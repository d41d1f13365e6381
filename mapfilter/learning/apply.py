"""Apply a patch: the cell plan, the points and the levels of a database after it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from scipy.spatial import cKDTree

from mapfilter._parallel import Progress
from mapfilter._types import Floats, Floats32, Ints
from mapfilter.database.manifest import InputFile
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.rewrite import levels_of, rewrite, routes_of
from mapfilter.errors import InputError, fail
from mapfilter.lattice import Lattice
from mapfilter.learning.patch import Change, Patch, accepted, check_patch
from mapfilter.learning.patterns import Patterns
from mapfilter.radio.cell_rules import RANGES
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.roads.lattice import RouteLattice

LEARNED = "learned"
"""Class of ways that journeys proposed."""
_NEAREST = 4
_LEAST_M = 1.0


@dataclass(frozen=True, eq=False)
class Changed:
    """A database after a patch.

    Parameters
    ----------
    plan : CellPlan
    routes : RouteLattice
    level_dbm : (cells, points) array
        NaN below the floor.
    """

    plan: CellPlan
    routes: RouteLattice
    level_dbm: Floats32


def apply_patch(
    database: RadioRouteDatabase,
    patch: Patch,
    out: Path | str,
    *,
    inputs: Sequence[InputFile] = (),
    where: str = "patch",
    progress: Progress | None = None,
) -> RadioRouteDatabase:
    """Write a database with the accepted changes of a patch, and open it.

    Levels are changed as far as a database allows: a turned cell has the loss of its mast and
    another gain; a moved one is predicted anew by distance alone; points of a new way have the
    levels of the points about them.

    Parameters
    ----------
    where : str
        Name of the patch in messages.
    inputs : sequence of InputFile
        For the record, such as the file of the patch.

    Raises
    ------
    InputError
        The patch is of another CRS, names cells that the database lacks, leaves no cell, or one
        with an EIRP that no cell has.
    OutputError
        The folder cannot be written, or holds other files than a database.
    """
    check_patch(patch, database, where)
    changed = changed_by(database, accepted(patch.changes), where)
    return rewrite(
        database,
        out,
        changed.plan,
        changed.routes,
        changed.level_dbm,
        inputs=inputs,
        progress=progress,
    )


def changed_by(
    database: RadioRouteDatabase, changes: Sequence[Change], where: str = "patch"
) -> Changed:
    """Return plan, points and levels of a database after some changes, in their order."""
    plan, routes = database.plan, routes_of(database)
    level = levels_of(database)
    east, north = routes.east_north_m
    original = Patterns(plan, east, north, level.T.astype(np.float64), database.floor_dbm)
    cells = list(plan.cells)
    gone: set[int] = set()
    for change in changes:
        at = [plan.index(name) for name in change.cells]
        if change.kind in ("turned", "rotated"):
            for cell in at:
                cells[cell], level[cell] = _turned(original, cell, change.turn_deg)
        elif change.kind == "swapped":
            _swap(original, cells, level, at[0], at[1])
        elif change.kind == "moved":
            place = change.east_m, change.north_m
            level[at[0]] = original.elsewhere(at[0], *place)
            cells[at[0]] = replace(
                cells[at[0]],
                east_m=place[0],
                north_m=place[1],
                site=f"{cells[at[0]].site}-{cells[at[0]].id}",
            )
        elif change.kind == "dead":
            gone |= set(at)
        if change.kind in ("offset", "moved") and np.isfinite(change.offset_db):
            level[at[0]] += np.float32(change.offset_db)
            cells[at[0]] = _offset(cells[at[0]], change.offset_db, where)
    left = [number for number in range(len(cells)) if number not in gone]
    if not left:
        raise fail(InputError, where, "a cell that is left", "none")
    level = np.where(level >= np.float32(database.floor_dbm), level, np.float32(np.nan))
    after = CellPlan(plan.crs, tuple(cells[number] for number in left))
    lines = [change for change in changes if change.kind == "way"]
    grown, level = _with_ways(routes, level[left], lines)
    return Changed(after, grown, level)


def _offset(cell: Cell, offset_db: float, where: str) -> Cell:
    """Return a cell whose EIRP is changed; InputError where it would be none of a cell."""
    known, eirp_dbm = RANGES["eirp_dbm"], cell.eirp_dbm + offset_db
    if not known.holds(eirp_dbm):
        expected = f"an EIRP in {known.low:g}..{known.high:g} dBm after it"
        got = f"{cell.eirp_dbm:g} dBm {offset_db:+g} dB = {eirp_dbm:g} dBm"
        hint = "an offset of another cell, or set accept = false"
        raise fail(InputError, f"{where}, offset_db of {cell.id}", expected, got, hint)
    return replace(cell, eirp_dbm=eirp_dbm)


def _turned(patterns: Patterns, cell: int, turn_deg: float) -> tuple[Cell, Floats]:
    one = patterns.plan.cells[cell]
    if one.azimuth_deg is None:
        return one, patterns.level_dbm[:, cell]
    azimuth_deg = (one.azimuth_deg + turn_deg) % 360.0
    return replace(one, azimuth_deg=azimuth_deg), patterns.turned(cell, azimuth_deg)


def _swap(patterns: Patterns, cells: list[Cell], level: Floats32, first: int, second: int) -> None:
    """Let two cells take each other's antennas, or, on different masts, each other's levels."""
    a, b = patterns.plan.cells[first], patterns.plan.cells[second]
    together = any({first, second} <= set(mast) for mast in patterns.masts)
    if together and a.azimuth_deg is not None and b.azimuth_deg is not None:
        level[first] = patterns.turned(first, b.azimuth_deg)
        level[second] = patterns.turned(second, a.azimuth_deg)
        names = ("azimuth_deg", "downtilt_deg", "mechanical_downtilt_deg", "beamwidth_deg")
        cells[first] = replace(a, **{name: getattr(b, name) for name in names})
        cells[second] = replace(b, **{name: getattr(a, name) for name in names})
        return
    level[first] = patterns.level_dbm[:, second]
    level[second] = patterns.level_dbm[:, first]
    identity = ("id", "mcc", "mnc", "lac", "ci", "arfcn", "bsic", "technology", "frequency_mhz")
    cells[first] = replace(b, **{name: getattr(a, name) for name in identity})
    cells[second] = replace(a, **{name: getattr(b, name) for name in identity})


def _with_ways(
    routes: RouteLattice, level: Floats32, lines: Sequence[Change]
) -> tuple[RouteLattice, Floats32]:
    """Add the points along lines, with the levels of the points about them."""
    lattice = routes.lattice
    known = np.zeros((lattice.rows, lattice.cols), dtype=np.bool_)
    known[routes.row, routes.col] = True
    rows, cols, ids, away = [], [], [], []
    last = int(routes.way_id.max(initial=0))
    for number, change in enumerate(lines, start=1):
        line = shapely.LineString(change.line_m)
        row, col = _pixels_about(lattice, line, change.half_width_m)
        fresh = ~known[row, col]
        row, col = row[fresh], col[fresh]
        known[row, col] = True
        places = shapely.points(*lattice.east_north(row, col))
        rows.append(row)
        cols.append(col)
        ids.append(np.full(row.size, last + number, dtype=np.int64))
        away.append(shapely.distance(places, line).astype(np.float32))
    if not rows or not sum(row.size for row in rows):
        return routes, level
    row, col = np.concatenate(rows), np.concatenate(cols)
    tree = cKDTree(np.column_stack(routes.east_north_m))
    far, near = tree.query(
        np.column_stack(lattice.east_north(row, col)), min(_NEAREST, len(routes))
    )
    far, near = far.reshape(row.size, -1), near.reshape(row.size, -1)
    weight = 1.0 / np.maximum(far, _LEAST_M) ** 2
    about = level[:, near]
    held = np.isfinite(about)
    share = np.where(held, weight, 0.0).sum(axis=2)
    mean = np.where(held, about * weight, 0.0).sum(axis=2) / np.where(share > 0, share, 1.0)
    added = np.where(held[:, :, 0], mean, np.nan).astype(np.float32)
    names = (*routes.class_names, LEARNED)
    every_row = np.concatenate([routes.row, row]).astype(np.int32)
    every_col = np.concatenate([routes.col, col]).astype(np.int32)
    order = np.lexsort((every_col, every_row))
    kind = np.full(row.size, len(names) - 1, dtype=np.int16)
    grown = RouteLattice(
        lattice,
        every_row[order],
        every_col[order],
        np.concatenate([routes.way_id, *ids])[order],
        np.concatenate([routes.way_class, kind])[order],
        names,
        np.concatenate([routes.distance_to_way_m, *away])[order],
        np.concatenate([routes.on_square, np.zeros(row.size, dtype=np.bool_)])[order],
        routes.attribution,
    )
    return grown, np.concatenate([level, added], axis=1)[:, order]


def _pixels_about(
    lattice: Lattice, line: shapely.LineString, half_width_m: float
) -> tuple[Ints, Ints]:
    west, south, east, north = line.bounds
    top, left = lattice.row_col(west - half_width_m, north + half_width_m)
    bottom, right = lattice.row_col(east + half_width_m, south - half_width_m)
    row, col = np.mgrid[
        max(top, 0) : min(bottom, lattice.rows - 1) + 1,
        max(left, 0) : min(right, lattice.cols - 1) + 1,
    ]
    row, col = row.ravel(), col.ravel()
    places = shapely.points(*lattice.east_north(row, col))
    near = shapely.distance(places, line) <= max(half_width_m, lattice.resolution_m * 0.75)
    return row[near], col[near]
