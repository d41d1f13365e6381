"""Telling exported files from those of other programs, which are not replaced."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

from rasterio.errors import RasterioError

from mapfilter._gdal import open_raster
from mapfilter._io import check_replaceable
from mapfilter.errors import InputError

BANDS = (("best_server", ""), ("best_level_dbm", "dBm"), ("margin_db", "dB"))
CELLS_TAG = "CELLS"
WRITTEN = "2000-01-01T00:00:00.000Z"
"""GeoPackages hold when each layer was changed; a fixed time gives equal bytes for equal layers."""


def check_export_replaceable(path: Path) -> None:
    """Check that a path holds nothing yet, or an older export that nobody changed.

    Raises
    ------
    OutputError
        There is a folder, a file of another program, or a GeoPackage that was edited.
    """
    own = _is_own_raster if path.suffix.lower() in (".tif", ".tiff") else _is_own_geopackage
    check_replaceable(path, own, "an older export")


def _is_own_raster(path: Path) -> bool:
    try:
        with open_raster(path) as source:
            names = tuple(source.descriptions)
            return CELLS_TAG in source.tags() and names == tuple(name for name, _ in BANDS)
    except (RasterioError, InputError):
        return False


def _is_own_geopackage(path: Path) -> bool:
    """Return whether all layers have the time of an export: whoever edits one sets another."""
    try:
        uri = f"{path.absolute().as_uri()}?mode=ro&immutable=1"
        with closing(sqlite3.connect(uri, uri=True)) as connection:
            found = connection.execute("SELECT last_change FROM gpkg_contents").fetchall()
    except sqlite3.Error:
        return False
    return bool(found) and all(time == WRITTEN for (time,) in found)
