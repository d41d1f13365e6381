"""Measurements of distances and positions: pseudoranges, differences, timing advances, fixes.

- Pseudorange: distance to a satellite plus the receiver clock's bias, ``y = |x - s| + c₀ δt + v``
  (Fritsche & Klein 2009, eq. 5).
- Difference of distances: ``y_i = |x - b_i| - |x - b_r| + v_i``. All differences share the
  reference station r, so their noise is correlated: ``C = D Σ Dᵀ`` with the times' own variances in
  Σ and a row of D for each difference.
- Timing advance: ``y = |x - b| + v`` (Fritsche & Klein 2009, eq. 4; Zhang et al. 2006, eqs. 3 and
  4). A step of GSM is half the way of light in one bit, 48/13 µs; of LTE in 16 Ts.

All models take a layout of the state, positions in metres, and the standard deviations of the
noise, one for all or one each; they raise an InputError with every fault.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError, fail
from mapfilter.models.gaussian import (
    GaussianTerms,
    checked_covariance,
    deviations,
    independent,
    places,
    terms,
)
from mapfilter.models.state import StateLayout
from mapfilter.models.terms import COMPONENT, DIFFERENCE, RANGE
from mapfilter.radio.identities import TIMING_STEP_M

GSM_STEP_M = TIMING_STEP_M["GSM"]
"""About 553 m; in LTE a step is 78.1 m."""


def pseudoranges(layout: StateLayout, satellites_m: ArrayLike, sigma_m: ArrayLike) -> GaussianTerms:
    """Return the model of pseudoranges to satellites (m, 3), in the frame of a state with a clock.

    Examples
    --------
    >>> from mapfilter.models.state import MOVING_CLOCK
    >>> model = pseudoranges(MOVING_CLOCK, [[0.0, 3e6, 4e6]], 15.0)
    >>> model.mean([0.0, 1.0, 0.0, 0.0, 85.0, 0.0]).tolist()
    [5000085.0]
    """
    if layout.clock is None:
        raise fail(InputError, "pseudorange", "a state with a clock", "none")
    faults = Faults()
    satellites = places("satellites_m", satellites_m, faults)
    sigma = deviations("sigma_m", sigma_m, len(satellites), faults)
    rows = terms(layout, RANGE, satellites, np.ones((len(satellites), 1)))
    return independent(faults, layout, rows, sigma, "pseudorange")


def difference_covariance(sigma_m: ArrayLike, reference: int) -> Floats:
    """Return ``D Σ Dᵀ``: the covariance of differences to a reference, (m - 1, m - 1).

    Examples
    --------
    >>> difference_covariance([5.0, 8.0, 12.0], 0).tolist()
    [[89.0, 25.0], [25.0, 169.0]]
    """
    variance = np.asarray(sigma_m, dtype=np.float64) ** 2
    others = np.delete(variance, reference)
    return np.asarray(np.diag(others) + variance[reference])


def range_differences(
    layout: StateLayout, stations_m: ArrayLike, sigma_m: ArrayLike, reference: int = 0
) -> GaussianTerms:
    """Return the model of differences of distances to a reference station.

    Parameters
    ----------
    stations_m : (m, 2) or (m, 3) array_like
        At least two, the reference among them.
    sigma_m : float or (m,) array_like
        Standard deviation of each station's time of arrival, as a distance.
    reference : int
        Index of the reference station.

    Examples
    --------
    >>> from mapfilter.models.state import POSITION
    >>> model = range_differences(POSITION, [[0.0, 0.0], [300.0, 400.0]], [5.0, 8.0])
    >>> model.mean([0.0, 0.0]).tolist(), model.covariance().tolist()
    ([500.0], [[89.0]])
    """
    faults = Faults()
    stations = places("stations_m", stations_m, faults)
    sigma = deviations("sigma_m", sigma_m, len(stations), faults)
    if len(stations) < 2:
        faults.add("stations_m", "at least two", len(stations))
    if not 0 <= reference < len(stations):
        raise fail(InputError, "reference", f"an index in 0..{len(stations) - 1}", reference)
    faults.raise_if_any(InputError)
    others = np.delete(stations, reference, axis=0)
    reference_m = stations[reference].copy()
    if layout.up is None:
        reference_m[2] -= layout.height_m
    rows = terms(layout, DIFFERENCE, others, np.tile(reference_m, (len(others), 1)))
    names = tuple(f"difference {index}" for index in range(len(stations)) if index != reference)
    noise = difference_covariance(sigma, reference)
    return GaussianTerms(layout, rows, noise, np.zeros(len(others)), names=names)


def timing_advances(
    layout: StateLayout, sites_m: ArrayLike, sigma_m: ArrayLike, step_m: float = 0.0
) -> GaussianTerms:
    """Return the model of timing advances, in metres.

    Parameters
    ----------
    sites_m : (m, 2) or (m, 3) array_like
        Positions of the base stations; without heights all is in one plane.
    step_m : float
        Size of the steps in which reports are drawn, as the middle of a step; 0 for continuous
        ones. Filters are not affected: add ``step²/12`` to the variance for the rounding.

    Examples
    --------
    >>> from mapfilter.models.state import POSITION
    >>> timing_advances(POSITION, [[300.0, 400.0]], 300.0).mean([0.0, 0.0]).tolist()
    [500.0]
    """
    faults = Faults()
    sites = places("sites_m", sites_m, faults)
    sigma = deviations("sigma_m", sigma_m, len(sites), faults)
    if not (np.isfinite(step_m) and step_m >= 0):
        faults.add("step_m", "metres >= 0", step_m)
    rows = terms(layout, RANGE, sites)
    return independent(faults, layout, rows, sigma, "timing advance", step_m)


def position_fix(layout: StateLayout, covariance_m2: ArrayLike) -> GaussianTerms:
    """Return the model of a fix of east and north, and of up where the covariance is 3 x 3.

    The covariance must be symmetric and positive definite.

    Examples
    --------
    >>> from mapfilter.models.state import MOVING
    >>> fix = position_fix(MOVING, [[25.0, 0.0], [0.0, 25.0]])
    >>> fix.mean([10.0, 1.0, 20.0, 2.0]).tolist()
    [10.0, 20.0]
    """
    faults = Faults()
    size = 2 if np.shape(covariance_m2) != (3, 3) else 3
    if size == 3 and layout.up is None:
        faults.add("covariance_m2", "2 x 2, as the state has no height", "3 x 3")
    noise = checked_covariance(covariance_m2, size, faults)
    faults.raise_if_any(InputError)
    rows = terms(layout, COMPONENT, np.zeros((size, 3)), np.arange(size, dtype=np.float64)[:, None])
    names = ("east", "north", "up")[:size]
    return GaussianTerms(layout, rows, noise, np.zeros(size), names=names)
