"""One located track on the map: truth and estimate."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M, accuracy, position_errors_m
from mapfilter.evaluation.claims import claims_of
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.report.basemap import HALO, BaseMap, Bounds, attribute, draw_base, map_height_in
from mapfilter.report.canvas import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    SKY,
    VERMILLION,
    Look,
    check_axes,
    legend,
    mark,
    new_figure,
    styled,
    wrapped_title,
)
from mapfilter.report.track_marks import LEAST_MARGIN_M, lost_places, name_ends, surroundings

_MAP_IN = 8.0
_NOWHERE_M = (0.0, 0.0, 2 * LEAST_MARGIN_M, 2 * LEAST_MARGIN_M)
"""Extent without a map and without a position."""
_TRUTH = "#868686"
_GONE = (Status.LOST, Status.OUTSIDE)


@styled
def plot_track(
    estimate: TrackEstimate,
    truth: Truth | None,
    base: BaseMap | None,
    ax: Axes | None = None,
    *,
    fixes_m: Floats | None = None,
    title: str = "",
    zoom: bool = True,
) -> Axes:
    """Draw truth and estimate over the streets, and where the filter switched to tracking.

    Tracked estimates more than 50 m off are drawn in another colour and shape; those while the
    filter searched, was uncertain or lost are no claims, and small and pale whatever their error.
    Epochs without a position are not drawn; crosses mark the estimates (before any, the truth) at
    which the filter got lost. Positions that the log itself holds, such as GNSS
    fixes, are ``fixes_m``, (k, 2) as east and north. Without a title it is the filter's name and
    the outcome of the track; ``zoom`` shows only the surroundings of truth and estimate, or without
    either of the fixes, not the whole area; how many estimates lie outside is written down. Without
    a map (None) the ground is plain.
    """
    if truth is not None and not truth.time_s.size:
        truth = None
    bounds_m = surroundings(estimate, truth, fixes_m) if zoom or base is None else None
    if base is None:
        shown = BaseMap(bounds_m or _NOWHERE_M)
    else:
        shown = base if bounds_m is None else base.zoomed(bounds_m)
    check_axes(ax)
    axes = ax
    if axes is None:
        axes = new_figure(_MAP_IN + 0.8, map_height_in(shown, _MAP_IN) + 1.2).subplots()
    frame = draw_base(axes, shown)
    located = np.isfinite(estimate.east_m) & np.isfinite(estimate.north_m)
    found_m = estimate.east_m[located], estimate.north_m[located]
    off = np.zeros(len(estimate), dtype=bool)
    if truth is not None:
        # Wider than the marks of the estimate: neither hides the other.
        x, y = frame(truth.east_m, truth.north_m)
        path = Look(linewidth=6.5, solid_capstyle="round", solid_joinstyle="round")
        axes.plot(x, y, color=_TRUTH, zorder=4, label="truth", **path)
        name_ends(axes, x, y, np.column_stack(frame(*found_m)))
        off = position_errors_m(estimate, truth) > SUCCESS_RADIUS_M
    elif located.any():
        name_ends(axes, *frame(*found_m), np.empty((0, 2)))
    if fixes_m is not None and len(fixes_m):
        plus = Look(marker="+", color=BLACK, s=45.0, linewidths=0.7, zorder=4.5)
        axes.scatter(*frame(*fixes_m.T), label="positions of the log", **plus)
    claimed = claims_of(estimate)
    tracked = located & claimed
    groups = (
        (tracked & ~off, Look(marker="o", color=BLUE, s=9.0, zorder=6), "estimate"),
        (located & ~claimed, Look(marker="o", color=SKY, s=3.5, zorder=5), _unclaimed(estimate)),
        (tracked & off, Look(marker="v", color=ORANGE, s=9.0, zorder=7), "more than 50 m off"),
    )
    for which, look, label in groups:
        if which.any():
            at = frame(estimate.east_m[which], estimate.north_m[which])
            axes.scatter(*at, linewidths=0, **look)
            # Marks as small as on the map would not show their colour in the legend.
            axes.add_line(mark(label, look["marker"], 2 * look["s"] ** 0.5, color=look["color"]))
    lost_m = lost_places(estimate, truth)
    if len(lost_m):
        cross = Look(s=140, marker="X", color=BLACK, edgecolors="white", linewidths=1.0)
        axes.scatter(*frame(*lost_m.T), zorder=10.5, label="got lost here", **cross)
    switch = estimate.converged_at
    if switch is not None and located[switch]:
        x, y = frame(estimate.east_m[[switch]], estimate.north_m[[switch]])
        star = Look(s=230, marker="*", color=VERMILLION, edgecolors="white")
        axes.scatter(x, y, linewidths=1.0, zorder=10, label="switch to tracking", **star)
        if truth is not None and truth.tells(estimate.time_s[switch]):
            true_x, true_y = frame(*truth.at(estimate.time_s[[switch]]))
            ends = [x[0], true_x[0]], [y[0], true_y[0]]
            axes.plot(*ends, color=VERMILLION, linewidth=1.4, zorder=9)
            rim = Look(facecolors="white", edgecolors=GREEN, linewidths=2.0, zorder=9.5)
            axes.scatter(true_x, true_y, s=70, marker="D", label="truth at the switch", **rim)
    _note_outside(axes, np.column_stack(found_m), shown.bounds_m)
    words = title or f"{estimate.filter} filter: {_outcome(estimate, truth)}"
    axes.set_title(wrapped_title(axes, words))
    attribute(axes, shown)
    legend(axes, ax, 3)
    return axes


def _note_outside(axes: Axes, found_m: Floats, bounds_m: Bounds) -> None:
    """Write how many estimates lie outside of the picture, if any do."""
    west, south, east, north = bounds_m
    inside = (found_m >= (west, south)).all(axis=1) & (found_m <= (east, north)).all(axis=1)
    if count := int(np.sum(~inside)):
        words = f"{number_of(count, 'estimate')} outside of the picture"
        text = axes.text(0.008, 0.99, words, transform=axes.transAxes, zorder=20)
        text.set(ha="left", va="top", fontsize=8.5, path_effects=HALO)


def _unclaimed(estimate: TrackEstimate) -> str:
    """Return what estimates that are not tracked are called in the legend."""
    others = [one for one in (Status.UNCERTAIN, Status.LOST) if one in estimate.status]
    *words, last = "searching", *(one.lower() for one in others)
    return f"while {', '.join(words)} or {last}" if words else f"while {last}"


def _outcome(estimate: TrackEstimate, truth: Truth | None) -> str:
    """Return in words whether and when a track converged, how far off, and its accuracy then."""
    switch = estimate.converged_at
    if switch is None:
        words = "did not converge"
    else:
        words = f"converged after {estimate.time_s[switch]:.0f} s"
        score = None if truth is None else accuracy(estimate, truth)
        if score is not None and np.isfinite(score.error_at_switch_m):
            right = "" if score.success else " (wrong)"
            words += f", {score.error_at_switch_m:.0f} m off{right}"
            if np.isfinite(score.error_mean_m):
                words += f"; mean error then {score.error_mean_m:.1f} m"
    last = estimate.status[-1] if len(estimate) else Status.SEARCHING
    return f"{words}; {last.lower()} at the end" if last in _GONE else words
