"""Raw frames of a vehicle's CAN bus: the speeds that OBD-II replies with, and nothing else.

Candump of can-utils (log and console) and Vector's ASC. Other frames mean what a maker chose.
"""

from __future__ import annotations

import re
from collections import Counter

import numpy as np

from mapfilter._constants import KMH_MPS
from mapfilter._words import number_of
from mapfilter.clocks.times import LEAST_UNIX_S
from mapfilter.errors import InputError, MapfilterError, fail
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.text import Text
from mapfilter.tracks.readers.unknown_formats import RAW_FRAMES

_NO_SPEED_KMH = 255
_SPEED_SD_MPS = KMH_MPS / 12**0.5
"""Speeds are whole km/h."""
_HEAD_LINES = 50
_MOST_BACK_SHARE = 0.1
_STAMP = r"^[ \t]*\((\d{1,12}\.\d{1,9})\)[ \t]+\S{1,16}[ \t]+(?:[RT]X[ \t]+\S[ \t]+\S[ \t]+)?"
_REPLY = r"(7E[89A-F]|18DAF1[0-9A-F]{2})"
"""Identifiers by which control units reply (ISO 15765-4), of 11 and of 29 bits."""
_SPEED = r"0[3-7]{0}41{0}0D{0}([0-9A-F]{{2}})"
"""A single frame of ISO-TP with a reply of service 01 that begins with PID 0D."""
_LENGTH = r"[ \t]+\[\d{1,2}\][ \t]+"
_ASC = r"^[ \t]*(\d{1,12}\.\d{1,9})[ \t]+\d{1,3}[ \t]+"
_ASC_DATA = r"x?[ \t]+[RT]x[ \t]+d[ \t]+\d{1,2}[ \t]+"
_ASC_DECIMAL = r"(202[4-9]|203[01])" + _ASC_DATA + r"0*[3-7][ ]+0*65[ ]+0*13[ ]+(\d{1,3})\b"
_BASE = re.compile(r"base[ \t]+(hex|dec)[ \t]+timestamps[ \t]+(absolute|relative)\b", re.IGNORECASE)
_CANDUMP = re.compile(_STAMP + r"[0-9A-F]{3,8}(?:#|" + _LENGTH + ")", re.ASCII | re.IGNORECASE)


def _compiled(pattern: str) -> re.Pattern[bytes]:
    return re.compile(pattern.encode(), re.MULTILINE | re.IGNORECASE)


_CANDUMP_SPEEDS = (
    _compiled(_STAMP + _REPLY + "#" + _SPEED.format("")),
    _compiled(_STAMP + _REPLY + _LENGTH + _SPEED.format("[ ]")),
)
_ASC_SPEEDS = {
    16: _compiled(_ASC + _REPLY + _ASC_DATA + _SPEED.format("[ ]+")),
    10: _compiled(_ASC + _ASC_DECIMAL),
}


def _base(text: Text) -> re.Match[str] | None:
    """Return the line of an ASC file on its numbers; None in another file."""
    heads = (_BASE.match(line.strip()) for line in text.head[:_HEAD_LINES])
    return next((found for found in heads if found), None)


def _matches(text: Text) -> bool:
    return bool(_CANDUMP.match(text.first_line) or _base(text))


def _relative(reading: Reading, got: str) -> MapfilterError:
    """Return the error of times that count from the frame before."""
    hint = "times since the frame before; export with absolute timestamps (candump -ta, -l)"
    return fail(InputError, str(reading.path), "absolute timestamps", got, hint)


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    asc, base = _base(text), 16
    patterns: tuple[re.Pattern[bytes], ...] = _CANDUMP_SPEEDS
    reading.program = "candump" if asc is None else "Vector ASC"
    if asc is not None:
        base = 10 if asc[1].lower() == "dec" else 16
        patterns = (_ASC_SPEEDS[base],)
        if asc[2].lower() == "relative":
            raise _relative(reading, "timestamps relative")
    reading.rows = sum(1 for line in text.data.split(b"\n") if line.strip())
    found = [match for pattern in patterns for match in pattern.finditer(text.data)]
    if not found:
        expected = "replies of OBD-II with a speed (service 01, PID 0D) among the frames"
        got = f"none in {number_of(reading.rows, 'line')}"
        raise fail(InputError, str(reading.path), expected, got, RAW_FRAMES)
    units = Counter(match[2].upper() for match in found)
    unit = min(units, key=lambda one: (-units[one], one))
    own = [match for match in found if match[2].upper() == unit]
    starts = np.array([match.start() for match in own], dtype=np.int64)
    feeds = np.flatnonzero(np.frombuffer(text.data, dtype=np.uint8) == ord("\n"))
    line = text.line + np.searchsorted(feeds, starts)
    time_s = np.array([float(match[1]) for match in own])
    if (back := int(np.sum(np.diff(time_s) < 0))) > _MOST_BACK_SHARE * len(own):
        raise _relative(reading, f"times that go backwards in {number_of(back, 'place')}")
    speed_kmh = np.array([float(int(match[3], base)) for match in own])
    reading.clock = Clock("utc" if np.median(time_s) > LEAST_UNIX_S else "monotonic")
    unknown = speed_kmh >= _NO_SPEED_KMH
    reading.refuse(line[unknown], f"speed of {_NO_SPEED_KMH} km/h: the mark of no value")
    columns = {
        "time_s": time_s[~unknown],
        "speed_mps": KMH_MPS * speed_kmh[~unknown],
        "speed_sd_mps": np.full(int((~unknown).sum()), _SPEED_SD_MPS),
    }
    reading.add("odometry", columns, line[~unknown])
    reading.note(
        f"speeds are replies of OBD-II (service 01, PID 0D) by {unit.decode()}, whole km/h"
    )
    if others := len(found) - len(own):
        reading.ignore(f"{number_of(others, 'speed')} by other control units not used")
    if rest := reading.rows - len(found):
        reading.ignore(f"{number_of(rest, 'line')} of other frames not used: {RAW_FRAMES}")


FORMAT = Format(
    "can",
    "raw frames of a CAN bus",
    "candump (can-utils), Vector ASC",
    "speeds of OBD-II (service 01, PID 0D); other frames are not decoded",
    _matches,
    _read,
)
