"""Success rates with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M, Accuracy

_Z_95 = 1.959963984540054


def wilson_interval(successes: int, runs: int, z: float = _Z_95) -> tuple[float, float]:
    """Return the Wilson score interval of a share (Wilson 1927); (0, 1) without any run.

    Examples
    --------
    >>> [round(end, 4) for end in wilson_interval(81, 100)]
    [0.7222, 0.8749]
    """
    if not 0 <= successes <= runs:
        raise ValueError(f"successes must lie in 0..{runs}, got {successes}")
    if runs == 0:
        return 0.0, 1.0
    share = successes / runs
    centre = share + z * z / (2 * runs)
    spread = z * sqrt(share * (1 - share) / runs + z * z / (4 * runs * runs))
    scale = 1 + z * z / runs
    # The ends are exactly 0 and 1 there; rounding must not push the share out of its interval.
    low = 0.0 if successes == 0 else (centre - spread) / scale
    high = 1.0 if successes == runs else (centre + spread) / scale
    return low, high


@dataclass(frozen=True, slots=True)
class SuccessSummary:
    """Many runs, scored together.

    Parameters
    ----------
    runs, switched, successes : int
        Counts.
    success, success_low, success_high : float
        Share of successful runs and its 95 % Wilson interval.
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


def summarise(scores: Sequence[Accuracy]) -> SuccessSummary:
    """Put the scores of many runs together.

    As in the paper's Table 4, errors are those after *successful* global positioning.
    """
    runs = len(scores)
    switched = [score for score in scores if score.switched]
    right = [score for score in switched if score.success]
    wrong = [score for score in switched if score.error_at_switch_m > SUCCESS_RADIUS_M]
    low, high = wilson_interval(len(right), runs)
    return SuccessSummary(
        runs,
        len(switched),
        len(right),
        len(right) / runs if runs else float("nan"),
        low,
        high,
        len(wrong) / runs if runs else float("nan"),
        _mean([score.switch_distance_m for score in switched]),
        _mean([score.error_mean_m for score in right]),
        _mean([score.error_67_m for score in right]),
        _mean([score.error_95_m for score in right]),
    )


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else float("nan")
