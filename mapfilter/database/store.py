"""The database folder: its manifest, its parts, and the checks when it is opened.

``manifest.json`` holds format and version, CRS, lattice, cells, parameters, the SHA-256 of inputs
and parts, and counts. ``cells.parquet`` is the cell table, ``points.parquet`` (GeoParquet) has one
row per point, ``levels/CELL/part-N.parquet`` one row per point at which the cell is received.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, Literal

import pyarrow as pa

from mapfilter._arguments import Setting, check_arguments, path_argument
from mapfilter._io import left_aside
from mapfilter._json_files import check_part
from mapfilter._words import likely_of_no_file
from mapfilter.database.checked import Part, generation_of, part_named
from mapfilter.database.manifest import CELLS, MANIFEST, POINTS, read_manifest
from mapfilter.database.parquet import Source, check_extent, count_rows, read_columns, write_columns
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import Faults, MapfilterError, StoreError, fail
from mapfilter.lattice import Lattice
from mapfilter.radio.cell_layouts import SELDOM
from mapfilter.radio.cells import Cell, CellPlan

_ARROW_TYPES = {
    "str": pa.string(),
    "str | None": pa.string(),
    "Antenna": pa.string(),
    "float": pa.float64(),
    "float | None": pa.float64(),
    "int | None": pa.int64(),
    "bool": pa.bool_(),
}
_OPTIONAL = SELDOM
"""Columns that older databases, and those whose plan does not state them, lack."""

_MOST_REPLACED = 50


def write_cells(plan: CellPlan, path: Path) -> None:
    """Write the cell table, one column per field of :class:`mapfilter.radio.cells.Cell`."""
    write_columns(cells_table(plan), path)


def cells_table(plan: CellPlan) -> pa.Table:
    """Return the cell table, without the columns that are optional and that no cell states."""
    lacking = {name for name in _OPTIONAL if not any(getattr(c, name) for c in plan.cells)}
    columns = [one for one in fields(Cell) if one.name not in lacking]
    schema = pa.schema([(one.name, _ARROW_TYPES[str(one.type)]) for one in columns])
    rows = [asdict(cell) for cell in plan.cells]
    return pa.Table.from_pylist(rows, schema)


def read_cells(source: Source, crs: str) -> CellPlan:
    """Read a cell table; raise StoreError where it is damaged."""
    names = [one.name for one in fields(Cell)]
    rows = read_columns(source, names, optional=_OPTIONAL).to_pylist()
    try:
        return CellPlan(crs, tuple(Cell(**row) for row in rows))
    except (TypeError, MapfilterError) as error:
        raise fail(StoreError, str(source), "a cell table", error, "damaged") from error


Verify = Literal["sizes", "full"]
"""What of the parts is compared when a database is opened."""


def open_database(
    path: Path | str,
    verify: Verify = "sizes",
    *,
    generation: str | None = None,
) -> RadioRouteDatabase:
    """Open a database folder and check that all its parts are there.

    Manifest, cell table, the extent of the points, and of each part the number of rows are always
    checked, with the checksum of its last 256 KiB. What is read later is compared with its checksum
    before it is used. A database that is replaced meanwhile is opened
    as it was before, or as it is afterwards.

    Parameters
    ----------
    verify : {"sizes", "full"}
        Compare the parts' sizes; or read them all and compare SHA-256, too.
    generation : str, optional
        Of the database that it has to be, as :attr:`RadioRouteDatabase.generation` gives it.

    Raises
    ------
    StoreError
        No database, one of another version, its manifest is damaged, a part is missing, cut off,
        of another length or has another checksum; or it is not the one of ``generation``.
    ConfigError
        The path is none, or another argument is of another type.
    """
    check_arguments(
        "open_database",
        path_argument("path", path),
        keywords=[
            Setting("verify", verify, Verify),
            Setting("generation", generation, str | None),
        ],
    )
    return _settled(Path(path), verify, generation)


def open_written(path: Path) -> RadioRouteDatabase:
    """Open a database that this process has just written.

    Its parts were described as they were written, so they are not read once more; what is read
    later is compared with its checksum, as always. Errors as of :func:`open_database`.
    """
    return _settled(path, "", None)


def _settled(path: Path, verify: str, generation: str | None) -> RadioRouteDatabase:
    """Open a database as it was before or after it was replaced, if it is meanwhile."""
    for _ in range(_MOST_REPLACED):
        before = generation_of(path)
        try:
            return _open(path, verify, generation)
        except StoreError:
            if before == generation_of(path):
                raise
    hint = "another process writes it without pause"
    raise fail(StoreError, str(path), "a database that stays", "ever another", hint)


def _open(path: Path, verify: str, generation: str | None) -> RadioRouteDatabase:
    if not path.is_dir():
        found = "a file" if path.exists() else "nothing"
        aside = left_aside(path)
        hint = likely_of_no_file(path)
        if path.exists():
            hint = "a database is a folder, which a build writes"
            if (path.parent / MANIFEST).is_file():
                hint = f"a part of the database {path.parent}"
        if aside is not None:
            hint = f"a write that was cut short; the older database is {aside}, rename it"
        raise fail(StoreError, str(path), "a database folder", found, hint)
    if not (path / MANIFEST).is_file():
        inner = sorted(path.glob(f"*/{MANIFEST}"))[:1]
        hint = f"the database is {inner[0].parent}" if inner else "not a database folder"
        raise fail(StoreError, str(path), MANIFEST, "no such file", hint)
    manifest, found = read_manifest(path)
    if generation not in (None, found):
        hint = "it was replaced while in use; start again"
        raise fail(StoreError, str(path), "the database that was opened before", "another", hint)
    where = str(path / MANIFEST)
    try:
        lattice = Lattice(**manifest["lattice"])
    except (MapfilterError, TypeError) as error:
        raise fail(StoreError, where, "a lattice", error, "edited or damaged") from error
    if verify:
        _check_parts(path, manifest["parts"], verify, found)
    plan = read_cells(part_named(CELLS, path, manifest, found), lattice.crs)
    if manifest["cells"] != list(plan.ids):
        raise fail(StoreError, where, f"the cells of {CELLS}", "other cells", "parts mixed up")
    check_extent(part_named(POINTS, path, manifest, found), lattice)
    parameters = manifest["parameters"]
    margin_db, floor_dbm = float(parameters["margin_db"]), float(parameters["floor_dbm"])
    return RadioRouteDatabase(path, lattice, plan, margin_db, floor_dbm, manifest, found)


def info(database: RadioRouteDatabase) -> dict[str, Any]:
    """Return area, counts, sizes, parameters and inputs of a database, ready for JSON."""
    manifest, lattice = database.manifest, database.lattice
    counts = dict.fromkeys(database.cell_ids, 0)
    for part in manifest["parts"]:
        if part.get("cell") is not None:
            counts[part["cell"]] += part["rows"]
    return {
        **{key: manifest[key] for key in ("format", "version", "software")},
        "crs": lattice.crs,
        "bounds_m": list(lattice.bounds_m),
        **{key: getattr(lattice, key) for key in ("resolution_m", "rows", "cols")},
        "points": manifest["counts"]["points"],
        "levels": sum(counts.values()),
        "bytes": sum(part["bytes"] for part in manifest["parts"]),
        **{key: manifest[key] for key in ("counts", "parameters", "inputs")},
        "levels_per_cell": counts,
    }


def _check_parts(
    path: Path, parts: Sequence[Mapping[str, Any]], verify: str, generation: str
) -> None:
    faults = Faults()
    for part in parts:
        if check_part(path / part["path"], part, faults, full=verify == "full"):
            try:
                count_rows(Part.of(path, part, generation))
            except StoreError as error:
                faults.found.extend(error.faults)
    faults.raise_if_any(StoreError)
