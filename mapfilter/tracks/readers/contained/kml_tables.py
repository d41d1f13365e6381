"""Points with times in KML (gx:Track, placemarks with a time stamp), and in TCX of Garmin."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator
from dataclasses import replace

from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.contained.tables import Path_, table_of_records
from mapfilter.tracks.readers.texts.text import Text

_PREFIX = re.compile(r"<(/?)[A-Za-z][A-Za-z0-9]{0,9}:")
_WHEN, _COORD = re.compile(r"<when>([^<]*)</when>"), re.compile(r"<coord>([^<]*)</coord>")
_DATA = re.compile(r"<Data\s+name=\"([^\"<>]{1,80})\"[^>]{0,200}>\s*<value>([^<]*)</value>")
_SIMPLE = re.compile(r"<SimpleData\s+name=\"([^\"<>]{1,80})\"[^>]{0,200}>([^<]*)</SimpleData>")
_PLACE = (("longitude",), ("latitude",), ("altitude_m",))
_TCX = {
    "Time": "time",
    "LatitudeDegrees": "latitude",
    "LongitudeDegrees": "longitude",
    "AltitudeMeters": "altitude_m",
    "Speed": "speed_mps",
}
_LINE = "a line without times, as of a map; export GPX, or points with their times"


def is_kml(text: Text) -> bool:
    """Return whether a text is KML."""
    return any("<kml" in line for line in text.head[:20])


def kml_table(text: Text) -> Text:
    """Return the points of a KML with their times and data as a text of CSV.

    Raises
    ------
    InputError
        It has no points with times, or entities, which could blow it up.
    """
    content = _content(text, "KML")
    records: list[dict[Path_, str]] = []
    for track in _elements(content, "Track"):
        times, places = _WHEN.findall(track), _COORD.findall(track)
        for when, place in zip(times, places, strict=False):
            records.append({("time",): when.strip(), **_placed(place.split())})
    if not records:
        for mark in _elements(content, "Placemark"):
            when = _WHEN.search(mark)
            points = [p for one in _elements(mark, "Point") for p in _elements(one, "coordinates")]
            data = [*_DATA.findall(mark), *_SIMPLE.findall(mark)]
            if points and (when is not None or data):
                told = {("time",): when[1].strip()} if when else {}
                told |= {(html.unescape(name),): html.unescape(value) for name, value in data}
                records.append(told | _placed(points[0].strip().split(",")))
    if not records:
        hint = _LINE if "<LineString" in content else "export GPX, or a table as CSV"
        raise fail(InputError, str(text.path), "points with times", "KML without any", hint)
    if not content.rstrip().endswith("</kml>"):
        note = "the file is cut off or damaged; whole points were read"
        text = replace(text, notes=(*text.notes, note))
    return table_of_records(text, records, "KML")


def is_tcx(text: Text) -> bool:
    """Return whether a text is TCX."""
    return any("<TrainingCenterDatabase" in line for line in text.head[:20])


def tcx_table(text: Text) -> Text:
    """Return the track points of a TCX that have a place as a text of CSV.

    Raises
    ------
    InputError
        It has none, or entities.
    """
    content = _content(text, "TCX")
    records: list[dict[Path_, str]] = []
    for point in _elements(content, "Trackpoint"):
        found: dict[Path_, str] = {
            (name,): inner for tag, name in _TCX.items() for inner in _elements(point, tag)
        }
        if ("latitude",) in found and ("longitude",) in found:
            records.append(found)
    if not records:
        hint = "recorded indoors, or an activity without a track"
        raise fail(InputError, str(text.path), "track points with places", "TCX without any", hint)
    return table_of_records(text, records, "TCX")


def _content(text: Text, what: str) -> str:
    """Return a text of XML without prefixes of its elements' names."""
    if b"<!ENTITY" in text.data:
        raise fail(InputError, str(text.path), f"{what} without entities", "<!ENTITY")
    return _PREFIX.sub(r"<\1", text.data.decode("utf-8", "replace"))


def _elements(content: str, name: str) -> Iterator[str]:
    """Yield the contents of elements of a name that have an end."""
    for piece in content.split(f"<{name}")[1:]:
        attributes, opened, rest = piece.partition(">")
        inner, closed, _ = rest.partition(f"</{name}>")
        if opened and closed and attributes[:1] in ("", " ", "\n", "\t"):
            yield inner


def _placed(parts: list[str]) -> dict[Path_, str]:
    return dict(zip(_PLACE, parts, strict=False))
