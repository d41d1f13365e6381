"""RxLev rasters: one band per cell in one GeoTIFF, read by window and never all at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
from numpy.typing import NDArray
from rasterio._err import CPLE_BaseError
from rasterio.errors import RasterioError
from rasterio.shutil import copy as copy_raster
from rasterio.windows import Window

from mapfilter._io import atomic_file
from mapfilter.errors import Faults, InputError, OutputError, fail
from mapfilter.geodesy import Lattice
from mapfilter.radio._raster_checks import QUANTITY_TAG, Quantity, describe, reason
from mapfilter.radio.cells import CellPlan

Floats32 = NDArray[np.float32]

_BLOCK_PX = 256
_LARGEST_READ_BYTES = 4 << 30
_PLAUSIBLE: dict[Quantity, tuple[float, float, str]] = {
    "level": (-300.0, 60.0, "path losses, or raw RXLEV, given for levels"),
    "loss": (0.0, 400.0, "levels given for path losses"),
    "deviation": (0.0, 100.0, "levels or path losses given for deviations"),
}


@dataclass(frozen=True)
class RxLevRasters:
    """What a raster file holds for which cells; the values stay in the file until read.

    Parameters
    ----------
    path : Path
    cell_ids : tuple of str
        One per band, in the order of the bands.
    lattice : Lattice
        Where the pixels lie.
    quantity : {"level", "loss", "deviation"}
        Received level (dBm), path loss (dB) that is to be taken from a cell's EIRP, or how far off
        levels may be (dB, one standard deviation).
    """

    path: Path
    cell_ids: tuple[str, ...]
    lattice: Lattice
    quantity: Quantity

    def read(
        self,
        window: tuple[int, int, int, int] | None = None,
        cells: Sequence[str] | None = None,
    ) -> Floats32:
        """Read values of some or all cells in a window, or everywhere.

        Parameters
        ----------
        window : (row, col, rows, cols), optional
            Must lie on the lattice.
        cells : sequence of str, optional
            Cell ids in the order wanted; all cells in the order of the bands when left out.

        Returns
        -------
        ndarray of float32, shape (cells, rows, cols)
            dBm or dB, as ``quantity`` says; NaN where there is no data.

        Raises
        ------
        InputError
            The window or a cell is not in the file, the file is cut off, or the values cannot be
            what ``quantity`` says.
        """
        row, col, rows, cols = window or (0, 0, self.lattice.rows, self.lattice.cols)
        ids = self.cell_ids if cells is None else tuple(cells)
        self._check_request(row, col, rows, cols, ids)
        bands = [self.cell_ids.index(cell_id) + 1 for cell_id in ids]
        if not bands:
            return np.empty((0, rows, cols), dtype=np.float32)
        try:
            with rasterio.open(self.path) as source:
                data = source.read(bands, window=Window(col, row, cols, rows), masked=True)
                scales = np.array([source.scales[band - 1] for band in bands])
                offsets = np.array([source.offsets[band - 1] for band in bands])
        except RasterioError as error:
            raise fail(
                InputError, str(self.path), "readable pixels", reason(error), "cut off or damaged"
            ) from error
        values = data.astype(np.float32).filled(np.nan)
        if (scales != 1).any() or (offsets != 0).any():
            values = values * scales[:, None, None] + offsets[:, None, None]
        values[~np.isfinite(values)] = np.nan
        self._check_plausible(values)
        return np.asarray(values, dtype=np.float32)

    def read_levels_dbm(
        self,
        plan: CellPlan,
        window: tuple[int, int, int, int] | None = None,
        cells: Sequence[str] | None = None,
    ) -> Floats32:
        """Read as :meth:`read`, but always levels (dBm): losses are taken from the cells' EIRP.

        Raises
        ------
        InputError
            As :meth:`read`, or the plan lacks a cell, or the file holds deviations.
        """
        if self.quantity == "deviation":
            hint = "the deviations of a survey given for its levels"
            raise fail(InputError, str(self.path), "levels or losses", "deviations", hint)
        values = self.read(window, cells)
        if self.quantity == "level":
            return values
        ids = self.cell_ids if cells is None else cells
        eirp_dbm = np.array([plan[cell_id].eirp_dbm for cell_id in ids], dtype=np.float32)
        return eirp_dbm[:, None, None] - values

    def _check_request(
        self, row: int, col: int, rows: int, cols: int, ids: tuple[str, ...]
    ) -> None:
        faults = Faults()
        size = (self.lattice.rows, self.lattice.cols)
        if min(row, col) < 0 or min(rows, cols) < 1 or row + rows > size[0] or col + cols > size[1]:
            got = f"row {row}, col {col}, {rows} x {cols}"
            faults.add(f"{self.path} window", f"a window on {size[0]} x {size[1]} pixels", got)
        elif rows * cols * len(ids) * 4 > _LARGEST_READ_BYTES:
            got = f"{rows} x {cols} x {len(ids)} cells"
            faults.add(f"{self.path} window", "at most 4 GiB at a time", got, "read it by windows")
        for cell_id in ids:
            if cell_id not in self.cell_ids:
                faults.add(str(self.path), "a cell of the rasters", repr(cell_id))
        faults.raise_if_any(InputError)

    def _check_plausible(self, values: Floats32) -> None:
        known = values[~np.isnan(values)]
        low, high, hint = _PLAUSIBLE[self.quantity]
        if known.size and not (low <= known.min() and known.max() <= high):
            unit = "dBm" if self.quantity == "level" else "dB"
            raise fail(
                InputError,
                f"{self.path} pixels",
                f"a {self.quantity} in {low:g}..{high:g} {unit}",
                f"{known.min():g}..{known.max():g}",
                hint,
            )
        if self.quantity == "level" and known.size and 2 * (known >= 0).sum() > known.size:
            got = f"{known.min():g}..{known.max():g}, mostly 0 and above"
            raise fail(
                InputError, f"{self.path} pixels", "levels in dBm, mostly below 0", got, hint
            )


def open_rasters(path: Path | str, quantity: Quantity | None = None) -> RxLevRasters:
    """Open a raster file whose bands are described by cell ids, and check it without reading it.

    Parameters
    ----------
    path : Path or str
        GeoTIFF or COG (or another format that GDAL knows) with square, north-up pixels.
    quantity : {"level", "loss"}, optional
        What the bands hold, for files that do not say so by mapfilter's tag or by their unit.

    Raises
    ------
    InputError
        With every fault: missing, empty or cut-off file, no CRS or degrees, rotated, oblong or
        upside-down pixels, bands without or with the same cell id, unknown quantity.
    """
    path = Path(path)
    return RxLevRasters(path, *describe(path, quantity))


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


def check_against_plan(rasters: RxLevRasters, plan: CellPlan) -> None:
    """See that rasters and plan hold the same cells.

    Raises
    ------
    InputError
        With the cells in the rasters and not in the plan, and the reverse.
    """
    faults = Faults()
    unknown = [cell_id for cell_id in rasters.cell_ids if cell_id not in plan]
    missing = [cell_id for cell_id in plan.ids if cell_id not in rasters.cell_ids]
    hint = "rasters and plan of different dates or places"
    if unknown:
        faults.add(str(rasters.path), "cells of the plan only", _listed(unknown), hint)
    if missing:
        got = f"no band for {_listed(missing)}"
        faults.add(str(rasters.path), "a band for each cell of the plan", got, hint)
    faults.raise_if_any(InputError)


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


def _listed(ids: Sequence[str]) -> str:
    more = f" and {len(ids) - 10} more" if len(ids) > 10 else ""
    return ", ".join(repr(cell_id) for cell_id in ids[:10]) + more
