"""Indexes of Planet: a line for each raw raster, with its edges and the side of its pixels.

A line holds the file's name, its western, eastern, southern and northern edge and the side of a
pixel in metres, and there is no header. Pixels are signed whole numbers of 16 bits, the high byte
first, rows from the north; -9999 is taken for no data. The layout of lines and pixels is that of a
published reader of maps in this format; no export of the tool itself was at hand.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from mapfilter._inputs import open_input
from mapfilter.errors import InputError
from mapfilter.radio.tables import number

HEADER = (("BYTEORDER", "M"), ("NODATA", "-9999"))
"""What a header of these pixels would hold."""
BITS = 16
_NUMBERS = 5
_LONGEST_BYTES = 1 << 24


class PlanetLine(NamedTuple):
    """A line of an index: its number, a file's name, its edges and the side of its pixels.

    ``area_m`` are the western, southern, eastern and northern edges.
    """

    line: int
    name: str
    area_m: tuple[float, float, float, float]
    resolution_m: float


class Unreadable(NamedTuple):
    """A line of an index that lacks a number: its number and its text."""

    line: int
    text: str


def planet_lines(path: Path) -> tuple[PlanetLine | Unreadable, ...]:
    """Return the lines of an index of Planet; none where a file is no such index.

    It is one where at least half of the lines are such: a slip in one does not make it another
    file.
    """
    try:
        with open_input(path) as stream:
            data = stream.read(_LONGEST_BYTES + 1)
    except (OSError, InputError):
        return ()
    if len(data) > _LONGEST_BYTES or b"\0" in data:
        return ()
    lines = tuple(_lines(data.decode("utf-8-sig", "replace")))
    read = sum(isinstance(one, PlanetLine) for one in lines)
    return lines if read and 2 * read >= len(lines) else ()


def _lines(text: str) -> Iterator[PlanetLine | Unreadable]:
    for line, content in enumerate(text.splitlines(), start=1):
        if not content.strip():
            continue
        # Names may have blanks.
        name, *texts = content.strip().rsplit(None, _NUMBERS)
        values = [value for value in map(number, texts) if value is not None]
        if len(values) < _NUMBERS:
            yield Unreadable(line, content.strip())
            continue
        west, east, south, north, side_m = values
        yield PlanetLine(line, name.strip('"'), (west, south, east, north), side_m)
