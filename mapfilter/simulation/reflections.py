"""Satellites behind buildings that are received by a reflection only (non-line-of-sight, NLOS).

A single reflection at a wall on the other side of the street is later by twice the distance to the
wall times the cosine of the elevation, never earlier (Hsu 2018, *Analysis and modeling GPS NLOS
effect in highly urbanized area*, GPS Solutions 22:7). Delays by ray tracing in streets follow
gamma distributions whose shape falls with the depth of the street (Ollander, Bode & Baum 2020,
*Simulation-based analysis of multipath delay distributions in urban canyons*, ENC); here the shape
is one, the exponential distribution.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Bools, Floats
from mapfilter.errors import ConfigError, Faults
from mapfilter.gnss.noise import multipath_bias_m


@dataclass(frozen=True, slots=True)
class NlosModel:
    """How hidden satellites are received by reflections.

    Parameters
    ----------
    share : float
        Probability that a hidden satellite at ``full_share_deg`` or higher is received.
    full_share_deg : float
        Below this elevation the probability falls linearly, to zero at the horizon: the lower a
        satellite, the less of the walls that face it is lit.
    memory_m : float
        A satellite stays received, or not, for distances with this mean, after which it is drawn
        anew.
    delay_m : float
        Mean delay of a reflection at elevation 0, exponentially distributed: twice the mean
        distance to the reflecting wall. It shrinks with the cosine of the elevation.
    delay_memory_m : float
        Correlation length of the delay.
    noise_factor : float
        Factor on the deviation of the white noise: the code noise grows as one over the square
        root of C/N0, so that 10 dB less make about 3.
    """

    share: float = 0.5
    full_share_deg: float = 30.0
    memory_m: float = 20.0
    delay_m: float = 30.0
    delay_memory_m: float = 10.0
    noise_factor: float = 3.0

    def __post_init__(self) -> None:
        faults = Faults()
        if not 0 <= self.share <= 1:
            faults.add("reception, nlos.share", "a share in 0..1", self.share)
        if not 0 < self.full_share_deg <= 90:
            expected = "degrees above 0, at most 90"
            faults.add("reception, nlos.full_share_deg", expected, self.full_share_deg)
        for name in ("memory_m", "delay_memory_m"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                faults.add(f"reception, nlos.{name}", "a finite number > 0", getattr(self, name))
        if not (np.isfinite(self.delay_m) and self.delay_m >= 0):
            faults.add("reception, nlos.delay_m", "a finite number >= 0", self.delay_m)
        if not (np.isfinite(self.noise_factor) and self.noise_factor >= 1):
            faults.add("reception, nlos.noise_factor", "a finite number >= 1", self.noise_factor)
        faults.raise_if_any(ConfigError)

    def probability(self, elevation_rad: ArrayLike) -> Floats:
        """Return the probability that a hidden satellite is received.

        Examples
        --------
        >>> NlosModel(share=0.6).probability(np.radians([0.0, 15.0, 30.0, 80.0])).round(9).tolist()
        [0.0, 0.3, 0.6, 0.6]
        """
        ramp = np.asarray(elevation_rad, dtype=np.float64) / np.radians(self.full_share_deg)
        return np.asarray(self.share * np.clip(ramp, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Reflections:
    """What of K epochs and S satellites would be received by reflections, were they hidden.

    Parameters
    ----------
    received : (K, S) array of bool
    delay_m : (K, S) array
    """

    received: Bools
    delay_m: Floats


def draw_reflections(
    model: NlosModel, travelled_m: Floats, elevation_rad: Floats, rng: np.random.Generator
) -> Reflections:
    """Draw reflections along a path; neither depends on where satellites are hidden.

    Parameters
    ----------
    travelled_m : (K,) array
        Distance travelled at each epoch, never decreasing.
    elevation_rad : (K, S) array
    """
    satellites = elevation_rad.shape[1]
    level = held_along(travelled_m, satellites, model.memory_m, rng)
    excess = multipath_bias_m(
        travelled_m, satellites, rng, mean_m=1.0, correlation_m=model.delay_memory_m
    )
    delay_m = model.delay_m * np.cos(elevation_rad) * excess
    return Reflections(level < model.probability(elevation_rad), delay_m)


def held_along(
    travelled_m: ArrayLike, columns: int, memory_m: float, rng: np.random.Generator
) -> Floats:
    """Draw uniform numbers that hold for exponentially distributed distances along a path.

    Two numbers at a distance d are the same with probability ``exp(-d / memory_m)``, else
    independent.

    Parameters
    ----------
    travelled_m : (K,) array_like
        Distance travelled at each epoch, never decreasing.
    columns : int
        Independent processes.

    Returns
    -------
    (K, columns) array
    """
    travelled = np.asarray(travelled_m, dtype=np.float64)
    drawn = rng.random((travelled.size, columns))
    keep = np.exp(-np.diff(travelled, prepend=-np.inf) / memory_m)
    anew = rng.random((travelled.size, columns)) >= keep[:, None]
    row = np.where(anew, np.arange(travelled.size)[:, None], 0)
    return np.asarray(np.take_along_axis(drawn, np.maximum.accumulate(row, axis=0), axis=0))
