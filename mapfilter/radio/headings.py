"""Headings of cell lists: names as programs show them, with a unit in brackets."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple
from unicodedata import combining, normalize

_METRES = frozenset(
    {"m", "metre", "metres", "meter", "meters", "mètre", "mètres", "metros", "metri", "mtr", "magl"}
)
# In German a "Grad" is a degree; gradians are found as "gon" too.
_DEGREES = frozenset(
    {
        "°",
        "º",
        "˚",
        "deg",
        "degs",
        "degree",
        "degrees",
        "grad",
        "grados",
        "gradi",
        "degré",
        "degrés",
    }
)
_POSITIONS_IN = frozenset({"e", "n", "east", "north"})
"""Ways in which positions count, which headings write in place of a unit."""
_LENGTHS = frozenset({"ft", "foot", "feet", "in", "inch", "inches", "yd", "km", "cm", "mm", "mi"})
_ANGLES = frozenset({"rad", "radian", "radians", "mrad", "gon", "mil", "mils"})
_POWERS = frozenset({"w", "watt", "watts", "mw", "kw", "dbw", "dbµv/m", "dbμv/m", "dbuv/m"})
_FREQUENCIES = frozenset({"hz", "khz", "ghz"})
_DECIBELS = frozenset({"db"})


class _Unit(NamedTuple):
    """A unit as messages name it, how headings may write it, and others of its dimension."""

    name: str
    written: frozenset[str]
    others: frozenset[str]


_UNITS: Mapping[str, _Unit] = {
    "_m": _Unit("metres", _METRES, _LENGTHS),
    "_deg": _Unit("degrees", _DEGREES, _ANGLES),
    "_dbm": _Unit("dBm", frozenset({"dbm"}), _POWERS),
    "_db": _Unit("dB", _DECIBELS, frozenset()),
    "_mhz": _Unit("MHz", frozenset({"mhz"}), _FREQUENCIES),
}
"""By the ending of a field."""
_NO_UNIT = _Unit("", frozenset(), frozenset())
# A position may be in degrees or in metres; each of them is wrong for the other's field.
_OF_DEGREES = _Unit("degrees", _DEGREES | _POSITIONS_IN, _ANGLES | _LENGTHS | _METRES)
_OF_METRES = _Unit("metres", _METRES | _POSITIONS_IN, _ANGLES | _LENGTHS | _DEGREES)
_PLACES = {"lat": _OF_DEGREES, "lon": _OF_DEGREES, "east": _OF_METRES, "north": _OF_METRES}
"""Of fields whose names have no ending."""
_KNOWN_UNITS = frozenset[str]().union(*(unit.written | unit.others for unit in _UNITS.values()))
_BEFORE_UNITS = re.compile(r"^(in|decimal)\s+")
"""Words before a unit, as in "in m"; "in" alone is inches."""
_ABOVE_SEA = re.compile(
    r"\b(?:nn|nhn|ngf|asl|amsl|msl|mer|meer\w*|s\. ?m)\b|\bü\.? ?m\b|üNN|niveau(?! (?:du )?sol)",
    re.IGNORECASE,
)
"""What headings of heights above the sea say; those of antennas are above the ground."""
_BRACKETS = {")": "(", "]": "["}
_APART = re.compile(r"[\s_-]+")
_ALIKE = 0.85
_SHORTEST_WORD = 3
_LONGEST = 80
"""Longer headings resemble nothing."""


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading of a table.

    Parameters
    ----------
    name : str
        As it stands there.
    words : str
        Its words in small letters with blanks between them, without a unit.
    title : str
        The name without a unit.
    unit : str
        What stands in brackets, in small letters; "" without any.
    """

    name: str
    words: str
    title: str
    unit: str

    @classmethod
    def of(cls, name: str) -> Heading:
        """Return a heading taken apart.

        Examples
        --------
        >>> Heading.of("Mechanical Downtilt (°)").words, Heading.of("EIRP [dBm]").unit
        ('mechanical downtilt', 'dbm')
        """
        opening = _BRACKETS.get(name[-1:], "")
        title, found, unit = name[:-1].rpartition(opening) if opening else ("", "", "")
        title, unit = title.strip(), unit.strip()
        if not (found and title and unit):
            return cls(name, _words(name), name, "")
        return cls(name, _words(title), title, unit.casefold())

    @property
    def is_above_sea(self) -> bool:
        """Whether it says that heights are above the sea.

        Examples
        --------
        >>> [Heading.of(f"Höhe (m{of})").is_above_sea for of in (" ü. NN", " ü. G.", "")]
        [True, False, False]
        """
        return _ABOVE_SEA.search(self.name) is not None

    def fits(self, field: str) -> bool:
        """Return whether the heading has no unit, or the unit of a field."""
        return not self.unit or _written(self.unit) in _unit(field).written

    def has_other_unit(self, field: str) -> bool:
        """Return whether the heading has another unit of what a field measures, as feet."""
        return _written(self.unit) in _unit(field).others

    def has_doubtful_unit(self, field: str) -> bool:
        """Return whether the heading has a known unit that does not measure a field, as dB do.

        Letters may mean something else then: the W of a longitude is no watt.
        """
        unit, known = _written(self.unit), _unit(field)
        return bool(known.name) and unit in _KNOWN_UNITS - known.written - known.others


