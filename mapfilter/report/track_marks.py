"""Where a picture of a track has its names of ends, its crosses and its borders."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from mapfilter._types import Floats
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.report.basemap import HALO, Bounds
from mapfilter.report.canvas import BLACK, GREY

_MARGIN_SHARE = 0.08
LEAST_MARGIN_M = 40.0
_APART_PT, _HALF_WIDTH_PT, _HALF_HEIGHT_PT = 17.0, 16.0, 7.0
"""From a mark to the middle of its name, and half the size of the name with a rim."""
_SIDES = (
    *((0, -1), (0, 1), (1.4, 0), (-1.4, 0)),
    *((1.2, -0.8), (-1.2, -0.8), (1.2, 0.8), (-1.2, 0.8)),
)
_STRAY, _JUMP, _SMALLEST_M = 0.02, 0.1, 500.0
"""Share of positions that may be strays, and of the extent of the others that they jump."""
_STEP_PT, _MARK_PT, _NEVER = 3.0, 4.0, 1000.0


def name_ends(axes: Axes, x: Floats, y: Floats, others: Floats) -> None:
    """Mark where a path starts and ends, with names beside it: where least of the path is.

    Parameters
    ----------
    axes : matplotlib Axes
        With its limits.
    x, y : (N,) array
        The path.
    others : (K, 2) array
        Other points that names should leave free.
    """
    points_pt = np.concatenate([_filled(_points_pt(axes, x, y)), _points_pt(axes, *others.T)])
    ends_pt = _points_pt(axes, x[[0, -1]], y[[0, -1]])
    half_pt = np.array([_HALF_WIDTH_PT, _HALF_HEIGHT_PT])
    # Middles that a name may not be so near to: of marks, and of the other name.
    taken = [(end_pt, half_pt + _MARK_PT) for end_pt in ends_pt]
    for at, word, side, colour in ((0, "start", -1, "white"), (-1, "end", 1, GREY)):
        offset = _free_side(ends_pt[at], points_pt, taken, side)
        taken.append((ends_pt[at] + offset, 2 * half_pt))
        name = axes.annotate(word, (x[at], y[at]), tuple(offset), textcoords="offset points")
        name.set(ha="center", va="center", fontsize=9, path_effects=HALO, zorder=11)
        axes.scatter(x[at], y[at], s=50, color=colour, edgecolors=BLACK, zorder=9.8)


def lost_places(estimate: TrackEstimate, truth: Truth | None) -> Floats:
    """Return where the filter got lost, (k, 2) as east and north: its last position before.

    Where it had none yet it is the true one.
    """
    lost = np.array([status is Status.LOST for status in estimate.status], dtype=bool)
    begins = np.flatnonzero(lost & ~np.concatenate([[False], lost[:-1]]))
    at = np.column_stack([estimate.east_m, estimate.north_m])
    known = np.isfinite(at).all(axis=1)
    last = np.maximum.accumulate(np.where(known, np.arange(len(at)), -1)) if len(at) else begins
    # The first lost position is where the filter was not: the one before is what it claimed.
    before = np.where(begins > 0, last[begins - 1], -1)
    places: Floats = np.where((before >= 0)[:, None], at[before], np.nan)
    if truth is not None and len(begins):
        true_m = np.column_stack(truth.at(estimate.time_s[begins]))
        places = np.where((before >= 0)[:, None], places, true_m)
    kept: Floats = places[np.isfinite(places).all(axis=1)]
    return kept


def surroundings(
    estimate: TrackEstimate, truth: Truth | None, fixes_m: Floats | None
) -> Bounds | None:
    """Return the extent of all positions with a margin; None when there are none.

    Fixes may be far off, so that they count only where there is nothing else. Few positions that
    lie several times as far away as all others, such as a first fix in another town, do not count.
    """
    parts = [np.column_stack([estimate.east_m, estimate.north_m])]
    if truth is not None:
        parts.append(np.column_stack([truth.east_m, truth.north_m]))
    positions = np.concatenate(parts)
    positions = positions[np.isfinite(positions).all(axis=1)]
    if not len(positions) and fixes_m is not None:
        positions = fixes_m
    if not len(positions):
        return None
    positions = _without_strays(positions)
    low, high = positions.min(axis=0), positions.max(axis=0)
    margin_m = max(LEAST_MARGIN_M, _MARGIN_SHARE * float((high - low).max()))
    # No side is shorter than half the other one: a straight track still shows its surroundings.
    half = np.maximum((high - low) / 2, 0.25 * float((high - low).max())) + margin_m
    middle = (low + high) / 2
    west, south = (middle - half).tolist()
    south -= 0.05 * 2 * float(half[1])  # room for the scale bar
    east, north = (middle + half).tolist()
    return west, south, east, north


def _without_strays(positions: Floats) -> Floats:
    """Return positions without a few that jump about beyond the extent of all others."""
    low, high = np.quantile(positions, [_STRAY, 1 - _STRAY], axis=0)
    reach_m = max(float((high - low).max()), _SMALLEST_M)
    near = np.abs(positions - (low + high) / 2).max(axis=1) <= reach_m
    if near.all() or near.mean() < 1 - _STRAY:
        return positions
    # Who walks away after a long rest does not jump.
    step_m = np.hypot(*np.diff(positions, axis=0, append=positions[-1:]).T)
    return positions[near] if step_m[~near].max() > _JUMP * reach_m else positions


def _points_pt(axes: Axes, x: Floats, y: Floats) -> Floats:
    """Return points in the axes as typographic points; about those of the finished picture."""
    figure = axes.get_figure(root=True)
    dpi = 72.0 if figure is None else figure.dpi
    found: Floats = axes.transData.transform(np.column_stack([x, y])) * 72.0 / dpi
    return found


def _filled(path_pt: Floats) -> Floats:
    """Return a path with points between those that lie far apart."""
    steps = np.ceil(np.hypot(*np.diff(path_pt, axis=0).T) / _STEP_PT)
    steps = np.concatenate([[1.0], np.clip(steps, 1, 1000)])
    at = np.cumsum(steps)
    every = np.arange(at[0], at[-1] + 1)
    return np.column_stack([np.interp(every, at, axis) for axis in path_pt.T])


def _free_side(
    at_pt: Floats, points_pt: Floats, taken: Sequence[tuple[Floats, Floats]], preferred: int
) -> Floats:
    """Return the offset of a name beside a mark at which it covers the fewest points."""
    found, fewest = np.zeros(2), np.inf
    half_pt = np.array([_HALF_WIDTH_PT, _HALF_HEIGHT_PT])
    for side in _SIDES:
        offset = _APART_PT * np.array(side)
        covered = float((np.abs(points_pt - at_pt - offset) <= half_pt).all(axis=1).sum())
        near = sum(bool((np.abs(one - at_pt - offset) < room).all()) for one, room in taken)
        count = covered + _NEVER * near - (0.5 if side[1] * preferred > 0 else 0.0)
        if count < fewest:
            found, fewest = offset, count
    return found
