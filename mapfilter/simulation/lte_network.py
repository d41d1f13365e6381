"""Reception of a hexagonal LTE network: sites of three sectors, levels, SINR, arrival times.

All sectors send at once and in the same band, so that each is received against all others. All
times are distances (m), times of arrival times the speed of light.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log10

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import comb, log_ndtr

from mapfilter._constants import LIGHT_MPS
from mapfilter._types import Bools, Floats
from mapfilter.errors import Faults, InputError, fail
from mapfilter.gnss.noise import correlated_along
from mapfilter.propagation.tr38901 import hidden_loss_db, seen_loss_db
from mapfilter.radio.antenna import sector_gain_db

_LEAST_DISTANCE_M = 10.0


@dataclass(frozen=True, slots=True)
class LteRadio:
    """Properties of all sectors and receivers of an LTE network.

    Antenna gain is at boresight; beamwidth and front-to-back ratio are of the horizontal pattern.
    The noise figure is that of receivers.
    """

    power_dbm: float = 43.0
    gain_dbi: float = 14.0
    beamwidth_deg: float = 70.0
    front_to_back_db: float = 20.0
    frequency_mhz: float = 2000.0
    bandwidth_mhz: float = 20.0
    noise_figure_db: float = 7.0
    height_m: float = 30.0
    mobile_height_m: float = 1.5

    @property
    def noise_dbm(self) -> float:
        """Thermal noise over the whole band."""
        return -174.0 + 10 * log10(self.bandwidth_mhz * 1e6) + self.noise_figure_db


def hexagonal_sites(spacing_m: float, rings: int) -> Floats:
    """Return a site and rings of sites around it, each as far from its neighbours, (S, 2).

    The neighbours of the first one lie at 0°, 60° ... anticlockwise from east; three sites meet at
    30°, 90° ... from each, at ``spacing / √3``.

    Raises
    ------
    InputError
        The distance is not above 0, or the rings are fewer than none.

    Examples
    --------
    >>> hexagonal_sites(1500.0, 1).round(0).tolist()[:3]
    [[0.0, 0.0], [-750.0, -1299.0], [750.0, -1299.0]]
    >>> len(hexagonal_sites(1500.0, 2))
    19
    """
    if not (np.isfinite(spacing_m) and spacing_m > 0 and rings >= 0):
        got = f"{spacing_m} m, {rings} rings"
        raise fail(InputError, "hexagonal sites", "metres above 0 and rings >= 0", got)
    steps = np.arange(-rings, rings + 1)
    a, b = (axis.ravel() for axis in np.meshgrid(steps, steps))
    within = np.maximum(np.maximum(np.abs(a), np.abs(b)), np.abs(a + b)) <= rings
    a, b = a[within], b[within]
    places = spacing_m * np.column_stack([a + b / 2, b * np.sqrt(3) / 2])
    order = np.argsort(np.hypot(*places.T).round(3), kind="stable")
    return np.asarray(places[order])


def turned(places_m: Floats, angle_deg: float) -> Floats:
    """Return places (..., 2) turned anticlockwise about the origin.

    Examples
    --------
    >>> turned(np.array([[1.0, 0.0]]), 90.0).round(9).tolist()
    [[0.0, 1.0]]
    """
    angle = np.radians(angle_deg)
    axes = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return np.asarray(places_m @ axes)


def sites_along(
    travelled_m: ArrayLike,
    sites: int,
    correlation_m: float,
    shared: float,
    rng: np.random.Generator,
) -> Floats:
    """Draw standard normal numbers for sites, with a part that all sites have in common.

    The correlation along the way, given as ``travelled_m`` of shape (K,), is
    ``exp(-d / correlation_m)``; ``shared`` is that of any two sites. The result is (K, sites).

    Raises
    ------
    InputError
        The correlation of sites is not within 0..1.
    """
    if not 0 <= shared <= 1:
        raise fail(InputError, "shared", "a correlation in 0..1", shared)
    drawn = correlated_along(travelled_m, sites + 1, correlation_m, rng)
    return np.asarray(np.sqrt(1 - shared) * drawn[:, 1:] + np.sqrt(shared) * drawn[:, :1])


def sector_levels_dbm(
    radio: LteRadio,
    sites_m: Floats,
    boresights_deg: ArrayLike,
    places_m: Floats,
    seen: Bools,
    shadowing_db: ArrayLike = 0.0,
) -> Floats:
    """Return the level of each sector at each place.

    Path loss is that of 3GPP TR 38.901 for urban macro cells, with or without line of sight.

    Parameters
    ----------
    boresights_deg : (3,) array_like
        Of the sectors of each site, anticlockwise from east.
    seen : (K, S) array of bool
        Whether each of S sites is in line of sight of each of K places.
    shadowing_db : (K, S) array_like
        Added to all sectors of a site.

    Returns
    -------
    (K, S, 3) array
        Levels in dBm of the three sectors of each site at each place.
    """
    away = places_m[:, None] - sites_m
    distance = np.maximum(np.hypot(away[..., 0], away[..., 1]), _LEAST_DISTANCE_M)
    given = (radio.frequency_mhz, radio.height_m, radio.mobile_height_m)
    free, blocked = seen_loss_db("uma", distance, *given), hidden_loss_db("uma", distance, *given)
    loss = np.where(seen, free, blocked)
    bearing = np.arctan2(away[..., 1], away[..., 0])[..., None]
    gain = sector_gain_db(
        bearing - np.radians(np.asarray(boresights_deg, dtype=np.float64)),
        np.radians(radio.beamwidth_deg),
        radio.front_to_back_db,
    )
    level = radio.power_dbm + radio.gain_dbi - loss + np.asarray(shadowing_db)
    return np.asarray(level[..., None] + gain)


def site_sinr_db(levels_dbm: Floats, noise_dbm: float) -> Floats:
    """Return the SINR of each site's best sector against all other sectors and noise, (..., S).

    ``levels_dbm`` are of shape (..., S, 3).

    Raises
    ------
    InputError
        A level is not a number.

    Examples
    --------
    >>> levels = np.array([[[-80.0, -110.0, -110.0], [-80.0, -110.0, -110.0]]])
    >>> site_sinr_db(levels, -120.0).round(2).tolist()
    [[-0.02, -0.02]]
    """
    if np.isnan(levels_dbm).any():
        raise fail(InputError, "levels_dbm", "numbers", "NaN")
    power = 10 ** (levels_dbm / 10)
    best = power.max(axis=-1)
    others = power.sum(axis=(-2, -1))[..., None] - best + 10 ** (noise_dbm / 10)
    return np.asarray(10 * np.log10(best / others))


@dataclass(frozen=True, slots=True)
class ArrivalModel:
    """Measurement of times of arrival by a receiver.

    Parameters
    ----------
    bandwidth_hz : float
        B, over which the known signal is spread evenly.
    samples : int
        N, independent samples that a correlation takes in: bandwidth times time. LTE's
        synchronisation channels have 62 carriers of 15 kHz and four symbols in a frame of 10 ms.
    window_m : float
        Length over which the correlation is searched for its peak.
    floor_m : float
        What remains of the deviation however strong the signal.
    """

    bandwidth_hz: float = 62 * 15e3
    samples: int = 62 * 40
    window_m: float = 3000.0
    floor_m: float = 3.0

    def __post_init__(self) -> None:
        faults = Faults()
        above_0 = {"bandwidth_hz": self.bandwidth_hz, "samples": self.samples}
        faults.check_positive("arrival, ", "a number", **above_0, window_m=self.window_m)
        if not (np.isfinite(self.floor_m) and self.floor_m >= 0):
            faults.add("arrival, floor_m", "metres >= 0", self.floor_m)
        if not faults.found and not 2 <= self.cells <= 30:
            faults.add("arrival, window_m", "2 to 30 resolution cells c / B", self.cells)
        faults.raise_if_any(InputError)

    @property
    def cells(self) -> int:
        """Number of resolution cells, c / B each, in the window."""
        return round(self.window_m * self.bandwidth_hz / LIGHT_MPS)

    def sigma_m(self, sinr_db: ArrayLike) -> Floats:
        """Return the deviation of a measured time, the Cramér-Rao bound and the floor together.

        ``σ² = c² / (8 π² β² N SINR) + floor²``; a signal spread evenly over B has ``β² = B² / 12``.

        Examples
        --------
        >>> ArrivalModel().sigma_m([0.0, -17.0]).round(1).tolist()
        [3.9, 18.1]
        """
        power = 10 ** (np.asarray(sinr_db, dtype=np.float64) / 10)
        spread_hz2 = self.bandwidth_hz**2 / 12
        bound = LIGHT_MPS**2 / (8 * np.pi**2 * spread_hz2 * self.samples * power)
        return np.asarray(np.sqrt(bound + self.floor_m**2))

    def wrong_peak(self, sinr_db: ArrayLike) -> Floats:
        """Return the probability that noise in another cell exceeds the peak of the signal.

        Of M orthogonal alternatives received without phase, M the cells of the window (Proakis,
        *Digital Communications*, 4th ed., eq. 5.4-46), at ``γ = N SINR``:
        ``Σ (-1)^(m+1) C(M-1, m) / (m+1) exp(-γ m / (m+1))`` over m = 1 ... M-1.

        Examples
        --------
        >>> ArrivalModel().wrong_peak([-17.0, -23.0, -26.0]).round(3).tolist()
        [0.0, 0.006, 0.103]
        """
        gamma = self.samples * 10 ** (np.asarray(sinr_db, dtype=np.float64) / 10)
        m = np.arange(1, self.cells)
        share = (-1.0) ** (m + 1) * comb(self.cells - 1, m) / (m + 1)
        terms = share * np.exp(-gamma[..., None] * m / (m + 1))
        return np.asarray(np.clip(terms.sum(axis=-1), 0.0, 1.0))


def detour_m(
    travelled_m: ArrayLike,
    hidden: Bools,
    rng: np.random.Generator,
    *,
    mean_m: float = 15.0,
    correlation_m: float = 10.0,
    shared: float = 0.5,
) -> Floats:
    """Draw the excess of ways without line of sight: exponential, correlated along the way.

    Part of a detour is near the receiver and common to all stations; differences of times are free
    of it. Where ``hidden``, of shape (K, S), is false it is 0; ``shared`` is the correlation of the
    normal processes of any two stations, from which the excess is drawn.
    """
    drawn = sites_along(travelled_m, hidden.shape[1], correlation_m, shared, rng)
    return np.asarray(np.where(hidden, -mean_m * log_ndtr(-drawn), 0.0))


def arrival_errors_m(model: ArrivalModel, sinr_db: Floats, rng: np.random.Generator) -> Floats:
    """Draw errors of measured times: normal, or anywhere in the window by a wrong peak."""
    error = model.sigma_m(sinr_db) * rng.standard_normal(sinr_db.shape)
    astray = rng.random(sinr_db.shape) < model.wrong_peak(sinr_db)
    anywhere = model.window_m * (rng.random(sinr_db.shape) - 0.5)
    return np.asarray(np.where(astray, anywhere, error))
