"""Where compiled kernels are kept, if numba finds no place itself."""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from mapfilter.errors import OutputError, fail

_NAME = "NUMBA_CACHE_DIR"
_PREFIX = "mapfilter-kernels-"


@cache
def keep_kernels() -> None:
    """Give numba a folder of this process where neither package nor home can be written.

    Without any place numba refuses to define a kernel, as for a user without a home in a container
    that may not be written to. The folder is removed when the process ends, so kernels are compiled
    each time. Processes that this one starts use it, too.

    Raises
    ------
    OutputError
        Nothing can be written in the temporary folder either.
    """
    if os.environ.get(_NAME) or any(map(_takes_files, _usual_places())):
        return
    try:
        folder = tempfile.mkdtemp(prefix=_PREFIX)
    except OSError as error:
        hint = f"set {_NAME} to a folder of your own"
        got = error.strerror or error
        raise fail(OutputError, "compiled kernels", "a place to keep them", got, hint) from error
    os.environ[_NAME] = folder
    if (numba := sys.modules.get("numba")) is not None:
        # It read the environment when it was imported.
        numba.config.CACHE_DIR = folder
    atexit.register(_remove, folder, os.getpid())


def _remove(folder: str, owner: int) -> None:
    # A copy of the process (fork) ends earlier.
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)


def _usual_places() -> Iterator[Path]:
    """Yield where numba keeps kernels: beside the sources, and in the user's folder of caches."""
    yield Path(__file__).parent / "__pycache__"
    given = os.environ.get("XDG_CACHE_HOME")
    caches = Path(given) if given else Path(os.path.expanduser("~")) / ".cache"  # noqa: PTH111
    # Without a home the tilde stays, which would be a folder of that name here.
    if caches.is_absolute():
        yield caches / "numba"


def _takes_files(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
