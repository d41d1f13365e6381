"""A row of units below the names of a plain CSV, as loggers of vehicles write; names take them."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import replace

from mapfilter._header_units import header_unit, parted_unit
from mapfilter.tracks.readers.plain.fields import usual_fields
from mapfilter.tracks.readers.texts.columns import Columns

_FEWEST, _MOSTLY = 2, 0.5
_DIGIT = re.compile(r"\d")


def with_unit_row(rows: Columns, own: Collection[str]) -> Columns:
    """Return columns without a first row that has units and no numbers; their names state them.

    Parameters
    ----------
    rows : Columns
        Of the first part of a file, or of a later one, which is read as that.
    own : collection of str
        Names that a user gives: these columns keep theirs.
    """
    reading = rows.reading
    if reading.unit_row is None:
        reading.unit_row = _units(rows.first_row()) if len(rows) else None
        if reading.unit_row:
            rows = rows.after_first()
            reading.note("units are those of the row below the names")
    units = reading.unit_row or {}
    names = tuple(
        name if name in own else _with_unit(name, units.get(name, "")) for name in rows.names
    )
    return replace(rows, names=names)


def _units(first: dict[str, str]) -> dict[str, str]:
    """Return the units of a first row by columns; none where it is one of values."""
    texts = {name: text for name, text in first.items() if text}
    if any(_DIGIT.search(text.replace("2", "").replace("²", "")) for text in texts.values()):
        return {}
    units = {name: parted_unit(f"x [{text.strip('()[]')}]")[1] for name, text in texts.items()}
    known = {name: unit for name, unit in units.items() if unit}
    return known if len(known) >= max(_FEWEST, _MOSTLY * len(texts)) else {}


def _with_unit(name: str, unit: str) -> str:
    """Return a name with its unit, unless it states one, or has the field's own by itself."""
    if not (name and unit) or parted_unit(name)[1]:
        return name
    stated = f"{name} [{unit}]"
    for field in usual_fields([name]):
        of_field = header_unit(field, stated)
        if of_field is None or of_field.factor == 1.0:
            return name
    return stated
