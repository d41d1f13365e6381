"""Plain grids: raw pixels with an ESRI header (``.bil``, ``.flt``), ESRI ASCII grids (``.asc``).

GDAL reads these formats, too, but fills raw pixels that were cut off with zeros, reads text that is
no number as 0 and ignores surplus numbers; here each of these is an error.

Headers hold a key and a value per line. They place the grid by the lower left pixel's corner or
centre (``XLLCORNER``, ``XLLCENTER``) or by the upper left pixel's *centre* (``ULXMAP``), whose
corner lies half a pixel to the north-west.

References
----------
Esri, "BIL, BIP, and BSQ raster files" and "ASCII raster file format" (ArcGIS help).
"""

from __future__ import annotations

from abc import abstractmethod
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import takewhile
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from pyproj import CRS
from pyproj.exceptions import CRSError

from mapfilter._inputs import open_input, read_input
from mapfilter._types import Floats32, Ints
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import Lattice, projected_crs, same_crs
from mapfilter.radio.tables import number
from mapfilter.rasters.files import Declared, RasterFile, Window, without_nodata

_LARGEST_HEADER_BYTES = 1 << 16
_LONGEST_VALUE = 60
_MOST_PX = 10_000_000
_FARTHEST_M = 1e8
_SQUARE_TOLERANCE = 1e-6
_DEGREES_STEP = 0.05
_WEST_KEYS = ("ULXMAP", "XLLCORNER", "XLLCENTER", "XLLCENTRE")
_NORTH_KEYS = ("ULYMAP", "YLLCORNER", "YLLCENTER", "YLLCENTRE")
_SIDE_KEYS = ("XDIM", "YDIM", "DX", "DY", "CELLSIZE")
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
class GridHeader:
    """The header of the file ``where``: keys in capitals with their values, as texts.

    Faults of the requested values are added to ``faults``.
    """

    where: str
    values: Mapping[str, str]
    faults: Faults = field(default_factory=Faults, compare=False)

    @classmethod
    def of(cls, where: str, lines: Sequence[bytes]) -> GridHeader:
        """Split the lines of a header; a line without a value, or a comment, is ignored."""
        values: dict[str, str] = {}
        for line in lines:
            words = line.decode("utf-8", "replace").replace("=", " ").split(None, 2)
            if len(words) >= 2:
                values.setdefault(words[0].upper(), words[1])
        return cls(where, values)

    @classmethod
    def read(cls, path: Path) -> GridHeader:
        """Read the header file of raw pixels."""
        return cls.of(str(path), read_input(path, _LARGEST_HEADER_BYTES, "a header").splitlines())

    def first(self, *keys: str) -> str | None:
        """Return the first of some keys that is there."""
        return next((key for key in keys if key in self.values), None)

    def number(self, key: str) -> float | None:
        """Return a value as a finite number, or None with a fault."""
        text = self.values[key]
        # A comma can only be a decimal one here: values end at blanks.
        value = number(text, decimal_comma=True)
        if value is None:
            self.faults.add(f"{self.where}, {key}", "a number", repr(text[:_LONGEST_VALUE]))
        return value

    def whole(
        self, key: str, default: int | None = None, *, low: int = 0, high: int = _MOST_PX
    ) -> int | None:
        """Return a value as a whole number in a range, or None with a fault."""
        if key not in self.values:
            if default is None:
                self.faults.add(self.where, f"a line {key}", "none", "a header that is cut off")
            return default
        value = self.number(key)
        if value is None or (value == int(value) and low <= value <= high):
            return None if value is None else int(value)
        expected, got = f"a whole number in {low}..{high}", self.values[key][:_LONGEST_VALUE]
        self.faults.add(f"{self.where}, {key}", expected, got)
        return None

    def lattice(self, crs: str, rows: int | None, cols: int | None) -> Lattice | None:
        """Return where a grid of so many pixels lies, or None with a fault."""
        side_m = self._side_m()
        west_key, north_key = self.first(*_WEST_KEYS), self.first(*_NORTH_KEYS)
        if west_key is None or north_key is None:
            expected = "XLLCORNER and YLLCORNER, their CENTER, or ULXMAP and ULYMAP"
            self.faults.add(self.where, expected, "not both", "exported without its place")
            return None
        west_m, north_m = self.number(west_key), self.number(north_key)
        if side_m is None or west_m is None or north_m is None or rows is None or cols is None:
            return None
        if not west_key.endswith("CORNER"):
            west_m -= side_m / 2
        if north_key == "ULYMAP":
            north_m += side_m / 2
        else:
            half_m = 0.0 if north_key.endswith("CORNER") else side_m / 2
            north_m = north_m + rows * side_m - half_m
        if max(abs(west_m), abs(north_m), rows * side_m, cols * side_m) > _FARTHEST_M:
            got = f"{west_m:g}, {north_m:g} and {rows} x {cols} pixels of {side_m:g} m"
            self.faults.add(self.where, f"a grid within {_FARTHEST_M:g} m of the origin", got)
            return None
        if side_m < _DEGREES_STEP and max(abs(west_m), abs(north_m)) <= 180:
            got, hint = f"pixels of {side_m:g}", "degrees given for metres"
            self.faults.add(self.where, f"metres in {crs}", got, hint)
            return None
        return Lattice(crs, west_m, north_m, side_m, rows, cols)

    def _side_m(self) -> float | None:
        found = [key for key in _SIDE_KEYS if key in self.values][:2]
        if not found or (len(found) == 1 and found[0] != "CELLSIZE"):
            expected = "the size of a pixel: CELLSIZE, or XDIM and YDIM"
            self.faults.add(self.where, expected, "none")
            return None
        sides_m = [side for key in found if (side := self.number(key)) is not None]
        if len(sides_m) < len(found):
            return None
        if not 0 < min(sides_m) <= _FARTHEST_M:
            self.faults.add(f"{self.where}, {found[0]}", "metres > 0", f"{sides_m[0]:g}")
            return None
        if max(sides_m) - min(sides_m) > _SQUARE_TOLERANCE * max(sides_m):
            got = " x ".join(f"{side:g}" for side in sides_m)
            self.faults.add(self.where, "square pixels", got)
            return None
        return sides_m[0]


