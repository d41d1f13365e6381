"""Local times of a zone as UTC, over hours that a clock passes twice or not at all."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta, timezone, tzinfo
from math import isfinite, nan
from zoneinfo import ZoneInfo, available_timezones

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats, Ints
from mapfilter._words import number_of
from mapfilter.errors import ConfigError, fail

_QUARTER_S = 900.0
LONGEST_STEP_S = 900.0
"""Between rows that go on without a gap."""
_FAR_QUARTERS = 6e7
"""Quarters of an hour, 1700 years from 1970; datetime ends soon after."""
_OFFSET = re.compile(r"(?:UTC|GMT)?([+-])(\d{1,2})(?::?([0-5]\d))?", re.ASCII)


def utc_from_local_s(local_s: ArrayLike, zone: str, after_s: float = nan) -> Floats:
    """Turn local times, in seconds as if their zone were UTC, into UTC seconds.

    An hour that a clock set back passes twice is the first, until times fall back in it. It is the
    second where times go on after it without a gap, and do not come from before it, or where they
    follow on others in it.

    Parameters
    ----------
    local_s : array_like
        In the order of rows.
    zone : str
    after_s : float
        UTC seconds of the row before them, as in an earlier part of a file.

    Examples
    --------
    >>> from datetime import UTC
    >>> local = [datetime(2026, 10, 25, 2, m, tzinfo=UTC).timestamp() for m in (50, 59, 0, 10)]
    >>> (np.diff(utc_from_local_s(local, "Europe/Berlin")) / 60).tolist()
    [9.0, 1.0, 10.0]
    """
    local = np.asarray(local_s, dtype=np.float64)
    shift, of = _shifts_s(local, zone)
    first_s = np.asarray(local - shift[of, 0].reshape(local.shape))
    later_s = np.maximum(shift[:, 0] - shift[:, 1], 0.0)
    known = np.isfinite(local)
    if later_s.any() and known.any():
        behind_s = after_s - float(first_s[known][0])
        later_s = later_s[of].reshape(local.shape)[known]
        first_s[known] += _second_pass_s(local[known], later_s, behind_s)
    return first_s


def change_notes(local_s: Floats, utc_s: Floats, zone: str, after_s: float = nan) -> list[str]:
    """Return notes on local times that a zone has not, or has twice where nothing tells them apart.

    Parameters
    ----------
    local_s : (N,) array
        As of :func:`utc_from_local_s`; NaN for times that state their zone.
    utc_s : (N,) array
        What it returned.
    zone : str
    after_s : float
        As of :func:`utc_from_local_s`.

    Examples
    --------
    >>> local = np.array([datetime(2026, 3, 29, 2, 30, tzinfo=UTC).timestamp()])
    >>> zone = "Europe/Berlin"
    >>> change_notes(local, utc_from_local_s(local, zone), zone)[0][:53]
    'time: 1 time is not of Europe/Berlin, from 2026-03-29'
    """
    local = local_s[np.isfinite(local_s)]
    if not local.size:
        return []
    shift, of = _shifts_s(local, zone)
    # The offset before a change is the first one, that after it the second one.
    skipped = shift[of, 0] < shift[of, 1]
    notes = []
    if skipped.any():
        at = int(np.flatnonzero(skipped)[0])
        before = _offset(float(shift[of[at], 0]))
        times = number_of(int(np.count_nonzero(skipped)), "time is", "times are")
        notes.append(
            f"time: {times} not of {zone}, from {_minute(local[at])} on, which a clock set forward "
            f"leaves out; taken for UTC{before} (likely: a clock that was not set, --zone {before};"
            " or a wrong zone)"
        )
    if doubled_s(local_s, utc_s, zone) and not isfinite(after_s):
        first, second = (_offset(one) for one in shift[of[0]].tolist())
        notes.append(
            f"time: all times, from {_minute(local[0])} on, lie in the hour that a clock of {zone} "
            f"passes twice; taken for the first time, UTC{first} (the second one: --zone {second}, "
            "or times with their offset)"
        )
    return notes


def doubled_s(local_s: Floats, utc_s: Floats, zone: str) -> float:
    """Return by how much later times are if an hour that comes twice is the second.

    It is 0 where they are not all of such an hour, taken for the first time.

    Parameters
    ----------
    local_s, utc_s, zone
        As of :func:`change_notes`.

    Examples
    --------
    >>> local = np.array([datetime(2026, 10, 25, 2, 30, tzinfo=UTC).timestamp()])
    >>> doubled_s(local, utc_from_local_s(local, "Europe/Berlin"), "Europe/Berlin")
    3600.0
    """
    known = np.isfinite(local_s)
    if not known.any():
        return 0.0
    shift, of = _shifts_s(local_s[known], zone)
    first = utc_s[known] == local_s[known] - shift[of, 0]
    return max(float((shift[:, 0] - shift[:, 1]).min()), 0.0) if first.all() else 0.0


def is_beside_change(utc_s: Floats, zone: str) -> bool:
    """Return whether some times are within an hour, or on both sides, of a zone's clock change."""
    rules = parse_zone(zone)
    quarters = np.unique(np.floor(utc_s[np.isfinite(utc_s)] / _QUARTER_S))
    near = np.unique(np.clip(quarters[:, None] + [-4, 4], -_FAR_QUARTERS, _FAR_QUARTERS))
    epoch = datetime(1970, 1, 1, tzinfo=UTC)
    ahead = {
        (epoch + timedelta(seconds=one * _QUARTER_S)).astimezone(rules).utcoffset()
        for one in near.tolist()
    }
    return len(ahead) > 1


