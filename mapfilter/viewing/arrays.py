"""Arrays of numbers in JSON: little-endian bytes in base64, quantised where that suffices."""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

TYPES = ("u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8")

PLACE_M = 0.1
"""Step of places, metres."""
_NOWHERE = -(2**31)


def packed(
    values: ArrayLike,
    code: str,
    *,
    scale: float = 1.0,
    offset: float = 0.0,
    none: int | None = None,
) -> dict[str, Any]:
    """Return an array as the page reads it.

    A value is the number stored times ``scale`` plus ``offset``; measured values out of range are
    those of its ends. ``none`` stands for NaN and may lie at an end of the range only.

    Raises
    ------
    ValueError
        Whole numbers, which may be indices, do not fit into the type.

    Examples
    --------
    >>> packed([0.5, float("nan")], "u1", scale=0.5, none=255)
    {'t': 'u1', 's': [2], 'b': 'Af8=', 'k': 0.5, 'n': 255}
    """
    given = np.asarray(values)
    found: dict[str, Any] = {"t": code, "s": list(given.shape)}
    kind = np.dtype(f"<{code}")
    if kind.kind == "f" or (given.dtype.kind in "iub" and scale == 1.0 and offset == 0.0):
        raw = given.astype(kind)
        if kind.kind != "f" and not np.array_equal(raw, given):
            raise ValueError(f"{given.min()}..{given.max()} does not fit into {code}")
    else:
        low, high = int(np.iinfo(kind).min), int(np.iinfo(kind).max)
        if none is not None:
            low, high = low + (none == low), high - (none == high)
        known = np.isfinite(given)
        steps = np.rint((np.where(known, given, 0.0) - offset) / scale)
        raw = np.clip(steps, low, high).astype(kind)
        if none is not None:
            raw[~known] = none
    found["b"] = b64encode(np.ascontiguousarray(raw).tobytes()).decode("ascii")
    found |= {"k": scale} if scale != 1.0 else {}
    found |= {"o": offset} if offset != 0.0 else {}
    return found | ({"n": none} if none is not None else {})


def places(values_m: ArrayLike) -> dict[str, Any]:
    """Return coordinates in decimetres; NaN where there is no place."""
    return packed(np.asarray(values_m, dtype=np.float64), "i4", scale=PLACE_M, none=_NOWHERE)


def cell_numbers(values: ArrayLike) -> dict[str, Any]:
    """Return numbers of cells, -1 for none, in two bytes each where they fit and else in four.

    Examples
    --------
    >>> cell_numbers([-1, 7])["t"], cell_numbers([40_000])["t"]
    ('i2', 'i4')
    """
    given = np.asarray(values, dtype=np.int64)
    return packed(given, "i2" if given.max(initial=0) <= np.iinfo(np.int16).max else "i4")


def unpacked(array: Mapping[str, Any]) -> NDArray[Any]:
    """Return the values of :func:`packed`; NaN where there are none.

    Raises
    ------
    KeyError, TypeError, ValueError
        It is not such an array.
    """
    if array["t"] not in TYPES:
        raise ValueError(f"type {array['t']!r}")
    raw = np.frombuffer(b64decode(array["b"], validate=True), dtype=f"<{array['t']}")
    raw = raw.reshape([int(size) for size in array["s"]])
    if not {"k", "o", "n"} & set(array):
        return raw
    values = raw * float(array.get("k", 1.0)) + float(array.get("o", 0.0))
    if "n" in array:
        values[raw == array["n"]] = np.nan
    return values


def starts(counts: ArrayLike) -> dict[str, Any]:
    """Return where the rows of each of several groups begin, and where the last one ends."""
    return packed(np.concatenate([[0], np.cumsum(np.asarray(counts, dtype=np.int64))]), "u4")
