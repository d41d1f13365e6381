"""What hypotheses keep of the errors of levels, as it changes over a distance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from mapfilter._types import Floats32, Ints32

_F = np.float32
_NONE: Ints32 = np.empty(0, dtype=np.int32)


class Ageing(NamedTuple):
    """What hypotheses kept before a distance, and what they keep after it.

    Both are records (:mod:`mapfilter.models.record_tiles`), whose numbers are as in
    :mod:`mapfilter.models.level_kernels`.

    Parameters
    ----------
    before : ndarray of float32, shape (M, P)
    chosen : ndarray of int32, shape (N,) or (0,)
        Record of each hypothesis in ``before``; none if each has its own.
    decay : ndarray of float32, shape (D,)
        Factors of the means, which are the first numbers.
    fault_keep : float
        By how much less the log odds of faults, the other numbers, differ from ``fault_log_odds``.
    due : bool
        Whether anything is to be aged; else ``now`` is ``before``.
    now : ndarray of float32, shape (N, P)
    """

    before: Floats32
    chosen: Ints32
    decay: Floats32
    fault_keep: float
    fault_log_odds: float
    due: bool
    now: Floats32


def as_it_is(records: Floats32) -> Ageing:
    """Return the ageing of records (N, P) that need none: nothing is due."""
    return Ageing(records, _NONE, np.zeros(0, dtype=np.float32), 1.0, 0.0, False, records)


@njit(error_model="numpy", cache=True, nogil=True)
def factors(ageing: Ageing) -> Floats32:
    """Return what the numbers of a record decay by, and to, (2, P)."""
    found, size = np.zeros((2, ageing.now.shape[1]), dtype=np.float32), ageing.decay.size
    for d in range(found.shape[1]):
        found[0, d] = _F(ageing.fault_keep)
        if d < size:
            found[0, d] = ageing.decay[d]
        elif ageing.due:
            found[1, d] = _F(ageing.fault_log_odds)
    return found


@njit(error_model="numpy", fastmath={"contract"}, cache=True, nogil=True)
def age(first: int, stop: int, ageing: Ageing) -> None:
    """Fill the records of hypotheses ``first`` to ``stop``."""
    if not ageing.due:
        return
    both, chosen = factors(ageing), ageing.chosen.size > 0
    factor, usual = both[0], both[1]
    for i in range(first, stop):
        old, new = ageing.before[ageing.chosen[i] if chosen else i], ageing.now[i]
        for d in range(new.size):
            new[d] = usual[d] + (old[d] - usual[d]) * factor[d]
