"""Tables in files: CSV in the usual encodings, and workbooks of Excel or LibreOffice."""

from __future__ import annotations

import csv
import io
import math
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from string import ascii_letters
from typing import Any

from python_calamine import CalamineError, CalamineWorkbook

from mapfilter._inputs import first_foreign_byte, read_input, wide_encoding
from mapfilter._separator_line import without_separator_line
from mapfilter._words import number_of
from mapfilter._zip import ZIP_DAMAGE
from mapfilter.errors import Faults, InputError, MapfilterError, fail
from mapfilter.radio.placemarks import is_kml, kml_in, read_placemarks

_LARGEST_BYTES = 1 << 26
_LARGEST_UNPACKED_BYTES = 1 << 29
MOST_FIELDS = 5_000_000
MOST_COLUMNS = 1000
MOST_TITLES = 10
_SEPARATORS = (",", ";", "\t")
_WIDE_SHARE = 0.4
_WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
"""First bytes of .xlsx and .ods, and of .xls."""
_GZIP = b"\x1f\x8b"
_OTHERS = {"<": "XML that is no KML", "{": "JSON", "[{": "JSON"}
"""How files of other kinds begin, which hold no table of lines."""


@dataclass(frozen=True, slots=True)
class Table:
    """The header and the rows of a file, each row with its line; blank lines are left out.

    ``notes`` say what was assumed to read it; workbooks have no separator.
    """

    path: Path
    separator: str
    header: tuple[str, ...]
    rows: tuple[tuple[int, list[str]], ...]
    notes: tuple[str, ...] = ()

    def number(self, text: str) -> float | None:
        """Return a finite number or None; decimal commas are read where they separate nothing."""
        return number(text, decimal_comma=self.separator != ",")

    def whole_rows(self, columns: int, faults: Faults) -> Iterator[tuple[int, list[str]]]:
        """Yield the rows that have so many fields; the others are faults."""
        for line, texts in self.rows:
            if len(texts) == columns:
                yield line, texts
                continue
            hint = "a decimal comma, or an unquoted separator"
            if len(texts) < columns:
                hint = "the line is cut off"
            faults.add(f"{self.path} row {line}, fields", f"{columns}", f"{len(texts)}", hint)


def number(text: str, *, decimal_comma: bool = False) -> float | None:
    """Return a text as a finite number, or None; digits of other scripts are none.

    Examples
    --------
    >>> number("60.5"), number("60,5"), number("60,5", decimal_comma=True), number("1_0")
    (60.5, None, 60.5, None)
    """
    if decimal_comma and text.count(",") == 1 and "." not in text:
        text = text.replace(",", ".")
    try:
        value = float(text if text.strip().isascii() and "_" not in text else "?")
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def why_no_number(text: str) -> str:
    """Return the likely reason why a text is no number, or "".

    Examples
    --------
    >>> why_no_number("60,5"), why_no_number("5.334.900,5")
    ('a decimal comma', 'marks between thousands; leave them out')
    >>> why_no_number("30 m"), why_no_number("high")
    ('a unit beside the number; leave it out', '')
    """
    if "," in text and text.replace(",", "", 1).lstrip("-").isdigit():
        return "a decimal comma"
    if text.translate(dict.fromkeys(map(ord, " .,'’\u00a0\u202f"))).lstrip("-").isdigit():
        return "marks between thousands; leave them out"
    begins = text.split(maxsplit=1)[0].rstrip(f"°%µ{ascii_letters}") if text.strip() else ""
    return "a unit beside the number; leave it out" if number(begins) is not None else ""


