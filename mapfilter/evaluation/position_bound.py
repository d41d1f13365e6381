"""How well one report of levels can place a phone at each point: the Cramér-Rao bound.

With levels L(x) + e, e normal with covariance S, no unbiased estimate from one report has an error
covariance below the inverse of J = G' S⁻¹ G, G the gradients of the levels (Kay 1993, "Fundamentals
of Statistical Signal Processing: Estimation Theory", section 3.9; for levels, Patwari et al. 2003,
"Relative location estimation in wireless sensor networks"). This is exact for that model. The
gradients are not: they are those of planes fitted to the predicted levels within the distance over
which errors are correlated, because a street has no width across which levels could be compared.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from mapfilter._types import Floats
from mapfilter.evaluation.radio_map import MOST_RECEIVED, ErrorModel, RadioMap, received_cells

_STREET_M = 25.0
# A fit across less than this share of the window determines no slope in that direction.
_NARROW = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class PositionBound:
    """Bounds of the position error from one report, shape (N,) each, in the order of the points.

    Parameters
    ----------
    plane_m : numpy.ndarray
        Root of the trace of J⁻¹: both directions unknown. Infinite where levels carry no
        information along one of them.
    along_m : numpy.ndarray
        Where the street is known, and only the place along it is not; infinite likewise.
    """

    plane_m: Floats
    along_m: Floats


def position_bound(radio: RadioMap, errors: ErrorModel) -> PositionBound:
    """Return the bound at every point of a radio map."""
    resolution_m = radio.lattice.resolution_m
    way = np.zeros(radio.on_way.shape, dtype=np.int64)
    way[radio.row, radio.col] = radio.way_id
    plane_m, along_m = _bounds(
        radio.row,
        radio.col,
        radio.on_way,
        way,
        radio.level_dbm,
        radio.site,
        radio.layer,
        radio.floor_dbm,
        max(errors.correlation_m / resolution_m, 1.0),
        max(round(_STREET_M / resolution_m), 1),
        errors.deviation_db**2,
        errors.site_share,
    )
    return PositionBound(plane_m * resolution_m, along_m * resolution_m)


@njit(cache=True)
def _bounds(  # type: ignore[no-untyped-def]
    rows, cols, on_way, way, level_dbm, site, layer, floor_dbm, reach_px, street_px, variance, share
):
    """Return the bounds in pixels."""
    count = rows.size
    plane, along = np.full(count, np.inf), np.full(count, np.inf)
    cells = np.empty(MOST_RECEIVED, dtype=np.int64)
    slope, part = np.empty((MOST_RECEIVED, 2)), np.empty(MOST_RECEIVED)
    reach = int(np.ceil(reach_px))
    most = (2 * reach + 1) ** 2
    near_row, near_col = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64)
    weight = np.empty(most)
    for i in range(count):
        row, col = rows[i], cols[i]
        received = received_cells(level_dbm[row, col], floor_dbm, site, layer, share, cells, part)
        found = 0
        mean_r, mean_c, total = 0.0, 0.0, 0.0
        axis_rr, axis_rc, axis_cc = 0.0, 0.0, 0.0
        for r in range(max(row - reach, 0), min(row + reach + 1, on_way.shape[0])):
            for c in range(max(col - reach, 0), min(col + reach + 1, on_way.shape[1])):
                if not on_way[r, c]:
                    continue
                dr, dc = r - row, c - col
                squared = dr * dr + dc * dc
                if squared > reach_px * reach_px:
                    continue
                near_row[found], near_col[found] = r, c
                weight[found] = np.exp(-2.0 * squared / (reach_px * reach_px))
                mean_r += weight[found] * dr
                mean_c += weight[found] * dc
                total += weight[found]
                found += 1
                if squared <= street_px * street_px and way[r, c] == way[row, col]:
                    axis_rr += dr * dr
                    axis_rc += dr * dc
                    axis_cc += dc * dc
        mean_r /= total
        mean_c /= total
        s_rr, s_rc, s_cc = 0.0, 0.0, 0.0
        slope[:received] = 0.0
        for k in range(found):
            dr, dc = near_row[k] - row - mean_r, near_col[k] - col - mean_c
            s_rr += weight[k] * dr * dr
            s_rc += weight[k] * dr * dc
            s_cc += weight[k] * dc * dc
            for j in range(received):
                # Against the point itself, so that levels that are all the same have no slope.
                level = (
                    level_dbm[near_row[k], near_col[k], cells[j]] - level_dbm[row, col, cells[j]]
                )
                slope[j, 0] += weight[k] * dr * level
                slope[j, 1] += weight[k] * dc * level
        # Along the two axes of the window's points, apart from each other.
        turn = 0.5 * np.arctan2(2 * s_rc, s_rr - s_cc)
        cos, sin = np.cos(turn), np.sin(turn)
        major = s_rr * cos * cos + 2 * s_rc * cos * sin + s_cc * sin * sin
        minor = s_rr + s_cc - major
        if major <= 0:
            continue
        least = total * (_NARROW * reach_px / 2) ** 2
        for j in range(received):
            first = (slope[j, 0] * cos + slope[j, 1] * sin) / major
            second = 0.0
            if minor > least:
                second = (slope[j, 1] * cos - slope[j, 0] * sin) / minor
            slope[j, 0] = first * cos - second * sin
            slope[j, 1] = first * sin + second * cos
        j_rr, j_rc, j_cc = _information(slope, part, received, variance * (1.0 - share))
        determinant = j_rr * j_cc - j_rc * j_rc
        if minor > least and determinant > 1e-12 * (j_rr + j_cc) ** 2 and determinant > 0:
            plane[i] = np.sqrt((j_rr + j_cc) / determinant)
        street = 0.5 * np.arctan2(2 * axis_rc, axis_rr - axis_cc)
        cos, sin = np.cos(street), np.sin(street)
        gained = j_rr * cos * cos + 2 * j_rc * cos * sin + j_cc * sin * sin
        if axis_rr + axis_cc > 0 and gained > 1e-12 * (j_rr + j_cc):
            along[i] = 1.0 / np.sqrt(gained)
    return plane, along


@njit(cache=True)
def _information(slope, part, received, scale):  # type: ignore[no-untyped-def]
    """Return the entries of G' S⁻¹ G, with the inverse within each site in closed form."""
    rr, rc, cc = 0.0, 0.0, 0.0
    sum_r, sum_c = 0.0, 0.0
    for j in range(received):
        rr += slope[j, 0] * slope[j, 0]
        rc += slope[j, 0] * slope[j, 1]
        cc += slope[j, 1] * slope[j, 1]
        sum_r += slope[j, 0]
        sum_c += slope[j, 1]
        if part[j] > 0.0:
            rr -= part[j] * sum_r * sum_r
            rc -= part[j] * sum_r * sum_c
            cc -= part[j] * sum_c * sum_c
            sum_r, sum_c = 0.0, 0.0
    return rr / scale, rc / scale, cc / scale
