"""``mapfilter merge``, ``export`` and ``info``: databases merged, exported and described."""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import rasterio
from rasterio.errors import NotGeoreferencedWarning, RasterioError

from mapfilter._io import ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter.database.export import BANDS, CELLS_TAG
from mapfilter.database.manifest import MANIFEST
from mapfilter.database.merge import merge
from mapfilter.database.store import info, open_database
from mapfilter.errors import ConfigError, InputError, fail
from mapfilter.evaluation.map_bound import BANDS as BOUND_BANDS
from mapfilter.rasters.raster_set import is_raster_folder, open_rasters
from mapfilter.tracks.readers.formats import format_of, read_recording
from mapfilter.tracks.schema import TABLES
from mapfilter.tracks.store import is_log, read_log

_MAPS = (".pbf", ".osm", ".osm.gz", ".osm.bz2")
_INDEX_COLUMN = b"TX_NAME"
_LONGEST_LINE_BYTES = 1 << 16


def run_merge(
    databases: Sequence[Path],
    out: Path,
    *,
    without: Sequence[str] = (),
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Merge databases; within its area a later one overrides earlier ones in its own cells."""
    began_s = time.perf_counter()
    opened = [open_database(path, verify="full") for path in databases]
    ensure_writable_folder(out.parent)
    merged = merge(opened, out, without=without, progress=progress)
    points = int(merged.manifest["counts"]["points"])
    seconds = time.perf_counter() - began_s
    return {"points": points, "cells": len(merged.cell_ids), "database": out, "seconds": seconds}


def run_export(database: Path, to: Path) -> dict[str, Any]:
    """Write a database as GeoPackage, or its best server and margin as GeoTIFF."""
    from mapfilter.database.export import export_cog, export_geopackage

    kind = to.suffix.lower()
    if kind not in (".gpkg", ".tif", ".tiff"):
        expected = "a name that ends in .gpkg or .tif"
        raise fail(ConfigError, f"--to {to}", expected, to.suffix or "no suffix")
    opened = open_database(database, verify="full")
    if kind == ".gpkg":
        export_geopackage(opened, to)
    else:
        export_cog(opened, to)
    points = opened.manifest["counts"]["points"]
    return {"points": points, "cells": len(opened.cell_ids), "file": to}


def run_info(path: Path) -> dict[str, Any]:
    """Describe the file or folder at a path, ready for JSON; compare a database's checksums."""
    if not path.exists():
        raise fail(InputError, str(path), "a database, raster file or log", "nothing there")
    if path.is_file():
        if (hint := _no_raster(path)) is None:
            return _recording_info(path)
        if hint:
            raise fail(InputError, str(path), "a database, raster or log folder", "a file", hint)
        return _raster_info(path)
    if (path / MANIFEST).exists():
        return {"kind": "database", **info(open_database(path, verify="full"))}
    if is_log(path):
        return _log_info(path)
    if is_raster_folder(path):
        return _raster_info(path)
    logs = sorted(inner for inner in path.iterdir() if is_log(inner))
    if logs:
        return {"kind": "logs", "logs": len(logs), "first": logs[0].name, "last": logs[-1].name}
    hint = "a folder that was not written whole" if any(path.iterdir()) else "an empty folder"
    raise fail(InputError, str(path), f"{MANIFEST}, a log, or logs", "none", hint)


def _no_raster(path: Path) -> str | None:
    """Return the use of a file that is not a raster, else an empty text; None for a recording."""
    name = path.name.lower()
    if name.endswith(_MAPS):
        return "a map; use it as area.map"
    if path.stem in TABLES or is_log(path.parent):
        return "a part of a log; name the folder that it lies in"
    if path.suffix.lower() == ".gpkg":
        return "an exported database, or a layer of roads; QGIS and geopandas open it"
    if path.suffix.lower() in (".tif", ".tiff") and _is_export(path):
        return "best servers that mapfilter export wrote; QGIS and rasterio open it"
    if path.suffix.lower() in (".tif", ".tiff") and _is_bound(path):
        return "the bound of a database that mapfilter bound wrote; QGIS and rasterio open it"
    if path.suffix == ".toml":
        return "a configuration; give it to a command with -c"
    if format_of(path) is not None:
        return None
    if path.suffix == ".csv" and _INDEX_COLUMN not in _first_line(path):
        return "a cell plan; use it as cells.plan"
    return ""


def _described(path: Path) -> tuple[tuple[str | None, ...], bool]:
    """Return the descriptions of a raster's bands, and whether a tag lists cells."""
    try:
        with warnings.catch_warnings():
            # A file that is cut off may have lost its place; its own reader reports that.
            warnings.simplefilter("ignore", NotGeoreferencedWarning)
            source = rasterio.open(path)
        with source:
            return source.descriptions, CELLS_TAG in source.tags()
    except RasterioError:
        return (), False


def _is_export(path: Path) -> bool:
    return _described(path) == (tuple(dict(BANDS)), True)


def _is_bound(path: Path) -> bool:
    return _described(path)[0] == tuple(dict(BOUND_BANDS))


def _first_line(path: Path) -> bytes:
    try:
        with path.open("rb") as stream:
            return stream.readline(_LONGEST_LINE_BYTES)
    except OSError as error:
        raise fail(InputError, str(path), "a readable file", error.strerror or error) from error


def _raster_info(path: Path) -> dict[str, Any]:
    rasters = open_rasters(path)
    lattice = rasters.lattice
    return {
        "kind": "rasters",
        "cells": len(rasters.cell_ids),
        "cell_ids": list(rasters.cell_ids),
        "quantity": rasters.quantity,
        "crs": lattice.crs,
        "bounds_m": list(lattice.bounds_m),
        "resolution_m": lattice.resolution_m,
        "rows": lattice.rows,
        "cols": lattice.cols,
        "bytes": sum(part.stat().st_size for part in rasters.parts),
        "notes": list(rasters.notes),
    }


def _recording_info(path: Path) -> dict[str, Any]:
    recording = read_recording(path)
    return {
        "kind": "recording",
        "format": recording.format,
        "program": recording.program,
        "clock": str(recording.clock),
        "rows": {name: len(rows) for name, rows in recording.tables.items()},
        "unused": {found.reason: found.count for found in recording.unusable},
        "notes": list(recording.notes),
        "use": "mapfilter replay --log, or mapfilter convert",
    }


def _log_info(path: Path) -> dict[str, Any]:
    log = read_log(path)
    return {
        "kind": "log",
        "crs": log.crs,
        "start_utc_s": log.start_utc_s,
        "duration_s": log.duration_s,
        "truth_length_m": log.truth_length_m,
        "rows": {name: len(getattr(log, name)) for name in TABLES},
        "notes": list(log.notes),
    }
