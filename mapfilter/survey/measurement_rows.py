"""Rows of measured levels: checked one by one, and kept as columns, refused or set aside."""

from __future__ import annotations

import math
from array import array
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np

from mapfilter._types import Floats
from mapfilter._words import counted, number_of
from mapfilter.clocks.time_hints import hint_on_time
from mapfilter.degrees import degree_fault
from mapfilter.errors import Fault, InputError
from mapfilter.radio.asu import LARGEST_ASU, LOST_SIGN, is_above_asu
from mapfilter.radio.cell_rules import RANGES, id_fault
from mapfilter.radio.identities import IDENTITY
from mapfilter.radio.tables import number
from mapfilter.survey.measurement_times import WaitingTimes

_FAULTS_KEPT = 20
_FAULTS_SHOWN = 3
_UNAVAILABLE = 2_000_000_000.0
_LEVEL_DBM = (-170.0, -10.0)
_PARTS = 7
_MOST_STEPS = 3846.0
"""Timing advances: of NR 0 to 3846, fewer of older technologies."""
_YES = ("1", "true", "yes", "neighbour", "neighbor")
_NO = ("0", "false", "no", "serving")
REQUIRED = ("lat", "lon", "level_dbm")
"""Fields without which a row is of no use."""
FIELDS = (
    *("cell", *IDENTITY, *REQUIRED, "time", "accuracy_m", "session"),
    *("timing_advance", "neighbour", "arfcn", "bsic"),
)
"""Fields that a column map may name."""

NO_TIME = "times not understood (levels kept)"
NO_CODE = "carriers or codes that are not possible (levels kept)"
_TIMES = "expected ISO 8601 (2026-05-01T10:00:00+02:00), 31.12.2026 10:00:00 or Unix s, ms or µs"


class NotMeasurementsError(InputError):
    """A file is no drive test: a text, or a recording without cells."""


Identity = tuple[int, int, int, int]
"""mcc, mnc, lac (tac in LTE) and ci."""
Code = tuple[int, int]
"""Carrier and code (BSIC, PSC or PCI), by which reports name neighbours."""

_ToldT = TypeVar("_ToldT", str, Code)


