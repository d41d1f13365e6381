"""GPX 1.0 and 1.1: track points, or waypoints with times where there is no track.

Points are read one by one as texts, so that damage loses the points that it hits and no others.
"""

from __future__ import annotations

import html
import re
from collections.abc import Iterator

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from mapfilter._types import Floats, Ints
from mapfilter.errors import InputError, fail
from mapfilter.tracks.joining.position_units import UERE_M
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.text import Text

_POINTS = ("trkpt", "wpt", "rtept")
_PART_BYTES = 1 << 22
_AFTER_NAME = np.frombuffer(b" \t\n\r>/", dtype=np.uint8)
# As most programs write a point: first its place, then height and time.
_USUAL = (
    r'^\s+lat="(?P<lat>[^"<]*)"\s+lon="(?P<lon>[^"<]*)"\s*>'
    r"\s*(?:<ele>(?P<ele>[^<]*)</ele>\s*)?(?:<time>(?P<time>[^<]*)</time>)?"
)
_ATTRIBUTE = r"^[^>]*?\sNAME\s*=\s*[\"'](?P<value>[^\"'<>]*)[\"']"
_ELEMENT = r"<(?:[\w.-]+:)?NAME(?:\s[^>]*)?>(?P<value>[^<]*)<"
_COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)
_PREFIX = re.compile(rb"<(/?)[\w.-]+:")
_CREATOR = re.compile(r"<gpx\b[^>]*?\bcreator\s*=\s*[\"']([^\"'<]*)")


def _matches(text: Text) -> bool:
    return any("<gpx" in line for line in text.head[:20])


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:
    data = text.data
    if b"<!ENTITY" in data:
        # Entities could blow a file up; no GPX needs any.
        raise fail(InputError, str(reading.path), "GPX without entities", "<!ENTITY")
    creator = _CREATOR.search("\n".join(text.head[:50]))
    reading.program = html.unescape(creator[1]).strip() if creator else ""
    reading.program = reading.program or "GPX"
    if b"<!--" in data:
        data = _COMMENT.sub(lambda found: b"\n" * found[0].count(b"\n"), data)
    if any(b":" + kind.encode() in data for kind in _POINTS):
        data = _PREFIX.sub(rb"<\1", data)
    if not data.rstrip().endswith(b"</gpx>"):
        reading.note("the file is cut off or damaged; whole points were read")
    counts = {kind: len(re.findall(rb"<%b\b" % kind.encode(), data)) for kind in _POINTS}
    kind = next((kind for kind in _POINTS if counts[kind]), "trkpt")
    for other in _POINTS:
        if other != kind and counts[other]:
            reading.note(f"{counts[other]} {other} not used")
    clocks: set[bool] = set()
    for points, lines in _points(data, kind.encode(), reading):
        rows = _columns(points, lines, reading)
        time_s, zoned = rows.times_of_part("time", zone=options.zone)
        if np.isfinite(time_s).any():
            clocks.add(zoned)
        reading.clock = Clock("local", options.zone) if False in clocks else Clock("utc")
        columns = {
            "time_s": time_s,
            "lat_deg": rows.number("lat"),
            "lon_deg": rows.number("lon"),
            "altitude_m": rows.number("ele"),
            "speed_mps": rows.number("speed"),
            "course_deg": rows.number("course", "bearing"),
            "accuracy_m": _accuracy(rows),
        }
        reading.rows += len(lines)
        reading.add("positions", columns, lines)


def _accuracy(rows: Columns) -> Floats:
    """Return the accuracy that a phone or a watch states, else one by the HDOP."""
    stated = rows.number("accuracy", "hacc")
    return np.where(np.isnan(stated), UERE_M * rows.number("hdop"), stated)


def _points(data: bytes, kind: bytes, reading: Reading) -> Iterator[tuple[pa.Array, Ints]]:
    """Yield points, from their attributes on, and the line of each; refuse those without an end."""
    opening = b"<" + kind
    start = data.find(opening)
    line = 1 + data.count(b"\n", 0, max(start, 0))
    while start >= 0:
        stop = data.find(opening, start + _PART_BYTES)
        part = data[start:stop] if stop >= 0 else data[start:]
        code = np.frombuffer(part, dtype=np.uint8)
        begins = _places(code, opening) + len(opening)
        # Of another tag only the name's beginning is the same.
        begins = begins[np.isin(code[np.minimum(begins, len(code) - 1)], _AFTER_NAME)]
        tags = _next(_places(code, b">"), begins, len(code))
        closed = code[tags - 1] == ord("/")
        ends = np.where(closed, tags, _next(_places(code, b"</" + kind), begins, len(code)))
        whole = ends <= np.append(begins[1:], len(code) - 1)
        lines = line + np.searchsorted(np.flatnonzero(code == ord("\n")), begins)
        reading.refuse(lines[~whole], f"{kind.decode()}: no end (likely: damaged or cut off)")
        begins, ends = begins[whole], ends[whole]
        if begins.size:
            edges = np.append(np.stack([begins, ends], axis=1).ravel(), len(code)).astype(np.int32)
            pieces = pa.StringArray.from_buffers(
                2 * len(begins), pa.py_buffer(edges), pa.py_buffer(code)
            )
            yield pieces.take(pa.array(2 * np.arange(len(begins)))), lines[whole]
        line += part.count(b"\n")
        start = stop


def _places(code: np.ndarray, pattern: bytes) -> Ints:
    """Return where a pattern begins."""
    places = np.flatnonzero(code[: max(0, len(code) - len(pattern) + 1)] == pattern[0])
    for at, value in enumerate(pattern[1:], start=1):
        places = places[code[places + at] == value]
    return places


def _next(places: Ints, begins: Ints, end: int) -> Ints:
    """Return the first of some places after each beginning, ``end`` where there is none."""
    return np.append(places, end)[np.searchsorted(places, begins)]


def _columns(points: pa.Array, lines: Ints, reading: Reading) -> Columns:
    usual = pc.extract_regex(points, _USUAL)
    found = {name: pc.fill_null(usual.field(name), "") for name in ("lat", "lon", "ele", "time")}
    valid = usual.is_valid()
    found = {name: pc.if_else(valid, values, "") for name, values in found.items()}
    missing = pc.or_(pc.equal(found["time"], ""), pc.equal(found["ele"], ""))
    other = pc.and_(missing, pc.match_substring_regex(points, r"ele>|time>"))
    other = pc.or_(pc.invert(valid), other)
    if pc.any(other).as_py():
        some = points.filter(other)
        for name in found:
            pattern = _ATTRIBUTE if name in ("lat", "lon") else _ELEMENT
            values = _extracted(some, pattern.replace("NAME", name))
            found[name] = pc.replace_with_mask(found[name], other, values)
    for name in ("speed", "course", "bearing", "hdop", "accuracy", "hAcc"):
        if pc.any(pc.match_substring(points, name)).as_py():
            found[name.lower()] = _extracted(points, _ELEMENT.replace("NAME", name))
    rows = Columns(reading, tuple(found), lines, decimal_comma=True)
    rows._columns.update(enumerate(pa.chunked_array([one]) for one in found.values()))
    return rows


def _extracted(points: pa.Array, pattern: str) -> pa.Array:
    found = pc.extract_regex(points, pattern)
    return pc.if_else(found.is_valid(), pc.fill_null(found.field("value"), ""), "")


FORMAT = Format(
    "gpx",
    "a GPX file",
    "watches, phones and GNSS receivers (GPX 1.0, 1.1)",
    "track points with times (else waypoints, route points): positions, speed, course",
    _matches,
    _read,
)
