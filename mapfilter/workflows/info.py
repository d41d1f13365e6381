"""``mapfilter info``: what a file or folder is, what it holds, and where to use it.

What reads logs, recordings, maps, rasters and layers is imported for each of them alone: the
imports take longer than the description.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mapfilter._inputs import open_input
from mapfilter.database.manifest import MANIFEST
from mapfilter.database.store import info, open_database
from mapfilter.errors import InputError, MapfilterError, fail
from mapfilter.radio.cell_layouts import ATOLL, COLUMNS
from mapfilter.radio.tables import read_table
from mapfilter.tracks.schema import TABLES
from mapfilter.workflows.descriptions.results import result_info

_MAPS = (".pbf", ".osm", ".osm.gz", ".osm.bz2")
_LAYERS = (".gpkg", ".shp", ".geojson", ".fgb")
_TABLES = (".csv", ".txt", ".tsv", ".cel", ".xlsx", ".xls", ".ods")
_INDEX_COLUMN = b"TX_NAME"
_LONGEST_LINE_BYTES = 1 << 16
_HEAD_BYTES = 1 << 10
_LEAST_OF_PLAN = _LEAST_OF_ANTENNAS = 2
_OF_ANTENNAS = ("height_m", "azimuth_deg", "downtilt_deg", "mechanical_downtilt_deg", "eirp_dbm")
"""Fields of which a list of antennas has two at least, and no journey."""
_OF_MODEM = b"+QENG:"
"""In replies of a modem with cells."""
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
    from mapfilter.tracks.log_folders import is_log

    if is_log(path):
        return _log_info(path)
    logs = sorted(inner for inner in path.iterdir() if is_log(inner))
    if logs:
        return {"kind": "logs", "logs": len(logs), "first": logs[0].name, "last": logs[-1].name}
    if (found := result_info(path)) is not None:
        return found
    if found := _recordings_info(_recordings_in(path), _USE_OF_FOLDERS):
        return found
    from mapfilter.workflows.descriptions.log_tables import tables_info

    if found := tables_info(path):
        return found
    inner = sorted(p.name for p in path.iterdir() if not p.name.startswith("."))
    hint = f"name one of {', '.join(inner)[:200]}" if inner else "an empty folder"
    from mapfilter.rasters.opening import is_raster_folder

    if is_raster_folder(path):
        from mapfilter.workflows.descriptions.geo import raster_info

        try:
            return raster_info(path)
        except InputError as error:
            if _is_mixed(path, error) or any((path / name).is_dir() for name in inner):
                expected = "rasters of one set, or a single thing"
                raise fail(InputError, str(path), expected, "several", hint) from error
            raise
    raise fail(InputError, str(path), f"{MANIFEST}, a log, or logs", "none", hint)


def _is_mixed(folder: Path, error: InputError) -> bool:
    """Return whether rasters of a folder do not go together, rather than share one fault."""
    kinds = {(fault.expected, fault.hint) for fault in error.faults}
    clashes = [fault for fault in error.faults if fault.where == str(folder)]
    return len(kinds) > 1 or len(clashes) > 1


def _file_info(path: Path) -> dict[str, Any]:
    name, suffix = path.name.lower(), path.suffix.lower()
    if name.endswith(_MAPS):
        from mapfilter.roads.maps import map_bounds_deg

        box = dict(zip(("west", "south", "east", "north"), map_bounds_deg(path), strict=True))
        return {"kind": "map", "bounds_deg": box, "bytes": path.stat().st_size, "use": "area.map"}
    from mapfilter.tracks.log_folders import is_log

    if is_log(path.parent):
        hint = "a part of a log; name the folder that it lies in"
        raise fail(InputError, str(path), _EXPECTED, "a file", hint)
    if (found := result_info(path)) is not None:
        return found
    if suffix == ".parquet":
        whole = (path.parent / MANIFEST).exists()
        hint = "a part of a database; name the folder that it lies in"
        of_frame = f"pandas, geopandas and QGIS open it; of a journey: {_USE_OF_RECORDINGS}"
        hint = hint if whole else of_frame
        raise fail(InputError, str(path), _EXPECTED, "a Parquet file", hint)
    if suffix in _LAYERS or (suffix == ".json" and _is_geojson(path)):
        from mapfilter.tracks.readers.formats import format_of
        from mapfilter.workflows.descriptions.geo import layers_info

        found = layers_info(path)
        journey = f"; points with times: {_USE_OF_RECORDINGS}"
        return found if format_of(path) is None else {**found, "use": f"{found['use']}{journey}"}
    if suffix == ".mat":
        use = "fingerprints: mapfilter evaluate single-reports reads those that its page names"
        return {"kind": "MATLAB file", "bytes": path.stat().st_size, "use": use}
    if suffix == ".toml":
        from mapfilter.config.load import load_config

        load_config(path, [])
        return {"kind": "configuration", "use": f"mapfilter check -c {path.name}"}
    from mapfilter.tracks.readers.contained.android_cells import is_of_cells
    from mapfilter.tracks.readers.formats import format_of
    from mapfilter.tracks.readers.texts.zipped import files_in_zip, is_zip

    # Texts of cells without times are refused with what they lack.
    begin = _beginning(path)
    if format_of(path) is not None or _OF_MODEM in begin or is_of_cells(begin):
        return _recording_info(path)
    if is_zip(path):
        from mapfilter.tracks.zipped_logs import UNPACK, is_zipped_log

        if is_zipped_log(path):
            raise fail(InputError, str(path), _EXPECTED, "a ZIP", UNPACK)
        formats = [known.name for one in files_in_zip(path) if (known := format_of(one))]
        if found := _recordings_info(formats, _USE_OF_RECORDINGS):
            return found
    if suffix in _TABLES and _INDEX_COLUMN not in _first_line(path):
        return _table_info(path)
    of_kml = begin.lstrip().startswith(b"<") and b"<kml" in begin[:_HEAD_BYTES].lower()
    if of_kml or suffix == ".kmz":
        return _kml_info(path)
    from mapfilter.workflows.descriptions.geo import raster_info, tiff_info

    if suffix in (".tif", ".tiff"):
        return tiff_info(path)
    try:
        return raster_info(path)
    except InputError as error:
        if not all("GDAL can read" in fault.expected for fault in error.faults):
            raise
        got = "a file of another kind"
        begins = _first_line(path)[:40].decode("utf-8", "replace").strip()
        hint = f"it begins with {begins!r}" if begins.isprintable() else "a binary file"
        raise fail(InputError, str(path), _EXPECTED, got, hint) from error


def _recordings_in(folder: Path) -> list[str]:
    """Return the formats of the recordings in a folder."""
    from mapfilter.tracks.open_log import list_journeys
    from mapfilter.tracks.readers.formats import format_of

    try:
        list_journeys(folder)
    except MapfilterError:
        return []
    files = (p for p in sorted(folder.iterdir()) if p.is_file() and not p.name.startswith("."))
    found = (format_of(file) for file in files)
    return [known.name for known in found if known is not None]


def _recordings_info(formats: Sequence[str], use: str) -> dict[str, Any]:
    """Describe several recordings by their formats, with their use; empty without any."""
    if not formats:
        return {}
    counts = {name: formats.count(name) for name in sorted(set(formats))}
    held = {"kind": "recordings", "files": len(formats), "formats": counts}
    return {**held, "use": use}


def _kml_info(path: Path) -> dict[str, Any]:
    from mapfilter.radio.placemarks import PLACEMARKS

    try:
        return _table_info(path)
    except InputError as error:
        if all(fault.expected != PLACEMARKS for fault in error.faults):
            raise
        hint = (
            "export the places of cells as CSV, and a journey with its times (gx:Track) or as GPX"
        )
        raise fail(InputError, str(path), _EXPECTED, "KML without times", hint) from error


def _table_info(path: Path) -> dict[str, Any]:
    """Describe a table: a cell plan, or one of which nothing is known but its columns."""
    table = read_table(path, "a table")
    header = [name.strip() for name in table.header]
    lower = {name.casefold() for name in header}
    held = {"columns": ", ".join(header), "rows": len(table.rows)}
    tool = _is_of_tool(header)
    if tool or len((lower & _PLAN) - _PLACES) >= _LEAST_OF_PLAN:
        use = 'cells.plan, with cells.layout = "atoll"' if tool else "cells.plan"
        return {"kind": "cell plan", **held, "use": use}
    use = "with a time in each row: mapfilter convert --column; fingerprints: mapfilter locate --db"
    return {"kind": "table", **held, "use": use}


def _is_of_tool(header: Sequence[str]) -> bool:
    """Return whether columns are those of antennas in the list of a planning tool."""
    from mapfilter.radio.arrange_cells import recognised
    from mapfilter.radio.cell_layouts import LAYOUTS

    known, own = LAYOUTS["atoll"], LAYOUTS["plan"]
    antennas = {name: known[name] for name in _OF_ANTENNAS}
    found, by_own = recognised(header, known), recognised(header, own)
    places = recognised(header, {name: known[name] for name in ("lat", "east")})
    several = len(recognised(header, antennas)) >= _LEAST_OF_ANTENNAS and bool(places)
    return several and len(set(found) - set(by_own)) >= _LEAST_OF_PLAN


def _is_geojson(path: Path) -> bool:
    return b'"FeatureCollection"' in _beginning(path)


def _first_line(path: Path) -> bytes:
    return _beginning(path).split(b"\n", 1)[0]


def _beginning(path: Path) -> bytes:
    with open_input(path) as stream:
        return stream.read(_LONGEST_LINE_BYTES)


def _recording_info(path: Path) -> dict[str, Any]:
    from mapfilter.tracks.readers.formats import read_recording

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
    from mapfilter.tracks.store import read_log

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
