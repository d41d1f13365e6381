"""Best server and margin of a database as a cloud-optimised GeoTIFF."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import rasterio
from rasterio._err import CPLE_BaseError
from rasterio.errors import RasterioError
from rasterio.shutil import copy as copy_raster
from rasterio.windows import Window as RasterWindow

from mapfilter._io import atomic_file
from mapfilter.database.manifest import POINTS
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.tiles import tile_windows
from mapfilter.database.windows import WindowReader
from mapfilter.errors import OutputError, fail

BANDS = (("best_server", ""), ("best_level_dbm", "dBm"), ("margin_db", "dB"))
CELLS_TAG = "CELLS"

_BLOCK_PX = 512


def write_cog(database: RadioRouteDatabase, path: Path) -> None:
    """Write a database; see :func:`mapfilter.database.store.export_cog`."""
    if path.suffix.lower() not in (".tif", ".tiff"):
        raise fail(OutputError, str(path), "a name that ends in .tif", path.suffix or "no suffix")
    lattice = database.lattice
    profile = {
        "driver": "GTiff", "width": lattice.cols, "height": lattice.rows, "count": len(BANDS),
        "dtype": "float32", "nodata": np.nan, "crs": lattice.crs, "interleave": "band",
        "transform": rasterio.Affine.from_gdal(*lattice.gdal_transform), "sparse_ok": True,
        "tiled": True, "blockxsize": _BLOCK_PX, "blockysize": _BLOCK_PX, "bigtiff": "if_safer",
    }  # fmt: skip
    columns = ("row", "col", *(name for name, _ in BANDS))
    reader = WindowReader([database.path / POINTS], columns, lattice)
    rank = {cell_id: number for number, cell_id in enumerate(database.cell_ids)}
    with atomic_file(path) as temporary:
        bands = temporary.with_name("bands.tif")
        try:
            with rasterio.open(bands, "w", **profile) as target:
                tags = {CELLS_TAG: json.dumps(database.cell_ids, ensure_ascii=False)}
                if database.attribution:
                    tags["TIFFTAG_COPYRIGHT"] = database.attribution
                target.update_tags(**tags)
                for band, (name, unit) in enumerate(BANDS, start=1):
                    target.set_band_description(band, name)
                    target.set_band_unit(band, unit)
                for window in tile_windows(lattice, _BLOCK_PX):
                    found = reader.read(window)
                    if not found or not len(found["row"]):
                        continue
                    row, col, rows, cols = window
                    values = np.full((len(BANDS), rows, cols), np.nan, dtype=np.float32)
                    at = np.asarray(found["row"]) - row, np.asarray(found["col"]) - col
                    server = found["best_server"].to_pylist()
                    values[0][at] = [rank[cell_id] for cell_id in server]
                    values[1][at], values[2][at] = found["best_level_dbm"], found["margin_db"]
                    target.write(values, window=RasterWindow(col, row, cols, rows))
            # Overviews of numbers of cells must not average them.
            copy_raster(
                bands, temporary, driver="COG", compress="DEFLATE", predictor="YES",
                blocksize=_BLOCK_PX, overview_resampling="nearest", bigtiff="if_safer",
            )  # fmt: skip
        except (RasterioError, CPLE_BaseError) as error:
            raise fail(OutputError, str(path), "a place that can be written", error) from error
