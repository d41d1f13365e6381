"""Export a database: best server and margin as GeoTIFF, points and cells as GeoPackage."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
from pyogrio.errors import DataLayerError, DataSourceError, FeatureError, GeometryError
from rasterio.windows import Window as RasterWindow

from mapfilter._io import atomic_file
from mapfilter.database.exported import BANDS, CELLS_TAG, WRITTEN, check_export_replaceable
from mapfilter.database.manifest import apart
from mapfilter.database.parquet import WindowReader, read_columns
from mapfilter.database.points import Points
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.tiles import tile_windows
from mapfilter.errors import InputError, OutputError, fail
from mapfilter.rasters.geotiff_writer import new_geotiff

_TILE_PX = 512
_WRITE_ERRORS = (DataSourceError, DataLayerError, FeatureError, GeometryError)


def export_cog(database: RadioRouteDatabase, path: Path | str) -> None:
    """Write best server and margin as a cloud-optimised GeoTIFF on the database's lattice.

    Bands: ``best_server`` (index into the JSON list in the tag ``CELLS``), ``best_level_dbm`` and
    ``margin_db``; NaN where there is no point. ``path`` ends in .tif; an older export is replaced.

    Raises
    ------
    InputError
        The database is of roads alone.
    OutputError
        The file cannot be written, or holds something else than an export.
    """
    check_export_replaceable(Path(path))
    if not database.cell_ids:
        hint = "a database of roads alone; export it to .gpkg"
        raise fail(InputError, str(database.path), "cells", "none", hint)
    lattice = database.lattice
    columns = ("row", "col", *(name for name, _ in BANDS))
    reader = WindowReader([database.points_part], columns, lattice)
    rank = {cell_id: number for number, cell_id in enumerate(database.cell_ids)}
    tags = {CELLS_TAG: json.dumps(database.cell_ids, ensure_ascii=False)}
    if database.attribution:
        tags["TIFFTAG_COPYRIGHT"] = database.attribution
    with new_geotiff(Path(path), lattice, BANDS, tags) as target:
        for window in tile_windows(lattice, _TILE_PX):
            found = reader.read(window)
            if not found:
                continue
            row, col, rows, cols = window
            values = np.full((len(BANDS), rows, cols), np.nan, dtype=np.float32)
            at = np.asarray(found["row"]) - row, np.asarray(found["col"]) - col
            server = found["best_server"].to_pylist()
            values[0][at] = [rank[cell_id] for cell_id in server]
            values[1][at], values[2][at] = found["best_level_dbm"], found["margin_db"]
            target.write(values, window=RasterWindow(col, row, cols, rows))


def export_geopackage(
    database: RadioRouteDatabase, path: Path | str, cells: Sequence[str] = ()
) -> None:
    """Write a database as GeoPackage: layers ``points`` and, with cells, ``cells`` and those named.

    ``path`` ends in .gpkg; an older export is replaced. The points of ``cells``, within the
    database's margin, become a layer each.

    Raises
    ------
    InputError
        The database has no such cell.
    OutputError
        The file cannot be written, or holds something else than an export, or one that was edited.
    """
    path = Path(path)
    if path.suffix.lower() != ".gpkg":
        raise fail(OutputError, str(path), "a name that ends in .gpkg", path.suffix or "no suffix")
    check_export_replaceable(path)
    crs = database.lattice.crs
    # A column without any value has no type that a GeoPackage knows.
    layers = {"points": _points(database)}
    if database.cell_ids:
        table = pd.DataFrame([asdict(cell) for cell in database.plan.cells])
        table = table.dropna(axis=1, how="all")
        place = gpd.points_from_xy(table["east_m"], table["north_m"])
        layers["cells"] = gpd.GeoDataFrame(table, geometry=place, crs=crs)
    # Layers of a GeoPackage are tables, whose names SQLite compares without case.
    names = apart({cell_id: f"cell {cell_id}" for cell_id in cells})
    for cell_id, name in names.items():
        row, col, level_dbm = database.cell_points(cell_id)
        east, north = database.lattice.east_north(row, col)
        columns = {"row": row, "col": col, "level_dbm": level_dbm}
        place = gpd.points_from_xy(east, north)
        layers[name] = gpd.GeoDataFrame(columns, geometry=place, crs=crs)
    write_layers(layers, path)


def write_layers(layers: Mapping[str, gpd.GeoDataFrame], path: Path) -> None:
    """Write the layers of a GeoPackage; equal layers give equal bytes.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    with atomic_file(path) as temporary, _fixed_date():
        try:
            for name, layer in layers.items():
                pyogrio.write_dataframe(layer, temporary, layer=name, driver="GPKG")
        except _WRITE_ERRORS as error:
            raise fail(OutputError, str(path), "a place that can be written", error) from error


def _points(database: RadioRouteDatabase) -> gpd.GeoDataFrame:
    columns = [*Points.__dataclass_fields__, "geometry"]
    table = read_columns(database.points_part, columns).to_pandas()
    for name in ("way_class", "best_server"):
        table[name] = table[name].astype(str)
    place = gpd.GeoSeries.from_wkb(table["geometry"])
    frame = gpd.GeoDataFrame(table, geometry=place, crs=database.lattice.crs)
    return frame.sort_values("point")


@contextmanager
def _fixed_date() -> Iterator[None]:
    before = pyogrio.get_gdal_config_option("OGR_CURRENT_DATE")
    pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": WRITTEN})
    try:
        yield
    finally:
        pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": before})
