"""Elements of OpenStreetMap PBF files, by pyrosm.

Commands read a few kinds of elements of one part of a map, and decoding takes longer than choosing
them: the last part of a small file that was decoded is kept.
"""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from threading import Lock
from typing import Any, NamedTuple

import pyrosm
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
from pyrosm.exceptions import PBFException
from pyrosm.utils import get_bounding_box
from shapely.errors import GEOSException

from mapfilter.errors import InputError, fail
from mapfilter.roads.elements import BoxDeg, Query

# Of a larger file, the part within the box is cut out first, without reading all into memory.
_LARGEST_IN_MEMORY_BYTES = 50 << 20
LARGEST_KEPT_BYTES = 4 << 20
# Elements cut by the box and empty layers are expected here; other warnings are shown.
_EXPECTED_WARNINGS = (r".*extend beyond the bounding box", r"Could not find any")
_WHOLE_WORLD_DEG = 90.0
_CUT_OFF = "cut off, or another format under this name"
# Raised in decoding where numbers in a file are damaged.
_OF_PYTHON = (EOFError, OSError, ValueError, TypeError, LookupError, ArithmeticError, MemoryError)
_DAMAGES = (*_OF_PYTHON, PBFException, DecodeError, GEOSException)
_READING = Lock()
"""What is decoded is completed as it is read, by one thread at a time."""


class Version(NamedTuple):
    """What changes when a file is written or replaced."""

    size_bytes: int
    written_ns: int
    changed_ns: int
    device: int
    inode: int

    @classmethod
    def of(cls, path: Path) -> Version:
        """Return the version of a file."""
        file = path.stat()
        of_disk = file.st_dev, file.st_ino
        return cls(file.st_size, file.st_mtime_ns, file.st_ctime_ns, *of_disk)


def read_pbf(path: Path, version: Version, box: BoxDeg | None, query: Query) -> Any:
    """Return the elements of a map with a node in a box; None without any."""

    def read() -> Any:
        if version.size_bytes <= LARGEST_KEPT_BYTES:
            return _chosen(_kept(path, version, box), query)
        if box is None or version.size_bytes <= _LARGEST_IN_MEMORY_BYTES:
            return _chosen(_opened(path, box), query)
        with tempfile.TemporaryDirectory(prefix="mapfilter-osm-") as folder:
            part = Path(folder) / "part.osm.pbf"
            _opened(path, box).to_pbf(str(part))
            return _chosen(_opened(part, box), query)

    with _READING:
        return _guarded(path, read)


def pbf_header_deg(path: Path) -> BoxDeg | None:
    """Return the box in the header of a map; None without any, or where it is the whole world."""
    header = _guarded(path, lambda: get_bounding_box(str(path)))
    if header is None:
        return None
    west, south, east, north = header.bounds
    is_part = east - west < _WHOLE_WORLD_DEG or north - south < _WHOLE_WORLD_DEG
    return (west, south, east, north) if is_part else None


@lru_cache(1)
def _kept(path: Path, version: Version, box: BoxDeg | None) -> pyrosm.OSM:  # noqa: ARG001
    return _opened(path, box)


def _opened(path: Path, box: BoxDeg | None) -> pyrosm.OSM:
    # The other engine keeps what it read in a folder that all users share, and reads it there.
    return pyrosm.OSM(
        str(path),
        bounding_box=list(box) if box else None,
        complete_relations=True,
        keep_metadata=False,
        engine="in_memory",
        progress=False,
    )


def _chosen(osm: pyrosm.OSM, query: Query) -> Any:
    return osm.get_data_by_custom_criteria(
        custom_filter={key: list(values) or True for key, values in query.wanted.items()},
        tags_as_columns=list(query.tags),
        keep_nodes=False,
    )


def _guarded(path: Path, read: Callable[[], Any]) -> Any:
    try:
        with warnings.catch_warnings():
            for message in _EXPECTED_WARNINGS:
                warnings.filterwarnings("ignore", message=message, category=UserWarning)
            return read()
    except _DAMAGES as error:
        reason = str(error).split(". ")[0].strip() or type(error).__name__
        raise fail(InputError, str(path), "a whole .osm.pbf file", reason, _CUT_OFF) from error
