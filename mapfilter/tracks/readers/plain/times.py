"""Times of a plain CSV: Unix time, dates, days of a spreadsheet, or seconds from some start."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pyarrow as pa

from mapfilter._constants import DAY_S
from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.clocks.local_times import utc_from_local_s
from mapfilter.clocks.time_hints import hint_on_time
from mapfilter.clocks.times import (
    LEAST_UNIX_S,
    are_days,
    in_days,
    unix_seconds,
    utc_from_gps_s,
    utc_from_week_s,
    without_midnights,
)
from mapfilter.clocks.written_dates import are_compact
from mapfilter.clocks.written_times import written_times
from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.clocks.local_parts import note_changes
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.plain.dates import OF_DAY, seconds_in_digits
from mapfilter.tracks.readers.plain.headers import columns_of
from mapfilter.tracks.readers.plain.mapped import Mapped
from mapfilter.tracks.readers.plain.weeks import (
    over_days,
    over_stuck_weeks,
    over_weeks,
    week_column,
    weeks_of,
)
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.numbers import MISSING

_TIMES = "seconds, Unix time, or ISO 8601 such as 2026-05-01T10:00:00+02:00"
_EPOCH_DAYS = 25_569.0
"""Days from 1900 to 1970, as spreadsheets count them."""
_FEWEST_SAME = 20
_SHORTENED = re.compile(r"\d[eE][+-]?\d", re.ASCII)
_LEAST_DIFFERENT = 0.5
_NUMBER = re.compile(r"\d+(?:\.\d*)?")
_EARLY_S, _RECENT_S, _LATEST_S = 9e8, 1.6e9, 2.2e9
"""Unix times of 1998, 2020 and 2039."""
_SAME_DATE = "time: the date stays the same over midnight: times go on with the next day"
_PAUSE_S = 600.0
_LONG, _SHORT, _JUMP, _FEWEST_JUMPS = 300.0, 20.0, 40.0, 3
"""Of times, their steps and the jumps between their minutes, to tell them from seconds."""
_DAYS = "time: days since 1900, as a spreadsheet writes them"
_OF_SENSORS = ("yaw_rate_radps", "yaw_rate_degps", "gyr_z", "acc_x")
_SELDOM_S, _FEWEST_SELDOM = 10.0, 20
"""Seconds between rows in which no sensor follows turns or steps, and the fewest such rows."""
_SLOWEST_MPS, _DEGREE_M = 0.1, 111_200.0
"""Mean speed of a journey; in thousandths of a second a train has less. Metres of a degree."""


def times_of(mapped: Mapped, reading: Reading, options: ReadOptions) -> Floats:
    """Return UTC seconds, or seconds from an unknown start where they are small numbers.

    Of several columns of times one in UTC goes first, then one of local times.
    """
    # Dates are no numbers; notes on them may be of the columns that are looked at, too.
    names = mapped.names("time")
    mapped = _best_column(mapped, reading)
    as_numbers = tuple(f"{name}: " for name in {*names, *mapped.names("time")})
    missing = mapped.rows.flags(*mapped.names("time"), true=MISSING)
    if missing.size and missing.all():
        # A part of a large file, as of a receiver without a fix: the clock is that of the others.
        return np.full(missing.size, np.nan)
    number = mapped.number("time") if len(mapped.rows) else np.zeros(0)
    known = number[np.isfinite(number)]
    usual_s = abs(float(np.median(known))) if known.size else np.inf
    _check_digits(mapped, reading, known)
    given = np.count_nonzero(mapped.rows.with_digits(*mapped.names("time")))
    if known.size >= 0.5 * given and usual_s < LEAST_UNIX_S:
        if are_days(known) or (in_days(known) and _DAYS in reading.notes):
            reading.note(_DAYS)
            return _local(reading, np.round((number - _EPOCH_DAYS) * DAY_S, 3), options.zone)
        if week := week_column(mapped):
            reading.clock = Clock("gps")
            reading.note(f"time: seconds of the GPS week in column {week}")
            counted_s = utc_from_week_s(weeks_of(mapped.rows, week, reading), number)
            return over_stuck_weeks(reading, counted_s, week)
        number = _without_digits(reading, number)
        if OF_DAY not in reading.notes:
            _check_milliseconds(mapped, reading, number)
        reading.clock = Clock("monotonic", from_midnight=OF_DAY in reading.notes)
        return over_days(reading, over_weeks(reading, number))
    for remarks in (reading.notes, reading.ignored):
        remarks[:] = [
            note
            for note in remarks
            if not (note.startswith(as_numbers) and "taken as missing" in note)
        ]
    names = mapped.names("time")
    # A zone that is given is that of the local times of all files.
    rows, name = mapped.rows, mapped.rows.find(*names) or ""
    is_utc, by_zone = "utc" in name, reading.by_zone
    zone = "UTC" if is_utc else options.zone
    time_s, zoned = rows.times(*names, zone=zone, after_s=reading.last_s)
    # Times of a column in UTC need no zone of a place.
    reading.by_zone = by_zone if is_utc else reading.by_zone
    reading.clock = Clock("utc") if zoned else Clock("local", zone)
    _note_gps(reading, name, known)
    if len(time_s) and not np.isfinite(time_s).any():
        texts = mapped.texts("time").tolist()
        at = next((row for row, text in enumerate(texts) if text), 0)
        where = f"{reading.path} row {mapped.rows.line[at]}, time"
        raise fail(
            InputError, where, _TIMES, repr(texts[at][:40] or "nothing"), hint_on_time(texts[at])
        )
    return _over_midnight(mapped, reading, time_s)


def _best_column(mapped: Mapped, reading: Reading) -> Mapped:
    """Return columns with the times of the one that says most, and tells rows apart.

    A start of the recording that stands in each row, or times in whole minutes, do not replace
    others that can be read. Later parts of a large file are read as the first one.
    """
    there = [name for name in mapped.names("time") if name in mapped.rows.names]
    names = [name for name in mapped.rows.names if mapped.rows.names.count(name) == 1]
    there += columns_of("time", names, {*mapped.taken, *mapped.beside, *there})
    if len(there) < 2 or "time" in mapped.own:
        return mapped
    if "time" not in reading.columns:
        reading.columns["time"] = _best_of(there, mapped.rows, reading)
    best = reading.columns["time"]
    return mapped if best == there[0] else replace(mapped, stated={**mapped.stated, "time": best})


def _best_of(there: list[str], rows: Columns, reading: Reading) -> str:
    certain = {name: _certainty(name, rows.first_text(name)) for name in there}
    if certain[there[0]] and np.unique(rows.texts(there[0])).size == 1 < len(rows):
        # The start of the recording; what counts from it tells rows apart.
        there = [name for name in there[1:] if np.unique(rows.texts(name)).size > 1] or there
    better = [name for name in there if certain[name] > certain[there[0]]]
    if better and certain[there[0]]:
        count = {name: np.unique(rows.texts(name)).size for name in (there[0], *better)}
        coarse = [name for name in better if count[name] < _LEAST_DIFFERENT * count[there[0]]]
        for name in coarse:
            times = number_of(count[name], "different time")
            reading.note(f"{name}: {times} in {number_of(len(rows), 'row')}, not used")
        better = [name for name in better if name not in coarse]
    return max(better, key=certain.__getitem__, default=there[0])


def _certainty(name: str, text: str) -> int:
    """Return 3 for times in UTC, 2 for local ones, 1 for other numbers, 0 for others."""
    number = text.replace(",", ".")
    if _NUMBER.fullmatch(number) and not are_compact(np.array([float(number)])):
        # Ticks since a phone was started are large, too.
        seconds = float(unix_seconds([float(number)])[0])
        sure = _EARLY_S < seconds < _LATEST_S and np.isnan(_since_1980(name, seconds))
        return 3 if sure else 1
    found = written_times(pa.chunked_array([[text]]), "UTC" if "utc" in name else "")
    return (3 if found.zoned else 2) if np.isfinite(found.time_s).all() else 0


def _without_digits(reading: Reading, number: Floats) -> Floats:
    """Return seconds of the day for times of day in one number: 36930.25 for 101530.25.

    Of seconds some would end in 60 to 99.
    """
    known = np.isfinite(number)
    counted = seconds_in_digits(number)
    if not known.any() or not np.isfinite(counted[known]).all():
        return number
    steps = np.diff(np.unique(number[known]))
    # From one minute to the next such numbers jump by 40.
    jumps = (steps > _JUMP) & (steps <= _JUMP + _SHORT)
    long = steps[steps <= _JUMP + _SHORT].sum() > _LONG and jumps.sum() >= _FEWEST_JUMPS
    if not (long or OF_DAY in reading.notes):
        return number
    reading.note(OF_DAY)
    return counted


def _check_milliseconds(mapped: Mapped, reading: Reading, number: Floats) -> None:
    """Refuse whole numbers without a unit by which turns or accelerations came very seldom.

    They are seconds where positions move by them as on a journey.

    Raises
    ------
    InputError
        Naming the column of times.
    """
    column = mapped.rows.find(*mapped.names("time")) or ""
    known = number[np.isfinite(number)]
    if mapped.unit("time") is not None or "sec" in column or known.size < _FEWEST_SELDOM:
        return
    between_s = float(np.median(np.diff(np.unique(known)))) if np.ptp(known) else 0.0
    if between_s < _SELDOM_S or (known != np.round(known)).any():
        return
    if any(map(mapped.holds, _OF_SENSORS)) and not _mean_mps(mapped, number) > _SLOWEST_MPS:
        got = f"whole numbers, {between_s:g} from row to row"
        hint = "milliseconds for s; call the column time_ms for milliseconds, time_s for seconds"
        expected = "seconds, and rows of a sensor that follow each other"
        raise fail(InputError, f"{reading.path}, time ({column})", expected, got, hint)


def _mean_mps(mapped: Mapped, time_s: Floats) -> float:
    """Return the mean speed of a file's positions if its times are seconds; 0 without any."""
    if not mapped.has("lat_deg", "lon_deg"):
        return 0.0
    lat_deg, lon_deg = mapped.number("lat_deg"), mapped.number("lon_deg")
    known = np.isfinite(lat_deg) & np.isfinite(lon_deg) & np.isfinite(time_s)
    if not known.any() or not np.ptp(time_s[known]):
        return 0.0
    east_deg = np.diff(lon_deg[known]) * np.cos(np.radians(lat_deg[known][1:]))
    way_m = _DEGREE_M * np.hypot(east_deg, np.diff(lat_deg[known])).sum()
    return float(way_m / np.ptp(time_s[known]))


