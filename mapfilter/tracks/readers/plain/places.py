"""Positions of a plain CSV: degrees with their hemispheres, and courses within one turn."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.errors import InputError, fail
from mapfilter.tracks.joining.position_units import UERE_M
from mapfilter.tracks.readers.plain.fields import column_option
from mapfilter.tracks.readers.plain.fix_states import fix_column, without_fix
from mapfilter.tracks.readers.plain.mapped import Mapped, add_rows
from mapfilter.tracks.readers.plain.odometry import speeds_of
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.columns import Columns

_HEMISPHERES = {"lat_deg": ("N", "S"), "lon_deg": ("E", "W")}
_NAMED = re.compile(
    r"(?:gps)?[ _]?(?:lat|latitude|lon|long|lng|longitude)[ /_]?"
    r"(?:(?:dir|hemi|ind|ref)\w*|n[ /_]?s|e[ /_]?w)|hemi\w*|n[ /_]?s|e[ /_]?w"
)
_MARKED = re.compile(r"([-+]?\d+(?:[.,]\d+)?)\s*(°?)\s*([NSEW]?)", re.ASCII | re.IGNORECASE)
"""Degrees with their sign or the letter of their hemisphere."""
_MISSING_WORD = re.compile(r"\D{2,}")
_FAR_DEG = 1.0
"""Farther from the equator and the meridian of Greenwich, none crosses them to the next row."""
_SATELLITES = re.compile(
    r"(?:gps[ _]?)?(?:num(?:ber)?[ _]?(?:of[ _]?)?|n)?[ _]?(?:sats?|satellites?|svs?)"
    r"(?:[ _]?(?:used|count|in[ _]use|in[ _]fix|num|number))?"
)
_FEWEST_HDOP, _HDOP, _EXACT = 20, (0.4, 2.0), 1e-6
_FEWEST_WEST = 3
"""So many different negative courses are no mark of missing ones."""


def hemisphere_columns(rows: Columns, taken: frozenset[str] = frozenset()) -> dict[str, str]:
    """Return the columns that hold the hemisphere of a latitude or longitude, by field.

    All their texts are N and S, or E and W, and their names say what they are: a letter may be a
    mark of anything.

    Parameters
    ----------
    rows : Columns
    taken : frozenset of str
        Columns of fields.
    """
    found: dict[str, str] = {}
    for name in rows.names:
        if not _NAMED.fullmatch(name) or name in taken or rows.names.count(name) > 1:
            continue
        every = {str(text).upper() for text in np.unique(rows.texts(name))} - {"", "-"}
        # Words stand for missing ones.
        texts = {text for text in every if not _MISSING_WORD.fullmatch(text)}
        for field, letters in _HEMISPHERES.items():
            if field not in found and texts and texts.issubset(letters):
                found[field] = name
    return found


def with_bare_degrees(mapped: Mapped) -> Mapped:
    """Return columns whose degrees are numbers, where they have a sign or a letter: 60.17° N."""
    rows = mapped.rows
    for field, (plus, minus) in _HEMISPHERES.items():
        name = rows.find(*mapped.names(field))
        found = name and _MARKED.fullmatch(rows.first_text(name))
        if not name or not found or not (found[2] or found[3]):
            continue
        for letter, sign in ((minus, "-"), (f"{plus}?", "")):
            either = f"[{letter[0]}{letter[0].lower()}]{letter[1:]}"
            pattern = rf"^\s*([-+]?\d+(?:[.,]\d+)?)\s*°?\s*{either}\s*$"
            rows = rows.rewritten(pattern, rf"{sign}\1", name)
        example = rows.reading.columns.setdefault(f"{field}, as in", found[0])
        rows.reading.note(f"{name}: degrees with a sign or a letter, as in {example}")
    return replace(mapped, rows=rows)


def add_places(
    mapped: Mapped, reading: Reading, time_s: Floats, hemispheres: dict[str, str]
) -> None:
    """Add positions in degrees, with speed and course.

    Raises
    ------
    InputError
        A column of hemispheres turns the positions of a steady way to and fro.
    """
    if not mapped.has("lat_deg", "lon_deg"):
        return
    names = ("lat_deg", "lon_deg", "altitude_m", "accuracy_m", "course_deg")
    columns = {name: mapped.number(name) for name in names}
    for field, column in hemispheres.items():
        columns[field] = _signed(mapped, reading, columns[field], field, column)
    if mapped.has("accuracy_m"):
        _note_hdop(mapped, reading, columns["accuracy_m"])
    if mapped.has("hdop"):
        stated_m, by_hdop_m = columns["accuracy_m"], UERE_M * mapped.number("hdop")
        columns["accuracy_m"] = np.where(np.isnan(stated_m), by_hdop_m, stated_m)
    columns["course_deg"] = _within_turn(columns["course_deg"])
    there = np.isfinite(columns["lat_deg"]) | np.isfinite(columns["lon_deg"])
    if column := fix_column(mapped.rows, mapped.taken):
        none = there & without_fix(mapped.rows, column, reading)
        reading.refuse(mapped.rows.line[none], f"no fix, by column {column}")
        there &= ~none
    columns |= {"time_s": time_s, "speed_mps": speeds_of(mapped, "speed")}
    add_rows(reading, "positions", columns, mapped.rows, there)


def _note_hdop(mapped: Mapped, reading: Reading, accuracy: Floats) -> None:
    """Note accuracies without a unit that look like a dilution of precision (HDOP).

    Of a receiver that counts its satellites, many programs write HDOP: tenths, of which some are
    below 1. Phones state metres, and hardly ever less than 1.
    """
    column = mapped.rows.find(*mapped.names("accuracy_m"))
    known = accuracy[np.isfinite(accuracy) & (accuracy > 0)]
    if column != "accuracy" or "accuracy_m" in mapped.own or known.size < _FEWEST_HDOP:
        return
    low, middle = float(known.min()), float(np.median(known))
    tenths = np.abs(10 * known - np.round(10 * known)) < _EXACT
    counted = any(_SATELLITES.fullmatch(name) for name in mapped.rows.names)
    if not (counted and tenths.all() and _HDOP[0] <= low < 1 and middle <= _HDOP[1]):
        return
    if np.unique(known).size > 2:
        reading.note(
            "accuracy: tenths, some below 1, beside a number of satellites, as HDOP has them: taken"
            f" for metres; {column_option('hdop', column)} reads HDOP"
        )


def _signed(mapped: Mapped, reading: Reading, degrees: Floats, field: str, column: str) -> Floats:
    """Return degrees that are negative where their hemisphere is that of S or W."""
    letter = _HEMISPHERES[field][1]
    letters = np.array([str(text).upper() for text in mapped.rows.texts(column)], dtype=object)
    other = np.asarray(letters == letter, dtype=np.bool_)
    _check_steady(mapped, reading, degrees, letters, column)
    wrong = other & (degrees > 0)
    if count := int(wrong.sum()):
        of = f"of {letter} by column {column}: negative"
        reading.count(lambda n: f"{field}: {number_of(n, 'value')} {of}", count)
    return np.where(wrong, -degrees, degrees)


def _check_steady(
    mapped: Mapped, reading: Reading, degrees: Floats, letters: np.ndarray, column: str
) -> None:
    """Refuse letters that change from row to row where the degrees do not."""
    at = np.flatnonzero(np.isin(letters.astype(str), list("NSEW")) & (degrees > 0))
    far = np.minimum(degrees[at[1:]], degrees[at[:-1]]) > _FAR_DEG
    steady = far & (np.abs(np.diff(degrees[at])) < _FAR_DEG)
    jumps = at[1:][steady & (letters[at[1:]] != letters[at[:-1]])]
    if not jumps.size:
        return
    changes = number_of(int(jumps.size), "change")
    where = f"{reading.path} row {mapped.rows.line[jumps[0]]}, {column}"
    got = f"{changes} between {' and '.join(sorted(set(letters[at])))} on a way without jumps"
    hint = "another quantity than a hemisphere: give the column another name, or leave it out"
    raise fail(InputError, where, "the hemisphere of the degrees", got, hint)


def _within_turn(course_deg: Floats) -> Floats:
    """Return courses of -180 to 180 as those of 0 to 360."""
    west = course_deg < 0
    if not west.any() or np.nanmin(course_deg) < -180 or np.nanmax(course_deg) > 180:
        return course_deg
    if len(np.unique(course_deg[west])) <= _FEWEST_WEST:
        return course_deg
    return np.where(west, course_deg + 360.0, course_deg)
