"""``mapfilter info``: what a file or folder is, what it holds, and where to use it."""

from __future__ import annotations

import warnings
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
from rasterio.errors import RasterioError

from mapfilter._gdal import open_raster
from mapfilter._inputs import open_input
from mapfilter._ogr import VectorSource, sealed_gdal, vector_source
from mapfilter.database.manifest import MANIFEST
from mapfilter.database.store import info, open_database
from mapfilter.errors import InputError, MapfilterError, fail
from mapfilter.geodesy import short_crs
from mapfilter.radio.cell_layouts import ATOLL, COLUMNS
from mapfilter.radio.tables import read_table
from mapfilter.rasters.opening import is_raster_folder, open_rasters
from mapfilter.roads.maps import map_bounds_deg
from mapfilter.tracks.open_log import list_journeys
from mapfilter.tracks.readers.formats import format_of, read_recording
from mapfilter.tracks.schema import TABLES
from mapfilter.tracks.store import is_log, read_log
from mapfilter.workflows.info_results import result_info

_MAPS = (".pbf", ".osm", ".osm.gz", ".osm.bz2")
_LAYERS = (".gpkg", ".shp", ".geojson", ".fgb")
_TABLES = (".csv", ".txt", ".tsv", ".xlsx", ".xls", ".ods")
_INDEX_COLUMN = b"TX_NAME"
_LONGEST_LINE_BYTES = 1 << 16
_MOST_VALUES = 20
_SAMPLED_PX = 4_000_000
_LEAST_OF_PLAN = 2
_PLACES = {"lat", "lon", "latitude", "longitude", "x", "y", "east", "north", "mcc", "mnc"}
_PLAN = {name.casefold() for name in (*COLUMNS, *(n for names in ATOLL.values() for n in names))}
_EXPECTED = "a database, raster, log, recording, map, layer, table or result"
_USE_OF: dict[str, str] = {
    "rinex-nav": "name it beside a recording of pseudoranges: mapfilter convert REC NAV --out LOG",
    "opencellid-cells": 'cells.plan, with cells.layout = "opencellid"',
}
_USE_OF_RECORDINGS = "mapfilter replay --log, or mapfilter convert"
_USE_OF_FOLDERS = (
    "of one journey: mapfilter convert; of several: fingerprints (mapfilter locate --db) or a "
    "survey (prediction.survey.files)"
)


def run_info(path: Path) -> dict[str, Any]:
    """Describe the file or folder at a path, ready for JSON; compare a database's checksums.

    Raises
    ------
    MapfilterError
        There is nothing, the file is damaged, or it is of no kind that mapfilter reads.
    """
    if not path.exists():
        raise fail(InputError, str(path), "a database, raster file or log", "nothing there")
    if path.is_file():
        return _file_info(path)
    if not path.is_dir():
        raise fail(InputError, str(path), "a file or folder", "a device or pipe")
    if (path / MANIFEST).exists():
        return {"kind": "database", **info(open_database(path, verify="full"))}
    if is_log(path):
        return _log_info(path)
    logs = sorted(inner for inner in path.iterdir() if is_log(inner))
    if logs:
        return {"kind": "logs", "logs": len(logs), "first": logs[0].name, "last": logs[-1].name}
    if (found := result_info(path)) is not None:
        return found
    recordings = _recordings_in(path)
    if recordings:
        counts = {name: recordings.count(name) for name in sorted(set(recordings))}
        held = {"kind": "recordings", "files": len(recordings), "formats": counts}
        return {**held, "use": _USE_OF_FOLDERS}
    inner = sorted(p.name for p in path.iterdir() if not p.name.startswith("."))
    hint = f"name one of {', '.join(inner)[:200]}" if inner else "an empty folder"
    if is_raster_folder(path):
        try:
            return _raster_info(path)
        except InputError as error:
            if len(error.faults) > 1 or any((path / name).is_dir() for name in inner):
                expected = "rasters of one set, or a single thing"
                raise fail(InputError, str(path), expected, "several", hint) from error
            raise
    raise fail(InputError, str(path), f"{MANIFEST}, a log, or logs", "none", hint)


def _file_info(path: Path) -> dict[str, Any]:
    name, suffix = path.name.lower(), path.suffix.lower()
    if name.endswith(_MAPS):
        box = dict(zip(("west", "south", "east", "north"), map_bounds_deg(path), strict=True))
        return {"kind": "map", "bounds_deg": box, "bytes": path.stat().st_size, "use": "area.map"}
    if is_log(path.parent):
        hint = "a part of a log; name the folder that it lies in"
        raise fail(InputError, str(path), _EXPECTED, "a file", hint)
    if (found := result_info(path)) is not None:
        return found
    if suffix == ".parquet":
        whole = (path.parent / MANIFEST).exists()
        hint = "a part of a database; name the folder that it lies in"
        hint = hint if whole else "pandas, geopandas and QGIS open it"
        raise fail(InputError, str(path), _EXPECTED, "a Parquet file", hint)
    if suffix in _LAYERS or (suffix == ".json" and _is_geojson(path)):
        return _layers_info(path)
    if suffix == ".mat":
        use = "fingerprints: mapfilter evaluate single-reports reads those that its page names"
        return {"kind": "MATLAB file", "bytes": path.stat().st_size, "use": use}
    if suffix == ".toml":
        # Of what has another kind no filter is imported, which takes longer than to describe it.
        from mapfilter.config.load import load_config

        load_config(path, [])
        return {"kind": "configuration", "use": f"mapfilter check -c {path.name}"}
    if format_of(path) is not None:
        return _recording_info(path)
    if suffix in _TABLES and _INDEX_COLUMN not in _first_line(path):
        return _table_info(path)
    if suffix in (".tif", ".tiff"):
        return _tiff_info(path)
    try:
        return _raster_info(path)
    except InputError as error:
        if not all("GDAL can read" in fault.expected for fault in error.faults):
            raise
        got = "a file of another kind"
        begins = _first_line(path)[:40].decode("utf-8", "replace").strip()
        hint = f"it begins with {begins!r}" if begins.isprintable() else "a binary file"
        raise fail(InputError, str(path), _EXPECTED, got, hint) from error


