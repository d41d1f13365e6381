"""Lines of a file of measured levels: a wrong byte or a line too long spoils only itself."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from mapfilter._inputs import first_foreign_byte, open_input, wide_encoding
from mapfilter._separator_line import without_separator_line
from mapfilter.errors import InputError, fail

LONGEST_LINE = _HEAD_BYTES = 1 << 16
"""Characters of a line, and bytes of a file's beginning."""


def lines_of(path: Path) -> Iterator[tuple[int, str | None]]:
    """Yield line numbers and texts; None for a line too long to be one."""
    with _open_text(path) as stream:
        line = 0
        while text := stream.readline(LONGEST_LINE):
            line += 1
            if len(text) < LONGEST_LINE or text.endswith("\n"):
                text = text.rstrip("\r\n")
                yield line, without_separator_line(text) if line == 1 else text
                continue
            while (more := stream.readline(LONGEST_LINE)) and not more.endswith("\n"):
                pass
            yield line, None


def _open_text(path: Path) -> TextIO:
    """Open a file as text in which an invalid byte invalidates only its own row."""
    with open_input(path) as stream:
        head = stream.read(_HEAD_BYTES)
    if not head:
        raise fail(InputError, str(path), "measurements", "an empty file")
    if wide := wide_encoding(head):
        raise fail(InputError, str(path), "text in UTF-8", wide, "saved as Unicode by Excel")
    if head.startswith(b"\x1f\x8b"):
        raise fail(InputError, str(path), "text", "a gzip file", "unpack it first")
    encoding = "cp1252" if _has_windows_names(head) else "utf-8-sig"
    return io.TextIOWrapper(open_input(path), encoding=encoding, errors="replace")


def is_windows(path: Path) -> bool:
    """Return whether the names of columns are in Windows-1252; a wrong byte below is only that."""
    with open_input(path) as stream:
        return _has_windows_names(stream.read(_HEAD_BYTES))


def _has_windows_names(head: bytes) -> bool:
    return first_foreign_byte(head.lstrip().split(b"\n", 1)[0]) >= 0
