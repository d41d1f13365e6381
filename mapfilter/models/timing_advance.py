"""Timing advance: the distance to a base station, on request in steps.

``y = |x - b| + v`` (Fritsche & Klein 2009, eq. 4; Zhang et al. 2006, eqs. 3 and 4). A step of GSM
is half the way of light in one bit, 48/13 µs; of LTE in 16 Ts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mapfilter.errors import Faults
from mapfilter.models._terms import RANGE
from mapfilter.models.gaussian import GaussianTerms, checked, deviations, places, terms
from mapfilter.models.state import StateLayout

SPEED_OF_LIGHT_MPS = 299_792_458.0

GSM_STEP_M = SPEED_OF_LIGHT_MPS * 48 / 13 * 1e-6 / 2
"""About 553 m."""

LTE_STEP_M = SPEED_OF_LIGHT_MPS * 16 / 30.72e6 / 2
"""About 78 m."""


def timing_advances(
    layout: StateLayout, sites_m: ArrayLike, sigma_m: ArrayLike, step_m: float = 0.0
) -> GaussianTerms:
    """Return the model of timing advances, in metres.

    Parameters
    ----------
    layout : StateLayout
    sites_m : (m, 2) or (m, 3) array_like
        Positions of the base stations; without heights all is in one plane.
    sigma_m : float or (m,) array_like
        Standard deviations.
    step_m : float
        Size of the steps in which a report is drawn: the middle of a step stands for it. 0 for
        a continuous one. What filters take is not changed by it: add ``step²/12`` to the variance
        for the rounding.

    Raises
    ------
    InputError
        A deviation or step is not positive, a position not finite.

    Examples
    --------
    >>> from mapfilter.models.state import POSITION
    >>> timing_advances(POSITION, [[300.0, 400.0]], 300.0).mean([0.0, 0.0]).tolist()
    [500.0]
    >>> round(GSM_STEP_M, 1), round(LTE_STEP_M, 1)
    (553.5, 78.1)
    """
    faults = Faults()
    sites = places("sites_m", sites_m, faults)
    sigma = deviations("sigma_m", sigma_m, len(sites), faults)
    if not (np.isfinite(step_m) and step_m >= 0):
        faults.add("step_m", "metres >= 0", step_m)
    names = tuple(f"timing advance {index}" for index in range(len(sites)))
    rows = terms(layout, RANGE, sites)
    step = np.full(len(sites), float(step_m))
    return checked(faults, GaussianTerms(layout, rows, np.diag(sigma**2), step, names=names))


def metres_of_steps(steps: ArrayLike, step_m: float = GSM_STEP_M) -> np.ndarray:
    """Return the middle of the distances that a reported timing advance covers.

    Examples
    --------
    >>> metres_of_steps([0, 2]).round(1).tolist()
    [276.7, 1383.7]
    """
    return (np.asarray(steps, dtype=np.float64) + 0.5) * step_m
