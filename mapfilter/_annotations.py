"""What annotations with limits allow: in words, and whether a value fits."""

from __future__ import annotations

import operator
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, is_dataclass
from math import isfinite, tau
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import numpy as np
from annotated_types import Ge, Gt, Le, Lt

_LIMITS: dict[type, tuple[str, str, Callable[[Any, Any], Any]]] = {
    Ge: ("ge", ">=", operator.ge),
    Gt: ("gt", ">", operator.gt),
    Le: ("le", "<=", operator.le),
    Lt: ("lt", "<", operator.lt),
}
_TYPES = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}
_TYPES |= {Path: "a path", NoneType: "nothing", tuple: "a list", dict: "a section"}
_WHOLE_TURN_DEG = 360.0
_CONTAINERS = (Literal, tuple, dict)


@dataclass(frozen=True, slots=True)
class Words:
    """In an annotation: the allowed values in words, where the type is not enough.

    Parameters
    ----------
    text : str
        Such as ``two numbers: longitude, latitude``.
    """

    text: str


def expected(annotation: Any) -> str:
    """Return in words what an annotation allows.

    Examples
    --------
    >>> expected(Annotated[float, Ge(0), Le(1)]), expected(Annotated[float, Gt(0)])
    ('a number in 0..1', 'a number > 0')
    >>> expected(Literal["set", "list"] | None)
    "'set', 'list', or nothing"
    """
    if words := next((one for one in get_args(annotation) if isinstance(one, Words)), None):
        return words.text
    inner, limits = _split(annotation)
    origin = get_origin(inner)
    if origin in (Literal, Union, UnionType):
        *others, last = _alternatives(inner)
        comma = "," if len(others) > 1 else ""
        return f"{', '.join(others)}{comma} or {last}" if others else last
    known = "a section" if hasattr(inner, "model_fields") else str(inner)
    word = _TYPES.get(origin or inner, known)
    match limits:
        case [Ge(ge=low), Le(le=high)]:
            return f"{word} in {_number(low)}..{_number(high)}"
        case []:
            return word
    return f"{word} {' and '.join(map(_limit, limits))}"


def _alternatives(annotation: Any) -> list[str]:
    """Return in words what each member of a union or literal allows."""
    if get_origin(annotation) is Literal:
        return [repr(value) for value in get_args(annotation)]
    if get_origin(annotation) in (Union, UnionType):
        return [word for one in get_args(annotation) for word in _alternatives(one)]
    return [expected(annotation)]


def likely(annotation: Any, value: Any) -> str:
    """Return the probable mistake behind a value beyond its limits, or an empty text."""
    _, limits = _split(without_none(annotation))
    share = any(getattr(limit, "le", getattr(limit, "lt", None)) == 1 for limit in limits)
    whole_turn = any(getattr(limit, "le", None) == tau for limit in limits)
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if whole_turn and number and tau < value <= _WHOLE_TURN_DEG:
        return "degrees given for radians"
    return "per cent given for a fraction" if share and number and 1 < value <= 100 else ""


def without_none(annotation: Any) -> Any:
    """Return an annotation without ``None``."""
    inner, _ = _split(annotation)
    if get_origin(inner) not in (Union, UnionType):
        return annotation
    return Union[tuple(one for one in get_args(inner) if one is not NoneType)]  # noqa: UP007


def _limit(limit: Any) -> str:
    name, sign, _ = _LIMITS[type(limit)]
    return f"{sign} {_number(getattr(limit, name))}"


def _number(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _split(annotation: Any) -> tuple[Any, list[Any]]:
    if get_origin(annotation) is Annotated:
        inner, *marks = get_args(annotation)
        return inner, [mark for mark in marks if isinstance(mark, tuple(_LIMITS))]
    return annotation, []


def plain_types(annotation: Any) -> list[Any]:
    """Return the types of a union, without limits."""
    inner, _ = _split(annotation)
    if get_origin(inner) in (Union, UnionType):
        return [one for part in get_args(inner) for one in plain_types(part)]
    return [inner]


def fits_in_files(annotation: Any) -> bool:
    """Return whether a configuration file can hold values of all types of an annotation."""
    return all(one in _TYPES or get_origin(one) in _CONTAINERS for one in plain_types(annotation))


def fits(annotation: Any, value: Any) -> bool:
    """Return whether an annotation allows a value."""
    inner, limits = _split(annotation)
    origin = get_origin(inner)
    if origin is Literal:
        return any(_equals(value, one) for one in get_args(inner))
    if origin in (Union, UnionType):
        return any(fits(one, value) for one in get_args(inner))
    if origin is tuple:
        kinds = get_args(inner)
        items = items_of(value)
        if items is None:
            return False
        if kinds[-1] is Ellipsis:
            return all(fits(kinds[0], one) for one in items)
        return len(items) == len(kinds) and all(map(fits, kinds, items))
    if inner is NoneType:
        return value is None
    if inner is bool:
        return isinstance(value, bool | np.bool_)
    if inner is str:
        return isinstance(value, str)
    if inner is Path:
        return isinstance(value, str | os.PathLike)
    if inner in (int, float):
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError):
            return False
        if isinstance(value, bool | np.bool_ | str):
            return False
        if not isfinite(number):
            return False
        return (inner is float or number == int(number)) and all(
            _holds(one, value) for one in limits
        )
    # Lists and nested options check themselves or are checked by their owner.
    return not (isinstance(inner, type) and is_dataclass(inner)) or isinstance(value, inner)


def items_of(value: Any) -> list[Any] | None:
    """Return the items of a list, of another sequence or of an array of one dimension, else None.

    Examples
    --------
    >>> items_of((1, 2)), items_of(np.arange(2).astype(str)), items_of("12")
    ([1, 2], ['0', '1'], None)
    """
    if isinstance(value, str | bytes | bytearray):
        return None
    if isinstance(value, np.ndarray):
        return value.tolist() if value.ndim == 1 else None
    listed = isinstance(value, Sequence) or getattr(value, "ndim", None) == 1
    return list(value) if listed else None


def _equals(value: Any, choice: Any) -> bool:
    """Return whether a value is a choice: texts by value, all else with its type, as True == 1."""
    same = isinstance(value, str) and isinstance(choice, str)
    return (same or type(value) is type(choice)) and bool(value == choice)


def as_plain(annotation: Any, value: Any) -> Any:
    """Return what is NumPy's, or a whole float for an integer, as Python's own value."""
    types = plain_types(annotation)
    if isinstance(value, np.bool_):
        return bool(value)
    if any(get_origin(one) is tuple for one in types) and not isinstance(value, tuple):
        items = items_of(value)
        if items is not None:
            return tuple(items)
    if value is None or not {int, float} & set(types) or isinstance(value, str | tuple):
        return value
    if float in types:
        return value if type(value) in (int, float) else float(value)
    return int(value)


def _holds(limit: Any, value: Any) -> bool:
    name, _, holds = _LIMITS[type(limit)]
    return bool(holds(value, getattr(limit, name)))
