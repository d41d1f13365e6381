"""GeoTIFF files of radio rasters: one band per cell, named by the band's description."""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import rasterio
from rasterio.errors import NotGeoreferencedWarning, RasterioError
from rasterio.windows import Window as RasterioWindow

from mapfilter._types import Floats32
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import Lattice, projected_crs, same_crs
from mapfilter.radio.cell_rules import id_fault
from mapfilter.rasters.files import (
    QUANTITY_TAG,
    Quantity,
    Window,
    check_file,
    existing,
    reason,
    without_nodata,
)

_UNITS: dict[str, Quantity] = {"dbm": "level", "db": "loss"}
_KINDS: tuple[Quantity, ...] = ("level", "loss", "deviation")
_LEAST_BLOCK_BYTES = 1 << 26
_INDEX_ENTRY_BYTES = 4
_MOST_BLOCKS_LOOKED_AT = 20_000
_SQUARE_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True)
class GeoTiff:
    """A GeoTIFF or COG with square, north-up pixels.

    Parameters
    ----------
    path : Path
    cell_ids : tuple of str
        One per band.
    lattice : Lattice
    nodata : tuple of float
        Numbers that mean no data, besides the file's own.
    tagged : bool
        Whether it says by mapfilter's tag what it holds.
    """

    path: Path
    cell_ids: tuple[str, ...]
    lattice: Lattice
    nodata: tuple[float, ...] = ()
    tagged: bool = False

    @property
    def parts(self) -> tuple[Path, ...]:
        """The file alone."""
        return existing(self.path)

    def read(self, bands: Sequence[int], window: Window) -> Floats32:
        """Read bands in a window; see :class:`~mapfilter.rasters.files.RasterFile`."""
        row, col, rows, cols = window
        numbers = [band + 1 for band in bands]
        try:
            with rasterio.open(self.path, driver="GTiff") as source:
                part = RasterioWindow(col, row, cols, rows)
                values = _masked(source, numbers, part)
                scales = np.array(source.scales)[bands]
                offsets = np.array(source.offsets)[bands]
        except (RasterioError, UnicodeDecodeError) as error:
            raise fail(
                InputError, str(self.path), "readable pixels", reason(error), "cut off or damaged"
            ) from error
        values = without_nodata(values, self.nodata)
        if (scales != 1).any() or (offsets != 0).any():
            scaled = values * scales[:, None, None] + offsets[:, None, None]
            values = without_nodata(scaled.astype(np.float32), ())
        return values


def open_geotiff(
    path: Path, crs: str | None = None, nodata: float | None = None
) -> tuple[GeoTiff, Quantity | None]:
    """Look at the header of a GeoTIFF.

    Parameters
    ----------
    path : Path
        With one band and no description, its name without suffix is the cell's id.
    crs : str, optional
        For files without one.
    nodata : float, optional
        A number that means no data, besides the file's own.

    Returns
    -------
    file : GeoTiff
    quantity : {"level", "loss", "deviation"} or None
        What the file says that it holds, by mapfilter's tag or by its unit.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    check_file(path)
    faults = Faults()
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", NotGeoreferencedWarning)
            with rasterio.open(path, driver="GTiff") as source:
                _check_extent_of_file(path, source, faults)
                # What a cut-off file says about itself is not worth telling.
                faults.raise_if_any(InputError)
                names = tuple(str(name or "") for name in source.descriptions)
                if len(names) == 1 and not names[0]:
                    names = (path.stem,)
                _check_bands(str(path), names, source.dtypes, faults)
                lattice = _lattice(str(path), source, crs, not caught, faults)
                quantity, tagged = _quantity(source), QUANTITY_TAG in source.tags()
    except (RasterioError, UnicodeDecodeError) as error:
        hint = "cut off, or no raster"
        raise fail(
            InputError, str(path), "a raster that GDAL can read", reason(error), hint
        ) from error
    faults.raise_if_any(InputError)
    empty = () if nodata is None else (nodata,)
    return GeoTiff(path, names, cast(Lattice, lattice), empty, tagged), quantity


def _masked(source: Any, bands: list[int], window: Any) -> Floats32:
    """Read bands with NaN where the file's own mask or nodata value says so."""
    # Each of these properties asks the file about all of its bands.
    masks, empty = source.mask_flag_enums, source.nodatavals
    flags = {flag.name for band in bands for flag in masks[band - 1]}
    own = {empty[band - 1] for band in bands}
    if flags <= {"all_valid", "nodata"} and all(n is None or math.isnan(n) for n in own):
        return np.asarray(source.read(bands, window=window, out_dtype=np.float32))
    data = source.read(bands, window=window, masked=True)
    return cast(Floats32, data.astype(np.float32).filled(np.nan))


