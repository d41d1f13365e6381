"""Dates of GPS that were misread: weeks counted anew, and seconds since 1980 or of a week.

Old receivers count weeks from 0 to 1023, so that a later date is one 1024 weeks earlier. Seconds of
GPS since 6 January 1980 that are taken for Unix time are ten years early. Both are certain where
they bring recordings of one journey together, and likely where the name of a file has the other
date, or a phone could not yet have recorded what it did.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

from mapfilter._constants import DAY_S, GPS_EPOCH_S
from mapfilter.clocks.times import utc_from_gps_s, utc_from_week_s
from mapfilter.gnss.almanacs import WEEK_S
from mapfilter.gnss.orbits import gps_time
from mapfilter.tracks.readers.recorded.recording import Recording

ERA_S = 1024 * WEEK_S
_COMMON = 0.5
_LEAST_TOW_S = 3600.0
"""Recordings from an unknown start begin at 0 or soon after."""
_LATEST_UTC_S = datetime(2039, 1, 1, tzinfo=UTC).timestamp()
_NAMED = re.compile(r"(?<!\d)(20[0-3]\d)([-_.]?)([01]\d)\2([0-3]\d)(?!\d)", re.ASCII)
_SINCE = {
    "LTE": datetime(2009, 12, 1, tzinfo=UTC).timestamp(),
    "NR": datetime(2018, 12, 1, tzinfo=UTC).timestamp(),
}
"""When the first networks were opened."""


@dataclass(frozen=True)
class Misread:
    """Seconds by which a recording's dates are early, and the mistake in words."""

    late_s: float
    cause: str


def span_s(recording: Recording) -> tuple[float, float]:
    """Return the first and the last time of a recording."""
    times = [rows["time_s"] for rows in recording.tables.values() if "time_s" in rows]
    return min(float(t.iloc[0]) for t in times), max(float(t.iloc[-1]) for t in times)


def later(recording: Recording, seconds: float) -> Recording:
    """Return a recording with later times."""
    if seconds == 0.0:
        return recording
    tables = {
        name: rows.assign(time_s=rows["time_s"] + seconds) if "time_s" in rows else rows
        for name, rows in recording.tables.items()
    }
    return replace(recording, tables=tables)


def early_dates(
    recordings: Sequence[Recording], given_s: Mapping[Path, float]
) -> tuple[list[float], list[str]]:
    """Return by how many seconds dates of recordings are early by the others, and notes on dates.

    Parameters
    ----------
    recordings : sequence of Recording
        Of one journey.
    given_s : mapping of Path to float
        Offsets that a person gives; with any, nothing is mended.
    """
    early_s, notes = [], list[str]()
    for recording in recordings:
        # A person who mends one clock knows of the others.
        found = None if given_s else _misread_beside(recording, recordings)
        early_s.append(0.0 if found is None else found.late_s)
        if found is not None:
            notes.append(
                f"{recording.name}: {found.late_s:+.0f} s, by the other files: {found.cause}"
            )
        else:
            notes += _doubtful_dates(recording, given_s)
    return early_s, notes


def _misread_beside(recording: Recording, others: Sequence[Recording]) -> Misread | None:
    """Return the mistake that parts a recording from others, which overlaps one without it.

    Parameters
    ----------
    recording : Recording
    others : sequence of Recording
        Of the same journey.
    """
    if not recording.clock.absolute:
        return None
    spans = [span_s(one) for one in others if one is not recording and one.clock.absolute]
    mine = span_s(recording)
    if any(_common(mine, other) > -DAY_S for other in spans):
        return None
    for mistake in _mistakes(mine[0]):
        moved = mine[0] + mistake.late_s, mine[1] + mistake.late_s
        if any(_common(moved, other) >= _COMMON * _shorter_s(mine, other) for other in spans):
            return mistake
    return None


