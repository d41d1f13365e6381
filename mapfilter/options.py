"""Options as plain dataclasses: each is defined once, with its limits, in the field's annotation.

A dataclass of options is what Python users give as keyword arguments, a section of the
configuration file, a page of the documentation, and the list of axes that a sweep may vary. Its
docstring describes each field; its annotations hold the limits::

    @dataclass(frozen=True, slots=True)
    class Walk(Options):
        speed_mps: Positive = 1.4

Names carry their unit (``_m``, ``_deg``, ``_dbm``).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache
from inspect import cleandoc
from math import isfinite
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    ClassVar,
    Literal,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

from annotated_types import Ge, Gt, Le, Lt

from mapfilter.errors import ConfigError, Faults

Positive = Annotated[float, Gt(0)]
NotNegative = Annotated[float, Ge(0)]
Share = Annotated[float, Ge(0), Le(1)]
Below1 = Annotated[float, Ge(0), Lt(1)]
Probability = Annotated[float, Gt(0), Lt(1)]
Degrees = Annotated[float, Ge(0), Le(360)]
Seed = Annotated[int, Ge(0), Lt(2**63)]

_LIMITS = (Ge, Gt, Le, Lt)
_ENTRY = re.compile(r"^(\w+(?:, \w+)*) : .*$")


@dataclass(frozen=True, slots=True)
class OptionInfo:
    """One option, for documentation and for sweeps.

    Parameters
    ----------
    name : str
    default : object
    expected : str
        Type and limits in words, such as ``a number > 0``.
    description : str
        From the docstring of the dataclass.
    numeric : bool
        Whether it is a number (no bool), so that a sweep may vary it.
    """

    name: str
    default: Any
    expected: str
    description: str
    numeric: bool


class Options:
    """Base of option dataclasses: values are checked when one is made, all faults together.

    Raises
    ------
    ConfigError
        Names each field whose value is of another type or beyond its limits.
    """

    __slots__ = ()
    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __post_init__(self) -> None:
        """Check all fields against their annotations."""
        faults = Faults()
        for name, annotation in _annotations(cast(Any, type(self))).items():
            value = getattr(self, name)
            if not fits(annotation, value):
                faults.add(f"{type(self).__name__}, {name}", expected(annotation), repr(value))
        self.check(faults)
        faults.raise_if_any(ConfigError)

    def check(self, faults: Faults) -> None:
        """Add faults of fields that do not go together; called after each field was checked."""


def annotations_of(options: type[Options]) -> dict[str, Any]:
    """Return the annotation of each field, with its limits."""
    return dict(_annotations(cast(Any, options)))


@cache
def _annotations(options: Any) -> dict[str, Any]:
    hints = get_type_hints(options, include_extras=True)
    return {field.name: hints[field.name] for field in fields(options)}


def describe_options(options: type[Options]) -> Iterator[OptionInfo]:
    """Yield what each field of an option dataclass means, in the order of definition.

    Examples
    --------
    >>> from mapfilter.simulation.walking import WalkerModel
    >>> next(info.name for info in describe_options(WalkerModel) if info.numeric)
    'change_side_m'
    """
    described = _descriptions(cast(Any, options))
    annotations = annotations_of(options)
    for field in fields(options):
        default = field.default if field.default is not MISSING else None
        if field.default_factory is not MISSING:
            default = field.default_factory()
        annotation = annotations[field.name]
        bare = plain_types(annotation)
        yield OptionInfo(
            field.name,
            default,
            expected(annotation),
            described.get(field.name, ""),
            set(bare) <= {int, float, NoneType} and bare != [NoneType],
        )


def expected(annotation: Any) -> str:
    """Return in words what an annotation allows.

    Examples
    --------
    >>> expected(Share), expected(Positive), expected(Literal["set", "list"] | None)
    ('a number in 0..1', 'a number > 0', "'set', 'list', or nothing")
    """
    inner, limits = _split(annotation)
    origin = get_origin(inner)
    if origin is Literal:
        return " or ".join(repr(value) for value in get_args(inner))
    if origin in (Union, UnionType):
        *others, last = (
            word
            for one in get_args(inner)
            for word in (
                map(repr, get_args(one)) if get_origin(one) is Literal else [expected(one)]
            )
        )
        return (
            f"{', '.join(others)} or {last}"
            if len(others) < 2
            else f"{', '.join(others)}, or {last}"
        )
    words = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}
    if inner is NoneType:
        return "nothing"
    word = words.get(inner, getattr(inner, "__name__", str(inner)))
    low = next((one for one in limits if isinstance(one, Ge | Gt)), None)
    high = next((one for one in limits if isinstance(one, Le | Lt)), None)
    match low, high:
        case Ge(ge=a), Le(le=b):
            return f"{word} in {a}..{b}"
        case None, None:
            return word
    parts = [
        f"{sign} {getattr(one, name)}"
        for one, (sign, name) in (
            (limit, _SIGNS[type(limit)]) for limit in (low, high) if limit is not None
        )
    ]
    return f"{word} {' and '.join(parts)}"


_SIGNS: dict[type, tuple[str, str]] = {
    Ge: (">=", "ge"),
    Gt: (">", "gt"),
    Le: ("<=", "le"),
    Lt: ("<", "lt"),
}


def _split(annotation: Any) -> tuple[Any, list[Any]]:
    if get_origin(annotation) is Annotated:
        inner, *marks = get_args(annotation)
        return inner, [mark for mark in marks if isinstance(mark, _LIMITS)]
    return annotation, []


def plain_types(annotation: Any) -> list[Any]:
    """Return the types of a union, without limits."""
    inner, _ = _split(annotation)
    if get_origin(inner) in (Union, UnionType):
        return [one for part in get_args(inner) for one in plain_types(part)]
    return [inner]


def fits(annotation: Any, value: Any) -> bool:
    """Tell whether a value is what an annotation allows."""
    inner, limits = _split(annotation)
    origin = get_origin(inner)
    if origin is Literal:
        return any(value == one and type(value) is type(one) for one in get_args(inner))
    if origin in (Union, UnionType):
        return any(fits(one, value) for one in get_args(inner))
    if inner is NoneType:
        return value is None
    if inner is bool or inner is str:
        return isinstance(value, inner)
    if inner in (int, float):
        try:
            number = float(value)
        except (TypeError, ValueError):
            return False
        if isinstance(value, bool | str) or not isfinite(number):
            return False
        return (inner is float or number == int(number)) and all(
            _holds(one, value) for one in limits
        )
    # Lists, paths and nested options check themselves or are checked by their owner.
    return is_dataclass(inner) is False or isinstance(value, inner)


def _holds(limit: Any, value: Any) -> bool:
    match limit:
        case Ge(ge=bound):
            return bool(value >= bound)
        case Gt(gt=bound):
            return bool(value > bound)
        case Le(le=bound):
            return bool(value <= bound)
        case Lt(lt=bound):
            return bool(value < bound)
    return True


@cache
def _descriptions(options: Any) -> dict[str, str]:
    """Return the descriptions in the ``Parameters`` section of a numpydoc docstring."""
    _, _, rest = cleandoc(options.__doc__ or "").partition("Parameters\n----------\n")
    found: dict[str, str] = {}
    names: list[str] = []
    for line in rest.splitlines():
        entry = _ENTRY.match(line)
        if entry:
            names = entry[1].split(", ")
        elif line.startswith("    ") and names:
            for name in names:
                found[name] = f"{found.get(name, '')} {line.strip()}".strip()
        elif line and not line.startswith(" "):
            break
    return found
