"""Plain grids: raw pixels with an ESRI header (``.bil``, ``.flt``), ESRI ASCII grids (``.asc``).

GDAL reads these formats, too, but fills raw pixels that were cut off with zeros, reads text that is
no number as 0 and ignores surplus numbers; here each of these is an error.

References
----------
Esri, "BIL, BIP, and BSQ raster files" and "ASCII raster file format" (ArcGIS help).
"""

from __future__ import annotations

from abc import abstractmethod
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import takewhile
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from mapfilter._types import Floats32, Ints
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import Lattice
from mapfilter.rasters.files import Declared, RasterFile, Window, without_nodata
from mapfilter.rasters.grid_header import WEST_KEYS, GridHeader, beside, grid_crs

_ORDERS = {"I": "<", "LSBFIRST": "<", "M": ">", "MSBFIRST": ">"}
_TYPES = {
    "SIGNEDINT": {8: "i1", 16: "i2", 32: "i4"},
    "UNSIGNEDINT": {8: "u1", 16: "u2", 32: "u4"},
    "FLOAT": {32: "f4", 64: "f8"},
}
_LARGEST_SKIP_BYTES = 1 << 20
_NODATA = -9999.0
_LARGEST_ASCII_HEADER_BYTES = 4096
_MOST_HEADER_LINES = 12
_MOST_COLS = 1_000_000
_LONGEST_NUMBER = 64


@dataclass(frozen=True, slots=True)
class _PlainGrid(RasterFile):
    """One band, without a mask."""

    def read(self, bands: Sequence[int], window: Window) -> Floats32:
        """Read a window; see :meth:`RasterFile.read`."""
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                values = self._pixels(*window).astype(np.float32)
        except OSError as error:
            got = error.strerror or str(error)
            raise fail(InputError, str(self.path), "readable pixels", got) from error
        found = without_nodata(values, self.nodata)
        return np.repeat(found[np.newaxis], len(bands), axis=0)

    @abstractmethod
    def _pixels(self, row: int, col: int, rows: int, cols: int) -> NDArray[Any]:
        """Read numbers as stored."""


@dataclass(frozen=True, slots=True)
class RawGrid(_PlainGrid):
    """One band of raw pixels.

    Parameters
    ----------
    dtype : str
        NumPy's text for the type of a pixel, such as ``">i2"``.
    skip_bytes, row_bytes : int
        What lies before the first row, and from each row to the next.
    """

    dtype: str = "<i2"
    skip_bytes: int = 0
    row_bytes: int = 0

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
    header_file, instead = beside(path, ".HDR", ".hdr"), declared.header
    header = instead
    if header is None or header_file is not None:
        header = GridHeader.read(header_file or path.with_suffix(".hdr"))
        if instead is not None and header.first(*WEST_KEYS) is None:
            header = GridHeader(header.where, {**instead.values, **header.values})
    faults = header.faults
    crs = grid_crs(path, declared.crs)
    rows, cols = header.whole("NROWS", low=1), header.whole("NCOLS", low=1)
    lattice = header.lattice(crs, rows, cols)
    if (bands := header.whole("NBANDS", 1)) not in (1, None):
        faults.add(header.where, "one band per file", f"NBANDS {bands}")
    dtype = _dtype(path, header)
    key = header.first("NODATA", "NODATA_VALUE")
    nodata = declared.nodata, header.number(key) if key else None
    skip_bytes = header.whole("SKIPBYTES", 0)
    if skip_bytes is not None and skip_bytes > _LARGEST_SKIP_BYTES:
        faults.add(f"{header.where}, SKIPBYTES", f"at most {_LARGEST_SKIP_BYTES}", skip_bytes)
    if rows is None or cols is None or dtype is None or skip_bytes is None:
        raise InputError(tuple(faults.found))
    bits = 8 * np.dtype(dtype).itemsize
    pixels_bytes = cols * bits // 8
    row_bytes = header.whole("TOTALROWBYTES", pixels_bytes) or 0
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
        tuple(number for number in nodata if number is not None),
        tuple(filter(None, (path, header_file, beside(path, ".prj", ".PRJ")))),
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


