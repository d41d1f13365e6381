"""``mapfilter export``: a radio-route database to a file that other programs open."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mapfilter.database.store import export_geopackage, open_database
from mapfilter.errors import ConfigError, fail


def run_export(database: Path, to: Path) -> dict[str, Any]:
    """Write a database as GeoPackage.

    Raises
    ------
    MapfilterError
        The database is missing or damaged, the file's kind is unknown, or it cannot be written.
    """
    if to.suffix.lower() != ".gpkg":
        raise fail(ConfigError, f"--to {to}", "a name that ends in .gpkg", to.suffix or "no suffix")
    opened = open_database(database, verify="full")
    export_geopackage(opened, to)
    return {"points": len(opened.points()), "cells": len(opened.cell_ids), "file": to}
