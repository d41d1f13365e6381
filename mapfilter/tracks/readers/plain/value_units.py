"""Units that a plain CSV has behind each value, as in ``-90 dBm``: they go into the header."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import replace

from mapfilter._header_units import parted_unit
from mapfilter.tracks.readers.texts.columns import Columns

_UNITS = ("dbm", "km/h", "kmh", "kph", "m/s", "mps", "mph", "knots", "kn", "kt", "ft", "m", "hpa")
_WITH_UNIT = re.compile(rf"\A[-+]?\d[\d.,]*\s?({'|'.join(_UNITS)})\Z", re.ASCII | re.IGNORECASE)


def with_value_units(rows: Columns, own: Collection[str]) -> Columns:
    """Return columns whose values have no unit, where the first one has one; their names state it.

    Values with another unit stay as they are, and are no numbers.

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
        if name not in known and (first := rows.first_text(name)):
            known[name] = _unit(first, parted_unit(name)[1])
        if not (unit := known.get(name, "")):
            continue
        rows = rows.rewritten(rf"(?i)^\s*([-+]?\d[\d.,]*)\s?{re.escape(unit)}\s*$", r"\1", name)
        rows.reading.note(f"{name}: {unit} behind its values")
        names[at] = name if parted_unit(name)[1] else f"{name} [{unit}]"
    return replace(rows, names=tuple(names))


def _unit(first: str, stated: str) -> str:
    """Return the unit behind the first value of a column; "" for none, or another than stated."""
    found = _WITH_UNIT.match(first)
    if found is None or not (of_value := parted_unit(f"x [{found[1]}]")[1]):
        return ""
    return found[1].lower() if stated in ("", of_value) else ""
