"""Reading parts by window: only the row groups that have rows there are decoded."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from mapfilter.database.columns import DAMAGE, damaged
from mapfilter.errors import StoreError, fail
from mapfilter.geodesy import Lattice

Window = tuple[int, int, int, int]
"""Row, column, rows and columns on a lattice."""

_EVERYWHERE = (-(2**62), 2**62)


class WindowReader:
    """Rows of some parts within windows, columns as asked.

    Points lie along a space-filling curve, so a row group covers a small area. Groups of the window
    that was read last are kept, as its neighbour needs most of them again.

    Parameters
    ----------
    parts : sequence of Path
    columns : sequence of str
        Among them ``row`` and ``col``.
    lattice : Lattice
        The database's.
    """

    def __init__(self, parts: Sequence[Path], columns: Sequence[str], lattice: Lattice) -> None:
        self._parts, self._columns, self._lattice = parts, list(columns), lattice
        self._groups: list[tuple[Path, int]] = []
        self._held: dict[int, pa.Table] = {}
        boxes: list[tuple[int, int, int, int]] = []
        for part in parts:
            try:
                footer = pq.read_metadata(part)
                names = {footer.schema.column(i).name: i for i in range(footer.num_columns)}
                for group in range(footer.num_row_groups):
                    ends = [_ends(footer.row_group(group), names[axis]) for axis in ("row", "col")]
                    self._groups.append((part, group))
                    boxes.append((*ends[0], *ends[1]))
            except DAMAGE as error:
                raise damaged(part, error) from error
        self._boxes = np.array(boxes, dtype=np.int64).reshape(-1, 4)

    def read(self, window: Window) -> dict[str, Any]:
        """Return the rows within a window, column by column: text as Arrow, others as NumPy.

        Raises
        ------
        StoreError
            A part is damaged or of another lattice.
        """
        row, col, rows, cols = window
        low_row, high_row, low_col, high_col = self._boxes.T
        meets = (low_row < row + rows) & (high_row >= row)
        meets &= (low_col < col + cols) & (high_col >= col)
        wanted = np.flatnonzero(meets).tolist()
        self._held = {i: self._held.get(i, None) or self._group(i) for i in wanted}
        tables = []
        for table in self._held.values():
            at = table["row"].to_numpy(), table["col"].to_numpy()
            inside = (at[0] >= row) & (at[0] < row + rows)
            inside &= (at[1] >= col) & (at[1] < col + cols)
            tables.append(table.filter(pa.array(inside)))
        if not tables:
            return {}
        found = pa.concat_tables(tables)
        return {
            name: found[name]
            if pa.types.is_dictionary(found[name].type)
            else found[name].to_numpy()
            for name in self._columns
        }

    def _group(self, number: int) -> pa.Table:
        part, group = self._groups[number]
        try:
            with pq.ParquetFile(part, page_checksum_verification=True) as source:
                table = source.read_row_group(group, columns=["point", *self._columns])
            table.validate(full=True)
        except DAMAGE as error:
            raise damaged(part, error) from error
        at = table["row"].to_numpy(), table["col"].to_numpy()
        number = at[0].astype(np.int64) * self._lattice.cols + at[1]
        placed = np.array_equal(number, table["point"].to_numpy())
        if not (placed and self._lattice.contains(*at).all()):
            expected = "points on the database's lattice"
            raise fail(StoreError, str(part), expected, "others", "parts mixed up")
        return table


def _ends(group: pq.RowGroupMetaData, column: int) -> tuple[int, int]:
    told = group.column(column).statistics
    return (told.min, told.max) if told is not None and told.has_min_max else _EVERYWHERE
