"""Writing bands as cloud-optimised GeoTIFF files, and telling those that were written so."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np
import rasterio
from numpy.typing import ArrayLike
from rasterio._err import CPLE_BaseError
from rasterio.errors import RasterioError
from rasterio.io import DatasetWriter
from rasterio.shutil import copy as copy_raster

from mapfilter._arguments import (
    Argument,
    Entries,
    Setting,
    check_arguments,
    path_argument,
    shown,
)
from mapfilter._arguments import items as named_items
from mapfilter._gdal import open_raster, reason_of
from mapfilter._io import atomic_file
from mapfilter._types import Floats, Floats32
from mapfilter.errors import InputError, MapfilterError, OutputError, fail, listed
from mapfilter.lattice import Lattice
from mapfilter.rasters.files import Quantity
from mapfilter.rasters.geotiff import QUANTITY_TAG

_PIXELS_TAG = "PIXELS_SHA256"
_BLOCK_PX = 256
_MOST_BAND_BYTES = 1 << 26
_BY_BAND = ("driver", "interleave", "tiled", "blockxsize", "blockysize", "sparse_ok")


@contextmanager
def new_geotiff(
    path: Path,
    lattice: Lattice,
    bands: Sequence[tuple[str, str]],
    tags: Mapping[str, str],
    *,
    overviews: Literal["average", "nearest"] = "nearest",
) -> Iterator[DatasetWriter]:
    """Open a new cloud-optimised GeoTIFF of float32 bands; it is put in place when all is written.

    With more than 256 bands it is a tiled one, band by band, without overviews.

    Parameters
    ----------
    path : Path
        Ends in .tif or .tiff.
    bands : sequence of (str, str)
        Description and unit of each band.
    overviews : {"average", "nearest"}
        Resampling of coarser levels; class numbers must not be averaged.

    Yields
    ------
    rasterio.io.DatasetWriter
        For any bands and windows, in any order; what is not written is NaN, the nodata value.

    Raises
    ------
    OutputError
        The name has another suffix, or the file cannot be written.
    """
    if path.suffix.lower() not in (".tif", ".tiff"):
        raise fail(OutputError, str(path), "a name that ends in .tif", path.suffix or "no suffix")
    profile = {
        "driver": "GTiff",
        "width": lattice.cols,
        "height": lattice.rows,
        "count": len(bands),
        "dtype": "float32",
        "nodata": np.nan,
        "crs": lattice.crs,
        "transform": rasterio.Affine.from_gdal(*lattice.gdal_transform),
        "interleave": "band",
        "tiled": True,
        "blockxsize": _BLOCK_PX,
        "blockysize": _BLOCK_PX,
        "sparse_ok": True,
        "bigtiff": "if_safer",
    }
    form: dict[str, Any] = {"driver": "COG", "blocksize": _BLOCK_PX, "predictor": "YES"}
    form |= {"overview_resampling": overviews}
    if _BLOCK_PX**2 * 4 * len(bands) > _MOST_BAND_BYTES:
        # There all bands of a block lie together: hundreds of them are more than is read again.
        form = {key: profile[key] for key in _BY_BAND} | {"predictor": 3}
    with atomic_file(path) as temporary:
        unfinished = temporary.with_name("bands.tif")
        try:
            with rasterio.open(unfinished, "w", **profile) as target:
                target.update_tags(**tags)
                for band, (name, unit) in enumerate(bands, start=1):
                    target.set_band_description(band, name)
                    target.set_band_unit(band, unit)
                yield target
            copy_raster(unfinished, temporary, compress="DEFLATE", bigtiff="if_safer", **form)
        except (RasterioError, CPLE_BaseError) as error:
            expected = "a raster that can be written"
            raise fail(OutputError, str(path), expected, reason_of(error)) from error


def write_rasters(
    path: Path | str,
    lattice: Lattice,
    items: Mapping[str, ArrayLike] | Floats | Floats32 | Iterable[tuple[str, ArrayLike]],
    cell_ids: Sequence[str] | None = None,
    tags: Mapping[str, str] | None = None,
    *,
    quantity: Quantity = "level",
) -> Path:
    """Write one band per cell, holding one band in memory at a time; return the file's path.

    Values are rounded to 0.01 dB; NaN is nodata. Equal values give equal bytes.

    Parameters
    ----------
    path : Path or str
        Ends in .tif or .tiff.
    lattice : Lattice
        Of the pixels.
    items : mapping of cell id to array, array, or iterable of (cell id, array)
        Arrays of shape (rows, cols), row 0 in the north; masked pixels are nodata. One array of
        shape (cells, rows, cols) is in the order of ``cell_ids``, and so is an iterable, which may
        make one array after the other.
    cell_ids : sequence of str, optional
        The band descriptions; of a mapping all cells in their order when left out.
    tags : mapping of str to str, optional
        Free text kept in the file, such as how it was predicted.
    quantity : {"level", "loss", "deviation"}
        What the arrays hold: dBm, or dB, as of
        :class:`~mapfilter.rasters.raster_set.RxLevRasters`.

    Returns
    -------
    Path
        Of the file, which :func:`~mapfilter.rasters.opening.open_rasters` opens.

    Raises
    ------
    InputError
        An item is not the cell that is next, has another shape or no numbers; a cell has none, or
        there is no cell.
    OutputError
        The file cannot be written.
    ConfigError
        An argument is of another type.
    """
    check_arguments(
        "write_rasters",
        path_argument("path", path),
        Argument("lattice", lattice, Lattice, "a lattice"),
        _items_argument(items),
        keywords=[
            *named_items("cell_ids", () if cell_ids is None else cell_ids, str, "a cell id"),
            Entries("tags", tags, str, "a text", "texts by their names"),
            Setting("quantity", quantity, Quantity),
        ],
    )
    hint = "items as a mapping, from ids to arrays, needs none"
    if isinstance(items, Mapping):
        hint = ""
        cell_ids = list(items) if cell_ids is None else cell_ids
        if lacking := [cell_id for cell_id in cell_ids if cell_id not in items]:
            got = f"none of {listed(lacking)}"
            raise fail(InputError, "levels", "an array of each cell", got)
        of_cells: Mapping[str, ArrayLike] = items
        items = ((cell_id, of_cells[cell_id]) for cell_id in cell_ids)
    if cell_ids is None or len(cell_ids) == 0:
        raise fail(InputError, "cell_ids", "the ids of all cells", "none", hint)
    if isinstance(items, np.ndarray):
        if items.shape[:1] != (len(cell_ids),) or items.ndim != 3:
            expected = f"({len(cell_ids)}, {lattice.rows}, {lattice.cols}): cells, rows, columns"
            raise fail(InputError, "items", expected, items.shape)
        items = zip(cell_ids, items, strict=True)
    bands = [(cell_id, "dBm" if quantity == "level" else "dB") for cell_id in cell_ids]
    tags = {**(tags or {}), QUANTITY_TAG: quantity}
    count, pixels = 0, hashlib.sha256()
    with new_geotiff(Path(path), lattice, bands, tags, overviews="average") as target:
        for count, item in enumerate(items, start=1):
            cell_id, values = _band(item, count)
            expected = cell_ids[count - 1] if count <= len(cell_ids) else "no more cells"
            if cell_id != expected:
                raise fail(InputError, f"band {count}", repr(expected), repr(cell_id))
            if values.shape != (lattice.rows, lattice.cols):
                shape = f"{lattice.rows} x {lattice.cols} pixels"
                raise fail(InputError, f"band {count} ({cell_id})", shape, values.shape)
            rounded = np.round(values, 2).astype(np.float32)
            rounded[~np.isfinite(rounded)] = np.nan
            target.write(rounded, count)
            pixels.update(rounded.tobytes())
        if count < len(cell_ids):
            raise fail(InputError, "bands", f"{len(cell_ids)} cells", f"{count}")
        target.update_tags(**{_PIXELS_TAG: pixels.hexdigest()})
    return Path(path)


def _items_argument(value: object) -> Argument | Entries:
    """Return the arrays of all cells, to be checked."""
    expected = "the array of each cell, by its id"
    if isinstance(value, Mapping):
        return Entries("items", value, object, "an array", expected)
    return Argument("items", value, Iterable, expected)


def _band(item: Any, number: int) -> tuple[str, Floats]:
    """Return the cell of an item, and its values; NaN where they are masked."""
    if not isinstance(item, tuple | list) or len(item) != 2:
        raise fail(InputError, f"items, band {number}", "a cell id and its array", shown(item))
    cell_id, given = item
    try:
        values: Floats = np.ma.asarray(given, dtype=np.float64).filled(np.nan)
    except (TypeError, ValueError) as error:
        where = f"items, band {number} ({cell_id})"
        raise fail(InputError, where, "rows of numbers", shown(given)) from error
    return cell_id, values


def is_as_written(path: Path) -> bool:
    """Return whether a file is a raster set that :func:`write_rasters` wrote, pixels unchanged."""
    pixels = hashlib.sha256()
    try:
        with open_raster(path) as source:
            expected = source.tags().get(_PIXELS_TAG)
            for band in source.indexes if expected else ():
                values = source.read(band)
                values[~np.isfinite(values)] = np.nan
                pixels.update(values.tobytes())
    except (MapfilterError, RasterioError, UnicodeDecodeError):
        return False
    return bool(expected == pixels.hexdigest())
