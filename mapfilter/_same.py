"""Equality to the last bit of what filters keep and return."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pandas as pd


class EqualByContent:
    """Base of what filters return: equal where all contents are, to the last bit; NaN equals NaN.

    Arrays have no truth value, by which dataclasses would compare them.
    """

    __slots__ = ()
    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        return same(self, other)


class EqualByValue:
    """Base of frozen values: equal where all fields are; NaN equals NaN, and has one hash.

    Dataclasses compare field by field from Python 3.13 on, so that NaN differs from itself there.
    """

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        return same(self, other)

    def __hash__(self) -> int:
        own: Any = self
        values = (getattr(own, one.name) for one in fields(own) if one.compare)
        return hash((type(self), *map(_hashable, values)))


def _hashable(value: Any) -> Any:
    """Return a value, of which the hash of NaN would be another each time."""
    if isinstance(value, tuple):
        return tuple(map(_hashable, value))
    return value if value == value else None


def same(a: Any, b: Any) -> bool:
    """Return whether two beliefs, estimates or outputs are equal to the last bit.

    Objects without an equality of their own are equal where what they hold is; NaN equals NaN.

    Examples
    --------
    >>> class Belief:
    ...     def __init__(self, *east_m):
    ...         self.east_m = np.array(east_m)
    >>> same(Belief(1.0, np.nan), Belief(1.0, np.nan)), same(Belief(1.0), Belief(2.0))
    (True, False)
    """
    return _same(a, b, set())


def _same(a: Any, b: Any, compared: set[tuple[int, int]]) -> bool:
    """Return whether two things are the same; objects hold others that may lead back to them."""
    if is_dataclass(a) and not isinstance(a, type):
        return type(a) is type(b) and all(
            _same(getattr(a, f.name), getattr(b, f.name), compared) for f in fields(a) if f.compare
        )
    if isinstance(a, tuple | list):
        pairs = zip(a, b, strict=False) if type(a) is type(b) else ()
        alike = type(a) is type(b) and len(a) == len(b)
        return alike and all(_same(*pair, compared) for pair in pairs)
    if isinstance(a, Mapping):
        alike = isinstance(b, Mapping) and a.keys() == b.keys()
        return alike and all(_same(a[key], b[key], compared) for key in a)
    if isinstance(a, np.ndarray):
        alike = isinstance(b, np.ndarray) and a.dtype == b.dtype and a.shape == b.shape
        return alike and _same_elements(a, b, compared)
    if isinstance(a, pd.DataFrame | pd.Series | pd.Index):
        return type(a) is type(b) and bool(a.equals(b))
    kind: Any = type(a)
    if a is b or kind.__eq__ is not object.__eq__:
        return bool(a is b or a == b or (a != a and b != b))
    if kind is not type(b):
        return False
    if isinstance(a, np.random.Generator):
        return _same(a.bit_generator.state, b.bit_generator.state, compared)
    if (id(a), id(b)) in compared:
        return True
    compared.add((id(a), id(b)))
    return _same(a.__getstate__(), b.__getstate__(), compared)


def _same_elements(
    a: np.ndarray[Any, Any], b: np.ndarray[Any, Any], compared: set[tuple[int, int]]
) -> bool:
    """Return whether arrays of one kind and shape have the same elements."""
    if a.dtype.names is not None:
        return all(_same_elements(a[name], b[name], compared) for name in a.dtype.names)
    if a.dtype.kind == "O":
        return all(_same(*pair, compared) for pair in zip(a.flat, b.flat, strict=True))
    return np.array_equal(a, b, equal_nan=a.dtype.kind in "fcmM")
