"""The upper ends of scales of levels: what phones state for any level as strong or stronger."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Bools, Floats

STRONGEST_DBM = (-24.0, -25.0, -31.0, -43.0, -44.0, -47.0, -47.5, -48.0, -51.0)
"""Strongest levels of reports.

RSCP (3GPP TS 25.133: -25 dBm or more), SS-RSRP (TS 38.133: -31), RSRP (TS 36.133: -44), RXLEV 63
(TS 45.008: -48, or -47 and -47.5 where a program adds 110 or 110.5), and the signal strength of
modems and of Android, 31 (TS 27.007: -51); -24 and -43 are those of Android.
"""

_LEAST_ROWS = 5
_BELOW_DB, _TIMES = 2.5, 3


def at_scale_end(level_dbm: Floats) -> Bools:
    """Return which levels are bounds: the strongest ones, at an end of a scale, in a pile.

    Levels become rarer towards the strongest one; on one way past a mast they are in the uppermost
    2 dB for up to 2.4 times as long as in the next 2 dB. Where more than three times as many are at
    the end of a known scale as in the 2.5 dB below, what lies beyond was put there. At least five
    have to be.

    Parameters
    ----------
    level_dbm : (N,) array of float
        NaN for none.

    Examples
    --------
    >>> at_scale_end(np.array([-51.0] * 7 + [-53.0] * 2 + [np.nan])).sum()
    np.int64(7)
    >>> at_scale_end(np.array([-51.0] * 7 + [-53.0] * 3)).any()
    np.False_
    """
    known = level_dbm[np.isfinite(level_dbm)]
    strongest_dbm = known.max(initial=-np.inf)
    if strongest_dbm not in STRONGEST_DBM:
        return np.zeros(len(level_dbm), dtype=np.bool_)
    at_end = level_dbm == strongest_dbm
    count = int(at_end.sum())
    below = int((known >= strongest_dbm - _BELOW_DB).sum()) - count
    if count < _LEAST_ROWS or count <= _TIMES * below:
        return np.zeros(len(level_dbm), dtype=np.bool_)
    return np.asarray(at_end, dtype=np.bool_)
