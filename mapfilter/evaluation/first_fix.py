"""Distance to the first unambiguous fix: an ideal filter on simulated journeys.

From each start a journey is drawn along the map: straight on where that is possible, now and then
round a corner. Every place of the first serving cell is a hypothesis; the motion is known without
error, so that all of them move alike, and those that leave the map are dropped. The rest is
evaluated twice:

- by cells: those stay at which the serving cell of the truth would serve, too, within the
  database's margin, as in Khalaf-Allah (2007). Serving cells are as predicted. This is exact for
  the journeys that are drawn;
- by levels: levels with the errors of an :class:`ErrorModel` are drawn along the journey, and
  hypotheses weighed with their likelihood, the first report in full, later ones with the share of
  an independent look that their distance travelled brings. This weighing is an approximation.

A filter with noisy motion, or one that keeps fewer hypotheses, needs longer.

All places are pixels; a hypothesis is where the journey may have begun, and its place at any time
that start moved as the truth moved.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Ge, Gt, Le, Lt

from mapfilter._parallel import Progress
from mapfilter._types import Bools, Floats, Ints
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M
from mapfilter.evaluation.first_fix_kernels import Judgement, Levels, try_all
from mapfilter.evaluation.radio_map import (
    ErrorModel,
    RadioMap,
    best_of_layers_dbm,
)
from mapfilter.options import Options, Positive

_AT_A_TIME = 128
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)


@dataclass(frozen=True, slots=True)
class FirstFixOptions(Options):
    """Journeys of the ideal filter, and the criterion of an unambiguous position.

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
    """

    spacing_m: Positive = 50.0
    journeys: Annotated[int, Ge(1), Le(1000)] = 2
    most_m: Annotated[float, Gt(0), Le(100_000)] = 1500.0
    path_m: Positive = 100.0
    apart_m: Positive = 200.0
    mass: Annotated[float, Ge(0.5), Lt(1)] = 0.95


@dataclass(frozen=True, slots=True, eq=False)
class FirstFix:
    """Results of all journeys; S starts with J journeys each.

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
    mixed = (np.arange(len(radio), dtype=np.uint64) * _GOLDEN) >> np.uint64(40)
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
    best_dbm = best_of_layers_dbm(radio.level_dbm, radio.layer)
    found = np.full((*shape, 7), np.nan)
    levels = Levels(
        radio.near_way,
        radio.level_dbm,
        best_dbm,
        radio.site,
        radio.layer,
        radio.floor_dbm,
        radio.margin_db,
    )
    resolution_m = radio.lattice.resolution_m
    judgement = Judgement(
        errors.deviation_db,
        errors.correlation_m,
        errors.site_share,
        SUCCESS_RADIUS_M / resolution_m,
        options.path_m,
        options.apart_m / resolution_m,
        options.mass,
    )
    own = radio.row, radio.col, radio.server, first, point
    walked = radio.on_way, resolution_m, options.most_m
    for begin in range(0, start.size, _AT_A_TIME):
        part = slice(begin, begin + _AT_A_TIME)
        found[part] = try_all(rng, start[part], options.journeys, own, walked, levels, judgement)
        if progress is not None:
            progress(min(begin + _AT_A_TIME, start.size), start.size)
    cells_m, cells_bits, levels_m, right, levels_bits, twin, error = np.moveaxis(found, 2, 0)
    ids = twin.astype(np.int64)
    return FirstFix(start, cells_m, levels_m, right > 0, cells_bits, levels_bits, ids, error)
