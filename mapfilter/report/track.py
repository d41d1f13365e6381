"""One track on the map: streets, truth, estimate and the switch."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M, Truth, position_errors_m
from mapfilter.filters.contract import Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.report.basemap import HALO, BaseMap, Bounds, attribute, draw_base, map_height_in
from mapfilter.report.canvas import BLACK, BLUE, GREEN, ORANGE, VERMILLION, picture

_MAP_IN = 8.0
_MARGIN_SHARE = 0.08
_LEAST_MARGIN_M = 40.0


def plot_track(
    estimate: TrackEstimate,
    truth: Truth | None,
    base: BaseMap,
    path: Path,
    *,
    title: str = "",
    zoom: bool = True,
) -> None:
    """Draw truth and estimate over the streets, and where the filter switched to tracking.

    Estimates more than 50 m off are drawn in another colour and shape.

    Parameters
    ----------
    estimate : TrackEstimate
        Epochs without a position are not drawn.
    truth : Truth or None
        The true path, where known.
    base : BaseMap
        The map below.
    path : Path
        PNG to write.
    title : str
        Above the map; without one, the filter's name and what came of the track.
    zoom : bool
        Show only the surroundings of truth and estimate, not the whole area.

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    bounds_m = _surroundings(estimate, truth) if zoom else None
    shown = base if bounds_m is None else base.zoomed(bounds_m)
    with picture(path, _MAP_IN + 0.8, map_height_in(shown, _MAP_IN) + 1.2) as figure:
        axes = figure.subplots()
        frame = draw_base(axes, shown)
        located = np.isfinite(estimate.east_m) & np.isfinite(estimate.north_m)
        off = np.zeros(len(estimate), dtype=bool)
        if truth is not None and truth.time_s.size:
            x, y = frame(truth.east_m, truth.north_m)
            axes.plot(x, y, color=BLACK, linewidth=2.6, zorder=4, label="truth")
            axes.annotate(
                "start", (float(x[0]), float(y[0])), xytext=(0, -13), textcoords="offset points",
                ha="center", fontsize=9, path_effects=list(HALO), zorder=3.5,
            )  # fmt: skip
            axes.scatter(x[:1], y[:1], s=50, color="white", edgecolors=BLACK, zorder=11)
            off = position_errors_m(estimate, truth) > SUCCESS_RADIUS_M
        near = located & ~off
        groups = ((near, BLUE, "o", "estimate"), (located & off, ORANGE, "v", "more than 50 m off"))
        for which, colour, marker, label in groups:
            if which.any():
                x, y = frame(estimate.east_m[which], estimate.north_m[which])
                axes.scatter(
                    x, y, s=10, marker=marker, color=colour, linewidths=0,
                    zorder=6, label=label,
                )  # fmt: skip
        switch = estimate.converged_at
        if switch is not None and located[switch]:
            x, y = frame(estimate.east_m[[switch]], estimate.north_m[[switch]])
            axes.scatter(
                x, y, s=230, marker="*", color=VERMILLION, edgecolors="white", linewidths=1.0,
                zorder=10, label="switch to tracking",
            )  # fmt: skip
            if truth is not None and truth.time_s.size:
                true_x, true_y = frame(*truth.at(estimate.time_s[[switch]]))
                axes.plot(
                    [float(x[0]), float(true_x[0])], [float(y[0]), float(true_y[0])],
                    color=VERMILLION, linewidth=1.4, zorder=9,
                )  # fmt: skip
                axes.scatter(
                    true_x, true_y, s=70, marker="D", facecolors="white", edgecolors=GREEN,
                    linewidths=2.0, zorder=9.5, label="truth at the switch",
                )  # fmt: skip
        axes.set_title(title or f"{estimate.filter}: {_verdict(estimate, truth)}")
        attribute(axes, shown)
        if axes.get_legend_handles_labels()[0]:
            figure.legend(loc="outside lower center", ncols=5, frameon=False)


def _verdict(estimate: TrackEstimate, truth: Truth | None) -> str:
    """Return in words what came of a track: success, wrong or never switched, and whether lost."""
    switch = estimate.converged_at
    said = "never switched"
    if switch is not None:
        said = f"switched after {estimate.time_s[switch]:.0f} s"
        if truth is not None and truth.time_s.size:
            error_m = float(position_errors_m(estimate, truth)[switch])
            kind = "success" if error_m <= SUCCESS_RADIUS_M else "wrong"
            said = f"{kind}, {error_m:.0f} m off at the switch" if np.isfinite(error_m) else said
    lost = len(estimate) and estimate.status[-1] is Status.LOST
    return f"{said}; lost at the end" if lost else said


def _surroundings(estimate: TrackEstimate, truth: Truth | None) -> Bounds | None:
    """Return the extent of all positions with a margin; None when there are none."""
    parts = [np.column_stack([estimate.east_m, estimate.north_m])]
    if truth is not None:
        parts.append(np.column_stack([truth.east_m, truth.north_m]))
    positions = np.concatenate(parts)
    positions = positions[np.isfinite(positions).all(axis=1)]
    if not len(positions):
        return None
    low, high = positions.min(axis=0), positions.max(axis=0)
    margin_m = max(_LEAST_MARGIN_M, _MARGIN_SHARE * float((high - low).max()))
    # No side is shorter than half the other one: a straight track still shows its surroundings.
    half = np.maximum((high - low) / 2, 0.25 * float((high - low).max())) + margin_m
    middle = (low + high) / 2
    west, south = (middle - half).tolist()
    south -= 0.05 * 2 * float(half[1])  # room for the scale bar
    east, north = (middle + half).tolist()
    return west, south, east, north
