"""Epochs of RINEX 2 observations: lines that name satellites, then lines of each of them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime

import numpy as np
import pyarrow as pa

from mapfilter._constants import GPS_EPOCH_S
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.rinex_epochs import Observations, Records, Wanted, observed
from mapfilter.tracks.readers.texts.lines import blocks, line_texts

_DATE = re.compile(
    rb"(\d{1,4})\s+(\d{1,2})\s+(\d{1,2})\s+(\d{1,2})\s+(\d{1,2})\s+(\d{1,2}(?:\.\d*)?)"
)
_MEASURED, _EVENTS, _SLIPS = (b"0", b"1", b" ", b""), (b"2", b"3", b"4", b"5"), b"6"
"""Flags of epochs; slips of cycles are written as observations are."""
_NAMES_OF_LINE, _VALUES_OF_LINE = 12, 5
_MOST_TYPES = 100


@dataclass(slots=True)
class _Epochs:
    """Epochs of a block: seconds, number and names of satellites, the first line of the first.

    Lines are counted from 0. ``end`` is the line after the last whole epoch.
    """

    gps_s: list[float] = field(default_factory=list)
    count: list[int] = field(default_factory=list)
    names: list[bytes] = field(default_factory=list)
    first: list[int] = field(default_factory=list)
    no_epoch: list[int] = field(default_factory=list)
    no_names: list[int] = field(default_factory=list)
    rows: int = 0
    end: int = 0


def read_epochs2(
    data: memoryview, first_line: int, types: Sequence[str], wanted: Wanted, reading: Reading
) -> Iterator[Observations]:
    """Read the lines below a header: of each satellite the first of its codes that is there.

    Parameters
    ----------
    types : sequence of str
        Types of observations, of which a line has five.
    wanted : Wanted
        Those types and the codes to be read.
    """
    lines_of_one = max(1, -(-min(len(types), _MOST_TYPES) // _VALUES_OF_LINE))
    rest, line = b"", first_line
    pieces = [piece for piece, _ in blocks(data, first_line)]
    for i, piece in enumerate(pieces):
        block = rest + piece
        lines = block.removesuffix(b"\n").split(b"\n")
        epochs = _epochs(lines, lines_of_one, last=i + 1 == len(pieces))
        reading.rows += epochs.rows
        reading.refuse(
            line + np.array(epochs.no_epoch, dtype=np.int64),
            "epoch: no date, time and number of satellites",
        )
        reading.refuse(
            line + np.array(epochs.no_names, dtype=np.int64),
            "epoch: fewer satellites than their number",
        )
        if epochs.count:
            yield from _observations(block, line, epochs, lines_of_one, wanted, reading)
        rest = b"\n".join([*lines[epochs.end :], b""]) if epochs.end < len(lines) else b""
        line += epochs.end


def _epochs(lines: Sequence[bytes], lines_of_one: int, *, last: bool) -> _Epochs:
    """Find the epochs of a block; one that goes on in the next block is left to it."""
    found = _Epochs()
    at, size = 0, len(lines)
    while at < size:
        line = lines[at]
        found.end = at
        if not line.strip():
            at += 1
            continue
        gps_s, number = _gps_s(line[:26]), line[29:32].strip()
        count = int(number) if number.isdigit() else 0
        measured = line[28:29] in _MEASURED
        begin = at + 1 + (count - 1) // _NAMES_OF_LINE
        slips = line[28:29] == _SLIPS
        end = begin + lines_of_one * count if measured or slips else at + 1 + count
        if count and end > size and not last:
            return found
        found.rows += 1
        # Events need neither a time nor lines of their own.
        timeless = np.isnan(gps_s) and (measured or bool(line[:26].strip()))
        event = line[28:29] in _EVENTS and number in (b"", b"0")
        if timeless or not (count or event):
            found.no_epoch.append(at)
            at += 1
            continue
        if measured:
            names = b"".join(one[32:68].ljust(36) for one in lines[at:begin])[: 3 * count]
            if len(names.rstrip()) < 3 * count:
                found.no_names.append(at)
                at += 1
                continue
            found.gps_s.append(gps_s)
            found.count.append(count)
            found.names.append(names)
            found.first.append(begin)
        at = end
    found.end = size
    return found


def _gps_s(text: bytes) -> float:
    """Return seconds since 6 January 1980, NaN for another text than a date and a time."""
    if (found := _DATE.fullmatch(text.strip())) is None:
        return np.nan
    year, month, day, hour, minute = map(int, found.groups()[:5])
    if year < 100:
        year += 2000 if year < 80 else 1900
    try:
        moment = datetime(year, month, day, hour, minute, tzinfo=UTC)
    except ValueError:
        return np.nan
    second = float(found[6])
    return moment.timestamp() - GPS_EPOCH_S + second if second < 61 else np.nan


def _observations(
    block: bytes,
    line: int,
    epochs: _Epochs,
    lines_of_one: int,
    wanted: Wanted,
    reading: Reading,
) -> list[Observations]:
    count = np.array(epochs.count)
    nth = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    first = np.repeat(epochs.first, count) + lines_of_one * nth
    texts = line_texts(np.frombuffer(block, dtype=np.uint8))
    # A file may end within an epoch.
    there = first < len(texts)
    first = first[there]
    reading.rows += len(first)
    words, index = np.unique(
        np.frombuffer(b"".join(epochs.names), dtype="S3")[there], return_inverse=True
    )
    # A satellite without a letter is one of GPS.
    known = [word.decode("utf-8", "replace") for word in words.tolist()]
    names = pa.array([f"G{name[1:]}" if name[:1] == " " else name for name in known], pa.string())
    time_s = np.repeat(epochs.gps_s, count)[there]
    records = Records(texts, first, 0, _VALUES_OF_LINE)
    return observed(records, names.take(pa.array(index)), time_s, line + first, wanted, reading)
