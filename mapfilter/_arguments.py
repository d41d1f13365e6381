"""Types of the arguments of public functions, checked before any of them is used.

A wrong object would fail somewhere inside, with a message about an attribute that no caller knows.
"""

from __future__ import annotations

import operator
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, NamedTuple, Protocol, get_args, runtime_checkable

import numpy as np
from annotated_types import Ge

from mapfilter._annotations import expected, fits, items_of, plain_types
from mapfilter.errors import ConfigError, Faults, fail

# As a call, since type checkers want to know of what texts a PathLike is, and isinstance must not.
PATH: UnionType = operator.or_(Path | str, os.PathLike)
"""With entries of os.scandir and paths of other libraries; each function makes a Path of them."""
FUNCTION: Any = Callable | None
_SHOWN = Path | str | int | float | None
_MOST_SHOWN = 60
_AGAIN = "made before mapfilter was imported anew; make it again, or start Python again"

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
    instead : tuple of (type or union of types, str)
        What others are likely to be given, and what to do with each.
    """

    name: str
    value: object
    kinds: type | UnionType
    expected: str
    instead: tuple[tuple[type | UnionType, str], ...] = ()

    def accepts(self, value: object) -> bool:
        """Return whether a value is of one of the kinds; true and false are no numbers."""
        kinds = get_args(self.kinds) or (self.kinds,)
        if isinstance(value, bool | np.bool_) and object not in kinds:
            return bool in kinds
        return isinstance(value, kinds)


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
        whole = int not in kinds or float in kinds or hasattr(value, "__index__")
        return (whole or value is None) and fits(self.annotation, value)


class Entries(NamedTuple):
    """One argument of a call that maps names to values.

    Parameters
    ----------
    kinds : type or union of types
        What each value may be; each key is a text.
    each : str
        A value in words.
    expected : str
        The mapping in words.
    optional : bool
        Whether it may be None.
    """

    name: str
    value: object
    kinds: type | UnionType
    each: str
    expected: str
    optional: bool = True

    def accepts(self, value: object) -> bool:
        """Return whether a value is such a mapping."""
        return not list(self.wrong(value))

    def wrong(self, value: object) -> Iterator[Argument]:
        """Yield what is wrong: the mapping, or each such key and value."""
        if not isinstance(value, Mapping):
            if value is not None or not self.optional:
                yield Argument(self.name, value, Mapping, self.expected)
            return
        for key, one in value.items():
            if not isinstance(key, str):
                yield Argument(f"{self.name}, key", key, str, "a text")
            else:
                entry = Argument(f"{self.name}[{shown(key)}]", one, self.kinds, self.each)
                if not entry.accepts(one):
                    yield entry


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
    >>> weights = Entries("weights", {"a": 1.0, "b": "2"}, float, "a number", "weights by name")
    >>> check_arguments("mean", keywords=[weights])
    Traceback (most recent call last):
        ...
    mapfilter.errors.ConfigError: mean, weights['b']: expected a number, found '2'
    """
    faults = Faults()
    for one in arguments:
        for wrong in _wrong(one):
            hint = _hint(one, arguments)
            faults.add(f"{function}, {wrong.name}", wrong.expected, shown(wrong.value), hint)
    for each in keywords:
        for wrong in _wrong(each):
            hint = _AGAIN if isinstance(wrong, Argument) and _is_namesake(wrong) else ""
            faults.add(f"{function}, {wrong.name}", wrong.expected, shown(wrong.value), hint)
    faults.raise_if_any(ConfigError)


@runtime_checkable
class _Submits(Protocol):
    """What does tasks; of an executor nothing else is used."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Any: ...


def executor_argument(value: object) -> Argument:
    """Return the argument ``executor``, which may be None, to be checked."""
    # A class has the method, too, but nothing to call it of.
    kinds = type(None) if isinstance(value, type) else _Submits | None
    return Argument("executor", value, kinds, "an executor of concurrent.futures")


def items(
    name: str, value: object, kinds: type | UnionType, expected: str
) -> list[Argument | Setting | Entries]:
    """Return the items of a list to be checked, or the list where it is none."""
    listed = items_of(value)
    if listed is None:
        return [Argument(name, value, tuple, f"a list, each {expected}")]
    return [Argument(f"{name}[{k}]", one, kinds, expected) for k, one in enumerate(listed)]


def path_argument(
    name: str, value: object, instead: tuple[tuple[type | UnionType, str], ...] = ()
) -> Argument:
    """Return a path to be checked; ``instead`` as of :class:`Argument`."""
    return Argument(name, value, PATH, "a path", instead)


def generator(function: str, seed: int | np.random.Generator) -> np.random.Generator:
    """Return the random numbers of a seed.

    Raises
    ------
    ConfigError
        The seed is neither a whole number >= 0 nor a generator. None would be another seed in each
        call.
    """
    whole = Setting("seed", seed, WholeNumber)
    if isinstance(seed, np.random.Generator) or whole.accepts(seed):
        return np.random.default_rng(seed)
    expected = f"{whole.expected} or a numpy.random.Generator"
    raise fail(ConfigError, f"{function}, seed", expected, shown(seed))


def shown(value: object) -> str:
    """Return a short value as it is written in Python, and the type of any other.

    Examples
    --------
    >>> shown("out/db"), shown(np.int64(0)), shown({}), shown(dict)
    ("'out/db'", '0', 'dict', 'the class dict')
    """
    if isinstance(value, type):
        return f"the class {value.__name__}"
    value = value.item() if isinstance(value, np.generic) else value
    text = repr(value)
    return text if isinstance(value, _SHOWN) and len(text) <= _MOST_SHOWN else type(value).__name__


def _wrong(one: Argument | Setting | Entries) -> Sequence[Argument | Setting]:
    """Return what is wrong of an argument: nothing, itself, or some of its entries."""
    if isinstance(one, Entries):
        return list(one.wrong(one.value))
    return () if one.accepts(one.value) else (one,)


def _hint(one: Argument | Entries, arguments: Sequence[Argument | Entries]) -> str:
    """Return that arguments were exchanged, where that would mend the call or one fault of it.

    Or that an object was made by classes of before, of which only their names are the same; or
    what to do with one that is likely to be given instead.
    """
    for other in arguments:
        misplaced = one.accepts(other.value) or not other.accepts(other.value)
        if misplaced and other.accepts(one.value):
            return f"arguments exchanged; the order is {', '.join(each.name for each in arguments)}"
    if not isinstance(one, Argument):
        return ""
    if _is_namesake(one):
        return _AGAIN
    return next((what for kinds, what in one.instead if isinstance(one.value, kinds)), "")


def _is_namesake(one: Argument) -> bool:
    """Return whether a value's class has the name of one that is allowed, and is another."""
    own = type(one.value)
    kinds = get_args(one.kinds) or (one.kinds,)
    return any(
        (own.__module__, own.__qualname__) == (kind.__module__, kind.__qualname__) for kind in kinds
    )
