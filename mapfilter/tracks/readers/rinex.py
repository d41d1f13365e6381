"""RINEX 2 and 3: observations of code ranges.

Lines have fixed columns, and are read each for itself, so that a damaged one loses only itself.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta

import numpy as np

from mapfilter.gnss.broadcast import GPS_EPOCH_UTC_S
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recording import Clock, Reading
from mapfilter.tracks.readers.rinex_epochs import Observations, read_epochs
from mapfilter.tracks.readers.text import Text
from mapfilter.tracks.readers.times import utc_from_gps_s

_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eEdD][-+]?\d+)?")
_NAME = re.compile(r"[GRECJIS]\d\d")
_SYSTEMS = {"GPS": 0.0, "GAL": 0.0, "QZS": 0.0, "IRN": 0.0, "BDT": 14.0}
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
    return (moment + timedelta(seconds=second)).timestamp() - GPS_EPOCH_UTC_S


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
    end = text.data.find(b"\n", at) if at >= 0 else -1
    lines = Lines(text.data[: end + 1] if end >= 0 else text.data)
    header = read_header(lines, reading)
    version = fixed_number(header.get("RINEX VERSION / TYPE", [""])[0][:9])
    system = header.get("TIME OF FIRST OBS", [""])[0][48:51].strip() or "GPS"
    reading.clock = Clock("utc" if system in ("GLO", "UTC") else "gps")
    if version >= 3:
        body = memoryview(text.data)[end + 1 :] if end >= 0 else memoryview(b"")
        found = read_epochs(body, lines.at + 1, _types3(header), _CODES, reading)
    else:
        lines = Lines(text.data)
        read_header(lines, reading)
        found = _epochs2(lines, header, reading)
    for some in found:
        elapsed = some.gps_s - _SYSTEMS.get(system, 0.0)
        utc = elapsed + GPS_EPOCH_UTC_S if reading.clock.kind == "utc" else utc_from_gps_s(elapsed)
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


_Places = dict[str, list[tuple[str, int, int]]]
"""Of each constellation its codes that are there, with their columns and those of their levels."""


def _places(types: Sequence[str]) -> _Places:
    places: _Places = {}
    for letter, codes in _CODES.items():
        for code in (code for code in codes if code in types):
            level = next((t for t in types if t[0] == "S" and t[1:] == code[1:]), None)
            at = -1 if level is None else 16 * types.index(level)
            places.setdefault(letter, []).append((code, 16 * types.index(code), at))
    return places


def _observe(
    name: str,
    values: str,
    places: _Places,
    second: float,
    number: int,
    reading: Reading,
    rows: list[tuple[float, str, str, float, float, int]],
) -> None:
    """Add the first code range that a line of observations has."""
    name = name.replace(" ", "0")
    if not _NAME.fullmatch(name):
        reading.refuse(number, "no satellite such as G07")
        return
    for code, at, level in places.get(name[0], ()):
        range_m = fixed_number(values[at : at + 14])
        if math.isfinite(range_m) and range_m != 0:
            cn0 = fixed_number(values[level : level + 14]) if level >= 0 else math.nan
            rows.append((second, name, code, range_m, cn0, number))
            return
    reading.refuse(number, "no code range on L1 (E1, B1)")


def _epochs2(
    lines: Lines,
    header: dict[str, list[str]],
    reading: Reading,
) -> list[Observations]:
    rows: list[tuple[float, str, str, float, float, int]] = []
    words = " ".join(line[6:] for line in header.get("# / TYPES OF OBSERV", [])).split()
    per = max(1, -(-len(words) // 5))
    places = _places(words)
    for line in lines:
        if not line.strip():
            continue
        reading.rows += 1
        second = gps_seconds(line[:26].split())
        count = fixed_number(line[29:32])
        flag = line[28:29]
        if not (np.isfinite(second) and 0 < count <= 999):
            reading.refuse(lines.at, "epoch: no date, time and number of satellites")
            continue
        if flag not in ("0", "1", " "):
            for _ in range(int(count)):
                lines.take()
            continue
        names = line[32:68]
        while len(names.rstrip()) < 3 * count and len(names) >= 36 and lines.at < len(lines.lines):
            names = names.ljust(36 * (len(names) // 36)) + lines.take()[32:68]
        for i in range(int(count)):
            name = names[3 * i : 3 * i + 3]
            number = lines.at + 1
            values = "".join(lines.take()[:80].ljust(80) for _ in range(per))
            if lines.at > len(lines.lines):
                break
            reading.rows += 1
            name = f"G{name[1:]}" if name[:1] == " " else name
            _observe(name, values, places, second, number, reading, rows)
    if not rows:
        return []
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return [Observations(*columns)]


FORMAT = Format(
    "rinex-obs",
    "a RINEX observation file",
    "GNSS receivers, converters, GnssLogger (RINEX 2 and 3)",
    "code ranges on L1 (E1, B1), carrier-to-noise density",
    _is_observation,
    _read_observation,
)
