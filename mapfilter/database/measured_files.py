"""Files of what a survey adds to a database.

``readings.parquet`` has a row for each reading, ``deviations.parquet`` the standard deviation of a
new reading at each point where a cell was measured.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from mapfilter._inputs import read_input
from mapfilter._types import Ints32
from mapfilter.database.checked import HeldPart
from mapfilter.database.manifest import DEVIATIONS, READINGS, describe_part
from mapfilter.database.measured import READING_KINDS, Deviations, MeasuredParts, Readings
from mapfilter.database.parquet import Source, dictionary, read_columns, text_codes, write_columns
from mapfilter.errors import StoreError, fail
from mapfilter.lattice import Lattice

_LARGEST_READINGS_BYTES = 1 << 31
_DEVIATIONS = ("cell", "row", "col", "deviation_db")


def write_readings(readings: Readings, path: Path) -> None:
    """Write the readings of a survey as Parquet."""
    path.write_bytes(readings_parquet(readings))


def readings_parquet(readings: Readings) -> bytes:
    """Return the bytes of the file that :func:`write_readings` writes."""
    sink = pa.BufferOutputStream()
    write_columns(_readings_table(readings), sink)
    return bytes(sink.getvalue())


def _readings_table(readings: Readings) -> pa.Table:
    columns = {name: pa.array(getattr(readings, name)) for name in READING_KINDS}
    columns["cell"] = dictionary(readings.cell, readings.cell_ids or ("",))
    return pa.table(columns)


def read_checked_readings(path: Path, sha256: str | None) -> Readings:
    """Read a survey's readings, whose checksum the rasters of the survey state.

    Raises
    ------
    StoreError
        The file is missing or damaged, or it is not the one of the rasters.
    """
    data = read_input(path, _LARGEST_READINGS_BYTES, "readings", StoreError)
    if hashlib.sha256(data).hexdigest() != sha256:
        expected, got = "the readings of the survey's rasters", "others, by their SHA-256"
        hint = "edited, damaged, or predict was stopped; run mapfilter predict again"
        raise fail(StoreError, str(path), expected, got, hint)
    return read_readings(HeldPart(path, data))


def read_readings(source: Source) -> Readings:
    """Read what :func:`write_readings` wrote; StoreError where it is damaged."""
    table = read_columns(source, tuple(READING_KINDS))
    cell, cell_ids = _codes(source, table["cell"])
    columns = {
        name: table[name].to_numpy().astype(kind)
        for name, kind in READING_KINDS.items()
        if name != "cell"
    }
    return Readings(cell_ids, cell, **columns)


def write_measured(folder: Path, parts: MeasuredParts) -> list[dict[str, Any]]:
    """Write both parts into a database folder; return their entries in the manifest."""
    write_readings(parts.readings, folder / READINGS)
    found = parts.deviations
    values = (found.row, found.col, found.deviation_db)
    columns = [dictionary(found.cell, found.cell_ids or ("",)), *map(pa.array, values)]
    write_columns(pa.table(dict(zip(_DEVIATIONS, columns, strict=True))), folder / DEVIATIONS)
    return [
        describe_part(folder, folder / READINGS, len(parts.readings)),
        describe_part(folder, folder / DEVIATIONS, len(found)),
    ]


def read_measured(
    readings: Source, deviations: Source, lattice: Lattice, cell_ids: Sequence[str]
) -> MeasuredParts:
    """Read both parts of a database of a lattice and cells.

    Raises
    ------
    StoreError
        A part is damaged, or not of this database.
    """
    table = read_columns(deviations, _DEVIATIONS)
    cell, names = _codes(deviations, table["cell"])
    row, col = (table[name].to_numpy().astype(np.int32) for name in ("row", "col"))
    if row.size and not lattice.contains(row, col).all():
        expected = "points on the database's lattice"
        raise fail(StoreError, str(deviations), expected, "others", "parts mixed up")
    deviation_db = table["deviation_db"].to_numpy().astype(np.float32)
    read = read_readings(readings)
    # Cells that were received too rarely for a map are in the readings: at times they serve.
    strange = len(read) > 0 and set(read.cell_ids).isdisjoint(cell_ids)
    for source, wrong in ((readings, strange), (deviations, not set(names) <= {*cell_ids, ""})):
        if wrong:
            raise fail(StoreError, str(source), "cells of the database", "others", "parts mixed up")
    return MeasuredParts(read, Deviations(names, cell, row, col, deviation_db))


def _codes(source: Source, column: Any) -> tuple[Ints32, tuple[str, ...]]:
    if column.null_count or not len(column):
        if not len(column):
            return np.empty(0, dtype=np.int32), ()
        raise fail(StoreError, str(source), "a cell in each row", "none", "damaged")
    return text_codes(column)
