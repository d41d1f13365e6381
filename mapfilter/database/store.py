"""The database folder: its manifest, its parts, and the checks when it is opened.

``manifest.json`` holds format and version, CRS, lattice, cells, parameters, the SHA-256 of inputs
and parts, and counts. ``cells.parquet`` is the cell table, ``points.parquet`` (GeoParquet) has one
row per point, ``levels/CELL/part-N.parquet`` one row per point at which the cell is heard.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path, PurePosixPath
from typing import Any, Literal
from urllib.parse import quote

import pyarrow as pa
import pyarrow.parquet as pq

from mapfilter._io import read_json, sha256_file
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import Faults, MapfilterError, StoreError, fail
from mapfilter.geodesy import Lattice
from mapfilter.radio.cells import Cell, CellPlan

FORMAT = "mapfilter radio-route database"
VERSION = 1
MANIFEST = "manifest.json"
CELLS = "cells.parquet"
POINTS = "points.parquet"

_LONGEST_NAME = 200
_ARROW_TYPES = {
    "str": pa.string(),
    "Antenna": pa.string(),
    "float": pa.float64(),
    "float | None": pa.float64(),
    "int | None": pa.int64(),
    "bool": pa.bool_(),
}


def levels_folder(cell_id: str) -> str:
    """Return a cell's folder within the database; no id leads out of it.

    Examples
    --------
    >>> levels_folder("S1A"), levels_folder("../x"), levels_folder("12.7")
    ('levels/S1A', 'levels/%2E%2E%2Fx', 'levels/12%2E7')
    """
    name = quote(cell_id, safe="").replace(".", "%2E")
    if len(name) > _LONGEST_NAME:
        name = name[: _LONGEST_NAME // 2] + "-" + hashlib.sha256(cell_id.encode()).hexdigest()
    return f"levels/{name}"


def write_cells(plan: CellPlan, path: Path) -> None:
    """Write the cell table, one column per field of :class:`mapfilter.radio.cells.Cell`."""
    schema = pa.schema([(field.name, _ARROW_TYPES[str(field.type)]) for field in fields(Cell)])
    rows = [asdict(cell) for cell in plan.cells]
    pq.write_table(pa.Table.from_pylist(rows, schema), path, compression="zstd")


def read_cells(path: Path, crs: str) -> CellPlan:
    """Read a cell table.

    Raises
    ------
    StoreError
        It is damaged.
    """
    try:
        rows = pq.ParquetFile(path).read().to_pylist()
        return CellPlan(crs, tuple(Cell(**row) for row in rows))
    except (OSError, pa.ArrowException, TypeError, MapfilterError) as error:
        raise fail(StoreError, str(path), "a cell table", error, "damaged") from error


def open_database(
    path: Path | str, verify: Literal["sizes", "full"] = "sizes"
) -> RadioRouteDatabase:
    """Open a database folder and check that all its parts are there.

    Parameters
    ----------
    path : Path or str
    verify : {"sizes", "full"}
        Compare the parts' sizes, or read them all and compare their SHA-256, too.

    Raises
    ------
    StoreError
        No database, one of a newer version, a part is missing, cut off or has another checksum.
    """
    path = Path(path)
    if not path.is_dir():
        found = "a file" if path.exists() else "nothing"
        raise fail(StoreError, str(path), "a database folder", found, "a mistyped path")
    if not (path / MANIFEST).is_file():
        raise fail(StoreError, str(path), MANIFEST, "no such file", "not a database folder")
    manifest = read_json(path / MANIFEST)
    where = str(path / MANIFEST)
    if manifest.get("format") != FORMAT:
        raise fail(StoreError, where, f"format {FORMAT!r}", manifest.get("format"))
    if manifest.get("version") != VERSION:
        hint = "written by a newer mapfilter; update it"
        raise fail(StoreError, where, f"version {VERSION}", manifest.get("version"), hint)
    try:
        _check_parts(path, manifest["parts"], verify)
        lattice = Lattice(**manifest["lattice"])
        plan = read_cells(path / CELLS, lattice.crs)
        parameters = manifest["parameters"]
        margin_db, floor_dbm = float(parameters["margin_db"]), float(parameters["floor_dbm"])
        listed = list(manifest["cells"])
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise fail(
            StoreError, where, "a whole manifest", repr(error), "edited or damaged"
        ) from error
    if listed != list(plan.ids):
        raise fail(StoreError, where, f"the cells of {CELLS}", "other cells", "parts mixed up")
    return RadioRouteDatabase(path, lattice, plan, margin_db, floor_dbm, manifest)


def info(database: RadioRouteDatabase) -> dict[str, Any]:
    """Return what a database holds, ready for JSON: area, counts, sizes, parameters, inputs."""
    manifest = database.manifest
    counts = dict.fromkeys(database.cell_ids, 0)
    for part in manifest["parts"]:
        if part.get("cell") is not None:
            counts[part["cell"]] += part["rows"]
    return {
        "format": manifest["format"],
        "version": manifest["version"],
        "software": manifest["software"],
        "crs": database.lattice.crs,
        "bounds_m": list(database.lattice.bounds_m),
        "resolution_m": database.lattice.resolution_m,
        "rows": database.lattice.rows,
        "cols": database.lattice.cols,
        "points": manifest["counts"]["points"],
        "levels": sum(counts.values()),
        "bytes": sum(part["bytes"] for part in manifest["parts"]),
        "counts": manifest["counts"],
        "parameters": manifest["parameters"],
        "inputs": manifest["inputs"],
        "levels_per_cell": counts,
    }


def export_geopackage(
    database: RadioRouteDatabase, path: Path | str, cells: Sequence[str] = ()
) -> None:
    """Write a database as GeoPackage: layers ``points`` and ``cells``, and one per cell named.

    Parameters
    ----------
    database : RadioRouteDatabase
    path : Path or str
        Ends in .gpkg; an older file is replaced.
    cells : sequence of str
        Cells whose points, within the database's margin, become a layer of their own.

    Raises
    ------
    InputError
        The database has no such cell.
    OutputError
        The file cannot be written.
    """
    from mapfilter.database.geopackage import write_geopackage

    write_geopackage(database, Path(path), cells)


def describe_part(folder: Path, file: Path, rows: int, cell: str | None = None) -> dict[str, Any]:
    """Return a part's entry for the manifest."""
    entry: dict[str, Any] = {"path": file.relative_to(folder).as_posix(), "rows": rows}
    if cell is not None:
        entry["cell"] = cell
    return {**entry, "bytes": file.stat().st_size, "sha256": sha256_file(file)}


def _check_parts(path: Path, parts: list[Mapping[str, Any]], verify: str) -> None:
    faults = Faults()
    for name in (CELLS, POINTS):
        if all(part["path"] != name for part in parts):
            faults.add(str(path / MANIFEST), f"a part {name}", "none")
    for part in parts:
        place, size = PurePosixPath(part["path"]), int(part["bytes"])
        file = path / place
        if place.is_absolute() or ".." in place.parts:
            faults.add(str(path / MANIFEST), "parts within the folder", str(place))
        elif not file.is_file():
            faults.add(str(file), f"a file of {size} bytes", "no such file", "not copied whole")
        elif file.stat().st_size != size:
            got = f"{file.stat().st_size} bytes"
            faults.add(str(file), f"{size} bytes", got, "cut off or overwritten")
        elif verify == "full" and (digest := sha256_file(file)) != part["sha256"]:
            expected = f"SHA-256 {part['sha256'][:12]}…"
            faults.add(str(file), expected, f"{digest[:12]}…", "changed after it was written")
    faults.raise_if_any(StoreError)
