"""Collecting the recording of one file while it is read: which rows and values are usable."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mapfilter._constants import DAY_S, GPS_EPOCH_S
from mapfilter._types import Bools, Floats, Ints
from mapfilter._words import number_of
from mapfilter.errors import listed
from mapfilter.tracks.cut_times import cut_times
from mapfilter.tracks.readers.batched_rows import without_batches
from mapfilter.tracks.readers.held_positions import own_positions
from mapfilter.tracks.readers.recorded_field import Field
from mapfilter.tracks.readers.recorded_values import (
    checked_values,
    duplicates,
    joined_parts,
    late_rows,
    reordered,
)
from mapfilter.tracks.readers.recording import Clock, Recording
from mapfilter.tracks.readers.remarks import CountedNotes, Remarks, number_or_share
from mapfilter.tracks.readers.set_back import set_back_by
from mapfilter.tracks.readers.tables import RECORDED
from mapfilter.tracks.readers.tallies import Tallies
from mapfilter.tracks.readers.unusable import Unusable, nothing_usable
from mapfilter.tracks.readers.wound import CAUSE
from mapfilter.tracks.repeated_readings import repeated_readings
from mapfilter.tracks.schema import NEIGHBOUR

_LINES_KEPT = 3
_EARLIEST_UTC_S, _LATEST_UTC_S = GPS_EPOCH_S, 4_102_444_800.0
_TICKS = "likely: ticks since a phone was started; their unit in the header, as time_ms, reads them"
_JUMP_S = DAY_S
_STRAY_SHARE = 0.1
_OF_STEPS = ("steps", "motion")
_SEVERAL = ("radio", "satellites", "ephemerides")
"""Tables that have several rows for each moment."""


@dataclass(slots=True)
class Reading(Remarks):
    """Collects the tables, bad rows and notes of one file while it is read.

    ``last_s`` is the last time of the file's rows, used or not, and ``passed_s`` that of the parts
    read so far, of formats without ``last_s``; ``columns`` are the names in the file of columns
    without a usual name, by field. ``doubled`` is by how much all times so far may be later, as of
    :func:`mapfilter.tracks.readers.local_times.doubled_s`, and the note on it. ``kept`` are rows
    that ``ending`` takes when all parts are read.
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
            good &= self._in_era(checked["time_s"], line, good)
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

    def _in_era(self, time_s: Floats, line: Ints, good: Bools) -> Bools:
        """Refuse times that are no dates, and few rows that lie days away from all others."""
        kept = np.ones(len(line), dtype=bool)
        if self.clock.kind != "monotonic":
            kept = (time_s >= _EARLIEST_UTC_S) & (time_s <= _LATEST_UTC_S)
            outside = good & ~kept
            # Milliseconds or nanoseconds of a phone that runs for days look like Unix times.
            early = outside.any() and bool((time_s[good] < _EARLIEST_UTC_S).all())
            hint = f" ({_TICKS})" if early else ""
            self.refuse(line[outside], f"time: not between 1980 and 2100{hint}")
        index = np.flatnonzero(good & kept)
        if index.size < 3:
            return kept
        order = index[np.argsort(time_s[index], kind="stable")]
        group = np.concatenate([[0], np.cumsum(np.diff(time_s[order]) > _JUMP_S)])
        sizes = np.bincount(group)
        stray = order[sizes[group] < max(2, _STRAY_SHARE * sizes.max())]
        if len(sizes) > 1 and stray.size < index.size:
            self.refuse(np.sort(line[stray]), "time: more than a day away from all other rows")
            kept[stray] = False
        return kept

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
        kept = {
            table: self._tidy(
                table, joined_parts(self.tables.pop(table)), cells=cells, by_cell=by_cell
            )
            for table in RECORDED
            if table in self.tables
        }
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
        )

    def _tidy(self, table: str, rows: pd.DataFrame, *, cells: bool, by_cell: bool) -> pd.DataFrame:
        """Sort a table and drop exact duplicates.

        ``cells`` says whether a file has some, and ``by_cell`` whether it lists neighbours.
        """
        if "time_s" not in rows:
            return rows
        time = rows["time_s"].to_numpy()
        if (np.diff(time) < 0).any():
            rows = reordered(rows, np.argsort(time, kind="stable"))
            time = rows["time_s"].to_numpy()
        if table in _OF_STEPS:
            rows, batches = without_batches(table, rows, repeated=cells)
            if batches:
                self.note(batches)
            time = rows["time_s"].to_numpy()
        if (np.diff(time) == 0).any():
            duplicate = repeated_readings(rows, duplicates(rows))
            if duplicate.any():
                self.note(
                    f"{table}: {number_of(int(duplicate.sum()), 'exact duplicate row')} dropped"
                )
                rows = rows[~duplicate].reset_index(drop=True)
            # Equal steps are distance lost; a file with a row for each cell repeats them.
            counted = time if table == "motion" and not by_cell else rows["time_s"]
            if table not in _SEVERAL and (cut := cut_times(np.asarray(counted))):
                self.ignore(f"{table}: {cut}")
        if table == "positions":
            rows, notes = own_positions(rows)
            for note in notes:
                self.ignore(note)
        return rows
