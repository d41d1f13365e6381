"""Units that a plain CSV has behind each value, as in ``-90 dBm``: they go into the header."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from mapfilter._header_units import parted_unit
from mapfilter.tracks.readers.texts.columns import MISSING, Columns

_UNITS = ("dbm", "km/h", "kmh", "kph", "m/s", "mps", "mph", "knots", "kn", "kt", "ft", "m", "hpa")
_WITH_UNIT = re.compile(rf"\A[-+]?\d[\d.,]*\s?({'|'.join(_UNITS)})\Z", re.ASCII | re.IGNORECASE)


def with_value_units(rows: Columns, own: Collection[str]) -> Columns:
    """Return columns whose values have no unit, where all have one; their names state it.

    Parameters
    ----------
    rows : Columns
        Of the first part of a file, or of a later one, which is read as that.
    own : collection of str
        Names that a user gives: these columns keep theirs.
    """
    names, known = list(rows.names), rows.reading.value_units
    for at, name in enumerate(rows.names):
        if name in own or not name or rows.names.count(name) > 1:
            continue
        unit = known.get(name) or _unit(rows, name)
        if not unit:
            continue
        known[name] = unit
        rows = rows.rewritten(rf"(?i)^\s*([-+]?\d[\d.,]*)\s?{re.escape(unit)}\s*$", r"\1", name)
        rows.reading.note(f"{name}: {unit} behind its values")
        names[at] = name if parted_unit(name)[1] else f"{name} [{unit}]"
    return replace(rows, names=tuple(names))


def _unit(rows: Columns, name: str) -> str:
    """Return the unit behind all values of a column; "" where one lacks it, or has another."""
    first = _WITH_UNIT.fullmatch(rows.first_text(name))
    if first is None or (stated := parted_unit(name)[1]) not in ("", first[1].lower()):
        return ""
    words = np.unique(rows.texts(name).astype(np.str_)).tolist()
    found = (_WITH_UNIT.fullmatch(word) for word in words if word not in MISSING)
    same = all(one is not None and one[1].lower() == first[1].lower() for one in found)
    return first[1].lower() if same and (stated or parted_unit(f"x [{first[1]}]")[1]) else ""
