"""One located track on the map: truth and estimate, and its belief at up to six moments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil, sqrt

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mapfilter._types import Floats
from mapfilter.errors import InputError, fail
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M, Truth, accuracy, position_errors_m
from mapfilter.filters.contract import Status
from mapfilter.positioning.estimate import Snapshot, TrackEstimate
from mapfilter.report.basemap import (
    HALO,
    BaseMap,
    Bounds,
    LocalFrame,
    attribute,
    draw_base,
    map_height_in,
)
from mapfilter.report.canvas import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    STREET,
    VERMILLION,
    Look,
    bottom_legend,
    grouped,
    legend,
    mark,
    new_figure,
    styled,
)

MAX_PANELS = 6

_MAP_IN, _PANEL_IN = 8.0, 4.0
_MARGIN_SHARE = 0.08
_LEAST_MARGIN_M = 40.0
_TRUTH = "#868686"
_SIDE_M, _MOST_SQUARES = 10.0, 200
_DECADES, _FAINTEST = 2.0, 0.12
_FAINTEST_CANDIDATE = 0.15

_Draw = Callable[[Axes, LocalFrame, Snapshot], None]


@styled
def plot_track(
    estimate: TrackEstimate,
    truth: Truth | None,
    base: BaseMap,
    ax: Axes | None = None,
    *,
    title: str = "",
    zoom: bool = True,
) -> Axes:
    """Draw truth and estimate over the streets, and where the filter switched to tracking.

    Estimates more than 50 m off are drawn in another colour and shape, epochs without a position
    are not drawn. Without a title it is the filter's name and the outcome of the track; ``zoom``
    shows only the surroundings of truth and estimate, not the whole area.
    """
    if truth is not None and not truth.time_s.size:
        truth = None
    bounds_m = _surroundings(estimate, truth) if zoom else None
    shown = base if bounds_m is None else base.zoomed(bounds_m)
    axes = ax
    if axes is None:
        axes = new_figure(_MAP_IN + 0.8, map_height_in(shown, _MAP_IN) + 1.2).subplots()
    frame = draw_base(axes, shown)
    located = np.isfinite(estimate.east_m) & np.isfinite(estimate.north_m)
    off = np.zeros(len(estimate), dtype=bool)
    if truth is not None:
        # Wider than the marks of the estimate: neither hides the other.
        x, y = frame(truth.east_m, truth.north_m)
        path = Look(linewidth=6.5, solid_capstyle="round", solid_joinstyle="round")
        axes.plot(x, y, color=_TRUTH, zorder=4, label="truth", **path)
        name = axes.annotate("start", (x[0], y[0]), (0, -14), textcoords="offset points")
        name.set(ha="center", fontsize=9, path_effects=HALO, zorder=3.5)
        axes.scatter(x[:1], y[:1], s=50, color="white", edgecolors=BLACK, zorder=11)
        off = position_errors_m(estimate, truth) > SUCCESS_RADIUS_M
    near = located & ~off
    groups = ((near, BLUE, "o", "estimate"), (located & off, ORANGE, "v", "more than 50 m off"))
    for which, colour, marker, label in groups:
        if which.any():
            at = frame(estimate.east_m[which], estimate.north_m[which])
            look = Look(s=9, marker=marker, color=colour, linewidths=0)
            axes.scatter(*at, zorder=6, label=label, **look)
    switch = estimate.converged_at
    if switch is not None and located[switch]:
        x, y = frame(estimate.east_m[[switch]], estimate.north_m[[switch]])
        star = Look(s=230, marker="*", color=VERMILLION, edgecolors="white")
        axes.scatter(x, y, linewidths=1.0, zorder=10, label="switch to tracking", **star)
        if truth is not None:
            true_x, true_y = frame(*truth.at(estimate.time_s[[switch]]))
            ends = [x[0], true_x[0]], [y[0], true_y[0]]
            axes.plot(*ends, color=VERMILLION, linewidth=1.4, zorder=9)
            rim = Look(facecolors="white", edgecolors=GREEN, linewidths=2.0, zorder=9.5)
            axes.scatter(true_x, true_y, s=70, marker="D", label="truth at the switch", **rim)
    axes.set_title(title or f"{estimate.filter} filter: {_outcome(estimate, truth)}")
    attribute(axes, shown)
    legend(axes, ax, 5)
    return axes


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
    lost = len(estimate) and estimate.status[-1] is Status.LOST
    return f"{words}; lost at the end" if lost else words


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


@styled
def plot_belief(snapshots: Sequence[Snapshot], truth: Truth | None, base: BaseMap) -> Figure:
    """Draw the probabilities of places at one to six moments, one panel each.

    A square of 10 m (or of half a percent of a larger area) fades with its probability, down to a
    hundredth of the likeliest square's; squares with less than a thousandth are not drawn. Every
    panel shows the whole area and names the distance travelled, in true metres where the truth is
    known.

    Raises
    ------
    InputError
        There is no snapshot, or more than six.
    """
    west, south, east, north = base.bounds_m
    side_m = max(_SIDE_M, max(east - west, north - south) / _MOST_SQUARES)

    def draw(axes: Axes, frame: LocalFrame, snapshot: Snapshot) -> None:
        if not snapshot.weight.size:
            return
        at_m = np.array([snapshot.hypothesis_east_m, snapshot.hypothesis_north_m])
        low = np.floor(at_m.min(axis=1) / side_m).astype(np.int64)
        col, row = np.floor(at_m / side_m).astype(np.int64) - low[:, None]
        mass = np.zeros((int(row.max()) + 1, int(col.max()) + 1))
        np.add.at(mass, (row, col), snapshot.weight)
        pixels = np.empty((*mass.shape, 4))
        pixels[..., :3] = to_rgb(BLUE)
        pixels[..., 3] = fading(mass / mass.max())
        extent = frame.extent((*(low * side_m), *((low + mass.shape[1::-1]) * side_m)))
        limits = axes.get_xlim(), axes.get_ylim()
        axes.imshow(pixels, extent=extent, origin="lower", interpolation="nearest", zorder=4)
        axes.set(xlim=limits[0], ylim=limits[1])

    shares = {"likeliest": 1.0, "a tenth of it": 0.1, "a hundredth": 0.01}
    look = Look(markeredgewidth=0, color=BLUE)
    marks = [
        mark(name, "s", 7, alpha=float(fading(np.array(share))), **look)
        for name, share in shares.items()
    ]
    return _plot_panels(snapshots, truth, base, draw, _mass_text, marks)


@styled
def plot_candidates(snapshots: Sequence[Snapshot], truth: Truth | None, base: BaseMap) -> Figure:
    """Draw the hypotheses at up to six moments, one panel each, with truth and estimate.

    Every panel names the number of hypotheses left; a hypothesis fades with its share of the
    belief. Errors are those of :func:`plot_belief`.
    """

    def draw(axes: Axes, frame: LocalFrame, snapshot: Snapshot) -> None:
        count = snapshot.hypothesis_east_m.size
        if not count:
            return
        x, y = frame(snapshot.hypothesis_east_m, snapshot.hypothesis_north_m)
        colours = np.empty((count, 4))
        colours[:, :3] = to_rgb(BLUE)
        share = snapshot.weight / snapshot.weight.max()
        colours[:, 3] = _FAINTEST_CANDIDATE + (1 - _FAINTEST_CANDIDATE) * np.clip(share, 0.0, 1.0)
        # Few are drawn large, thousands small enough to show the streets they lie on.
        size = float(np.clip(90.0 / sqrt(count), 2.0, 36.0))
        axes.scatter(x, y, s=size, c=colours, linewidths=0, zorder=4)

    def text(snapshot: Snapshot) -> str:
        left = snapshot.hypothesis_east_m.size
        return f"{grouped(left)} {'candidate' if left == 1 else 'candidates'}"

    dot = mark("candidates", "o", 5, color=BLUE)
    return _plot_panels(snapshots, truth, base, draw, text, [dot])


def _plot_panels(
    snapshots: Sequence[Snapshot],
    truth: Truth | None,
    base: BaseMap,
    draw: _Draw,
    text: Callable[[Snapshot], str],
    marks: Sequence[Line2D],
) -> Figure:
    count = len(snapshots)
    if not 1 <= count <= MAX_PANELS:
        raise fail(InputError, "snapshots", f"1 to {MAX_PANELS}", count)
    if truth is not None and not truth.time_s.size:
        truth = None
    columns = count if count <= 3 else ceil(count / 2)
    rows = ceil(count / columns)
    height_in = rows * (map_height_in(base, _PANEL_IN) + 0.45) + 0.9
    figure = new_figure(columns * (_PANEL_IN + 0.1) + 0.6, height_in)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for index, (axes, snapshot) in enumerate(zip(panels, snapshots, strict=False)):
        frame = draw_base(axes, base, scale_bar=index == 0)
        draw(axes, frame, snapshot)
        _draw_path(axes, frame, snapshot, truth)
        travelled = f"{snapshot.travelled_m:.0f} m by dead reckoning"
        if truth is not None:
            travelled = f"{float(truth.distance_at(snapshot.time_s)):.0f} m travelled"
        title = f"({'abcdef'[index]}) {travelled}, {text(snapshot)}"
        axes.set_title(title, fontsize=10.5)
        if index % columns:
            axes.set_ylabel("")
            axes.set_yticklabels([])
        if index + columns < count:
            axes.set_xlabel("")
            axes.set_xticklabels([])
    for axes in panels[count:]:
        axes.set_visible(False)
    attribute(panels[count - 1], base)
    handles = [Line2D([], [], color=STREET, linewidth=2, label="where one can be"), *marks]
    if truth is not None:
        rim = Look(markerfacecolor="none", markeredgecolor=BLACK, markeredgewidth=1.6)
        handles.append(Line2D([], [], color=BLACK, linewidth=1.3, label="true path so far"))
        handles.append(mark("true position", "D", 7, **rim))
    if any(np.isfinite(s.east_m) for s in snapshots):
        handles.append(mark("estimate", "*", 13, color=VERMILLION, markeredgecolor="white"))
    bottom_legend(figure, len(handles), handles)
    return figure


def _draw_path(axes: Axes, frame: LocalFrame, snapshot: Snapshot, truth: Truth | None) -> None:
    if truth is not None:
        past = truth.time_s <= snapshot.time_s
        axes.plot(
            *frame(truth.east_m[past], truth.north_m[past]), color=BLACK, linewidth=1.3, zorder=5
        )
        at = frame(*truth.at(snapshot.time_s))
        rim = Look(facecolors="none", edgecolors=BLACK, linewidths=1.6)
        axes.scatter(*at, s=52, marker="D", zorder=7, **rim)
    if np.isfinite(snapshot.east_m) and np.isfinite(snapshot.north_m):
        at = frame(np.array([snapshot.east_m]), np.array([snapshot.north_m]))
        rim = Look(color=VERMILLION, edgecolors="white", linewidths=0.7)
        axes.scatter(*at, s=150, marker="*", zorder=8, **rim)


def fading(share: Floats) -> Floats:
    """Return the opacity of a square by its share of the likeliest square's probability.

    Examples
    --------
    >>> fading(np.array([1.0, 0.1, 0.01, 0.001, 0.0005])).round(2).tolist()
    [1.0, 0.5, 0.12, 0.12, 0.0]
    """
    with np.errstate(divide="ignore"):
        decades = np.log10(share)
    opaque = np.clip(1.0 + decades / _DECADES, _FAINTEST, 1.0)
    return np.where(share >= 1e-3, opaque, 0.0)


def _mass_text(snapshot: Snapshot) -> str:
    off_m = np.hypot(
        snapshot.hypothesis_east_m - snapshot.east_m, snapshot.hypothesis_north_m - snapshot.north_m
    )
    share = float(snapshot.weight[off_m <= SUCCESS_RADIUS_M].sum())
    shown = "> 99.9" if share > 0.999 else f"{100 * share:.{1 if share > 0.99 else 0}f}"
    words = f"{shown} % within {SUCCESS_RADIUS_M:.0f} m"
    return f"{words}: converged" if snapshot.status is Status.CONVERGED else words