def week_start_s(recording: Recording, other: Recording) -> float | None:
    """Return the UTC time of the GPS week of which a recording counts seconds; None for no such.

    Parameters
    ----------
    recording : Recording
        With times from an unknown start.
    other : Recording
        In UTC, with which most of the shorter one has to overlap.
    """
    if recording.clock.from_midnight:
        return None
    begin_s, end_s = span_s(recording)
    there = span_s(other)
    if begin_s < _LEAST_TOW_S or begin_s >= WEEK_S or there[0] < GPS_EPOCH_S:
        return None
    week, _ = gps_time(there[0])
    for one in (week, week - 1):
        start_s = float(utc_from_week_s(one, begin_s)) - begin_s
        moved = begin_s + start_s, end_s + start_s
        if _common(moved, there) >= _COMMON * _shorter_s(moved, there) > 0:
            return start_s
    return None


def _doubtful_dates(recording: Recording, given: Collection[Path]) -> list[str]:
    """Return a note where the name of a file, or what it holds, contradicts its dates.

    Parameters
    ----------
    recording : Recording
    given : collection of Path
        Recordings whose times a person mends.
    """
    if not recording.clock.absolute or recording.path in given:
        return []
    begin_s, end_s = span_s(recording)
    day = _day(begin_s)
    if (named_s := _named_s(recording.path.name)) is not None:
        for mistake in _mistakes(begin_s):
            early_s = named_s - (end_s + mistake.late_s), begin_s + mistake.late_s - named_s
            if early_s[0] <= DAY_S and early_s[1] <= 2 * DAY_S:
                why = f"of {day}, but {_day(named_s)} by its name"
                return [_doubt(recording, why, [mistake])]
    for technology, since_s in _SINCE.items():
        radio = recording.tables.get("radio")
        held = radio is not None and bool((radio["technology"] == technology).any())
        if held and begin_s < since_s:
            fitting = [
                one for one in _mistakes(begin_s) if since_s <= begin_s + one.late_s < _LATEST_UTC_S
            ]
            why = f"of {day}, before the first network of {technology}"
            return [_doubt(recording, why, fitting)]
    return []


def _doubt(recording: Recording, why: str, mistakes: Sequence[Misread]) -> str:
    begin_s, _ = span_s(recording)
    likely = ", or ".join(
        f"{one.cause}: --offset {recording.name}={one.late_s:.0f} for {_day(begin_s + one.late_s)}"
        for one in mistakes
    )
    return f"{recording.name}: times are {why}{f' (likely: {likely})' if likely else ''}"


def _mistakes(begin_s: float) -> list[Misread]:
    """Return mistakes that dates may have, with by how much they are early."""
    weeks = "the date of a receiver whose week number began anew"
    found = [Misread(ERA_S, weeks), Misread(2 * ERA_S, weeks)]
    # As Unix time they are those of the same number.
    of_gps_s = float(utc_from_gps_s(begin_s)) - begin_s
    return [*found, Misread(of_gps_s, "seconds of GPS time since 1980")]


def _named_s(name: str) -> float | None:
    """Return the begin of the day that a file's name has; None without one, or with several.

    Examples
    --------
    >>> _day(_named_s("drive_2026-05-01.csv")), _named_s("drive-20261399.csv"), _named_s("a.csv")
    ('2026-05-01', None, None)
    """
    days = {(int(y), int(m), int(d)) for y, _, m, d in _NAMED.findall(name)}
    if len(days) != 1:
        return None
    year, month, day = days.pop()
    try:
        return datetime(year, month, day, tzinfo=UTC).timestamp()
    except ValueError:
        return None


def _day(time_s: float) -> str:
    return f"{datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=time_s):%Y-%m-%d}"


def _common(one: tuple[float, float], other: tuple[float, float]) -> float:
    """Return the seconds that two spans have in common; below 0 those between them."""
    return min(one[1], other[1]) - max(one[0], other[0])


def _shorter_s(one: tuple[float, float], other: tuple[float, float]) -> float:
    return min(one[1] - one[0], other[1] - other[0])
