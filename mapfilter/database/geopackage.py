"""A radio-route database as GeoPackage, for QGIS and its like."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path

import geopandas as gpd
import pandas as pd
import pyogrio
from pyogrio.errors import DataLayerError, DataSourceError, FeatureError, GeometryError

from mapfilter._io import atomic_file
from mapfilter.database.columns import read_columns
from mapfilter.database.manifest import POINTS, apart
from mapfilter.database.radioroutes import Points, RadioRouteDatabase
from mapfilter.errors import OutputError, fail

# GeoPackages hold the time of writing; a fixed one gives equal bytes for equal databases.
_WRITE_ERRORS = (DataSourceError, DataLayerError, FeatureError, GeometryError)
_WRITTEN = "2000-01-01T00:00:00.000Z"


def write_geopackage(database: RadioRouteDatabase, path: Path, cells: Sequence[str]) -> None:
    """Write a database; see :func:`mapfilter.database.store.export_geopackage`."""
    if path.suffix.lower() != ".gpkg":
        raise fail(OutputError, str(path), "a name that ends in .gpkg", path.suffix or "no suffix")
    crs = database.lattice.crs
    layers = {"points": _points(database), "cells": _cells(database)}
    # Layers of a GeoPackage are tables, whose names SQLite does not tell apart by case.
    names = apart({cell_id: f"cell {cell_id}" for cell_id in cells})
    for cell_id, name in names.items():
        row, col, level_dbm = database.cell_points(cell_id)
        east, north = database.lattice.east_north(row, col)
        columns = {"row": row, "col": col, "level_dbm": level_dbm}
        place = gpd.points_from_xy(east, north)
        layers[name] = gpd.GeoDataFrame(columns, geometry=place, crs=crs)
    with atomic_file(path) as temporary, _fixed_date():
        try:
            for name, layer in layers.items():
                pyogrio.write_dataframe(layer, temporary, layer=name, driver="GPKG")
        except _WRITE_ERRORS as error:
            raise fail(OutputError, str(path), "a place that can be written", error) from error


def _points(database: RadioRouteDatabase) -> gpd.GeoDataFrame:
    columns = [*Points.__dataclass_fields__, "geometry"]
    table = read_columns(database.path / POINTS, columns).to_pandas()
    for name in ("way_class", "best_server"):
        table[name] = table[name].astype(str)
    place = gpd.GeoSeries.from_wkb(table["geometry"])
    frame = gpd.GeoDataFrame(table, geometry=place, crs=database.lattice.crs)
    return frame.sort_values("point", ignore_index=True)


def _cells(database: RadioRouteDatabase) -> gpd.GeoDataFrame:
    table = pd.DataFrame([asdict(cell) for cell in database.plan.cells])
    # A column without any value has no type that a GeoPackage knows.
    table = table.dropna(axis="columns", how="all")
    place = gpd.points_from_xy(table["east_m"], table["north_m"])
    return gpd.GeoDataFrame(table, geometry=place, crs=database.lattice.crs)


@contextmanager
def _fixed_date() -> Iterator[None]:
    before = pyogrio.get_gdal_config_option("OGR_CURRENT_DATE")
    pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": _WRITTEN})
    try:
        yield
    finally:
        pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": before})
