"""Writing RxLev rasters: one band per cell in one cloud-optimised GeoTIFF."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
from numpy.typing import NDArray
from rasterio._err import CPLE_BaseError
from rasterio.errors import RasterioError
from rasterio.shutil import copy as copy_raster

from mapfilter._io import atomic_file
from mapfilter._types import Floats32
from mapfilter.errors import InputError, OutputError, fail
from mapfilter.geodesy import Lattice
from mapfilter.radio._raster_checks import QUANTITY_TAG, Quantity, reason

_BLOCK_PX = 256


def write_rasters(
    path: Path | str,
    lattice: Lattice,
    items: Iterable[tuple[str, NDArray[Any]]],
    cell_ids: Sequence[str],
    tags: Mapping[str, str] | None = None,
    *,
    quantity: Quantity = "level",
) -> None:
    """Write one band per cell as a cloud-optimised GeoTIFF, holding one band in memory at a time.

    Values are rounded to 0.01 dB; NaN is nodata. Equal values give equal bytes.

    Parameters
    ----------
    path : Path or str
        Ends in .tif or .tiff.
    lattice : Lattice
    items : iterable of (cell id, array of shape (rows, cols))
        In the order of ``cell_ids``.
    cell_ids : sequence of str
        The band descriptions.
    tags : mapping of str to str, optional
        Free text kept in the file, such as how it was predicted.
    quantity : {"level", "loss", "deviation"}

    Raises
    ------
    InputError
        An item is not the cell that is next, or has another shape.
    OutputError
        The file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in (".tif", ".tiff"):
        raise fail(OutputError, str(path), "a name that ends in .tif", path.suffix or "no suffix")
    unit = "dBm" if quantity == "level" else "dB"
    profile = {
        "driver": "GTiff", "width": lattice.cols, "height": lattice.rows, "count": len(cell_ids),
        "dtype": "float32", "nodata": np.nan, "crs": lattice.crs, "interleave": "band",
        "transform": rasterio.Affine.from_gdal(*lattice.gdal_transform),
        "tiled": True, "blockxsize": _BLOCK_PX, "blockysize": _BLOCK_PX, "bigtiff": "if_safer",
    }  # fmt: skip
    with atomic_file(path) as temporary:
        bands = temporary.with_name("bands.tif")
        try:
            with rasterio.open(bands, "w", **profile) as target:
                target.update_tags(**{**(tags or {}), QUANTITY_TAG: quantity})
                for band, cell_id, values in _in_order(items, cell_ids, lattice):
                    target.write(values, band)
                    target.set_band_description(band, cell_id)
                    target.set_band_unit(band, unit)
            copy_raster(
                bands, temporary, driver="COG", compress="DEFLATE", predictor="YES",
                blocksize=_BLOCK_PX, overview_resampling="average", bigtiff="if_safer",
            )  # fmt: skip
        except (RasterioError, CPLE_BaseError) as error:
            raise fail(
                OutputError, str(path), "a raster that can be written", reason(error)
            ) from error


def _in_order(
    items: Iterable[tuple[str, NDArray[Any]]], cell_ids: Sequence[str], lattice: Lattice
) -> Iterable[tuple[int, str, Floats32]]:
    count = 0
    for count, (cell_id, values) in enumerate(items, start=1):
        expected = cell_ids[count - 1] if count <= len(cell_ids) else "no more cells"
        if cell_id != expected:
            raise fail(InputError, f"band {count}", repr(expected), repr(cell_id))
        if values.shape != (lattice.rows, lattice.cols):
            shape = f"{lattice.rows} x {lattice.cols} pixels"
            raise fail(InputError, f"band {count} ({cell_id})", shape, values.shape)
        rounded = np.round(np.asarray(values, dtype=np.float64), 2).astype(np.float32)
        rounded[~np.isfinite(rounded)] = np.nan
        yield count, cell_id, rounded
    if count < len(cell_ids):
        raise fail(InputError, "bands", f"{len(cell_ids)} cells", f"{count}")
