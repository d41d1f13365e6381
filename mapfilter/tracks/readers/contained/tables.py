"""Records as the text of a CSV, which the readers of CSV read."""

from __future__ import annotations

import csv
import io
from array import array
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from mapfilter._words import number_of
from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.texts.text import Text

KeyPath = tuple[str, ...]
"""Names from the outermost object to a value."""
MOST_VALUES = 50_000_000
"""Of a table, blank ones included."""
MOST_LETTERS = 1 << 30
MOST_COLUMNS = 1000
"""Of records, each of which may have names of its own."""
A_TABLE = "a table of at most 5e7 values and 1 GiB of texts"
_BETWEEN = "\x1f"
"""What keeps the values of a record apart, which no text has."""
SMALLER = "export the positions and cells alone, or parts of the journey"


def as_table(text: Text, header: Sequence[str], rows: Iterable[Sequence[str]], what: str) -> Text:
    """Return a text of CSV with a note on what its lines are of.

    Parameters
    ----------
    text : Text
        The file.
    header : sequence of str
    rows : iterable of sequence of str
    what : str
        What each row was, such as "JSON: 1 record".

    Raises
    ------
    InputError
        The table is too large: a small file may hold one.
    """
    held = io.BytesIO()
    # JSON may have halves of letters, which UTF-8 has not.
    stream = io.TextIOWrapper(held, "utf-8", "replace", newline="")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([_on_a_line(name) for name in header])
    count = letters = 0
    for row in rows:
        writer.writerow([_on_a_line(value) for value in row])
        count += 1
        letters += sum(map(len, row))
        if count * len(header) > MOST_VALUES or letters > MOST_LETTERS:
            raise fail(InputError, str(text.path), A_TABLE, "a larger one", SMALLER)
    note = f"{what} read as a table of {number_of(count, 'row')} (lines 2, 3, …)"
    stream.flush()
    notes = (*text.notes, note)
    return replace(text, data=held.getvalue(), notes=notes, line=1, made_of=what)


def names_of(paths: Sequence[KeyPath]) -> dict[KeyPath, str]:
    """Return names of columns: the last names of paths, all names where several end alike.

    Examples
    --------
    >>> list(names_of([("time",), ("gps", "lat"), ("a", "x"), ("b", "x")]).values())
    ['time', 'lat', 'a.x', 'b.x']
    """
    count = Counter(path[-1].lower() for path in paths)
    return {path: path[-1] if count[path[-1].lower()] == 1 else ".".join(path) for path in paths}


class PackedRecords:
    """Records of values by their paths, in little more memory than their texts."""

    def __init__(self) -> None:
        self._known: dict[tuple[KeyPath, ...], int] = {}
        self._kinds: array[int] = array("L")
        self._texts = io.BytesIO()
        self.values = 0

    def __len__(self) -> int:
        return len(self._kinds)

    def add(self, record: Mapping[KeyPath, str]) -> None:
        """Keep a record; line breaks and separators within its texts become blanks."""
        paths = tuple(record)
        self._kinds.append(self._known.setdefault(paths, len(self._known)))
        texts = (_on_a_line(value).replace(_BETWEEN, " ") for value in record.values())
        self._texts.write(f"{_BETWEEN.join(texts)}\n".encode("utf-8", "replace"))
        self.values += len(paths)

    @property
    def paths(self) -> list[KeyPath]:
        """All paths, in the order in which they came."""
        return list(dict.fromkeys(path for paths in self._known for path in paths))

    def rows(self) -> Iterator[list[str]]:
        """Yield the values of each record by :attr:`paths`, "" where it has none."""
        place = {path: at for at, path in enumerate(self.paths)}
        places = [[place[path] for path in paths] for paths in self._known]
        self._texts.seek(0)
        for kind, line in zip(self._kinds, self._texts, strict=True):
            row = [""] * len(place)
            for at, text in zip(places[kind], line[:-1].decode().split(_BETWEEN), strict=False):
                row[at] = text
            yield row


def table_of_records(
    text: Text, records: Sequence[Mapping[KeyPath, str]] | PackedRecords, what: str
) -> Text:
    """Return records of values by their paths as a text of CSV; see :func:`as_table`."""
    if not isinstance(records, PackedRecords):
        packed = PackedRecords()
        for record in records:
            packed.add(record)
        records = packed
    paths = records.paths
    if len(paths) > MOST_COLUMNS:
        expected, got = f"at most {MOST_COLUMNS} different names of values", f"{len(paths)}"
        raise fail(InputError, str(text.path), expected, got, SMALLER)
    names = names_of(paths)
    return as_table(text, [names[path] for path in paths], records.rows(), what)


def written(value: Any) -> str:
    """Return a value of JSON, or of a layer, as a CSV has it.

    Examples
    --------
    >>> written(True), written(None), written(60.5), written(7)
    ('true', '', '60.5', '7')
    """
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value)


def _on_a_line(value: str) -> str:
    return value.replace("\n", " ").replace("\r", " ")
