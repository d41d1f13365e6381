"""Ends of tables that were cut while they were written or copied: half a number, zero bytes."""

from __future__ import annotations

import re
from collections.abc import Sequence

from mapfilter._words import number_of

_TAIL_BYTES = _HEAD_BYTES = 1 << 16
_LINE_ENDS = (b"\n", b"\r")
_NUMBER = re.compile(rb"\s*([-+]?\d*(?:[.,](\d*))?(?:[eE][-+]?\d+)?)\s*")
_FEW_ROWS, _MANY_ROWS = 5, 20
_SMALLER = 5.0
_NOT_OF_LINES = b"{[<"
"""First characters of JSON and XML, which are whole without a line's end."""


def without_zero_end(data: bytes) -> tuple[bytes, str]:
    r"""Return a text without zero bytes at its end, and a note; "" where there are none.

    File systems leave them where a device stopped while it wrote. The line before them is left out
    where it has no end. Zero bytes elsewhere stay.

    Examples
    --------
    >>> data, note = without_zero_end(b"time_s,step_m\n0,1.4\n1,1.\0\0\0")
    >>> data
    b'time_s,step_m\n0,1.4\n'
    >>> note
    '3 zero bytes at the end (line 3) left out, with the unfinished row before them'
    """
    kept = data.rstrip(b"\0")
    zeros = len(data) - len(kept)
    if not zeros:
        return data, ""
    line = (kept.count(b"\n") or kept.count(b"\r")) + 1
    note = f"{number_of(zeros, 'zero byte')} at the end (line {line}) left out"
    if kept and not kept.endswith(_LINE_ENDS) and kept.lstrip()[:1] not in _NOT_OF_LINES:
        kept = kept[: _last_line(kept)]
        note += ", with the unfinished row before them"
    return kept, note


def without_cut_row(data: bytes, separator: str, first: int = 0) -> tuple[bytes, str]:
    r"""Return a table without its last row where that was cut off, and how; "" where it is whole.

    Many programs write no end of the last line. It was cut off only where it also has fewer fields
    than any other row, or its last number fewer decimals; a whole number is cut off where it is
    far smaller than all others.

    Parameters
    ----------
    first : int
        Where the rows begin, below the header.

    Examples
    --------
    >>> rows = b"".join(b"%d,385400.%02d\n" % (n, n + 10) for n in range(30))
    >>> without_cut_row(rows + b"30,38", ",")[1]
    'cut off within its last number (38, without a line end)'
    >>> without_cut_row(rows + b"30,385400.40", ",")[1]
    ''
    """
    start = _last_line(data)
    last = data[start:]
    tail = data[max(start - _TAIL_BYTES, first) : max(start, first)].splitlines()
    # The first line of a part is none as a whole.
    others = [line for line in tail[start - first > _TAIL_BYTES :] if line.strip()]
    if not last or not others or b'"' in last:
        return data, ""
    mark = separator.encode()
    fields = last.count(mark)
    if fields < min(line.count(mark) for line in others):
        return data[:start], "cut off within the row (without a line end)"
    ends = [line.rpartition(mark)[2] for line in others if line.count(mark) == fields]
    number = last.rpartition(mark)[2]
    if not _is_cut(number, ends):
        return data, ""
    shown = number.decode("ascii", "replace").strip() or "nothing"
    return data[:start], f"cut off within its last number ({shown}, without a line end)"


def header_end(data: bytes, separators: Sequence[str]) -> tuple[str, int]:
    r"""Return the separator of a table's header, and where the rows below it begin.

    The header is the first line that is neither blank nor Excel's ``sep=;``.

    Examples
    --------
    >>> header_end(b"sep=;\n\na;b\n1;2", (",", ";"))
    (';', 11)
    """
    at = 0
    for line in data.splitlines(keepends=True):
        at += len(line)
        if line.strip() and not line.lstrip(b'\xef\xbb\xbf"').lower().startswith(b"sep="):
            return max(separators, key=lambda mark: line.count(mark.encode())), at
    return separators[0], at


def without_cut_end(data: bytes, separators: Sequence[str], where: str) -> tuple[bytes, list[str]]:
    """Return a table without zero bytes at its end and a row that was cut off, with notes.

    Parameters
    ----------
    where : str
        Name of the file in notes.
    """
    data, zeros = without_zero_end(data)
    notes = [f"{where}: {zeros}"] if zeros else []
    separator, begin = header_end(data[:_HEAD_BYTES], separators)
    data, cut = without_cut_row(data, separator, begin)
    if cut:
        ends = data.count(b"\n") or data.count(b"\r")
        notes.append(f"{where} row {ends + 1}: {cut}, left out")
    return data, notes


def _last_line(data: bytes) -> int:
    """Return where the last line begins."""
    return max(data.rfind(end) for end in _LINE_ENDS) + 1


def _is_cut(last: bytes, others: Sequence[bytes]) -> bool:
    """Return whether a number is most likely the beginning of one like the others.

    A number loses its decimals first. Of N rows in any order, the last one alone has the fewest in
    at most one of N files.
    """
    given = [text for text in others if text.strip()]
    known = [number for text in given if (number := _NUMBER.fullmatch(text))]
    found = _NUMBER.fullmatch(last)
    if found is None or len(known) < max(len(given), _FEW_ROWS):
        return False
    if not last.strip() and len(given) < len(others):
        return False
    many = len(known) >= _MANY_ROWS
    decimals = {len(number[2] or b"") for number in known}
    digits = len(found[2] or b"")
    value = _magnitude(found[1])
    # Writers of as few digits as possible write 0 for 0.00.
    if value != 0.0 or len(decimals) == 1:
        least = min(decimals)
        if digits <= least - (1 if many else 2):
            return True
    if digits or not many or value == 0.0:
        return False
    return value is None or value * _SMALLER < min(_magnitude(number[1]) or 0.0 for number in known)


def _magnitude(number: bytes) -> float | None:
    """Return the absolute value of a number; None where it has no digits."""
    try:
        return abs(float(number.replace(b",", b".")))
    except ValueError:
        return None
