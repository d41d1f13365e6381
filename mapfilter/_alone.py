"""One writer of a result at a time: an empty hidden file beside it, locked while it is written.

The system unlocks the file when its process ends, in whatever way: one that a killed process left
locks nobody out, and the next writer removes it.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

from mapfilter.errors import OutputError, fail

# A link there leads to a file of somebody else, and a pipe is not waited for.
_FLAGS = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK


@contextlib.contextmanager
def writing_alone(result: Path) -> Iterator[None]:
    """Keep other processes, and other calls of this one, from writing a result in the block.

    File systems that know no locks are used without.

    Raises
    ------
    OutputError
        Another one writes it, or no file can be made beside it.
    """
    result = Path(os.path.realpath(result)) if result.is_symlink() else result
    lock = result.with_name(f".{result.name}.lock")
    handle = _locked(lock, result)
    try:
        yield
    finally:
        # Unlinked while it is locked: who opened it meanwhile sees that it is gone, and makes one.
        with contextlib.suppress(OSError):
            lock.unlink()
        os.close(handle)


def _locked(lock: Path, result: Path) -> int:
    """Return the descriptor of a locked file that is still there."""
    while True:
        try:
            handle = os.open(lock, _FLAGS, 0o666)
        except OSError as error:
            got = error.strerror or error
            raise fail(OutputError, str(result), "a place that can be written", got) from error
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            os.close(handle)
            expected = "a folder that nothing else writes at the same time"
            got = "one that another command is writing"
            hint = "wait until it ends, or choose another folder"
            raise fail(OutputError, str(result), expected, got, hint) from error
        except OSError:
            # No locks here.
            return handle
        if _is_same(handle, lock):
            return handle
        os.close(handle)


def _is_same(handle: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), path.stat())
    except FileNotFoundError:
        return False
