"""Time differences of arrival (TDOA, E-OTD, OTDOA), as differences of distances.

``y_i = |x - b_i| - |x - b_r| + v_i``. All differences share the reference station r, so their noise
is correlated: ``C = D Σ Dᵀ`` with the times' own variances in Σ and a row of D for each difference.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError, fail
from mapfilter.models._terms import DIFFERENCE
from mapfilter.models.gaussian import GaussianTerms, checked, deviations, places, terms
from mapfilter.models.state import StateLayout


def difference_covariance(sigma_m: ArrayLike, reference: int) -> Floats:
    """Return ``D Σ Dᵀ``: the covariance of differences to a reference.

    Parameters
    ----------
    sigma_m : (m,) array_like
        Standard deviation of each station's time of arrival, as a distance.
    reference : int
        Which one all others are compared with.

    Returns
    -------
    (m - 1, m - 1) array
        In the order of the stations without the reference.

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
    layout : StateLayout
    stations_m : (m, 2) or (m, 3) array_like
        At least two, the reference among them.
    sigma_m : float or (m,) array_like
        Standard deviation of each station's time of arrival, as a distance.
    reference : int
        Index of the reference station.

    Raises
    ------
    InputError
        Fewer than two stations, no such reference, a deviation that is not positive.

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
    return checked(faults, GaussianTerms(layout, rows, noise, np.zeros(len(others)), names=names))
