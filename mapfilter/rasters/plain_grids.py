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

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyproj.exceptions import CRSError

from mapfilter._inputs import open_input, read_input
from mapfilter._types import Floats32
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import known_crs, projected_crs, same_crs, shown_crs
from mapfilter.lattice import Lattice
from mapfilter.radio.tables import number
from mapfilter.rasters.files import RasterFile, Window, without_nodata

_LARGEST_HEADER_BYTES = 1 << 16
_SHOWN_BYTES = 30
_LONGEST_VALUE = 60
_MOST_PX = 10_000_000
_FARTHEST_M = 1e8
_SQUARE_TOLERANCE = 1e-6
_DEGREES_STEP = 0.05
WEST_KEYS = ("ULXMAP", "XLLCORNER", "XLLCENTER", "XLLCENTRE")
_NORTH_KEYS = ("ULYMAP", "YLLCORNER", "YLLCENTER", "YLLCENTRE")
_SIDE_KEYS = ("XDIM", "YDIM", "DX", "DY", "CELLSIZE")
NODATA = -9999.0


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
        lines = read_input(path, _LARGEST_HEADER_BYTES, "a header").splitlines()
        if lines and lines[0].strip() == b"ENVI":
            hint = "gdal_translate FROM TO.tif converts the raster"
            raise fail(InputError, str(path), "a header of ESRI (NROWS, NCOLS, …)", "ENVI", hint)
        return cls.of(str(path), lines)

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

    def nodata(self, *keys: str) -> float | None:
        """Return the number that means no data, NaN for "nan"; None without a line or valid one."""
        key = self.first(*keys)
        if key is None:
            return None
        return math.nan if self.values[key].lower() == "nan" else self.number(key)

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
        west_key, north_key = self.first(*WEST_KEYS), self.first(*_NORTH_KEYS)
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


def file_beside(path: Path, *suffixes: str) -> Path | None:
    """Return the file of the same name with one of some suffixes, if there is one."""
    return next((p for s in suffixes if (p := path.with_suffix(s)).is_file()), None)


def grid_crs(path: Path, declared: str | None) -> str:
    """Return the CRS in the ``.prj`` file beside a plain grid, else the declared one."""
    found = file_beside(path, ".prj", ".PRJ")
    if found is None:
        if declared is None:
            hint = "plain grids have none; set crs in [rasters]"
            raise fail(InputError, f"{path}, CRS", "a projected CRS in metres", "none", hint)
        return declared
    try:
        text = read_input(found, _LARGEST_HEADER_BYTES, "a CRS").decode("utf-8-sig").strip()
        stated = known_crs(text, str(found))
    except (CRSError, UnicodeDecodeError, OSError, ValueError) as error:
        if declared is not None:
            return declared
        expected, got = "a CRS as well-known text", "an empty file"
        if head := _head(found):
            got = f"a file that begins with {head!r}"
        hint = "cut off, or of another program; set crs in [rasters], which then counts instead"
        raise fail(InputError, str(found), expected, got, hint) from error
    # The dialect of these files names datums in its own way, so that nothing matches exactly.
    code = stated.to_epsg(min_confidence=70)
    crs = projected_crs(code or stated, str(found))
    if declared is not None and not same_crs(crs, declared):
        hint, expected = "two systems mixed up", f"{shown_crs(declared)}, as declared"
        raise fail(InputError, str(found), expected, shown_crs(crs), hint)
    return declared or crs


def _head(path: Path) -> str:
    """Return how a text file begins, as messages show it."""
    with open_input(path) as stream:
        return stream.read(_SHOWN_BYTES).decode("latin-1").strip()


@dataclass(frozen=True, slots=True)
class PlainGrid(RasterFile):
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
