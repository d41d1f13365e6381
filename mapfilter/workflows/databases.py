"""``mapfilter merge``: radio-route databases to one."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mapfilter._io import ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter.database.merge import merge
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, fail


@dataclass(frozen=True)
class MergeResult:
    """What was merged.

    Parameters
    ----------
    points, cells : int
        Of the new database.
    database : Path
    seconds : float
        Wall time.
    """

    points: int
    cells: int
    database: Path
    seconds: float


def run_merge(
    databases: Sequence[Path],
    out: Path,
    *,
    without: Sequence[str] = (),
    progress: Progress | None = None,
) -> MergeResult:
    """Merge databases; within its area the word of a later one on its own cells counts.

    Raises
    ------
    MapfilterError
        A database is missing or damaged, they do not fit each other, or the output cannot be
        written.
    """
    began_s = time.perf_counter()
    opened = [open_database(path, verify="full") for path in databases]
    ensure_writable_folder(out.parent)
    merged = merge(opened, out, without=without, progress=progress)
    points = int(merged.manifest["counts"]["points"])
    return MergeResult(points, len(merged.cell_ids), out, time.perf_counter() - began_s)


def run_export(database: Path, to: Path) -> dict[str, Any]:
    """Write a database as GeoPackage, or its best server and margin as GeoTIFF.

    Raises
    ------
    MapfilterError
        The database is missing or damaged, the file's kind is unknown, or it cannot be written.
    """
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
