"""Lines of a file of measured levels: a wrong byte or a line too long spoils only itself."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from mapfilter._cut_ends import header_end, without_cut_row
from mapfilter._inputs import first_foreign_byte, open_input, wide_encoding
from mapfilter._separator_line import without_separator_line
from mapfilter.errors import InputError, fail

SEPARATORS = (",", ";", "\t")
LONGEST_LINE = _HEAD_BYTES = 1 << 16
"""Characters of a line, and bytes of a file's beginning."""
_TAIL_BYTES = 1 << 18
Lines = Iterator[tuple[int, str | None]]
"""Line numbers and texts; None for a line too long to be one."""


def lines_of(path: Path) -> Lines:
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


def cut_end(path: Path) -> str:
    """Return how the last row of a file was cut off, "" where it is whole; zero bytes are none."""
    with open_input(path) as stream:
        separator, begin = header_end(stream.read(_HEAD_BYTES), SEPARATORS)
        size = stream.seek(0, os.SEEK_END)
        start = max(size - _TAIL_BYTES, 0)
        stream.seek(start)
        data = stream.read()
    return without_cut_row(data, separator, max(begin - start, 0))[1]


def without_last(lines: Lines, last: list[int]) -> Lines:
    """Yield all lines but the last one that is not blank, whose number is put into ``last``."""
    before = None
    for one in lines:
        if one[1] is not None and not one[1].strip():
            continue
        if before is not None:
            yield before
        before = one
    last += [before[0]] if before is not None else []


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
