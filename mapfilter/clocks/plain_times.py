"""Times of one plain layout throughout, which most files have, read at once."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from mapfilter._types import Floats
from mapfilter.clocks.local_times import utc_from_local_s

_EARLIEST_S, _LATEST_S = -2_208_988_800.0, 4_102_444_800.0
"""The years 1900 to 2099."""


def plain_times(
    column: pa.ChunkedArray, zone: str, layout: str, after_s: float
) -> tuple[Floats, bool] | None:
    """Return times that are all of one plain layout, all of them with a zone or none; else None.

    It gives what :func:`mapfilter.clocks.times.parse_times` does, in a tenth of its
    time.

    Parameters
    ----------
    column : pyarrow.ChunkedArray of str
    zone, layout, after_s
        As of :func:`mapfilter.clocks.times.parse_times`.

    Returns
    -------
    time_s : (N,) array
        UTC seconds, NaN beyond the years 1900 to 2099. Without a zone, as if the zone were UTC.
    zoned : bool
        Whether the times are UTC: by their own zone or by ``zone``.
    """
    trimmed = pc.utf8_trim_whitespace(column)
    for own in ("UTC", None) if layout == "ISO8601" else (None,):
        try:
            if layout == "ISO8601":
                moments = pc.cast(trimmed, pa.timestamp("ns", own))
            else:
                moments = pc.strptime(trimmed, format=layout, unit="ns")
        except pa.ArrowInvalid:
            continue
        ns = np.asarray(pc.cast(moments, pa.int64()).to_numpy(), dtype=np.int64)
        time_s = ns // 10**9 + ns % 10**9 / 1e9
        time_s[(time_s < _EARLIEST_S) | (time_s >= _LATEST_S)] = np.nan
        if own is None and zone:
            time_s = utc_from_local_s(time_s, zone, after_s)
        return time_s, bool(own or zone)
    return None
