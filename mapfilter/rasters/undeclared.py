"""Numbers in rasters that mean no data though their files do not state it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np

from mapfilter._types import Floats32
from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError
from mapfilter.rasters.files import Quantity, as_stored

_NO_LEVEL_BELOW = -300.0
_NO_LEVEL_ABOVE = 60.0
_LEAST_LOSS_DB = 20.0
_STRONGEST_DBM, _WEAKEST_DBM = -20.0, -140.0
"""Levels beyond these are rare."""
_LARGEST_LOSS_DB = 200.0
_TELLING_SHARE = 0.01
_NEAR_ZERO = 1.0
_LARGEST_OF_TYPES = (255.0, 32767.0, 65535.0)
_FAR_DB = 20.0
_MANY_TIMES = 10
_FEWEST = 20
_MARKERS = (0.0, -1.0, 1.0)
"""Stored numbers that mean no data in a hole of any size, where all about it is far from them."""


def nodata_taken_as_level(values: Floats32, factor: float = 1.0) -> tuple[float, float] | None:
    """Return the number that means no data though the file does not state it, and its share.

    That is one and the same number, beyond all levels (such as -9999), exactly 0 among levels
    that are below it, the largest number of an integer type, far above all others, or any number
    that hardly a level or loss reaches (-1, -200), in 20 pixels or more and far from all others.
    On a lattice it is also a stored 0, -1 or 1 far from the pixels beside it, be it a single one.

    Parameters
    ----------
    values : ndarray of float32
        NaN without data; of shape (rows, cols) on a lattice.
    factor : float
        By which the stored numbers were multiplied.

    Examples
    --------
    >>> nodata_taken_as_level(np.float32([-80.5, -91.25, -9999, -9999]))
    (-9999.0, 0.5)
    >>> nodata_taken_as_level(np.float32([-80.5, 0, 0, -70]))
    (0.0, 0.5)
    >>> nodata_taken_as_level(np.float32([80, 140, 255, 255]))
    (255.0, 0.5)
    >>> nodata_taken_as_level(np.repeat(np.float32([-80.5, -91.25, -1, -70]), 30))
    (-1.0, 0.25)
    >>> nodata_taken_as_level(np.float32([-80.5, -70]))
    """
    known = values[~np.isnan(values)]
    if (top := _top_of_type(known, factor)) is not None:
        return top
    low, others = known[known < _NO_LEVEL_BELOW], known[known >= _NO_LEVEL_BELOW]
    if low.size and others.size and (low == low[0]).all() and (others >= 0).all():
        return float(low[0]), low.size / known.size
    beyond = known[(known < _NO_LEVEL_BELOW) | (known > _NO_LEVEL_ABOVE)]
    inside = known.size - beyond.size
    if beyond.size and (beyond == beyond[0]).all() and (inside == 0 or (known < 0).any()):
        return float(beyond[0]), beyond.size / known.size
    zero, others = int((known == 0).sum()), known[known != 0]
    if not known.size or zero < _TELLING_SHARE * known.size:
        return _far_from_others(known) or _hole(values, known.size, factor)
    # Zero means no data where nothing comes near it.
    near = int((np.abs(others) < _NEAR_ZERO).sum())
    apart = bool((others < 0).all() or (others >= _LEAST_LOSS_DB).all())
    if apart and zero > _MANY_TIMES * near:
        return 0.0, zero / known.size
    return _hole(values, known.size, factor)


def check_nodata_stated(
    values: Floats32, cells: Sequence[str], quantity: Quantity, factor: float, path: Path
) -> None:
    """Check that no number that means no data is taken for a strong level.

    Weak ones do no harm: no cell is received there.

    Parameters
    ----------
    values : ndarray of float32, shape (cells, rows, cols)
        Read from a file, times the factor.
    """
    if quantity == "level":
        low, high = _STRONGEST_DBM, _NO_LEVEL_ABOVE
        wanted = np.fmax.reduce(values, axis=None) > low
    else:
        low, high = -np.inf, _LEAST_LOSS_DB
        wanted = quantity == "loss" and np.fmin.reduce(values, axis=None) < high
    if not wanted:
        return
    faults = Faults()
    for cell_id, band in zip(cells, values, strict=True):
        number, share = nodata_taken_as_level(band, factor) or (np.nan, 0.0)
        known = int(np.count_nonzero(~np.isnan(band)))
        if share * known < _FEWEST:
            number, share = _hole(band, known, factor) or (np.nan, 0.0)
        if low < number < high:
            part = number_of(round(share * known), "pixel")
            if share >= _TELLING_SHARE and share * known >= _FEWEST:
                part = f"{share:.0%} of the pixels"
            got = f"{number:g} in {part} of a tile"
            stored = as_stored(number, factor)
            hint = f"{stored} means no data, and the file does not state it; set nodata"
            faults.add(f"{path} pixels, cell {cell_id}", f"a {quantity}, or no data", got, hint)
    faults.raise_if_any(InputError)


def _far_from_others(known: Floats32) -> tuple[float, float] | None:
    """Return a number that hardly a level or loss reaches, and its share.

    It may be that of a small hole in the data: on a street it would be the strongest level by far.
    """
    if not known.size:
        return None
    low, high = float(known.min()), float(known.max())
    are_levels = np.count_nonzero(known < 0) > np.count_nonzero(known > _LEAST_LOSS_DB)
    if are_levels:
        likely = [high] * (high > _STRONGEST_DBM) + [low] * (low < _WEAKEST_DBM)
    else:
        likely = [low] * (low < _LEAST_LOSS_DB) + [high] * (high > _LARGEST_LOSS_DB)
    for number in likely:
        count = np.count_nonzero(known == number)
        near = np.count_nonzero(np.abs(known - number) < _FAR_DB) - count
        if _FEWEST <= count < known.size and count > _MANY_TIMES * near:
            return number, float(count) / known.size
    return None


def _hole(values: Floats32, known: int, factor: float) -> tuple[float, float] | None:
    """Return a stored 0, -1 or 1 that is far from all pixels beside it, and its share."""
    if values.ndim != 2:
        return None
    for marker in _MARKERS:
        number = np.float32(marker * factor)
        marked = values == number
        if marked.any():
            # What is beyond the edge, and the marked ones themselves, are far from nothing.
            padded = np.pad(np.where(marked, np.nan, values), 1, constant_values=np.nan)
            nearest_db = np.inf
            for row, col in product(range(3), repeat=2):
                beside = padded[row : row + len(values), col : col + values.shape[1]][marked]
                away_db = np.abs(beside[~np.isnan(beside)] - number)
                nearest_db = min(nearest_db, away_db.min(initial=np.inf))
            if _FAR_DB <= nearest_db < np.inf:
                return float(number), np.count_nonzero(marked) / known
    return None


def _top_of_type(known: Floats32, factor: float) -> tuple[float, float] | None:
    """Return the largest number of an integer type and its share, where it means no data.

    Numbers that reach up to it are those of a raster that was cut off there.
    """
    exact = known / np.float64(factor)
    stored = np.rint(exact)
    if not known.size or stored.max() not in _LARGEST_OF_TYPES:
        return None
    if not np.allclose(exact, stored, rtol=1e-6, atol=1e-3):
        return None
    at_top = stored == stored.max()
    share, others = float(at_top.mean()), known[~at_top]
    if share < _TELLING_SHARE or not others.size:
        return None
    top = known[at_top][0]
    far = np.abs(top - others).min() >= _FAR_DB
    return (float(top), share) if far else None
