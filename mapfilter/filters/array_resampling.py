"""Weights and systematic choice of :mod:`mapfilter.filters.resampling`, by arrays of any device."""

from __future__ import annotations

from math import isfinite, log
from typing import Any

import numpy as np

from mapfilter._device import arrays_of


def normalise_arrays(log_weight: Any) -> tuple[Any, float, float]:
    """Normalise log weights (N,) in place.

    Returns
    -------
    weight : array of float32, shape (N,)
        Sums to one.
    log_total, effective : float
        Logarithm of the sum before, and the effective sample size; minus infinity and 0 where no
        weight is left.
    """
    arrays = arrays_of(log_weight)
    highest = float(log_weight.max())
    if not isfinite(highest):
        return arrays.zeros(log_weight.size, dtype=np.float32), -np.inf, 0.0
    weight = arrays.exp(log_weight - highest).astype(np.float32)
    total = float(weight.sum(dtype=np.float64))
    squares = float((weight * weight).sum(dtype=np.float64))
    log_total = highest + log(total)
    log_weight -= log_total
    return weight * np.float32(1.0 / total), log_total, total * total / squares


def systematic_arrays(weight: Any, offset: float, count: int) -> Any:
    """Return the indices (M,) of the particles that M new ones copy, ascending.

    Weights sum to one; ``offset`` is drawn uniformly from [0, 1).

    Examples
    --------
    >>> systematic_arrays(np.float32([0.5, 0.125, 0.375]), 0.5, 4).tolist()
    [0, 0, 2, 2]
    """
    arrays = arrays_of(weight)
    # Copies of a particle end before the first place that is beyond the weights up to it.
    end = arrays.ceil(arrays.cumsum(weight, dtype=np.float64) * float(count) - offset)
    places = arrays.arange(count, dtype=np.float64)
    return arrays.searchsorted(end[:-1], places, side="right").astype(np.int32)
