"""Raw pixels with an ESRI header (``.bil``, ``.flt``), read by window."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from mapfilter.errors import InputError, fail
from mapfilter.lattice import Lattice
from mapfilter.rasters.files import Declared
from mapfilter.rasters.plain_grids import WEST_KEYS, GridHeader, PlainGrid, file_beside, grid_crs

_LARGEST_SKIP_BYTES = 1 << 20
_ORDERS = {"I": "<", "LSBFIRST": "<", "M": ">", "MSBFIRST": ">"}
_TYPES = {
    "SIGNEDINT": {8: "i1", 16: "i2", 32: "i4"},
    "UNSIGNEDINT": {8: "u1", 16: "u2", 32: "u4"},
    "FLOAT": {32: "f4", 64: "f8"},
}


@dataclass(frozen=True, slots=True)
class RawGrid(PlainGrid):
    """One band of raw pixels.

    Parameters
    ----------
    dtype : str
        NumPy's text for the type of a pixel, such as ``">i2"``.
    skip_bytes, row_bytes : int
        What lies before the first row, and from each row to the next.
    """

    _: KW_ONLY
    dtype: str
    skip_bytes: int
    row_bytes: int

    def _pixels(self, row: int, col: int, rows: int, cols: int) -> NDArray[Any]:
        shape = self.lattice.rows, self.lattice.cols
        strides = self.row_bytes, np.dtype(self.dtype).itemsize
        try:
            data = np.memmap(self.path, np.uint8, "r")
            pixels: NDArray[Any] = np.ndarray(shape, self.dtype, data, self.skip_bytes, strides)
        except (TypeError, ValueError) as error:
            raise fail(InputError, str(self.path), "all rows", "fewer bytes", "cut off") from error
        return pixels[row : row + rows, col : col + cols]


def open_raw_grid(path: Path, cell_id: str, declared: Declared) -> RawGrid:
    """Read the header of raw pixels, beside the file, and compare it with the file.

    Raises
    ------
    InputError
        With every fault: no header, an unknown type of pixels, several bands, a place or size that
        makes no sense, a file shorter or longer than its header requires.
    """
    header_file = file_beside(path, ".HDR", ".hdr")
    where, instead = declared.header or ("", {})
    header = GridHeader(where, instead)
    if header_file is not None or not instead:
        header = GridHeader.read(header_file or path.with_suffix(".hdr"))
        if header.first(*WEST_KEYS) is None:
            header = GridHeader(header.where, {**instead, **header.values})
    faults = header.faults
    crs = grid_crs(path, declared.crs)
    rows, cols = header.whole("NROWS", low=1), header.whole("NCOLS", low=1)
    lattice = header.lattice(crs, rows, cols)
    if (bands := header.whole("NBANDS", 1)) not in (1, None):
        faults.add(header.where, "one band per file", f"NBANDS {bands}")
    dtype = _dtype(path, header)
    nodata = declared.nodata, header.nodata("NODATA", "NODATA_VALUE")
    skip_bytes = header.whole("SKIPBYTES", 0)
    if skip_bytes is not None and skip_bytes > _LARGEST_SKIP_BYTES:
        faults.add(f"{header.where}, SKIPBYTES", f"at most {_LARGEST_SKIP_BYTES}", skip_bytes)
    if rows is None or cols is None or dtype is None or skip_bytes is None:
        raise InputError(tuple(faults.found))
    bits = 8 * np.dtype(dtype).itemsize
    pixels_bytes = cols * bits // 8
    row_bytes = header.whole("TOTALROWBYTES", pixels_bytes)
    if row_bytes is None:
        raise InputError(tuple(faults.found))
    if row_bytes < pixels_bytes:
        expected = f"at least {pixels_bytes} for {cols} pixels of {bits} bits"
        faults.add(f"{header.where}, TOTALROWBYTES", expected, row_bytes)
    size = path.stat().st_size
    # The last row need not be filled up.
    least = skip_bytes + (rows - 1) * row_bytes + pixels_bytes
    most = max(skip_bytes + rows * row_bytes, least)
    if not least <= size <= most:
        hint = "the header is of another file, or NBITS, NROWS or NCOLS is wrong"
        if size < least:
            hint = "the file is cut off, or the header is of another"
        faults.add(str(path), f"{most} bytes for {rows} rows of {row_bytes}", f"{size} bytes", hint)
    faults.raise_if_any(InputError)
    return RawGrid(
        path,
        (cell_id,),
        cast(Lattice, lattice),
        tuple(empty for empty in nodata if empty is not None),
        tuple(filter(None, (path, header_file, file_beside(path, ".prj", ".PRJ")))),
        bits=bits,
        dtype=dtype,
        skip_bytes=skip_bytes,
        row_bytes=row_bytes,
    )


def _dtype(path: Path, header: GridHeader) -> str | None:
    bits = header.whole("NBITS", 32 if path.suffix.lower() == ".flt" else 8)
    order_text = header.values.get("BYTEORDER", "I").upper()
    # Without a type, 16 bits are mostly signed, and 32 mostly real, as GDAL takes them, too.
    default = {8: "UNSIGNEDINT", 16: "SIGNEDINT"}.get(bits or 0, "FLOAT")
    kind = header.values.get("PIXELTYPE", default).upper()
    kind = {"SIGNED": "SIGNEDINT", "UNSIGNED": "UNSIGNEDINT"}.get(kind, kind)
    order = _ORDERS.get(order_text)
    if order is None:
        header.faults.add(f"{header.where}, BYTEORDER", "I or M", repr(order_text[:20]))
    found = _TYPES.get(kind, {}).get(bits or 0)
    if found is None and bits is not None:
        expected = "NBITS 8, 16 or 32, and PIXELTYPE SIGNEDINT, UNSIGNEDINT or FLOAT"
        header.faults.add(header.where, expected, f"{bits} and {kind[:20]}")
    return f"{order}{found}" if order and found else None
