"""Going back along a track: which of the earlier hypotheses a later one may have come from."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapfilter._kernels import cos_sin32, exp32, hashed, uniforms, wrap32

Floats32 = NDArray[np.float32]

_F = np.float32


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def draw_ancestors(
    later: Floats32,
    earlier: Floats32,
    log_weight: Floats32,
    moved_east_m: float,
    moved_north_m: float,
    place_var_m2: float,
    bias_var_rad2: float,
    scale_var: float,
    log_jump: float,
    key: np.uint64,
    chosen: NDArray[np.int32],
) -> None:
    """Draw one ancestor of each later hypothesis: backward simulation (Godsill et al. 2004, eq. 6).

    An earlier hypothesis counts by its weight and by how well its own errors of heading and scale
    bring it, over the displacement by dead reckoning, to the later one.

    Parameters
    ----------
    later : ndarray of float32, shape (5, M)
    earlier : ndarray of float32, shape (5, N)
    log_weight : ndarray of float32, shape (N,)
    moved_east_m, moved_north_m : float
        Displacement by dead reckoning in between.
    place_var_m2, bias_var_rad2, scale_var : float
        Of what the motion adds in between.
    log_jump : float
        Log density of an unmeasured displacement: where no ancestor is nearer than that, the
        weights alone decide.
    key : numpy.uint64
    chosen : ndarray of int32, shape (M,)
        Filled.
    """
    count = earlier.shape[1]
    to_east, to_north = np.empty(count, dtype=np.float32), np.empty(count, dtype=np.float32)
    me, mn = _F(moved_east_m), _F(moved_north_m)
    for i in range(count):
        cosine, sine = cos_sin32(earlier[2, i])
        stretch = exp32(earlier[3, i])
        to_east[i] = earlier[0, i] + stretch * (me * cosine - mn * sine)
        to_north[i] = earlier[1, i] + stretch * (me * sine + mn * cosine)
    per_place, per_bias = _F(-0.5 / place_var_m2), _F(-0.5 / bias_var_rad2)
    per_scale, jump = _F(-0.5 / scale_var), _F(log_jump)
    fit = np.empty(count, dtype=np.float32)
    for j in range(later.shape[1]):
        x, y, b, s = later[0, j], later[1, j], later[2, j], later[3, j]
        highest = _F(-1e30)
        for i in range(count):
            dx, dy = x - to_east[i], y - to_north[i]
            db, ds = wrap32(b - earlier[2, i]), s - earlier[3, i]
            near = per_place * (dx * dx + dy * dy) + per_bias * db * db + per_scale * ds * ds
            near = near if near > jump else jump
            fit[i] = near + log_weight[i]
            highest = fit[i] if fit[i] > highest else highest
        total = 0.0
        for i in range(count):
            fit[i] = exp32(fit[i] - highest)
            total += fit[i]
        place, _ = uniforms(hashed(key, np.uint64(j)))
        goal, passed, found = place * total, 0.0, 0
        for i in range(count):
            passed += fit[i]
            found = i
            if passed >= goal:
                break
        chosen[j] = found
