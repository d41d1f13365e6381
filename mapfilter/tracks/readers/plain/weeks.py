"""Seconds of the GPS week or of the day in a plain CSV: weeks beside them, and over their ends."""

from __future__ import annotations

import numpy as np

from mapfilter._constants import DAY_S
from mapfilter._types import Floats
from mapfilter.gnss.almanacs import WEEK_S
from mapfilter.tracks.readers.plain.mapped import Mapped
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.columns import Columns

_NAMES = ("gps_week", "gpsweek", "gps week", "week_number", "week", "wn")
_TURN, _LATEST = 1024, 4096
"""Weeks of files may be counted modulo 1024; those of a year are fewer than 54."""
_WEEKS_OF_YEAR = 54
_NEAR_END_S = 3600.0
_LONGEST_PAUSE_S = 600.0
_OVER_MIDNIGHT = "time: seconds of the day begin anew: times go on"


def week_column(mapped: Mapped) -> str:
    """Return the column of GPS weeks beside seconds of the week; "" without one."""
    name = mapped.rows.find(*_NAMES)
    if name is None or name in mapped.taken or not len(mapped.rows):
        return ""
    week, second = mapped.rows.number(name), mapped.number("time")
    known = week[np.isfinite(week)]
    seconds = second[np.isfinite(second)]
    if not known.size or not seconds.size or (known != np.round(known)).any():
        return ""
    in_week = seconds.min() >= 0 and seconds.max() <= WEEK_S
    of_gps = known.min() >= (0 if "gps" in name else _WEEKS_OF_YEAR) and known.max() < _LATEST
    return name if in_week and of_gps else ""


def weeks_of(rows: Columns, name: str, reading: Reading) -> Floats:
    """Return GPS weeks, counted on; those below 1024 are of the last count, since April 2019."""
    week = rows.number(name)
    if np.nanmax(week) < _TURN:
        reading.note(f"{name}: weeks counted modulo 1024, taken for those since 2019-04-07")
        return np.asarray(week + 2 * _TURN)
    return week


def over_stuck_weeks(reading: Reading, time_s: Floats, week: str) -> Floats:
    """Return UTC seconds that go on where seconds of the week begin anew, and the week stays.

    Parameters
    ----------
    reading : Reading
    time_s : (N,) array
        Of the rows' weeks and seconds.
    week : str
        Column of the weeks, for the note.
    """
    known = np.isfinite(time_s)
    before_s = [reading.last_s] if np.isfinite(reading.last_s) else []
    steps = np.diff(time_s[known], prepend=before_s or time_s[known][:1])
    back, ahead = (sign * steps > WEEK_S - _NEAR_END_S for sign in (-1, 1))
    weeks = np.cumsum(back.astype(np.int64) - ahead)
    # A receiver may count the week later; a pause of a week is none that was missed.
    weeks -= np.minimum(np.minimum.accumulate(weeks), 0) if weeks.size else 0
    if not weeks.any():
        return time_s
    counted = time_s.copy()
    counted[known] += WEEK_S * weeks
    reading.note(f"{week}: stays where seconds of the GPS week begin anew: times go on")
    return counted


def over_weeks(reading: Reading, second: Floats) -> Floats:
    """Return seconds of the GPS week that go on where the week begins anew."""
    known = np.isfinite(second)
    before_s = [reading.last_s] if np.isfinite(reading.last_s) else []
    seconds = np.concatenate([before_s, second[known]])
    if not seconds.size or second[known].min() < 0 or second[known].max() > WEEK_S:
        return second
    back = np.flatnonzero(np.diff(seconds) < -WEEK_S / 2)
    if not back.size:
        return second
    # Those of a part that was read before may have gone on already.
    goes_on = bool(before_s) and before_s[0] > WEEK_S
    left_s, begun_s = WEEK_S - seconds[back], seconds[back + 1]
    if not goes_on and max(left_s.max(), begun_s.max()) > _NEAR_END_S:
        return second
    counted = second.copy()
    counted[known] = np.unwrap(seconds, period=WEEK_S)[len(before_s) :]
    reading.note("time: seconds of the GPS week begin anew: times go on")
    return counted


def over_days(reading: Reading, second: Floats) -> Floats:
    """Return seconds of the day that go on after midnight, where they begin anew within minutes."""
    known = np.isfinite(second)
    if not known.any() or second[known].min() < 0 or second[known].max() > DAY_S:
        return second
    # Those of a part that was read before may have gone on already.
    goes_on = _OVER_MIDNIGHT in reading.notes
    days_s = reading.last_s // DAY_S * DAY_S if goes_on else 0.0
    before_s = [reading.last_s - days_s] if np.isfinite(reading.last_s) else []
    seconds = np.concatenate([before_s, second[known]])
    steps = np.diff(seconds)
    back = steps[steps < -DAY_S / 2]
    if not (goes_on or back.size) or (back < -DAY_S).any():
        return second
    if (back > _LONGEST_PAUSE_S - DAY_S).any():
        return second + days_s
    counted = second.copy()
    counted[known] = days_s + np.unwrap(seconds, period=DAY_S)[len(before_s) :]
    reading.note(_OVER_MIDNIGHT)
    return counted
