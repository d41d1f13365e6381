"""ZIPs of track logs, which are read as folders only."""

from __future__ import annotations

from pathlib import Path

from mapfilter.errors import MapfilterError
from mapfilter.tracks.log_folders import HEAD
from mapfilter.tracks.readers.texts.zipped import files_in_zip, is_zip
from mapfilter.tracks.schema import TABLES

UNPACK = "a ZIP of a track log; unpack it, and name its folder"


def is_zipped_log(path: Path) -> bool:
    """Return whether a path is a ZIP of a track log: its head, and at least one of its tables."""
    if not (path.is_file() and is_zip(path)):
        return False
    try:
        names = files_in_zip(path)
    except MapfilterError:
        return False
    tables = {name.stem for name in names if name.suffix in (".csv", ".parquet")}
    return any(name.name == HEAD for name in names) and not tables.isdisjoint(TABLES)
