"""Compiled look-ups in an area that is held by tiles: which tile a hypothesis is in, and its ways.

Pixels are those of the whole area; a tile's arrays begin at a row and column of it. Positions are
turned into pixels with the same arithmetic as on an area that is held whole.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mapfilter._types import Bytes, Floats32, Ints, Ints32
from mapfilter.models.fingerprint import RasterFrame, pixels_up_to

_F = np.float32


@njit(error_model="numpy", cache=True)
def by_tile(
    pixel: Ints32, cols: int, side: int, tile_cols: int, tiles: int
) -> tuple[Ints, Ints, Ints]:
    """Return flat pixels (N,) grouped by their tiles of ``side`` pixels.

    Indices of the pixels, those of a tile together and in their order; where each tile's begin,
    with N at the end; and the numbers of these tiles, of ``tiles`` in all.
    """
    of = np.empty(pixel.size, dtype=np.int64)
    count = np.zeros(tiles, dtype=np.int64)
    for i in range(pixel.size):
        row, col = pixel[i] // cols, pixel[i] % cols
        of[i] = (row // side) * tile_cols + col // side
        count[of[i]] += 1
    numbers = np.flatnonzero(count)
    first = np.zeros(numbers.size + 1, dtype=np.int64)
    for k in range(numbers.size):
        first[k + 1] = first[k] + count[numbers[k]]
        count[numbers[k]] = first[k]
    order = np.empty(pixel.size, dtype=np.int64)
    for i in range(pixel.size):
        order[count[of[i]]] = i
        count[of[i]] += 1
    return order, first, numbers


@njit(error_model="numpy", cache=True)
def look_up_levels(
    pixel: Ints32,
    which: Ints,
    cols: int,
    corner: tuple[int, int],
    near: Ints32,
    levels_dbm: Floats32,
    rough_db: Bytes,
    found_dbm: Floats32,
    found_rough_db: Bytes,
) -> None:
    """Fill in the levels and their roughness for the hypotheses ``which`` of a tile, in place.

    ``levels_dbm`` (K, P) are those of each cell at the tile's nearest points, ``rough_db``
    (K, rows, cols) or empty that of each pixel; found are (N, K).
    """
    top, left = corner
    for j in range(which.size):
        i = which[j]
        row, col = pixel[i] // cols - top, pixel[i] % cols - left
        point = near[row, col]
        for k in range(levels_dbm.shape[0]):
            found_dbm[i, k] = levels_dbm[k, point]
        for k in range(rough_db.shape[0]):
            found_rough_db[i, k] = rough_db[k, row, col]


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def upper_left(state: Floats32, raster: RasterFrame) -> Ints32:
    """Return the flat pixel whose centre lies north-west of each hypothesis, as bilinearly used.

    ``raster`` is from the centre of its first pixel.
    """
    return pixels_up_to(state, raster, raster.rows - 2, raster.cols - 2)


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def interpolate_tile(
    state: Floats32,
    first: Ints32,
    which: Ints,
    raster: RasterFrame,
    corner: tuple[int, int],
    values: Floats32,
    found: Floats32,
) -> None:
    """Fill in a tile's values at the hypotheses ``which``, bilinear between centres, in place.

    Parameters
    ----------
    state : ndarray of float32, shape (S, N)
        East and north in metres in the first two rows.
    first : ndarray of int32, shape (N,)
        What :func:`upper_left` returns.
    which : ndarray of int64, shape (M,)
        Indices of the hypotheses whose first pixel lies in the tile.
    raster : RasterFrame
        From the centre of the area's first pixel.
    corner : tuple of int
        Row and column in the area of the tile's first value.
    values : ndarray of float32, shape (rows, cols)
        Of the tile and of pixels around it.
    found : ndarray of float32, shape (N,)
        Filled in at ``which``.
    """
    zero, one = _F(0.0), _F(1.0)
    west, north_m, k = _F(raster.west_m), _F(raster.north_m), _F(raster.per_m)
    east, north, (top, left) = state[0], state[1], corner
    for j in range(which.size):
        i = which[j]
        x = (east[i] - west) * k
        y = (north_m - north[i]) * k
        x = x if x > zero else zero
        y = y if y > zero else zero
        col, row = np.int32(first[i] % raster.cols), np.int32(first[i] // raster.cols)
        u, v = x - _F(col), y - _F(row)
        u = u if u < one else one
        v = v if v < one else one
        r, c = row - top, col - left
        upper = values[r, c] + u * (values[r, c + 1] - values[r, c])
        under = values[r + 1, c] + u * (values[r + 1, c + 1] - values[r + 1, c])
        found[i] = upper + v * (under - upper)


@njit(error_model="numpy", cache=True)
def pixels_from_south(
    east_m: Floats32, north_m: Floats32, rows: int, cols: int, per_m: float
) -> Ints32:
    """Return the flat pixel of each place, rows counted from the south in double precision."""
    pixel = np.empty(east_m.size, dtype=np.int32)
    last_col, last_row, zero = np.int32(cols - 1), np.int32(rows - 1), np.int32(0)
    for i in range(pixel.size):
        col, row = np.int32(east_m[i] * per_m), np.int32(north_m[i] * per_m)
        col = col if col > zero else zero
        row = row if row > zero else zero
        col = col if col < last_col else last_col
        row = row if row < last_row else last_row
        pixel[i] = np.int32(np.int32(last_row - row) * np.int32(cols)) + col
    return pixel


@njit(error_model="numpy", cache=True)
def level_ranges(
    point: Ints32, level_dbm: Floats32, cols: int, side: int, tile_cols: int, tiles: int
) -> tuple[Floats32, Floats32]:
    """Return the least and the largest level (dBm) of a cell in each tile, both (``tiles``,).

    They are NaN where it has none. ``point`` (N,) are flat pixels on a lattice of ``cols`` columns,
    ``level_dbm`` (N,) the levels there; tiles have ``side`` pixels, ``tile_cols`` of them in a row.
    """
    least = np.full(tiles, np.nan, dtype=np.float32)
    most = np.full(tiles, np.nan, dtype=np.float32)
    for i in range(point.size):
        row, col = point[i] // cols, point[i] % cols
        tile = (row // side) * tile_cols + col // side
        level = level_dbm[i]
        if not least[tile] <= level:
            least[tile] = level
        if not most[tile] >= level:
            most[tile] = level
    return least, most


@njit(error_model="numpy", cache=True)
def levels_at_points(
    point: Ints, cell_point: Ints32, cell_dbm: Floats32, quiet_dbm: float
) -> tuple[Floats32, bool]:
    """Return a cell's level at points (P,), and whether it has one at any of them.

    ``point`` (P,), at least one, and ``cell_point`` (N,), the points where the cell has a level,
    ascend; ``cell_dbm`` (N,) are its levels, ``quiet_dbm`` is taken where it has none.
    """
    found = np.full(point.size, quiet_dbm, dtype=np.float32)
    there, j = False, np.searchsorted(cell_point, point[0])
    for i in range(point.size):
        while j < cell_point.size and cell_point[j] < point[i]:
            j += 1
        if j == cell_point.size:
            break
        if cell_point[j] == point[i]:
            found[i], there = cell_dbm[j], True
    return found, there


@njit(error_model="numpy", cache=True)
def tenths_of_roughness(levels_dbm: Floats32, near: Ints32, size: int) -> Bytes:
    """Return the roughness of levels at the nearest points of pixels, in tenths of a dB.

    It is that of :func:`mapfilter.models.level_errors.roughness` with a square of ``size`` pixels.
    """
    rows, cols = near.shape
    half, per = size // 2, 1.0 / size
    level, square = np.empty((rows, cols)), np.empty((rows, cols))
    for r in range(rows):
        for c in range(cols):
            value = np.float64(levels_dbm[near[r, c]])
            level[r, c], square[r, c] = value, value * value
    down, down_square = np.zeros((rows, cols)), np.zeros((rows, cols))
    for r in range(rows):
        for k in range(r - half, r + half + 1):
            at = _reflected(k, rows)
            for c in range(cols):
                down[r, c] += level[at, c]
                down_square[r, c] += square[at, c]
    found = np.empty((rows, cols), dtype=np.uint8)
    for r in range(rows):
        total, total_square = 0.0, 0.0
        for k in range(-half, half + 1):
            total += down[r, _reflected(k, cols)]
            total_square += down_square[r, _reflected(k, cols)]
        for c in range(cols):
            mean = total * per * per
            variance = total_square * per * per - mean * mean
            rough_db = np.float32(np.sqrt(max(variance, 0.0)))
            found[r, c] = np.uint8(min(np.rint(np.float32(10.0) * rough_db), np.float32(255.0)))
            gone, new = _reflected(c - half, cols), _reflected(c + half + 1, cols)
            total += down[r, new] - down[r, gone]
            total_square += down_square[r, new] - down_square[r, gone]
    return found


@njit(inline="always")
def _reflected(at: int, size: int) -> int:
    """Return a place in a row that is continued by its mirror image."""
    while at < 0 or at >= size:
        at = -1 - at if at < 0 else 2 * size - 1 - at
    return at
