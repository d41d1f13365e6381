"""What a raster file must be before any of its pixels is read."""

from __future__ import annotations

import math
import warnings
from collections import Counter
from pathlib import Path
from typing import Any, Literal, cast

import rasterio
from rasterio.errors import NotGeoreferencedWarning, RasterioError

from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import Lattice, projected_crs
from mapfilter.radio._cell_rules import id_fault

Quantity = Literal["level", "loss", "deviation"]

QUANTITY_TAG = "MAPFILTER_QUANTITY"
"""Tag of a file that says which quantity its bands hold."""
_UNITS = {"dbm": "level", "db": "loss"}
_LARGEST_BLOCK_BYTES = 1 << 30
_INDEX_ENTRY_BYTES = 4
_SQUARE_TOLERANCE = 1e-6


def describe(path: Path, quantity: Quantity | None) -> tuple[tuple[str, ...], Lattice, Quantity]:
    """Return the cell ids, lattice and quantity of a raster file, without reading its pixels.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    _check_file(path)
    faults = Faults()
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", NotGeoreferencedWarning)
            with rasterio.open(path) as source:
                if source.driver == "GTiff":
                    _check_extent_of_file(path, source, faults)
                    # What a cut-off file says about itself is not worth telling.
                    faults.raise_if_any(InputError)
                lattice = _lattice(path, source, not caught, faults)
                quantity = quantity or _quantity(source)
                ids = tuple(str(name) for name in source.descriptions)
    except (RasterioError, UnicodeDecodeError) as error:
        hint = "cut off, or no raster"
        raise fail(
            InputError, str(path), "a raster that GDAL can read", reason(error), hint
        ) from error
    if quantity is None:
        expected = "to know whether the bands are levels (dBm) or losses (dB)"
        faults.add(str(path), expected, "neither tag nor unit", "say quantity = level or loss")
    faults.raise_if_any(InputError)
    return ids, cast(Lattice, lattice), cast(Quantity, quantity)


def reason(error: Exception) -> str:
    """Return the first line of what GDAL said."""
    text = str(error.__cause__ or error).strip()
    return text.splitlines()[0] if text else type(error).__name__


def _check_file(path: Path) -> None:
    try:
        size = path.stat().st_size
    except OSError as error:
        raise fail(InputError, str(path), "a readable file", error.strerror or error) from error
    if path.is_dir():
        raise fail(InputError, str(path), "a raster file", "a folder")
    if size == 0:
        raise fail(InputError, str(path), "a raster file", "an empty file")


def _quantity(source: Any) -> Quantity | None:
    named = {source.tags().get(QUANTITY_TAG)} - {None}
    named = named or {_UNITS.get((unit or "").strip().lower()) for unit in source.units}
    found = named.pop() if len(named) == 1 else None
    return found if found in ("level", "loss", "deviation") else None


def _lattice(path: Path, source: Any, placed: bool, faults: Faults) -> Lattice | None:
    """Return where the pixels lie, or None; what is wrong with the file is added to ``faults``."""
    where = str(path)
    crs = None
    try:
        crs = projected_crs(source.crs.to_wkt() if source.crs else None, f"{where}, CRS")
    except InputError as error:
        faults.found.extend(error.faults)
    _check_bands(where, source, faults)
    if not _check_pixels(where, source, placed, faults) or crs is None:
        return None
    corner = source.transform
    return Lattice(crs, corner.c, corner.f, corner.a, source.height, source.width)


def _check_pixels(where: str, source: Any, placed: bool, faults: Faults) -> bool:
    t = source.transform
    before = len(faults.found)
    if not placed or t.is_identity:
        faults.add(f"{where}, transform", "where the pixels lie", "nothing", "exported without it")
    elif t.b != 0 or t.d != 0:
        faults.add(f"{where}, transform", "rows that run east", "a rotated raster")
    elif t.e > 0 or t.a < 0:
        faults.add(f"{where}, transform", "row 0 in the north, column 0 in the west",
                   f"pixels of {t.a:g} x {t.e:g}", "a raster upside down or mirrored")  # fmt: skip
    elif abs(t.a + t.e) > _SQUARE_TOLERANCE * t.a:
        faults.add(f"{where}, transform", "square pixels", f"{t.a:g} m x {-t.e:g} m")
    elif not all(map(math.isfinite, (t.a, t.c, t.f))):
        faults.add(f"{where}, transform", "finite numbers", f"{t.a}, {t.c}, {t.f}")
    return len(faults.found) == before


def _check_bands(where: str, source: Any, faults: Faults) -> None:
    nameless = [str(i) for i, name in enumerate(source.descriptions, start=1) if not name]
    if nameless:
        faults.add(
            f"{where}, band {', '.join(nameless[:10])}", "a cell id as band description", "none"
        )
    for name in filter(None, source.descriptions):
        if wrong := id_fault(name):
            faults.add(f"{where}, band {name!r}", *wrong)
    for name, count in Counter(filter(None, source.descriptions)).items():
        if count > 1:
            faults.add(f"{where}, bands", "each cell once", f"{name!r} {count} times")
    for kind in sorted({kind for kind in source.dtypes if "complex" in kind}):
        faults.add(f"{where}, bands", "real numbers", kind)


def _check_extent_of_file(path: Path, source: Any, faults: Faults) -> None:
    """Compare what the header of a TIFF promises with the bytes that are there."""
    size_bytes = path.stat().st_size
    rows_px, cols_px = source.block_shapes[0]
    down, across = -(-source.height // rows_px), -(-source.width // cols_px)
    by_band = str(source.interleaving).lower().endswith("band")
    planes = source.count if by_band else 1
    hint = "the file is cut off, or its header is damaged"
    block_bytes = rows_px * cols_px * 8 * (1 if by_band else source.count)
    if block_bytes > _LARGEST_BLOCK_BYTES:
        got = f"{rows_px} x {cols_px} pixels"
        faults.add(f"{path}, blocks", "blocks under 1 GiB", got, "not tiled, or a damaged header")
        return
    if down * across * planes * _INDEX_ENTRY_BYTES > size_bytes:
        got = f"{size_bytes} bytes for {source.height} x {source.width} x {source.count} pixels"
        faults.add(str(path), "as many bytes as its header tells", got, hint)
        return
    needed = 0
    for band in range(1, planes + 1):
        for row in range(down):
            for col in range(across):
                block = f"{col}_{row}"
                offset = source.get_tag_item(f"BLOCK_OFFSET_{block}", "TIFF", bidx=band)
                length = source.get_tag_item(f"BLOCK_SIZE_{block}", "TIFF", bidx=band)
                needed = max(needed, int(offset or 0) + int(length or 0))
    if needed == 0:
        faults.add(str(path), "pixels", "a header without any", hint)
    elif needed > size_bytes:
        faults.add(str(path), f"at least {needed} bytes", f"{size_bytes} bytes", hint)
