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
from typing import Any

import pyrosm
from geopandas import GeoDataFrame
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
from pyrosm.exceptions import PBFException
from pyrosm.utils import get_bounding_box
from shapely.errors import GEOSException

from mapfilter.errors import InputError, fail
from mapfilter.roads.elements import CUT_OFF, BoxDeg, Query, Version

# Of a larger file, the part within the box is cut out first, without reading all into memory.
_LARGEST_IN_MEMORY_BYTES = 50 << 20
# Elements cut by the box and empty layers are expected here; other warnings are shown.
_EXPECTED_WARNINGS = (r".*extend beyond the bounding box", r"Could not find any")
_WHOLE_WORLD_DEG = 90.0
# Raised in decoding where numbers in a file are damaged.
_OF_PYTHON = (EOFError, OSError, ValueError, TypeError, LookupError, ArithmeticError, MemoryError)
_DAMAGES = (*_OF_PYTHON, PBFException, DecodeError, GEOSException)
_READING = Lock()
"""One thread at a time: pyrosm decodes a kept part at its first query, and filters of warnings are
those of the process."""


def read_pbf(path: Path, version: Version, box: BoxDeg | None, query: Query) -> GeoDataFrame | None:
    """Return the elements of a map with a node in a box (degrees); None without any.

    Raises
    ------
    InputError
        The file is damaged, or no PBF.
    """
    if version.is_small:
        return _guarded(path, lambda: _chosen(_kept(path, version, box), query))
    if box is None or version.size_bytes <= _LARGEST_IN_MEMORY_BYTES:
        return _guarded(path, lambda: _chosen(_opened(path, box), query))
    with tempfile.TemporaryDirectory(prefix="mapfilter-osm-") as folder:
        part = Path(folder) / "part.osm.pbf"
        _guarded(path, lambda: _opened(path, box).to_pbf(str(part)))
        return _guarded(path, lambda: _chosen(_opened(part, box), query))


def pbf_header_deg(path: Path) -> BoxDeg | None:
    """Return the box in the header of a map; None without any, or where it is the whole world.

    Raises
    ------
    InputError
        The file is damaged, or no PBF.
    """
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
        with _READING, warnings.catch_warnings():
            for message in _EXPECTED_WARNINGS:
                warnings.filterwarnings("ignore", message=message, category=UserWarning)
            return read()
    except _DAMAGES as error:
        reason = str(error).split(". ")[0].strip() or type(error).__name__
        raise fail(InputError, str(path), "a whole .osm.pbf file", reason, CUT_OFF) from error
