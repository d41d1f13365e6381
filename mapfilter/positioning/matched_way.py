"""Which way a belief is on, and how probably."""

from __future__ import annotations

import numpy as np
from numba import njit

from mapfilter._types import Floats32, Ints32
from mapfilter.positioning.bayes.area_map import AreaMap


def matched_way(
    area: AreaMap, east_m: Floats32, north_m: Floats32, weight: Floats32
) -> tuple[int, float]:
    """Return the way whose nearest points hold the largest share of a belief, and that share.

    Parameters
    ----------
    area : AreaMap
    east_m, north_m, weight : ndarray of float32, shape (N,)
        In the area's frame; weights sum to one.

    Returns
    -------
    way_id : int
        0 where the largest share lies in squares, off all ways.
    probability : float
    """
    lattice = area.lattice
    rank, share = _heaviest(
        east_m, north_m, weight, area.way_rank, len(area.way_ids), lattice.rows, lattice.cols,
        1 / lattice.resolution_m,
    )  # fmt: skip
    return int(area.way_ids[rank]), min(float(share), 1.0)


@njit(error_model="numpy", cache=True)
def _heaviest(
    east_m: Floats32, north_m: Floats32, weight: Floats32, way_rank: Ints32,
    ways: int, rows: int, cols: int, per_m: float,
) -> tuple[int, float]:  # fmt: skip
    mass = np.zeros(ways, dtype=np.float32)
    for i in range(weight.size):
        col = min(max(int(east_m[i] * per_m), 0), cols - 1)
        row = rows - 1 - min(max(int(north_m[i] * per_m), 0), rows - 1)
        mass[way_rank[row * cols + col]] += weight[i]
    best = int(np.argmax(mass))
    return best, mass[best]