def read_table(path: Path, what: str) -> Table:
    """Read a table whose first line names its columns.

    It may be packed with gzip. Text has commas, semicolons or tabs, and is UTF-8, UTF-16 or UTF-32
    with a byte order mark, or else Windows-1252 (with a note); a first line ``sep=;`` is no header,
    nor are up to ten lines of a title, which fill one field each (with a note). Of a workbook
    (.xlsx, .xls, .ods) the first sheet is read, and of KML or KMZ the placemarks with data.

    Parameters
    ----------
    what : str
        For messages, such as ``"a cell plan"``.

    Raises
    ------
    InputError
        The file is missing, empty, too large or no such table.
    """
    data = read_input(path, _LARGEST_BYTES, what)
    if data.startswith(_GZIP):
        data = _unpacked(path, data, what)
    if data.startswith(b"PK") and (kml := kml_in(path, data, _LARGEST_BYTES)) is not None:
        data = kml
    if data.startswith(_WORKBOOKS):
        return _read_workbook(path, data, what)
    text, notes = _decoded(path, data)
    if is_kml(text):
        return _read_placemarks(path, text, notes, what)
    for mark, kind in _OTHERS.items():
        if text.lstrip().startswith(mark):
            hint = "export the list as CSV or as a workbook, with a row for each cell"
            raise fail(InputError, str(path), f"{what} as a table", kind, hint)
    text = without_separator_line(text)
    heads = [*islice((line for line in text.splitlines() if line.strip()), MOST_TITLES + 1)]
    separator = _separator(heads)
    reader = csv.reader(io.StringIO(text, newline=None), delimiter=separator)
    lines: list[tuple[int, list[str]]] = []
    fields = 0
    try:
        for row in reader:
            if any(field.strip() for field in row):
                lines.append((reader.line_num, row))
                fields += len(row)
                if fields > MOST_FIELDS:
                    raise _too_large(path, what, reader.line_num)
    except csv.Error as error:
        raise fail(InputError, f"{path} row {reader.line_num}", "CSV", error) from error
    if not lines:
        raise fail(InputError, str(path), "a header line and rows", "nothing", "an empty file")
    lines, titles = _without_titles(path, lines)
    notes += titles
    header = tuple(name.strip() for name in lines[0][1])
    if len(header) > MOST_COLUMNS:
        expected = f"{what} of at most {MOST_COLUMNS} columns"
        raise fail(InputError, f"{path}, header", expected, len(header), "another file")
    return Table(path, separator, header, tuple(lines[1:]), notes)


def _unpacked(path: Path, data: bytes, what: str) -> bytes:
    """Return what is packed with gzip, as public lists of cells are."""
    found = bytearray()
    # Lists that were joined, or packed in blocks, are several files one after another.
    while data.startswith(_GZIP):
        unpacker = zlib.decompressobj(wbits=31)
        try:
            found += unpacker.decompress(data, _LARGEST_UNPACKED_BYTES - len(found) + 1)
        except zlib.error as error:
            raise fail(InputError, str(path), "a gzip file", str(error), "damaged") from error
        if len(found) > _LARGEST_UNPACKED_BYTES:
            mib = _LARGEST_UNPACKED_BYTES >> 20
            expected = f"{what} of at most {mib} MiB unpacked"
            raise fail(InputError, str(path), expected, "a larger one")
        if not unpacker.eof:
            raise fail(InputError, str(path), "a whole gzip file", "a part of one", "cut off")
        data = unpacker.unused_data
    return bytes(found)


def _separator(heads: Sequence[str]) -> str:
    """Return what separates the fields of a table with these first lines, or commas."""
    head = next((line for line in heads if any(mark in line for mark in _SEPARATORS)), "")
    separator = max(_SEPARATORS, key=head.count)
    if separator != ",":
        return separator
    # What is no CSV is refused when it is read.
    with suppress(csv.Error):
        if len({len(row) for row in csv.reader(heads)}) == 1:
            return separator
    # The commas may be those of a title above a table with another separator.
    for mark in _SEPARATORS[1:]:
        titles = next((n for n, line in enumerate(heads) if mark in line), 0)
        counts = {line.count(mark) for line in heads[titles:]}
        if titles and len(heads) > titles + 1 and len(counts) == 1 and min(counts) > 1:
            return mark
    return separator


def _without_titles(
    path: Path, lines: list[tuple[int, list[str]]]
) -> tuple[list[tuple[int, list[str]]], tuple[str, ...]]:
    """Leave out lines of one field above the header, with a note."""
    fields = (sum(bool(field.strip()) for field in row) for _, row in lines)
    titles = next((n for n, count in enumerate(fields) if count > 1), 0)
    if not 0 < titles <= MOST_TITLES:
        return lines, ()
    first = next(field.strip() for field in lines[0][1] if field.strip())
    some = number_of(titles, "line")
    return lines[titles:], (f"{path.name}: {some} above the header left out: {first!r}",)


