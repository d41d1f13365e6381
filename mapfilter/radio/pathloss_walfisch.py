"""Path loss over and between roofs: COST 231 Walfisch-Ikegami.

Source: COST Action 231, *Digital mobile radio towards future generation systems, final report*,
EUR 18957 (1999), chapter 4, "COST 231-Walfisch-Ikegami-Model". Terms carry the names that the
report gives them.

Distances below 20 m count as 20 m and roofs less than 1 m above the mobile as 1 m above it;
everything else outside the published ranges is extrapolated by the same equations.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.radio.pathloss_hata import SHORTEST_DISTANCE_M

LOWEST_ROOF_ABOVE_MOBILE_M = 1.0
"""Lower roofs count as this high above the mobile."""


def cost231_walfisch_ikegami_db(
    distance_m: ArrayLike,
    frequency_mhz: float,
    base_height_m: float,
    mobile_height_m: float,
    roof_height_m: ArrayLike,
    street_width_m: float,
    building_separation_m: float,
    street_orientation_deg: ArrayLike,
    metropolitan: bool,
    line_of_sight: ArrayLike,
) -> Floats:
    """Return the path loss of the COST 231 Walfisch-Ikegami model in dB.

    In a street canyon with line of sight ``42.6 + 26 lg d + 20 lg f``; without it free space plus
    roof-top-to-street and multi-screen diffraction where their sum is positive, else free space;
    f in MHz, d in km. Published for 800-2000 MHz, bases of 4-50 m, mobiles of 1-3 m, 0.02-5 km.
    Array arguments broadcast.

    Parameters
    ----------
    distance_m : array_like
        Horizontal distance.
    frequency_mhz, base_height_m, mobile_height_m : float
    roof_height_m : array_like
        Mean height of the roofs around the mobile.
    street_width_m, building_separation_m : float
        Width of the streets, w, and distance between the buildings' centres, b.
    street_orientation_deg : array_like
        Angle between the street and the direct path, 0..90.
    metropolitan : bool
        Metropolitan centre, or medium-sized city and suburbs.
    line_of_sight : array_like of bool

    Examples
    --------
    >>> loss_db = cost231_walfisch_ikegami_db(
    ...     1000.0, 1800.0, 30.0, 1.5, 15.0, 20.0, 40.0, 90.0, False, [True, False])
    >>> loss_db.round(2).tolist()
    [107.71, 129.81]
    """
    distance_km = np.maximum(np.asarray(distance_m, dtype=np.float64), SHORTEST_DISTANCE_M) / 1000
    roof = np.maximum(
        np.asarray(roof_height_m, dtype=np.float64), mobile_height_m + LOWEST_ROOF_ABOVE_MOBILE_M
    )
    canyon_db = 42.6 + 26.0 * np.log10(distance_km) + 20.0 * np.log10(frequency_mhz)
    diffraction_db = roof_to_street_db(
        frequency_mhz, roof - mobile_height_m, street_width_m, street_orientation_deg
    ) + multi_screen_db(
        distance_km * 1000, frequency_mhz, base_height_m, roof, building_separation_m, metropolitan
    )
    blocked_db = free_space_db(distance_km * 1000, frequency_mhz) + np.maximum(diffraction_db, 0.0)
    return np.where(np.asarray(line_of_sight, dtype=bool), canyon_db, blocked_db)


def free_space_db(distance_m: ArrayLike, frequency_mhz: float) -> Floats:
    """Return the free-space loss ``32.4 + 20 lg d + 20 lg f`` in dB.

    Examples
    --------
    >>> free_space_db(1000.0, 1800.0).round(2).item()
    97.51
    """
    distance_km = np.asarray(distance_m, dtype=np.float64) / 1000
    return np.asarray(32.4 + 20.0 * np.log10(distance_km) + 20.0 * np.log10(frequency_mhz))


def roof_to_street_db(
    frequency_mhz: float,
    roof_above_mobile_m: ArrayLike,
    street_width_m: float,
    street_orientation_deg: ArrayLike,
) -> Floats:
    """Return the roof-top-to-street diffraction and scatter loss L_rts in dB.

    ``-16.9 - 10 lg w + 10 lg f + 20 lg (h_roof - h_m) + L_ori``, where L_ori is
    ``-10 + 0.354 φ`` below 35°, ``2.5 + 0.075 (φ - 35)`` below 55° and ``4 - 0.114 (φ - 55)`` up to
    90°.

    Examples
    --------
    >>> roof_to_street_db(1800.0, 13.5, 20.0, [0.0, 35.0, 55.0]).round(2).tolist()
    [15.25, 27.75, 29.25]
    """
    angle = np.asarray(street_orientation_deg, dtype=np.float64)
    orientation_db = np.select(
        [angle < 35.0, angle < 55.0],
        [-10.0 + 0.354 * angle, 2.5 + 0.075 * (angle - 35.0)],
        4.0 - 0.114 * (angle - 55.0),
    )
    above = np.asarray(roof_above_mobile_m, dtype=np.float64)
    constant_db = -16.9 - 10.0 * np.log10(street_width_m) + 10.0 * np.log10(frequency_mhz)
    return np.asarray(constant_db + 20.0 * np.log10(above) + orientation_db)


def multi_screen_db(
    distance_m: ArrayLike,
    frequency_mhz: float,
    base_height_m: float,
    roof_height_m: ArrayLike,
    building_separation_m: float,
    metropolitan: bool,
) -> Floats:
    """Return the multi-screen diffraction loss L_msd in dB.

    ``L_bsh + k_a + k_d lg d + k_f lg f - 9 lg b``; L_bsh, k_a and k_d depend on whether the base
    stands above the roofs, k_f on the kind of town.

    Examples
    --------
    >>> multi_screen_db(1000.0, 1800.0, 30.0, 15.0, 40.0, False).round(2).item()
    7.04
    """
    distance_km = np.asarray(distance_m, dtype=np.float64) / 1000
    roof = np.asarray(roof_height_m, dtype=np.float64)
    base_above_roof = base_height_m - roof
    above = base_above_roof > 0
    # log10 is evaluated on both branches, so the unused one must stay positive.
    height_db = np.where(above, -18.0 * np.log10(1.0 + np.maximum(base_above_roof, 0.0)), 0.0)
    near = np.minimum(distance_km, 0.5) / 0.5
    k_a = np.where(above, 54.0, 54.0 - 0.8 * base_above_roof * near)
    k_d = np.where(above, 18.0, 18.0 - 15.0 * base_above_roof / roof)
    k_f = -4.0 + (1.5 if metropolitan else 0.7) * (frequency_mhz / 925.0 - 1.0)
    frequency_db = k_f * np.log10(frequency_mhz) - 9.0 * np.log10(building_separation_m)
    return np.asarray(height_db + k_a + k_d * np.log10(distance_km) + frequency_db)
