"""A fix: components of the position, measured directly with a covariance."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mapfilter.errors import Faults
from mapfilter.models._terms import COMPONENT
from mapfilter.models.gaussian import GaussianTerms, checked, checked_covariance, terms
from mapfilter.models.state import StateLayout

_NAMES = ("east", "north", "up")


def position_fix(layout: StateLayout, covariance_m2: ArrayLike) -> GaussianTerms:
    """Return the model of a fix of east and north, and of up where the covariance is 3 x 3.

    Raises
    ------
    InputError
        The covariance is not symmetric positive definite, or the state has no height.

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
    noise = checked_covariance("covariance_m2", covariance_m2, size, faults)
    rows = terms(layout, COMPONENT, np.zeros((size, 3)), np.arange(size, dtype=np.float64)[:, None])
    return checked(faults, GaussianTerms(layout, rows, noise, np.zeros(size), names=_NAMES[:size]))
