"""Rows of one measurement file, and the faults of those that are refused; all readers end here."""

from __future__ import annotations

import math
from array import array
from collections import Counter
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TextIO

from mapfilter.errors import Fault, InputError, fail
from mapfilter.radio.cell_rules import id_fault

_FAULTS_KEPT = 20
_FAULTS_SHOWN = 3
_LATEST_S = 4_102_444_800.0
_UNAVAILABLE = 2_000_000_000.0
_LEVEL_DBM = (-170.0, -10.0)

Identity = tuple[int, int, int, int]
"""mcc, mnc, lac (tac in LTE) and ci."""


@dataclass(slots=True)
class Rows:
    """Good rows as columns, the faults of bad ones, and counts of what is set aside.

    Positions are degrees (WGS 84), times Unix seconds (NaN where unknown), accuracies metres (NaN
    where unknown). ``cell`` and ``session`` are numbers given in ``cells`` and ``sessions``.
    """

    path: Path
    read: int = 0
    cells: dict[str, int] = field(default_factory=dict)
    sessions: dict[str, int] = field(default_factory=dict)
    cell: array[int] = field(default_factory=lambda: array("i"))
    session: array[int] = field(default_factory=lambda: array("i"))
    time_s: array[float] = field(default_factory=lambda: array("d"))
    lat_deg: array[float] = field(default_factory=lambda: array("d"))
    lon_deg: array[float] = field(default_factory=lambda: array("d"))
    level_dbm: array[float] = field(default_factory=lambda: array("d"))
    accuracy_m: array[float] = field(default_factory=lambda: array("d"))
    identities: dict[str, Identity] = field(default_factory=dict)
    refused: int = 0
    faults: list[Fault] = field(default_factory=list)
    aside: Counter[str] = field(default_factory=Counter)

    def refuse(self, line: int, name: str, expected: str, got: object, hint: str = "") -> None:
        """Count a bad row and keep the faults of the first ones."""
        self.refused += 1
        if len(self.faults) < _FAULTS_KEPT:
            self.faults.append(Fault(f"{self.path} row {line}, {name}", expected, str(got), hint))

    def add(
        self,
        line: int,
        cell: str,
        place: tuple[str, str],
        level: str,
        *,
        time: str = "",
        accuracy: str = "",
        session: str = "",
    ) -> None:
        """Check one row given as texts, and keep it or refuse it.

        ``place`` is latitude and longitude. A time or accuracy that makes no sense becomes
        unknown: the level is as good without.
        """
        if cell not in self.cells and (wrong := id_fault(cell)) is not None:
            self.refuse(line, "cell", *wrong)
            return
        lat_deg, lon_deg, level_dbm = number(place[0]), number(place[1]), number(level)
        named = ("lat", place[0], lat_deg), ("lon", place[1], lon_deg)
        for name, text, value in (*named, ("level_dbm", level, level_dbm)):
            if not math.isfinite(value):
                self.refuse(line, name, "a number", repr(text[:40]) if text else "nothing")
                return
        if (misplaced := place_fault(lat_deg, lon_deg)) is not None:
            self.refuse(line, "lat, lon", *misplaced)
            return
        if not _LEVEL_DBM[0] <= level_dbm <= _LEVEL_DBM[1]:
            expected = f"dBm in {_LEVEL_DBM[0]:g}..{_LEVEL_DBM[1]:g}"
            hint = "RXLEV or ASU given for dBm" if 0 <= level_dbm <= 97 else ""
            if abs(level_dbm) >= _UNAVAILABLE:
                hint = "the marker of a level that was not available"
            self.refuse(line, "level_dbm", expected, level[:40], hint)
            return
        time_s, accuracy_m = unix_seconds(time), number(accuracy)
        if time and math.isnan(time_s):
            self.aside["times not understood (levels kept)"] += 1
        self.cell.append(self.cells.setdefault(cell, len(self.cells)))
        self.session.append(self.sessions.setdefault(session, len(self.sessions)))
        self.time_s.append(time_s)
        self.lat_deg.append(lat_deg)
        self.lon_deg.append(lon_deg)
        self.level_dbm.append(level_dbm)
        self.accuracy_m.append(accuracy_m if 0 < accuracy_m < _UNAVAILABLE else math.nan)

    def notes(self) -> list[str]:
        """Return remarks on how many rows were refused or set aside, and where the first are."""
        found = []
        if self.refused:
            some = "; ".join(str(fault) for fault in self.faults[:_FAULTS_SHOWN])
            more = "; …" if self.refused > _FAULTS_SHOWN else ""
            found.append(
                f"{self.path.name}: {self.refused} of {self.read} rows left out: {some}{more}"
            )
        return found + [f"{self.path.name}: {count} {what}" for what, count in self.aside.items()]


def number(text: str) -> float:
    """Return a number, or NaN when the text is none.

    Examples
    --------
    >>> number("-71.5"), number("1_0"), number("")
    (-71.5, nan, nan)
    """
    try:
        return float("" if "_" in text else text)
    except ValueError:
        return math.nan


def whole(text: str) -> int | None:
    """Return a whole number ≥ 0 that is no marker of an unavailable value, else None."""
    value = number(text)
    if not (0 <= value < 2**36) or value != int(value) or value == 2**31 - 1:
        return None
    return int(value)


def unix_seconds(text: str) -> float:
    """Return Unix seconds of an ISO 8601 time (UTC by default) or of s, ms or µs; else NaN.

    Examples
    --------
    >>> unix_seconds("1599319703000"), unix_seconds("2020-09-05T15:28:23Z")
    (1599319703.0, 1599319703.0)
    """
    value = number(text)
    if math.isfinite(value):
        scale = 1e6 if value > 1e14 else 1e3 if value > 1e11 else 1.0
        return value / scale if 0 < value / scale < _LATEST_S else math.nan
    try:
        moment = datetime.fromisoformat(text)
        aware = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
        seconds = aware.timestamp()
    except (ValueError, OverflowError):
        return math.nan
    return seconds if 0 < seconds < _LATEST_S else math.nan


def place_fault(lat_deg: float, lon_deg: float) -> tuple[str, str, str] | None:
    """Return (expected, found, likely mistake) when a position is none, else None."""
    got = f"{lat_deg:g}, {lon_deg:g}"
    expected = "degrees in -90..90 and -180..180"
    if abs(lat_deg) > 180 or abs(lon_deg) > 180:
        return expected, got, "metres given for degrees"
    if abs(lat_deg) > 90:
        return expected, got, "latitude and longitude swapped"
    if lat_deg == 0 and lon_deg == 0:
        return "a position", got, "no fix yet"
    return None


def open_text(path: Path) -> TextIO:
    """Open a file as text in which a wrong byte spoils only its own row."""
    try:
        with path.open("rb") as stream:
            head = stream.read(2)
    except OSError as error:
        raise fail(InputError, str(path), "a readable file", error.strerror or error) from error
    if not head:
        raise fail(InputError, str(path), "measurements", "an empty file")
    if head in (b"\xff\xfe", b"\xfe\xff"):
        raise fail(InputError, str(path), "text in UTF-8", "UTF-16", "saved as Unicode by Excel")
    if head == b"\x1f\x8b":
        raise fail(InputError, str(path), "text", "a gzip file", "unpack it first")
    return path.open(encoding="utf-8-sig", errors="replace")
