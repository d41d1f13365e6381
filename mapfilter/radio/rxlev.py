"""The RXLEV scale of GSM measurement reports, and who a reported neighbour may be.

RXLEV ``n`` (1..62) means a level in [-111 + n, -110 + n) dBm and is read as the bin's centre,
-110.5 + n dBm. RXLEV 0 says only "below -110 dBm", RXLEV 63 only "-48 dBm or more": both are
censored (3GPP TS 45.008, section 8.1.4). Raw RXLEV and dBm never share a name.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapfilter._types import Floats, Ints
from mapfilter.errors import InputError, fail
from mapfilter.radio.cells import CellPlan

LOWEST_LEVEL_DBM = -110.0
"""RXLEV 0 means a level below this."""
HIGHEST_LEVEL_DBM = -48.0
"""RXLEV 63 means this level or more."""
_LARGEST_RXLEV = 63


class Censored(IntEnum):
    """Whether a reported level is a value, or only a bound on it."""

    BELOW = -1
    INSIDE = 0
    ABOVE = 1


def level_dbm_from_rxlev(rxlev: ArrayLike) -> Floats:
    """Return the bin centres -110.5 + n of raw RXLEV values, in dBm.

    For the censored values 0 and 63 this is a nominal figure; see :func:`censored_from_rxlev`.

    Parameters
    ----------
    rxlev : array_like of int, any shape
        Raw RXLEV, 0..63.

    Raises
    ------
    InputError
        A value is not a whole number in 0..63.

    Examples
    --------
    >>> level_dbm_from_rxlev([1, 62]).tolist()
    [-109.5, -48.5]
    """
    values = _checked_rxlev(rxlev)
    return values - 110.5


def censored_from_rxlev(rxlev: ArrayLike) -> NDArray[np.int8]:
    """Return :class:`Censored` values (int8) of raw RXLEV values.

    Raises
    ------
    InputError
        A value is not a whole number in 0..63.

    Examples
    --------
    >>> censored_from_rxlev([0, 30, 63]).tolist()
    [-1, 0, 1]
    """
    return _censored(_checked_rxlev(rxlev))


def rxlev_from_level_dbm(level_dbm: ArrayLike) -> Ints:
    """Return the raw RXLEV, 0..63, that a phone reports for levels in dBm.

    Parameters
    ----------
    level_dbm : array_like of float, any shape
        Levels; infinities are allowed and censored.

    Raises
    ------
    InputError
        A level is NaN: there is nothing to report.

    Examples
    --------
    >>> rxlev_from_level_dbm([-140.0, -110.0, -80.2, -48.0]).tolist()
    [0, 1, 30, 63]
    """
    level = np.asarray(level_dbm, dtype=np.float64)
    if np.isnan(level).any():
        raise fail(InputError, "level_dbm", "a level in dBm", "NaN", "no level at that place")
    return _rxlev(level).astype(np.int64)


def quantise_level_dbm(level_dbm: ArrayLike) -> tuple[Floats, NDArray[np.int8]]:
    """Return levels as a report gives them: bin centres in dBm, and :class:`Censored` values.

    NaN stays NaN and is INSIDE.

    Parameters
    ----------
    level_dbm : array_like of float, any shape

    Returns
    -------
    level_dbm : ndarray of float64, same shape
        -110.5 + RXLEV; nominal where censored.
    censored : ndarray of int8, same shape

    Examples
    --------
    >>> level_dbm, censored = quantise_level_dbm([-120.0, -80.2, -30.0])
    >>> level_dbm.tolist(), censored.tolist()
    ([-110.5, -80.5, -47.5], [-1, 0, 1])
    """
    rxlev = _rxlev(np.asarray(level_dbm, dtype=np.float64))
    return rxlev - 110.5, _censored(rxlev)


def resolve_neighbours(plan: CellPlan, arfcn: int | None, bsic: int | None) -> tuple[str, ...]:
    """Return the ids of all cells that a neighbour report may mean, in the plan's order.

    A report names a neighbour only by BCCH carrier and BSIC; carriers are reused, so that there
    may be several candidates, or none.

    Parameters
    ----------
    plan : CellPlan
    arfcn : int or None
        BCCH carrier; without it nothing can be resolved.
    bsic : int or None
        Base station identity code; without it every cell on the carrier is a candidate.
    """
    if arfcn is None:
        return ()
    if bsic is None:
        return tuple(cell.id for cell in plan.cells if cell.arfcn == arfcn)
    return plan.ids_by_carrier.get((int(arfcn), int(bsic)), ())


def _rxlev(level_dbm: Floats) -> Floats:
    return np.clip(np.floor(level_dbm + 111.0), 0.0, float(_LARGEST_RXLEV))


def _censored(rxlev: Floats) -> NDArray[np.int8]:
    above = (rxlev == _LARGEST_RXLEV).astype(np.int8)
    below = (rxlev == 0).astype(np.int8)
    return np.asarray(above - below, dtype=np.int8)


def _checked_rxlev(rxlev: ArrayLike) -> Floats:
    values = np.asarray(rxlev, dtype=np.float64)
    wrong = ~((values >= 0) & (values <= _LARGEST_RXLEV) & (values == np.floor(values)))
    if wrong.any():
        first = float(values[wrong].flat[0])
        hint = "dBm given for RXLEV" if first < 0 else ""
        raise fail(InputError, "rxlev", "whole numbers in 0..63", f"{first:g}", hint)
    return values
