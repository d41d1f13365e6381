"""Numbers of things, in words."""

from __future__ import annotations


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
