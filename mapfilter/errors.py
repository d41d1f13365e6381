"""Named errors. Each fault names the place, what was expected and found, and the likely mistake.

Input is checked once, when it is read, and all faults are reported together: collect them in a
:class:`Faults` and call :meth:`Faults.raise_if_any`.

Examples
--------
>>> faults = Faults()
>>> faults.add("cells.csv row 3, lat", "degrees in -90..90", "4553534.3", "metres for degrees")
>>> faults.raise_if_any(InputError)
Traceback (most recent call last):
    ...
mapfilter.errors.InputError: cells.csv row 3, lat: expected degrees in -90..90, found 4553534.3 \
(likely: metres for degrees)
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import isfinite

from mapfilter._words import number_of

_MAX_SHOWN = 20
_MAX_ALIKE = 3
_NUMBER = re.compile(r"[0-9]+")


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault of an input, at ``where``: file, row and field as a user can find it.

    ``hint`` is the likely mistake, or an empty string.
    """

    where: str
    expected: str
    got: str
    hint: str = ""

    def __str__(self) -> str:
        tail = f" (likely: {self.hint})" if self.hint else ""
        return f"{self.where}: expected {self.expected}, found {self.got}{tail}"


class MapfilterError(Exception):
    """Base of all errors that a user can mend; the command line shows them without a traceback."""

    def __init__(self, faults: tuple[Fault, ...]) -> None:
        self.faults = faults
        super().__init__(faults)

    def __str__(self) -> str:
        """Return a line for each fault; of many that differ in numbers only, the first three."""
        alike: dict[tuple[str, ...], list[Fault]] = {}
        for fault in self.faults:
            kind = (_NUMBER.sub("#", fault.where), _NUMBER.sub("#", fault.expected), fault.hint)
            alike.setdefault(kind, []).append(fault)
        lines: list[str] = []
        shown = 0
        for faults in alike.values():
            if len(lines) + min(len(faults), _MAX_ALIKE) > _MAX_SHOWN:
                left = number_of(len(self.faults) - shown, "more fault")
                lines.append(f"… and {left}")
                break
            lines += [str(fault) for fault in faults[:_MAX_ALIKE]]
            shown += len(faults)
            if len(faults) > _MAX_ALIKE:
                lines[-1] += f" … and {len(faults) - _MAX_ALIKE} more like this"
        return "\n".join(lines)


class ConfigError(MapfilterError):
    """The configuration or the command is wrong."""


class InputError(MapfilterError):
    """An input file or table is missing, damaged or does not make sense."""


class StoreError(MapfilterError):
    """A file that mapfilter wrote is damaged, cut off or of a newer version."""


class OutputError(MapfilterError):
    """The output cannot be written."""


class Stopped(BaseException):
    """The process was asked by a signal to end; its notes say what is kept."""

    def __init__(self, signal_number: int) -> None:
        self.signal_number = signal_number
        super().__init__(signal_number)


@dataclass(slots=True)
class Faults:
    """Collects faults, so that all of them are reported together.

    ``notes`` are on inputs that have faults; the error that is raised has them as its own.
    """

    found: list[Fault] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, where: str, expected: str, got: object, hint: str = "") -> None:
        """Note one fault."""
        self.found.append(Fault(where, expected, str(got), hint))

    def take(self, error: MapfilterError) -> None:
        """Note the faults of an error, with its notes."""
        self.found.extend(error.faults)
        self.notes.extend(notes_of(error))

    def check_positive(self, where: str, unit: str, **values: float) -> None:
        """Note each value that is no finite number > 0; its place is ``where`` and its name."""
        for name, value in values.items():
            if not (isfinite(value) and value > 0):
                self.add(f"{where}{name}", f"{unit} > 0", value)

    def raise_if_any(self, kind: type[MapfilterError]) -> None:
        """Raise ``kind`` with every fault noted so far, or return when there is none."""
        if self.found:
            with noted(self.notes):
                raise kind(tuple(self.found))


@contextmanager
def noted(notes: Iterable[str]) -> Iterator[None]:
    """Add notes on an input to an error of it that is raised within; the command shows them first.

    They often tell why: which rows were left out, and how columns were understood.

    Examples
    --------
    >>> try:
    ...     with noted(["a.csv: columns not used: acc"]):
    ...         raise fail(InputError, "a.csv", "positions", "none")
    ... except InputError as error:
    ...     notes_of(error)
    ['a.csv: columns not used: acc']
    """
    try:
        yield
    except MapfilterError as error:
        for note in notes:
            if note not in notes_of(error):
                error.add_note(note)
        raise


@contextmanager
def already_noted(notes: Collection[str]) -> Iterator[None]:
    """Take notes that were shown before off an error that is raised within.

    Examples
    --------
    >>> try:
    ...     with already_noted(["seen"]), noted(["seen", "new"]):
    ...         raise fail(InputError, "a.csv", "positions", "none")
    ... except InputError as error:
    ...     notes_of(error)
    ['new']
    """
    try:
        yield
    except MapfilterError as error:
        error.__notes__ = [note for note in notes_of(error) if note not in notes]
        raise


def notes_of(error: BaseException) -> list[str]:
    """Return the notes that were added to an error."""
    return list(getattr(error, "__notes__", ()))


def listed(names: Sequence[str], most: int = 8) -> str:
    """Return names in one line, the first of many only.

    Examples
    --------
    >>> listed(["a", "b", "c"], 2)
    'a, b and 1 more'
    """
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def fail(
    kind: type[MapfilterError], where: str, expected: str, got: object, hint: str = ""
) -> MapfilterError:
    """Make an error of ``kind`` with a single fault, to be raised by the caller."""
    return kind((Fault(where, expected, str(got), hint),))
