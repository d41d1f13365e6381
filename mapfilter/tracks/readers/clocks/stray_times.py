"""Times of a recording's rows that are no dates, or lie days away from all others."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mapfilter._constants import DAY_S, GPS_EPOCH_S
from mapfilter._types import Bools, Floats
from mapfilter.tracks.readers.recorded.recording import Clock

_EARLIEST_UTC_S, _LATEST_UTC_S = GPS_EPOCH_S, 4_102_444_800.0
_TICKS = "likely: ticks since a phone was started; their unit in the header, as time_ms, reads them"
_JUMP_S = DAY_S
_STRAY_SHARE = 0.1


def stray_times(clock: Clock, time_s: Floats, good: Bools) -> Iterator[tuple[Bools, str]]:
    """Yield rows whose times cannot be those of the recording, and why.

    Parameters
    ----------
    clock : Clock
        Of a monotonic one any time may be.
    time_s : (N,) array of float
        In seconds; as Unix times but of a monotonic clock.
    good : (N,) array of bool
        Rows that count; others are never yielded.

    Examples
    --------
    >>> time_s = 1.7e9 + np.array([0.0, 1.0, 2.0, 3.0, 1e6])
    >>> (stray, why), = stray_times(Clock("utc"), time_s, np.ones(5, dtype=bool))
    >>> stray.tolist(), why
    ([False, False, False, False, True], 'time: more than a day away from all other rows')
    """
    kept = good
    if clock.kind != "monotonic":
        is_date = (time_s >= _EARLIEST_UTC_S) & (time_s <= _LATEST_UTC_S)
        kept = good & is_date
        outside = good & ~is_date
        if outside.any():
            # Milliseconds or nanoseconds of a phone that runs for days look like Unix times.
            early = bool((time_s[good] < _EARLIEST_UTC_S).all())
            yield outside, f"time: not between 1980 and 2100{f' ({_TICKS})' if early else ''}"
    index = np.flatnonzero(kept)
    if index.size < 3:
        return
    order = index[np.argsort(time_s[index], kind="stable")]
    group = np.concatenate([[0], np.cumsum(np.diff(time_s[order]) > _JUMP_S)])
    sizes = np.bincount(group)
    stray = order[sizes[group] < max(2, _STRAY_SHARE * sizes.max())]
    if len(sizes) > 1 and 0 < stray.size < index.size:
        far = np.zeros(len(time_s), dtype=bool)
        far[stray] = True
        yield far, "time: more than a day away from all other rows"