def _beside(path: Path, *suffixes: str) -> Path | None:
    """Return the file of the same name with one of some suffixes, if there is one."""
    return next((p for s in suffixes if (p := path.with_suffix(s)).is_file()), None)


def _grid_crs(path: Path, declared: str | None) -> str:
    """Return the CRS in the ``.prj`` file beside a plain grid, else the declared one."""
    found = _beside(path, ".prj", ".PRJ")
    if found is None:
        if declared is None:
            hint = "plain grids have none; set crs in [rasters]"
            raise fail(InputError, f"{path}, CRS", "a projected CRS in metres", "none", hint)
        return declared
    try:
        text = read_input(found, _LARGEST_HEADER_BYTES, "a CRS").decode("utf-8-sig").strip()
        stated = CRS.from_user_input(text)
    except (CRSError, UnicodeDecodeError, OSError, ValueError) as error:
        if declared is not None:
            return declared
        expected = "a CRS as well-known text"
        raise fail(InputError, str(found), expected, "none that is known", "set crs") from error
    # The dialect of these files names datums in its own way, so that nothing matches exactly.
    code = stated.to_epsg(min_confidence=70)
    crs = projected_crs(code or stated, str(found))
    if declared is not None and not same_crs(crs, declared):
        hint = "two systems mixed up"
        raise fail(InputError, str(found), f"{declared}, as declared", crs, hint)
    return declared or crs


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
    header_file = _beside(path, ".HDR", ".hdr")
    where, instead = declared.header or ("", {})
    header = GridHeader(where, instead)
    if header_file is not None or not instead:
        header = GridHeader.read(header_file or path.with_suffix(".hdr"))
        if header.first(*_WEST_KEYS) is None:
            header = GridHeader(header.where, {**instead, **header.values})
    faults = header.faults
    crs = _grid_crs(path, declared.crs)
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
        tuple(empty for empty in nodata if empty is not None),
        tuple(filter(None, (path, header_file, _beside(path, ".prj", ".PRJ")))),
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
        with open_input(self.path) as stream:
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
    with open_input(path) as stream:
        head = stream.read(_LARGEST_ASCII_HEADER_BYTES)
    lines = head.splitlines(keepends=True)[:_MOST_HEADER_LINES]
    lines = list(takewhile(lambda line: line.strip()[:1].isalpha(), lines))
    header, header_bytes = GridHeader.of(str(path), lines), sum(map(len, lines))
    if "NCOLS" not in header.values or "NROWS" not in header.values:
        raise fail(InputError, str(path), "lines NCOLS and NROWS first", "none", "no ASCII grid")
    crs, faults = _grid_crs(path, declared.crs), header.faults
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
    parts = tuple(filter(None, (path, _beside(path, ".prj", ".PRJ"))))
    place = cast(Lattice, lattice)
    return AsciiGrid(path, (cell_id,), place, nodata, parts, header_bytes=header_bytes)


@lru_cache(maxsize=1024)
def _row_starts(path: Path, _changed_ns: int, header_bytes: int, rows: int) -> Ints:
    """Return where each row begins, and the end of the last; the file is read through once."""
    ends, expected = array("q", [header_bytes]), f"{rows} lines of numbers"
    with open_input(path) as stream:
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