def _check_digits(mapped: Mapped, reading: Reading, known: Floats) -> None:
    """Refuse numbers that a spreadsheet shortened until most rows have the same one.

    Raises
    ------
    InputError
        Naming one of them.
    """
    times = np.unique(known).size
    if not times or known.size < _FEWEST_SAME * times:
        return
    text = next((one for one in mapped.texts("time").tolist() if one), "")
    if not (_SHORTENED.search(text) or in_days(known)):
        return
    column = mapped.rows.find(*mapped.names("time"))
    got = f"{number_of(times, 'time')} in {known.size} rows, such as {text[:40]}"
    hint = "a spreadsheet that shortened numbers: show all their digits there, and export again"
    raise fail(InputError, f"{reading.path}, time ({column})", "a time of each row", got, hint)


def _local(reading: Reading, local_s: Floats, zone: str) -> Floats:
    reading.clock = Clock("local", zone)
    if not zone:
        return local_s
    utc_s = utc_from_local_s(local_s, zone, reading.last_s)
    note_changes(reading, local_s, utc_s, zone, reading.last_s)
    return utc_s


def _note_gps(reading: Reading, name: str, known: Floats) -> None:
    """Note a column of GPS time whose numbers may count from 1980."""
    seconds = float(unix_seconds(known[:1])[0]) if known.size else np.nan
    of_gps = _since_1980(name, seconds)
    if np.isfinite(of_gps):
        day, other = (f"{datetime.fromtimestamp(x, UTC):%Y-%m-%d}" for x in (seconds, of_gps))
        reading.note(
            f"{name}: taken for Unix time ({day}); seconds of GPS since 1980 would be of {other}: "
            f"--offset {reading.path.name}={of_gps - seconds:.0f}"
        )


