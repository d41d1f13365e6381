"""Columns of a plain CSV that state whether a receiver had a fix."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Bools
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.columns import Columns

_TYPES = ("fix_type", "fixtype", "fix type", "gps_fix_type", "gnss_fix_type")
"""Kinds of fixes: 0 and 1 for none, 2 and more for others; or 0 for none and 1 for one."""
_EITHER = ("gps_fix", "fix")
"""Kinds of fixes where one is 3 (in three dimensions); else qualities, of which 0 alone is none."""
_QUALITIES = ("fix_quality", "gps_quality", "gga_quality", "fix quality")
"""As in GGA of NMEA: 0 for none, 6 to 8 for positions that are not measured."""
_VALID = "valid"
"""Of a receiver of u-blox it is whether the date and time are valid."""
_FLAGS = ("gnssfixok", "gnss_fix_ok", "fix_ok", "fix_valid", "gps_valid", "gnss_valid", _VALID)
_OF_BAGS = ("field.status.status", "status.status")
"""As in NavSatStatus of ROS: -1 for none."""
_ARDUPILOT = {"timeus", "nsats", "status"}
_NONE = frozenset(("no_fix", "no fix", "nofix", "none", "no gps", "no_gps", "invalid", "no"))
_FALSE = frozenset(("0", "false", "no", "n", "v", "invalid"))
_LEAST_OF_TYPES, _THREE_DIMENSIONS, _ESTIMATED = 2, 3, (6, 7, 8)


def fix_column(rows: Columns, own: frozenset[str] = frozenset()) -> str:
    """Return the column that states whether there was a fix; "" without one.

    Parameters
    ----------
    rows : Columns
    own : frozenset of str
        Columns of fields.
    """
    first = ("status",) if rows.has(*_ARDUPILOT) else ()
    names = (*first, *_FLAGS[:-1], *_TYPES, *_EITHER, *_QUALITIES, *_OF_BAGS, _VALID)
    found = (name for name in names if name in rows.names and name not in own)
    return next((name for name in found if rows.names.count(name) == 1), "")


def without_fix(rows: Columns, name: str, reading: Reading) -> Bools:
    """Return the rows that had no fix by a column, where other rows had one.

    Later parts of a large file are read as the first one in which both are.
    """
    words = np.char.lower(rows.texts(name).astype(np.str_))
    number = _numbers(words)
    if name in _FLAGS:
        none, known = np.isin(words, [*_FALSE]) | (number == 0), words != ""
    elif name in _OF_BAGS:
        none, known = number == -1, np.isfinite(number)
    elif name in _QUALITIES:
        none, known = np.isin(number, (0, *_ESTIMATED)), np.isfinite(number)
    else:
        types = reading.columns.get("fix types") == name
        shown = number == _THREE_DIMENSIONS if name in _EITHER else number >= _LEAST_OF_TYPES
        types |= bool(shown.any())
        if types:
            reading.columns["fix types"] = name
        none = (number < _LEAST_OF_TYPES if types else number == 0) | np.isin(words, [*_NONE])
        known = np.isfinite(number) | ~np.isin(words, ["", *_NONE])
    if (known & ~none).any():
        reading.columns["fix states"] = name
    told = reading.columns.get("fix states") == name
    return np.asarray(none & told, dtype=np.bool_)


def _numbers(words: np.ndarray) -> np.ndarray:
    """Return words as numbers, NaN for others; a column has few different ones."""
    known: dict[str, float] = {}
    for word in np.unique(words):
        try:
            known[str(word)] = float(word)
        except ValueError:
            known[str(word)] = np.nan
    return np.array([known[word] for word in words.tolist()], dtype=np.float64)
