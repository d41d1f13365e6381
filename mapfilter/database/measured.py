"""What a survey adds to a database: its readings, and how well its levels are known.

Filters over measured maps need both: a cell that was not measured at a place may be received there,
and which cell serves is counted (:mod:`mapfilter.models.measured_map`). Single reports are compared
with the readings. :mod:`mapfilter.database.measured_files` reads and writes them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._types import Bools, Floats, Floats32, Ints32
from mapfilter.database.manifest import POINTS
from mapfilter.database.parquet import read_columns
from mapfilter.errors import InputError, fail
from mapfilter.rasters.raster_set import RxLevRasters

READING_KINDS = {
    "cell": np.int32,
    "report": np.int32,
    "session": np.int32,
    "east_m": np.float64,
    "north_m": np.float64,
    "level_dbm": np.float64,
    "timing_advance": np.float64,
    "serving": np.bool_,
}
"""Columns of readings, and their types."""
_LARGEST_READ_PX = 1 << 25


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """Readings that a survey was made of, N rows.

    Parameters
    ----------
    cell_ids : tuple of str
    cell, report, session : ndarray of int32, shape (N,)
        Index into ``cell_ids``; numbers of what was received at one time, and of the drive or walk.
    east_m, north_m : ndarray, shape (N,)
        Where the cell was received.
    level_dbm : ndarray, shape (N,)
    timing_advance : ndarray, shape (N,)
        Steps; NaN where it was not reported.
    serving : ndarray of bool, shape (N,)
        Whether it was the serving cell.
    """

    cell_ids: tuple[str, ...]
    cell: Ints32
    report: Ints32
    session: Ints32
    east_m: Floats
    north_m: Floats
    level_dbm: Floats
    timing_advance: Floats
    serving: Bools

    def __len__(self) -> int:
        return len(self.cell)

    def some(self, kept: Bools) -> Readings:
        """Return some of the rows."""
        return Readings(self.cell_ids, *(getattr(self, name)[kept] for name in READING_KINDS))


@dataclass(frozen=True, slots=True, eq=False)
class Deviations:
    """Standard deviations of a new reading at points where a cell was measured, M rows.

    ``cell`` is an index into ``cell_ids``, ``row`` and ``col`` are the place on the lattice.
    """

    cell_ids: tuple[str, ...]
    cell: Ints32
    row: Ints32
    col: Ints32
    deviation_db: Floats32

    def __len__(self) -> int:
        return len(self.cell)

    def some(self, kept: Bools) -> Deviations:
        """Return some of the rows."""
        cell, row, col = (one[kept] for one in (self.cell, self.row, self.col))
        return Deviations(self.cell_ids, cell, row, col, self.deviation_db[kept])

    def spread(self, cell_ids: Sequence[str], on_way: Bools) -> Floats32:
        """Return the deviation at every pixel, shape (C, P), NaN where a cell was not measured.

        Parameters
        ----------
        cell_ids : sequence of str
            The C cells that are wanted.
        on_way : ndarray of bool, shape (rows, cols)
            Points of the database; pixels beside them have the value of the nearest one.
        """
        # Here, as it takes long to import, and a database may be opened for its figures alone.
        from scipy.ndimage import distance_transform_edt

        rows, cols = on_way.shape
        near = distance_transform_edt(~on_way, return_distances=False, return_indices=True)
        found = np.full((len(cell_ids), rows * cols), np.nan, dtype=np.float32)
        of = {cell_id: number for number, cell_id in enumerate(self.cell_ids)}
        order = np.argsort(self.cell, kind="stable")
        edges = np.searchsorted(self.cell[order], np.arange(len(self.cell_ids) + 1))
        for band, cell_id in enumerate(cell_ids):
            if cell_id not in of:
                continue
            own = order[edges[of[cell_id]] : edges[of[cell_id] + 1]]
            layer = np.full((rows, cols), np.nan, dtype=np.float32)
            layer[self.row[own], self.col[own]] = self.deviation_db[own]
            found[band] = layer[near[0], near[1]].ravel()
        return found


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredParts:
    """What the survey of a database measured."""

    readings: Readings
    deviations: Deviations


def merged_parts(
    parts: Sequence[MeasuredParts],
    shifts: Sequence[tuple[int, int]],
    cell_ids: Sequence[str],
    left_out: Sequence[str] = (),
) -> MeasuredParts:
    """Return the parts of several surveys together, of some cells.

    ``shifts`` are the rows and columns that each survey's lattice lies below and right of the new
    one's corner. Of a deviation given twice the last counts. Readings of further cells, received
    too rarely for a map, stay beside those of ``cell_ids``, unless they are ``left_out``.
    """
    every = {name for one in parts for name in one.readings.cell_ids}
    names_read = (*cell_ids, *sorted(every.difference(cell_ids, left_out)))
    numbers = {name: number for number, name in enumerate(names_read)}

    def renamed(names: Sequence[str], cell: Ints32) -> Ints32:
        own = np.array([numbers.get(name, -1) for name in names], dtype=np.int32)
        return np.asarray(own[cell], dtype=np.int32)

    given = [p.readings for p in parts]
    readings = [replace(one, cell=renamed(one.cell_ids, one.cell)) for one in given]
    found = [p.deviations for p in parts]
    cell = _joined([renamed(f.cell_ids, f.cell) for f in found], np.int32)
    row = _joined([f.row + down for f, (down, _) in zip(found, shifts, strict=True)], np.int32)
    col = _joined([f.col + right for f, (_, right) in zip(found, shifts, strict=True)], np.int32)
    value = _joined([f.deviation_db for f in found], np.float32)
    table = np.column_stack([cell, row, col])[::-1]
    _, last = np.unique(table, axis=0, return_index=True)
    kept = len(cell) - 1 - last
    kept = kept[(cell[kept] >= 0) & (cell[kept] < len(cell_ids))]
    columns = {
        name: _joined([getattr(one, name) for one in readings], kind)
        for name, kind in READING_KINDS.items()
    }
    for name in ("report", "session"):
        # Numbers of different surveys differ.
        counts = [int(getattr(one, name).max(initial=-1)) + 1 for one in readings]
        sizes = [len(one) for one in readings]
        columns[name] += np.repeat(np.cumsum([0, *counts[:-1]]), sizes).astype(np.int32)
    rows = Readings(names_read, **columns)
    deviations = Deviations(tuple(cell_ids), cell[kept], row[kept], col[kept], value[kept])
    # Rare cells alone would be the readings of another database.
    mapped = (rows.cell >= 0) & (rows.cell < len(cell_ids))
    return MeasuredParts(rows.some(rows.cell >= 0 if mapped.any() else mapped), deviations)


def deviations_at_points(
    folder: Path, rasters: RxLevRasters, cell_ids: Sequence[str]
) -> Deviations:
    """Return the deviations of a survey's rasters at the points of a database folder.

    Raises
    ------
    InputError
        A raster is damaged, or on another lattice than the points.
    """
    points = read_columns(folder / POINTS, ("row", "col"))
    row, col = (points[name].to_numpy() for name in ("row", "col"))
    if row.size and not rasters.lattice.contains(row, col).all():
        hint = "deviations of another survey"
        raise fail(InputError, str(rasters.path), "the lattice of the levels", "another", hint)
    known = set(rasters.cell_ids)
    wanted = [number for number, cell_id in enumerate(cell_ids) if cell_id in known]
    at_once = max(_LARGEST_READ_PX // (rasters.lattice.rows * rasters.lattice.cols), 1)
    cells, rows, cols, values = [], [], [], []
    for start in range(0, len(wanted), at_once):
        some = np.array(wanted[start : start + at_once], dtype=np.int32)
        deviation_db = rasters.read(cells=tuple(cell_ids[n] for n in some))[:, row, col]
        which, kept = np.nonzero(np.isfinite(deviation_db))
        cells.append(some[which])
        rows.append(row[kept])
        cols.append(col[kept])
        values.append(deviation_db[which, kept])
    return Deviations(
        tuple(cell_ids),
        _joined(cells, np.int32),
        _joined(rows, np.int32),
        _joined(cols, np.int32),
        _joined(values, np.float32),
    )


def _joined(parts: Sequence[Any], kind: type) -> Any:
    return np.concatenate([np.empty(0, dtype=kind), *parts]).astype(kind)
