"""Collecting the recording of one file while it is read: which rows and values are usable."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mapfilter._types import Bools, Floats, Ints
from mapfilter._words import number_of
from mapfilter.errors import listed
from mapfilter.tracks.readers.clocks.set_back import set_back_by
from mapfilter.tracks.readers.clocks.stray_times import stray_times
from mapfilter.tracks.readers.recorded.recorded_field import Field
from mapfilter.tracks.readers.recorded.recorded_values import (
    checked_values,
    joined_parts,
    late_rows,
)
from mapfilter.tracks.readers.recorded.recording import Clock, Recording
from mapfilter.tracks.readers.recorded.remarks import CountedNotes, Remarks, number_or_share
from mapfilter.tracks.readers.recorded.tables import RECORDED
from mapfilter.tracks.readers.recorded.tallies import Tallies
from mapfilter.tracks.readers.recorded.tidied_tables import tidied
from mapfilter.tracks.readers.recorded.unusable import Unusable, nothing_usable
from mapfilter.tracks.readers.recorded.wound import CAUSE
from mapfilter.tracks.schema import NEIGHBOUR

_LINES_KEPT = 3


@dataclass(slots=True)
class Reading(Remarks):
    """Collects the tables, bad rows and notes of one file while it is read.

    ``last_s`` is the last time of the file's rows, used or not, and ``passed_s`` that of the parts
    read so far, of formats without ``last_s``; ``columns`` are the names in the file of columns
    without a usual name, by field. ``doubled`` is by how much all times so far may be later, as of
    :func:`mapfilter.clocks.local_times.doubled_s`, and the note on it; ``by_zone`` whether any of
    them is UTC by the zone that was given; ``date_order`` whether dates with the year at the end,
    or in two digits, begin with "day", "month" or "year", as one of them shows, or the order of
    dates of digits, and ``date_column`` the column of dates beside times of day; ``later`` gives
    the columns of the parts after the one that is read; ``value_units`` the units behind the values
    of columns. ``kept`` are rows that ``ending`` takes when all parts are read.
    """

    path: Path
    rows: int = 0
    clock: Clock = field(default_factory=lambda: Clock("utc"))
    program: str = ""
    crs: str = ""
    tables: dict[str, list[pd.DataFrame]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    ignored: list[str] = field(default_factory=list)
    fields: tuple[str, ...] = ()
    unread: tuple[str, ...] = ()
    named: tuple[str, ...] = ()
    tallies: Tallies = field(default_factory=Tallies)
    last_s: float = -inf
    passed_s: float = -inf
    doubled: tuple[float, str] = (0.0, "")
    by_zone: bool = False
    date_order: str = ""
    date_column: str = ""
    later: Callable[[], Iterable[Any]] = tuple
    value_units: dict[str, str] = field(default_factory=dict)
    columns: dict[str, str] = field(default_factory=dict)
    kept: list[pd.DataFrame] = field(default_factory=list)
    ending: Callable[[pd.DataFrame], None] | None = None
    counted: CountedNotes = field(default_factory=CountedNotes)
    _firsts: dict[str, str] = field(default_factory=dict)
    _backwards: dict[str, Ints] = field(default_factory=dict)
    _refused: dict[str, list[Ints]] = field(default_factory=dict)

    def refuse(self, lines: ArrayLike, reason: str, first: float | None = None) -> None:
        """Count lines with bad rows, each once for a reason; ``first`` is the first bad value."""
        found = np.atleast_1d(np.asarray(lines, dtype=np.int64))
        if found.size:
            if first is not None:
                self._firsts.setdefault(reason, f"{first:.10g}")
            self._refused.setdefault(reason, []).append(found)

    def add(self, table: str, columns: Mapping[str, Any], lines: ArrayLike) -> None:
        """Check rows of a table, and keep the usable ones.

        Parameters
        ----------
        table : str
            One of :data:`RECORDED`.
        columns : mapping of str to array_like
            ``time_s`` and columns of the table; absent ones are missing in every row. NaN and None
            are missing values.
        lines : (N,) array_like of int
            The line of each row.
        """
        line = np.asarray(lines, dtype=np.int64)
        checked = {
            f.name: checked_values(f, columns.get(f.name), len(line)) for f in RECORDED[table]
        }
        good = np.ones(len(line), dtype=bool)
        for known in RECORDED[table]:
            good &= self._check(table, known, checked, line, good)
        if table == "positions":
            nowhere = good & (checked["lat_deg"] == 0) & (checked["lon_deg"] == 0)
            self.refuse(line[nowhere], "latitude and longitude are 0 (no fix yet)")
            good &= ~nowhere
        if "time_s" in checked:
            for no_time, reason in stray_times(self.clock, checked["time_s"], good):
                self.refuse(line[no_time], reason)
                good &= ~no_time
        if not good.any():
            return
        if not good.all():
            checked = {name: values[good] for name, values in checked.items()}
        rows = pd.DataFrame(checked, copy=False)
        if "time_s" in rows:
            self._note_backwards(table, rows["time_s"].to_numpy(), line[good])
        self.tables.setdefault(table, []).append(rows)

    def _note_backwards(self, table: str, time_s: Floats, line: Ints) -> None:
        """Note where times go backwards; of a line with several rows of a table once."""
        steps_s = np.diff(time_s)
        back = steps_s < 0
        if not back.any():
            return
        known = self._backwards.get(table, np.zeros(0, dtype=np.int64))
        before, after = (
            np.searchsorted(known, ends[back], "right") for ends in (line[:-1], line[1:])
        )
        # A cell that is not in all lines goes backwards from one of its lines to the next.
        new = int(np.count_nonzero(before == after))
        self._backwards[table] = np.union1d(known, line[1:][back])
        if new:
            cause = set_back_by(-steps_s[back], self.clock)
            why = f" (likely: {cause})" if cause else ""
            self.count(
                lambda n: f"{table}: times go backwards in {number_of(n, 'place')}; sorted{why}",
                new,
            )

    def shift(self, later_s: float) -> None:
        """Make the times of all rows so far later."""
        for parts in self.tables.values():
            parts[:] = [part.assign(time_s=part["time_s"] + later_s) for part in parts]
        self.kept[:] = [part.assign(time_s=part["time_s"] + later_s) for part in self.kept]

    def keep(self, rows: pd.DataFrame, ending: Callable[[pd.DataFrame], None]) -> None:
        """Keep rows of a part of the file; ``ending`` takes those of all when it is read."""
        self.kept.append(rows)
        self.ending = ending

    def _check(
        self, table: str, known: Field, checked: dict[str, Any], line: Ints, good: Bools
    ) -> Bools:
        """Refuse rows without a needed value; ignore other values out of range."""
        values = checked[known.name]
        if known.text:
            missing = np.asarray(values.codes < 0)
            outside = np.zeros(len(values), dtype=bool)
        else:
            missing = np.isnan(values)
            if (noise := known.is_noise(values)).any():
                least = f"just below {known.low:g}, taken for {known.low:g}"
                self.count(
                    lambda n: f"{table}, {known.name}: {number_of(n, 'value')} {least}",
                    int(noise.sum()),
                )
                values = checked[known.name] = np.where(noise, known.low, values)
            outside = ~missing & ~((values >= known.low) & (values <= known.high))
            if known.turn and not missing.all():
                values, outside = self._unwound(table, known, values, outside)
                checked[known.name] = values
            if known.vital:
                given = int(np.count_nonzero(good & ~missing))
                self.tallies.add_values(table, known, values, given, good & outside, line)
        label = f"{table}, {known.name}"
        if known.required:
            column = self.columns.get(known.name, "")
            named = f"{known.name} ({column})" if column else known.name
            self.refuse(line[good & missing], f"{named}: missing, or no {known.kind}")
            for hint, of in known.mistakes(values, good & outside):
                reason = f"{named}: not {known.expected}{hint}"
                self.refuse(line[of], reason, float(values[of][0]))
            return ~missing & ~outside
        if (ignored := good & outside).any():
            first = line[ignored][0]
            numbers = [int(ignored.sum())]
            # Elsewhere few bad values say nothing of their cause.
            hint = known.mistake(float(np.abs(values[ignored]).max())) if known.marks > 1 else ""
            hint = hint or self._doubt(table, known, int(ignored.sum()), line.size)
            where = f"first in line {first}" + (f"; likely: {hint}" if hint else "")
            given = int(np.count_nonzero(good & ~missing))
            if known.is_another(values[ignored], given):
                # What is left of another quantity is none of this one either.
                outside = ~missing
                numbers.append(given)
                where += "; the whole column"
            self.count(
                lambda n, of=None: (
                    f"{label}: {number_or_share(n, of)} not {known.expected}, ignored ({where})"
                ),
                *numbers,
                key=f"{label}, {len(numbers)}",
                ignored=True,
            )
            checked[known.name] = np.where(outside, np.nan, values)
        return np.ones(len(line), dtype=bool)

    def _unwound(
        self, table: str, known: Field, values: Floats, outside: Bools
    ) -> tuple[Floats, Bools]:
        """Return headings with unwrapped ones wrapped, and which are out of range still."""
        values = self.tallies.winding(table, known).unwound(values, outside)
        left = outside & ~(np.abs(values) <= known.high)
        if count := int(np.count_nonzero(outside & ~left)):
            turned = "beyond a turn, wrapped (unwrapped)"
            self.count(lambda n: f"{table}, {known.name}: {number_of(n, 'value')} {turned}", count)
        return values, left

    def _doubt(self, table: str, known: Field, ignored: int, rows: int) -> str:
        """Return what headings may be that mostly are out of range, but do not jump; else ""."""
        if not known.turn or ignored <= rows / 2:
            return ""
        return CAUSE if self.tallies.winding(table, known).doubtful else ""

    def done(self, name: str, rows_word: str = "row") -> Recording:
        """Sort the tables, drop exact duplicates, and return the recording.

        Raises
        ------
        InputError
            No row can be used, or most values of a column that a log needs are out of range.
        """
        if self.ending is not None:
            self.ending(pd.concat(self.kept, ignore_index=True))
        found = {reason: np.unique(np.concatenate(some)) for reason, some in self._refused.items()}
        refused = tuple(
            Unusable(
                reason,
                len(lines),
                tuple(lines[:_LINES_KEPT].tolist()),
                self._firsts.get(reason, ""),
            )
            for reason, lines in sorted(found.items(), key=lambda one: -len(one[1]))
        )
        if not self.tables:
            reasons = [*map(str, refused), *self.ignored]
            if not reasons and (empty := self.tallies.empty):
                reasons.append(f"no numbers in {listed(empty)}")
            raise nothing_usable(self.path, name, self.rows, reasons, rows_word)
        self.tallies.check(self.path, RECORDED)
        if late := late_rows(self.tables.values(), self.last_s, read=not self.unread):
            self.ignore(late)
        radio = self.tables.get("radio", ())
        cells = bool(radio)
        by_cell = any((part["role"] == NEIGHBOUR).any() for part in radio)
        kept = {}
        for table in (table for table in RECORDED if table in self.tables):
            rows = joined_parts(self.tables.pop(table))
            if "time_s" in rows:
                rows, notes, ignored = tidied(table, rows, cells=cells, by_cell=by_cell)
                for note in notes:
                    self.note(note)
                for note in ignored:
                    self.ignore(note)
            kept[table] = rows
        return Recording(
            self.path,
            name,
            self.program,
            self.clock,
            kept,
            self.rows,
            refused,
            tuple(self.notes),
            self.crs,
            tuple(note for note in self.ignored if note in self.notes),
            self.fields,
            self.unread,
            self.named,
            self.by_zone or (self.clock.kind == "local" and bool(self.clock.zone)),
        )