def _minute(local_s: float) -> str:
    return f"{datetime(1970, 1, 1) + timedelta(seconds=local_s):%Y-%m-%d %H:%M}"


def _offset(shift_s: float) -> str:
    """Return an offset from UTC as ``--zone`` takes it."""
    minutes = round(abs(shift_s) / 60)
    return f"{'-' if shift_s < 0 else '+'}{minutes // 60:02d}:{minutes % 60:02d}"


def _shifts_s(local_s: Floats, zone: str) -> tuple[Floats, Ints]:
    """Return by how much local times are ahead of UTC, in the first and the second pass.

    Returns
    -------
    shift_s : (K, 2) array
        Of each quarter of an hour that occurs; the same twice but about a change of the clock.
    of : (N,) array of int
        The quarter of each time.
    """
    rules = parse_zone(zone)
    # The shift is constant within an hour's quarter in every zone.
    quarter = np.floor(np.where(np.isfinite(local_s), local_s, 0.0) / _QUARTER_S)
    values, of = np.unique(np.clip(quarter, -_FAR_QUARTERS, _FAR_QUARTERS), return_inverse=True)
    shift = np.empty((len(values), 2))
    for i, value in enumerate(values.tolist()):
        moment = datetime(1970, 1, 1) + timedelta(seconds=value * _QUARTER_S)
        for fold in (0, 1):
            offset = moment.replace(tzinfo=rules, fold=fold).utcoffset() or timedelta(0)
            shift[i, fold] = offset.total_seconds()
    return shift, of


def _second_pass_s(local_s: Floats, later_s: Floats, behind_s: float) -> Floats:
    """Return the seconds to add to rows of an hour's second pass, 0 in the first.

    Parameters
    ----------
    local_s, later_s : (N,) array
        Times in the order of rows, and by how much the second pass is later; 0 elsewhere.
    behind_s : float
        By how much the first of them would be before the row before it.
    """
    added_s, size = np.zeros(len(local_s)), len(local_s)
    edges = np.diff((later_s > 0).astype(np.int8), prepend=0, append=0)
    begins, ends = np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)
    steps = np.diff(local_s)
    near = (steps >= 0) & (steps <= LONGEST_STEP_S)
    for begin, end in zip(begins.tolist(), ends.tolist(), strict=True):
        falls = np.flatnonzero(steps[begin : end - 1] < -later_s[begin] / 2)
        comes = begin > 0 and near[begin - 1]
        goes_on = end < size and near[end - 1]
        follows = begin == 0 and later_s[0] / 2 < behind_s < 2 * later_s[0]
        if falls.size or follows or (goes_on and not comes):
            since = begin + int(falls[0]) + 1 if falls.size and not follows else begin
            added_s[since:end] = later_s[since:end]
    return added_s


def parse_zone(zone: str) -> tzinfo:
    """Return the time zone of a name (``Europe/Brussels``, ``UTC``) or an offset (``+01:00``).

    Raises
    ------
    ConfigError
        There is no such zone.

    Examples
    --------
    >>> parse_zone("+05:30")
    datetime.timezone(datetime.timedelta(seconds=19800))
    """
    if found := _OFFSET.fullmatch(zone.strip()):
        sign = -1 if found[1] == "-" else 1
        shift = sign * timedelta(hours=int(found[2]), minutes=int(found[3] or 0))
        if abs(shift) <= timedelta(hours=15):
            return timezone(shift)
    try:
        return ZoneInfo(zone.strip())
    except (ValueError, OSError, LookupError) as error:
        expected = "a zone such as Europe/Brussels or +01:00"
        raise fail(ConfigError, "--zone", expected, repr(zone), _zone_of(zone)) from error


def _zone_of(city: str) -> str:
    """Return the zone that is named after a city; "" without one."""
    end = f"/{city.strip().lower().replace(' ', '_')}"
    return next((name for name in sorted(available_timezones()) if name.lower().endswith(end)), "")
