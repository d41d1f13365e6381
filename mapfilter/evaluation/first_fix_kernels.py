"""Compiled loops of the ideal filter: walks, and the hypotheses that a journey leaves."""

from __future__ import annotations

from math import erfc
from typing import NamedTuple

import numpy as np
from numba import njit

from mapfilter._types import Bools, Floats32, Ints
from mapfilter.evaluation.radio_map import (
    MOST_RECEIVED,
    distance_squared,
    received_cells,
)

_AHEAD_STEPS = 6
_KEEP_ON = 2.5
_TURN_BACK = 1e-3
_HOPELESS = 30.0


@njit(cache=True)
def walk(rng, on_way, row, col, resolution_m, most_m):  # type: ignore[no-untyped-def]
    """Draw a journey over the points, two pixels a step in one of 16 directions.

    The probability of a direction grows with the length and straightness of the map along it.

    Returns
    -------
    rows, cols : numpy.ndarray of int64, shape (K,)
        Pixels, the start first.
    gone_m : numpy.ndarray, shape (K,)
        Metres travelled to each.
    """
    step_r = np.array([-2, -2, -2, -1, 0, 1, 2, 2, 2, 2, 2, 1, 0, -1, -2, -2])
    step_c = np.array([0, 1, 2, 2, 2, 2, 2, 1, 0, -1, -2, -2, -2, -2, -2, -1])
    length_px = np.sqrt((step_r * step_r + step_c * step_c).astype(np.float64))
    most = int(most_m / (2 * resolution_m)) + 2
    rows, cols = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64)
    gone_m = np.empty(most)
    rows[0], cols[0], gone_m[0] = row, col, 0.0
    chance = np.empty(16)
    count, heading = 1, -1
    while count < most and gone_m[count - 1] < most_m:
        row, col = rows[count - 1], cols[count - 1]
        total = 0.0
        for way in range(16):
            free = 0
            while free < _AHEAD_STEPS:
                r, c = row + (free + 1) * step_r[way], col + (free + 1) * step_c[way]
                if r < 0 or c < 0 or r >= on_way.shape[0] or c >= on_way.shape[1]:
                    break
                if not on_way[r, c]:
                    break
                free += 1
            chance[way] = (free / _AHEAD_STEPS) ** 2
            if heading >= 0:
                turn = np.cos((way - heading) * np.pi / 8)
                chance[way] *= np.exp(_KEEP_ON * (turn - 1)) if turn > -0.5 else _TURN_BACK
            total += chance[way]
        if total == 0.0:
            break
        left = rng.random() * total
        heading = 0
        while heading < 15 and left >= chance[heading]:
            left -= chance[heading]
            heading += 1
        rows[count], cols[count] = row + step_r[heading], col + step_c[heading]
        gone_m[count] = gone_m[count - 1] + length_px[heading] * resolution_m
        count += 1
    return rows[:count], cols[:count], gone_m[:count]


@njit(cache=True)
def _serves(level_dbm, best_dbm, floor_dbm, margin_db):  # type: ignore[no-untyped-def]
    return level_dbm > floor_dbm and level_dbm >= best_dbm - margin_db


class Levels(NamedTuple):
    """Levels of all pixels and cells, the best of each layer, and where hypotheses may be."""

    near_way: Bools
    level_dbm: Floats32
    best_dbm: Floats32
    site: Ints
    layer: Ints
    floor_dbm: float
    margin_db: float


class Judgement(NamedTuple):
    """Errors of levels and the criterion of an unambiguous position, for the kernels."""

    deviation_db: float
    correlation_m: float
    share: float
    near_px: float
    path_m: float
    apart_px: float
    mass: float


