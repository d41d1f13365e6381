"""Numbers of things in words, and what a path means that leads nowhere."""

from __future__ import annotations

import re

_ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]{1,15}:/")
"""Of two letters or more before the colon: one is a drive. A Path has one of the two strokes."""
_PATTERN = re.compile(r"[*?\[]")


def counted(count: int, what: str) -> str:
    """Return a number with what it counts, named as several that end with an "s".

    Examples
    --------
    >>> counted(1, "rows of a table"), counted(2, "rows of a table")
    ('1 row of a table', '2 rows of a table')
    """
    many, space, rest = what.partition(" ")
    return number_of(count, many.removesuffix("s"), many) + space + rest


def number_of(count: int, one: str, many: str = "") -> str:
    """Return a number with what it counts.

    Parameters
    ----------
    count : int
    one : str
        What one of them is called.
    many : str
        What several are, if not with an "s" at the end.

    Examples
    --------
    >>> number_of(1, "row"), number_of(2, "row"), number_of(0, "value is", "values are")
    ('1 row', '2 rows', '0 values are')
    """
    return f"{count} {one if count == 1 else many or one + 's'}"


def likely_of_no_file(path: object, otherwise: str = "a mistyped path") -> str:
    """Return the likely mistake behind a path at which there is nothing.

    Parameters
    ----------
    otherwise : str
        What is likely of a plain path.

    Examples
    --------
    >>> likely_of_no_file("~/walk.csv"), likely_of_no_file("walk.cvs")
    ('~ is not expanded; give os.path.expanduser of it', 'a mistyped path')
    """
    text = str(path)
    if _ADDRESS.match(text):
        return "an address; download the file and give its path"
    if text.startswith("~"):
        return "~ is not expanded; give os.path.expanduser of it"
    if _PATTERN.search(text):
        return "a pattern, which is not expanded; give the paths, such as those of glob.glob"
    return otherwise
