"""Route lattices on disk: one GeoParquet file that geopandas, QGIS and DuckDB open as it is."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from mapfilter._io import atomic_file, check_version
from mapfilter.errors import MapfilterError, StoreError, fail
from mapfilter.geodesy import Lattice
from mapfilter.roads.geoparquet import dictionary, geo_metadata, point_geometry
from mapfilter.roads.lattice import RouteLattice

FORMAT = "mapfilter route lattice"
VERSION = 1
_KEY = b"mapfilter"


def write_route_lattice(routes: RouteLattice, path: Path) -> None:
    """Write a route lattice as GeoParquet.

    Columns: point (``row * cols + col``), row, col, way_id, way_class, on_square,
    distance_to_way_m, geometry.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    east, north = routes.east_north_m
    table = pa.table(
        {
            "point": routes.point,
            "row": routes.row,
            "col": routes.col,
            "way_id": routes.way_id,
            "way_class": dictionary(routes.way_class, routes.class_names),
            "on_square": routes.on_square,
            "distance_to_way_m": routes.distance_to_way_m,
            "geometry": point_geometry(east, north),
        }
    )
    header = {
        "format": FORMAT,
        "version": VERSION,
        "points": len(routes),
        "lattice": asdict(routes.lattice),
        "class_names": list(routes.class_names),
    }
    bounds = (east.min(), north.min(), east.max(), north.max()) if len(routes) else None
    metadata = {_KEY: json.dumps(header).encode(), b"geo": geo_metadata(routes.lattice.crs, bounds)}
    with atomic_file(path) as temporary:
        pq.write_table(table.replace_schema_metadata(metadata), temporary, compression="zstd")


def read_route_lattice(path: Path) -> RouteLattice:
    """Read a route lattice that :func:`write_route_lattice` wrote.

    Raises
    ------
    StoreError
        The file is missing, cut off, of a newer version or no route lattice.
    """
    try:
        table = pq.read_table(path)
        header = json.loads((table.schema.metadata or {}).get(_KEY, b"{}"))
    except (OSError, pa.ArrowException, ValueError) as error:
        found = "no such file" if not path.is_file() else str(error).splitlines()[0]
        raise fail(StoreError, str(path), "a whole Parquet file", found, "cut off") from error
    _check_header(path, header, table.num_rows)
    names = tuple(str(name) for name in header["class_names"])
    codes = {name: code for code, name in enumerate(names)}
    try:
        words = table["way_class"].combine_chunks().dictionary_decode().to_pylist()
        return RouteLattice(
            Lattice(**header["lattice"]),
            table["row"].to_numpy(),
            table["col"].to_numpy(),
            table["way_id"].to_numpy(),
            np.array([codes[word] for word in words], dtype=np.int16),
            names,
            table["distance_to_way_m"].to_numpy(),
            table["on_square"].to_numpy(),
        )
    except (KeyError, TypeError, AttributeError, pa.ArrowException, MapfilterError) as error:
        raise fail(StoreError, str(path), "the columns of a route lattice", error) from error


def _check_header(path: Path, header: Any, rows: int) -> None:
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise fail(StoreError, str(path), f"a {FORMAT}", "another Parquet file")
    check_version(str(path), header.get("version"), VERSION)
    if header["points"] != rows:
        raise fail(StoreError, str(path), f"{header['points']} points", rows, "cut off")
