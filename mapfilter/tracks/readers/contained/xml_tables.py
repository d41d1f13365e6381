"""Points with times in KML (gx:Track, placemarks), in TCX, and in GPX that has cells."""

from __future__ import annotations

import html
import re
from collections.abc import Callable, Iterator
from dataclasses import replace

from mapfilter._words import number_of
from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.contained.tables import KeyPath, table_of_records
from mapfilter.tracks.readers.texts.text import Text

_PREFIX = re.compile(r"<(/?)[A-Za-z][A-Za-z0-9]{0,9}:")
_WHEN, _COORD = re.compile(r"<when>([^<]*)</when>"), re.compile(r"<coord>([^<]*)</coord>")
_EMPTY = re.compile(r"<(when|coord)\s{0,9}/>")
"""Where a track has a time without a place, or a place without a time."""
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
_OF_CELLS = re.compile(
    rb"<(?:\w{1,20}:)?(?:rsrp|rscp|level_dbm|mcc|cell_?id|cid|eci)>", re.IGNORECASE
)
"""Elements that a GPX has only of cells, in the extensions of its points."""
_LEAF = re.compile(r"<([\w.-]{1,40})>([^<>]{1,200})</")
_ATTRIBUTE = re.compile(r"\b(lat|lon)\s?=\s?[\"']([^\"'<>]{1,40})[\"']")
_HEAD_BYTES = 1 << 18
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
    records: list[dict[KeyPath, str]] = []
    uneven = 0
    for track in _elements(content, "Track"):
        track = _EMPTY.sub(r"<\1></\1>", track)
        times, places = _WHEN.findall(track), _COORD.findall(track)
        uneven += len(times) != len(places)
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
    if uneven:
        tracks = number_of(uneven, "track has", "tracks have")
        note = f"{tracks} not as many times as places; taken in their order, one by one"
        text = replace(text, notes=(*text.notes, note))
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
    records: list[dict[KeyPath, str]] = []
    for point in _elements(content, "Trackpoint"):
        found: dict[KeyPath, str] = {
            (name,): inner for tag, name in _TCX.items() for inner in _elements(point, tag)
        }
        if ("latitude",) in found and ("longitude",) in found:
            records.append(found)
    if not records:
        hint = "recorded indoors, or an activity without a track"
        raise fail(InputError, str(text.path), "track points with places", "TCX without any", hint)
    return table_of_records(text, records, "TCX")


def has_cells(text: Text) -> bool:
    """Return whether points of a GPX have cells in their extensions."""
    return any("<gpx" in line for line in text.head[:20]) and bool(
        _OF_CELLS.search(text.data[:_HEAD_BYTES])
    )


def gpx_table(text: Text) -> Text | None:
    """Return the points of a GPX with all that their extensions hold as a text of CSV.

    None where no point has a place and a time.
    """
    content = _content(text, "GPX")
    records: list[dict[KeyPath, str]] = []
    for tag in ("trkpt", "wpt"):
        for piece in content.split(f"<{tag} ")[1:]:
            attributes, _, rest = piece.partition(">")
            inner, closed, _ = rest.partition(f"</{tag}>")
            found: dict[KeyPath, str] = {(name,): value for name, value in _LEAF.findall(inner)}
            place = dict(_ATTRIBUTE.findall(attributes))
            if closed and place.keys() >= {"lat", "lon"} and ("time",) in found:
                records.append({("lat",): place["lat"], ("lon",): place["lon"], **found})
        if records:
            break
    return table_of_records(text, records, "GPX with cells") if records else None


def _content(text: Text, what: str) -> str:
    """Return a text of XML without comments, and without prefixes of its elements' names."""
    if b"<!ENTITY" in text.data:
        hint = "delete its <!DOCTYPE …>, which no recording needs"
        raise fail(InputError, str(text.path), f"{what} without entities", "<!ENTITY", hint)
    content = text.data.decode("utf-8", "replace")
    content = _without(content, "<![CDATA[", "]]>", html.escape)
    return _PREFIX.sub(r"<\1", _without(content, "<!--", "-->", lambda _: ""))


def _without(content: str, begin: str, end: str, instead: Callable[[str], str]) -> str:
    """Return a text with other words for what stands between marks."""
    first, *pieces = content.split(begin)
    found = [first]
    for piece in pieces:
        inner, closed, rest = piece.partition(end)
        found += [instead(inner), rest] if closed else []
    return "".join(found)


def _elements(content: str, name: str) -> Iterator[str]:
    """Yield the contents of elements of a name that have an end."""
    for piece in content.split(f"<{name}")[1:]:
        attributes, opened, rest = piece.partition(">")
        inner, closed, _ = rest.partition(f"</{name}>")
        if opened and closed and attributes[:1] in ("", " ", "\n", "\t"):
            yield inner


def _placed(parts: list[str]) -> dict[KeyPath, str]:
    return dict(zip(_PLACE, parts, strict=False))
