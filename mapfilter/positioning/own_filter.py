"""A filter that a user wrote, imported by its name.

The name is ``package.module:Name``. Called with a database, it gives an object with the four
functions of :class:`mapfilter.filters.contract.Filter`; prior and readings are epochs. Importing it
runs the code of its module: give only names of modules that you trust.
"""

from __future__ import annotations

import hashlib
import inspect
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import ConfigError, MapfilterError, fail
from mapfilter.filters.contract import Filter
from mapfilter.positioning.epochs import Epoch

MapFilter = Filter[Epoch, Any, Epoch]
"""A filter whose prior and readings are epochs."""

_FUNCTIONS = ("init", "predict", "update", "locate")


@dataclass(frozen=True, slots=True)
class OwnFilter:
    """A filter by its name; it is imported anew by every process.

    Parameters
    ----------
    name : str
        ``package.module:Name``.
    source_sha256 : str
        Of the module's file, so that what an older text of it found is not taken for its results.
    """

    name: str
    source_sha256: str = ""


def own_filter(name: str) -> OwnFilter:
    """Import a filter to see that it is there, and return its options.

    Raises
    ------
    ConfigError
        It cannot be imported, is not called, or lacks a function of a filter.

    Examples
    --------
    >>> own_filter("math:pi")
    Traceback (most recent call last):
        ...
    mapfilter.errors.ConfigError: filter math:pi: expected a class, or a function that makes a \
filter of a database, found float
    """
    found = _imported(name)
    if isinstance(found, type):
        _check_functions(name, found)
    file = _file(inspect.getmodule(found) or _module(name))
    text = file.read_bytes() if file is not None and file.is_file() else b""
    return OwnFilter(name, hashlib.sha256(text).hexdigest())


def make_filter(own: OwnFilter, database: RadioRouteDatabase) -> MapFilter:
    """Make the filter over a database.

    Raises
    ------
    ConfigError
        As :func:`own_filter`, or the filter does not take a database.
    """
    with told_by_name(own.name):
        made: MapFilter = _imported(own.name)(database)
    _check_functions(own.name, made)
    return made


def _imported(name: str) -> Any:
    module, _, path = name.partition(":")
    try:
        found: Any = import_module(module)
        for part in path.split("."):
            found = getattr(found, part)
    # A module may do anything when it is imported, also end the program.
    except (Exception, SystemExit) as error:
        hint = "its folder is neither the working folder nor in PYTHONPATH"
        raise fail(
            ConfigError,
            f"filter {name}",
            "a filter that can be imported as package.module:Name",
            _said(error),
            hint if isinstance(error, ModuleNotFoundError) else "",
        ) from error
    if not callable(found):
        expected = "a class, or a function that makes a filter of a database"
        raise fail(ConfigError, f"filter {name}", expected, type(found).__name__)
    return found


def _check_functions(name: str, found: object) -> None:
    lacking = [one for one in _FUNCTIONS if not callable(getattr(found, one, None))]
    if lacking:
        expected = f"the functions {', '.join(_FUNCTIONS)}"
        raise fail(ConfigError, f"filter {name}", expected, f"no {', '.join(lacking)}")


@contextmanager
def told_by_name(name: str) -> Iterator[None]:
    """Tell what goes wrong in a filter's code with its place; the cause keeps the traceback.

    Raises
    ------
    ConfigError
        In place of any error that is not ours.
    """
    try:
        yield
    except MapfilterError:
        raise
    except Exception as error:
        # The last line outside of libraries is most likely the user's own.
        frames, file = traceback.extract_tb(error.__traceback__), _file(_module(name))
        own = [frame for frame in frames if file is not None and Path(frame.filename) == file]
        at = (own or list(frames))[-1]
        where = f"filter {name}, {Path(at.filename).name} line {at.lineno}, in {at.name}"
        hint = "mapfilter.testing.check_filter tells which clause of the contract it breaks"
        raise fail(ConfigError, where, "a filter that runs", _said(error), hint) from error


def _said(error: BaseException) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())


def _module(name: str) -> ModuleType | None:
    return sys.modules.get(name.partition(":")[0])


def _file(module: ModuleType | None) -> Path | None:
    file = getattr(module, "__file__", None)
    return Path(file) if file else None
