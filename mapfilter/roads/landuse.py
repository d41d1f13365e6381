"""Where one can be, from a classified land-use raster: the paper's second database.

The table is a CSV file with the columns ``class`` and ``walkable`` (0 or 1), and either ``value``,
for rasters of one band, or ``r``, ``g``, ``b``, for rasters of three colour bands.
"""

from __future__ import annotations

import csv
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
from numpy.typing import NDArray
from rasterio.enums import Resampling
from rasterio.errors import NotGeoreferencedWarning, RasterioError
from rasterio.transform import Affine
from rasterio.warp import reproject

from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import Lattice, projected_crs, same_crs

_COLOUR = ("r", "g", "b")
_OUTSIDE = -1


def read_landuse(path: Path | str, table_path: Path | str, lattice: Lattice) -> NDArray[np.bool_]:
    """Return which lattice points lie in a walkable class of land use.

    Each lattice point takes the class of the pixel that holds it (nearest neighbour), whatever
    the raster's resolution; points off the raster and no-data pixels are not walkable.

    Parameters
    ----------
    path : Path or str
        GeoTIFF or the like with one band of values or three of colours (8 bits each; a fourth
        band is taken for transparency: 0 is no data), in the lattice's CRS.
    table_path : Path or str
        What values or colours mean.
    lattice : Lattice

    Returns
    -------
    numpy.ndarray of bool, shape (lattice.rows, lattice.cols)

    Raises
    ------
    InputError
        A file is missing or damaged, the CRS differs, raster and table do not go together, values
        or colours are not in the table (each with its number of points), or none is walkable.
    """
    path = Path(path)
    keys, is_colour = _read_table(Path(table_path))
    codes = _read_codes(path, lattice, colour=is_colour)
    found, counts = np.unique(codes, return_counts=True)
    faults = Faults()
    for code, count in zip(found.tolist(), counts.tolist(), strict=True):
        if code != _OUTSIDE and code not in keys:
            shown = f"value {code}"
            if is_colour:
                shown = f"colour {code >> 16},{code >> 8 & 255},{code & 255}"
            hint = "a class left out, or colours blended by compression or resampling"
            faults.add(str(path), f"classes of {table_path}", f"{shown} at {count} points", hint)
    faults.raise_if_any(InputError)
    walkable = [code for code, (_, can_walk) in keys.items() if can_walk]
    mask = np.isin(codes, walkable)
    if not mask.any():
        got = "no point of the raster" if (codes == _OUTSIDE).all() else "none"
        hint = "raster of another area" if (codes == _OUTSIDE).all() else "wrong table"
        raise fail(InputError, str(path), "walkable points in the area", got, hint)
    return mask


def _read_table(path: Path) -> tuple[dict[int, tuple[str, bool]], bool]:
    """Return code -> (class, walkable), and whether the codes are colours."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            first = stream.readline()
            stream.seek(0)
            rows = list(csv.DictReader(stream, delimiter=";" if ";" in first else ","))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise fail(InputError, str(path), "a readable CSV table", error) from error
    columns = set(rows[0]) if rows else set()
    is_colour = columns.issuperset(_COLOUR)
    if not columns.issuperset(("class", "walkable")) or not (is_colour or "value" in columns):
        expected = "columns class, walkable and value, or class, walkable, r, g, b"
        got = ", ".join(str(column) for column in rows[0]) if rows else "no rows"
        raise fail(InputError, str(path), expected, got)
    faults = Faults()
    keys: dict[int, tuple[str, bool]] = {}
    for line, row in enumerate(rows, start=2):
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
        if not text.isdigit() or (is_colour and int(text) > 255):
            expected = "a whole number in 0..255" if is_colour else "a whole number >= 0"
            faults.add(f"{where}, {name}", expected, repr(row[name]))
            return None
        code = code * 256 + int(text) if is_colour else int(text)
    return code


def _read_codes(path: Path, lattice: Lattice, *, colour: bool) -> NDArray[np.int64]:
    """Return the values or packed colours at the lattice points; -1 where there are none."""
    if not path.is_file():
        raise fail(InputError, str(path), "a raster file", "no such file", "a mistyped path")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)
            with rasterio.open(path) as source:
                _check_raster(source, path, lattice, colour)
                bands = 3 if colour else 1
                values = [_on_lattice(source, band, lattice) for band in range(1, bands + 1)]
                known = np.all([_known(source, band, lattice) for band in range(1, bands + 1)], 0)
    except RasterioError as error:
        raise fail(InputError, str(path), "a readable raster", error, "cut off") from error
    codes = values[0]
    for band_values in values[1:]:
        codes = codes * 256 + band_values
    return np.where(known, codes, _OUTSIDE)


def _check_raster(source: Any, path: Path, lattice: Lattice, colour: bool) -> None:
    faults = Faults()
    crs = projected_crs(source.crs.to_wkt() if source.crs else None, f"{path}, crs")
    if not same_crs(crs, lattice.crs):
        faults.add(f"{path}, crs", lattice.crs, crs, "raster of another zone")
    wanted = (3, 4) if colour else (1,)
    if source.count not in wanted:
        expected = "three colour bands" if colour else "one band of values"
        faults.add(f"{path}, bands", expected, source.count, "table and raster of different kinds")
    elif not all(np.issubdtype(np.dtype(kind), np.integer) for kind in source.dtypes):
        faults.add(f"{path}, pixels", "whole numbers", source.dtypes[0], "a continuous quantity")
    faults.raise_if_any(InputError)


def _on_lattice(source: Any, band: int, lattice: Lattice) -> NDArray[np.int64]:
    return _nearest(source.read(band), source.transform, lattice)


def _known(source: Any, band: int, lattice: Lattice) -> NDArray[np.bool_]:
    return _nearest(source.read_masks(band) > 0, source.transform, lattice) > 0


def _nearest(values: NDArray[Any], transform: Affine, lattice: Lattice) -> NDArray[np.int64]:
    target = np.zeros((lattice.rows, lattice.cols), dtype=np.int64)
    reproject(
        values.astype(np.int64),
        target,
        src_transform=transform,
        dst_transform=Affine.from_gdal(*lattice.gdal_transform),
        src_crs=lattice.crs,
        dst_crs=lattice.crs,
        resampling=Resampling.nearest,
        init_dest_nodata=False,
    )
    return target