def _recordings_in(folder: Path) -> list[str]:
    """Return the formats of the recordings in a folder."""
    try:
        list_journeys(folder)
    except MapfilterError:
        return []
    files = (p for p in sorted(folder.iterdir()) if p.is_file() and not p.name.startswith("."))
    found = (format_of(file) for file in files)
    return [known.name for known in found if known is not None]


def _layers_info(path: Path) -> dict[str, Any]:
    """Describe the layers of a vector file."""
    place = vector_source(path)
    try:
        with sealed_gdal(), warnings.catch_warnings():
            # GDAL warns of much that it copes with.
            warnings.simplefilter("ignore", RuntimeWarning)
            layers = [
                _layer_info(place, layer, kind) for layer, kind in pyogrio.list_layers(place.path)
            ]
    except (RuntimeError, OSError, ValueError, UnboundLocalError) as error:
        raise fail(InputError, str(path), "a layer that GDAL can read", str(error)) from error
    return {"kind": "layers", "layers": layers, "use": "roads.layer, or QGIS and geopandas"}


def _layer_info(place: VectorSource, layer: str, kind: str | None) -> dict[str, Any]:
    about = pyogrio.read_info(place.path, layer=layer, force_feature_count=True, **place.options)
    return {
        "layer": str(layer),
        "geometry": str(kind or "none"),
        "features": int(about["features"]),
        "crs": str(about["crs"] or ""),
        "columns": ", ".join(map(str, about["fields"])),
    }


def _table_info(path: Path) -> dict[str, Any]:
    """Describe a table: a cell plan, or one of which nothing is known but its columns."""
    table = read_table(path, "a table")
    header = [name.strip() for name in table.header]
    lower = {name.casefold() for name in header}
    held = {"columns": ", ".join(header), "rows": len(table.rows)}
    if len((lower & _PLAN) - _PLACES) >= _LEAST_OF_PLAN:
        return {"kind": "cell plan", **held, "use": "cells.plan"}
    use = "with a time in each row: mapfilter convert --column; fingerprints: mapfilter locate --db"
    return {"kind": "table", **held, "use": use}


def _tiff_info(path: Path) -> dict[str, Any]:
    """Describe a GeoTIFF: levels or losses, what mapfilter wrote, or any other."""
    from mapfilter.database.export import BANDS, CELLS_TAG
    from mapfilter.evaluation.map_bound import BANDS as BOUND_BANDS

    names, tags = _described(path)
    if names == tuple(dict(BANDS)) and CELLS_TAG in tags:
        use = "written by mapfilter export; QGIS and rasterio open it"
        return {"kind": "best servers", **_geotiff_info(path), "use": use}
    if names == tuple(dict(BOUND_BANDS)):
        use = "written by mapfilter bound; QGIS and rasterio open it"
        return {"kind": "bound", **_geotiff_info(path), "use": use}
    if not _is_classes(path):
        return _raster_info(path)
    found = _geotiff_info(path)
    values = _values_of(path)
    more = {"values": values} if values else {}
    use = "a map of roads: roads.raster, with roads.raster_classes; land use: roads.landuse"
    return {"kind": "classes", **found, **more, "use": use}


def _described(path: Path) -> tuple[tuple[str | None, ...], Collection[str]]:
    """Return the descriptions of a raster's bands, and the names of its tags."""
    try:
        # A file that is cut off may have lost its place; its own reader reports that.
        with open_raster(path) as source:
            return source.descriptions, source.tags().keys()
    except RasterioError:
        return (), ()


def _is_classes(path: Path) -> bool:
    """Return whether a raster is a single band of bytes without the tags of levels."""
    try:
        with open_raster(path) as source:
            is_plain = "quantity" not in {name.casefold() for name in source.tags()}
            return bool(source.count == 1 and source.dtypes[0] == "uint8" and is_plain)
    except RasterioError:
        return False


def _geotiff_info(path: Path) -> dict[str, Any]:
    with open_raster(path, quiet=False) as source:
        unit = "deg" if source.crs and source.crs.is_geographic else "m"
        found = {
            "crs": short_crs(str(source.crs)) if source.crs else "none",
            f"bounds_{unit}": [float(edge) for edge in source.bounds],
            f"resolution_{unit}": float(source.res[0]),
            "rows": source.height,
            "cols": source.width,
        }
        names = [name for name in source.descriptions if name]
        return found | ({"bands": names} if names else {})


def _values_of(path: Path) -> list[int]:
    """Return the values of a raster of few classes, without that of no data.

    Of a large one they are those of a thinned copy.
    """
    with open_raster(path, quiet=False) as source:
        thin = max(1, int(np.ceil((source.height * source.width / _SAMPLED_PX) ** 0.5)))
        shape = (max(1, source.height // thin), max(1, source.width // thin))
        values = np.unique(source.read(1, out_shape=shape, masked=True).compressed())
    return [int(value) for value in values] if values.size <= _MOST_VALUES else []


def _is_geojson(path: Path) -> bool:
    return b'"FeatureCollection"' in _beginning(path)


def _first_line(path: Path) -> bytes:
    return _beginning(path).split(b"\n", 1)[0]


def _beginning(path: Path) -> bytes:
    with open_input(path) as stream:
        return stream.read(_LONGEST_LINE_BYTES)


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
        "use": _USE_OF.get(recording.format, _USE_OF_RECORDINGS),
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
