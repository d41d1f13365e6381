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
from contextlib import suppress
from dataclasses import MISSING, dataclass, fields
from functools import cache
from inspect import cleandoc
from math import tau
from types import NoneType
from typing import Annotated, Any, ClassVar, Literal, cast, get_origin, get_type_hints

from annotated_types import Ge, Gt, Le, Lt

from mapfilter._annotations import as_plain, expected, fits, fits_in_files, likely, plain_types
from mapfilter.errors import ConfigError, Faults

Positive = Annotated[float, Gt(0)]
NotNegative = Annotated[float, Ge(0)]
Share = Annotated[float, Ge(0), Le(1)]
Below1 = Annotated[float, Ge(0), Lt(1)]
Probability = Annotated[float, Gt(0), Lt(1)]
Radians = Annotated[float, Ge(0), Le(tau)]
Degrees = Annotated[float, Ge(0), Le(360)]
Seed = Annotated[int, Ge(0), Lt(2**63)]

_ENTRY = re.compile(r"^(\w+(?:, \w+)*) : .*$")


@dataclass(frozen=True, slots=True)
class OptionInfo:
    """One option, for documentation and for sweeps.

    Parameters
    ----------
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
            if fits(annotation, value):
                object.__setattr__(self, name, as_plain(annotation, value))
            else:
                where = f"{type(self).__name__}, {name}"
                hint = likely(annotation, value) or _choice_of(type(self), value)
                faults.add(where, expected(annotation), repr(value), hint)
        # A field of another type may not compare with others; it is named already.
        with suppress(*((TypeError, AttributeError, KeyError) if faults.found else ())):
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


def _choice_of(options: Any, value: Any) -> str:
    """Return the option of which a text is one of the choices, as an argument; "" for none."""
    for name, annotation in _annotations(options).items():
        choices = [one for one in plain_types(annotation) if get_origin(one) is Literal]
        if isinstance(value, str) and any(fits(one, value) for one in choices):
            return f"{name}={str(value)!r}"
    return ""


def describe_options(options: type[Options]) -> Iterator[OptionInfo]:
    """Yield what each field of an option dataclass means, in the order of definition.

    Fields that no configuration file can hold, such as arrays, are left out.

    Examples
    --------
    >>> from mapfilter.simulation.walking import WalkerModel
    >>> next(info.name for info in describe_options(WalkerModel) if info.numeric)
    'change_side_m'
    """
    described = descriptions(options)
    annotations = annotations_of(options)
    for field in fields(options):
        default = field.default if field.default is not MISSING else None
        if field.default_factory is not MISSING:
            default = field.default_factory()
        annotation = annotations[field.name]
        if not fits_in_files(annotation):
            continue
        bare = plain_types(annotation)
        yield OptionInfo(
            field.name,
            default,
            expected(annotation),
            described.get(field.name, ""),
            set(bare) <= {int, float, NoneType} and bare != [NoneType],
        )


def descriptions(options: type) -> dict[str, str]:
    """Return the descriptions in the ``Parameters`` sections of a class and of its bases."""
    found: dict[str, str] = {}
    for one in reversed(options.__mro__):
        found |= _described(cleandoc(one.__doc__ or ""))
    return found


def _described(docstring: str) -> dict[str, str]:
    _, _, rest = docstring.partition("Parameters\n----------\n")
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