def _quantity(source: Any) -> Quantity | None:
    if tagged := source.tags().get(QUANTITY_TAG):
        return next((kind for kind in _KINDS if kind == tagged), None)
    named = {_UNITS.get((unit or "").strip().lower()) for unit in source.units}
    return named.pop() if len(named) == 1 else None


def _lattice(
    where: str, source: Any, declared: str | None, placed: bool, faults: Faults
) -> Lattice | None:
    """Return where the pixels lie, or None; what is wrong with the file is added to ``faults``."""
    crs = None
    try:
        text = source.crs.to_wkt() if source.crs else declared
        crs = projected_crs(text, f"{where}, CRS")
        if declared is not None and not same_crs(crs, declared):
            faults.add(f"{where}, CRS", f"{declared}, as declared", crs, "two systems mixed up")
    except InputError as error:
        faults.found.extend(error.faults)
    if not _check_pixels(where, source, placed, faults) or crs is None:
        return None
    corner = source.transform
    return Lattice(crs, corner.c, corner.f, corner.a, source.height, source.width)


def _check_pixels(where: str, source: Any, placed: bool, faults: Faults) -> bool:
    t = source.transform
    before = len(faults.found)
    if not placed or t.is_identity:
        faults.add(f"{where}, transform", "where the pixels lie", "nothing", "exported without it")
    elif not all(map(math.isfinite, (t.a, t.b, t.c, t.d, t.e, t.f))):
        faults.add(f"{where}, transform", "finite numbers", f"{t.a}, {t.c}, {t.f}")
    elif t.b != 0 or t.d != 0:
        faults.add(f"{where}, transform", "rows that run east", "a rotated raster")
    elif t.e >= 0 or t.a <= 0:
        faults.add(f"{where}, transform", "row 0 in the north, column 0 in the west",
                   f"pixels of {t.a:g} x {t.e:g}", "a raster upside down or mirrored")  # fmt: skip
    elif abs(t.a + t.e) > _SQUARE_TOLERANCE * t.a:
        faults.add(f"{where}, transform", "square pixels", f"{t.a:g} m x {-t.e:g} m")
    return len(faults.found) == before


def _check_bands(where: str, names: tuple[str, ...], dtypes: Sequence[str], faults: Faults) -> None:
    nameless = [str(i) for i, name in enumerate(names, start=1) if not name]
    if nameless:
        faults.add(
            f"{where}, band {', '.join(nameless[:10])}", "a cell id as band description", "none"
        )
    for name in filter(None, names):
        if wrong := id_fault(name):
            faults.add(f"{where}, band {name!r}", *wrong)
    for name, count in Counter(filter(None, names)).items():
        if count > 1:
            faults.add(f"{where}, bands", "each cell once", f"{name!r} {count} times")
    for kind in sorted({kind for kind in dtypes if "complex" in kind}):
        faults.add(f"{where}, bands", "real numbers", kind)


def _check_extent_of_file(path: Path, source: Any, faults: Faults) -> None:
    """Compare what the header of a TIFF promises with the bytes that are there."""
    size_bytes = path.stat().st_size
    rows_px, cols_px = source.block_shapes[0]
    down, across = -(-source.height // rows_px), -(-source.width // cols_px)
    by_band = str(source.interleaving).lower().endswith("band")
    planes = source.count if by_band else 1
    hint = "the file is cut off, or its header is damaged"
    pixel_bytes = max(np.dtype(kind).itemsize for kind in source.dtypes)
    block_bytes = rows_px * cols_px * pixel_bytes * (1 if by_band else source.count)
    if block_bytes > max(size_bytes, _LEAST_BLOCK_BYTES):
        got = f"{rows_px} x {cols_px} pixels of {pixel_bytes} bytes"
        faults.add(f"{path}, blocks", "blocks under 64 MiB", got, "not tiled, or a damaged header")
        return
    if down * across * planes * _INDEX_ENTRY_BYTES > size_bytes:
        got = f"{size_bytes} bytes for {source.height} x {source.width} x {source.count} pixels"
        faults.add(str(path), "as many bytes as its header tells", got, hint)
        return
    needed, blocks = 0, down * across
    step = max(1, -(-blocks * planes // _MOST_BLOCKS_LOOKED_AT))
    for band in range(1, planes + 1):
        # Backwards, because a file that is cut off lacks its last blocks.
        for number in range(blocks - 1, -1, -step):
            block = f"{number % across}_{number // across}"
            offset = source.get_tag_item(f"BLOCK_OFFSET_{block}", "TIFF", bidx=band)
            length = source.get_tag_item(f"BLOCK_SIZE_{block}", "TIFF", bidx=band)
            needed = max(needed, int(offset or 0) + int(length or 0))
    if needed == 0:
        faults.add(str(path), "pixels", "a header without any", hint)
    elif needed > size_bytes:
        faults.add(str(path), f"at least {needed} bytes", f"{size_bytes} bytes", hint)