@dataclass(frozen=True, slots=True)
class AsciiGrid(_PlainGrid):
    """One grid of numbers written as text; the first row begins after ``header_bytes``."""

    header_bytes: int = 0

    def _pixels(self, row: int, col: int, rows: int, cols: int) -> NDArray[Any]:
        changed_ns = self.path.stat().st_mtime_ns
        starts = _row_starts(self.path, changed_ns, self.header_bytes, self.lattice.rows)
        values = np.empty((rows, cols), dtype=np.float64)
        with self.path.open("rb") as stream:
            for i in range(rows):
                stream.seek(int(starts[row + i]))
                line = stream.read(int(starts[row + i + 1] - starts[row + i]))
                values[i] = self._numbers(line, row + i, slice(col, col + cols))
        return values

    def _numbers(self, line: bytes, row: int, wanted: slice) -> Sequence[float]:
        cols, where = self.lattice.cols, f"{self.path} row {row + 1}"
        if len(line) > cols * _LONGEST_NUMBER:
            got = f"{len(line)} bytes"
            raise fail(InputError, where, f"{cols} numbers", got, "rows run together")
        fields = line.replace(b",", b".").split(None, cols)
        if len(fields) != cols:
            more = len(fields) > cols
            hint = "NCOLS is wrong, or rows run together" if more else "cut off, or NCOLS is wrong"
            raise fail(InputError, where, f"{cols} numbers", "more" if more else len(fields), hint)
        try:
            return [float(b"?" if b"_" in field else field) for field in fields[wanted]]
        except ValueError as error:
            expected = f"{cols} numbers"
            raise fail(InputError, where, expected, "something else", "damaged") from error


def open_ascii_grid(path: Path, cell_id: str, declared: Declared) -> AsciiGrid:
    """Read the header of an ESRI ASCII grid; numbers that mean no data are -9999 by default.

    Raises
    ------
    InputError
        With every fault: no such header, a place or size that makes no sense, fewer bytes than
        the pixels need.
    """
    with path.open("rb") as stream:
        head = stream.read(_LARGEST_ASCII_HEADER_BYTES)
    lines = head.splitlines(keepends=True)[:_MOST_HEADER_LINES]
    lines = list(takewhile(lambda line: line.strip()[:1].isalpha(), lines))
    header, header_bytes = GridHeader.of(str(path), lines), sum(map(len, lines))
    if "NCOLS" not in header.values or "NROWS" not in header.values:
        raise fail(InputError, str(path), "lines NCOLS and NROWS first", "none", "no ASCII grid")
    crs, faults = grid_crs(path, declared.crs), header.faults
    rows, cols = header.whole("NROWS", low=1), header.whole("NCOLS", low=1)
    lattice = header.lattice(crs, rows, cols)
    key = header.first("NODATA_VALUE", "NODATA")
    own = _NODATA if key is None else header.number(key) or 0.0
    if cols is not None and cols > _MOST_COLS:
        faults.add(f"{path}, NCOLS", f"at most {_MOST_COLS}", cols)
    found_bytes = path.stat().st_size - header_bytes
    if rows is not None and cols is not None and 2 * rows * cols - 1 > found_bytes:
        expected = f"at least {2 * rows * cols - 1} bytes for {rows} x {cols} numbers"
        hint = "the file is cut off, or its header is damaged"
        faults.add(str(path), expected, f"{found_bytes} bytes", hint)
    faults.raise_if_any(InputError)
    nodata = (own,) if declared.nodata is None else (own, declared.nodata)
    parts = tuple(filter(None, (path, beside(path, ".prj", ".PRJ"))))
    place = cast(Lattice, lattice)
    return AsciiGrid(path, (cell_id,), place, nodata, parts, header_bytes=header_bytes)


@lru_cache(maxsize=1024)
def _row_starts(path: Path, _changed_ns: int, header_bytes: int, rows: int) -> Ints:
    """Return where each row begins, and the end of the last; the file is read through once."""
    ends, expected = array("q", [header_bytes]), f"{rows} lines of numbers"
    with path.open("rb") as stream:
        stream.seek(header_bytes)
        for line in stream:
            if len(ends) <= rows:
                ends.append(ends[-1] + len(line))
            elif line.strip():
                hint = "NROWS is wrong, or rows are broken over lines"
                raise fail(InputError, str(path), expected, "more", hint)
    if len(ends) <= rows:
        got, hint = f"{len(ends) - 1}", "the file is cut off, or rows are broken over lines"
        raise fail(InputError, str(path), expected, got, hint)
    return np.array(ends, dtype=np.int64)
