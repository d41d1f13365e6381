"""What a Kalman-type filter with dead reckoning knows less of as time passes.

A gyroscope's bias wanders: what fixes have found of it is right while they go on, and grows old
once they end. Taken for right for ever, it would lead a vehicle along a bent way within a radius
that is too small.
"""

from __future__ import annotations

from math import expm1, radians

import numpy as np

from mapfilter.positioning.kalman.lasting import Motion
from mapfilter.positioning.kalman.models import KalmanOptions
from mapfilter.positioning.kalman.reckoning import RATE, RECKONED, at_rest

_WANDER_RADPS, _WANDER_S = radians(0.05), 150.0
"""How far the bias of a gyroscope of a phone or a car wanders, at most (its bias instability), and
the time in which it does."""


def as_time_passes(options: KalmanOptions, elapsed_s: float, rate_var_radps2: float) -> Motion:
    """Return transition, noise and shift of what changes whether one moves or not.

    The position wanders, and so does the error of the rate of turns. After a time t since it was
    known it is off by a variance of S² (1 - exp(-t / τ)), the structure function of a first-order
    Gauss-Markov process about an offset that may be large; S is what is stated of the whole error.

    Parameters
    ----------
    options : KalmanOptions
    elapsed_s : float
        Since the epoch before.
    rate_var_radps2 : float
        Variance of the error of the rate by then, (rad/s)².
    """
    transition, noise, shift = at_rest(RECKONED)
    noise[:2, :2] = options.drift_m_per_sqrt_s**2 * elapsed_s * np.eye(2)
    most = min(radians(options.turn_rate_sd_deg_per_s), _WANDER_RADPS) ** 2
    noise[RATE, RATE] = -expm1(-elapsed_s / _WANDER_S) * max(most - rate_var_radps2, 0.0)
    return transition, noise, shift
