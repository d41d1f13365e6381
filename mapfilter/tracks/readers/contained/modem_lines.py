"""Cells of a modem's replies (``AT+QENG`` of Quectel) in a log whose lines begin with a time."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from itertools import islice

from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.contained.tables import as_table
from mapfilter.tracks.readers.texts.text import Text

MARK = "+QENG:"
_AT = re.compile(r"\bAT\+\w{2,12}|^\+\w{2,12}: ", re.MULTILINE)
_TIME = re.compile(
    r"[\[(]?\s{0,20}(\d{4}-\d\d-\d\d[ T_]\d\d:\d\d:\d\d(?:[.,]\d{1,9})?(?:Z|[+-]\d\d:?\d\d)?"
    r"|\d{1,2}[./]\d{1,2}[./]\d{4},? \d\d:\d\d:\d\d(?:[.,]\d{1,9})?|\d{10}(?:\.\d{1,9})?|\d{13})\b"
)
_COLUMNS = ("time", "role", "technology", "mcc", "mnc", "lac", "ci", "bsic", "arfcn", "level_dbm")
_EXPECTED = (
    "replies to AT+QENG (Quectel) in lines that begin with a date and a time, or a Unix time"
)
_LEAST = {"LTE": 12, "NR5G-SA": 11}
"""Technologies of serving cells, and the fields of each up to its RSRP."""
_STATES = ("SEARCH", "LIMSRV", "NOCONN", "CONNECT")


def is_modem_log(text: Text) -> bool:
    """Return whether a text is a log of a modem's commands and replies."""
    head = "\n".join(islice(text.head, 60))
    return MARK in head or len(_AT.findall(head)) > 1


def modem_table(text: Text) -> Text:
    """Return the cells of a modem's log as a text of CSV; a line's time is that of its reply.

    A line without a time has that of the last one that began with a time.

    Raises
    ------
    InputError
        There are no such replies, or no times.
    """
    lines = text.data.decode("utf-8", "replace").splitlines()
    if not any(MARK in line for line in lines):
        hint = "replies to other commands are not read: log AT+QENG, or write CSV of time, mcc, …"
        raise fail(InputError, str(text.path), _EXPECTED, "a modem's log without any", hint)
    rows = list(_rows(lines))
    if not rows:
        first = next(line for line in lines if MARK in line)
        hint = "write date and time before each line"
        raise fail(InputError, str(text.path), _EXPECTED, repr(first[:40]), hint)
    return as_table(text, _COLUMNS, rows, "replies of a modem to AT+QENG")


def _rows(lines: list[str]) -> Iterator[list[str]]:
    time = ""
    for line in lines:
        if found := _TIME.match(line.strip()):
            time = found[1]
        _, mark, reply = line.partition(MARK)
        if not (mark and time):
            continue
        if cell := _cell(_values(reply)):
            yield [time, *cell]


def _values(reply: str) -> list[str]:
    """Return the values of a reply; none where it is damaged."""
    try:
        values = next(csv.reader([reply.strip()], skipinitialspace=True), [])
    except csv.Error:
        return []
    return [one.strip() for one in values]


def _cell(values: list[str]) -> list[str]:
    """Return the columns of a cell; none where a reply is of another kind, or is cut off."""
    kind = values[0] if values else ""
    # The state of the modem stands in some replies, and in others in a line of its own.
    rest = [one for one in values[1:] if one not in _STATES] if kind == "servingcell" else values
    if kind in ("LTE", "NR5G-SA"):
        rest = values
    if kind.startswith("neighbourcell") and len(values) >= 6 and values[1] == "LTE":
        arfcn, pci, _, rsrp = values[2:6]
        return ["neighbour", "LTE", "", "", "", "", pci, arfcn, _level(rsrp)]
    if not rest or rest[0] not in _LEAST or len(rest) < _LEAST[rest[0]]:
        return []
    technology = "LTE" if rest[0] == "LTE" else "NR"
    mcc, mnc, ci, pci = rest[2:6]
    if technology == "LTE":
        arfcn, tac, rsrp = rest[6], rest[10], rest[11]
    else:
        tac, arfcn, rsrp = rest[6], rest[7], rest[10]
    try:
        identity = [str(int(tac, 16)), str(int(ci, 16))]
    except ValueError:
        return []
    return ["serving", technology, mcc, mnc, *identity, pci, arfcn, _level(rsrp)]


def _level(text: str) -> str:
    return "" if text in ("-", "-32768") else text
