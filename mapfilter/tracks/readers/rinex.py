"""RINEX 2 and 3: observations of code ranges.

Lines have fixed columns, and are read each for itself, so that a damaged one loses only itself.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime, timedelta

import numpy as np

from mapfilter._constants import GPS_EPOCH_S
from mapfilter.clocks.times import utc_from_gps_s
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.rinex2_epochs import read_epochs2
from mapfilter.tracks.readers.rinex_epochs import Observations, Wanted, read_epochs
from mapfilter.tracks.readers.texts.text import Text

_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eEdD][-+]?\d+)?")
_BEIDOU_BEHIND_S = 14.0
_OWN_TIMES = {"R": "GLO", "C": "BDT"}
"""Time systems of files of one constellation that name none."""
_CODES = {
    **dict.fromkeys("GJS", ("C1C", "C1P", "C1W", "C1X", "C1")),
    "R": ("C1C", "C1P", "C1"),
    "E": ("C1C", "C1X", "C1B", "C1A", "C1"),
    "C": ("C2I", "C1I", "C1P", "C1X", "C2X"),
    "I": ("C5A", "C5C"),
}


def rinex_kind(text: Text) -> str:
    """Return the letter of a RINEX file's kind, "" for another file."""
    for line in text.head[:5]:
        if "RINEX VERSION / TYPE" in line[55:90]:
            return line[20:21].upper()
    return ""


def _is_observation(text: Text) -> bool:
    return rinex_kind(text) == "O"


def fixed_number(text: str) -> float:
    """Return a number, perhaps with Fortran's exponent; NaN for another text."""
    text = text.strip()
    return float(text.replace("D", "E").replace("d", "e")) if _NUMBER.fullmatch(text) else np.nan


def gps_seconds(words: Sequence[str]) -> float:
    """Return seconds since 6 January 1980 of year, month, day, hour, minute and second."""
    values = [fixed_number(word) for word in words]
    if len(values) != 6 or not all(0 <= value < 10_000 for value in values):
        return float("nan")
    year, month, day, hour, minute, second = values
    if year < 100:
        year += 2000 if year < 80 else 1900
    try:
        moment = datetime(int(year), int(month), int(day), int(hour), int(minute), tzinfo=UTC)
    except ValueError:
        return float("nan")
    if not 0 <= second < 61:
        return float("nan")
    return (moment + timedelta(seconds=second)).timestamp() - GPS_EPOCH_S


class Lines:
    """Lines of a file with their numbers, one step at a time."""

    def __init__(self, data: bytes) -> None:
        self.lines = data.decode("utf-8", "replace").split("\n")
        self.at = 0

    def __iter__(self) -> Iterator[str]:
        while self.at < len(self.lines):
            self.at += 1
            yield self.lines[self.at - 1]

    def take(self) -> str:
        """Return the next line, "" at the end."""
        self.at += 1
        return self.lines[self.at - 1] if self.at <= len(self.lines) else ""


def read_header(lines: Lines, reading: Reading) -> dict[str, list[str]]:
    """Return the header's lines by their labels."""
    header: dict[str, list[str]] = {}
    for line in lines:
        label = line[60:].strip()
        if label == "END OF HEADER":
            break
        header.setdefault(label, []).append(line[:60])
    program = header.get("PGM / RUN BY / DATE", [""])[0][:20].strip()
    reading.program = f"RINEX by {program}" if program else "RINEX"
    return header


def _read_observation(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    at = text.data.find(b"END OF HEADER")
    end = text.data.find(b"\n", at) + 1 if at >= 0 else 0
    lines = Lines(text.data[:end] if end else text.data)
    header = read_header(lines, reading)
    kind = header.get("RINEX VERSION / TYPE", [""])[0]
    version = fixed_number(kind[:9])
    stated = header.get("TIME OF FIRST OBS", [""])[0][48:51].strip()
    system = stated or _OWN_TIMES.get(kind[40:41].upper(), "GPS")
    reading.clock = Clock("utc" if system in ("GLO", "UTC") else "gps")
    body, first_line = memoryview(text.data)[end or len(text.data) :], lines.at + 1
    found: Iterable[Observations]
    if version >= 3:
        found = read_epochs(body, first_line, Wanted(_types3(header), _CODES), reading)
    else:
        types = " ".join(line[6:] for line in header.get("# / TYPES OF OBSERV", [])).split()
        wanted = Wanted(dict.fromkeys(_CODES, types), _CODES)
        found = read_epochs2(body, first_line, types, wanted, reading)
    for some in found:
        elapsed = some.gps_s + (_BEIDOU_BEHIND_S if system == "BDT" else 0.0)
        utc = elapsed + GPS_EPOCH_S if reading.clock.kind == "utc" else utc_from_gps_s(elapsed)
        columns = {
            "time_s": utc,
            "satellite": some.satellite,
            "signal": some.signal,
            "pseudorange_m": some.pseudorange_m,
            "cn0_dbhz": some.cn0_dbhz,
        }
        reading.add("satellites", columns, some.line)


def _types3(header: dict[str, list[str]]) -> dict[str, list[str]]:
    types: dict[str, list[str]] = {}
    letter = ""
    for line in header.get("SYS / # / OBS TYPES", []):
        letter = line[:1].strip() or letter
        types.setdefault(letter, []).extend(line[6:60].split())
    return types


FORMAT = Format(
    "rinex-obs",
    "a RINEX observation file",
    "GNSS receivers, converters, GnssLogger (RINEX 2 and 3)",
    "code ranges on L1 (E1, B1), carrier-to-noise density",
    _is_observation,
    _read_observation,
)