def unit_of(field: str) -> str:
    """Return the unit of a field as messages name it, or "".

    Examples
    --------
    >>> unit_of("eirp_dbm"), unit_of("east"), unit_of("antenna")
    ('dBm', 'metres', '')
    """
    return _unit(field).name


def places_named(headings: Sequence[Heading], field: str, names: Sequence[str]) -> list[int]:
    """Return which headings have one of the names of a field, in the order of the names.

    Those of the field's unit come before those of a doubtful one, and these before those of another
    one, which the caller refuses.
    """
    found: list[int] = []
    for name in map(_words, names):
        same = [at for at, heading in enumerate(headings) if heading.words == name]
        for judged in (Heading.fits, Heading.has_doubtful_unit, Heading.has_other_unit):
            if at := [at for at in same if judged(headings[at], field)][:1]:
                found += at
                break
    found.sort(key=lambda at: _doubt(headings[at], field))
    return list(dict.fromkeys(found))


def doubtful_units(headings: Sequence[Heading], picked: Mapping[str, Sequence[int]]) -> str:
    """Return a note on the columns of fields that are read in spite of their units, or "".

    Examples
    --------
    >>> doubtful_units([Heading.of("EIRP (dB)")], {"eirp_dbm": [0]})
    "units that do not belong to fields: 'EIRP (dB)' is read as eirp_dbm in dBm"
    """
    named = ", ".join(
        f"{headings[at].name!r} is read as {field} in {unit_of(field)}"
        for field, places in picked.items()
        for at in places
        if headings[at].has_doubtful_unit(field)
    )
    return f"units that do not belong to fields: {named}" if named else ""


def resembling(
    headings: Sequence[Heading], used: Collection[int], wanted: Mapping[str, Sequence[str]]
) -> list[tuple[str, str]]:
    """Return (heading, field) for unused headings that resemble a name of a wanted field."""
    found = []
    for at, heading in enumerate(headings):
        if at in used:
            continue
        alike = []
        for field, names in wanted.items():
            most = max((_likeness(heading.words, _words(name)) for name in names), default=0.0)
            if most > 0:
                # "Antenna Height (m)" is a height.
                of_unit = bool(heading.unit and unit_of(field)) and heading.fits(field)
                alike.append((of_unit, most, field))
        if alike:
            found.append((heading.name, max(alike)[-1]))
    return found


def _unit(field: str) -> _Unit:
    return _PLACES.get(field) or _UNITS.get(f"_{field.rpartition('_')[2]}", _NO_UNIT)


def _written(unit: str) -> str:
    """Return a unit alone: what follows explains it, as in "m AGL", and so do "in m" and "°N"."""
    first = re.split(r"[\s,;_-]", _BEFORE_UNITS.sub("", unit), maxsplit=1)[0].rstrip(".")
    if first[:1] in _DEGREES:
        return first[0]
    without_points = first.replace(".", "")
    return without_points if without_points in _KNOWN_UNITS else first


def _doubt(heading: Heading, field: str) -> int:
    return 0 if heading.fits(field) else 1 if heading.has_doubtful_unit(field) else 2


def _words(name: str) -> str:
    """Return the words of a name in small letters, without accents, as some exports have them."""
    apart = normalize("NFKD", _APART.sub(" ", name).strip().casefold())
    return apart if apart.isascii() else "".join(one for one in apart if not combining(one))


def _likeness(heading: str, name: str) -> float:
    """Return how alike a heading and a name are, 0 for not enough."""
    if not heading or len(heading) > _LONGEST:
        return 0.0
    if len(name) >= _SHORTEST_WORD and set(name.split()) <= set(heading.split()):
        return len(name) / len(heading)
    # A misspelling keeps the first letter: an altitude is no latitude.
    if len(name) <= _SHORTEST_WORD or heading[0] != name[0]:
        return 0.0
    if len(heading) > _SHORTEST_WORD and " " not in name and name.startswith(heading):
        return len(heading) / len(name)
    matcher = difflib.SequenceMatcher(None, heading, name)
    # The last of them takes most of the time.
    bounds = matcher.real_quick_ratio, matcher.quick_ratio, matcher.ratio
    return matcher.ratio() if all(ratio() >= _ALIKE for ratio in bounds) else 0.0