@njit(cache=True)
def judged_by_cells(rows, cols, gone_m, row, col, levels, near_px, path_m):  # type: ignore[no-untyped-def]
    """Return metres until all hypotheses are near the truth, and bits after ``path_m``."""
    near_way, level_dbm, best_dbm, _, layer, floor_dbm, margin_db = levels
    clear_m, bits = np.inf, -1.0
    from_row, from_col = row.copy(), col.copy()
    left = from_row.size
    for k in range(rows.size):
        server = np.argmax(level_dbm[rows[k], cols[k]])
        # Where no cell is received none tells anything, and hypotheses are only moved.
        told = level_dbm[rows[k], cols[k], server] > floor_dbm
        moved_r, moved_c = rows[k] - rows[0], cols[k] - cols[0]
        kept, farthest = 0, 0.0
        for h in range(left):
            r, c = from_row[h] + moved_r, from_col[h] + moved_c
            if r < 0 or c < 0 or r >= near_way.shape[0] or c >= near_way.shape[1]:
                continue
            if not near_way[r, c]:
                continue
            best = best_dbm[r, c, layer[server]]
            if told and not _serves(level_dbm[r, c, server], best, floor_dbm, margin_db):
                continue
            from_row[kept], from_col[kept] = from_row[h], from_col[h]
            off_r, off_c = from_row[h] - rows[0], from_col[h] - cols[0]
            farthest = max(farthest, off_r * off_r + off_c * off_c)
            kept += 1
        left = kept
        if clear_m == np.inf and farthest <= near_px * near_px:
            clear_m = gone_m[k]
        if bits < 0 and gone_m[k] >= path_m:
            bits = np.log2(row.size / left)
        if bits >= 0 and clear_m < np.inf:
            break
    return clear_m, (bits if bits >= 0 else np.log2(row.size / left))


@njit(cache=True)
def judged_by_levels(  # type: ignore[no-untyped-def]
    rng, rows, cols, gone_m, row, col, point, levels, judgement
):
    """Return metres until levels decide, whether rightly, bits, twin, and the twin's error."""
    near_way, level_dbm, _, site, layer, floor_dbm, _ = levels
    deviation_db, correlation_m, share, near_px, path_m, apart_px, mass = judgement
    clear_m, right, bits, twin, twin_error = np.inf, 0.0, -1.0, -1.0, 0.0
    cell_count = level_dbm.shape[2]
    own_db, site_db = rng.standard_normal(cell_count), rng.standard_normal(site.max() + 1)
    cells, part = np.empty(MOST_RECEIVED, dtype=np.int64), np.empty(MOST_RECEIVED)
    report, truth = np.empty(MOST_RECEIVED), np.empty(MOST_RECEIVED)
    off_db, apart_db = np.empty(MOST_RECEIVED), np.empty(MOST_RECEIVED)
    from_row, from_col, number = row.copy(), col.copy(), point.copy()
    left = from_row.size
    log_weight, apart = np.zeros(left), np.zeros(left)
    scale = deviation_db**2 * (1 - share)
    for k in range(rows.size):
        weight = 1.0
        if k > 0:
            step_m = gone_m[k] - gone_m[k - 1]
            weight = step_m / (2 * correlation_m)
            kept = np.exp(-step_m / correlation_m)
            new = np.sqrt(1 - kept * kept)
            for i in range(cell_count):
                own_db[i] = kept * own_db[i] + new * rng.standard_normal()
            for i in range(site_db.size):
                site_db[i] = kept * site_db[i] + new * rng.standard_normal()
        here_dbm = level_dbm[rows[k], cols[k]]
        received = received_cells(here_dbm, floor_dbm, site, layer, share, cells, part)
        for i in range(received):
            error = np.sqrt(share) * site_db[site[cells[i]]] + np.sqrt(1 - share) * own_db[cells[i]]
            truth[i] = level_dbm[rows[k], cols[k], cells[i]]
            report[i] = truth[i] + deviation_db * error
        counts_twins = bits < 0
        moved_r, moved_c = rows[k] - rows[0], cols[k] - cols[0]
        kept_count = 0
        heaviest = -np.inf
        for h in range(left):
            r, c = from_row[h] + moved_r, from_col[h] + moved_c
            if r < 0 or c < 0 or r >= near_way.shape[0] or c >= near_way.shape[1]:
                continue
            if not near_way[r, c]:
                continue
            for i in range(received):
                level = level_dbm[r, c, cells[i]]
                off_db[i] = report[i] - level
                apart_db[i] = truth[i] - level
            weighed = (
                log_weight[h] - 0.5 * weight * distance_squared(off_db, part, received) / scale
            )
            if counts_twins:
                squared = distance_squared(apart_db, part, received) / scale
                apart[kept_count] = apart[h] + weight * squared
            from_row[kept_count], from_col[kept_count] = from_row[h], from_col[h]
            number[kept_count], log_weight[kept_count] = number[h], weighed
            heaviest = max(heaviest, weighed)
            kept_count += 1
        left = kept_count
        if counts_twins and (gone_m[k] >= path_m or k == rows.size - 1):
            bits = np.log2(row.size) - _entropy_bits(log_weight[:left], heaviest)
            least = np.inf
            for h in range(left):
                off_r, off_c = from_row[h] - rows[0], from_col[h] - cols[0]
                if off_r * off_r + off_c * off_c >= apart_px * apart_px and apart[h] < least:
                    least, twin = apart[h], float(number[h])
            if least < np.inf:
                twin_error = 0.5 * erfc(np.sqrt(least) / 2 / np.sqrt(2.0))
        left = _without_hopeless(
            log_weight, apart, from_row, from_col, number, left, heaviest, bits < 0
        )
        if clear_m == np.inf:
            best = np.argmax(log_weight[:left])
            if _mass_near(log_weight, from_row, from_col, left, best, near_px) >= mass:
                clear_m = gone_m[k]
                off_r, off_c = from_row[best] - rows[0], from_col[best] - cols[0]
                right = 1.0 if off_r * off_r + off_c * off_c <= near_px * near_px else 0.0
        if bits >= 0 and clear_m < np.inf:
            break
    return clear_m, right, max(bits, 0.0), twin, twin_error


