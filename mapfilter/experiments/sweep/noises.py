"""Errors of dead reckoning over which a sweep runs: axes of its grid, and their combinations."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import replace
from numbers import Real
from typing import Any

import numpy as np

from mapfilter._arguments import Argument, check_arguments, shown
from mapfilter.errors import ConfigError, Faults
from mapfilter.tracks.imu_noise import ImuNoise

NOISE_AXES = ("sigma_trans_m", "sigma_orient_deg", "bias_sd_deg", "drift_deg_per_sqrt_s", "scale")
"""Errors of dead reckoning that are axes of the grid, and columns of its table."""

GYRO_ERRORS = ("gyro_noise_deg_per_sqrt_s", "gyro_bias_deg_per_s")
"""Errors of turns, which a filter does not use where motion has headings, as that of a sweep."""

NO_TURNS = (
    "simulated motion has headings, and filters use turns only without; a custom filter may use "
    'those of turns = "gyro"'
)


def noise_grid(
    sigma_trans_m: Sequence[float] | float = (0.2,),
    sigma_orient_deg: Sequence[float] | float = (3.0,),
    bias_sd_deg: Sequence[float] | float = (0.0,),
    drift_deg_per_sqrt_s: Sequence[float] | float = (0.0,),
    scale: Sequence[float] | float = (0.0,),
    *,
    others: ImuNoise | None = None,
) -> tuple[ImuNoise, ...]:
    """Return every combination, the last axis changing fastest; ``others`` gives what is not here.

    Raises
    ------
    ConfigError
        An axis has no numbers, or is none.

    Examples
    --------
    >>> [noise.sigma_orient_deg for noise in noise_grid((0.0, 0.2), (0, 3))]
    [0.0, 3.0, 0.0, 3.0]
    """
    usual = Argument("others", others, ImuNoise | None, "ImuNoise")
    check_arguments("noise_grid", keywords=[usual])
    given = sigma_trans_m, sigma_orient_deg, bias_sd_deg, drift_deg_per_sqrt_s, scale
    faults = Faults()
    axes = [_axis(name, one, faults) for name, one in zip(NOISE_AXES, given, strict=True)]
    faults.raise_if_any(ConfigError)
    found = []
    for values in itertools.product(*axes):
        chosen: dict[str, Any] = dict(zip(NOISE_AXES, map(float, values), strict=True))
        found.append(replace(others or ImuNoise(), **chosen))
    return tuple(found)


def _axis(name: str, given: object, faults: Faults) -> list[Any]:
    """Return the values of an axis of a grid, one or several."""
    values: list[Any] = [given]
    if not isinstance(given, str | Real) and isinstance(given, Iterable):
        # An array of no dimension is one number.
        values = np.atleast_1d(given).tolist() if isinstance(given, np.ndarray) else list(given)
    wrong = [shown(one) for one in values if not isinstance(one, Real)]
    if wrong or not values:
        faults.add(f"noise_grid, {name}", "numbers", *(wrong[:1] or ["none"]))
    return values
