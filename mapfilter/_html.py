"""Small HTML tables, as notebooks show objects; every text is escaped."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

_MOST_ROWS = 12


def html_table(title: str, rows: Mapping[str, object]) -> str:
    """Return a title and a table of names and values.

    Examples
    --------
    >>> html_table("Log", {"rows <all>": 3})
    '<p><b>Log</b></p><table><tr><th>rows &lt;all&gt;</th><td>3</td></tr></table>'
    """
    body = "".join(
        f"<tr><th>{escape(name)}</th><td>{escape(str(value))}</td></tr>"
        for name, value in rows.items()
    )
    return f"<p><b>{escape(title)}</b></p><table>{body}</table>"


def shortened(names: Sequence[str]) -> str:
    """Return names with commas between them, of many only the first.

    Examples
    --------
    >>> shortened([str(number) for number in range(14)])
    '0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 and 2 more'
    """
    more = len(names) - _MOST_ROWS
    return ", ".join(names[:_MOST_ROWS]) + (f" and {more} more" if more > 0 else "")
