"""Rasters of different resolutions and extents, read as if they lay on one lattice."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Literal

import numpy as np

from mapfilter._types import Floats, Floats32, Ints
from mapfilter.errors import Faults, InputError, fail, listed
from mapfilter.geodesy import same_crs, shown_crs
from mapfilter.lattice import Lattice
from mapfilter.rasters.files import RasterFile, Window

Resampling = Literal["nearest", "bilinear"]

_ALIGNED_PX = 1e-3
_EDGE_PX = 1e-6
_MOST_PX = 40_000_000_000
_LARGEST_SOURCE_BYTES = 1 << 30


def common_lattice(
    files: Sequence[RasterFile], resolution_m: float | None, resampling: Resampling
) -> tuple[Lattice, tuple[str, ...]]:
    """Return one lattice for several files, and remarks on those that are resampled.

    Its pixels are those of most files of the finest resolution, unless another resolution is
    asked for; it covers all files.
    """
    lattices, faults = [file.lattice for file in files], Faults()
    first = lattices[0]
    for file in files:
        if not same_crs(file.lattice.crs, first.crs):
            expected = f"{shown_crs(first.crs)}, as in {files[0].path.name}"
            found = shown_crs(file.lattice.crs)
            faults.add(f"{file.path}, CRS", expected, found, "two systems mixed up")
    faults.raise_if_any(InputError)
    wanted_m = resolution_m or min(lattice.resolution_m for lattice in lattices)
    if all(lattice.aligned_with(first) for lattice in lattices) and _alike(
        wanted_m, first.resolution_m
    ):
        return first, ()
    lattice = _covering(files, wanted_m)
    notes = []
    if any(one.bounds_m != lattice.bounds_m for one in lattices):
        size = f"{lattice.rows} x {lattice.cols} pixels of {lattice.resolution_m:g} m"
        notes.append(f"rasters of different extents: put on {size} that cover all of them")
    off = [file for file in files if _shift(file.lattice, lattice) is None]
    alike = [file for file in off if _alike(file.lattice.resolution_m, lattice.resolution_m)]
    others = [file for file in off if file not in alike]
    if alike:
        right = (alike[0].lattice.west_m - lattice.west_m) / lattice.resolution_m
        up = (alike[0].lattice.north_m - lattice.north_m) / lattice.resolution_m
        notes.append(
            f"{len(alike)} of {len(files)} rasters lie between the pixels of the lattice "
            f"(by {right - round(right):+.2f} pixels east, {up - round(up):+.2f} north), "
            f"resampled ({resampling}): {_names(alike)}"
        )
    if others:
        sides = sorted({file.lattice.resolution_m for file in others})
        listed = ", ".join(f"{side:g} m" for side in sides[:5])
        notes.append(
            f"{len(others)} of {len(files)} rasters resampled ({resampling}) from {listed} "
            f"to {lattice.resolution_m:g} m: {_names(others)}"
        )
    return lattice, tuple(notes)


def read_on(
    file: RasterFile,
    bands: Sequence[int],
    lattice: Lattice,
    window: Window,
    resampling: Resampling,
) -> Floats32:
    """Read bands of a file in a window of another lattice; NaN beyond the file.

    Where the pixels of both coincide, numbers are taken over as they are. Else *nearest* takes the
    pixel that holds the centre of the one asked for; *bilinear* weighs the four nearest centres,
    in dB, without those that have no data, and has data where nearest has.
    """
    if lattice == file.lattice:
        return file.read(bands, window)
    shift = _shift(file.lattice, lattice)
    if shift is not None:
        rows = np.arange(window[2]) + window[0] - shift[0]
        cols = np.arange(window[3]) + window[1] - shift[1]
        return _nearest(file, bands, rows, cols)
    rows = np.arange(window[0], window[0] + window[2])
    cols = np.arange(window[1], window[1] + window[3])
    east_m, north_m = lattice.east_north(rows, cols)
    # Places in pixels from the file's corner; on an edge, whatever the rounding, the later counts.
    row = (file.lattice.north_m - north_m) / file.lattice.resolution_m
    col = (east_m - file.lattice.west_m) / file.lattice.resolution_m
    held = [np.floor(place + _EDGE_PX).astype(np.int64) for place in (row, col)]
    nearest = _nearest(file, bands, held[0], held[1])
    return nearest if resampling == "nearest" else _bilinear(file, bands, row, col, nearest)


def _names(files: Sequence[RasterFile]) -> str:
    return listed([file.path.name for file in files], 3)


def _alike(a_m: float, b_m: float) -> bool:
    return abs(a_m - b_m) <= 1e-6 * max(a_m, b_m)


def _covering(files: Sequence[RasterFile], side_m: float) -> Lattice:
    """Return the lattice over all others, in step with most of those of its resolution."""
    lattices = [file.lattice for file in files]
    alike = [one for one in lattices if _alike(one.resolution_m, side_m)]
    phases = [
        (round(one.west_m / side_m % 1, 3) % 1, round(one.north_m / side_m % 1, 3) % 1)
        for one in alike
    ]
    origin_m = (0.0, 0.0)
    if alike:
        one = alike[phases.index(Counter(phases).most_common(1)[0][0])]
        origin_m = one.west_m, one.north_m
    bounds = np.array([one.bounds_m for one in lattices])
    (west, south), (east, north) = bounds[:, :2].min(axis=0), bounds[:, 2:].max(axis=0)
    left = np.floor((west - origin_m[0]) / side_m + _ALIGNED_PX)
    right = np.ceil((east - origin_m[0]) / side_m - _ALIGNED_PX)
    top = np.floor((origin_m[1] - north) / side_m + _ALIGNED_PX)
    bottom = np.ceil((origin_m[1] - south) / side_m - _ALIGNED_PX)
    rows, cols = int(bottom - top), int(right - left)
    if rows * cols > _MOST_PX:
        expected = f"rasters that {_MOST_PX:.0e} pixels can cover"
        got = f"{(east - west) / 1000:.0f} km x {(north - south) / 1000:.0f} km at {side_m:g} m"
        hint = "a raster of another place, or a resolution in the wrong unit"
        off_m = np.abs(bounds - np.median(bounds, axis=0)).max(axis=1)
        where = f"{files[0].path.parent}, with {files[int(off_m.argmax())].path.name}"
        raise fail(InputError, where, expected, got, hint)
    west_m, north_m = origin_m[0] + left * side_m, origin_m[1] - top * side_m
    return Lattice(lattices[0].crs, float(west_m), float(north_m), side_m, rows, cols)


def _shift(source: Lattice, target: Lattice) -> tuple[int, int] | None:
    """Return row and column of the source's corner on the target, if their pixels coincide."""
    longest = max(source.rows, source.cols)
    if abs(source.resolution_m - target.resolution_m) * longest > _ALIGNED_PX * target.resolution_m:
        return None
    down = (target.north_m - source.north_m) / target.resolution_m
    right = (source.west_m - target.west_m) / target.resolution_m
    row, col = round(down), round(right)
    return (row, col) if max(abs(down - row), abs(right - col)) <= _ALIGNED_PX else None


