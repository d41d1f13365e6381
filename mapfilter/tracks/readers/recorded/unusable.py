"""Rows of a file that cannot be used, and files of which none can."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mapfilter._words import number_of
from mapfilter.errors import InputError, MapfilterError, fail


@dataclass(frozen=True)
class Unusable:
    """Rows of a file that cannot be used, for one reason.

    ``lines`` are the first of them, and ``first`` is what the first one holds; "" where the reason
    is not a value.
    """

    reason: str
    count: int
    lines: tuple[int, ...]
    first: str = ""

    def __str__(self) -> str:
        more = ", …" if self.count > len(self.lines) else ""
        lines = "line" if self.count == 1 else "lines"
        where = f"{lines} {', '.join(map(str, self.lines))}{more}"
        where += f"; first {self.first}" if self.first else ""
        return f"{number_of(self.count, 'row')}: {self.reason} ({where})"


def nothing_usable(
    path: Path, name: str, rows: int, reasons: Sequence[str], rows_word: str = "row"
) -> MapfilterError:
    """Return the error for a file of which no row can be used, with the main reasons."""
    got = f"none in {number_of(rows, 'row')}" if rows else "no rows"
    got += f": {'; '.join(reasons[:3])}" if reasons else ""
    return fail(InputError, str(path), f"a usable {rows_word} of {name}", got)
