"""The bounds of a radio map as a cloud-optimised GeoTIFF, one band each."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import rasterio
from rasterio._err import CPLE_BaseError
from rasterio.errors import RasterioError
from rasterio.shutil import copy as copy_raster

from mapfilter._io import atomic_file
from mapfilter._types import Floats32
from mapfilter.errors import OutputError, fail
from mapfilter.evaluation.map_bound import BANDS
from mapfilter.geodesy import Lattice

_BLOCK_PX = 512


def write_bound(
    rasters: Mapping[str, Floats32], lattice: Lattice, path: Path, attribution: str = ""
) -> None:
    """Write the rasters of :data:`mapfilter.evaluation.map_bound.BANDS`, NaN off the points.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    profile = {
        "driver": "GTiff", "width": lattice.cols, "height": lattice.rows, "count": len(BANDS),
        "dtype": "float32", "nodata": np.nan, "crs": lattice.crs, "interleave": "band",
        "transform": rasterio.Affine.from_gdal(*lattice.gdal_transform), "tiled": True,
        "blockxsize": _BLOCK_PX, "blockysize": _BLOCK_PX, "bigtiff": "if_safer",
    }  # fmt: skip
    with atomic_file(path) as temporary:
        bands = temporary.with_name("bands.tif")
        try:
            with rasterio.open(bands, "w", **profile) as target:
                if attribution:
                    target.update_tags(TIFFTAG_COPYRIGHT=attribution)
                for band, (name, unit) in enumerate(BANDS, start=1):
                    target.write(rasters[name], band)
                    target.set_band_description(band, name)
                    target.set_band_unit(band, unit)
            copy_raster(
                bands, temporary, driver="COG", compress="DEFLATE", predictor="YES",
                blocksize=_BLOCK_PX, overview_resampling="nearest", bigtiff="if_safer",
            )  # fmt: skip
        except (RasterioError, CPLE_BaseError) as error:
            raise fail(OutputError, str(path), "a place that can be written", error) from error