def _nearest(file: RasterFile, bands: Sequence[int], rows: Ints, cols: Ints) -> Floats32:
    """Take pixels, read in strips that fit into memory; rows and columns ascend.

    Those beyond the file are NaN.
    """
    values = np.full((len(bands), rows.size, cols.size), np.nan, dtype=np.float32)
    r = np.flatnonzero((rows >= 0) & (rows < file.lattice.rows))
    c = np.flatnonzero((cols >= 0) & (cols < file.lattice.cols))
    if not (r.size and c.size):
        return values
    rows, cols = rows[r], cols[c]
    left, width = int(cols[0]), int(cols[-1] - cols[0]) + 1
    step = max(1, _LARGEST_SOURCE_BYTES // (4 * width * len(bands)))
    inside = values[:, r[0] : r[-1] + 1, c[0] : c[-1] + 1]
    done = 0
    while done < rows.size:
        top = int(rows[done])
        part = rows[done : done + int(np.searchsorted(rows[done:], top + step))]
        strip = file.read(bands, (top, left, int(part[-1]) - top + 1, width))
        if not (_without_gap(part) and _without_gap(cols)):
            strip = strip[:, (part - top)[:, None], cols - left]
        inside[:, done : done + part.size] = strip
        done += part.size
    return values


def _without_gap(numbers: Ints) -> bool:
    return bool((np.diff(numbers) == 1).all())


def _bilinear(
    file: RasterFile,
    bands: Sequence[int],
    row: Floats,
    col: Floats,
    nearest: Floats32,
) -> Floats32:
    """Weigh the four nearest pixels; at the file's edge, those that are there."""
    weighted = np.zeros(nearest.shape, dtype=np.float64)
    weight = np.zeros(nearest.shape, dtype=np.float64)
    above, left = np.floor(row - 0.5), np.floor(col - 0.5)
    for down in (0, 1):
        for right in (0, 1):
            at = (above + down).astype(np.int64), (left + right).astype(np.int64)
            share = np.outer(
                1 - np.abs(row - 0.5 - above - down), 1 - np.abs(col - 0.5 - left - right)
            )
            values = _nearest(file, bands, *at)
            known = ~np.isnan(values)
            weighted += np.where(known, values, 0.0) * share
            weight += known * share
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = weighted / weight
    return np.where(np.isnan(nearest), np.nan, mean).astype(np.float32)
