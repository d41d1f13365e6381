"""Empirical path loss of cells above the roofs: Okumura-Hata and COST 231 Hata.

Sources: M. Hata, *Empirical formula for propagation loss in land mobile radio services*, IEEE
Transactions on Vehicular Technology 29(3), 1980; COST Action 231, *Digital mobile radio towards
future generation systems, final report*, EUR 18957 (1999), chapter 4, "COST 231-Hata-Model".

Distances below 20 m count as 20 m; everything else outside the published ranges is extrapolated by
the same equations.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

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
    frequency_mhz, base_height_m, mobile_height_m : float
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
    large = environment == "large_city"
    mobile_db = (large_city_mobile_db if large else mobile_height_db)(
        frequency_mhz, mobile_height_m
    )
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

    Parameters
    ----------
    distance_m : array_like, any shape
        Horizontal distance.
    frequency_mhz, base_height_m, mobile_height_m : float
    metropolitan : bool
        Metropolitan centre, or medium-sized city and suburbs.

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
