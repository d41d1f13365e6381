"""Likely mistakes behind values of a configuration, and behind files that are no TOML."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

_AT_LINE = re.compile(r"at line ([0-9]+)")
_KEY = r"^\s*[\w.\"'-]+\s*="
_IN_LINES: tuple[tuple[re.Pattern[str], str], ...] = (
    (re.compile(rf"{_KEY}\s*[-+]?[0-9]+,[0-9]+\s*(#|$)"), "a decimal comma; write a point"),
    (
        re.compile(
            rf"{_KEY}\s*[-+]?[0-9][0-9.]*(e[-+]?[0-9]+)?\s*[^\W0-9_][^#=]*(#|$)", re.IGNORECASE
        ),
        "a unit after a number; write the number alone, or a text in quotes",
    ),
    (re.compile(rf'{_KEY}\s*"[^"]*\\[^"]*"'), "backslashes in a text; write / or single quotes"),
    (
        re.compile(rf"{_KEY}\s*(?!(?:true|false|inf|nan)\s*(?:#|$))[^\s\"'\[{{0-9#+-]"),
        "a text without quotes",
    ),
    (re.compile(rf"{_KEY}\s*[\"'][^\"']*$"), "a quotation mark left out"),
)
"""By the line at which TOML ends; the first that matches counts."""
_TWICE = (
    ("Cannot overwrite a value", "a key given twice"),
    ("Duplicate inline table key", "a key given twice"),
    ("Cannot declare", "a section given twice"),
)
"""By what the parser says, whose line is good TOML by itself."""


def mistake_in_toml(text: str, error: Exception) -> str:
    """Return the likely mistake in a text that is no TOML, or "".

    Examples
    --------
    >>> mistake_in_toml("a = 0,5", ValueError("Expected a newline (at line 1, column 6)"))
    'a decimal comma; write a point'
    """
    for said, hint in _TWICE:
        if str(error).startswith(said):
            return hint
    found, lines = _AT_LINE.search(str(error)), text.splitlines()
    if found is None or not 1 <= int(found[1]) <= len(lines):
        return ""
    line = lines[int(found[1]) - 1]
    return next((hint for pattern, hint in _IN_LINES if pattern.search(line)), "")


def mistake_in_value(keys: Sequence[str], words: str, given: Any) -> str:
    """Return the likely mistake behind a value of the wrong type, or "".

    Parameters
    ----------
    keys : sequence of str
        Of the setting, outermost first.
    words : str
        What is expected.

    Examples
    --------
    >>> mistake_in_value(["rasters", "factor"], "a number", "0,0625")
    'a decimal comma; write 0.0625'
    >>> mistake_in_value(["rasters", "crs"], "a text", 32635)
    '"EPSG:32635"'
    """
    if keys and keys[-1] == "crs" and isinstance(given, int) and not isinstance(given, bool):
        return f'"EPSG:{given}"'
    if not re.match("a (finite |whole )?number", words):
        return ""
    text = given.strip() if isinstance(given, str) else ""
    if isinstance(given, list) and len(given) == 2 and all(type(one) is int for one in given):
        # As a setting, which is a list where it has commas.
        text = ",".join(map(str, given))
    if re.fullmatch(r"[-+]?[0-9]{1,40},[0-9]{1,40}", text):
        return f"a decimal comma; write {text.replace(',', '.')}"
    if found := re.fullmatch(r"([-+]?[0-9][0-9.]{0,40})\s{0,9}[^\W0-9_][^0-9]{0,40}", text):
        return f"a unit after the number; write {found[1]}"
    return ""
