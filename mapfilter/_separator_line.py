"""The first line that spreadsheets write into a CSV file to name its separator."""

from __future__ import annotations

import re
from typing import AnyStr

_LINE = r"\ufeff?\"?sep=[,;|\t]\"?[,;| \t]*(?=[\r\n]|\Z)"
_TEXT = re.compile(_LINE, re.IGNORECASE)
_BYTES = re.compile(_LINE.replace(r"\ufeff", r"(?:\xef\xbb\xbf)").encode(), re.IGNORECASE)


def without_separator_line(table: AnyStr) -> AnyStr:
    r"""Return a table whose first line is blank where it was Excel's ``sep=;``.

    Rows keep their line numbers, and the separator is found by the header, as in any table.

    Examples
    --------
    >>> without_separator_line("sep=;\r\ncell;lat"), without_separator_line(b"cell;lat")
    ('\r\ncell;lat', b'cell;lat')
    """
    if isinstance(table, str):
        return _TEXT.sub("", table, count=1) if _TEXT.match(table) else table
    return _BYTES.sub(b"", table, count=1) if _BYTES.match(table) else table
