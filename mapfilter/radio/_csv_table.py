"""Tables as CSV text, as spreadsheets and planning tools write them."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path

from mapfilter.errors import InputError, fail

_LARGEST_BYTES = 1 << 26
_MOST_FIELDS = 5_000_000
_SEPARATORS = (",", ";", "\t")


@dataclass(frozen=True, slots=True)
class Table:
    """A header and rows of texts; blank lines are left out.

    Parameters
    ----------
    path : Path
    separator : str
        Comma, semicolon or tab.
    header : tuple of str
        Without blanks around the names.
    rows : tuple of (int, list of str)
        Line of the file, and its fields.
    """

    path: Path
    separator: str
    header: tuple[str, ...]
    rows: tuple[tuple[int, list[str]], ...]

    def number(self, text: str) -> float | None:
        """Return a finite number or None; decimal commas are read where they separate nothing."""
        return number(text, decimal_comma=self.separator != ",")


def number(text: str, *, decimal_comma: bool = False) -> float | None:
    """Return a text as a finite number, or None.

    Examples
    --------
    >>> number("60.5"), number("60,5"), number("60,5", decimal_comma=True), number("1_0")
    (60.5, None, 60.5, None)
    """
    if decimal_comma and text.count(",") == 1 and "." not in text:
        text = text.replace(",", ".")
    try:
        value = float("?" if "_" in text else text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def read_table(path: Path, what: str) -> Table:
    """Read a table whose first line names its columns.

    Parameters
    ----------
    path : Path
        UTF-8; commas, semicolons or tabs.
    what : str
        What it should be, for messages, such as ``"a cell plan"``.

    Raises
    ------
    InputError
        The file is missing, empty, too large or no such text.
    """
    text = _text(path, what)
    head = next((line for line in text.splitlines() if line.strip()), "")
    separator = max(_SEPARATORS, key=head.count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    lines: list[tuple[int, list[str]]] = []
    fields = 0
    try:
        for row in reader:
            if any(field.strip() for field in row):
                lines.append((reader.line_num, row))
                fields += len(row)
                if fields > _MOST_FIELDS:
                    got = f"more in the first {reader.line_num} lines"
                    raise fail(InputError, str(path), f"{what} of at most 5e6 fields", got)
    except csv.Error as error:
        raise fail(InputError, f"{path} row {reader.line_num}", "CSV", error) from error
    if not lines:
        raise fail(InputError, str(path), "a header line and rows", "nothing", "an empty file")
    header = tuple(name.strip() for name in lines[0][1])
    return Table(path, separator, header, tuple(lines[1:]))


def _text(path: Path, what: str) -> str:
    try:
        if path.stat().st_size > _LARGEST_BYTES:
            raise fail(InputError, str(path), f"{what} of at most 64 MiB", "a larger file")
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        got = f"other bytes at offset {error.start}"
        hint = "saved in a Windows code page, or no text file"
        raise fail(InputError, str(path), "text in UTF-8", got, hint) from error
    except OSError as error:
        raise fail(InputError, str(path), "a readable file", error.strerror or error) from error
    if "\0" in text:
        raise fail(InputError, str(path), "text in UTF-8", "NUL characters", "no text file")
    return text
