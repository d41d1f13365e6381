"""Positions of a plain CSV: degrees with their hemispheres, and courses within one turn."""

from __future__ import annotations

import re

import numpy as np

from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.tracks.readers.columns import Columns
from mapfilter.tracks.readers.csv_mapped import Mapped, add_rows
from mapfilter.tracks.readers.csv_odometry import speeds_of
from mapfilter.tracks.readers.recording import Reading

_HEMISPHERES = {"lat_deg": ("N", "S"), "lon_deg": ("E", "W")}
_NAMED = re.compile(r"lat|lon|lng|hemi|^n[ /_]?s$|^e[ /_]?w$")
_FEWEST_WEST = 3
"""So many different negative courses are no mark of missing ones."""


def hemisphere_columns(rows: Columns, taken: frozenset[str] = frozenset()) -> dict[str, str]:
    """Return the columns that hold the hemisphere of a latitude or longitude, by field.

    All their texts are N and S, or E and W; there is one for both, or its name says what it is.

    Parameters
    ----------
    rows : Columns
    taken : frozenset of str
        Columns of fields.
    """
    found: dict[str, str] = {}
    for name in rows.names:
        if not name or name in taken or rows.names.count(name) > 1:
            continue
        first = rows.first_text(name).upper()
        for field, letters in _HEMISPHERES.items():
            if field not in found and first in letters:
                texts = {str(text).upper() for text in np.unique(rows.texts(name))}
                if texts <= {*letters, ""}:
                    found[field] = name
    if len(found) == len(_HEMISPHERES):
        return found
    # A letter alone may be a mark of anything.
    return {field: name for field, name in found.items() if _NAMED.search(name)}


def add_places(
    mapped: Mapped, reading: Reading, time_s: Floats, hemispheres: dict[str, str]
) -> None:
    """Add positions in degrees, with speed and course."""
    if not mapped.has("lat_deg", "lon_deg"):
        return
    names = ("lat_deg", "lon_deg", "altitude_m", "accuracy_m", "course_deg")
    columns = {name: mapped.number(name) for name in names}
    for field, column in hemispheres.items():
        columns[field] = _signed(mapped, reading, columns[field], field, column)
    columns["course_deg"] = _within_turn(columns["course_deg"])
    there = np.isfinite(columns["lat_deg"]) | np.isfinite(columns["lon_deg"])
    columns |= {"time_s": time_s, "speed_mps": speeds_of(mapped, "speed")}
    add_rows(reading, "positions", columns, mapped.rows, there)


def _signed(mapped: Mapped, reading: Reading, degrees: Floats, field: str, column: str) -> Floats:
    """Return degrees that are negative where their hemisphere is that of S or W."""
    letter = _HEMISPHERES[field][1]
    other = np.array([str(text).upper() == letter for text in mapped.rows.texts(column)])
    wrong = other & (degrees > 0)
    if count := int(wrong.sum()):
        reading.note(
            f"{field}: {number_of(count, 'value')} of {letter} by column {column}: negative"
        )
    return np.where(wrong, -degrees, degrees)


def _within_turn(course_deg: Floats) -> Floats:
    """Return courses of -180 to 180 as those of 0 to 360."""
    west = course_deg < 0
    if not west.any() or np.nanmin(course_deg) < -180 or np.nanmax(course_deg) > 180:
        return course_deg
    if len(np.unique(course_deg[west])) <= _FEWEST_WEST:
        return course_deg
    return np.where(west, course_deg + 360.0, course_deg)
