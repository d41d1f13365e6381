"""Times of arrival of a known signal: how well they can be measured, and what makes them wrong.

All times are distances (m), times of arrival times the speed of light.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import comb, log_ndtr

from mapfilter._types import Bools, Floats
from mapfilter.errors import Faults, InputError
from mapfilter.models.clock import SPEED_OF_LIGHT_MPS
from mapfilter.simulation.lte_network import sites_along


@dataclass(frozen=True, slots=True)
class ArrivalModel:
    """How a receiver measures times of arrival.

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
        for name in ("bandwidth_hz", "samples", "window_m"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                faults.add(f"arrival, {name}", "a number above 0", value)
        if not (np.isfinite(self.floor_m) and self.floor_m >= 0):
            faults.add("arrival, floor_m", "metres >= 0", self.floor_m)
        if not faults.found and not 2 <= self.cells <= 30:
            faults.add("arrival, window_m", "2 to 30 resolution cells c / B", self.cells)
        faults.raise_if_any(InputError)

    @property
    def cells(self) -> int:
        """Number of resolution cells, c / B each, in the window."""
        return round(self.window_m * self.bandwidth_hz / SPEED_OF_LIGHT_MPS)

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
        bound = SPEED_OF_LIGHT_MPS**2 / (8 * np.pi**2 * spread_hz2 * self.samples * power)
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
    travelled_m: ArrayLike, hidden: Bools, rng: np.random.Generator, *,
    mean_m: float = 15.0, correlation_m: float = 10.0, shared: float = 0.5,
) -> Floats:  # fmt: skip
    """Draw the excess of ways without line of sight: exponential, correlated along the way.

    Part of a detour is near the receiver and common to all stations; differences of times are free
    of it.

    Parameters
    ----------
    travelled_m : (K,) array_like
    hidden : (K, S) array of bool
        Where it is not 0.
    rng : numpy.random.Generator
    mean_m, correlation_m : float
    shared : float
        Correlation of the normal processes of any two stations, from which the excess is drawn.

    Returns
    -------
    (K, S) array
    """
    drawn = sites_along(travelled_m, hidden.shape[1], correlation_m, shared, rng)
    return np.asarray(np.where(hidden, -mean_m * log_ndtr(-drawn), 0.0))


def arrival_errors_m(model: ArrivalModel, sinr_db: Floats, rng: np.random.Generator) -> Floats:
    """Draw errors of measured times: normal, or anywhere in the window by a wrong peak."""
    error = model.sigma_m(sinr_db) * rng.standard_normal(sinr_db.shape)
    astray = rng.random(sinr_db.shape) < model.wrong_peak(sinr_db)
    anywhere = model.window_m * (rng.random(sinr_db.shape) - 0.5)
    return np.asarray(np.where(astray, anywhere, error))