def _too_large(path: Path, what: str, lines: int) -> MapfilterError:
    got = f"more in the first {lines} lines"
    return fail(InputError, str(path), f"{what} of at most 5e6 fields", got)


def _decoded(path: Path, data: bytes) -> tuple[str, tuple[str, ...]]:
    """Return a file's text, and a note where its encoding was assumed."""
    notes: tuple[str, ...] = ()
    wide = wide_encoding(data)
    try:
        text = data.decode(wide or "utf-8-sig")
    except UnicodeDecodeError as error:
        expected = "text in UTF-8, UTF-16, UTF-32 or Windows-1252"
        got = f"other bytes at {error.start}"
        if wide:
            raise fail(InputError, str(path), expected, got, "cut off, or no text file") from error
        try:
            text = data.decode("cp1252")
        except UnicodeDecodeError:
            raise fail(InputError, str(path), expected, got, "no text file") from error
        note = f"no UTF-8 (byte {error.start}); read as Windows-1252"
        if first_foreign_byte(data) < 0:
            text = data.decode("utf-8-sig", "replace")
            note = f"some bytes are not UTF-8 (the first is byte {error.start})"
        notes = (f"{path.name}: {note}",)
    if text.count("\0") > _WIDE_SHARE * len(text):
        got, hint = "UTF-16 text without a byte order mark", "saved as Unicode; save as UTF-8"
        raise fail(InputError, str(path), "text in UTF-8", got, hint)
    if "\0" in text:
        raise fail(InputError, str(path), "text in UTF-8", "NUL characters", "no text file")
    return text, notes


def _read_workbook(path: Path, data: bytes, what: str) -> Table:
    expected, hint = "a workbook that can be read", "cut off, protected by a password, or no table"
    try:
        if data.startswith(b"PK"):
            with zipfile.ZipFile(io.BytesIO(data)) as archive:
                unpacked = sum(member.file_size for member in archive.infolist())
            if unpacked > _LARGEST_UNPACKED_BYTES:
                raise fail(InputError, str(path), expected, f"{unpacked / 2**20:.0f} MB unpacked")
        book = CalamineWorkbook.from_filelike(io.BytesIO(data))
        sheets = book.sheet_names
        cells = book.get_sheet_by_index(0).to_python(skip_empty_area=False) if sheets else []
    except (CalamineError, *ZIP_DAMAGE) as error:
        got = (str(error).splitlines() or [type(error).__name__])[0]
        raise fail(InputError, str(path), expected, got, hint) from error
    texts = ((line, [_text(value) for value in row]) for line, row in enumerate(cells, start=1))
    lines = [(line, row) for line, row in texts if any(row)]
    if not lines:
        raise fail(InputError, str(path), "a header line and rows", "an empty sheet")
    if sum(len(row) for _, row in lines) > MOST_FIELDS:
        raise _too_large(path, what, len(lines))
    others = f"; {len(sheets) - 1} more not read" if len(sheets) > 1 else ""
    note = f"{path.name}: sheet {sheets[0]!r} of a workbook{others}"
    lines, titles = _without_titles(path, lines)
    return Table(path, "", tuple(lines[0][1]), tuple(lines[1:]), (note, *titles))


def _read_placemarks(path: Path, text: str, notes: tuple[str, ...], what: str) -> Table:
    records, told = read_placemarks(path, text)
    header = [*dict.fromkeys(name for record in records for name in record)]
    if len(header) > MOST_COLUMNS:
        expected = f"{what} of at most {MOST_COLUMNS} columns"
        raise fail(InputError, f"{path}, header", expected, len(header), "another file")
    # A few names for each of many placemarks would be too many fields for the memory.
    if len(header) * len(records) > MOST_FIELDS:
        raise _too_large(path, what, len(records))
    rows = ([record.get(name, "") for name in header] for record in records)
    return Table(path, "", tuple(header), tuple(enumerate(rows, start=1)), (*notes, *told))


def _text(value: Any) -> str:
    """Return the value of a cell as a CSV file would have it."""
    if isinstance(value, float) and math.isfinite(value) and value == int(value):
        return str(int(value))
    return str(value).strip()
