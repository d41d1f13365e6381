"""Errors of tracks along the way or over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mapfilter._types import Bools, Floats
from mapfilter.errors import InputError, fail
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M, accuracy, position_errors_m
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.report.basemap import HALO
from mapfilter.report.canvas import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILLION,
    Look,
    bottom_legend,
    legend,
    new_figure,
    single_axes,
    stretches,
    styled,
    tidy,
)
from mapfilter.report.pauses import broken_at_pauses

_SIZE_IN = (9.0, 4.8)
_SHADES = {
    Status.SEARCHING: "#eeeeee",
    Status.UNCERTAIN: "#fbf3d0",
    Status.LOST: "#f7d9c9",
    Status.OUTSIDE: "#c4dcf0",
}
_SPANS = tuple(_SHADES.values())
_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, VERMILLION, GREY)
_WIDE, _LEAST_M = 12.0, 0.3
_NEARLY_ALL = 0.9
_PANEL_IN, _PANELS_WIDE = (4.4, 2.3), 2


@styled
def plot_error_over_distance(
    estimate: TrackEstimate,
    truth: Truth,
    ax: Axes | None = None,
    *,
    title: str = "",
    single_reports_m: Floats | None = None,
) -> Axes:
    """Draw the position error over the true distance travelled.

    The error's axis is logarithmic where hundreds of metres become few; the filter's own radii are
    a band, its protection levels dotted; epochs without a position, and pauses without an epoch,
    leave a gap. Marks the switch
    from searching to tracking, the 50 m that count as success there, the mean and the 67 and 95 %
    errors after it, and where the filter was searching, uncertain, lost or outside of the map.
    ``single_reports_m`` are errors of reports that were located one by one: their median is a line.
    Without a title it is the filter's name.
    """
    distance_m = distance_along_m(estimate, truth)
    errors_m = position_errors_m(estimate, truth)
    length_m = max(float(truth.distance_at(truth.time_s[-1])), 1.0)
    score = accuracy(estimate, truth)
    known_m = errors_m[np.isfinite(errors_m)]
    most_m = max(float(known_m.max(initial=0.0)), 1.1 * SUCCESS_RADIUS_M)
    beside_m = np.nan
    if single_reports_m is not None and single_reports_m.size:
        beside_m = float(np.median(single_reports_m))
        most_m = max(most_m, beside_m)
    axes = single_axes(ax, *_SIZE_IN)
    axes.set(xlim=(0.0, length_m), ylim=(0.0, 1.15 * most_m))
    if score.switched and most_m > _WIDE * score.error_95_m:
        # Hundreds of metres while searching would press what follows flat.
        axes.set(yscale="log", ylim=(_LEAST_M, 2 * most_m))
        axes.yaxis.set_major_formatter("{x:g}")
    shade_statuses(axes, estimate, distance_m)
    near = Look(color=VERMILLION, linewidth=1.2, linestyle=(0, (5, 3)))
    limit = f"{SUCCESS_RADIUS_M:.0f} m: limit of a right switch"
    axes.axhline(SUCCESS_RADIUS_M, label=limit, **near)
    if np.isfinite(beside_m):
        dash_dot = Look(color=GREY, linewidth=1.2, linestyle=(0, (7, 2, 1, 2)))
        axes.axhline(beside_m, label=f"reports without motion, median {beside_m:.0f} m", **dash_dot)
    at_m, radii_m, levels_m, drawn_m = broken_at_pauses(
        estimate, distance_m, estimate.radii_m, estimate.protection_m, errors_m
    )
    if np.isfinite(radii_m[:, 2]).any():
        for radius_m in radii_m.T:
            axes.fill_between(at_m, radius_m, color=ORANGE, alpha=0.16, linewidth=0)
        band = Look(color=ORANGE, linewidth=1.1, label="95 % radius; darker: 67, 50 %")
        axes.plot(at_m, radii_m[:, 2], **band)
    levels_m = np.where(np.isfinite(levels_m), levels_m, np.nan)
    if np.isfinite(levels_m).any():
        dotted = Look(color=PURPLE, linewidth=1.1, linestyle=(0, (1, 1.5)))
        axes.plot(at_m, levels_m, label="protection level", **dotted)
    if known_m.size:
        axes.plot(at_m, drawn_m, color=BLUE, linewidth=1.5, label="error")
    if score.switched:
        from_m, error_m = float(truth.distance_at(score.switch_time_s)), score.error_at_switch_m
        star = Look(markersize=15, markeredgecolor="white", zorder=6, clip_on=False)
        name = f"switch: {error_m:.0f} m off after {from_m:.0f} m"
        if score.success is None:
            name = "switch: where the truth is not known"
        axes.plot([from_m], [error_m], "*", color=VERMILLION, label=name, **star)
        for figure, after_m, dashes, colour in (
            ("mean", score.error_mean_m, "-", BLACK),
            ("67 %", score.error_67_m, (0, (6, 2)), GREEN),
            ("95 %", score.error_95_m, (0, (1.5, 1.5)), GREY),
        ):
            if np.isfinite(after_m):
                look = Look(color=colour, linestyle=dashes, linewidth=1.4, zorder=5)
                name = f"{figure} after the switch: {after_m:.1f} m"
                axes.plot([from_m, length_m], [after_m, after_m], label=name, **look)
    else:
        text = axes.text(0.5, 0.55, "never switched to tracking", transform=axes.transAxes)
        text.set(ha="center", color=GREY, fontsize=12, path_effects=HALO)
    axes.set(xlabel="distance travelled / m", ylabel="position error / m")
    if not covers(truth, estimate):
        axes.set_xlabel(f"distance travelled / m, in the {_covered(truth, estimate)}")
    axes.set_title(title or f"Filter: {estimate.filter}")
    tidy(axes, grid=False)
    legend(axes, ax, 4)
    return axes


@styled
def plot_errors_over_time(
    estimates: Mapping[str, TrackEstimate],
    truth: Truth,
    ax: Axes | None = None,
    *,
    spans: Sequence[tuple[str, float, float]] = (),
    title: str = "",
) -> Axes:
    """Draw the position errors of up to six estimates, by their names, on a logarithmic axis.

    ``spans`` are stretches of time to shade: name, begin and end in seconds.
    """
    axes = single_axes(ax, *_SIZE_IN)
    for (name, begin_s, end_s), shade in zip(spans, _SPANS, strict=False):
        axes.axvspan(begin_s, end_s, color=shade, linewidth=0, zorder=0, label=name)
    for (name, estimate), colour in zip(estimates.items(), _COLOURS, strict=False):
        errors_m = position_errors_m(estimate, truth).clip(_LEAST_M)
        drawn = broken_at_pauses(estimate, estimate.time_s, errors_m)
        axes.plot(*drawn, color=colour, linewidth=1.4, label=name)
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_ylim(bottom=_LEAST_M)
    axes.set_xlim(float(truth.time_s[0]), float(truth.time_s[-1]))
    axes.set(xlabel="time / s", ylabel="position error / m", title=title)
    tidy(axes, grid=False)
    legend(axes, ax, 3)
    return axes


@styled
def plot_errors_apart(
    estimates: Mapping[str, TrackEstimate],
    truth: Truth,
    *,
    spans: Sequence[tuple[str, float, float]] = (),
) -> Figure:
    """Draw the position errors of several estimates over time, each in a panel of its own.

    The others stand behind it in grey, so that six lines can be told apart. ``spans`` are as of
    :func:`plot_errors_over_time`.

    Raises
    ------
    InputError
        There is no estimate.
    """
    if not estimates:
        raise fail(InputError, "estimates", "one or more, by their names", "none")
    drawn = {
        name: broken_at_pauses(one, one.time_s, position_errors_m(one, truth).clip(_LEAST_M))
        for name, one in estimates.items()
    }
    rows = -(-len(estimates) // _PANELS_WIDE)
    figure = new_figure(_PANELS_WIDE * _PANEL_IN[0], rows * _PANEL_IN[1] + 0.5)
    panels = figure.subplots(rows, _PANELS_WIDE, sharex=True, sharey=True, squeeze=False).ravel()
    for index, (axes, name) in enumerate(zip(panels, estimates, strict=False)):
        for (span, begin_s, end_s), shade in zip(spans, _SPANS, strict=False):
            axes.axvspan(begin_s, end_s, color=shade, linewidth=0, zorder=0, label=span)
        for other in estimates:
            behind = Look(color="#c8c8c8", linewidth=0.7, zorder=1.5)
            look = Look(color=BLUE, linewidth=1.5, zorder=3) if other == name else behind
            axes.plot(*drawn[other], **look)
        axes.set_title(name, fontsize=10.5)
        tidy(axes, grid=False)
        if index + _PANELS_WIDE >= len(estimates):
            axes.set_xlabel("time / s")
            axes.tick_params(labelbottom=True)
    panels[0].set(yscale="log", xlim=(float(truth.time_s[0]), float(truth.time_s[-1])))
    panels[0].set_ylim(bottom=_LEAST_M)
    panels[0].yaxis.set_major_formatter("{x:g}")
    for axes in panels[len(estimates) :]:
        axes.set_visible(False)
    figure.supylabel("position error / m", fontsize=10)
    shaded = panels[0].get_legend_handles_labels()[0]
    others = Line2D([], [], color="#c8c8c8", linewidth=0.9, label="the others")
    bottom_legend(figure, 6, [Line2D([], [], color=BLUE, label="error"), others, *shaded])
    return figure


def distance_along_m(estimate: TrackEstimate, truth: Truth) -> Floats:
    """Return the true distance travelled at each epoch; NaN before and after the truth."""
    covered = _during(truth, estimate)
    return np.where(covered, truth.distance_at(estimate.time_s), np.nan)


def _during(truth: Truth, estimate: TrackEstimate) -> Bools:
    """Return which epochs lie within the times of a truth."""
    return np.asarray((estimate.time_s >= truth.time_s[0]) & (estimate.time_s <= truth.time_s[-1]))


def covers(truth: Truth, estimate: TrackEstimate) -> bool:
    """Return whether there is a truth at nearly all epochs."""
    return not len(estimate) or bool(_during(truth, estimate).mean() >= _NEARLY_ALL)


def _covered(truth: Truth, estimate: TrackEstimate) -> str:
    known_s, whole_s = np.ptp(truth.time_s), np.ptp(estimate.time_s)
    return f"{known_s:.0f} of {whole_s:.0f} s with a truth"


def shade_statuses(
    axes: Axes, estimate: TrackEstimate, along: Floats, *, named: bool = True
) -> None:
    """Shade where the filter was searching, uncertain, lost or outside of the map, a shade each.

    ``along`` is finite where there is something to shade.
    """
    for status, colour in _SHADES.items():
        has = np.array([s is status for s in estimate.status], dtype=bool) & np.isfinite(along)
        name = status.lower() if named else None
        for first, end in stretches(has):
            last = end if end < along.size and np.isfinite(along[end]) else end - 1
            ends = float(along[first]), float(along[last])
            axes.axvspan(*ends, color=colour, linewidth=0, zorder=0, label=name)
            name = None
