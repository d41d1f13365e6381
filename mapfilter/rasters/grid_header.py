"""Headers of plain grids, a key and a value per line: ESRI ASCII grids, HDR files of raw pixels.

Both place the grid by the lower left pixel's corner or centre (``XLLCORNER``, ``XLLCENTER``) or by
the upper left pixel's *centre* (``ULXMAP``), whose corner lies half a pixel to the north-west.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pyproj import CRS
from pyproj.exceptions import CRSError

from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import Lattice, projected_crs, same_crs

_LARGEST_HEADER_BYTES = 1 << 16
_LONGEST_VALUE = 60
_MOST_PX = 10_000_000
_FARTHEST_M = 1e8
_SQUARE_TOLERANCE = 1e-6
_DEGREES_STEP = 0.05
WEST_KEYS = ("ULXMAP", "XLLCORNER", "XLLCENTER", "XLLCENTRE")
_NORTH_KEYS = ("ULYMAP", "YLLCORNER", "YLLCENTER", "YLLCENTRE")


@dataclass(frozen=True, slots=True)
class GridHeader:
    """The header of the file ``where``: keys in capitals with their values, as texts."""

    where: str
    values: Mapping[str, str]

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
        """Return a value as a finite number, or None with a fault."""
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
        """Return a value as a whole number in ``low`` to 10 million, or None with a fault."""
        if key not in self.values:
            if default is None:
                faults.add(self.where, f"a line {key}", "none", "a header that is cut off")
            return default
        value = self.number(key, faults)
        if value is None or (value == int(value) and low <= value <= _MOST_PX):
            return None if value is None else int(value)
        expected = f"a whole number in {low}..{_MOST_PX}"
        faults.add(f"{self.where}, {key}", expected, self.values[key][:_LONGEST_VALUE])
        return None


def grid_lattice(
    header: GridHeader, crs: str, rows: int | None, cols: int | None, faults: Faults
) -> Lattice | None:
    """Return where a grid lies, or None with a fault."""
    side_m = _side_m(header, faults)
    west_key, north_key = header.first(*WEST_KEYS), header.first(*_NORTH_KEYS)
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
    keys = ("XDIM", "YDIM", "DX", "DY", "CELLSIZE")
    found = [key for key in keys if key in header.values][:2]
    if not found or (len(found) == 1 and found[0] != "CELLSIZE"):
        faults.add(header.where, "the size of a pixel: CELLSIZE, or XDIM and YDIM", "none")
        return None
    sides_m = [side for key in found if (side := header.number(key, faults)) is not None]
    if len(sides_m) < len(found):
        return None
    if not 0 < min(sides_m) <= _FARTHEST_M:
        faults.add(f"{header.where}, {found[0]}", "metres > 0", f"{sides_m[0]:g}")
        return None
    if max(sides_m) - min(sides_m) > _SQUARE_TOLERANCE * max(sides_m):
        faults.add(header.where, "square pixels", " x ".join(f"{side:g}" for side in sides_m))
        return None
    return sides_m[0]


def beside(path: Path, *suffixes: str) -> Path | None:
    """Return the file of the same name with one of some suffixes, if there is one."""
    return next((p for s in suffixes if (p := path.with_suffix(s)).is_file()), None)


def grid_crs(path: Path, declared: str | None) -> str:
    """Return the CRS in the ``.prj`` file beside a plain grid, else the declared one."""
    found = beside(path, ".prj", ".PRJ")
    if found is None:
        if declared is None:
            hint = "plain grids have none; set crs in [rasters]"
            raise fail(InputError, f"{path}, CRS", "a projected CRS in metres", "none", hint)
        return declared
    try:
        text = found.read_bytes()[:_LARGEST_HEADER_BYTES].decode("utf-8-sig").strip()
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
