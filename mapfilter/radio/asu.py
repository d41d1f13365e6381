"""Arbitrary strength units (ASU) in columns of levels, and levels that have lost their sign."""

from __future__ import annotations

LARGEST_ASU = 97
"""Of any technology: 3GPP TS 27.007, +CESQ."""
LOST_SIGN = "a lost sign (70 for -70 dBm)"
_LARGEST_LOSS_DB = 200
UNKNOWN_ASU = (99, 255)
"""Units that mean an unknown level."""
_LEAST_SHARE = 0.01


def is_above_asu(level: float) -> bool:
    """Return whether a positive level is too large for an ASU, and could be a dBm without sign.

    Examples
    --------
    >>> [is_above_asu(level) for level in (68.0, 99.0, 104.0, 2147483647.0)]
    [False, False, True, False]
    """
    return LARGEST_ASU < level <= _LARGEST_LOSS_DB and level not in UNKNOWN_ASU


def have_lost_sign(above: int, positive: int, levels: int) -> bool:
    """Return whether positive levels of a column are no ASU, but dBm without their sign.

    Parameters
    ----------
    above, positive, levels : int
        How many are too large for an ASU, how many are positive, and how many there are.

    Examples
    --------
    >>> have_lost_sign(10, 177, 177), have_lost_sign(1, 177, 177), have_lost_sign(10, 12, 177)
    (True, False, False)
    """
    return above > 0 and above >= _LEAST_SHARE * positive and positive > levels / 2
