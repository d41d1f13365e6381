"""Success rates with their intervals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from itertools import compress
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike

from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M, Accuracy, mean_of

Z_95 = 1.959963984540054
"""Half the width of a 95 % interval, in standard deviations."""


def wilson_interval(successes: int, runs: int, z: float = Z_95) -> tuple[float, float]:
    """Return the Wilson score interval of a share (Wilson 1927); (0, 1) without any run.

    Examples
    --------
    >>> [round(end, 4) for end in wilson_interval(81, 100)]
    [0.7222, 0.8749]
    """
    if not 0 <= successes <= runs:
        raise ValueError(f"successes must lie in 0..{runs}, got {successes}")
    return _wilson(successes / runs, runs, z) if runs else (0.0, 1.0)


def wilson_interval_of_routes(
    successes: ArrayLike, runs: ArrayLike, z: float = Z_95
) -> tuple[float, float]:
    """Return the Wilson interval of a share over all routes, from that of some routes.

    Runs on one route are correlated: the effective sample size is below their number. The variance
    of the share is taken from the scatter of the routes (the ratio estimator of cluster sampling),
    and the interval is Wilson's for as many independent runs as have that variance (Korn and
    Graubard 1998). Where all routes succeed or all fail, each route counts as one run, and where
    each route has one run, the interval is that of independent runs.

    Parameters
    ----------
    successes, runs : array_like of int, shape (routes,)
        Of each route.

    Returns
    -------
    low, high : float
        NaN for a single route.

    Examples
    --------
    >>> [round(end, 3) for end in wilson_interval_of_routes([10, 0, 10, 0], [10, 10, 10, 10])]
    [0.125, 0.875]
    >>> [round(end, 3) for end in wilson_interval(20, 40)]
    [0.352, 0.648]
    """
    good, of = np.asarray(successes, dtype=np.float64), np.asarray(runs, dtype=np.float64)
    if good.size < 2:
        return float("nan"), float("nan")
    share = float(good.sum()) / float(of.sum())
    return _wilson(share, independent_runs(good, of, share * (1 - share)), z)


def independent_runs(sums: ArrayLike, runs: ArrayLike, variance: float) -> float:
    """Return how many independent runs tell as much of a mean as the runs of some routes do.

    The effective sample size of Korn and Graubard (1998), by the scatter of the routes (the ratio
    estimator of cluster sampling), between one and all runs. Where runs do not differ at all, each
    route counts as one; where each route has one run, that is all of them.

    Parameters
    ----------
    sums, runs : array_like, shape (routes,)
        Sum of what is averaged over the runs of each route, and their number.
    variance : float
        Variance of a single run.

    Examples
    --------
    >>> round(independent_runs([10, 0, 10, 0], [10, 10, 10, 10], 0.25), 6)
    3.0
    """
    total_of, of = np.asarray(sums, dtype=np.float64), np.asarray(runs, dtype=np.float64)
    routes, total = of.size, float(of.sum())
    if variance == 0 or np.all(of == 1):
        return float(routes)
    mean = float(total_of.sum()) / total
    between = routes / (routes - 1) * float(np.sum((total_of - mean * of) ** 2)) / total**2
    return min(max(variance / between, 1.0), total) if between > 0 else total


def _wilson(share: float, runs: float, z: float) -> tuple[float, float]:
    centre = share + z * z / (2 * runs)
    spread = z * sqrt(share * (1 - share) / runs + z * z / (4 * runs * runs))
    scale = 1 + z * z / runs
    # The ends are exactly 0 and 1 there; rounding must not push the share out of its interval.
    low = 0.0 if share == 0 else (centre - spread) / scale
    high = 1.0 if share == 1 else (centre + spread) / scale
    return low, high


@dataclass(frozen=True, slots=True)
class SuccessSummary:
    """Many runs, scored together.

    Parameters
    ----------
    runs, switched, successes : int
        Counts of the runs whose ground truth tells whether they were right.
    success, success_low, success_high : float
        Share of successful runs and its 95 % interval, with each route as a cluster; NaN for the
        runs of a single route.
    wrong : float
        Share of all runs that switched more than 50 m off.
    switch_distance_m : float
        Mean over the runs that switched; NaN without any.
    error_mean_m, error_67_m, error_95_m : float
        Means over the successful runs of each run's figure; NaN without any.
    """

    runs: int
    switched: int
    successes: int
    success: float
    success_low: float
    success_high: float
    wrong: float
    switch_distance_m: float
    error_mean_m: float
    error_67_m: float
    error_95_m: float


def summarise(
    scores: Sequence[Accuracy], routes: Sequence[Hashable] | None = None
) -> SuccessSummary:
    """Put the scores of many runs together.

    As in the paper's Table 4, errors are those after *successful* global positioning. Runs whose
    ground truth does not tell whether they were right are left out.

    Parameters
    ----------
    routes : sequence, optional
        The route of each run, as anything that is equal for runs on one route; without it each run
        has its own.
    """
    told = [score.success is not None for score in scores]
    routes = None if routes is None else list(compress(routes, told))
    scores = list(compress(scores, told))
    runs = len(scores)
    switched = [score for score in scores if score.switched]
    right = [score for score in switched if score.success]
    wrong = [score for score in switched if score.error_at_switch_m > SUCCESS_RADIUS_M]
    if routes is None or len(set(routes)) == runs:
        low, high = wilson_interval(len(right), runs)
    else:
        of = Counter(routes)
        good = Counter(route for route, score in zip(routes, scores, strict=True) if score.success)
        low, high = wilson_interval_of_routes([good[route] for route in of], list(of.values()))
    return SuccessSummary(
        runs,
        len(switched),
        len(right),
        len(right) / runs if runs else float("nan"),
        low,
        high,
        len(wrong) / runs if runs else float("nan"),
        mean_of([score.switch_distance_m for score in switched]),
        mean_of([score.error_mean_m for score in right]),
        mean_of([score.error_67_m for score in right]),
        mean_of([score.error_95_m for score in right]),
    )
