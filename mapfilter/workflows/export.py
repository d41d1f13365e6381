"""``mapfilter export``: a radio-route database to a file that other programs open."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mapfilter.database.store import export_cog, export_geopackage, open_database
from mapfilter.errors import ConfigError, fail


def run_export(database: Path, to: Path) -> dict[str, Any]:
    """Write a database as GeoPackage, or its best server and margin as GeoTIFF.

    Raises
    ------
    MapfilterError
        The database is missing or damaged, the file's kind is unknown, or it cannot be written.
    """
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
