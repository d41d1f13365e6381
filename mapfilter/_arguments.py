"""Types of the arguments of public functions, checked before any of them is used.

A wrong object would fail somewhere inside, with a message about an attribute that no caller knows.
"""

from __future__ import annotations

import operator
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from annotated_types import Ge

from mapfilter.errors import ConfigError, Faults, fail
from mapfilter.options import expected, fits, plain_types

# As a call, since type checkers want to know of what texts a PathLike is, and isinstance must not.
PATH: UnionType = operator.or_(Path | str, os.PathLike)
"""With entries of os.scandir and paths of other libraries; each function makes a Path of them."""
FUNCTION: Any = Callable | None
_SHOWN = Path | str | int | float | None
_MOST_SHOWN = 60

Count = Annotated[int, Ge(1)]
WholeNumber = Annotated[int, Ge(0)]


class Argument(NamedTuple):
    """One argument of a call.

    Parameters
    ----------
    kinds : type or union of types
        What it may be.
    expected : str
        The same in words, with the function that makes it.
    """

    name: str
    value: object
    kinds: type | UnionType
    expected: str

    def accepts(self, value: object) -> bool:
        """Return whether a value is of one of the kinds."""
        return isinstance(value, self.kinds)


class Setting(NamedTuple):
    """One argument of a call that is a number, a text, a choice or true or false.

    Parameters
    ----------
    annotation : type
        With its limits, as for a field of :class:`mapfilter.options.Options`. A whole number has a
        type for these: 2.0 is none.
    """

    name: str
    value: object
    annotation: Any

    @property
    def expected(self) -> str:
        """What it may be, in words."""
        return expected(self.annotation)

    def accepts(self, value: object) -> bool:
        """Return whether a value has the type and lies within the limits."""
        kinds = plain_types(self.annotation)
        if bool in kinds and isinstance(value, np.bool_):
            return True
        whole = int not in kinds or float in kinds or hasattr(value, "__index__")
        return (whole or value is None) and fits(self.annotation, value)


class Entries(NamedTuple):
    """One argument of a call that maps names to values.

    Parameters
    ----------
    kinds : type or union of types
        What each value may be; each key is a text.
    expected : str
        The same in words.
    optional : bool
        Whether it may be None.
    """

    name: str
    value: object
    kinds: type | UnionType
    expected: str
    optional: bool = True

    def accepts(self, value: object) -> bool:
        """Return whether a value is such a mapping."""
        if not isinstance(value, Mapping):
            return value is None and self.optional
        return all(isinstance(k, str) and isinstance(v, self.kinds) for k, v in value.items())


def check_arguments(
    function: str,
    *arguments: Argument | Entries,
    keywords: Sequence[Argument | Setting | Entries] = (),
) -> None:
    """Check the types of a call's arguments, all together.

    Parameters
    ----------
    arguments : Argument or Entries
        Those that are given by their place, in their order.
    keywords : sequence
        Those that are given by name, which nobody exchanges.

    Raises
    ------
    ConfigError
        With every argument of another kind; the hint names those that were exchanged.

    Examples
    --------
    >>> levels = Argument("levels", "a", list, "a list of levels")
    >>> check_arguments("mean", levels, Argument("name", [1.0], str, "a text"))
    Traceback (most recent call last):
        ...
    mapfilter.errors.ConfigError: mean, levels: expected a list of levels, found 'a' \
(likely: arguments exchanged; the order is levels, name)
    mean, name: expected a text, found list \
(likely: arguments exchanged; the order is levels, name)
    >>> check_arguments("mean", keywords=[Setting("smooth", "no", bool)])
    Traceback (most recent call last):
        ...
    mapfilter.errors.ConfigError: mean, smooth: expected true or false, found 'no'
    """
    faults = Faults()
    for one in arguments:
        if not one.accepts(one.value):
            hint = _hint(one, arguments)
            faults.add(f"{function}, {one.name}", one.expected, shown(one.value), hint)
    for each in keywords:
        if not each.accepts(each.value):
            faults.add(f"{function}, {each.name}", each.expected, shown(each.value))
    faults.raise_if_any(ConfigError)


@runtime_checkable
class _Submits(Protocol):
    """What does tasks; of an executor nothing else is used."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Any: ...


def executor_argument(value: object) -> Argument:
    """Return the argument ``executor``, which may be None, to be checked."""
    return Argument("executor", value, _Submits | None, "an executor of concurrent.futures")


def items(
    name: str, value: object, kinds: type | UnionType, expected: str
) -> list[Argument | Setting | Entries]:
    """Return the items of a list to be checked, or the list where it is none."""
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return [Argument(f"{name}[{k}]", one, kinds, expected) for k, one in enumerate(value)]
    return [Argument(name, value, tuple, f"a list, each {expected}")]


def path_argument(name: str, value: object) -> Argument:
    """Return a path to be checked."""
    return Argument(name, value, PATH, "a path")


def generator(function: str, seed: int | np.random.Generator) -> np.random.Generator:
    """Return the random numbers of a seed.

    Raises
    ------
    ConfigError
        The seed is neither a whole number >= 0 nor a generator.
    """
    try:
        return np.random.default_rng(seed)
    except (TypeError, ValueError):
        expected = "a whole number >= 0 or a numpy.random.Generator"
        raise fail(ConfigError, f"{function}, seed", expected, shown(seed)) from None


def shown(value: object) -> str:
    """Return a short value as it is written in Python, and the type of any other.

    Examples
    --------
    >>> shown("out/db"), shown({}), shown(dict)
    ("'out/db'", 'dict', 'the class dict')
    """
    if isinstance(value, type):
        return f"the class {value.__name__}"
    text = repr(value)
    return text if isinstance(value, _SHOWN) and len(text) <= _MOST_SHOWN else type(value).__name__


def _hint(one: Argument | Entries, arguments: Sequence[Argument | Entries]) -> str:
    """Return that arguments were exchanged, where that would mend the call or one fault of it."""
    for other in arguments:
        misplaced = one.accepts(other.value) or not other.accepts(other.value)
        if misplaced and other.accepts(one.value):
            return f"arguments exchanged; the order is {', '.join(each.name for each in arguments)}"
    return ""
