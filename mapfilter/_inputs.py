"""The door for files that others made: only regular files are opened, and none without a limit.

A named pipe waits for ever for its other end, a device may have no end; both are refused here,
and :func:`open_input` neither waits for a pipe that took the place of a file after the check.
"""

from __future__ import annotations

import errno
import os
import stat
from io import BufferedReader
from pathlib import Path

from mapfilter.errors import InputError, MapfilterError, fail

_NO_PATH = (errno.ENAMETOOLONG, errno.ELOOP)
_NO_FILE = "a pipe, socket or device"
_SHOWN = 60


def check_file(path: Path, kind: type[MapfilterError] = InputError) -> int:
    """Return the size of a regular file in bytes.

    Raises
    ------
    InputError or ``kind``
        The path names nothing, a folder, or a pipe, socket or device.
    """
    try:
        found = path.stat()
    except (OSError, ValueError) as error:
        raise _unreadable(path, error, kind) from error
    _check_regular(path, found.st_mode, kind)
    return found.st_size


def open_input(path: Path, kind: type[MapfilterError] = InputError) -> BufferedReader:
    """Open a regular file for reading bytes; never waits for a pipe or a device.

    Raises
    ------
    InputError or ``kind``
        There is no such file, it cannot be read, or it is a folder, pipe, socket or device.
    """
    try:
        # A pipe would wait for its writer otherwise, before anything can be asked about it.
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    except (OSError, ValueError) as error:
        raise _unreadable(path, error, kind) from error
    try:
        _check_regular(path, os.fstat(handle).st_mode, kind)
    except MapfilterError:
        os.close(handle)
        raise
    return os.fdopen(handle, "rb")


def read_input(
    path: Path, largest_bytes: int, what: str, kind: type[MapfilterError] = InputError
) -> bytes:
    """Return the bytes of an input file.

    Raises
    ------
    InputError or ``kind``
        The file is missing, larger than ``largest_bytes``, or a pipe, socket or device.
    """
    try:
        with open_input(path, kind) as stream:
            # A read of N bytes takes memory for N, however short the file is.
            held_bytes = os.fstat(stream.fileno()).st_size
            data = stream.read(min(held_bytes, largest_bytes) + 1)
    except OSError as error:
        raise _unreadable(path, error, kind) from error
    if len(data) > largest_bytes:
        kib = largest_bytes >> 10
        size = f"{kib >> 10} MiB" if kib >= 1024 else f"{kib} KiB"
        raise fail(kind, str(path), f"{what} of at most {size}", "a larger file")
    return data


def path_fault(path: Path) -> str:
    """Return the expected kind of path for messages, or an empty text when nothing is wrong.

    A path may name a file, a folder or nothing yet; whether it can be read or written is found
    later. Pipes are refused because reading would block, and cannot be repeated.

    Examples
    --------
    >>> path_fault(Path("not-yet"))
    ''
    >>> path_fault(Path("a" * 5000))
    'a path that the system takes (File name too long)'
    """
    try:
        str(path).encode()
        mode = path.stat().st_mode
    except UnicodeEncodeError:
        return "a path in UTF-8"
    except ValueError:
        return "a path without a zero byte"
    except OSError as error:
        refused = error.errno in _NO_PATH
        return f"a path that the system takes ({error.strerror})" if refused else ""
    usable = stat.S_ISREG(mode) or stat.S_ISDIR(mode)
    return "" if usable else f"a file or a folder, not {_NO_FILE}"


def is_unicode(value: object) -> bool:
    r"""Return whether the texts in a value of JSON can be written; a lone surrogate cannot.

    Examples
    --------
    >>> is_unicode({"notes": ["2\u00b0"]}), is_unicode({"notes": ["\ud800"]})
    (True, False)
    """
    waiting = [value]
    while waiting:
        one = waiting.pop()
        if isinstance(one, str):
            try:
                one.encode()
            except UnicodeEncodeError:
                return False
        elif isinstance(one, dict):
            waiting += [*one.keys(), *one.values()]
        elif isinstance(one, list):
            waiting += one
    return True


def shown(value: object) -> str:
    """Return a value as messages show it: printable, and not too long.

    Examples
    --------
    >>> shown("a" * 5000)[-4:]
    'aaa…'
    """
    text = repr(value)
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}…"


def _check_regular(path: Path, mode: int, kind: type[MapfilterError]) -> None:
    if stat.S_ISREG(mode):
        return
    got = os.strerror(errno.EISDIR) if stat.S_ISDIR(mode) else _NO_FILE
    raise fail(kind, str(path), "a readable file", got)


def _unreadable(
    path: Path, error: OSError | ValueError, kind: type[MapfilterError]
) -> MapfilterError:
    got = getattr(error, "strerror", None) or error
    return fail(kind, str(path), "a readable file", got)
