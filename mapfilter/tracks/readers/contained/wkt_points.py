"""Points as well-known text in a column of a CSV, as geopandas, PostGIS and QGIS write them."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import replace

from mapfilter._words import number_of
from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.texts.separated_values import header_names, likely_separator
from mapfilter.tracks.readers.texts.text import Text

_NAMES = ("geometry", "wkt", "geom", "the_geom", "wkt_geom")
_NUMBER = r"(-?\d{1,9}(?:\.\d{0,20})?(?:[eE][+-]?\d{1,3})?)"
_POINT = re.compile(
    rf"(?:SRID=(\d{{1,6}});)?\s?POINT\s?(?:ZM?|M)?\s?\(\s?{_NUMBER}\s{_NUMBER}"
    r"(?:\s[-\d.eE+]{1,30}){0,2}\s?\)",
    re.IGNORECASE | re.ASCII,
)
_MARK = re.compile(rb"\bPOINT\s?(?:ZM?|M)?\s?\(", re.IGNORECASE)
_PLACES = {"lat", "latitude", "lat_deg"}
_AXES = ("longitude", "latitude")
_DEGREES = (None, "4326")


def with_point_columns(text: Text) -> Text:
    """Return a CSV with the points of a column as longitude and latitude; others as they are.

    Raises
    ------
    InputError
        A point states another system than WGS 84.
    """
    separator = likely_separator(text.first_line)
    names = header_names(text.first_line, separator)
    found = [at for at, name in enumerate(names) if name in _NAMES]
    if len(found) != 1 or _PLACES & {*names} or _MARK.search(text.data[: 1 << 16]) is None:
        return text
    lines = io.StringIO(text.data.decode("utf-8", "replace"), newline="\n")
    stream, header = io.StringIO(), list[str]()
    writer = csv.writer(stream, delimiter=separator, lineterminator="\n")
    at, without = found[0], 0
    try:
        for row in csv.reader(lines, delimiter=separator):
            header = header or row
            # Another row is refused, as it is without points.
            if len(row) == len(names):
                place = _AXES if row == header else _place(row[at], text)
                without += not place[0]
                row = [*row[:at], *place, *row[at + 1 :]]
            writer.writerow(row)
    except csv.Error:
        return text
    note = f"{names[at]}: points taken for longitude and latitude"
    note += f"; {number_of(without, 'row')} without one" if without else ""
    return replace(text, data=stream.getvalue().encode(), notes=(*text.notes, note))


def _place(field: str, text: Text) -> tuple[str, str]:
    """Return the longitude and latitude of a point; two blank texts for anything else."""
    found = _POINT.fullmatch(field.strip(' "'))
    if found is None:
        return "", ""
    if found[1] not in _DEGREES:
        hint = "export the points in WGS 84 (EPSG:4326)"
        expected = "points in longitude and latitude (SRID=4326)"
        raise fail(InputError, str(text.path), expected, f"SRID={found[1]}", hint)
    return found[2], found[3]
