"""Kinds of files that ``mapfilter info`` describes by GDAL: rasters, and layers of vectors.

The libraries that read them take a quarter of a second to import, so that other kinds do without.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
from rasterio.errors import RasterioError

from mapfilter._gdal import open_raster
from mapfilter._ogr import VectorSource, sealed_gdal, vector_source
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import short_crs
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import RxLevRasters

_MOST_VALUES = 20
_SAMPLED_PX = 4_000_000
_ANY: dict[str, Any] = {"crs": "EPSG:3857", "quantity": "level"}
_UNSTATED = ((), ("quantity",), ("crs",), ("crs", "quantity"))
"""Options that the files of a set may not state, the fewest first."""


def layers_info(path: Path) -> dict[str, Any]:
    """Describe the layers of a vector file."""
    place = vector_source(path)
    try:
        with sealed_gdal(), warnings.catch_warnings():
            # GDAL warns of much that it copes with.
            warnings.simplefilter("ignore", RuntimeWarning)
            layers = [
                _layer_info(place, layer, kind) for layer, kind in pyogrio.list_layers(place.path)
            ]
    except (RuntimeError, OSError, ValueError, UnboundLocalError) as error:
        raise fail(InputError, str(path), "a layer that GDAL can read", str(error)) from error
    return {"kind": "layers", "layers": layers, "use": "roads.layer, or QGIS and geopandas"}


def _layer_info(place: VectorSource, layer: str, kind: str | None) -> dict[str, Any]:
    about = pyogrio.read_info(place.path, layer=layer, force_feature_count=True, **place.options)
    return {
        "layer": str(layer),
        "geometry": str(kind or "none"),
        "features": int(about["features"]),
        "crs": str(about["crs"] or ""),
        "columns": ", ".join(map(str, about["fields"])),
    }


def tiff_info(path: Path) -> dict[str, Any]:
    """Describe a GeoTIFF: levels or losses, what mapfilter wrote, or any other."""
    # Here, as the second one imports numba.
    from mapfilter.database.exported import BANDS, CELLS_TAG
    from mapfilter.evaluation.map_bound import BANDS as BOUND_BANDS

    names, tags = _described(path)
    if names == tuple(dict(BANDS)) and CELLS_TAG in tags:
        use = "written by mapfilter export; QGIS and rasterio open it"
        return {"kind": "best servers", **_geotiff_info(path), "use": use}
    if names == tuple(dict(BOUND_BANDS)):
        use = "written by mapfilter bound; QGIS and rasterio open it"
        return {"kind": "bound", **_geotiff_info(path), "use": use}
    if not _is_classes(path):
        return raster_info(path)
    found = _geotiff_info(path)
    values = _values_of(path)
    more = {"values": values} if values else {}
    use = "a map of roads: roads.raster, with roads.raster_classes; land use: roads.landuse"
    return {"kind": "classes", **found, **more, "use": use}


def _described(path: Path) -> tuple[tuple[str | None, ...], Collection[str]]:
    """Return the descriptions of a raster's bands, and the names of its tags."""
    try:
        # A file that is cut off may have lost its place; its own reader reports that.
        with open_raster(path) as source:
            return source.descriptions, source.tags().keys()
    except RasterioError:
        return (), ()


def _is_classes(path: Path) -> bool:
    """Return whether a raster is a single band of bytes without the tags of levels."""
    try:
        with open_raster(path) as source:
            is_plain = "quantity" not in {name.casefold() for name in source.tags()}
            return bool(source.count == 1 and source.dtypes[0] == "uint8" and is_plain)
    except RasterioError:
        return False


def _geotiff_info(path: Path) -> dict[str, Any]:
    with open_raster(path, quiet=False) as source:
        unit = "deg" if source.crs and source.crs.is_geographic else "m"
        found = {
            "crs": short_crs(str(source.crs)) if source.crs else "none",
            f"bounds_{unit}": [float(edge) for edge in source.bounds],
            f"resolution_{unit}": float(source.res[0]),
            "rows": source.height,
            "cols": source.width,
        }
        names = [name for name in source.descriptions if name]
        return found | ({"bands": names} if names else {})


def _values_of(path: Path) -> list[int]:
    """Return the values of a raster of few classes, without that of no data.

    Of a large one they are those of a thinned copy.
    """
    with open_raster(path, quiet=False) as source:
        thin = max(1, int(np.ceil((source.height * source.width / _SAMPLED_PX) ** 0.5)))
        shape = (max(1, source.height // thin), max(1, source.width // thin))
        values = np.unique(source.read(1, out_shape=shape, masked=True).compressed())
    return [int(value) for value in values] if values.size <= _MOST_VALUES else []


def raster_info(path: Path) -> dict[str, Any]:
    """Describe a set of rasters of levels or losses; CRS and quantity are "none" where unstated."""
    rasters, unstated = _open_as_stated(path)
    lattice = rasters.lattice
    keys = " and ".join(f"rasters.{name}" for name in unstated)
    use = {"use": f"rasters.path, with {keys}, which the files do not state"} if keys else {}
    return {
        "kind": "rasters",
        "cells": len(rasters.cell_ids),
        "cell_ids": list(rasters.cell_ids),
        "quantity": "none" if "quantity" in unstated else rasters.quantity,
        "crs": "none" if "crs" in unstated else lattice.crs,
        "bounds_m": list(lattice.bounds_m),
        "resolution_m": lattice.resolution_m,
        "rows": lattice.rows,
        "cols": lattice.cols,
        "bytes": sum(part.stat().st_size for part in rasters.parts),
        "notes": list(rasters.notes),
        **use,
    }


def _open_as_stated(path: Path) -> tuple[RxLevRasters, tuple[str, ...]]:
    """Open a set of rasters, and return it with the options that its files do not state.

    Any value of these opens the set then; what is wrong beyond them is an error as ever.
    """
    faults = InputError(())
    for unstated in _UNSTATED:
        given = {name: _ANY[name] for name in unstated}
        try:
            return open_rasters(path, **given), unstated
        except InputError as error:
            # Where a value itself is in the way, as degrees are, it is none of the user's.
            made_up = any(value in f.expected for value in given.values() for f in error.faults)
            faults = faults if made_up else error
    raise faults
