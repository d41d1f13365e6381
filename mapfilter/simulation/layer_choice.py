"""Which layer of a network a simulated phone is on: by priorities, not by levels.

Networks steer phones to the carrier with the most room: the newest technology, and within it the
highest frequency. A phone leaves it where its cells are weak, and comes back where they are strong
again (reselection to a layer of higher priority and of lower priority, 3GPP TS 36.304, 5.2.4.5).
Priorities are in no plan; these are usual ones.
"""

from __future__ import annotations

import numpy as np

from mapfilter._types import Bools, Floats, Ints
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.layers import layer_numbers

_NEWEST_FIRST = ("NR", "LTE", "UMTS", "GSM", None)


def layers_by_priority(plan: CellPlan) -> Ints:
    """Return the layer of each cell, shape (C,), numbered from the one that is preferred most.

    Examples
    --------
    >>> from mapfilter.radio.cells import Cell
    >>> cells = [
    ...     Cell(kind, "S", 0.0, 0.0, 30.0, None, 30.0, mhz, "omni", technology=kind)
    ...     for kind, mhz in (("GSM", 950.0), ("LTE", 1850.0))
    ... ]
    >>> layers_by_priority(CellPlan("EPSG:32631", tuple(cells))).tolist()
    [1, 0]
    """
    numbers = layer_numbers(plan.cells)
    first: dict[int, int] = {}
    for index, number in enumerate(numbers.tolist()):
        first.setdefault(number, index)

    def rank(number: int) -> tuple[int, float]:
        cell = plan.cells[first[number]]
        return _NEWEST_FIRST.index(cell.technology), -cell.frequency_mhz

    place = {number: k for k, number in enumerate(sorted(first, key=rank))}
    return np.array([place[number] for number in numbers.tolist()], dtype=np.int64)


def layers_served(
    mean_dbm: Floats, received: Bools, layer: Ints, enough_dbm: float, hysteresis_db: float
) -> Ints:
    """Return the layer that serves at each report, shape (N,).

    A phone stays on its layer while the best cell there has ``enough_dbm``, and goes over to one
    that is preferred where that has ``hysteresis_db`` more. Below, it takes the first layer that
    has enough, or where there is none the strongest, again with the hysteresis.

    Parameters
    ----------
    mean_dbm : (N, C) array
        Levels by which a phone decides, in dBm.
    received : (N, C) array of bool
    layer : (C,) array of int
        From :func:`layers_by_priority`.
    enough_dbm, hysteresis_db : float

    Examples
    --------
    >>> level = np.array([[-80.0, -70.0], [-99.0, -70.0], [-94.0, -70.0], [-90.0, -70.0]])
    >>> got = np.ones(level.shape, dtype=bool)
    >>> layers_served(level, got, np.array([0, 1]), -95.0, 4.0).tolist()
    [0, 1, 1, 0]
    """
    served = np.zeros(len(mean_dbm), dtype=np.int64)
    if layer.max(initial=0) == 0:
        return served
    audible = np.where(received, mean_dbm, -np.inf)
    best = np.stack(
        [audible[:, layer == k].max(axis=1) for k in range(int(layer.max()) + 1)], axis=1
    )
    now = -1
    for i, level in enumerate(best):
        enough = level >= enough_dbm
        better = np.flatnonzero(level[: max(now, 0)] >= enough_dbm + hysteresis_db)
        if better.size:
            now = int(better[0])
        elif now < 0 or not enough[now]:
            lost = now < 0 or not np.isfinite(level[now])
            if enough.any():
                now = int(np.argmax(enough))
            elif lost or level.max() > level[now] + hysteresis_db:
                now = int(np.argmax(level))
        served[i] = now
    return served
