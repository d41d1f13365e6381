"""RINEX 2 and 3: broadcast ephemerides, and coefficients of the ionosphere."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from mapfilter._constants import DAY_S
from mapfilter._words import number_of
from mapfilter.clocks.times import utc_from_gps_s
from mapfilter.gnss.almanacs import WEEK_S
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.rinex import (
    Lines,
    fixed_number,
    gps_seconds,
    read_header,
    rinex_kind,
)
from mapfilter.tracks.readers.texts.text import Text

_ELEMENTS = (
    *("iode", "crs", "delta_n", "m0"),
    *("cuc", "eccentricity", "cus", "sqrt_a"),
    *("toe", "cic", "omega0", "cis"),
    *("i0", "crc", "omega", "omega_dot"),
    *("idot", "codes", "week", "flag"),
    *("accuracy", "health", "tgd", "iodc"),
)
_KEPT = (
    *("crs", "delta_n", "m0", "cuc", "eccentricity", "cus", "sqrt_a", "cic", "omega0", "cis"),
    *("i0", "crc", "omega", "omega_dot", "idot", "health", "tgd"),
)


def _is_navigation(text: Text) -> bool:
    return rinex_kind(text) in ("N", "E", "G")


def _read_navigation(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    lines = Lines(text.data)
    header = read_header(lines, reading)
    reading.clock = Clock("gps")
    _add_ionosphere(header, reading)
    version = fixed_number(header.get("RINEX VERSION / TYPE", [""])[0][:9])
    first = 4 if version >= 3 else 3
    blocks: list[tuple[int, list[str]]] = []
    for line in lines:
        if not line.strip():
            continue
        reading.rows += 1
        # A message begins with a satellite where its other lines are blank.
        if line[:first].strip():
            blocks.append((lines.at, [line]))
        elif blocks:
            blocks[-1][1].append(line)
    rows, numbers, other = [], [], 0
    for number, block in blocks:
        name = block[0][:3].strip() if version >= 3 else f"G{block[0][:2].strip():0>2}"
        name = name.replace(" ", "0")
        if re.fullmatch(r"[RSI]\d\d", name):
            other += 1
            continue
        row = _message(name, block, first)
        if row is None:
            reading.refuse(number, "ephemeris: cut off, or no number where one should be")
            continue
        rows.append(row)
        numbers.append(number)
    if other:
        systems = "GLONASS, SBAS or NavIC"
        some = number_of(other, f"message of {systems} is", f"messages of {systems} are")
        reading.note(f"{some} not used")
    if rows:
        columns: dict[str, Any] = {name: [row[name] for row in rows] for name in rows[0]}
        reading.add("ephemerides", columns, numbers)


def _add_ionosphere(header: dict[str, list[str]], reading: Reading) -> None:
    """Add the coefficients of the ionosphere that a header has."""
    found: dict[str, list[float]] = {}
    for name, label, key in (("alpha", "ION ALPHA", "GPSA"), ("beta", "ION BETA", "GPSB")):
        lines = [line[2:50] for line in header.get(label, [])]
        lines += [line[5:53] for line in header.get("IONOSPHERIC CORR", []) if line[:4] == key]
        if lines:
            found[name] = [fixed_number(lines[0][12 * i : 12 * i + 12]) for i in range(4)]
    if len(found) == 2:
        columns = {f"{name}{i}": [values[i]] for name, values in found.items() for i in range(4)}
        if np.isfinite(list(columns.values())).all():
            reading.add("ionosphere", columns, [1])


def _message(name: str, block: Sequence[str], first: int) -> dict[str, Any] | None:
    """Return the elements of one satellite, None where they are not complete."""
    if not re.fullmatch(r"[GEJC]\d\d", name) or len(block) < 7:
        return None
    toc = gps_seconds(block[0][first - 1 : first + 19].split())
    clock = [fixed_number(block[0][first + 19 + 19 * i :][:19]) for i in range(3)]
    values = [fixed_number(line[first + 19 * i :][:19]) for line in block[1:7] for i in range(4)]
    found = dict(zip(_ELEMENTS, values, strict=True))
    week = found["week"]
    if name[0] == "C":
        # BeiDou's weeks count from 2006, its seconds are 14 behind.
        week, found["toe"], toc = week + 1356, found["toe"] + 14.0, toc + 14.0
    if not np.isfinite(week):
        return None
    # Weeks may be counted modulo 1024: the one nearest the clock's time is meant.
    toe = week * WEEK_S + found["toe"]
    turns = np.round((toc - toe) / (1024 * WEEK_S)) if np.isfinite(toc + toe) else 0.0
    toe += turns * 1024 * WEEK_S
    if not abs(toe - toc) < DAY_S:
        return None
    kept = {key: found[key] for key in _KEPT}
    clocks = dict(zip(("af0", "af1", "af2"), clock, strict=True))
    time_s = float(utc_from_gps_s(toc))
    return {"time_s": time_s, "satellite": name, "toc_s": toc, "toe_s": toe, **clocks, **kept}


FORMAT = Format(
    "rinex-nav",
    "a RINEX navigation file",
    "GNSS receivers, IGS (RINEX 2 and 3)",
    "broadcast ephemerides of GPS, Galileo, QZSS and BeiDou, to place satellites of the others",
    _is_navigation,
    _read_navigation,
)