def _since_1980(name: str, seconds: float) -> float:
    """Return the UTC seconds of a column of GPS time that may count from 1980; NaN for others."""
    if "gps" not in name or not seconds < _RECENT_S:
        return np.nan
    of_gps = float(utc_from_gps_s(np.array([seconds]))[0])
    return of_gps if of_gps < _LATEST_S else np.nan


def _over_midnight(mapped: Mapped, reading: Reading, time_s: Floats) -> Floats:
    """Return times that go on after midnight where a column of dates keeps the day of the start."""
    if not mapped.date:
        return time_s
    dates = mapped.rows.texts(mapped.date)[mapped.rows.with_digits(mapped.date)]
    if (dates[1:] != dates[:-1]).any():
        return time_s
    known_s = time_s[np.isfinite(time_s)]
    before_s = [reading.last_s] if np.isfinite(reading.last_s) else []
    steps_s = np.diff(np.concatenate([before_s, known_s]))
    # Between parts the date may change, too: then times fall by less, or more, than a day.
    if before_s and _SAME_DATE not in reading.notes:
        steps_s[:1][(steps_s[:1] < -DAY_S) | (steps_s[:1] > _PAUSE_S - DAY_S)] = 0.0
    if not (steps_s < -DAY_S / 2).any():
        return time_s
    counted = without_midnights(time_s, before_s[0] if before_s else np.nan)
    reading.note(_SAME_DATE)
    return counted
