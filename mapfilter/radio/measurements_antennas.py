"""Measured levels from the text log of the Android app *Antennas*: serving cell and neighbours."""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

from mapfilter.radio._measurement_rows import Identity, Rows, open_text, whole

FIRST_WORD = "BEGIN"
"""How a log begins."""
_LONGEST_LINE = 4096
_KEY = re.compile(r'(\w[\w ]*)=\s*("[^"]*"|[^,]*)')
_LEVEL = re.compile(r"^(>?)\s*(-?\d+)\s*dBm$")


def read_antennas_log(path: Path) -> Rows:
    """Read a log: each record has a serving cell, up to six neighbours, and one position.

    A level written with ``>`` is a bound, no level: it is counted and left out.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    rows = Rows(path)
    time, operator = "", ""
    heard: list[tuple[int, dict[str, str]]] = []
    with open_text(path) as stream:
        line = 0
        while text := stream.readline(_LONGEST_LINE):
            line += 1
            kind = text.split(",", 1)[0].strip()
            values = {key.strip(): value.strip(' "\r\n') for key, value in _KEY.findall(text)}
            if kind == "Record":
                _unplaced(rows, heard)
                time, operator, heard = values.get("Time", ""), values.get("Operator", ""), []
            elif kind == "ACTIVE GSM" or kind == "GSM":
                rows.read += 1
                heard.append((line, values))
            elif kind == "Best Location":
                place = values.get("Lat", ""), values.get("Lon", "")
                for cell_line, cell in heard:
                    _add(rows, cell_line, cell, place, _iso(time), operator)
                heard = []
    _unplaced(rows, heard)
    return rows


def _add(
    rows: Rows, line: int, cell: dict[str, str], place: tuple[str, str], time: str, operator: str
) -> None:
    parts = (whole(operator[:3]), whole(operator[3:]), whole(cell.get("LAC", "")),
             whole(cell.get("CID", "")))  # fmt: skip
    mcc, mnc, lac, ci = parts
    if mcc is None or mnc is None or lac is None or ci is None:
        rows.aside["rows of cells without identity"] += 1
        return
    found = _LEVEL.match(cell.get("Signal", ""))
    if found is None:
        rows.refuse(line, "Signal", "a level such as -67dBm", repr(cell.get("Signal", "")[:40]))
        return
    if found[1]:
        rows.aside["levels that are only bounds (>)"] += 1
        return
    identity: Identity = (mcc, mnc, lac, ci)
    name = "-".join(map(str, identity))
    rows.identities.setdefault(name, identity)
    rows.add(line, name, place, found[2], time=time)


def _unplaced(rows: Rows, heard: list[tuple[int, dict[str, str]]]) -> None:
    for line, _ in heard:
        rows.refuse(line, "Best Location", "a position after the cells", "none", "the log cut off")


def _iso(time: str) -> str:
    """Return a time such as ``2014-09-24 19:21:42:61 GMT+05:30`` in ISO 8601, else ''."""
    text = re.sub(r":(\d{1,3}) GMT", lambda found: f".{found[1]:0>3} ", time)
    try:
        return datetime.strptime(text, "%Y-%m-%d %H:%M:%S.%f %z").isoformat()
    except ValueError:
        return time
