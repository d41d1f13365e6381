"""Why the times of a file fall back: a clock set back by an hour, or one of twelve hours."""

from __future__ import annotations

from mapfilter._constants import HOUR_S
from mapfilter._types import Floats
from mapfilter.tracks.readers.recorded.recording import Clock

_HALF_DAY_S, _LONGEST_PAUSE_S = 12 * HOUR_S, 600.0
_HOUR = "a clock that was set back by an hour: --zone"
_TWELVE = (
    "hours of 1 to 12 without AM or PM, which begin anew after 12:59: write those of 0 to 23, or "
    "AM or PM after the time"
)


def set_back_by(falls_s: Floats, clock: Clock) -> str:
    """Return the likely cause of times that fall back; "" for none, as of rows out of order.

    Parameters
    ----------
    falls_s : (N,) array
        By how much, each more than 0.
    clock : Clock

    Examples
    --------
    >>> import numpy as np
    >>> set_back_by(np.array([3599.0]), Clock("local"))
    'a clock that was set back by an hour: --zone'
    >>> set_back_by(np.array([43199.0]), Clock("utc"))[:34]
    'hours of 1 to 12 without AM or PM,'
    >>> set_back_by(np.array([3599.0, 1.0]), Clock("local"))
    ''
    """
    if len(falls_s) != 1 or clock.kind not in ("local", "utc"):
        return ""
    fall_s = float(falls_s[0])
    if HOUR_S / 2 < fall_s <= HOUR_S and clock == Clock("local"):
        return _HOUR
    return _TWELVE if _HALF_DAY_S - _LONGEST_PAUSE_S < fall_s <= _HALF_DAY_S else ""
