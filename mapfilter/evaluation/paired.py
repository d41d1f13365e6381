"""Differences of two filters over the runs that both processed.

All filters of a sweep locate the same logs with the same noise. What one gains over another is
therefore known better than from the intervals of each: most runs are right with both, or with
none, and tell nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from math import nan, sqrt
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mapfilter.evaluation.intervals import pooled_interval
from mapfilter.evaluation.success import Z_95, independent_runs
from mapfilter.evaluation.success_cells import COORDINATES, READING, varied_keys

_OWN = ("filter", READING, "update_length_m")
"""Coordinates in which filters of one cell of the grid differ."""
_RUN = ("route", "draw")


@dataclass(frozen=True, slots=True)
class PairedCell:
    """A filter beside another one, the baseline, in one cell of a grid.

    Differences are the filter's figure less the baseline's: a higher ``success``, a lower
    ``wrong``, error and distance are better. All intervals are 95 %.

    Parameters
    ----------
    place : dict
        Coordinates in the grid that both have in common, and ``update_length_m`` of each; NaN
        where a filter has none.
    reading, baseline : str
        Names of the two.
    runs, routes : int
        Runs that both processed.
    success, success_low, success_high : float
        Difference of the shares of successful runs, and its interval for *these* routes.
    success_routes_low, success_routes_high : float
        The interval for all routes of the area; NaN for a single one.
    only_reading, only_baseline : int
        Runs that were successful with one of the two alone.
    wrong, wrong_low, wrong_high, wrong_routes_low, wrong_routes_high : float
        The same of the runs that switched more than 50 m off.
    both : int
        Runs that were successful with both.
    error_m, error_low_m, error_high_m : float
        Mean difference of the mean errors of these runs, and its interval over routes; no interval
        (NaN) below three routes.
    distance_m, distance_low_m, distance_high_m : float
        The same of the distances travelled until the switch.
    """

    place: dict[str, Any]
    reading: str
    baseline: str
    runs: int
    routes: int
    success: float
    success_low: float
    success_high: float
    success_routes_low: float
    success_routes_high: float
    only_reading: int
    only_baseline: int
    wrong: float
    wrong_low: float
    wrong_high: float
    wrong_routes_low: float
    wrong_routes_high: float
    both: int
    error_m: float
    error_low_m: float
    error_high_m: float
    distance_m: float
    distance_low_m: float
    distance_high_m: float

    @property
    def row(self) -> dict[str, Any]:
        """Coordinates and figures: a row of a table."""
        figures = {one.name: getattr(self, one.name) for one in fields(self)}
        del figures["place"]
        return self.place | figures


def paired_cells(runs: pd.DataFrame, baseline: str) -> tuple[PairedCell, ...]:
    """Compare each filter of a sweep with one of them, in every cell of the grid.

    Parameters
    ----------
    runs : pandas.DataFrame
        Rows as of :func:`mapfilter.evaluation.success_cells.success_cells`.
    baseline : str
        Reading that the others are compared with; at every update length that it has.
    """
    found = []
    at = [name for name in (*COORDINATES, *varied_keys(runs)) if name not in _OWN]
    for place, rows in runs.groupby(at, sort=False, dropna=False):
        common = dict(zip(at, place, strict=True))
        own = {name: one for name, one in _by_filter(rows) if name[0] == baseline}
        for (name, length_m), one in _by_filter(rows):
            if name == baseline:
                continue
            for (_, other_m), other in own.items():
                both = one.merge(other, on=list(_RUN), suffixes=("", "_baseline"))
                lengths = {"update_length_m": length_m, "baseline_update_length_m": other_m}
                found.append(_cell(common | lengths, name, baseline, both))
    return tuple(found)


def _by_filter(rows: pd.DataFrame) -> Iterator[tuple[tuple[str, float], pd.DataFrame]]:
    for (_, name, length_m), one in rows.groupby(list(_OWN), sort=False, dropna=False):
        yield (str(name), float(length_m)), one


def _cell(place: dict[str, Any], name: str, baseline: str, both: pd.DataFrame) -> PairedCell:
    here, there = both["success"].to_numpy(bool), both["success_baseline"].to_numpy(bool)
    route = both["route"].to_numpy()
    wrong, wrong_there = (
        both[f"switched{of}"].to_numpy(bool) & ~right
        for of, right in (("", here), ("_baseline", there))
    )
    success = _shares("success", here, there, route)
    figures = success | _shares("wrong", wrong, wrong_there, route)
    right = both[here & there]
    for key, column in (("error", "error_mean_m"), ("distance", "switch_distance_m")):
        less_m = (right[column] - right[f"{column}_baseline"]).to_numpy()
        low_m, high_m = pooled_interval(
            [less_m[right["route"] == one] for one in right["route"].unique()], "mean"
        )
        figures[f"{key}_m"] = float(less_m.mean()) if less_m.size else nan
        figures |= {f"{key}_low_m": low_m, f"{key}_high_m": high_m}
    return PairedCell(
        place=place,
        reading=name,
        baseline=baseline,
        runs=len(both),
        routes=len(np.unique(route)),
        only_reading=int(np.sum(here & ~there)),
        only_baseline=int(np.sum(there & ~here)),
        both=len(right),
        **figures,
    )


def _shares(name: str, here: ArrayLike, there: ArrayLike, route: ArrayLike) -> dict[str, Any]:
    """Return the difference of two shares with both of its intervals, by their columns."""
    own, other = np.asarray(here, bool), np.asarray(there, bool)
    gained, lost = own & ~other, other & ~own
    low, high = paired_interval(int(gained.sum()), int(lost.sum()), own.size)
    _, at = np.unique(np.asarray(route), return_inverse=True)
    ends = paired_interval_of_routes(
        np.bincount(at, gained), np.bincount(at, lost), np.bincount(at)
    )
    difference = (float(gained.sum()) - float(lost.sum())) / own.size if own.size else nan
    return {
        name: difference,
        f"{name}_low": low,
        f"{name}_high": high,
        f"{name}_routes_low": ends[0],
        f"{name}_routes_high": ends[1],
    }


def paired_interval(gained: float, lost: float, runs: float) -> tuple[float, float]:
    """Return the 95 % interval of the difference of two shares of the same runs.

    That of Bonett and Price (2012), who add one run to each kind in which the two differ: it holds
    for few runs, too, and has a width where no run differs. (-1, 1) without any run.

    Parameters
    ----------
    gained, lost : float
        Runs that were successful with the first alone, and with the second alone.
    runs : float
        All runs.

    Examples
    --------
    >>> [round(end, 3) for end in paired_interval(12, 3, 100)]
    [0.011, 0.166]
    >>> [round(end, 3) for end in paired_interval(0, 0, 10)]
    [-0.231, 0.231]
    """
    if not runs > 0:
        return -1.0, 1.0
    plus, minus = (gained + 1) / (runs + 2), (lost + 1) / (runs + 2)
    middle = plus - minus
    spread = Z_95 * sqrt((plus + minus - middle**2) / (runs + 2))
    return max(middle - spread, -1.0), min(middle + spread, 1.0)


def paired_interval_of_routes(
    gained: ArrayLike, lost: ArrayLike, runs: ArrayLike
) -> tuple[float, float]:
    """Return the interval of the difference for all routes, from that of some routes.

    :func:`paired_interval` for as many independent runs as have the variance that the routes show
    (:func:`mapfilter.evaluation.success.wilson_interval_of_routes`). Where no run differs, each
    route counts as one run.

    Parameters
    ----------
    gained, lost, runs : array_like of int, shape (routes,)
        Of each route.

    Returns
    -------
    low, high : float
        NaN for a single route.

    Examples
    --------
    >>> ends = paired_interval_of_routes([5, 0, 5, 0], [0, 0, 0, 1], [10, 10, 10, 10])
    >>> [round(end, 2) for end in ends]
    [-0.18, 0.55]
    """
    plus, minus = np.asarray(gained, np.float64), np.asarray(lost, np.float64)
    of = np.asarray(runs, np.float64)
    if of.size < 2:
        return nan, nan
    total = float(of.sum())
    up, down = float(plus.sum()) / total, float(minus.sum()) / total
    usual = up + down - (up - down) ** 2
    count = independent_runs(plus - minus, of, usual)
    return paired_interval(up * count, down * count, count)
