"""Dates in the names of files, as loggers write them: 2026-05-13, 20260513, 2026_05_13."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

_NAMED = re.compile(r"(?<!\d)((?:19|20)\d\d)([-_.]?)(0[1-9]|1[0-2])\2([0-3]\d)(?!\d)", re.ASCII)
_PARTS = 2
"""Of a path: the file, and the folder or ZIP that it is in."""


def dates_in_name(path: Path) -> list[np.datetime64]:
    """Return the dates with a year of four digits in the names of a file and of its folder.

    Examples
    --------
    >>> [str(one) for one in dates_in_name(Path("2013-05-16/drive_20130517_1015.csv"))]
    ['2013-05-16', '2013-05-17']
    """
    found = []
    for name in path.parts[-_PARTS:]:
        for year, _, month, day in _NAMED.findall(name):
            try:
                found.append(np.datetime64(f"{year}-{month}-{day}"))
            except ValueError:
                continue
    return found
