"""Calibration of a filter: coverage, reliability, ranks and NEES.

A filter that reports "95 % within 10 m" must be right in 95 of 100 cases, no more and no less.
Epochs of one track are not independent; take one, or few, of each track for intervals to hold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammaincinv

from mapfilter._types import Floats
from mapfilter.errors import InputError, fail
from mapfilter.evaluation.success import wilson_interval


@dataclass(frozen=True, slots=True)
class Coverage:
    """How often the truth lay within a radius.

    Parameters
    ----------
    share : float
        That the radius should hold.
    covered, low, high : float
        Share of the cases inside, and its 95 % Wilson interval.
    """

    share: float
    cases: int
    inside: int
    covered: float
    low: float
    high: float


def coverage(errors_m: ArrayLike, radii_m: ArrayLike, share: float) -> Coverage:
    """Count how often errors are within radii; cases without either are left out.

    Parameters
    ----------
    errors_m, radii_m : (N,) array_like
        One of them may be a single number.
    share : float
        That the radii should hold, 0 to 1.

    Raises
    ------
    InputError
        The share lies beyond, or there are not as many radii as errors.

    Examples
    --------
    >>> found = coverage([1.0, 5.0, 2.0], [2.0, 4.0, 2.0], 0.67)
    >>> found.inside, found.cases, round(found.covered, 2)
    (2, 3, 0.67)
    """
    if not 0 <= share <= 1:
        raise fail(InputError, "coverage, share", "a number in 0..1", share)
    errors = np.asarray(errors_m, dtype=np.float64)
    radii = np.asarray(radii_m, dtype=np.float64)
    if errors.ndim and radii.ndim and errors.shape != radii.shape:
        raise fail(InputError, "coverage, radii_m", f"shape {errors.shape}", radii.shape)
    errors, radii = np.broadcast_arrays(errors, radii)
    known = np.isfinite(errors) & np.isfinite(radii)
    cases, inside = int(known.sum()), int(np.sum(errors[known] <= radii[known]))
    low, high = wilson_interval(inside, cases)
    return Coverage(share, cases, inside, inside / cases if cases else float("nan"), low, high)


@dataclass(frozen=True, slots=True)
class Reliability:
    """One point of a reliability diagram.

    Parameters
    ----------
    predicted : float
        Mean of the probabilities in the bin.
    came_true, low, high : float
        Share of the cases that came true, and its 95 % Wilson interval.
    """

    predicted: float
    cases: int
    came_true: float
    low: float
    high: float


def reliability(
    probabilities: ArrayLike, outcomes: ArrayLike, bins: int = 10
) -> tuple[Reliability, ...]:
    """Compare probabilities with what came true, in bins of equal width; empty ones are left out.

    Parameters
    ----------
    probabilities : array_like, shape (N,)
        Such as each epoch's mass within 50 m; NaN is left out.
    outcomes : array_like of bool, shape (N,)
        Such as whether the error was at most 50 m.

    Examples
    --------
    >>> points = reliability([0.1, 0.1, 0.95, 0.95], [False, False, True, True], bins=2)
    >>> [(round(point.predicted, 2), point.cases, point.came_true) for point in points]
    [(0.1, 2, 0.0), (0.95, 2, 1.0)]
    """
    predicted = np.asarray(probabilities, dtype=np.float64)
    true = np.asarray(outcomes, dtype=np.bool_)[np.isfinite(predicted)]
    predicted = predicted[np.isfinite(predicted)]
    place = np.minimum((predicted * bins).astype(np.int64), bins - 1)
    points = []
    for which in np.unique(place):
        here = place == which
        cases, came = int(here.sum()), int(true[here].sum())
        low, high = wilson_interval(came, cases)
        points.append(Reliability(float(predicted[here].mean()), cases, came / cases, low, high))
    return tuple(points)


def hpd_rank(density: ArrayLike, weight: ArrayLike, at_truth: float) -> float:
    """Return the share of a belief whose density is higher than at the truth.

    Over many cases of a calibrated filter it is uniform on [0, 1] (Talts et al. 2018).

    Parameters
    ----------
    density, weight : array_like, shape (N,)
        Of hypotheses; weights sum to one.
    at_truth : float
        Density at the true place.
    """
    above = np.asarray(density, dtype=np.float64) > at_truth
    return float(np.asarray(weight, dtype=np.float64)[above].sum())


def uniformity(ranks: ArrayLike) -> float:
    """Return the p-value of ranks being uniform on [0, 1] (Kolmogorov-Smirnov)."""
    # Half a second to import, and every command imports this module.
    from scipy import stats

    known = np.asarray(ranks, dtype=np.float64)
    known = known[np.isfinite(known)]
    return float(stats.kstest(known, "uniform").pvalue) if known.size else float("nan")


def nees(error_east_m: ArrayLike, error_north_m: ArrayLike, covariance_m2: ArrayLike) -> Floats:
    """Return normalised estimation errors squared, shape (N,).

    They are 2 on average where beliefs are normal and calibrated, and NaN where a covariance is
    unknown or has no inverse.

    Examples
    --------
    >>> nees([2.0], [3.0], [[[4.0, 0.0], [0.0, 9.0]]]).round(6).tolist()
    [2.0]
    """
    error = np.stack(
        [np.asarray(error_east_m, np.float64), np.asarray(error_north_m, np.float64)], axis=-1
    )
    covariance = np.asarray(covariance_m2, dtype=np.float64)
    found = np.full(len(error), np.nan)
    whole = np.concatenate([covariance.reshape(len(error), 4), error], axis=1)
    finite = np.isfinite(whole).all(axis=1, keepdims=True)
    determinant = np.linalg.det(np.where(finite[..., np.newaxis], covariance, 0.0))
    known = np.flatnonzero(determinant > 0)
    solved = np.linalg.solve(covariance[known], error[known][..., None])[..., 0]
    found[known] = np.sum(error[known] * solved, axis=1)
    return found


def nees_interval(cases: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the band in which the mean of so many independent NEES lies (Bar-Shalom 2001, 5.4.2).

    Examples
    --------
    >>> low, high = nees_interval(100)
    >>> round(low, 2), round(high, 2)
    (1.63, 2.41)
    """
    if cases < 1:
        return float("nan"), float("nan")
    tail = (1 - confidence) / 2
    low, high = 2 * gammaincinv(cases, [tail, 1 - tail]) / cases
    return float(low), float(high)
