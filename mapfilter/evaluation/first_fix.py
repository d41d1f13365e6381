"""How far one travels until it is clear where one is: an ideal filter, tried on drawn journeys.

From each start a journey is drawn along the map: straight on where that is possible, now and then
round a corner. Every place of the first serving cell is a hypothesis; the motion is known without
error, so that all of them move alike, and those that leave the map are dropped. What is left is
judged twice:

- by cells: those stay at which the serving cell of the truth would serve, too, within the
  database's margin, as in Khalaf-Allah (2007). Serving cells are as predicted. This is exact for
  the journeys that are drawn;
- by levels: levels with errors as :class:`ErrorModel` tells them are drawn along the journey, and
  hypotheses weighed with their likelihood, the first report in full, later ones with the share of
  an independent look that their distance travelled brings. This weighing is an approximation.

A filter with noisy motion, or one that keeps fewer hypotheses, needs longer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from mapfilter._parallel import Progress
from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import ConfigError, Faults
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M
from mapfilter.evaluation.ideal_filter import judged_by_cells, judged_by_levels, walk
from mapfilter.evaluation.radio_map import ErrorModel, RadioMap

_AT_A_TIME = 128
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)


@dataclass(frozen=True, slots=True)
class FirstFixOptions:
    """What is tried, and when it counts as clear.

    Parameters
    ----------
    spacing_m : float
        Of the starts: one in each square of this side that has a point.
    journeys : int
        From each start.
    most_m : float
        Journeys end here.
    path_m : float
        Length over which information is counted and twins are looked for.
    apart_m : float
        Twins are at least so far from each other.
    mass : float
        Share of the weights within 50 m of the heaviest hypothesis at which levels have decided.

    Raises
    ------
    ConfigError
        With every value that is not as told.
    """

    spacing_m: float = 50.0
    journeys: int = 2
    most_m: float = 1500.0
    path_m: float = 100.0
    apart_m: float = 200.0
    mass: float = 0.95

    def __post_init__(self) -> None:
        faults = Faults()
        for name in ("spacing_m", "most_m", "path_m", "apart_m"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                faults.add(f"bound, {name}", "metres > 0", value)
        if not 1 <= self.journeys <= 1000:
            faults.add("bound, journeys", "1..1000", self.journeys)
        if not 0.5 <= self.mass < 1:
            faults.add("bound, mass", "0.5 <= mass < 1", self.mass)
        if self.most_m > 100_000:
            faults.add("bound, most_m", "at most 100 km", self.most_m, "a wrong unit")
        faults.raise_if_any(ConfigError)


@dataclass(frozen=True, slots=True, eq=False)
class FirstFix:
    """What came of all journeys; S starts with J journeys each.

    Parameters
    ----------
    start : numpy.ndarray of int64, shape (S,)
        Points.
    cells_m, levels_m : numpy.ndarray, shape (S, J)
        Metres until it was clear; infinite where it never was.
    right : numpy.ndarray of bool, shape (S, J)
        Levels decided for a place at most 50 m off.
    cells_bits, levels_bits : numpy.ndarray, shape (S, J)
        Information on the start after ``path_m``, beyond the name of the first serving cell.
    twin : numpy.ndarray of int64, shape (S, J)
        The point at least ``apart_m`` away that looks most alike over ``path_m``; -1 where none is
        left on the map.
    twin_error : numpy.ndarray, shape (S, J)
        Probability of taking the twin for the truth, or the reverse: 0.5 is a perfect twin.
    """

    start: Ints
    cells_m: Floats
    levels_m: Floats
    right: Bools
    cells_bits: Floats
    levels_bits: Floats
    twin: Ints
    twin_error: Floats


def starts(radio: RadioMap, spacing_m: float) -> Ints:
    """Return one point for each square of a side that has any, in row-major order.

    It is the first of the square's points in the order of a hash, so neither corner is preferred.
    """
    side_px = max(round(spacing_m / radio.lattice.resolution_m), 1)
    squares_across = radio.lattice.cols // side_px + 1
    square = radio.row // side_px * squares_across + radio.col // side_px
    mixed = (np.arange(len(radio), dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(
        40
    )
    order = np.lexsort((mixed, square))
    _, first = np.unique(square[order], return_index=True)
    return np.sort(order[first]).astype(np.int64)


def first_fix(
    radio: RadioMap,
    errors: ErrorModel,
    options: FirstFixOptions,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> FirstFix:
    """Try the ideal filter from starts all over a map."""
    start = starts(radio, options.spacing_m)
    shape = (start.size, options.journeys)
    first, point = radio.points_by_cell()
    best_dbm = radio.level_dbm.max(axis=2)
    found = np.full((*shape, 7), np.nan)
    for begin in range(0, start.size, _AT_A_TIME):
        part = slice(begin, begin + _AT_A_TIME)
        found[part] = _try_all(
            rng, start[part], options.journeys, radio.row, radio.col, radio.server, first, point,
            radio.on_way, radio.near_way, radio.level_dbm, best_dbm, radio.site,
            radio.floor_dbm, radio.margin_db, radio.lattice.resolution_m, errors.deviation_db,
            errors.correlation_m, errors.site_share, options.most_m, options.path_m,
            options.apart_m, options.mass, SUCCESS_RADIUS_M,
        )  # fmt: skip
        if progress is not None:
            progress(min(begin + _AT_A_TIME, start.size), start.size)
    return FirstFix(
        start,
        found[..., 0],
        found[..., 2],
        found[..., 3] > 0,
        found[..., 1],
        found[..., 4],
        found[..., 5].astype(np.int64),
        found[..., 6],
    )


@njit(cache=True)
def _try_all(  # type: ignore[no-untyped-def]
    rng, start, journeys, row, col, server, first, point, on_way, near_way, level_dbm, best_dbm,
    site, floor_dbm, margin_db, resolution_m, deviation_db, correlation_m, share, most_m, path_m,
    apart_m, mass, success_m,
):  # fmt: skip
    found = np.empty((start.size, journeys, 7))
    for i in range(start.size):
        here = start[i]
        own = point[first[server[here]] : first[server[here] + 1]]
        for j in range(journeys):
            rows, cols, gone_m = walk(rng, on_way, row[here], col[here], resolution_m, most_m)
            found[i, j, 0:2] = judged_by_cells(
                rows, cols, gone_m, row[own], col[own], near_way, level_dbm, best_dbm, floor_dbm,
                margin_db, success_m / resolution_m, path_m,
            )  # fmt: skip
            found[i, j, 2:7] = judged_by_levels(
                rng, rows, cols, gone_m, row[own], col[own], own, near_way, level_dbm, site,
                floor_dbm, deviation_db, correlation_m, share, success_m / resolution_m, path_m,
                apart_m / resolution_m, mass,
            )  # fmt: skip
    return found
