"""What hypotheses keep of the errors of levels, as it changes over a distance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from mapfilter._types import Bools, Floats32, Ints32

_F = np.float32
_NONE: Ints32 = np.empty(0, dtype=np.int32)


class Ageing(NamedTuple):
    """What hypotheses kept before a distance, and what they keep after it.

    Rows are as in :mod:`mapfilter.models.level_kernels`.

    Parameters
    ----------
    before : ndarray of float32, shape (W, M)
    chosen : ndarray of int32, shape (N,) or (0,)
        Column of each hypothesis in ``before``; none if each has its own.
    decay : ndarray of float32, shape (D,)
        Factors of the means, which are the first rows.
    fault_keep : float
        By how much less the log odds of faults, the other rows, differ from ``fault_log_odds``.
    due : ndarray of bool, shape (W,)
        Rows that :func:`age` fills; the others are filled already.
    now : ndarray of float32, shape (W, N)
    """

    before: Floats32
    chosen: Ints32
    decay: Floats32
    fault_keep: float
    fault_log_odds: float
    due: Bools
    now: Floats32

    def of_row(self, row: int) -> Ageing:
        """Return that of a single row, if it is due."""
        only = np.zeros(self.due.size, dtype=np.bool_)
        only[row] = self.due[row]
        return Ageing(*self[:5], only, self.now)

    def without_row(self, row: int) -> Ageing:
        """Return that of the other rows."""
        others = self.due.copy()
        others[row] = False
        return Ageing(*self[:5], others, self.now)


def as_it_is(kept: Floats32) -> Ageing:
    """Return the ageing of what needs none (W, N): nothing is due."""
    nothing, width = np.zeros(0, dtype=np.float32), kept.shape[0]
    return Ageing(kept, _NONE, nothing, 1.0, 0.0, np.zeros(width, dtype=np.bool_), kept)


@njit(error_model="numpy", fastmath={"contract"}, cache=True, nogil=True)
def age(first: int, stop: int, ageing: Ageing) -> None:
    """Fill the rows that are due of hypotheses ``first`` to ``stop``."""
    means, chosen = ageing.decay.size, ageing.chosen.size > 0
    keep, usual = _F(ageing.fault_keep), _F(ageing.fault_log_odds)
    for d in range(ageing.due.size):
        if not ageing.due[d]:
            continue
        to = ageing.now[d, first:stop]
        factor = ageing.decay[d] if d < means else keep
        if chosen:
            row, at = ageing.before[d], ageing.chosen[first:stop]
            if d < means:
                for i in range(to.size):
                    to[i] = factor * row[np.uint32(at[i])]
            else:
                for i in range(to.size):
                    to[i] = usual + (row[np.uint32(at[i])] - usual) * factor
        else:
            row = ageing.before[d, first:stop]
            if d < means:
                for i in range(to.size):
                    to[i] = factor * row[i]
            else:
                for i in range(to.size):
                    to[i] = usual + (row[i] - usual) * factor