@dataclass(slots=True)
class Rows:
    """Good rows as columns, the faults of bad ones, and counts of what is set aside.

    ``cell`` and ``session`` are numbers given in ``cells`` and ``sessions``; ``technologies`` and
    ``codes`` count how often cells have been GSM, UMTS, LTE or NR, and had a carrier and code
    (:func:`most_frequent`); ``identified`` is the cell of identities that were looked at before,
    ``odd_time`` the first time not understood; ``remarks`` are on the file as a whole. Times that
    are no numbers are those of ``waiting`` until :meth:`finish`.
    """

    path: Path
    read: int = 0
    cells: dict[str, int] = field(default_factory=dict)
    sessions: dict[str, int] = field(default_factory=dict)
    cell: array[int] = field(default_factory=lambda: array("i"))
    session: array[int] = field(default_factory=lambda: array("i"))
    values: array[float] = field(default_factory=lambda: array("d"))
    identities: dict[str, Identity] = field(default_factory=dict)
    technologies: Counter[tuple[str, str]] = field(default_factory=Counter)
    codes: Counter[tuple[str, Code]] = field(default_factory=Counter)
    identified: dict[tuple[str, ...], str] = field(default_factory=dict)
    refused: int = 0
    faults: list[Fault] = field(default_factory=list)
    aside: Counter[str] = field(default_factory=Counter)
    odd_time: str = ""
    remarks: list[str] = field(default_factory=list)
    waiting: WaitingTimes = field(default_factory=WaitingTimes)

    @property
    def columns(self) -> Floats:
        """Return all rows as columns, shape (7, N); what is unknown is NaN.

        Unix seconds, latitude, longitude (WGS 84), level (dBm), accuracy (m), timing advance
        (steps), and 1 for a serving cell, 0 for a neighbour.
        """
        return np.array(self.values).reshape(-1, _PARTS).T

    def refuse(self, line: int, name: str, expected: str, got: object, hint: str = "") -> None:
        """Count a bad row and keep the faults of the first ones."""
        self.refused += 1
        if len(self.faults) < _FAULTS_KEPT:
            self.faults.append(Fault(f"{self.path} row {line}, {name}", expected, str(got), hint))

    def identify(self, line: int, cell: str, texts: Sequence[str]) -> str:
        """Return the cell that mcc, mnc, lac and ci name, or ``cell`` where that is not empty.

        An identity that is not possible refuses the row; a row without any is set aside. Both
        return an empty text.
        """
        given = (cell, *texts)
        if given in self.identified:
            return self.identified[given]
        mcc, mnc, lac, ci = map(_whole, texts)
        if mcc is None or mnc is None or lac is None or ci is None:
            if not cell:
                self.aside["rows of cells without identity"] += 1
            return cell
        identity = (mcc, mnc, lac, ci)
        for name, value in zip(IDENTITY, identity, strict=True):
            if not RANGES[name].holds(value):
                self.refuse(line, name, RANGES[name].expected, value)
                return ""
        cell = cell or "-".join(map(str, identity))
        self.identities.setdefault(cell, identity)
        self.identified[given] = cell
        return cell

    def add(self, line: int, cell: str, given: Mapping[str, str]) -> None:
        """Check one row, given as texts by :data:`FIELDS`, and keep it or refuse it.

        A time or accuracy that makes no sense becomes unknown: the level is as good without.
        """
        if cell not in self.cells and (wrong := id_fault(cell)) is not None:
            self.refuse(line, "cell", *wrong)
            return
        found = []
        for name in REQUIRED:
            value = number(given[name])
            if value is None:
                self.refuse(
                    line, name, "a number", repr(given[name][:40]) if given[name] else "nothing"
                )
                return
            found.append(value)
        lat_deg, lon_deg, level_dbm = found
        misplaced = degree_fault(lat_deg, lon_deg)
        if lat_deg == 0 and lon_deg == 0:
            misplaced = "a position", "0, 0", "no fix yet"
        if misplaced is not None:
            self.refuse(line, "lat, lon", *misplaced)
            return
        if not _LEVEL_DBM[0] <= level_dbm <= _LEVEL_DBM[1]:
            expected = f"dBm in {_LEVEL_DBM[0]:g}..{_LEVEL_DBM[1]:g}"
            hint = LOST_SIGN if is_above_asu(level_dbm) else ""
            if 0 <= level_dbm <= LARGEST_ASU:
                hint = "RXLEV or ASU given for dBm"
            if abs(level_dbm) >= _UNAVAILABLE:
                hint = "the marker of a level that was not available"
            self.refuse(line, "level_dbm", expected, given["level_dbm"][:40], hint)
            return
        time_s = self.waiting.seconds(len(self.cell), line, given["time"])
        accuracy_m = number(given["accuracy_m"]) or math.nan
        if not 0 < accuracy_m < _UNAVAILABLE:
            accuracy_m = math.nan
        self.cell.append(self.cells.setdefault(cell, len(self.cells)))
        self.session.append(self.sessions.setdefault(given["session"], len(self.sessions)))
        steps = number(given["timing_advance"])
        if steps is None or not 0 <= steps <= _MOST_STEPS:
            steps = math.nan
        arfcn, bsic = _whole(given["arfcn"]), _whole(given["bsic"])
        if arfcn is not None and bsic is not None:
            if RANGES["arfcn"].holds(arfcn) and RANGES["bsic"].holds(bsic):
                self.codes[cell, (arfcn, bsic)] += 1
            else:
                self.aside[NO_CODE] += 1
        said = given["neighbour"].lower()
        serving = 0.0 if said in _YES else 1.0 if said in _NO else math.nan
        self.values.extend((time_s, lat_deg, lon_deg, level_dbm, accuracy_m, steps, serving))

    def finish(self) -> None:
        """Read the times of all rows that are no numbers, when there are no more rows."""
        time_s, notes = self.waiting.read(self.path)
        self.remarks += notes
        for row, value in zip(self.waiting.rows, time_s.tolist(), strict=True):
            self.values[_PARTS * row] = value
        odd = np.flatnonzero(np.isnan(time_s))
        if odd.size:
            first = int(odd[0])
            text = self.waiting.text(first)
            self.aside[NO_TIME] += odd.size
            self.odd_time = f"{text[:40]!r} in line {self.waiting.lines[first]}"
            hint = hint_on_time(text, dated_by_name=False)
            self.odd_time += f" ({hint})" if hint else ""

    def notes(self) -> list[str]:
        """Return remarks on how many rows were refused or set aside, and where the first are."""
        found = [
            f"{counted(count, what)}{self._example(what)}" for what, count in self.aside.items()
        ]
        if self.refused:
            some = "; ".join(str(fault) for fault in self.faults[:_FAULTS_SHOWN])
            more = "; …" if self.refused > _FAULTS_SHOWN else ""
            found.insert(
                0, f"{self.refused} of {number_of(self.read, 'row')} left out: {some}{more}"
            )
        return [f"{self.path.name}: {note}" for note in (*self.remarks, *found)]

    def _example(self, what: str) -> str:
        return f", such as {self.odd_time}; {_TIMES}" if what == NO_TIME and self.odd_time else ""


def most_frequent(counts: Iterable[Counter[tuple[str, _ToldT]]]) -> dict[str, _ToldT]:
    """Return what most rows of each cell state; of equals the larger one, whatever their order.

    Examples
    --------
    >>> most_frequent([Counter({("A", 7): 2, ("B", 5): 1}), Counter({("A", 9): 3, ("B", 4): 1})])
    {'B': 5, 'A': 9}
    """
    total: Counter[tuple[str, _ToldT]] = Counter()
    for one in counts:
        total.update(one)
    ordered = sorted((count, said) for said, count in total.items())
    return {cell: value for _, (cell, value) in ordered}


def _whole(text: str) -> int | None:
    """Return a whole number ≥ 0 that is no marker of an unavailable value, else None."""
    value = number(text)
    if value is None or not 0 <= value < 2**36 or value != int(value) or value == 2**31 - 1:
        return None
    return int(value)
