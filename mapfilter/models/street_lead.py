"""Where dead reckoning leads the hypotheses of a belief over streets in the mean."""

from __future__ import annotations

import numpy as np
from numba import njit

from mapfilter._kernels import cos_sin32, exp32, wrap32
from mapfilter._types import Floats32

_F = np.float32


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def mean_lead(
    state: Floats32, weight: Floats32, east_m: float, north_m: float, near_m: float
) -> tuple[float, float]:
    """Return where a metre of dead reckoning leads the hypotheses near a place in the mean.

    These are the part in its direction and that to the left, by the errors that they have now; 1
    and 0 without any hypothesis near it.
    """
    x, y, reach, zero = _F(east_m), _F(north_m), _F(near_m * near_m), _F(0.0)
    east, north, bias, scale = state[0], state[1], state[2], state[3]
    turn, stretch = state[5], state[6]
    parts = np.empty((3, weight.size), dtype=np.float32)
    near, ahead, left = parts[0], parts[1], parts[2]
    for i in range(weight.size):
        dx, dy = east[i] - x, north[i] - y
        w = weight[i] if dx * dx + dy * dy <= reach else zero
        cosine, sine = cos_sin32(wrap32(bias[i] + turn[i]))
        length = w * exp32(scale[i] + stretch[i])
        near[i], ahead[i], left[i] = w, length * cosine, length * sine
    # Sums are apart from the loop that computes, which is vectorised.
    total, along, aside = 0.0, 0.0, 0.0
    for i in range(weight.size):
        total += near[i]
        along += ahead[i]
        aside += left[i]
    if not total > 0.0:
        return 1.0, 0.0
    return along / total, aside / total
