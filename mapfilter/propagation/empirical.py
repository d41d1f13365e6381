"""Path loss by formula: free space, log-distance, Okumura-Hata, COST 231 Hata, Walfisch-Ikegami.

Distances below 20 m (free space: 1 m) count as that, and roofs less than 1 m above the mobile as
1 m above it; everything else outside the published ranges is extrapolated by the same equations.

References
----------
M. Hata, "Empirical formula for propagation loss in land mobile radio services", IEEE Transactions
on Vehicular Technology 29(3), 1980.
COST Action 231, "Digital mobile radio towards future generation systems, final report", EUR 18957
(1999), chapter 4. Terms carry the names of the report.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._constants import LIGHT_MPS
from mapfilter._types import Floats

Environment = Literal["large_city", "city", "suburban", "open"]

SHORTEST_DISTANCE_M = 20.0
"""Shorter distances count as this one."""
_LARGE_CITY_SPLIT_MHZ = 300.0


def okumura_hata_db(
    distance_m: ArrayLike,
    frequency_mhz: float,
    base_height_m: float,
    mobile_height_m: float,
    environment: Environment,
) -> Floats:
    """Return the path loss of the Okumura-Hata model in dB.

    ``L = 69.55 + 26.16 lg f - 13.82 lg h_b - a(h_m) + (44.9 - 6.55 lg h_b) lg d`` in towns;
    ``L - 2 lg²(f / 28) - 5.4`` in suburbs; ``L - 4.78 lg² f + 18.33 lg f - 40.94`` in the open; f
    in MHz, d in km. Published for 150-1500 MHz, bases of 30-200 m, mobiles of 1-10 m, 1-20 km.

    Parameters
    ----------
    distance_m : array_like, any shape
        Horizontal distance.
    environment : {"large_city", "city", "suburban", "open"}
        ``"city"`` is a small or medium-sized one; suburbs and open land take its a(h_m).

    Examples
    --------
    >>> [okumura_hata_db(5000.0, 900.0, 30.0, 1.5, kind).round(2).item()
    ...  for kind in ("large_city", "city", "suburban", "open")]
    [151.04, 151.02, 141.08, 122.52]
    """
    distance_km = np.maximum(np.asarray(distance_m, dtype=np.float64), SHORTEST_DISTANCE_M) / 1000
    lg_f, lg_base = np.log10(frequency_mhz), np.log10(base_height_m)
    height_db = large_city_mobile_db if environment == "large_city" else mobile_height_db
    mobile_db = height_db(frequency_mhz, mobile_height_m)
    constant_db = 69.55 + 26.16 * lg_f - 13.82 * lg_base - mobile_db
    if environment == "suburban":
        constant_db -= 2 * np.log10(frequency_mhz / 28) ** 2 + 5.4
    elif environment == "open":
        constant_db -= 4.78 * lg_f**2 - 18.33 * lg_f + 40.94
    return np.asarray(constant_db + (44.9 - 6.55 * lg_base) * np.log10(distance_km))


def cost231_hata_db(
    distance_m: ArrayLike,
    frequency_mhz: float,
    base_height_m: float,
    mobile_height_m: float,
    metropolitan: bool,
) -> Floats:
    """Return the path loss of the COST 231 Hata model in dB.

    ``L = 46.3 + 33.9 lg f - 13.82 lg h_b - a(h_m) + (44.9 - 6.55 lg h_b) lg d + C_m``, where a(h_m)
    is that of a medium-sized city and C_m is 3 dB in metropolitan centres, else 0; f in MHz, d in
    km. Published for 1500-2000 MHz, bases of 30-200 m above all roofs, mobiles of 1-10 m, 1-20 km.

    Examples
    --------
    >>> cost231_hata_db(2000.0, 1800.0, 30.0, 1.5, False).round(2).item()
    146.8
    """
    distance_km = np.maximum(np.asarray(distance_m, dtype=np.float64), SHORTEST_DISTANCE_M) / 1000
    lg_f, lg_base = np.log10(frequency_mhz), np.log10(base_height_m)
    slope_db = 44.9 - 6.55 * lg_base
    city_db = 3.0 if metropolitan else 0.0
    mobile_db = mobile_height_db(frequency_mhz, mobile_height_m)
    constant_db = 46.3 + 33.9 * lg_f - 13.82 * lg_base - mobile_db + city_db
    return np.asarray(constant_db + slope_db * np.log10(distance_km))


def mobile_height_db(frequency_mhz: float, mobile_height_m: float) -> float:
    """Return Hata's a(h_m) of a medium-sized city, ``(1.1 lg f - 0.7) h_m - (1.56 lg f - 0.8)``.

    Examples
    --------
    >>> round(mobile_height_db(900.0, 1.5), 4)
    0.0159
    """
    lg_f = np.log10(frequency_mhz)
    return float((1.1 * lg_f - 0.7) * mobile_height_m - (1.56 * lg_f - 0.8))


def large_city_mobile_db(frequency_mhz: float, mobile_height_m: float) -> float:
    """Return Hata's a(h_m) of a large city.

    ``8.29 lg²(1.54 h_m) - 1.1`` up to 200 MHz and ``3.2 lg²(11.75 h_m) - 4.97`` from 400 MHz on.
    Hata leaves a gap between; each form reaches to its middle.

    Examples
    --------
    >>> round(large_city_mobile_db(900.0, 1.5), 4)
    -0.0009
    """
    if frequency_mhz <= _LARGE_CITY_SPLIT_MHZ:
        return float(8.29 * np.log10(1.54 * mobile_height_m) ** 2 - 1.1)
    return float(3.2 * np.log10(11.75 * mobile_height_m) ** 2 - 4.97)


SHORTEST_FREE_DISTANCE_M = 1.0
"""Shorter distances count as this one in free space: nearer, an antenna has no far field."""


def friis_db(distance_m: ArrayLike, frequency_mhz: float) -> Floats:
    """Return the loss of free space between isotropic antennas in dB.

    ``L = 20 lg(4 π d f / c)`` (Friis 1946, for antennas of gain 1). Distances below 1 m
    count as 1 m.

    Examples
    --------
    >>> friis_db([1000.0, 2000.0], 1800.0).round(2).tolist()
    [97.55, 103.57]
    """
    distance = np.maximum(np.asarray(distance_m, dtype=np.float64), SHORTEST_FREE_DISTANCE_M)
    wavelength_m = LIGHT_MPS / (frequency_mhz * 1e6)
    return np.asarray(20 * np.log10(4 * np.pi * distance / wavelength_m))


def log_distance_db(
    distance_m: ArrayLike,
    frequency_mhz: float,
    exponent: float,
    reference_distance_m: float = 1.0,
    reference_loss_db: float | None = None,
) -> Floats:
    """Return the log-distance path loss in dB.

    ``L = L(d0) + 10 n lg(d / d0)`` (Rappaport 2002, eq. 4.68). L(d0) is that of free space unless
    it was measured; with d0 = 1 m this is the close-in model (Sun et al. 2016, eq. 1). Distances
    below d0 count as d0.

    Parameters
    ----------
    exponent : float
        n: 2 in free space, 2.7 to 5 in towns.
    reference_distance_m : float
        d0.
    reference_loss_db : float or None
        L(d0); None for free space.

    Examples
    --------
    >>> log_distance_db([100.0, 1000.0], 1800.0, 3.5, 100.0, 80.0).tolist()
    [80.0, 115.0]
    """
    distance = np.maximum(np.asarray(distance_m, dtype=np.float64), reference_distance_m)
    if reference_loss_db is None:
        reference_loss_db = float(friis_db(reference_distance_m, frequency_mhz))
    return np.asarray(reference_loss_db + 10 * exponent * np.log10(distance / reference_distance_m))


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
    roof_height_m : array_like
        Mean height of the roofs around the mobile.
    street_width_m, building_separation_m : float
        Width of the streets, w, and distance between the buildings' centres, b.
    street_orientation_deg : array_like
        Angle between the street and the direct path, 0..90.
    metropolitan : bool
        Metropolitan centre, or medium-sized city and suburbs.

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
