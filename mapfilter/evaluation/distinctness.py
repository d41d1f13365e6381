"""How well each point can be told from all others of its serving cell, in bits.

Of two places that differ by levels d, one report with error covariance S tells which it is with
a probability of error of at most half the Bhattacharyya coefficient, exp(-d' S⁻¹ d / 8) (Kailath
1967, "The divergence and Bhattacharyya distance measures in signal selection"). A point's bits are
minus the logarithm of the mean of these over the places of its cell: with b bits, one place in 2^b
is left on average.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numba import njit

from mapfilter._types import Floats
from mapfilter.evaluation.radio_map import (
    MOST_HEARD,
    ErrorModel,
    RadioMap,
    distance_squared,
    heard_cells,
)

COMPARED = 500


@dataclass(frozen=True, slots=True, eq=False)
class Distinctness:
    """What one report tells at each point, shape (N,) each, in the order of the points.

    Parameters
    ----------
    cell_bits : numpy.ndarray
        From the name of the serving cell: log2 of all points over the cell's. Exact.
    level_bits : numpy.ndarray
        From the levels, among the points of that cell. Exact for the error model, save that at most
        500 places of a cell, evenly chosen, stand for all.
    """

    cell_bits: Floats
    level_bits: Floats


def distinctness(radio: RadioMap, errors: ErrorModel) -> Distinctness:
    """Return what one report tells at every point of a radio map."""
    first, point = radio.points_by_cell()
    counts = np.diff(first)
    chosen = [
        point[begin:end][np.linspace(0, end - begin - 1, min(COMPARED, end - begin)).astype(int)]
        for begin, end in pairwise(first)
    ]
    compared = np.concatenate(chosen)
    from_ = np.concatenate([[0], np.cumsum([part.size for part in chosen])])
    levels = radio.level_dbm[radio.row, radio.col]
    mean = _mean_overlap(
        levels,
        radio.server,
        from_,
        levels[compared],
        radio.site,
        radio.floor_dbm,
        errors.deviation_db**2,
        errors.site_share,
    )
    cell_bits = np.log2(len(radio) / counts[radio.server])
    return Distinctness(cell_bits, -np.log2(np.maximum(mean, 1.0 / len(radio))))


@njit(cache=True)
def _mean_overlap(  # type: ignore[no-untyped-def]
    levels, server, first, others, site, floor_dbm, variance, share
):
    mean = np.zeros(server.size)
    cells = np.empty(MOST_HEARD, dtype=np.int64)
    off_db, part = np.empty(MOST_HEARD), np.empty(MOST_HEARD)
    scale = -1.0 / (8.0 * variance * (1.0 - share))
    for i in range(server.size):
        heard = heard_cells(levels[i], floor_dbm, site, share, cells, part)
        begin, end = first[server[i]], first[server[i] + 1]
        total = 0.0
        for other in range(begin, end):
            for j in range(heard):
                off_db[j] = levels[i, cells[j]] - others[other, cells[j]]
            total += np.exp(scale * distance_squared(off_db, part, heard))
        mean[i] = total / max(end - begin, 1)
    return mean
