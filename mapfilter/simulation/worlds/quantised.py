"""Levels as phones report them: steps of 1 dB or 2 dB, or four bars.

*1dB*
    The bin's centre, -110.5 + RXLEV dBm, RXLEV 0 to 63 (3GPP TS 45.008, section 8.1.4).
*2dB*
    ``-113 + 2 n`` dBm, n from 0 to 31: the signal strength of AT+CSQ (3GPP TS 27.007, section 8.5),
    which Android calls ASU.
*bars*
    What is left where a program keeps Android's signal level: bars begin at -103, -97 and -89 dBm
    (``SignalStrength`` of GSM: ASU 5, 8 and 12). A report states the middle of a bar; the lowest
    and the highest are censored at their limit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mapfilter._types import Floats

ScaleName = Literal["1dB", "2dB", "bars"]
Reported = tuple[Floats, NDArray[np.int8]]

BARS_DBM = (-103.0, -97.0, -89.0)
"""Where the second, third and fourth bar begin."""


def in_1_db(level_dbm: Floats) -> Reported:
    """Return levels in steps of 1 dB, and whether they are censored (-1 below, 1 above).

    Examples
    --------
    >>> level_dbm, censored = in_1_db(np.array([-120.0, -80.2, -30.0]))
    >>> level_dbm.tolist(), censored.tolist()
    ([-110.5, -80.5, -47.5], [-1, 0, 1])
    """
    level = np.clip(np.floor(level_dbm) + 0.5, -110.5, -47.5)
    return level, _censored(level <= -110.5, level >= -47.5)


def in_2_db(level_dbm: Floats) -> Reported:
    """Return levels in steps of 2 dB, and whether they are censored.

    Examples
    --------
    >>> level_dbm, censored = in_2_db(np.array([-120.0, -80.2, -30.0]))
    >>> level_dbm.tolist(), censored.tolist()
    ([-113.0, -81.0, -51.0], [-1, 0, 1])
    """
    number = np.clip(np.round((level_dbm + 113.0) / 2), 0, 31)
    return -113.0 + 2 * number, _censored(number == 0, number == 31)


def in_bars(level_dbm: Floats) -> Reported:
    """Return levels in four bars, and whether they are censored.

    Examples
    --------
    >>> level_dbm, censored = in_bars(np.array([-120.0, -99.0, -95.0, -70.0]))
    >>> level_dbm.tolist(), censored.tolist()
    ([-103.0, -100.0, -93.0, -89.0], [-1, 0, 0, 1])
    """
    bar = np.digitize(level_dbm, BARS_DBM)
    shown = np.array([BARS_DBM[0], np.mean(BARS_DBM[:2]), np.mean(BARS_DBM[1:]), BARS_DBM[2]])
    return shown[bar], _censored(bar == 0, bar == len(BARS_DBM))


def _censored(below: NDArray[np.bool_], above: NDArray[np.bool_]) -> NDArray[np.int8]:
    return above.astype(np.int8) - below.astype(np.int8)


SCALES: Mapping[ScaleName, Callable[[Floats], Reported]] = MappingProxyType(
    {"1dB": in_1_db, "2dB": in_2_db, "bars": in_bars}
)
"""The scales by name."""
