"""Files of which each line names its kind: its lines by kind."""

from __future__ import annotations

from collections.abc import Callable

from mapfilter._words import number_of
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.separated_values import line_columns

Groups = dict[str, tuple[list[bytes], list[int]]]


def group_lines(
    data: bytes, reading: Reading, kind_of: Callable[[bytes], bytes], known: frozenset[str]
) -> Groups:
    """Return the lines of each known kind, and their numbers; count and note those of others.

    ``kind_of`` returns the kind of a line, b"" for one to be skipped.
    """
    groups: Groups = {}
    others: dict[str, int] = {}
    for number, line in enumerate(data.split(b"\n"), start=1):
        if not line.strip():
            continue
        kind = kind_of(line).decode("utf-8", "replace")
        if not kind:
            continue
        if kind in known:
            lines, numbers = groups.setdefault(kind, ([], []))
            lines.append(line)
            numbers.append(number)
            continue
        reading.rows += 1
        if kind.replace("_", "").isalnum() and len(kind) < 50:
            others[kind] = others.get(kind, 0) + 1
        else:
            reading.refuse(number, "no line of this format")
    for kind, count in sorted(others.items())[:20]:
        reading.note(f"{number_of(count, f'row of {kind!r} is', f'rows of {kind!r} are')} not used")
    return groups


def columns_of(
    groups: Groups,
    kind: str,
    names: str,
    separator: str,
    reading: Reading,
    *,
    least: int = 0,
) -> Columns | None:
    """Return the columns of one kind, ``names`` with blanks between; None without rows of it.

    ``least`` is how many fields a line must have, all by default.
    """
    if kind not in groups:
        return None
    lines, numbers = groups[kind]
    return line_columns(lines, numbers, reading, names.split(), separator, ragged=least)
