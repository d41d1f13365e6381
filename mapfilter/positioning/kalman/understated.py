"""By how much fixes understate what lasts of their errors, by dead reckoning over half a minute.

Between houses a receiver that states 3 m errs by 30 m to one side for a while. Over half a minute
steps and wheels are off by less: the distance of a fix from where a belief of then has been led
without any has a covariance of what motion adds, and of two errors of fixes, which by then are
hardly those of each other. The times u by which variances are larger than stated take one of a few
values, and may change: a hidden Markov chain, whose probabilities are Bayes' rule's.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from mapfilter._types import Floats
from mapfilter.positioning.kalman.coast import Coast

_TIMES = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
_FIRST = (0.9, 0.04, 0.02, 0.015, 0.01, 0.01, 0.005)
"""Values of u, and their prior probabilities, which they also return to."""
_CHANGES = 0.1
"""Probability that u changes between two comparisons."""
_EVERY_S, _LEAST_S, _MOST_S = 29.0, 29.0, 50.0
"""Time between two comparisons, and ages of the belief that is compared."""
_USUAL, _BEYOND = 0.8, 0.4
"""Variance of the difference of two errors half a minute apart, in that of one: of usual ones, and
of what is beyond them, which lasts for longer."""
_CONFIRMED, _SHOWN = 2, 1.5
"""Comparisons in a row that show a value: jumps of headings, and fixes that begin to lead away, are
noticed by then. Value from which on variances are raised."""


@dataclass(frozen=True, slots=True)
class Understated:
    """Probabilities of the times u.

    Parameters
    ----------
    shares : tuple of float
    compared_s : float
        Time of the last comparison.
    means : tuple of float
        Of u, after each of the last comparisons.
    """

    shares: tuple[float, ...] = _FIRST
    compared_s: float = -inf
    means: tuple[float, ...] = (1.0,) * _CONFIRMED

    @property
    def times(self) -> float:
        """The least mean of u of late, 1 where that is hardly more."""
        least = min(self.means)
        return least if least >= _SHOWN else 1.0

    def at_fix(
        self, time_s: float, place_m: Floats, stated_m2: Floats, kept: Iterable[Coast]
    ) -> Understated:
        """Return them after a fix of a stated covariance beside beliefs without fixes."""
        if time_s - self.compared_s < _EVERY_S:
            return self
        old = [one for one in kept if _LEAST_S <= time_s - one.begun_s <= _MOST_S]
        if not old:
            return self
        off_m, moved_m2 = old[-1].beside(place_m)
        nats = []
        for times in _TIMES:
            whole_m2 = moved_m2 + (_USUAL + _BEYOND * (times - 1)) * stated_m2
            squared = float(off_m @ np.linalg.solve(whole_m2, off_m))
            nats.append(-0.5 * squared - 0.5 * float(np.log(np.linalg.det(whole_m2))))
        shares = (1 - _CHANGES) * np.array(self.shares) + _CHANGES * np.array(_FIRST)
        shares = shares * np.exp(np.array(nats) - max(nats))
        shares /= shares.sum()
        means = (*self.means[1:], float(shares @ _TIMES))
        return replace(self, shares=tuple(shares.tolist()), compared_s=time_s, means=means)
