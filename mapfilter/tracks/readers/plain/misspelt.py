"""Names of columns that are nearly those of a field."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from difflib import SequenceMatcher
from functools import cache

from mapfilter._header_units import parted_unit
from mapfilter.tracks.readers.plain.fields import FIELDS, is_of_axis

_ALIKE, _ALIKE_SHORT = 0.8, 0.85
_ALIKE_WORDS = 0.65
"""The same of each of several words: vehicle_type is no vehicle_speed."""
_SHORT = 4
"""Names of so many letters resemble others that differ in one; shorter ones by chance only."""
_UNITS = ("_rad", "_deg", "_radps", "_degps", "_kmh", "_mps", "_km", "_m")


@dataclass(frozen=True, slots=True)
class _Usual:
    """A usual name of a field, taken apart.

    Parameters
    ----------
    field : str
    name : str
    count : int
        Of its words, that of its unit included.
    words : tuple of str
        Without its unit.
    spelled : tuple of str
        What a text may resemble: the name without its unit, and with it in one word.
    """

    field: str
    name: str
    count: int
    words: tuple[str, ...]
    spelled: tuple[str, str]


def meant(column: str, taken: Collection[str] = ()) -> str:
    """Return the field that a column's name resembles, in the same unit; "" for none.

    A misspelling keeps the first letter, adds no word, and leaves the axis of a sensor.

    Parameters
    ----------
    column : str
        In lower case.
    taken : collection of str
        Fields that other columns hold.

    Examples
    --------
    >>> [meant(name) for name in ("stepcount", "compas", "compass_rad", "operator")]
    ['steps', 'compass_deg', '', '']
    """
    text = parted_unit(column)[0]
    found, most = "", 0.0
    for usual in _usual_names().get(text[:1], ()):
        if usual.field not in taken and _may_be(column, text, usual):
            likeness = max(_ratio(text, one) for one in usual.spelled)
            if likeness > most:
                found, most = usual.field, likeness
    return found


@cache
def _usual_names() -> dict[str, tuple[_Usual, ...]]:
    """Return all usual names by the letter that they begin with."""
    found: dict[str, list[_Usual]] = {}
    for field, names in FIELDS.items():
        for name in names:
            own, words = parted_unit(name)[0], _words(name)
            spelled = own, "".join(words)
            usual = _Usual(field, name, len(words), tuple(_words(own)), spelled)
            found.setdefault(own[0], []).append(usual)
    return {letter: tuple(names) for letter, names in found.items()}


def _may_be(column: str, text: str, usual: _Usual) -> bool:
    """Return whether units, words and axes of a column, and of its text alone, are those."""
    if any(column.endswith(u) != usual.name.endswith(u) for u in _UNITS if u in column):
        return False
    words = _words(text)
    if len(words) > usual.count or (is_of_axis(usual.field) and text[-1] != usual.field[-1]):
        return False
    return len(words) != len(usual.words) or not any(map(_differ, words, usual.words))


def _ratio(text: str, usual: str) -> float:
    """Return how alike two texts are; 0 for not enough."""
    least = _ALIKE_SHORT if len(usual) == _SHORT else _ALIKE
    matcher = SequenceMatcher(None, text, usual)
    # What it is at most is known at once.
    if len(usual) < _SHORT or matcher.real_quick_ratio() < least or matcher.quick_ratio() < least:
        return 0.0
    ratio = matcher.ratio()
    return ratio if ratio >= least else 0.0


def _differ(word: str, other: str) -> bool:
    """Return whether two words are no misspelling of one another."""
    return SequenceMatcher(None, word, other).ratio() < _ALIKE_WORDS


def _words(name: str) -> list[str]:
    return name.replace("_", " ").split()
