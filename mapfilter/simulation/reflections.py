"""Reception of satellites behind buildings by reflections: which, how late, and for how long."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Ge, Gt, Le
from numpy.typing import ArrayLike

from mapfilter._types import Bools, Floats
from mapfilter.gnss.noise import multipath_bias_m
from mapfilter.options import NotNegative, Options, Positive, Share


@dataclass(frozen=True, slots=True)
class NlosModel(Options):
    """Reception of satellites behind buildings by a reflection (non-line-of-sight, NLOS).

    A single reflection at a wall on the other side of the street is later by twice the distance to
    the wall times the cosine of the elevation, never earlier (Hsu 2018, *Analysis and modeling GPS
    NLOS effect in highly urbanized area*, GPS Solutions 22:7). Delays by ray tracing in streets
    follow gamma distributions whose shape falls with the depth of the street (Ollander, Bode & Baum
    2020, *Simulation-based analysis of multipath delay distributions in urban canyons*, ENC); here
    the shape is one, the exponential distribution.

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

    share: Share = 0.5
    full_share_deg: Annotated[float, Gt(0), Le(90)] = 30.0
    memory_m: Positive = 20.0
    delay_m: NotNegative = 30.0
    delay_memory_m: Positive = 10.0
    noise_factor: Annotated[float, Ge(1)] = 3.0

    def probability(self, elevation_rad: ArrayLike) -> Floats:
        """Return the probability that a hidden satellite is received.

        Examples
        --------
        >>> NlosModel(share=0.6).probability(np.radians([0.0, 15.0, 30.0, 80.0])).round(9).tolist()
        [0.0, 0.3, 0.6, 0.6]
        """
        ramp = np.asarray(elevation_rad, dtype=np.float64) / np.radians(self.full_share_deg)
        return np.asarray(self.share * np.clip(ramp, 0.0, 1.0))


def draw_reflections(
    model: NlosModel, travelled_m: Floats, elevation_rad: Floats, rng: np.random.Generator
) -> tuple[Bools, Floats]:
    """Draw which satellites would be received by reflections, were they hidden, and the delays (m).

    Neither depends on where satellites are hidden. ``travelled_m`` of shape (K,) never decreases;
    ``elevation_rad`` and both results have the shape (K, S).
    """
    satellites = elevation_rad.shape[1]
    level = held_along(travelled_m, satellites, model.memory_m, rng)
    excess = multipath_bias_m(
        travelled_m, satellites, rng, mean_m=1.0, correlation_m=model.delay_memory_m
    )
    received = level < model.probability(elevation_rad)
    return received, model.delay_m * np.cos(elevation_rad) * excess


def held_along(
    travelled_m: ArrayLike, columns: int, memory_m: float, rng: np.random.Generator
) -> Floats:
    """Draw uniform numbers that hold for exponentially distributed distances along a path.

    Two numbers of a column at a distance d are the same with probability ``exp(-d / memory_m)``,
    else independent; so are the columns. ``travelled_m`` of shape (K,) never decreases; the result
    has the shape (K, columns).
    """
    travelled = np.asarray(travelled_m, dtype=np.float64)
    drawn = rng.random((travelled.size, columns))
    keep = np.exp(-np.diff(travelled, prepend=-np.inf) / memory_m)
    anew = rng.random((travelled.size, columns)) >= keep[:, None]
    row = np.where(anew, np.arange(travelled.size)[:, None], 0)
    return np.asarray(np.take_along_axis(drawn, np.maximum.accumulate(row, axis=0), axis=0))
