"""Headers of plain grids, a key and a value per line: ESRI ASCII grids, HDR files of raw pixels.

Both place the grid by the lower left pixel's corner or centre (``XLLCORNER``, ``XLLCENTER``) or by
the upper left pixel's centre (``ULXMAP``).

``ULXMAP`` and ``ULYMAP`` are the *centre* of the upper left pixel, so its corner lies half a pixel
to the north-west of them.

References
----------
Esri, "BIL, BIP, and BSQ raster files" (ArcGIS help).

The rows begin in the north, although the header gives the lower left pixel: its corner
(``XLLCORNER``) or its centre (``XLLCENTER``).

References
----------
Esri, "ASCII raster file format" (ArcGIS help).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import cast

import numpy as np
from pyproj import CRS
from pyproj.exceptions import CRSError

from mapfilter._types import Floats32, Ints
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import Lattice, projected_crs, same_crs
from mapfilter.rasters.files import Window, existing, without_nodata

_LARGEST_HEADER_BYTES = 1 << 16
_LONGEST_VALUE = 60
_MOST_PX = 10_000_000
_FARTHEST_M = 1e8
_SQUARE_TOLERANCE = 1e-6
_DEGREES_STEP = 0.05


@dataclass(frozen=True, slots=True)
class GridHeader:
    """Keys in capitals with their values, as texts.

    Parameters
    ----------
    where : str
        The file.
    values : mapping of str to str
    """

    where: str
    values: Mapping[str, str]

    @classmethod
    def of(cls, where: str, lines: Sequence[bytes]) -> GridHeader:
        """Split the lines of a header; a line without a value, or a comment, is passed over."""
        values: dict[str, str] = {}
        for line in lines:
            words = line.decode("utf-8", "replace").replace("=", " ").split(None, 2)
            if len(words) >= 2:
                values.setdefault(words[0].upper(), words[1])
        return cls(where, values)

    @classmethod
    def read(cls, path: Path) -> GridHeader:
        """Read the header file of raw pixels.

        Raises
        ------
        InputError
            The file is missing or too large for a header.
        """
        try:
            with path.open("rb") as stream:
                data = stream.read(_LARGEST_HEADER_BYTES + 1)
        except OSError as error:
            raise fail(InputError, str(path), "a readable file", error.strerror or error) from error
        if len(data) > _LARGEST_HEADER_BYTES:
            raise fail(InputError, str(path), "a header of at most 64 KiB", "a larger file")
        return cls.of(str(path), data.splitlines())

    def first(self, *keys: str) -> str | None:
        """Return the first of some keys that is there."""
        return next((key for key in keys if key in self.values), None)

    def number(self, key: str, faults: Faults) -> float | None:
        """Return a value as a finite number; a fault is noted when it is none."""
        text = self.values[key]
        try:
            # A comma can only be a decimal one here: values end at blanks.
            value = float("?" if "_" in text else text.replace(",", "."))
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            faults.add(f"{self.where}, {key}", "a number", repr(text[:_LONGEST_VALUE]))
            return None
        return value

    def whole(
        self, key: str, faults: Faults, default: int | None = None, *, low: int = 0
    ) -> int | None:
        """Return a value as a whole number in ``low`` to 10 million, else note a fault."""
        if key not in self.values:
            if default is None:
                faults.add(self.where, f"a line {key}", "none", "a header that is cut off")
            return default
        value = self.number(key, faults)
        if value is None:
            return None
        if value != int(value) or not low <= value <= _MOST_PX:
            expected = f"a whole number in {low}..{_MOST_PX}"
            faults.add(f"{self.where}, {key}", expected, self.values[key][:_LONGEST_VALUE])
            return None
        return int(value)


def is_placed(header: GridHeader) -> bool:
    """Tell whether a header says where its grid lies."""
    return header.first("ULXMAP", "XLLCORNER", "XLLCENTER", "XLLCENTRE") is not None


def grid_lattice(
    header: GridHeader, crs: str, rows: int | None, cols: int | None, faults: Faults
) -> Lattice | None:
    """Return where a grid lies; what is wrong is added to ``faults``."""
    side_m = _side_m(header, faults)
    west_key = header.first("ULXMAP", "XLLCORNER", "XLLCENTER", "XLLCENTRE")
    north_key = header.first("ULYMAP", "YLLCORNER", "YLLCENTER", "YLLCENTRE")
    if west_key is None or north_key is None:
        expected = "XLLCORNER and YLLCORNER, their CENTER, or ULXMAP and ULYMAP"
        faults.add(header.where, expected, "not both", "exported without its place")
        return None
    west_m, north_m = header.number(west_key, faults), header.number(north_key, faults)
    if side_m is None or west_m is None or north_m is None or rows is None or cols is None:
        return None
    if not west_key.endswith("CORNER"):
        west_m -= side_m / 2
    if north_key == "ULYMAP":
        north_m += side_m / 2
    else:
        north_m += rows * side_m
        if not north_key.endswith("CORNER"):
            north_m -= side_m / 2
    if max(abs(west_m), abs(north_m), rows * side_m, cols * side_m) > _FARTHEST_M:
        got = f"{west_m:g}, {north_m:g} and {rows} x {cols} pixels of {side_m:g} m"
        faults.add(header.where, f"a grid within {_FARTHEST_M:g} m of the origin", got)
        return None
    if side_m < _DEGREES_STEP and max(abs(west_m), abs(north_m)) <= 180:
        got = f"pixels of {side_m:g}"
        faults.add(header.where, f"metres in {crs}", got, "degrees given for metres")
        return None
    return Lattice(crs, west_m, north_m, side_m, rows, cols)


def _side_m(header: GridHeader, faults: Faults) -> float | None:
    keys = [key for pair in (("XDIM", "YDIM"), ("DX", "DY"), ("CELLSIZE",)) for key in pair]
    found = [key for key in keys if key in header.values][:2]
    if not found or (len(found) == 1 and found[0] != "CELLSIZE"):
        faults.add(header.where, "the size of a pixel: CELLSIZE, or XDIM and YDIM", "none")
        return None
    sides_m = [header.number(key, faults) for key in found]
    known = [side for side in sides_m if side is not None]
    if len(known) < len(found):
        return None
    if not 0 < min(known) <= _FARTHEST_M:
        faults.add(f"{header.where}, {found[0]}", "metres > 0", f"{known[0]:g}")
        return None
    if max(known) - min(known) > _SQUARE_TOLERANCE * max(known):
        faults.add(header.where, "square pixels", " x ".join(f"{side:g}" for side in known))
        return None
    return known[0]


def crs_file(path: Path) -> Path | None:
    """Return the file beside a plain grid that tells its CRS, if there is one."""
    return next((p for s in (".prj", ".PRJ") if (p := path.with_suffix(s)).is_file()), None)


def crs_beside(path: Path, declared: str | None) -> str:
    """Return the CRS of a plain grid: that of the ``.prj`` file beside it, else the declared one.

    Raises
    ------
    InputError
        There is neither, or both and they differ, or the file is wrong and nothing is declared.
    """
    found = crs_file(path)
    if found is None:
        if declared is None:
            hint = "plain grids do not tell it; say crs in [rasters]"
            raise fail(InputError, f"{path}, CRS", "a projected CRS in metres", "none", hint)
        return declared
    try:
        text = found.read_bytes()[:_LARGEST_HEADER_BYTES].decode("utf-8-sig").strip()
        told = CRS.from_user_input(text)
    except (CRSError, UnicodeDecodeError, OSError, ValueError) as error:
        if declared is not None:
            return declared
        expected = "a CRS as well-known text"
        raise fail(InputError, str(found), expected, "none that is known", "say crs") from error
    # The dialect of these files names datums in its own way, so that nothing matches exactly.
    code = told.to_epsg(min_confidence=70)
    crs = projected_crs(code or told, str(found))
    if declared is not None and not same_crs(crs, declared):
        hint = "two systems mixed up"
        raise fail(InputError, str(found), f"{declared}, as declared", crs, hint)
    return declared or crs


_ORDERS = {"I": "<", "LSBFIRST": "<", "M": ">", "MSBFIRST": ">"}
_TYPES = {
    (8, "SIGNEDINT"): "i1", (8, "UNSIGNEDINT"): "u1", (16, "SIGNEDINT"): "i2",
    (16, "UNSIGNEDINT"): "u2", (32, "SIGNEDINT"): "i4", (32, "UNSIGNEDINT"): "u4",
    (32, "FLOAT"): "f4", (64, "FLOAT"): "f8",
}  # fmt: skip
_LARGEST_SKIP_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class Bil:
    """One band of raw pixels.

    Parameters
    ----------
    path : Path
    cell_ids : tuple of one str
    lattice : Lattice
    dtype : str
        NumPy's text for the type of a pixel, such as ``">i2"``.
    skip_bytes, row_bytes : int
        What lies before the first row, and from each row to the next.
    nodata : tuple of float
        Numbers that mean no data.
    """

    path: Path
    cell_ids: tuple[str, ...]
    lattice: Lattice
    dtype: str
    skip_bytes: int
    row_bytes: int
    nodata: tuple[float, ...] = ()

    @property
    def bits(self) -> int:
        """Size of a pixel."""
        return 8 * np.dtype(self.dtype).itemsize

    @property
    def parts(self) -> tuple[Path, ...]:
        """The file, its header and its CRS."""
        return existing(self.path, header_of(self.path), crs_file(self.path))

    def read(self, bands: Sequence[int], window: Window) -> Floats32:
        """Read a window row by row; see :class:`~mapfilter.rasters.files.RasterFile`."""
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


def header_of(path: Path) -> Path:
    """Return where the header of raw pixels is, if there is one: same name, ``.hdr``."""
    upper = path.with_suffix(".HDR")
    return upper if upper.is_file() else path.with_suffix(".hdr")


def open_bil(
    path: Path,
    cell_id: str,
    crs: str | None = None,
    nodata: float | None = None,
    *,
    instead: GridHeader | None = None,
) -> Bil:
    """Read the header of raw pixels and compare it with the file.

    Parameters
    ----------
    path : Path
        The ``.bil`` or ``.flt`` file; its header lies beside it.
    cell_id : str
    crs : str, optional
        For files without a ``.prj`` beside them.
    nodata : float, optional
        A number that means no data, besides the header's own.
    instead : GridHeader, optional
        Used where there is no header, or one that does not tell the place.

    Raises
    ------
    InputError
        With every fault: no header, an unknown type of pixels, several bands, a place or size that
        makes no sense, a file shorter or longer than the header tells.
    """
    header = _header(path, instead)
    faults = Faults()
    system = crs_beside(path, crs)
    rows, cols = header.whole("NROWS", faults, low=1), header.whole("NCOLS", faults, low=1)
    lattice = grid_lattice(header, system, rows, cols, faults)
    if (bands := header.whole("NBANDS", faults, 1)) not in (1, None):
        faults.add(header.where, "one band per file", f"NBANDS {bands}")
    dtype = _dtype(path, header, faults)
    empty = [] if nodata is None else [nodata]
    if key := header.first("NODATA", "NODATA_VALUE"):
        own = header.number(key, faults)
        empty += [] if own is None else [own]
    skip_bytes = header.whole("SKIPBYTES", faults, 0)
    if skip_bytes is not None and skip_bytes > _LARGEST_SKIP_BYTES:
        faults.add(f"{header.where}, SKIPBYTES", f"at most {_LARGEST_SKIP_BYTES}", skip_bytes)
    if rows is None or cols is None or dtype is None or skip_bytes is None:
        raise InputError(tuple(faults.found))
    pixel_bytes = np.dtype(dtype).itemsize
    row_bytes = header.whole("TOTALROWBYTES", faults, cols * pixel_bytes) or 0
    if row_bytes < cols * pixel_bytes:
        expected = f"at least {cols * pixel_bytes} for {cols} pixels of {8 * pixel_bytes} bits"
        faults.add(f"{header.where}, TOTALROWBYTES", expected, row_bytes)
    _check_size(path, skip_bytes, rows, row_bytes, cols * pixel_bytes, faults)
    faults.raise_if_any(InputError)
    return Bil(path, (cell_id,), cast(Lattice, lattice), dtype, skip_bytes, row_bytes, tuple(empty))


def _header(path: Path, instead: GridHeader | None) -> GridHeader:
    if instead is not None and not header_of(path).is_file():
        return instead
    header = GridHeader.read(header_of(path))
    if instead is None or is_placed(header):
        return header
    return GridHeader(header.where, {**instead.values, **header.values})


def _check_size(
    path: Path, skip_bytes: int, rows: int, row_bytes: int, pixels_bytes: int, faults: Faults
) -> None:
    """Note a fault when a file is not as long as its rows; the last one need not be filled up."""
    try:
        size = path.stat().st_size
    except OSError as error:
        faults.add(str(path), "a readable file", error.strerror or str(error))
        return
    least = skip_bytes + (rows - 1) * row_bytes + pixels_bytes
    most = max(skip_bytes + rows * row_bytes, least)
    if not least <= size <= most:
        hint = "the file is cut off, or the header is of another" if size < least else (
            "the header is of another file, or NBITS, NROWS or NCOLS is wrong"
        )  # fmt: skip
        faults.add(str(path), f"{most} bytes for {rows} rows of {row_bytes}", f"{size} bytes", hint)


def _dtype(path: Path, header: GridHeader, faults: Faults) -> str | None:
    floating = path.suffix.lower() == ".flt"
    bits = header.whole("NBITS", faults, 32 if floating else 8)
    order_text = header.values.get("BYTEORDER", "I").upper()
    # Without a type, 16 bits are mostly signed, and 32 mostly real, as GDAL takes them, too.
    default = {8: "UNSIGNEDINT", 16: "SIGNEDINT"}.get(bits or 0, "FLOAT")
    kind = header.values.get("PIXELTYPE", default).upper()
    kind = {"SIGNED": "SIGNEDINT", "UNSIGNED": "UNSIGNEDINT"}.get(kind, kind)
    order = _ORDERS.get(order_text)
    if order is None:
        faults.add(f"{header.where}, BYTEORDER", "I or M", repr(order_text[:20]))
    found = _TYPES.get((bits or 0, kind))
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
_NEWLINE = ord("\n")


@dataclass(frozen=True, slots=True)
class AsciiGrid:
    """One grid of numbers written as text.

    Parameters
    ----------
    path : Path
    cell_ids : tuple of one str
    lattice : Lattice
    header_bytes : int
        Where the first row begins.
    nodata : tuple of float
        Numbers that mean no data.
    """

    path: Path
    cell_ids: tuple[str, ...]
    lattice: Lattice
    header_bytes: int
    nodata: tuple[float, ...]

    @property
    def parts(self) -> tuple[Path, ...]:
        """The file and its CRS."""
        return existing(self.path, crs_file(self.path))

    def read(self, bands: Sequence[int], window: Window) -> Floats32:
        """Read a window line by line; see :class:`~mapfilter.rasters.files.RasterFile`."""
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
                    values[i - row] = self._numbers(
                        stream.read(int(starts[i + 1] - starts[i])), i, col, cols
                    )
        except OSError as error:
            got = error.strerror or str(error)
            raise fail(InputError, str(self.path), "readable pixels", got) from error
        with np.errstate(over="ignore"):
            found = without_nodata(values.astype(np.float32), self.nodata)
        return np.repeat(found[np.newaxis], len(bands), axis=0)

    def _numbers(self, line: bytes, row: int, col: int, cols: int) -> list[float]:
        where, expected = f"{self.path} row {row + 1}", f"{self.lattice.cols} numbers"
        if len(line) > self.lattice.cols * _LONGEST_NUMBER:
            raise fail(InputError, where, expected, f"{len(line)} bytes", "rows run together")
        fields = line.replace(b",", b".").split(None, self.lattice.cols)
        if len(fields) != self.lattice.cols:
            more = len(fields) > self.lattice.cols
            hint = "NCOLS is wrong, or rows run together" if more else "cut off, or NCOLS is wrong"
            raise fail(InputError, where, expected, "more" if more else len(fields), hint)
        try:
            if b"_" in line:
                raise ValueError("an underscore")
            return [float(field) for field in fields[col : col + cols]]
        except ValueError as error:
            raise fail(InputError, where, expected, "something else", "damaged") from error


def open_ascii_grid(
    path: Path, cell_id: str, crs: str | None = None, nodata: float | None = None
) -> AsciiGrid:
    """Read the header of an ESRI ASCII grid.

    Parameters
    ----------
    path : Path
    cell_id : str
    crs : str, optional
        For files without a ``.prj`` beside them.
    nodata : float, optional
        A number that means no data, besides the header's own (-9999 where it tells none).

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
    lines, header_bytes = [], 0
    for line in head.splitlines(keepends=True)[:_MOST_HEADER_LINES]:
        if not line.strip()[:1].isalpha():
            break
        lines.append(line)
        header_bytes += len(line)
    header, faults = GridHeader.of(str(path), lines), Faults()
    if "NCOLS" not in header.values or "NROWS" not in header.values:
        raise fail(InputError, str(path), "lines NCOLS and NROWS first", "none", "no ASCII grid")
    system = crs_beside(path, crs)
    rows, cols = header.whole("NROWS", faults, low=1), header.whole("NCOLS", faults, low=1)
    lattice = grid_lattice(header, system, rows, cols, faults)
    own = _NODATA
    if key := header.first("NODATA_VALUE", "NODATA"):
        own = header.number(key, faults) or 0.0
    if cols is not None and cols > _MOST_COLS:
        faults.add(f"{path}, NCOLS", f"at most {_MOST_COLS}", cols)
    if rows is not None and cols is not None and 2 * rows * cols - 1 > size - header_bytes:
        expected = f"at least {2 * rows * cols - 1} bytes for {rows} x {cols} numbers"
        hint = "the file is cut off, or its header is damaged"
        faults.add(str(path), expected, f"{size - header_bytes} bytes", hint)
    faults.raise_if_any(InputError)
    empty = (own,) if nodata is None else (own, nodata)
    return AsciiGrid(path, (cell_id,), cast(Lattice, lattice), header_bytes, empty)


@lru_cache(maxsize=1024)
def _row_starts(path: Path, size: int, _modified_ns: int, header_bytes: int, rows: int) -> Ints:
    """Return where each row begins, and the end of the last; the file is read through once.

    Raises
    ------
    InputError
        There are more or fewer rows than the header tells.
    """
    ends: list[Ints] = []
    found, at = 0, header_bytes
    with path.open("rb") as stream:
        stream.seek(header_bytes)
        while found <= rows and (chunk := stream.read(_CHUNK_BYTES)):
            newlines = np.flatnonzero(np.frombuffer(chunk, dtype=np.uint8) == _NEWLINE)
            ends.append(newlines.astype(np.int64) + at + 1)
            found += newlines.size
            at += len(chunk)
        starts = np.concatenate([np.array([header_bytes], dtype=np.int64), *ends])
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
