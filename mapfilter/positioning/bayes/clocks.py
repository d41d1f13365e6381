"""What is known of the clocks of reports and motion: whether they are one.

:mod:`mapfilter.positioning.bayes.clock_check` compares them.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, nan
from typing import NamedTuple

import numpy as np

from mapfilter._same import EqualByContent
from mapfilter._types import Floats, Floats32
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.level_memory import LevelMemory

APART_S: Floats = np.array([-40, -30, -20, -13, -7, -3, 0, 3, 7, 13, 20, 30, 40], dtype=np.float64)
"""How much later than a report the position was that it belongs to."""
LATE_S = 3.0
"""Seconds by which reports are late without another clock."""
SAME = int(np.flatnonzero(APART_S == 0.0)[0])
_TOLD_FROM_S, _TOLD_FROM = 7.0, 0.9
"""Seconds, and probability of as many and more, from which on a difference is reported."""
_APART_BEFOREHAND = 0.05
_PRIOR: Floats = np.full(APART_S.size, log(_APART_BEFOREHAND / (APART_S.size - 1)))
_PRIOR[SAME] = log(1 - _APART_BEFOREHAND)


class HeldReport(NamedTuple):
    """A report that is compared with positions once those after it are known."""

    time_s: float
    travelled_m: float
    serving: int
    levels: LevelReport


@dataclass(frozen=True, slots=True, eq=False)
class Clocks(EqualByContent):
    """What reports say of the difference of the clocks.

    Parameters
    ----------
    trace : ndarray, shape (N, 3)
        Time in s, east and north in m of positions of the last minutes, in the area's frame.
    travelled_m : float
        Distance travelled at the last one.
    held : tuple of HeldReport
        Reports that are still to be compared.
    kept : ndarray of float32, shape (W, K), or None
        Errors of levels, if the clocks differ by each of :data:`APART_S`.
    memory : LevelMemory or None
    log_weight : ndarray, shape (K,)
        Log-likelihoods of the differences.
    compared_m : float
        Distance travelled at the last report that was compared; NaN before the first one.
    wider_m : tuple of float
        By how much radii of 50, 67, 95 and 99 % are wider.
    away : float
        Probability that the position is more than 50 m off for this reason.
    told : bool
        Whether a difference has been reported.
    """

    trace: Floats
    travelled_m: float = nan
    held: tuple[HeldReport, ...] = ()
    kept: Floats32 | None = None
    memory: LevelMemory | None = None
    log_weight: Floats | None = None
    compared_m: float = nan
    wider_m: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    away: float = 0.0
    told: bool = False

    @property
    def probability(self) -> Floats:
        """Probabilities of the differences (K,)."""
        if self.log_weight is None:
            return np.exp(_PRIOR)
        total = _PRIOR + self.log_weight
        found: Floats = np.exp(total - total.max())
        found /= found.sum()
        return found

    @property
    def apart_s(self) -> float:
        """The most probable difference, where one is to be reported; NaN for none."""
        found = self.probability
        if found[np.abs(APART_S) >= _TOLD_FROM_S].sum() < _TOLD_FROM:
            return nan
        return float(APART_S[np.argmax(found)])
