"""Plain grids: raw pixels with an ESRI header (``.bil``, ``.flt``), ESRI ASCII grids (``.asc``).

GDAL reads these formats, too, but fills raw pixels that were cut off with zeros, reads text that is
no number as 0 and ignores surplus numbers; here each of these is an error.

References
----------
Esri, "BIL, BIP, and BSQ raster files" and "ASCII raster file format" (ArcGIS help).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import cast

import numpy as np

from mapfilter._types import Floats32, Ints
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import Lattice
from mapfilter.rasters.files import Declared, RasterFile, Window, without_nodata
from mapfilter.rasters.grid_header import WEST_KEYS, GridHeader, beside, grid_crs, grid_lattice

_ORDERS = {"I": "<", "LSBFIRST": "<", "M": ">", "MSBFIRST": ">"}
_TYPES = {
    "SIGNEDINT": {8: "i1", 16: "i2", 32: "i4"},
    "UNSIGNEDINT": {8: "u1", 16: "u2", 32: "u4"},
    "FLOAT": {32: "f4", 64: "f8"},
}
_LARGEST_SKIP_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class RawGrid(RasterFile):
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

    def read(self, bands: Sequence[int], window: Window) -> Floats32:
        """Read a window row by row; see :meth:`RasterFile.read`."""
        row, col, rows, cols = window
        values = np.empty((rows, cols), dtype=self.dtype)
        start = self.skip_bytes + col * values.itemsize
        try:
            with self.path.open("rb", buffering=0) as stream:
                for i in range(rows):
                    stream.seek(start + (row + i) * self.row_bytes)
                    if stream.readinto(values[i].view(np.uint8)) != values[i].nbytes:
                        got = f"the end in row {row + i + 1}"
                        raise fail(InputError, str(self.path), "all rows", got, "cut off")
        except OSError as error:
            got = error.strerror or str(error)
            raise fail(InputError, str(self.path), "readable pixels", got) from error
        with np.errstate(over="ignore", invalid="ignore"):
            found = without_nodata(values.astype(np.float32), self.nodata)
        return np.repeat(found[np.newaxis], len(bands), axis=0)


def open_raw_grid(
    path: Path, cell_id: str, declared: Declared, instead: GridHeader | None = None
) -> RawGrid:
    """Read the header of raw pixels and compare it with the file.

    Parameters
    ----------
    path : Path
        The ``.bil`` or ``.flt`` file; its header lies beside it.
    declared : Declared
        CRS of files without a ``.prj`` beside them; a number that means no data.
    instead : GridHeader, optional
        Used where there is no header, or one without the place.

    Raises
    ------
    InputError
        With every fault: no header, an unknown type of pixels, several bands, a place or size that
        makes no sense, a file shorter or longer than its header requires.
    """
    header_file = beside(path, ".HDR", ".hdr")
    if instead is None or header_file is not None:
        header = GridHeader.read(header_file or path.with_suffix(".hdr"))
        if instead is not None and header.first(*WEST_KEYS) is None:
            header = GridHeader(header.where, {**instead.values, **header.values})
    else:
        header = instead
    faults = Faults()
    crs = grid_crs(path, declared.crs)
    rows, cols = header.whole("NROWS", faults, low=1), header.whole("NCOLS", faults, low=1)
    lattice = grid_lattice(header, crs, rows, cols, faults)
    if (bands := header.whole("NBANDS", faults, 1)) not in (1, None):
        faults.add(header.where, "one band per file", f"NBANDS {bands}")
    dtype = _dtype(path, header, faults)
    nodata = [] if declared.nodata is None else [declared.nodata]
    if key := header.first("NODATA", "NODATA_VALUE"):
        own = header.number(key, faults)
        nodata += [] if own is None else [own]
    skip_bytes = header.whole("SKIPBYTES", faults, 0)
    if skip_bytes is not None and skip_bytes > _LARGEST_SKIP_BYTES:
        faults.add(f"{header.where}, SKIPBYTES", f"at most {_LARGEST_SKIP_BYTES}", skip_bytes)
    if rows is None or cols is None or dtype is None or skip_bytes is None:
        raise InputError(tuple(faults.found))
    bits = 8 * np.dtype(dtype).itemsize
    pixels_bytes = cols * bits // 8
    row_bytes = header.whole("TOTALROWBYTES", faults, pixels_bytes) or 0
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
        tuple(nodata),
        tuple(filter(None, (path, header_file, beside(path, ".prj", ".PRJ")))),
        bits=bits,
        dtype=dtype,
        skip_bytes=skip_bytes,
        row_bytes=row_bytes,
    )


def _dtype(path: Path, header: GridHeader, faults: Faults) -> str | None:
    bits = header.whole("NBITS", faults, 32 if path.suffix.lower() == ".flt" else 8)
    order_text = header.values.get("BYTEORDER", "I").upper()
    # Without a type, 16 bits are mostly signed, and 32 mostly real, as GDAL takes them, too.
    default = {8: "UNSIGNEDINT", 16: "SIGNEDINT"}.get(bits or 0, "FLOAT")
    kind = header.values.get("PIXELTYPE", default).upper()
    kind = {"SIGNED": "SIGNEDINT", "UNSIGNED": "UNSIGNEDINT"}.get(kind, kind)
    order = _ORDERS.get(order_text)
    if order is None:
        faults.add(f"{header.where}, BYTEORDER", "I or M", repr(order_text[:20]))
    found = _TYPES.get(kind, {}).get(bits or 0)
    if found is None and bits is not None:
        expected = "NBITS 8, 16 or 32, and PIXELTYPE SIGNEDINT, UNSIGNEDINT or FLOAT"
        faults.add(header.where, expected, f"{bits} and {kind[:20]}")
    return f"{order}{found}" if order and found else None


_NODATA = -9999.0
_LARGEST_ASCII_HEADER_BYTES = 4096
_MOST_HEADER_LINES = 12
_MOST_COLS = 1_000_000
_LONGEST_NUMBER = 64
_CHUNK_BYTES = 1 << 22


@dataclass(frozen=True, slots=True)
class AsciiGrid(RasterFile):
    """One grid of numbers written as text; the first row begins after ``header_bytes``."""

    header_bytes: int = 0

    def read(self, bands: Sequence[int], window: Window) -> Floats32:
        """Read a window line by line; see :meth:`RasterFile.read`."""
        row, col, rows, cols = window
        values = np.empty((rows, cols), dtype=np.float64)
        try:
            status = self.path.stat()
            starts = _row_starts(
                self.path, status.st_size, status.st_mtime_ns, self.header_bytes, self.lattice.rows
            )
            with self.path.open("rb") as stream:
                for i in range(row, row + rows):
                    stream.seek(int(starts[i]))
                    line = stream.read(int(starts[i + 1] - starts[i]))
                    values[i - row] = self._numbers(line, i, slice(col, col + cols))
        except OSError as error:
            got = error.strerror or str(error)
            raise fail(InputError, str(self.path), "readable pixels", got) from error
        with np.errstate(over="ignore"):
            found = without_nodata(values.astype(np.float32), self.nodata)
        return np.repeat(found[np.newaxis], len(bands), axis=0)

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


def open_ascii_grid(
    path: Path, cell_id: str, declared: Declared, _instead: GridHeader | None = None
) -> AsciiGrid:
    """Read the header of an ESRI ASCII grid; numbers that mean no data are -9999 by default.

    Raises
    ------
    InputError
        With every fault: no such header, a place or size that makes no sense, fewer bytes than
        the pixels need.
    """
    try:
        size = path.stat().st_size
        with path.open("rb") as stream:
            head = stream.read(_LARGEST_ASCII_HEADER_BYTES)
    except OSError as error:
        raise fail(InputError, str(path), "a readable file", error.strerror or error) from error
    lines = []
    for line in head.splitlines(keepends=True)[:_MOST_HEADER_LINES]:
        if not line.strip()[:1].isalpha():
            break
        lines.append(line)
    header_bytes = sum(map(len, lines))
    header, faults = GridHeader.of(str(path), lines), Faults()
    if "NCOLS" not in header.values or "NROWS" not in header.values:
        raise fail(InputError, str(path), "lines NCOLS and NROWS first", "none", "no ASCII grid")
    crs = grid_crs(path, declared.crs)
    rows, cols = header.whole("NROWS", faults, low=1), header.whole("NCOLS", faults, low=1)
    lattice = grid_lattice(header, crs, rows, cols, faults)
    key = header.first("NODATA_VALUE", "NODATA")
    own = _NODATA if key is None else header.number(key, faults) or 0.0
    if cols is not None and cols > _MOST_COLS:
        faults.add(f"{path}, NCOLS", f"at most {_MOST_COLS}", cols)
    if rows is not None and cols is not None and 2 * rows * cols - 1 > size - header_bytes:
        expected = f"at least {2 * rows * cols - 1} bytes for {rows} x {cols} numbers"
        hint = "the file is cut off, or its header is damaged"
        faults.add(str(path), expected, f"{size - header_bytes} bytes", hint)
    faults.raise_if_any(InputError)
    nodata = (own,) if declared.nodata is None else (own, declared.nodata)
    parts = tuple(filter(None, (path, beside(path, ".prj", ".PRJ"))))
    place = cast(Lattice, lattice)
    return AsciiGrid(path, (cell_id,), place, nodata, parts, header_bytes=header_bytes)


@lru_cache(maxsize=1024)
def _row_starts(path: Path, size: int, _modified_ns: int, header_bytes: int, rows: int) -> Ints:
    """Return where each row begins, and the end of the last; the file is read through once."""
    ends = [np.array([header_bytes], dtype=np.int64)]
    found, at = 0, header_bytes
    with path.open("rb") as stream:
        stream.seek(header_bytes)
        while found <= rows and (chunk := stream.read(_CHUNK_BYTES)):
            newlines = np.flatnonzero(np.frombuffer(chunk, dtype=np.uint8) == ord("\n"))
            ends.append(newlines.astype(np.int64) + at + 1)
            found += newlines.size
            at += len(chunk)
        starts = np.concatenate(ends)
        if starts.size == rows and starts[-1] < size:
            starts = np.append(starts, size)
        extra_bytes = size - int(starts[rows]) if starts.size > rows else 0
        stream.seek(size - extra_bytes)
        blank = not stream.read(_CHUNK_BYTES).strip()
    if starts.size <= rows:
        got, hint = f"{starts.size - 1}", "the file is cut off, or rows are broken over lines"
        raise fail(InputError, str(path), f"{rows} lines of numbers", got, hint)
    if not blank or extra_bytes > _CHUNK_BYTES:
        hint = "NROWS is wrong, or rows are broken over lines"
        raise fail(InputError, str(path), f"{rows} lines of numbers", "more", hint)
    return starts[: rows + 1]
