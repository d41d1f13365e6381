"""Headings of cell lists: names as programs show them, with a unit in brackets."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

_METRES = frozenset({"m", "metre", "metres", "meter", "meters"})
_DEGREES = frozenset({"°", "º", "˚", "deg", "degree", "degrees"})
_UNITS: Mapping[str, tuple[str, frozenset[str]]] = {
    "_m": ("metres", _METRES),
    "_deg": ("degrees", _DEGREES),
    "_dbm": ("dBm", frozenset({"dbm"})),
    "_db": ("dB", frozenset({"db"})),
    "_mhz": ("MHz", frozenset({"mhz"})),
}
"""By the ending of a field, its unit in messages, and how headings may write it."""
_NO_UNIT: tuple[str, frozenset[str]] = ("", frozenset())
_ENDINGS = {"lat": "_deg", "lon": "_deg", "east": "_m", "north": "_m"}
"""Of fields whose names have none."""
_OTHER_UNITS = frozenset(
    {
        *("ft", "foot", "feet", "in", "inch", "yd", "km", "cm", "mm", "mi"),
        *("rad", "radian", "radians", "mrad", "gon", "grad", "mil", "mils"),
        *("w", "watt", "watts", "mw", "kw", "dbw", "dbµv/m", "dbuv/m"),
        *("hz", "khz", "ghz"),
    }
)
_KNOWN_UNITS = _OTHER_UNITS.union(*(written for _, written in _UNITS.values()))
_BRACKETS = {")": "(", "]": "["}
_APART = re.compile(r"[\s_-]+")
_ALIKE = 0.85
_SHORTEST_WORD = 3
_LONGEST = 80
"""Longer headings resemble nothing."""
_OF_OTHER_MEANING = frozenset({"frequency band"})
"""Headings that resemble a field and are none: a band is no frequency of a carrier."""


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

    def fits(self, field: str) -> bool:
        """Return whether the heading has no unit, or the unit of a field."""
        # What follows a unit explains it, as in "m AGL".
        return not self.unit or self.unit.split()[0] in _unit(field)[1]

    def has_other_unit(self, field: str) -> bool:
        """Return whether the heading has a unit that is known and not that of a field."""
        unit = self.unit.split()[0] if self.unit else ""
        own = _unit(field)[1]
        return bool(own) and unit in _KNOWN_UNITS and unit not in own


def unit_of(field: str) -> str:
    """Return the unit of a field as messages name it, or "".

    Examples
    --------
    >>> unit_of("eirp_dbm"), unit_of("east"), unit_of("antenna")
    ('dBm', 'metres', '')
    """
    return _unit(field)[0]


def places_named(headings: Sequence[Heading], field: str, names: Sequence[str]) -> list[int]:
    """Return which headings have one of the names of a field, in the order of the names.

    Those of the field's unit come before those of another one, which the caller refuses.
    """
    found: list[int] = []
    for name in map(_words, names):
        same = [at for at, heading in enumerate(headings) if heading.words == name]
        fitting = [at for at in same if headings[at].fits(field)][:1]
        found += fitting or [at for at in same if headings[at].has_other_unit(field)][:1]
    return list(dict.fromkeys(found))


def resembling(
    headings: Sequence[Heading], used: Collection[int], wanted: Mapping[str, Sequence[str]]
) -> list[tuple[str, str]]:
    """Return (heading, field) for unused headings that resemble a name of a wanted field."""
    found = []
    for at, heading in enumerate(headings):
        if at in used or heading.words in _OF_OTHER_MEANING:
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


def _unit(field: str) -> tuple[str, frozenset[str]]:
    ending = _ENDINGS.get(field, f"_{field.rpartition('_')[2]}")
    return _UNITS.get(ending, _NO_UNIT)


def _words(name: str) -> str:
    return _APART.sub(" ", name).strip().casefold()


def _likeness(heading: str, name: str) -> float:
    """Return how alike a heading and a name are, 0 for not enough."""
    if not heading or len(heading) > _LONGEST:
        return 0.0
    if len(name) >= _SHORTEST_WORD and set(name.split()) <= set(heading.split()):
        return len(name) / len(heading)
    if len(name) <= _SHORTEST_WORD:
        return 0.0
    matcher = difflib.SequenceMatcher(None, heading, name)
    # The last of them takes most of the time.
    bounds = matcher.real_quick_ratio, matcher.quick_ratio, matcher.ratio
    return matcher.ratio() if all(ratio() >= _ALIKE for ratio in bounds) else 0.0
