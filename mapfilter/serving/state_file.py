"""Saved sessions: the state of a filter as plain numbers and names, without any pickle.

A file is one line of JSON (format, version, lengths, SHA-256 of the rest), a JSON document, and the
bytes of arrays (:mod:`mapfilter.serving.state_values`).
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mapfilter._inputs import json_value, read_input
from mapfilter._io import atomic_file
from mapfilter._json_files import check_version
from mapfilter.errors import StoreError, fail
from mapfilter.serving.state_values import ValueReader, ValueWriter

FORMAT, VERSION = "mapfilter session", 23

_LARGEST_BYTES = 256 << 20
_LARGEST_LINE = 1000


def encode(value: Mapping[str, Any]) -> bytes:
    """Return the bytes of a file that holds a value.

    Parameters
    ----------
    value : mapping
        Numbers, texts, arrays, tuples, mappings with text keys, and objects of listed classes.

    Raises
    ------
    TypeError
        Something else is in it.
    """
    writer = ValueWriter()
    document = json.dumps(writer.value(value), separators=(",", ":"), allow_nan=False).encode()
    rest = b"".join((document, *writer.arrays))
    head = {
        "format": FORMAT,
        "version": VERSION,
        "document_bytes": len(document),
        "bytes": len(rest),
        "sha256": hashlib.sha256(rest).hexdigest(),
    }
    return json.dumps(head).encode() + b"\n" + rest


def decode(data: bytes, where: str) -> dict[str, Any]:
    """Return the value that :func:`encode` was given.

    Raises
    ------
    StoreError
        The bytes are cut off, changed, of another version, or something else.
    """
    line, _, rest = data[: _LARGEST_LINE + 1].partition(b"\n")
    rest = data[len(line) + 1 :]
    try:
        head = json_value(line)
        known = head["format"] == FORMAT
        version, size, digest = head["version"], head["document_bytes"], head["sha256"]
    except (ValueError, TypeError, KeyError, RecursionError):
        known, version, size, digest = False, 0, 0, ""
    if not known:
        raise fail(StoreError, where, f"a {FORMAT}", "something else", "cut off or overwritten")
    check_version(where, version, VERSION)
    if hashlib.sha256(rest).hexdigest() != digest:
        expected, got = "bytes as they were written", "others, by their SHA-256"
        raise fail(StoreError, where, expected, got, "cut off or changed")
    try:
        value = ValueReader(rest[size:]).value(json_value(rest[:size]))
        if not isinstance(value, dict):
            raise TypeError(type(value).__name__)
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError) as error:
        got = f"others ({type(error).__name__}: {error})"
        hint = "written by another version of mapfilter, or edited"
        raise fail(StoreError, where, "the values of a session", got, hint) from error
    return value


def write_session(path: Path, value: Mapping[str, Any]) -> None:
    """Write a value to a file that only this user can read; it is there whole, or as before."""
    data = encode(value)
    with atomic_file(path) as temporary:
        temporary.touch(mode=0o600)
        temporary.write_bytes(data)


def read_session(path: Path) -> dict[str, Any]:
    """Read what :func:`write_session` has written; raise StoreError where that is not there."""
    data = read_input(path, _LARGEST_BYTES, "a session", StoreError)
    return decode(data, str(path))
