"""Path loss of several slopes with diffraction over roofs, and sector antennas with side lobes.

With line of sight the loss is that of free space up to the breakpoint ``4 h_b h_m / λ`` and falls
with the fourth power of distance beyond it (the lower bound of Rec. ITU-R P.1411). Where
buildings reach into the path, the loss of a single knife edge is added (Rec. ITU-R P.526), up to
the loss over the roofs. The latter has slopes of 3.0, 3.8 and 4.4, which change at 150 m and 500 m,
and passes a median of the site-general form at 500 m (Rec. ITU-R P.1411, section 4.2.1, with
α = 4.39, β = -6.27, γ = 2.30). That a slope grows with distance is the rule
in measurements (Feuerstein et al. 1994, *Path loss, delay spread, and outage models as functions of
antenna height for microcellular system design*, IEEE Trans. Veh. Technol. 43(3): exponents 2.1 to
2.2 and 3.3 to 4.2 before and after the breakpoint; Zhang & Andrews 2015, *Downlink cellular network
analysis with multi-slope path loss models*, IEEE Trans. Commun. 63(5)). Antennas below the roofs,
such as those indoors, follow the site-general NLoS medians of street canyons (Rec. ITU-R P.1411,
section 4.1.1 of versions 10 to 12): α = 4.00, β = 10.2, γ = 2.36 among high buildings up to 200 m,
and α = 5.06, as among low ones, beyond.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mapfilter._constants import LIGHT_MPS
from mapfilter._types import Floats, Floats32
from mapfilter.lattice import Lattice

_SHORTEST_M = 10.0
MOBILE_M = 1.5
"""Height of the phone above ground."""
_RAY_STEP_M = 4.0
_OWN_BUILDING_M = 8.0
_AT_A_TIME = 256
_STREET_BREAK_M = 200.0
_BREAKS_M, _SLOPES = (150.0, 500.0), (3.0, 3.8, 4.4)


class Mast(NamedTuple):
    """Where an antenna stands; heights above ground."""

    east_m: float
    north_m: float
    height_m: float


def sight_loss_db(distance_m: Floats, frequency_mhz: float, base_height_m: float) -> Floats:
    """Return the loss with line of sight in dB.

    Parameters
    ----------
    distance_m : ndarray
        Horizontal; below 10 m it counts as 10 m.

    Examples
    --------
    >>> sight_loss_db(np.array([100.0, 4000.0]), 1800.0, 30.0).round(1).tolist()
    [77.9, 121.0]
    """
    wave_m = LIGHT_MPS / (frequency_mhz * 1e6)
    slant = np.hypot(np.maximum(distance_m, _SHORTEST_M), base_height_m - MOBILE_M)
    break_m = 4 * base_height_m * MOBILE_M / wave_m
    beyond_db = 20 * np.log10(np.maximum(slant / break_m, 1.0))
    return np.asarray(20 * np.log10(4 * np.pi * slant / wave_m) + beyond_db)


def roof_loss_db(distance_m: Floats, frequency_mhz: float) -> Floats:
    """Return the loss over the roofs in dB: slopes 3.0, 3.8 and 4.4, joined at 150 m and 500 m.

    Examples
    --------
    >>> roof_loss_db(np.array([50.0, 150.0, 500.0, 1000.0]), 1800.0).round(1).tolist()
    [83.9, 98.2, 118.1, 131.3]
    """
    distance = np.maximum(distance_m, _SHORTEST_M)
    loss = 10 * 4.39 * np.log10(_BREAKS_M[1]) - 6.27 + 10 * 2.30 * np.log10(frequency_mhz / 1000)
    near = np.log10(np.minimum(distance, _BREAKS_M[0]) / _BREAKS_M[0])
    middle = np.log10(np.clip(distance, *_BREAKS_M) / _BREAKS_M[1])
    far = np.log10(np.maximum(distance, _BREAKS_M[1]) / _BREAKS_M[1])
    return np.asarray(loss + 10 * (_SLOPES[0] * near + _SLOPES[1] * middle + _SLOPES[2] * far))


def street_loss_db(distance_m: Floats, frequency_mhz: float) -> Floats:
    """Return the loss in dB from an antenna below the roofs, without line of sight.

    Slopes are 4.00 up to 200 m and 5.06 beyond.

    Examples
    --------
    >>> street_loss_db(np.array([100.0, 200.0, 400.0]), 1800.0).round(1).tolist()
    [96.2, 108.3, 123.5]
    """
    distance = np.maximum(distance_m, _SHORTEST_M)
    near = 40 * np.log10(np.minimum(distance, _STREET_BREAK_M))
    far = 50.6 * np.log10(np.maximum(distance / _STREET_BREAK_M, 1.0))
    return np.asarray(near + far + 10.2 + 23.6 * np.log10(frequency_mhz / 1000))


def knife_edge_db(fresnel: Floats) -> Floats:
    """Return the loss of a knife edge in dB for the Fresnel parameter ν (Rec. ITU-R P.526).

    ``6.9 + 20 lg(√((ν - 0.1)² + 1) + ν - 0.1)`` above ν = -0.78, else 0.

    Examples
    --------
    >>> knife_edge_db(np.array([-2.0, 0.0, 2.4])).round(2).tolist()
    [0.0, 6.03, 20.54]
    """
    above = np.maximum(fresnel, -0.78) - 0.1
    loss = 6.9 + 20 * np.log10(np.sqrt(above**2 + 1) + above)
    return np.asarray(np.maximum(loss, 0.0))


def fresnel_parameter(
    heights_m: Floats32 | None,
    lattice: Lattice,
    mast: Mast,
    east_m: Floats,
    north_m: Floats,
    frequency_mhz: float,
) -> Floats:
    """Return the largest Fresnel parameter of the buildings between a mast and positions.

    The building on or in which the antenna is does not count, nor do others within 8 m of either
    end: the phone may be at a wall. Outside the lattice there are none.

    Parameters
    ----------
    heights_m : (rows, cols) array or None
        Of buildings; without any, -2 everywhere, at which nothing is lost.
    """
    found = np.full(east_m.shape, -2.0)
    if heights_m is None:
        return found
    wave_m = LIGHT_MPS / (frequency_mhz * 1e6)
    for begin in range(0, east_m.size, _AT_A_TIME):
        part = slice(begin, begin + _AT_A_TIME)
        right, up = east_m[part] - mast.east_m, north_m[part] - mast.north_m
        length = np.maximum(np.hypot(right, up), 1.0)
        # Samples lie at fixed distances from the mast, whatever other positions there are.
        before = (np.arange(int(np.ceil(length.max() / _RAY_STEP_M))) + 0.5) * _RAY_STEP_M
        share = before / length[:, None]
        row, col = lattice.row_col(
            mast.east_m + right[:, None] * share, mast.north_m + up[:, None] * share
        )
        there = lattice.contains(row, col)
        roof = np.where(there, heights_m[np.where(there, row, 0), np.where(there, col, 0)], 0.0)
        after = length[:, None] - before
        ray = mast.height_m + (MOBILE_M - mast.height_m) * share
        own = np.logical_and.accumulate(roof > 0, axis=1)
        counts = (roof > 0) & ~own & (np.minimum(before, after) > _OWN_BUILDING_M)
        scale = np.sqrt(2 / wave_m * (1 / before + 1 / np.maximum(after, 1.0)))
        edge = np.where(counts, (roof - ray) * scale, -2.0)
        found[part] = np.maximum(edge.max(axis=1), -2.0)
    return found


def pattern_db(
    offset_rad: Floats, beamwidth_deg: float, front_to_back_db: float, ripple_phase_rad: float = 0.0
) -> Floats:
    """Return the gain of a sector antenna off its boresight in dB, at most 0 on average.

    A cardioid ``cos^2q(φ/2)`` of the given width at half power, limited to the front-to-back ratio,
    with a ripple of ±1 dB as measured patterns have it. At boresight it is 0 without the ripple.

    Parameters
    ----------
    ripple_phase_rad : float
        Of the ripple, which differs from antenna to antenna.

    Examples
    --------
    >>> pattern_db(np.radians([32.5, 180.0]), 65.0, 25.0, -np.pi / 2).round(1).tolist()
    [-2.6, -25.0]
    """
    half = np.radians(beamwidth_deg) / 2
    sharpness = -3.0 / (20 * np.log10(np.cos(half / 2)))
    lobe = 20 * sharpness * np.log10(np.maximum(np.abs(np.cos(offset_rad / 2)), 1e-6))
    ripple = np.sin(5 * offset_rad + ripple_phase_rad) + np.sin(3 * offset_rad - ripple_phase_rad)
    return np.asarray(np.maximum(lobe, -front_to_back_db) + 0.5 * ripple)
