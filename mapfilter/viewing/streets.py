"""Lines along the middle of streets that are known as pixels."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from mapfilter._types import Bools, Floats, Ints

_SIMPLER_PX = 0.75
_MOST_ROUNDS = 60


def middle_lines(way: Ints) -> tuple[list[Floats], list[int]]:
    """Return lines through the pixels of ways, (k, 2) arrays of rows and columns, and their ways.

    Parameters
    ----------
    way : ndarray of int64, shape (rows, cols)
        Id of each pixel's way; 0 where there is none.
    """
    thin = thinned(way != 0)
    row, col = np.nonzero(thin)
    number = np.full(thin.shape, -1, dtype=np.int64)
    number[row, col] = np.arange(row.size)
    padded = np.pad(number, 1, constant_values=-1)
    pairs = []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        other = padded[row + 1 + down, col + 1 + right]
        joined = other >= 0
        if down and right:
            # With a pixel beside both, the line goes round that one.
            joined &= (padded[row + 1 + down, col + 1] < 0) & (padded[row + 1, col + 1 + right] < 0)
        pairs.append(np.column_stack([np.flatnonzero(joined), other[joined]]))
    pair = np.concatenate(pairs)
    if not len(pair):
        return [], []
    of = way[row, col][pair[:, 0]]
    order = np.argsort(of, kind="stable")
    ids, first = np.unique(of[order], return_index=True)
    segments = shapely.linestrings(np.column_stack([row, col])[pair[order]].astype(np.float64))
    lines: list[Floats] = []
    owners: list[int] = []
    for one, some in zip(ids.tolist(), np.split(segments, first[1:]), strict=True):
        merged = shapely.line_merge(shapely.multilinestrings(some))
        for part in shapely.get_parts(shapely.simplify(merged, _SIMPLER_PX)):
            lines.append(shapely.get_coordinates(part))
            owners.append(one)
    return lines, owners


def thinned(there: Bools) -> Bools:
    """Return what is left of an area when its pixels are taken off from all sides, to lines.

    Zhang & Suen (1984): a pixel goes if that breaks no connection.

    Examples
    --------
    >>> bar = np.zeros((5, 7), dtype=bool)
    >>> bar[1:4, 1:6] = True
    >>> int(thinned(bar).sum()) <= 3
    True
    """
    left = np.pad(there, 1)
    for _ in range(_MOST_ROUNDS):
        before = int(left.sum())
        for side in (0, 1):
            left[1:-1, 1:-1] &= ~_removable(left, side)
        if int(left.sum()) == before:
            break
    return np.asarray(left[1:-1, 1:-1], dtype=np.bool_)


def _removable(there: Bools, side: int) -> NDArray[np.bool_]:
    """Return which inner pixels go in one half of a round."""
    north, south = there[:-2, 1:-1], there[2:, 1:-1]
    west, east = there[1:-1, :-2], there[1:-1, 2:]
    ring = (
        north, there[:-2, 2:], east, there[2:, 2:], south, there[2:, :-2], west, there[:-2, :-2],
    )  # fmt: skip
    count = np.sum(ring, axis=0, dtype=np.int8)
    begins = np.sum(
        [~one & after for one, after in zip(ring, (*ring[1:], ring[0]), strict=True)],
        axis=0,
        dtype=np.int8,
    )
    two = (count >= 2) & (count <= 6) & (begins == 1) & there[1:-1, 1:-1]
    if side:
        found = two & ~(north & east & west) & ~(north & south & west)
    else:
        found = two & ~(north & east & south) & ~(east & south & west)
    return np.asarray(found, dtype=np.bool_)
