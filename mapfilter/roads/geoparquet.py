"""GeoParquet tables of lattice points, with the same bytes whenever the points are the same."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from pyproj import CRS

from mapfilter._types import Floats

_WKB_POINT = np.dtype([("order", "u1"), ("kind", "<u4"), ("east", "<f8"), ("north", "<f8")])


def point_geometry(east_m: Floats, north_m: Floats) -> pa.Array:
    """Return points as well-known binary, shape (N,).

    Examples
    --------
    >>> import shapely
    >>> shapely.from_wkb(point_geometry(np.array([3.0]), np.array([4.0]))[0].as_py())
    <POINT (3 4)>
    """
    points = np.empty(east_m.size, dtype=_WKB_POINT)
    points["order"], points["kind"] = 1, 1
    points["east"], points["north"] = east_m, north_m
    offsets = np.arange(east_m.size + 1, dtype=np.int32) * np.int32(_WKB_POINT.itemsize)
    buffers = [None, pa.py_buffer(offsets.tobytes()), pa.py_buffer(points.tobytes())]
    return pa.Array.from_buffers(pa.binary(), east_m.size, buffers)


def point_coordinates(geometry: pa.Array) -> Floats:
    """Return east and north of points that :func:`point_geometry` made, shape (N, 2).

    Examples
    --------
    >>> point_coordinates(point_geometry(np.array([3.0, 5.0]), np.array([4.0, 6.0]))).tolist()
    [[3.0, 4.0], [5.0, 6.0]]
    """
    # Offsets into the bytes tell where a slice of a longer array begins.
    _, offsets, data = geometry.buffers()
    first = np.frombuffer(offsets, np.int32)[geometry.offset] if len(geometry) else 0
    points = np.frombuffer(data, _WKB_POINT, len(geometry), int(first))
    return np.column_stack((points["east"], points["north"]))


def geo_metadata(crs: str, bounds_m: tuple[float, float, float, float] | None) -> bytes:
    """Return the value of the GeoParquet 1.1 key ``geo`` for a ``geometry`` column of points."""
    column: dict[str, Any] = {
        "encoding": "WKB",
        "geometry_types": ["Point"],
        "crs": CRS.from_user_input(crs).to_json_dict(),
    }
    if bounds_m is not None:
        column["bbox"] = list(bounds_m)
    geo = {"version": "1.1.0", "primary_column": "geometry", "columns": {"geometry": column}}
    return json.dumps(geo).encode()


def dictionary(codes: NDArray[Any], names: tuple[str, ...]) -> pa.Array:
    """Return codes into names as a dictionary-encoded column of text."""
    return pa.DictionaryArray.from_arrays(
        pa.array(np.asarray(codes, dtype=np.int32)), pa.array(names, type=pa.string())
    )
