"""Faults of cells: the prediction of one may be wrong altogether, for hundreds of metres.

A cell is switched off, moved or rotated, or differs in some other way from what the prediction
knows; then its readings say nothing of the position. Each hypothesis keeps the log odds of each
cell's fault, and a reading's likelihood is the mixture over both.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mapfilter._kernels import exp32, log32

MOST_READING, MOST_KEPT = 20.0, 8.0
"""Bounds of the log odds after a reading, and of those that hypotheses keep: faults may end."""

_F, _ONE, _ZERO = np.float32, np.float32(1.0), np.float32(0.0)


@njit(inline="always")
def mixed(
    before: np.float32, other: np.float32, right: np.float32
) -> tuple[np.float32, np.float32, np.float32]:
    """Mix the likelihoods of a reading with and without a fault of its cell.

    Parameters
    ----------
    before : float
        Log odds of the fault.
    other, right : float
        Log-likelihood of the reading with and without it.

    Returns
    -------
    fine : float
        Probability that there is none, given the reading.
    gained : float
        Log-likelihood of the reading.
    after : float
        Log odds of the fault, given the reading.
    """
    fine, gained, factor, after = mixed_but_for_logarithm(before, other, right)
    return fine, gained - log32(factor), after


@njit(inline="always")
def mixed_but_for_logarithm(
    before: np.float32, other: np.float32, right: np.float32
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Mix likelihoods as :func:`mixed` does, without a logarithm.

    Returns
    -------
    fine : float
        Probability that there is no fault, given the reading.
    gained, factor : float
        The log-likelihood of the reading is the first less the logarithm of the second. The product
        of four factors is a normal number in single precision.
    after : float
        Log odds of the fault, given the reading.
    """
    most, cap = _F(MOST_READING), _F(MOST_KEPT)
    whole = before + other - right
    odds = whole if whole < most else most
    odds = odds if odds > -most else -most
    fine = _ONE / (_ONE + exp32(odds))
    # Beyond the bound the logarithm of one plus the odds is that of the odds.
    beyond = whole - odds if whole > odds else _ZERO
    known = before if before < most else most
    factor = fine * (_ONE + exp32(known))
    after = whole if whole < cap else cap
    # Faults that are next to impossible from the start stay so.
    least = before if before < -cap else -cap
    after = after if after > least else least
    return fine, right + beyond - (before - known), factor, after
