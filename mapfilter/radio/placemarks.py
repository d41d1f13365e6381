"""Placemarks of KML and KMZ, as Google Earth has sites, as the rows of a table."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from mapfilter._words import number_of
from mapfilter.errors import InputError, fail

_LONGITUDES, _LATITUDES = {"lon", "lon_deg", "longitude"}, {"lat", "lat_deg", "latitude"}
_MOST_ELEMENTS = 2_000_000
_HEAD = 1 << 12


def is_kml(text: str) -> bool:
    """Return whether a text is KML."""
    return text.lstrip().startswith("<") and "<kml" in text[:_HEAD]


def placemark_rows(path: Path, text: str) -> tuple[list[str], list[list[str]], tuple[str, ...]]:
    """Return header, rows and notes of the placemarks with a point and data.

    Columns are the names of the data (``ExtendedData``), and of the placemark's name and place
    where no data has them: ``cell``, ``lon`` and ``lat``, in WGS 84. Sectors that are drawn as
    areas, and pins without data, are left out with a note.

    Raises
    ------
    InputError
        It is damaged, has entities, which could blow it up, or no such placemark.
    """
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        hint = "delete its <!DOCTYPE …>, which no list needs"
        raise fail(InputError, str(path), "KML without entities", "a DOCTYPE", hint)
    records: list[dict[str, str]] = []
    without = 0
    try:
        for mark in _placemarks(path, text):
            data, place = _data(mark), _place(mark)
            if data and place is not None:
                named = {one.lower() for one in data}
                lon, lat = place
                name = (mark.findtext("{*}name") or "").strip()
                own = {} if "cell" in named or not name else {"cell": name}
                own |= {} if named & _LONGITUDES else {"lon": lon}
                own |= {} if named & _LATITUDES else {"lat": lat}
                records.append(own | data)
            else:
                without += 1
    except ElementTree.ParseError as error:
        raise fail(InputError, str(path), "whole KML", str(error), "cut off, or damaged") from error
    if not records:
        got = f"{number_of(without, 'placemark')} without" if without else "none"
        hint = (
            "write height, azimuth, EIRP and frequency of each cell as its ExtendedData (QGIS does "
            "for the columns of a layer), or export the list as CSV or as a workbook"
        )
        raise fail(InputError, str(path), "placemarks with a point and data", got, hint)
    header = [*dict.fromkeys(name for record in records for name in record)]
    notes: tuple[str, ...] = (
        f"{path.name}: KML read as a table of {number_of(len(records), 'placemark')}",
    )
    if without:
        some = number_of(without, "placemark")
        notes += (f"{path.name}: {some} without a point or without data left out",)
    return header, [[record.get(name, "") for name in header] for record in records], notes


def _placemarks(path: Path, text: str) -> Iterator[Element]:
    # The text is decoded already, whatever it says of its encoding.
    begin, end, rest = text.lstrip().partition("?>")
    whole = rest if end and begin.startswith("<?xml") else text
    for number, (_, element) in enumerate(ElementTree.iterparse(io.BytesIO(whole.encode()))):
        if number > _MOST_ELEMENTS:
            raise fail(InputError, str(path), "KML of at most 2e6 elements", "more")
        if element.tag.rpartition("}")[2] == "Placemark":
            yield element
            # A large document need not be in memory twice.
            element.clear()


def _data(mark: Element) -> dict[str, str]:
    found = {one.get("name", ""): one.findtext("{*}value") for one in mark.findall(".//{*}Data")}
    found |= {one.get("name", ""): one.text for one in mark.findall(".//{*}SimpleData")}
    return {name.strip(): (value or "").strip() for name, value in found.items() if name.strip()}


def _place(mark: Element) -> tuple[str, str] | None:
    point = mark.find(".//{*}Point")
    parts = (point.findtext("{*}coordinates") or "").strip().split(",") if point is not None else []
    return (parts[0].strip(), parts[1].strip()) if len(parts) > 1 else None
