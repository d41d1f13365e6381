"""Placemarks of KML and KMZ, as Google Earth has sites, as the rows of a table."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.parsers.expat import ExpatError, ParserCreate

from mapfilter._words import number_of
from mapfilter._zip import ZIP_DAMAGE
from mapfilter.errors import InputError, fail

_LONGITUDES, _LATITUDES = {"lon", "lon_deg", "longitude"}, {"lat", "lat_deg", "latitude"}
PLACEMARKS = "placemarks with a point and data"
"""What is expected of KML that is a table."""
_MOST_ELEMENTS = 2_000_000
_HEAD = 1 << 12


def is_kml(text: str) -> bool:
    """Return whether a text is KML."""
    return text.lstrip().startswith("<") and "<kml" in text[:_HEAD]


def kml_in(path: Path, data: bytes, most_bytes: int) -> bytes | None:
    """Return the first KML in a KMZ, which is its document; None for another file.

    Raises
    ------
    InputError
        The document is damaged, encrypted or larger than ``most_bytes``, unpacked.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            named = (one for one in archive.infolist() if one.filename.lower().endswith(".kml"))
            if (member := next(named, None)) is None:
                return None
            if member.file_size > most_bytes:
                expected = f"KML of at most {most_bytes} bytes, unpacked"
                got, hint = f"{member.file_size} in {member.filename[:80]!r}", "split it"
                raise fail(InputError, str(path), expected, got, hint)
            return archive.read(member)
    except ZIP_DAMAGE as error:
        # Without a list of its members it may be a workbook, whose reader knows better.
        if path.suffix.lower() != ".kmz":
            return None
        hint = "cut off, or protected by a password"
        raise fail(InputError, str(path), "a KMZ that can be read", str(error), hint) from error


def read_placemarks(path: Path, text: str) -> tuple[list[dict[str, str]], tuple[str, ...]]:
    """Return the data of the placemarks with a point and data, by name, and notes.

    Names are those of the data (``ExtendedData``), and of the placemark's name and place where its
    data has none: ``cell``, ``lon`` and ``lat``, in degrees of WGS 84. Sectors that are drawn as
    areas, and pins without data, are left out with a note.

    Raises
    ------
    InputError
        It is damaged, has entities, which could blow it up, or no such placemark.
    """
    records: list[dict[str, str]] = []
    without = 0
    try:
        for mark in _placemarks(path, text):
            data, place = _data(mark), _place(mark)
            if data and place is not None:
                named = {one.lower() for one, value in data.items() if value}
                lon, lat = place
                in_metres = named >= {"east", "north"}
                name = (mark.findtext("{*}name") or "").strip()
                own = {} if "cell" in named or not name else {"cell": name}
                own |= {} if in_metres or named & _LONGITUDES else {"lon": lon}
                own |= {} if in_metres or named & _LATITUDES else {"lat": lat}
                filled = {one: value for one, value in data.items() if value or one not in own}
                records.append(own | filled)
            else:
                without += 1
    except (ElementTree.ParseError, ExpatError) as error:
        raise fail(InputError, str(path), "whole KML", str(error), "cut off, or damaged") from error
    if not records:
        got = f"{number_of(without, 'placemark')} without" if without else "none"
        hint = (
            "write height, azimuth, EIRP and frequency of each cell as its ExtendedData (QGIS does "
            "for the columns of a layer), or export the list as CSV or as a workbook"
        )
        raise fail(InputError, str(path), PLACEMARKS, got, hint)
    notes: tuple[str, ...] = (
        f"{path.name}: KML read as a table of {number_of(len(records), 'placemark')}",
    )
    if without:
        some = number_of(without, "placemark")
        notes += (f"{path.name}: {some} without a point or without data left out",)
    return records, notes


def _placemarks(path: Path, text: str) -> Iterator[Element]:
    # The text is decoded already, whatever it says of its encoding.
    begin, end, rest = text.lstrip().partition("?>")
    whole = (rest if end and begin.startswith("<?xml") else text).encode()
    _check_entities(path, whole)
    for number, (_, element) in enumerate(ElementTree.iterparse(io.BytesIO(whole))):
        if number > _MOST_ELEMENTS:
            raise fail(InputError, str(path), "KML of at most 2e6 elements", "more")
        if element.tag.rpartition("}")[2] == "Placemark":
            yield element
            # A large document need not be in memory twice.
            element.clear()


def _check_entities(path: Path, data: bytes) -> None:
    """Refuse a DOCTYPE of the document; that of a page in a description is mere text."""

    def refuse(*_: object) -> None:
        hint = "delete its <!DOCTYPE …>, which no list needs"
        raise fail(InputError, str(path), "KML without entities", "a DOCTYPE", hint)

    parser = ParserCreate("utf-8")
    parser.StartDoctypeDeclHandler = refuse
    parser.Parse(data, True)


def _data(mark: Element) -> dict[str, str]:
    found = {one.get("name", ""): one.findtext("{*}value") for one in mark.findall(".//{*}Data")}
    found |= {one.get("name", ""): one.text for one in mark.findall(".//{*}SimpleData")}
    return {name.strip(): (value or "").strip() for name, value in found.items() if name.strip()}


def _place(mark: Element) -> tuple[str, str] | None:
    point = mark.find(".//{*}Point")
    parts = (point.findtext("{*}coordinates") or "").strip().split(",") if point is not None else []
    return (parts[0].strip(), parts[1].strip()) if len(parts) > 1 else None
