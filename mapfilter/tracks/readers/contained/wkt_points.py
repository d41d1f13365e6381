"""Points as well-known text in a column of a CSV, as geopandas, PostGIS and QGIS write them."""

from __future__ import annotations

import re
from dataclasses import replace

from mapfilter.tracks.readers.texts.separated_values import header_names, likely_separator
from mapfilter.tracks.readers.texts.text import Text

_NAMES = ("geometry", "wkt", "geom", "the_geom", "wkt_geom")
_POINT = re.compile(
    rb"\"?(?:SRID=\d{1,6};)?POINT ?(?:ZM?|M)? ?"
    rb"\((-?\d{1,9}(?:\.\d{1,20})?) (-?\d{1,9}(?:\.\d{1,20})?)(?: [-\d.eE+]{1,30}){0,2}\)\"?",
    re.IGNORECASE,
)
_PLACES = {"lat", "latitude", "lat_deg"}


def with_point_columns(text: Text) -> Text:
    """Return a CSV with the points of a column as longitude and latitude; others as they are."""
    separator = likely_separator(text.first_line)
    names = header_names(text.first_line, separator)
    found = [at for at, name in enumerate(names) if name in _NAMES]
    if len(found) != 1 or _PLACES & {*names} or _POINT.search(text.data[: 1 << 16]) is None:
        return text
    own = names[found[0]]
    head, line, rest = text.data.partition(b"\n")
    if not head.strip():
        return text
    places = [f"longitude{separator}latitude" if name == own else f'"{name}"' for name in names]
    rows = _POINT.sub(rb"\1" + separator.encode() + rb"\2", rest)
    note = f"{own}: points taken for longitude and latitude"
    data = separator.join(places).encode() + line + rows
    return replace(text, data=data, notes=(*text.notes, note))
