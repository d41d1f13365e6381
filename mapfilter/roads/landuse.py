"""A classified land-use raster: the paper's second database.

The table is a CSV file with the columns ``class`` and ``walkable`` (0 or 1), and either ``value``,
for rasters of one band, or ``r``, ``g``, ``b``, for rasters of three colour bands.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rasterio.errors import RasterioError
from rasterio.windows import Window

from mapfilter._gdal import open_raster
from mapfilter._inputs import read_input
from mapfilter._separator_line import without_separator_line
from mapfilter._types import Bools
from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import projected_crs, same_crs, shown_crs
from mapfilter.lattice import Lattice

_COLOUR = ("r", "g", "b")
_LARGEST_WINDOW_PX = 1 << 24
_MOST_DIGITS = 10
_LARGEST_TABLE_BYTES = 16 << 20
_ALIGNED_PX = 1e-3
_NEARLY_ALL = 0.95
_MOST_SHOWN = 10


@dataclass(frozen=True, slots=True, eq=False)
class LandUse:
    """Classes of land use on a lattice, and which of them are walkable.

    Parameters
    ----------
    code : numpy.ndarray of int, shape (rows, cols) of the lattice
        Index into ``names``; negative where nothing is known.
    names, can_walk : tuple of str, tuple of bool
        Name of each class, and whether it is walkable.
    colours : tuple of str
        Colour of each class, such as "#8c8c8c"; empty without colours.
    notes : tuple of str
        How the raster was resampled, and its coverage of the lattice if incomplete.
    """

    code: NDArray[np.integer]
    names: tuple[str, ...]
    can_walk: tuple[bool, ...]
    colours: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        faults = Faults()
        for name, values in (("can_walk", self.can_walk), ("colours", self.colours)):
            if len(values) != len(self.names) and (values or name == "can_walk"):
                faults.add(f"land use, {name}", f"{len(self.names)} of them", len(values))
        if self.code.size and int(self.code.max()) >= len(self.names):
            faults.add("land use, code", f"below {len(self.names)}", int(self.code.max()))
        faults.raise_if_any(InputError)

    @property
    def walkable(self) -> Bools:
        """Mask of the walkable classes, shape (rows, cols)."""
        # The last entry is that of the negative codes.
        return np.asarray(np.array([*self.can_walk, False])[np.maximum(self.code, -1)])


def read_landuse(path: Path | str, table_path: Path | str, lattice: Lattice) -> LandUse:
    """Return the class of land use at each lattice point.

    Each lattice point takes the class of the pixel that holds it (nearest neighbour), whatever
    the raster's resolution; points off the raster and no-data pixels have none. The raster is read
    by windows of bounded size. Classes of a colour raster have its colours.

    Parameters
    ----------
    path : Path or str
        GeoTIFF or the like with one band of values or three of colours (8 bits each; a fourth
        band is transparency: 0 is no data), in the lattice's CRS, north up.
    table_path : Path or str
        Table of the classes of values or colours.
    lattice : Lattice
        Points to classify.

    Raises
    ------
    InputError
        A file is missing or damaged, the CRS differs, raster and table do not go together, values
        or colours are not in the table (the most frequent ones with their number of points), or
        none is walkable.
    """
    path = Path(path)
    keys, is_colour = _read_table(Path(table_path))
    codes, known, notes = _read_codes(path, lattice, colour=is_colour)
    found, counts = np.unique(codes[known], return_counts=True)
    pairs = zip(found.tolist(), counts.tolist(), strict=True)
    unknown = [(code, count) for code, count in pairs if code not in keys]
    unknown.sort(key=lambda pair: -pair[1])
    faults, expected = Faults(), f"classes of {table_path}"
    hint = "a class left out, or colours blended by compression or resampling"
    for code, count in unknown[:_MOST_SHOWN]:
        shown = f"value {code}"
        if is_colour:
            shown = f"colour {code >> 16},{code >> 8 & 255},{code & 255}"
        faults.add(str(path), expected, f"{shown} at {number_of(count, 'point')}", hint)
    if rest := unknown[_MOST_SHOWN:]:
        points = sum(count for _, count in rest)
        faults.add(
            str(path),
            expected,
            f"{number_of(len(rest), 'other')} at {number_of(points, 'point')}",
            hint,
        )
    faults.raise_if_any(InputError)
    index = np.full(codes.shape, -1, dtype=np.min_scalar_type(-len(keys)))
    rank = {code: number for number, code in enumerate(keys)}
    places = np.array([rank[code] for code in found.tolist()], dtype=index.dtype)
    for row in range(lattice.rows):
        here = known[row]
        index[row, here] = places[np.searchsorted(found, codes[row, here])]
    if known.mean() < _NEARLY_ALL:
        notes = (*notes, f"{path}: covers {known.mean():.0%} of the area")
    landuse = LandUse(
        index,
        tuple(name for name, _ in keys.values()),
        tuple(can_walk for _, can_walk in keys.values()),
        tuple(f"#{code:06x}" for code in keys) if is_colour else (),
        notes,
    )
    if not landuse.walkable.any():
        got = "none" if known.any() else "no point of the raster"
        hint = "wrong table" if known.any() else "raster of another area"
        raise fail(InputError, str(path), "walkable points in the area", got, hint)
    return landuse


def _read_table(path: Path) -> tuple[dict[int, tuple[str, bool]], bool]:
    """Return code -> (class, walkable), and whether the codes are colours."""
    try:
        text = read_input(path, _LARGEST_TABLE_BYTES, "a table").decode("utf-8-sig")
        table = without_separator_line(text).lstrip("\r\n")
        above = text[: len(text) - len(table)].count("\n")
        delimiter = ";" if ";" in table.partition("\n")[0] else ","
        reader = csv.DictReader(io.StringIO(table, newline=""), delimiter=delimiter)
        # Blank lines are no rows.
        numbered = [(above + reader.line_num, row) for row in reader]
    except (UnicodeDecodeError, csv.Error) as error:
        raise fail(InputError, str(path), "a readable CSV table", error) from error
    columns = set(numbered[0][1]) if numbered else set()
    is_colour = columns.issuperset(_COLOUR)
    if not columns.issuperset(("class", "walkable")) or not (is_colour or "value" in columns):
        expected = "columns class, walkable and value, or class, walkable, r, g, b"
        got = ", ".join(map(str, numbered[0][1])) if numbered else "no rows"
        raise fail(InputError, str(path), expected, got)
    faults = Faults()
    keys: dict[int, tuple[str, bool]] = {}
    for line, row in numbered:
        code = _code(row, is_colour, f"{path} row {line}", faults)
        if (row["walkable"] or "").strip() not in ("0", "1"):
            faults.add(f"{path} row {line}, walkable", "0 or 1", repr(row["walkable"]))
        if code is not None and code in keys:
            faults.add(f"{path} row {line}", "each class once", f"again that of {keys[code][0]!r}")
        elif code is not None:
            keys[code] = (row["class"], (row["walkable"] or "").strip() == "1")
    faults.raise_if_any(InputError)
    return keys, is_colour


def _code(row: dict[str, str], is_colour: bool, where: str, faults: Faults) -> int | None:
    code = 0
    for name in _COLOUR if is_colour else ("value",):
        text = (row[name] or "").strip()
        is_number = text.isascii() and text.isdigit() and len(text) <= _MOST_DIGITS
        if not is_number or (is_colour and int(text) > 255):
            expected = "a whole number in 0..255" if is_colour else "a whole number >= 0"
            faults.add(f"{where}, {name}", expected, repr(row[name]))
            return None
        code = code * 256 + int(text) if is_colour else int(text)
    return code


def _read_codes(
    path: Path, lattice: Lattice, *, colour: bool
) -> tuple[NDArray[np.integer[Any]], Bools, tuple[str, ...]]:
    """Return values or packed colours at the lattice points, which are known, and notes."""
    try:
        with open_raster(path) as source:
            _check_raster(source, path, lattice, colour)
            return *_at_points(source, lattice, colour=colour), _notes(source, path, lattice)
    except RasterioError as error:
        raise fail(InputError, str(path), "a readable raster", error, "cut off") from error


def _at_points(
    source: Any, lattice: Lattice, *, colour: bool
) -> tuple[NDArray[np.integer[Any]], Bools]:
    shape = lattice.rows, lattice.cols
    kind = np.promote_types(np.int32 if colour else source.dtypes[0], np.uint8)
    codes, known = np.zeros(shape, dtype=kind), np.zeros(shape, dtype=np.bool_)
    # The raster's row of each row of the lattice, and its column of each column.
    east, _ = lattice.east_north(np.zeros(lattice.cols), np.arange(lattice.cols))
    _, north = lattice.east_north(np.arange(lattice.rows), np.zeros(lattice.rows))
    transform = source.transform
    rows = np.floor((north - transform.f) / transform.e).astype(np.int64)
    cols = np.floor((east - transform.c) / transform.a).astype(np.int64)
    on_rows = np.flatnonzero((rows >= 0) & (rows < source.height))
    on_cols = np.flatnonzero((cols >= 0) & (cols < source.width))
    if not (on_rows.size and on_cols.size):
        return codes, known
    bands = [1, 2, 3] if colour else [1]
    left, width = int(cols[on_cols[0]]), int(np.ptp(cols[on_cols])) + 1
    down_px = lattice.resolution_m / -transform.e
    at_a_time = max(1, int(_LARGEST_WINDOW_PX / width / max(down_px, 1)))
    for first in range(0, on_rows.size, at_a_time):
        some = on_rows[first : first + at_a_time]
        top, height = int(rows[some[0]]), int(np.ptp(rows[some])) + 1
        window = Window(left, top, width, height)
        wanted = np.ix_(rows[some] - top, cols[on_cols] - left)
        values = [band[wanted] for band in source.read(bands, window=window)]
        target = np.ix_(some, on_cols)
        codes[target] = values[0]
        for band_values in values[1:]:
            codes[target] = codes[target] * 256 + band_values
        known[target] = (source.read_masks(bands, window=window) > 0).all(axis=0)[wanted]
    return codes, known


def _notes(source: Any, path: Path, lattice: Lattice) -> tuple[str, ...]:
    """Return a note when the pixels are not the lattice's own."""
    pixel_m = np.array([source.transform.a, -source.transform.e])
    shift_m = np.array([lattice.west_m - source.transform.c, source.transform.f - lattice.north_m])
    shift_px = shift_m / lattice.resolution_m
    own_size = np.allclose(pixel_m, lattice.resolution_m, rtol=1e-6, atol=0)
    if own_size and np.abs(shift_px - np.round(shift_px)).max() < _ALIGNED_PX:
        return ()
    size = " x ".join(f"{side:g}" for side in np.unique(pixel_m))
    points = f"points of a lattice of {lattice.resolution_m:g} m"
    return (f"{path}: pixels of {size} m resampled to the {points} (nearest neighbour)",)


def _check_raster(source: Any, path: Path, lattice: Lattice, colour: bool) -> None:
    faults = Faults()
    crs = projected_crs(source.crs.to_wkt() if source.crs else None, f"{path}, crs")
    if not same_crs(crs, lattice.crs):
        faults.add(f"{path}, crs", shown_crs(lattice.crs), shown_crs(crs), "raster of another zone")
    wanted = (3, 4) if colour else (1,)
    if source.count not in wanted:
        expected = "three colour bands" if colour else "one band of values"
        faults.add(f"{path}, bands", expected, source.count, "table and raster of different kinds")
    elif not all(np.issubdtype(np.dtype(kind), np.integer) for kind in source.dtypes):
        faults.add(f"{path}, pixels", "whole numbers", source.dtypes[0], "a continuous quantity")
    elif colour and set(source.dtypes) != {"uint8"}:
        faults.add(f"{path}, pixels", "colours of 8 bits", source.dtypes[0])
    transform = source.transform
    if transform.b or transform.d or transform.e >= 0 or transform.a <= 0:
        got = "rotated, upside-down or mirrored ones"
        faults.add(f"{path}, pixels", "rows from north to south", got)
    faults.raise_if_any(InputError)
