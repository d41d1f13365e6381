"""The door for files that others made: only regular files are opened, and none without a limit.

A named pipe waits for ever for its other end, a device may have no end; both are refused here,
and :func:`open_input` neither waits for a pipe that took the place of a file after the check.
"""

from __future__ import annotations

import codecs
import errno
import json
import os
import re
import stat
import sys
import tomllib
from collections import Counter
from collections.abc import Callable
from io import BufferedReader
from pathlib import Path
from typing import Any

from mapfilter._words import likely_of_no_file
from mapfilter.errors import InputError, MapfilterError, fail

_NO_PATH = (errno.ENAMETOOLONG, errno.ELOOP)
_NO_FILE = "a pipe, socket or device"
_WIDE = {
    codecs.BOM_UTF32_LE: "UTF-32",
    codecs.BOM_UTF32_BE: "UTF-32",
    codecs.BOM_UTF16_LE: "UTF-16",
    codecs.BOM_UTF16_BE: "UTF-16",
}
"""By their marks; that of UTF-32 begins with one of UTF-16, and is looked for first."""
_MOST_DAMAGED = 20
"""Of Windows-1252, "É»" is a letter of UTF-8: there are many more that are none."""
_SHOWN = 60
_FILE_OF_CRS = re.compile(
    r"(?:grids|init|file|catalog|model)=[^\s\"=]*[/\\~]|"
    r"PARAMETERFILE\[\"[^\"]*\",\s?\"[^\"]*[/\\~]",
    re.IGNORECASE,
)


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
            data = stream.read(held_bytes + 1) if held_bytes <= largest_bytes else b""
    except OSError as error:
        raise _unreadable(path, error, kind) from error
    if max(held_bytes, len(data)) > largest_bytes:
        kib = largest_bytes >> 10
        size = f"{kib >> 10} MiB" if kib >= 1024 else f"{kib} KiB"
        raise fail(kind, str(path), f"{what} of at most {size}", "a larger file")
    return data


def toml_values(text: str) -> dict[str, Any]:
    """Return the values of a text in TOML.

    Raises
    ------
    ValueError
        It is no TOML, or holds a number of thousands of digits.
    RecursionError
        Hundreds of its values lie in each other.
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except ValueError as error:
        # Python's own words are advice on a setting of the interpreter.
        raise ValueError("a number of thousands of digits") from error


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
        return _unnamed_letters(path)
    except ValueError:
        return "a path without a zero byte"
    except OSError as error:
        refused = error.errno in _NO_PATH
        return f"a path that the system takes ({error.strerror})" if refused else ""
    usable = stat.S_ISREG(mode) or stat.S_ISDIR(mode)
    return "" if usable else f"a file or a folder, not {_NO_FILE}"


def wide_encoding(data: bytes) -> str:
    """Return ``UTF-16`` or ``UTF-32`` where a text begins with the mark of one, else nothing.

    Examples
    --------
    >>> [wide_encoding("a".encode(codec)) for codec in ("utf-32", "utf-16", "utf-8")]
    ['UTF-32', 'UTF-16', '']
    """
    return next((name for mark, name in _WIDE.items() if data.startswith(mark)), "")


def first_foreign_byte(data: bytes) -> int:
    r"""Return the place of the first byte by which a text is Windows-1252 and no UTF-8; else -1.

    Damaged text with whole letters of UTF-8 is UTF-8, too, also where it is cut off within one:
    in Windows-1252 two letters in a row hardly ever make one.

    Examples
    --------
    >>> first_foreign_byte("Länge".encode("cp1252")), first_foreign_byte("Länge".encode())
    (1, -1)
    >>> first_foreign_byte("Länge".encode() + b",\xe4,\xfc"), first_foreign_byte(b"Qualit\xe9")
    (-1, 6)
    """
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        text = data.decode("utf-8", "replace")
        damaged, letters = text.count("\ufffd"), len(text) - len(text.encode("ascii", "ignore"))
        if (letters - damaged) * _MOST_DAMAGED >= damaged:
            return -1
        try:
            data.decode("cp1252")
        except UnicodeDecodeError:
            return -1
        return error.start
    return -1


def json_value(data: bytes, constant: Callable[[str], Any] | None = None) -> Any:
    """Return the value of a JSON text in UTF-8, with or without a byte order mark.

    ``constant`` is called for NaN and infinities, which are taken by default.

    Raises
    ------
    ValueError
        It is no JSON, in another encoding, or a key stands twice in one object.
    RecursionError
        It is nested too deeply.

    Examples
    --------
    >>> json_value(b'{"a": 1, "a": 2}')
    Traceback (most recent call last):
    ValueError: the key 'a' twice in one object
    """
    if wide := wide_encoding(data):
        raise ValueError(f"{wide} text; save as UTF-8")
    text = data.decode("utf-8-sig")
    return json.loads(text, object_pairs_hook=_without_repeats, parse_constant=constant)


def json_within() -> json.JSONDecoder:
    """Return what reads values of JSON within a text, one after the other; numbers as texts.

    A file of records may be cut off, or hold several values. Keys that stand twice in one object
    have the last value. Raises as :func:`json_value`.

    Examples
    --------
    >>> json_within().raw_decode('{"a": 1.50} {"a"')
    ({'a': '1.50'}, 11)
    """
    return json.JSONDecoder(parse_float=str, parse_int=str)


def named_file(crs_text: str) -> str:
    """Return what a CRS names of the machine's files, or an empty text.

    Grids of PROJ are named without a folder; what has one is any file.

    Examples
    --------
    >>> named_file("+proj=utm +zone=35 +nadgrids=@null"), named_file("+init=./my:crs")
    ('', 'init=./')
    """
    found = _FILE_OF_CRS.search(crs_text)
    return found[0] if found else ""


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


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        times = Counter(name for name, _ in pairs)
        twice = next(name for name, count in times.items() if count > 1)
        raise ValueError(f"the key {shown(twice)} twice in one object")
    return found


def _unnamed_letters(path: Path) -> str:
    """Return the expected kind of path where its bytes are no letters of the locale."""
    codec = sys.getfilesystemencoding()
    try:
        os.fsencode(path).decode()
    except UnicodeError:
        return "a path in UTF-8"
    return f"a path in {codec}, the encoding of the locale (set PYTHONUTF8=1 to use UTF-8)"


def _check_regular(path: Path, mode: int, kind: type[MapfilterError]) -> None:
    if stat.S_ISREG(mode):
        return
    got = os.strerror(errno.EISDIR) if stat.S_ISDIR(mode) else _NO_FILE
    raise fail(kind, str(path), "a readable file", got)


def _unreadable(
    path: Path, error: OSError | ValueError, kind: type[MapfilterError]
) -> MapfilterError:
    got = getattr(error, "strerror", None) or error
    hint = likely_of_no_file(path, "") if isinstance(error, FileNotFoundError) else ""
    return fail(kind, str(path), "a readable file", got, hint)
