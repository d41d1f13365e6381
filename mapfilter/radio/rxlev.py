"""The RXLEV scale of GSM measurement reports, and the cells that a reported neighbour may be.

RXLEV ``n`` (1..62) is a level in [-111 + n, -110 + n) dBm, read as the bin's centre, -110.5 + n
dBm. RXLEV 0 is any level below -110 dBm, RXLEV 63 any of -48 dBm or more: both are censored (3GPP
TS 45.008, section 8.1.4). Raw RXLEV and dBm never share a name.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapfilter._types import Floats
from mapfilter.radio.cells import CellPlan

LARGEST_RXLEV = 63


def quantise_level_dbm(level_dbm: ArrayLike) -> tuple[Floats, NDArray[np.int8]]:
    """Return levels as a report gives them, of the same shape.

    Returns
    -------
    level_dbm : ndarray of float64
        Bin centres, -110.5 + RXLEV; nominal where censored. NaN stays NaN.
    censored : ndarray of int8
        -1 below the scale, 1 above it, 0 for a value and NaN.

    Examples
    --------
    >>> level_dbm, censored = quantise_level_dbm([-120.0, -80.2, -30.0])
    >>> level_dbm.tolist(), censored.tolist()
    ([-110.5, -80.5, -47.5], [-1, 0, 1])
    """
    level = np.asarray(level_dbm, dtype=np.float64)
    rxlev = np.clip(np.floor(level + 111.0), 0.0, float(LARGEST_RXLEV))
    censored = (rxlev == LARGEST_RXLEV).astype(np.int8) - (rxlev == 0).astype(np.int8)
    return rxlev - 110.5, np.asarray(censored, dtype=np.int8)


def resolve_neighbours(plan: CellPlan, arfcn: int | None, bsic: int | None) -> tuple[str, ...]:
    """Return the ids of all cells that a neighbour report may mean, in the plan's order.

    A report names a neighbour only by BCCH carrier and BSIC; carriers are reused, so that there
    may be several candidates, or none.

    Parameters
    ----------
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
