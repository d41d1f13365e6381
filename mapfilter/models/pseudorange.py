"""GNSS pseudoranges: distance to a satellite plus the receiver clock's bias.

``y = |x - s| + c₀ δt + v`` (Fritsche & Klein 2009, eq. 5).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mapfilter.errors import Faults, InputError, fail
from mapfilter.models._terms import RANGE
from mapfilter.models.gaussian import GaussianTerms, checked, deviations, places, terms
from mapfilter.models.state import StateLayout


def pseudoranges(layout: StateLayout, satellites_m: ArrayLike, sigma_m: ArrayLike) -> GaussianTerms:
    """Return the model of pseudoranges to satellites.

    Parameters
    ----------
    layout : StateLayout
        With a clock.
    satellites_m : (m, 3) array_like
        Positions of the satellites in the frame of the state.
    sigma_m : float or (m,) array_like
        Standard deviations.

    Raises
    ------
    InputError
        The state has no clock, a deviation is not positive, a position not finite.

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
    names = tuple(f"pseudorange {index}" for index in range(len(satellites)))
    return checked(
        faults,
        GaussianTerms(layout, rows, np.diag(sigma**2), np.zeros(len(sigma)), names=names),
    )
