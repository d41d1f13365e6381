"""Stanford diagrams, coverage of radii, and the worst run of a case."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from numpy.typing import ArrayLike

from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M, position_errors_m
from mapfilter.evaluation.stanford import BINS, StanfordCounts
from mapfilter.evaluation.truth import Truth
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.report.basemap import HALO, BaseMap, LocalFrame, local_frame
from mapfilter.report.canvas import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    VERMILLION,
    Look,
    figure_of,
    grouped,
    legend,
    new_figure,
    single_axes,
    styled,
    tidy,
)
from mapfilter.report.errors import distance_along_m, shade_statuses
from mapfilter.report.pauses import broken_at_pauses
from mapfilter.report.track import plot_track

_SIDE_IN = 6.4
_RUN_IN = (13.0, 6.8)
_WRAP, _LEAST_M, _MOST_M = 150, 0.5, 2000.0
_AROUND_S, _LEAST_HALF_M = 60.0, 60.0
_UNIT = re.compile(r"(\d) (m²|m|km|s|%)")
_FILLS = {
    "available": "#e4f3ec",
    "misleading": "#fbe9c6",
    "hazardous": "#f6cdb8",
    "unavailable": "#ededed",
    "unavailable_misleading": "#dcd3dd",
}


@styled
def plot_stanford(
    bins: ArrayLike,
    counts: StanfordCounts,
    alert_limit_m: float,
    ax: Axes | None = None,
    *,
    title: str = "",
) -> Axes:
    """Draw a Stanford diagram: how often which error had which protection level.

    Regions carry their name and their share of the epochs; the last bins hold all beyond.

    Parameters
    ----------
    bins : array_like, shape (K, 3)
        From :func:`mapfilter.evaluation.stanford.stanford_bins`; equal bins are added.
    counts : StanfordCounts
        Of the same epochs.
    alert_limit_m : float
        The axes end at twice this.
    """
    axes = single_axes(ax, _SIDE_IN + 1.0, _SIDE_IN)
    limit, end = alert_limit_m, 2 * alert_limit_m
    _draw_regions(axes, limit)
    found = np.asarray(bins, dtype=np.int64).reshape(-1, 3)
    held = np.zeros((BINS, BINS))
    np.add.at(held, (found[:, 1], found[:, 0]), found[:, 2])
    edges = np.linspace(0.0, end, BINS + 1)
    if held.any():
        shown = np.ma.masked_equal(held, 0)
        norm = LogNorm(1, max(float(held.max()), 10.0))
        mesh = axes.pcolormesh(edges, edges, shown, norm=norm, cmap="viridis_r", zorder=3)
        beside = axes.inset_axes((1.03, 0.0, 0.035, 1.0))
        bar = figure_of(axes).colorbar(mesh, cax=beside, format="{x:g}")
        bar.set_label("epochs")
    axes.plot([0, end], [0, end], color=BLACK, linewidth=1.0, zorder=4)
    dashed = Look(color=GREY, linewidth=1.0, linestyle=(0, (5, 3)), zorder=4)
    axes.axhline(limit, **dashed)
    axes.plot([limit, limit], [0, limit], **dashed)
    total = max(counts.epochs, 1)
    for name, (x, y) in {
        "available": (0.17, 0.40),
        "misleading": (0.345, 0.13),
        "hazardous": (0.75, 0.13),
        "unavailable": (0.25, 0.86),
        "unavailable_misleading": (0.80, 0.60),
    }.items():
        share = getattr(counts, name) / total
        text = f"{name.replace('_', chr(10))}\n{_percent(share)}"
        label = axes.text(x * end, y * end, text, ha="center", va="center", zorder=5)
        label.set(fontsize=9, path_effects=HALO)
    axes.set(xlim=(0, end), ylim=(0, end), aspect="equal")
    axes.set(xlabel=f"error / m (all above {end:g} m in the last bins)")
    axes.set(ylabel=f"protection level / m (alert limit {limit:g} m)")
    axes.set_title(title or f"{grouped(counts.epochs)} epochs")
    return axes


def _draw_regions(axes: Axes, limit: float) -> None:
    end = 2 * limit
    for name, corners in {
        "available": [(0, 0), (limit, limit), (0, limit)],
        "misleading": [(0, 0), (limit, 0), (limit, limit)],
        "hazardous": [(limit, 0), (end, 0), (end, limit), (limit, limit)],
        "unavailable": [(0, limit), (limit, limit), (end, end), (0, end)],
        "unavailable_misleading": [(limit, limit), (end, limit), (end, end)],
    }.items():
        axes.add_patch(Polygon(corners, facecolor=_FILLS[name], edgecolor="none", zorder=1))


def _percent(share: float) -> str:
    """Return a share in per cent; a small one is not rounded to nothing."""
    if share == 0 or share >= 0.0995:
        return f"{100 * share:.0f} %"
    return f"{100 * share:.2g} %" if share >= 1e-4 else f"{100 * share:.1g} %"


@styled
def plot_coverage(
    cases: Mapping[str, Sequence[tuple[float, float, float]]],
    shares: Sequence[int],
    ax: Axes | None = None,
    *,
    title: str = "",
) -> Axes:
    """Draw how often radii held the truth, with intervals, against what they should hold.

    Parameters
    ----------
    cases : mapping of str to sequence of (covered, low, high)
        For each case one triple for each share; NaN is not drawn.
    shares : sequence of int
        Per cent that the radii should hold, such as 50, 67, 95 and 99.
    """
    axes = single_axes(ax, 8.0, 1.6 + 0.34 * len(cases))
    colours = (GREY, ORANGE, BLUE, VERMILLION)
    places = np.arange(len(cases))[::-1]
    for place in places[::2]:
        axes.axhspan(place - 0.5, place + 0.5, color="#f6f6f6", linewidth=0, zorder=0)
    for which, (share, colour) in enumerate(zip(shares, colours, strict=False)):
        axes.axvline(share, color=colour, linewidth=1.0, linestyle=(0, (4, 3)), zorder=1)
        found = 100 * np.array([triples[which] for triples in cases.values()], dtype=np.float64)
        offset = 0.22 - 0.15 * which
        middle, low, high = found.T
        spread = np.abs(np.stack([middle - low, high - middle]))
        look = Look(fmt="o", color=colour, markersize=4.5, linewidth=1.4, capsize=2.0, zorder=3)
        axes.errorbar(middle, places + offset, xerr=spread, label=f"{share} % radius", **look)
    axes.set_yticks(places, list(cases))
    axes.set(xlim=(0, 101.5), ylim=(-0.6, len(cases) - 0.4))
    axes.set_xlabel("claimed epochs whose radius held the truth / %")
    axes.set_title(title)
    tidy(axes, grid=False)
    legend(axes, ax, 4)
    return axes


@styled
def plot_worst_run(
    estimate: TrackEstimate,
    truth: Truth,
    base: BaseMap,
    epochs: tuple[int, int, int],
    alert_limit_m: float,
    *,
    title: str,
    reason: str,
) -> Figure:
    """Draw a run on the map and its errors against radii and levels; mark its worst epoch.

    Parameters
    ----------
    base : BaseMap
        Streets of the area.
    epochs : tuple of int
        The worst epoch, and the first and last epoch of the stretch around it.
    title, reason : str
        What went wrong, in a few words and in sentences.
    """
    worst, first, last = epochs
    figure = new_figure(*_RUN_IN)
    left, right = figure.subplots(1, 2, width_ratios=[1.0, 1.15])
    near = truth if _reachable(truth, base) else None
    shown = _about(estimate, near, base, first, last)
    place = " " if near is not None else "the truth is outside the map"
    plot_track(estimate, near, shown, left, title=place, zoom=False)
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3, frameon=False)
    _mark_worst(left, local_frame(shown), estimate, near, worst)
    distance_m = distance_along_m(estimate, truth)
    errors_m = position_errors_m(estimate, truth)
    shade_statuses(right, estimate, distance_m)
    right.axhline(alert_limit_m, color=GREY, linewidth=1.0, linestyle=(0, (5, 3)))
    levels_m = np.where(np.isfinite(estimate.protection_m), estimate.protection_m, np.nan)
    for values, colour, name in (
        (levels_m, VERMILLION, "protection level"),
        (estimate.radii_m[:, 2], ORANGE, "95 % radius"),
        (errors_m, BLUE, "error"),
    ):
        if np.isfinite(values).any():
            drawn = broken_at_pauses(estimate, distance_m, np.clip(values, _LEAST_M, None))
            right.plot(*drawn, color=colour, label=name)
    if np.isfinite(errors_m[worst]):
        star = Look(color=BLACK, markersize=11, linestyle="", zorder=6)
        right.plot(distance_m[worst], max(errors_m[worst], _LEAST_M), "*", label="worst", **star)
    right.set(yscale="log", xlabel="distance travelled / m", ylabel="m")
    most_m = np.nanmax([*errors_m, *levels_m, 2 * SUCCESS_RADIUS_M])
    right.set_ylim(_LEAST_M, min(1.5 * most_m, max(_MOST_M, 1.2 * np.nanmax([*errors_m, 1.0]))))
    if last > first:
        ends = truth.distance_at(estimate.time_s[[first, last]])
        name = f"claims > {SUCCESS_RADIUS_M:.0f} m off"
        right.hlines(1.15 * _LEAST_M, *ends, color=BLACK, linewidth=4.0, label=name)
    right.set_xlim(0.0, max(float(truth.distance_at(truth.time_s[-1])), 1.0))
    right.yaxis.set_major_formatter("{x:g}")
    tidy(right, grid=False)
    figure.suptitle(title, fontweight="bold")
    right.set_title(f"alert limit {alert_limit_m:g} m (dashed)", fontsize=9, color=GREY)
    right.legend(loc="upper center", bbox_to_anchor=(0.45, -0.1), ncols=4, frameon=False)
    # No line ends between a number and its unit.
    whole = _UNIT.sub("\\1\N{NO-BREAK SPACE}\\2", reason)
    figure.supxlabel(fill(whole, _WRAP), fontsize=10, x=0.01, ha="left")
    return figure


def _reachable(truth: Truth, base: BaseMap) -> bool:
    """Return whether a truth lies near the map; the log may be of another city."""
    west, south, east, north = base.bounds_m
    reach = max(east - west, north - south)
    middle_east, middle_north = (west + east) / 2, (south + north) / 2
    away = np.hypot(truth.east_m - middle_east, truth.north_m - middle_north)
    return bool(np.max(away) < 3 * reach)


def _about(
    estimate: TrackEstimate, truth: Truth | None, base: BaseMap, first: int, last: int
) -> BaseMap:
    """Return the map about a stretch, and a minute before and after it."""
    time_s = estimate.time_s
    from_s, to_s = time_s[first] - _AROUND_S, time_s[last] + _AROUND_S
    at = (time_s >= from_s) & (time_s <= to_s)
    parts = [np.column_stack([estimate.east_m, estimate.north_m])[at]]
    if truth is not None:
        parts.append(np.column_stack(truth.at(time_s[at])))
    places = np.concatenate(parts)
    places = places[np.isfinite(places).all(axis=1)]
    if not len(places):
        return base
    low, high = places.min(axis=0), places.max(axis=0)
    half = max(0.5 * float((high - low).max()), _LEAST_HALF_M) * 1.15
    (west, south), (east, north) = (low + high) / 2 - half, (low + high) / 2 + half
    return base.zoomed((float(west), float(south), float(east), float(north)))


def _mark_worst(
    axes: Axes, frame: LocalFrame, estimate: TrackEstimate, truth: Truth | None, worst: int
) -> None:
    """Mark the worst epoch: its 95 % radius, its protection level, and the truth then."""
    east_m, north_m = estimate.east_m[[worst]], estimate.north_m[[worst]]
    if not np.isfinite(east_m).all():
        return
    (x,), (y,) = frame(east_m, north_m)
    for radius_m, colour in (
        (estimate.radii_m[worst, 2], ORANGE),
        (estimate.protection_m[worst], VERMILLION),
    ):
        if np.isfinite(radius_m):
            rim = Look(fill=False, edgecolor=colour, linewidth=1.8, zorder=12)
            axes.add_patch(Circle((x, y), radius_m / frame.unit_m, **rim))
    axes.plot([x], [y], "*", color=BLACK, markersize=11, zorder=13)
    if truth is not None:
        (true_x,), (true_y,) = frame(*truth.at(estimate.time_s[[worst]]))
        axes.plot([x, true_x], [y, true_y], color=BLACK, linewidth=1.2, zorder=12)
