"""GPX 1.0 and 1.1: track points, or waypoints with times where there is no track."""

from __future__ import annotations

import re
from typing import Any
from xml.parsers import expat

import numpy as np

from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recording import Clock, Reading
from mapfilter.tracks.readers.text import Text
from mapfilter.tracks.readers.times import parse_times

_POINTS = ("trkpt", "wpt", "rtept")
_VALUES = ("time", "ele", "speed", "course", "hdop")
_UERE_M = 4.0
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


class _Points:
    """Collects points while a file is parsed; a file cut off keeps those before its end."""

    def __init__(self) -> None:
        self.rows: dict[str, list[dict[str, Any]]] = {kind: [] for kind in _POINTS}
        self.creator = ""
        self._point: dict[str, Any] | None = None
        self._value = ""
        self._text: list[str] = []
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._characters
        # Entities could blow a file up; no GPX needs any.
        self.parser.EntityDeclHandler = self._refuse_entities

    def _refuse_entities(self, *_: object) -> None:
        raise expat.ExpatError("entities are not read")

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        tag = name.rpartition(":")[2]
        if tag == "gpx":
            self.creator = attributes.get("creator", "")
        if tag in _POINTS:
            self._point = {"line": self.parser.CurrentLineNumber, "kind": tag, **attributes}
        elif self._point is not None and tag in _VALUES:
            self._value, self._text = tag, []

    def _characters(self, text: str) -> None:
        if self._value:
            self._text.append(text)

    def _end(self, name: str) -> None:
        tag = name.rpartition(":")[2]
        if self._point is None:
            return
        if tag == self._value:
            self._point.setdefault(tag, "".join(self._text).strip())
            self._value = ""
        elif tag == self._point["kind"]:
            self.rows[tag].append(self._point)
            self._point = None


def _matches(text: Text) -> bool:
    return any("<gpx" in line for line in text.head[:20])


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:
    points = _Points()
    start = text.data.find(b"<")
    # The text is UTF-8 by now, whatever its declaration says.
    data = re.sub(rb'^(<\?xml[^>]*?)\s+encoding=["\'][^"\']*["\']', rb"\1", text.data[start:])
    lines_before = text.data[: max(start, 0)].count(b"\n")
    try:
        points.parser.Parse(data, True)
    except expat.ExpatError as error:
        reading.note(f"XML is damaged or cut off ({error}); points before that were read")
    reading.program = points.creator or "GPX"
    kind = next((kind for kind in _POINTS if points.rows[kind]), "trkpt")
    rows = points.rows[kind]
    for other in _POINTS:
        if other != kind and points.rows[other]:
            reading.note(f"{len(points.rows[other])} {other} not used")
    reading.rows += len(rows)
    time_s, zoned = parse_times(
        np.array([row.get("time", "") for row in rows], dtype=object), options.zone
    )
    reading.clock = Clock("utc") if zoned else Clock("local", options.zone)
    numbers = {
        name: np.array([_number(row.get(name, "")) for row in rows])
        for name in ("lat", "lon", "ele", "speed", "course", "hdop")
    }
    columns = {
        "time_s": time_s,
        "lat_deg": numbers["lat"],
        "lon_deg": numbers["lon"],
        "altitude_m": numbers["ele"],
        "speed_mps": numbers["speed"],
        "course_deg": numbers["course"],
        "accuracy_m": _UERE_M * numbers["hdop"],
    }
    lines = np.array([row["line"] for row in rows], dtype=np.int64) + lines_before
    if len(rows):
        reading.add("positions", columns, lines)


def _number(text: str) -> float:
    text = text.strip()
    return float(text) if _NUMBER.fullmatch(text) else float("nan")


FORMAT = Format(
    "gpx",
    "a GPX file",
    "watches, phones and GNSS receivers (GPX 1.0, 1.1)",
    "track points with times (else waypoints, route points): positions, speed, course",
    _matches,
    _read,
)
