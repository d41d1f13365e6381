"""Errors in the code of a custom filter: named by its file and line, or by what it returned."""

from __future__ import annotations

import inspect
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

from mapfilter.errors import ConfigError, MapfilterError, fail
from mapfilter.filters.contract import ReturnTypeError

ADVICE = "mapfilter.testing.check_filter names the clause of the contract that it breaks"
"""Hint of errors in the code of a custom filter."""


@contextmanager
def wrap_user_errors(name: str, owner: object = None) -> Iterator[None]:
    """Name the file and line of an error in a filter's code; the cause keeps the traceback.

    Of what a function returns against the contract, the function is named.

    Parameters
    ----------
    owner : object
        The filter, or its class, where the name is not that of a module.

    Raises
    ------
    ConfigError
        In place of any error that is not ours.
    """
    try:
        yield
    except MapfilterError:
        raise
    except ReturnTypeError as error:
        where = f"filter {name}, {error.function}"
        raise fail(ConfigError, where, f"it to return {error.expected}", error.got) from error
    except Exception as error:
        # The last line outside of libraries is most likely the user's own.
        frames, file = (
            traceback.extract_tb(error.__traceback__),
            file_of(
                module_of(name)
                or inspect.getmodule(owner if isinstance(owner, type) else type(owner))
            ),
        )
        own = [frame for frame in frames if file is not None and Path(frame.filename) == file]
        at = (own or list(frames))[-1]
        where = f"filter {name}, {Path(at.filename).name} line {at.lineno}, in {at.name}"
        raise fail(ConfigError, where, "a filter that runs", fault_text(error), ADVICE) from error


def fault_text(error: BaseException) -> str:
    """Return an error's kind and message on one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())


def module_of(name: str) -> ModuleType | None:
    """Return the imported module of a filter's name; None for none."""
    return sys.modules.get(name.partition(":")[0])


def file_of(module: ModuleType | None) -> Path | None:
    """Return the file of a module; None where it has none."""
    file = getattr(module, "__file__", None)
    return Path(file) if file else None
