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
    """A line of an index: its number, a file's name, its edges and the side of its pixels."""

    line: int
    name: str
    area_m: tuple[float, float, float, float]
    resolution_m: float


def planet_lines(path: Path) -> tuple[PlanetLine, ...]:
    """Return the lines of an index of Planet; none where a file is no such index."""
    try:
        with open_input(path) as stream:
            data = stream.read(_LONGEST_BYTES + 1)
    except (OSError, InputError):
        return ()
    if len(data) > _LONGEST_BYTES or b"\0" in data:
        return ()
    try:
        return tuple(_lines(data.decode("utf-8-sig", "replace")))
    except ValueError:
        return ()


def _lines(text: str) -> Iterator[PlanetLine]:
    for line, content in enumerate(text.splitlines(), start=1):
        if not content.strip():
            continue
        # Names may have blanks.
        name, *texts = content.strip().rsplit(None, _NUMBERS)
        west, east, south, north, side_m = map(_metres, texts)
        yield PlanetLine(line, name.strip('"'), (west, south, east, north), side_m)


def _metres(text: str) -> float:
    value = number(text)
    if value is None:
        raise ValueError(f"expected a number, found {text!r}")
    return value
