"""Lines of a file of measured levels: a wrong byte or a line too long spoils only itself."""

from __future__ import annotations

import io
import os
import re
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
_TAIL_BYTES, _PART_BYTES = 1 << 18, 1 << 20
_FOREIGN_WORD = re.compile(rb"[A-Za-z][\x80-\xff]|[\x80-\xff][A-Za-z]")
Lines = Iterator[tuple[int, str | None]]
"""Line numbers and texts; None for a line too long to be one."""


def lines_of(path: Path, *, windows: bool | None = None) -> Lines:
    """Yield line numbers and texts; None for a line too long to be one.

    Parameters
    ----------
    windows : bool or None
        Whether the file is in Windows-1252, not UTF-8; None for what the names of columns say.
    """
    with _open_text(path, windows) as stream:
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


def _open_text(path: Path, windows: bool | None) -> TextIO:
    """Open a file as text in which an invalid byte invalidates only its own row."""
    with open_input(path) as stream:
        head = stream.read(_HEAD_BYTES)
    if not head:
        raise fail(InputError, str(path), "measurements", "an empty file")
    if wide := wide_encoding(head):
        raise fail(InputError, str(path), "text in UTF-8", wide, "saved as Unicode by Excel")
    if head.startswith(b"\x1f\x8b"):
        raise fail(InputError, str(path), "text", "a gzip file", "unpack it first")
    if windows is None:
        windows = _is_windows(head.lstrip().split(b"\n", 1)[0])
    encoding = "cp1252" if windows else "utf-8-sig"
    return io.TextIOWrapper(open_input(path), encoding=encoding, errors="replace")


def is_windows(path: Path) -> bool:
    """Return whether a file is in Windows-1252, by lines with words that are no ASCII.

    A wrong byte in a number is only that.
    """
    foreign = b""
    with open_input(path) as stream:
        while len(foreign) < _HEAD_BYTES and (part := stream.read(_PART_BYTES)):
            part += stream.readline(LONGEST_LINE)
            if not part.isascii():
                lines = part.splitlines(keepends=True)
                foreign += b"".join(line for line in lines if _FOREIGN_WORD.search(line))
    return _is_windows(foreign)


def _is_windows(text: bytes) -> bool:
    """Return whether text is in Windows-1252, by its whole lines."""
    end = text.rfind(b"\n") + 1
    return first_foreign_byte(text[:end] or text) >= 0
