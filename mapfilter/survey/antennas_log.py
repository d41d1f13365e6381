"""Logs of *Antennas*: records of a serving cell, its neighbours and one position."""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import datetime, timedelta
from pathlib import Path

from mapfilter.survey.measurement_lines import lines_of
from mapfilter.survey.measurement_rows import FIELDS, Rows

_KEY = re.compile(r'(\w[\w ]{0,31}+)=\s{0,9}("[^"]{0,4000}"|[^,]{0,4000})')
_LEVEL = re.compile(r"^(>?)\s*(-?\d+)\s*dBm$")


def read_antennas_log(path: Path) -> Rows:
    """Read a log of *Antennas*: records of a serving cell, up to six neighbours, and one position.

    A level written with ``>`` is a bound, no level: it is counted and left out.
    """
    rows = Rows(path)
    time, operator = "", ""
    received: list[tuple[int, dict[str, str]]] = []

    def drop_unplaced() -> None:
        for at, _ in received:
            rows.refuse(at, "Best Location", "a position after the cells", "none", "cut off")
        received.clear()

    for line, text in lines_of(path):
        kind, pairs = (text or "").split(",", 1)[0].strip(), _KEY.findall(text or "")
        values = {key.strip(): value.strip(' "\r\n') for key, value in pairs}
        if kind == "Record":
            drop_unplaced()
            time, operator = values.get("Time", ""), values.get("Operator", "")
        elif kind in ("ACTIVE GSM", "GSM"):
            rows.read += 1
            received.append((line, values | {"neighbour": "0" if kind == "ACTIVE GSM" else "1"}))
        elif kind == "Best Location":
            found = dict.fromkeys(FIELDS, "") | {"time": _iso(time)}
            found |= {"lat": values.get("Lat", ""), "lon": values.get("Lon", "")}
            for at, cell in received:
                _add_logged(rows, at, cell, operator, found)
            received.clear()
    drop_unplaced()
    rows.finish()
    return rows


def _add_logged(
    rows: Rows, line: int, cell: dict[str, str], operator: str, found: Mapping[str, str]
) -> None:
    texts = (operator[:3], operator[3:], cell.get("LAC", ""), cell.get("CID", ""))
    name, signal = rows.identify(line, "", texts), cell.get("Signal", "")
    level = _LEVEL.match(signal)
    if name and level is None:
        rows.refuse(line, "Signal", "a level such as -67dBm", repr(signal[:40]))
    elif name and level is not None and level[1]:
        rows.aside["levels given only as bounds (>)"] += 1
    elif name and level is not None:
        neighbour = cell["neighbour"]
        rows.technologies[name, "GSM"] += 1
        rows.add(line, name, {**found, "level_dbm": level[2], "neighbour": neighbour})


def _iso(time: str) -> str:
    """Return a time such as ``2014-09-24 19:21:42:61 GMT+05:30`` in ISO 8601, else as it is."""
    text = re.sub(r":(\d{1,3}) GMT", lambda found: f".{found[1]:0>3} ", time)
    plain = text.replace(":60.", ":59.")
    try:
        moment = datetime.strptime(plain, "%Y-%m-%d %H:%M:%S.%f %z")
    except ValueError:
        return time
    # A leap second is the first one of the next minute.
    return (moment + timedelta(seconds=plain != text)).isoformat()
