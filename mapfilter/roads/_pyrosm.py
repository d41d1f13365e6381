"""Reading ``.osm.pbf`` maps with pyrosm, and their faults in plain words."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyrosm
from geopandas import GeoDataFrame
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
from pyrosm.exceptions import PBFException
from pyrosm.utils import get_bounding_box
from shapely.errors import GEOSException

from mapfilter.errors import InputError, fail
from mapfilter.roads._elements import BoxDeg, Query

# Elements cut by the box and empty layers are expected here; anything else is still shown.
_EXPECTED_WARNINGS = (r".*extend beyond the bounding box", r"Could not find any")
_WHOLE_WORLD_DEG = 90.0
# What decoding trips over when numbers in a file are not what they were.
_DAMAGES = (
    PBFException, DecodeError, EOFError, OSError, ValueError, TypeError, LookupError,
    ArithmeticError, MemoryError, GEOSException,
)  # fmt: skip


def read_pbf(path: Path, box: BoxDeg | None, query: Query) -> GeoDataFrame | None:
    """Return the elements of a map that have a node in a box, in degrees; None if there are none.

    Raises
    ------
    InputError
        The map is cut off or damaged.
    """

    def read() -> Any:
        osm = pyrosm.OSM(
            str(path),
            bounding_box=list(box) if box else None,
            complete_relations=True,
            keep_metadata=False,
            progress=False,
        )
        return osm.get_data_by_custom_criteria(
            custom_filter={key: list(values) or True for key, values in query.wanted.items()},
            tags_as_columns=list(query.tags),
            keep_nodes=False,
        )

    return _guarded(path, read)


def pbf_bounds_deg(path: Path) -> BoxDeg | None:
    """Return the box in a map's header; None when there is none, or when it says nothing.

    Raises
    ------
    InputError
        The map is cut off or damaged.
    """
    header = _guarded(path, lambda: get_bounding_box(str(path)))
    if header is None:
        return None
    west, south, east, north = header.bounds
    is_telling = east - west < _WHOLE_WORLD_DEG or north - south < _WHOLE_WORLD_DEG
    return (west, south, east, north) if is_telling else None


def _guarded(path: Path, read: Callable[[], Any]) -> Any:
    try:
        with warnings.catch_warnings():
            for message in _EXPECTED_WARNINGS:
                warnings.filterwarnings("ignore", message=message, category=UserWarning)
            return read()
    except _DAMAGES as error:
        reason = str(error).split(". ")[0].strip() or type(error).__name__
        hint = "cut off, or another format under this name"
        raise fail(InputError, str(path), "a whole .osm.pbf file", reason, hint) from error
