"""Types of the arguments of public functions, checked before any of them is used.

A wrong object would fail somewhere inside, with a message about an attribute that no caller knows.
"""

from __future__ import annotations

import operator
import os
from collections.abc import Sequence
from pathlib import Path
from types import UnionType
from typing import NamedTuple

import numpy as np

from mapfilter.errors import ConfigError, Faults, fail

# As a call, since type checkers want to know of what texts a PathLike is, and isinstance must not.
PATH: UnionType = operator.or_(Path | str, os.PathLike)
"""With entries of os.scandir and paths of other libraries; each function makes a Path of them."""
_SHOWN = Path | str | int | float | None
_MOST_SHOWN = 60


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


def check_arguments(function: str, *arguments: Argument) -> None:
    """Check the types of a call's arguments, given in their order.

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
    """
    faults = Faults()
    for one in arguments:
        if not one.accepts(one.value):
            hint = _hint(one, arguments)
            faults.add(f"{function}, {one.name}", one.expected, shown(one.value), hint)
    faults.raise_if_any(ConfigError)


def check_path(function: str, name: str, value: object) -> None:
    """Raise ConfigError where a value is no path."""
    check_arguments(function, Argument(name, value, PATH, "a path"))


def check_seed(function: str, seed: object) -> None:
    """Raise ConfigError where a seed is no whole number >= 0."""
    try:
        good = operator.index(seed) >= 0  # type: ignore[arg-type]
    except TypeError:
        good = False
    if not good:
        raise fail(ConfigError, f"{function}, seed", "a whole number >= 0", shown(seed))


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


def _hint(one: Argument, arguments: Sequence[Argument]) -> str:
    """Return that arguments were exchanged, where that would mend the call or one fault of it."""
    for other in arguments:
        misplaced = one.accepts(other.value) or not other.accepts(other.value)
        if misplaced and other.accepts(one.value):
            return f"arguments exchanged; the order is {', '.join(each.name for each in arguments)}"
    return ""
