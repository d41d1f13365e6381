"""Path loss and line-of-sight probability of 3GPP TR 38.901, outdoors: UMa and UMi-Street Canyon.

Source: 3GPP TR 38.901, *Study on channel model for frequencies from 0.5 to 100 GHz*, tables 7.4.1-1
and 7.4.2-1. Distances are horizontal (d_2D); the slant distance (d_3D) follows from the heights. f
is in GHz, c is 3·10⁸ m/s as in the report.

Distances below 10 m count as 10 m. Heights less than 0.5 m above the effective environment count as
0.5 m above it. All else outside the published ranges is extrapolated by the same equations.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats

Scenario = Literal["uma", "umi"]

SHORTEST_TR38901_DISTANCE_M = 10.0
"""Shorter distances count as this one."""
_SPEED_OF_LIGHT_MPS = 3.0e8
_ENVIRONMENT_M = 1.0
_LEAST_EFFECTIVE_M = 0.5


# Rows of table 7.4.1-1: constant, slope by lg d and factor of the breakpoint, with line of sight;
# constant, slope by lg d, by lg f and by height, without.
_SEEN: dict[Scenario, tuple[float, float, float]] = {
    "uma": (28.0, 22.0, 9.0),
    "umi": (32.4, 21.0, 9.5),
}
_HIDDEN: dict[Scenario, tuple[float, float, float, float]] = {
    "uma": (13.54, 39.08, 20.0, 0.6),
    "umi": (22.4, 35.3, 21.3, 0.3),
}


def breakpoint_distance_m(
    frequency_mhz: float,
    base_height_m: float,
    mobile_height_m: float,
    environment_height_m: float = _ENVIRONMENT_M,
) -> float:
    """Return the breakpoint distance ``d'_BP = 4 (h_BS - h_E)(h_UT - h_E) f_c / c`` in metres.

    Table 7.4.1-1, note 1. The effective environment height h_E is 1 m in UMi, and in UMa for
    mobiles up to 13 m; higher, the report draws it for each link.

    Examples
    --------
    >>> breakpoint_distance_m(2000.0, 25.0, 1.5)
    320.0
    """
    base, mobile = (
        max(height_m - environment_height_m, _LEAST_EFFECTIVE_M)
        for height_m in (base_height_m, mobile_height_m)
    )
    return 4 * base * mobile * frequency_mhz * 1e6 / _SPEED_OF_LIGHT_MPS


def seen_loss_db(
    scenario: Scenario,
    distance_m: ArrayLike,
    frequency_mhz: float,
    base_height_m: float,
    mobile_height_m: float,
) -> Floats:
    """Return the path loss with line of sight in dB, PL_UMa-LOS or PL_UMi-LOS.

    UMa: ``28.0 + 22 lg d_3D + 20 lg f`` up to the breakpoint, then
    ``28.0 + 40 lg d_3D + 20 lg f - 9 lg(d'_BP² + (h_BS - h_UT)²)``; UMi: 32.4, 21 and 9.5 in place
    of 28.0, 22 and 9. Published for 0.5-100 GHz, 10 m - 5 km, mobiles of 1.5-22.5 m and bases of
    25 m (UMa) or 10 m (UMi).

    Parameters
    ----------
    distance_m : array_like, any shape
        Horizontal distance, d_2D.

    Examples
    --------
    >>> seen_loss_db("uma", [100.0, 1000.0], 2000.0, 25.0, 1.5).round(2).tolist()
    [78.28, 108.91]
    """
    constant_db, slope_db, breakpoint_db = _SEEN[scenario]
    flat, slant = _distances_m(distance_m, base_height_m, mobile_height_m)
    break_m = breakpoint_distance_m(frequency_mhz, base_height_m, mobile_height_m)
    lg_slant, frequency_db = np.log10(slant), 20 * np.log10(frequency_mhz / 1000)
    near_db = constant_db + slope_db * lg_slant + frequency_db
    bend_db = breakpoint_db * np.log10(break_m * break_m + (base_height_m - mobile_height_m) ** 2)
    far_db = constant_db + 40 * lg_slant + frequency_db - bend_db
    return np.asarray(np.where(flat <= break_m, near_db, far_db))


def hidden_loss_db(
    scenario: Scenario,
    distance_m: ArrayLike,
    frequency_mhz: float,
    base_height_m: float,
    mobile_height_m: float,
) -> Floats:
    """Return the path loss without line of sight in dB, PL_UMa-NLOS or PL_UMi-NLOS.

    The larger of the loss with line of sight and, in UMa,
    ``13.54 + 39.08 lg d_3D + 20 lg f - 0.6 (h_UT - 1.5)``, in UMi
    ``22.4 + 35.3 lg d_3D + 21.3 lg f - 0.3 (h_UT - 1.5)``.

    Examples
    --------
    >>> hidden_loss_db("uma", [100.0, 1000.0], 2000.0, 25.0, 1.5).round(2).tolist()
    [98.18, 136.81]
    """
    constant_db, slope_db, frequency_db, height_db = _HIDDEN[scenario]
    _, slant = _distances_m(distance_m, base_height_m, mobile_height_m)
    own_db = (
        constant_db
        + slope_db * np.log10(slant)
        + frequency_db * np.log10(frequency_mhz / 1000)
        - height_db * (mobile_height_m - 1.5)
    )
    seen_db = seen_loss_db(scenario, distance_m, frequency_mhz, base_height_m, mobile_height_m)
    return np.asarray(np.maximum(seen_db, own_db))


def sight_probability(
    scenario: Scenario, distance_m: ArrayLike, mobile_height_m: float = 1.5
) -> Floats:
    """Return the probability of line of sight to an outdoor mobile (table 7.4.2-1), 0..1.

    1 up to 18 m; beyond, with s = 36 m in UMi and 63 m in UMa,
    ``18 / d + exp(-d / s) (1 - 18 / d)``, in UMa times
    ``1 + C' 5/4 (d / 100)³ exp(-d / 150)``, where C' is 0 up to 13 m of mobile height and
    ``((h_UT - 13) / 10)^1.5`` up to 23 m. It stands for antennas of 25 m (UMa) and 10 m (UMi).

    Parameters
    ----------
    distance_m : array_like, any shape
        Horizontal distance outdoors, d_2D-out.
    mobile_height_m : float
        Above 23 m it counts as 23 m.

    Examples
    --------
    >>> sight_probability("uma", [10.0, 100.0, 500.0]).round(4).tolist()
    [1.0, 0.3477, 0.0363]
    >>> sight_probability("umi", [10.0, 100.0, 500.0]).round(4).tolist()
    [1.0, 0.231, 0.036]
    """
    distance = np.maximum(np.asarray(distance_m, dtype=np.float64), 18.0)
    share = 18.0 / distance
    decay = np.exp(-distance / (36.0 if scenario == "umi" else 63.0))
    probability = share + decay * (1 - share)
    if scenario == "uma" and mobile_height_m > 13.0:
        raised = ((min(mobile_height_m, 23.0) - 13.0) / 10.0) ** 1.5
        bulge = 1.25 * (distance / 100) ** 3 * np.exp(-distance / 150)
        probability = np.where(distance > 18.0, probability * (1 + raised * bulge), probability)
    return np.minimum(probability, 1.0)


def _distances_m(
    distance_m: ArrayLike, base_height_m: float, mobile_height_m: float
) -> tuple[Floats, Floats]:
    flat = np.maximum(np.asarray(distance_m, dtype=np.float64), SHORTEST_TR38901_DISTANCE_M)
    return flat, np.hypot(flat, base_height_m - mobile_height_m)