@njit(cache=True)
def _entropy_bits(log_weight, heaviest):  # type: ignore[no-untyped-def]
    total, moment = 0.0, 0.0
    for value in log_weight:
        weight = np.exp(value - heaviest)
        total += weight
        moment += weight * (value - heaviest)
    return (np.log(total) - moment / total) / np.log(2.0)


@njit(cache=True)
def _mass_near(log_weight, row, col, left, best, near_px):  # type: ignore[no-untyped-def]
    total, near = 0.0, 0.0
    for h in range(left):
        weight = np.exp(log_weight[h] - log_weight[best])
        total += weight
        off_r, off_c = row[h] - row[best], col[h] - col[best]
        if off_r * off_r + off_c * off_c <= near_px * near_px:
            near += weight
    return near / total


@njit(cache=True)
def _without_hopeless(  # type: ignore[no-untyped-def]
    log_weight, apart, row, col, number, left, heaviest, counts_twins
):
    """Drop hypotheses of no weight, unless they may be twins; return how many are left."""
    kept = 0
    for h in range(left):
        likely = log_weight[h] >= heaviest - _HOPELESS
        if likely or (counts_twins and apart[h] <= _HOPELESS):
            log_weight[kept], row[kept], col[kept] = log_weight[h], row[h], col[h]
            number[kept], apart[kept] = number[h], apart[h]
            kept += 1
    return kept


@njit(cache=True)
def try_all(rng, start, journeys, points, walked, levels, judgement):  # type: ignore[no-untyped-def]
    """Return what each journey of each start showed, shape (starts, journeys, 7)."""
    row, col, server, first, point = points
    on_way, resolution_m, most_m = walked
    near_px, path_m = judgement.near_px, judgement.path_m
    found = np.empty((start.size, journeys, 7))
    for i in range(start.size):
        here = start[i]
        own = point[first[server[here]] : first[server[here] + 1]]
        rows_own, cols_own = row[own], col[own]
        for j in range(journeys):
            rows, cols, gone_m = walk(rng, on_way, row[here], col[here], resolution_m, most_m)
            clear_m, bits = judged_by_cells(
                rows, cols, gone_m, rows_own, cols_own, levels, near_px, path_m
            )
            by_levels = judged_by_levels(
                rng, rows, cols, gone_m, rows_own, cols_own, own, levels, judgement
            )
            # One by one: for parts of arrays numba compiles checks of shapes, which take seconds.
            found[i, j, 0], found[i, j, 1] = clear_m, bits
            found[i, j, 2], found[i, j, 3], found[i, j, 4] = by_levels[:3]
            found[i, j, 5], found[i, j, 6] = by_levels[3:]
    return found
