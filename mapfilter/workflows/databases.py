"""``mapfilter merge`` and ``export``: databases merged and exported."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mapfilter._io import ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter._partial import nothing_left
from mapfilter.database.merge import merge
from mapfilter.database.merge_notes import merge_notes
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, fail
from mapfilter.workflows.inputs.apart import check_in_no_store, check_out_apart


def run_merge(
    databases: Sequence[Path],
    out: Path,
    *,
    without: Sequence[str] = (),
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Merge databases; within its area a later one overrides earlier ones in its own cells.

    Raises
    ------
    MapfilterError
        The databases do not fit, cannot be read, or the merged one would replace one of them.
    """
    began_s = time.perf_counter()
    check_out_apart(out, databases)
    opened = [open_database(path, verify="full") for path in databases]
    with nothing_left(out.parent):
        ensure_writable_folder(out.parent)
        merged = merge(opened, out, without=without, progress=progress)
    points = int(merged.manifest["counts"]["points"])
    seconds = time.perf_counter() - began_s
    found = {"points": points, "cells": len(merged.cell_ids), "database": out, "seconds": seconds}
    return {**found, "notes": merge_notes(opened)}


def run_export(database: Path, to: Path) -> dict[str, Any]:
    """Write a database as GeoPackage, or its best server and margin as GeoTIFF."""
    from mapfilter.database.export import export_cog, export_geopackage

    kind = to.suffix.lower()
    if kind not in (".gpkg", ".tif", ".tiff"):
        expected = "a name that ends in .gpkg or .tif"
        raise fail(ConfigError, f"--to {to}", expected, to.suffix or "no suffix")
    check_out_apart(to, [database], "--to")
    check_in_no_store(to, "--to")
    opened = open_database(database, verify="full")
    if kind == ".gpkg":
        export_geopackage(opened, to)
    else:
        export_cog(opened, to)
    points = opened.manifest["counts"]["points"]
    return {"points": points, "cells": len(opened.cell_ids), "file": to}
