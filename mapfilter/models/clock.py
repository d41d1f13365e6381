"""A receiver's clock: bias and drift driven by white and flicker noise.

States are c₀·δt in metres and its rate in metres per second. The process noise comes from the
Allan variance parameters h0, h-1 and h-2 of the oscillator (Brown & Hwang; Fritsche & Klein 2009,
section III-B).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError

SPEED_OF_LIGHT_MPS = 299_792_458.0


@dataclass(frozen=True, slots=True)
class Oscillator:
    """Parameters of a clock's Allan variance.

    Parameters
    ----------
    h0 : float
        White frequency noise, seconds.
    h_minus1 : float
        Flicker frequency noise, no unit.
    h_minus2 : float
        Random walk of the frequency, 1/s.
    """

    h0: float
    h_minus1: float
    h_minus2: float

    def __post_init__(self) -> None:
        faults = Faults()
        for name in ("h0", "h_minus1", "h_minus2"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                faults.add(f"oscillator, {name}", "a number >= 0", value)
        faults.raise_if_any(InputError)


QUARTZ = Oscillator(9.4e-20, 1.8e-19, 3.8e-21)
"""A typical quartz standard (Fritsche & Klein 2009, section III-B, from Mao et al. 2003)."""


def clock_noise(
    interval_s: float,
    oscillator: Oscillator = QUARTZ,
    cross_term: Literal["as_printed", "textbook"] = "as_printed",
) -> Floats:
    """Return the covariance of bias and drift gained over an interval, (2, 2), in m² and m²/s².

    ``Q11 = h0 T/2 + 2 h-1 T² + 2/3 π² h-2 T³``, ``Q12 = 2 h-1 T + π² h-2 T²`` and
    ``Q22 = h0/(2T) + 2 h-1 + 8/3 π² h-2 T``, each times c₀².

    Parameters
    ----------
    interval_s : float
    oscillator : Oscillator
    cross_term : {"as_printed", "textbook"}
        Fritsche & Klein print T³ in Q12, where the dimension asks for T².

    Raises
    ------
    InputError
        The interval is not positive.
    """
    if not (np.isfinite(interval_s) and interval_s > 0):
        faults = Faults()
        faults.add("interval_s", "seconds above 0", interval_s)
        faults.raise_if_any(InputError)
    h0, h1, h2 = oscillator.h0, oscillator.h_minus1, oscillator.h_minus2
    t, power = interval_s, 3 if cross_term == "as_printed" else 2
    bias = h0 * t / 2 + 2 * h1 * t**2 + 2 / 3 * np.pi**2 * h2 * t**3
    cross = 2 * h1 * t + np.pi**2 * h2 * t**power
    drift = h0 / (2 * t) + 2 * h1 + 8 / 3 * np.pi**2 * h2 * t
    return np.array([[bias, cross], [cross, drift]]) * SPEED_OF_LIGHT_MPS**2
