"""Error against the distance travelled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from mapfilter._types import Floats
from mapfilter.evaluation.accuracy import (
    SUCCESS_RADIUS_M,
    Accuracy,
    Truth,
    accuracy,
    position_errors_m,
)
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
    bottom_legend,
    distinct_colours,
    picture,
)

_SIZE_IN = (9.0, 4.8)
_SEARCHING = "#eeeeee"
_LOST = "#f7d9c9"
_WIDE, _LEAST_M = 12.0, 0.3


def plot_error_over_distance(
    estimate: TrackEstimate, truth: Truth, path: Path, *, title: str = ""
) -> None:
    """Draw the position error over the metres really travelled.

    The error's axis is logarithmic where hundreds of metres become few; the filter's own radii are
    a band. Marks the switch from searching to tracking, the 50 m that count as success there, the
    mean and the 67 and 95 % errors after it, and where the filter was searching or lost.

    Parameters
    ----------
    estimate : TrackEstimate
        Epochs without a position leave a gap.
    truth : Truth
        The true path, at least one row.
    path : Path
        PNG to write.
    title : str
        Above the picture; without one, the filter's name.

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    distance_m = truth.distance_at(estimate.time_s)
    errors_m = position_errors_m(estimate, truth)
    length_m = max(float(truth.distance_at(truth.time_s[-1])), 1.0)
    known_m = errors_m[np.isfinite(errors_m)]
    score = accuracy(estimate, truth)
    most_m = max(float(known_m.max(initial=0.0)), 1.1 * SUCCESS_RADIUS_M)
    # Hundreds of metres while searching would press what follows flat.
    wide = score.switched and most_m > _WIDE * score.error_95_m
    with picture(path, *_SIZE_IN) as figure:
        axes = figure.subplots()
        axes.set_xlim(0.0, length_m)
        if wide:
            axes.set_yscale("log")
            axes.set_ylim(_LEAST_M, 2 * most_m)
            axes.yaxis.set_major_formatter("{x:g}")
        else:
            axes.set_ylim(0.0, 1.15 * most_m)
        shade_searching_and_lost(axes, estimate, distance_m)
        axes.axhline(
            SUCCESS_RADIUS_M, color=VERMILLION, linewidth=1.2, linestyle=(0, (5, 3)),
            label=f"{SUCCESS_RADIUS_M:.0f} m",
        )  # fmt: skip
        told_m = estimate.radii_m.T
        if np.isfinite(told_m[2]).any():
            for radius_m in told_m:
                axes.fill_between(distance_m, radius_m, color=ORANGE, alpha=0.16, linewidth=0)
            axes.plot(
                distance_m, told_m[2], color=ORANGE, linewidth=1.1,
                label="50, 67, 95 % radius by the filter",
            )  # fmt: skip
        axes.plot(distance_m, errors_m, color=BLUE, linewidth=1.5, label="error")
        if score.switched:
            _draw_score(axes, score, length_m)
        else:
            axes.text(
                0.5, 0.55, "never switched to tracking", transform=axes.transAxes, ha="center",
                color=GREY, fontsize=12, path_effects=list(HALO),
            )  # fmt: skip
        axes.set_xlabel("distance travelled / m")
        axes.set_ylabel("position error / m")
        axes.set_title(title or f"Filter: {estimate.filter}")
        axes.spines[["top", "right"]].set_visible(False)
        figure.legend(loc="outside lower center", ncols=4, frameon=False)


def shade_searching_and_lost(
    axes: Axes, estimate: TrackEstimate, along: Floats, *, named: bool = True
) -> None:
    """Shade the stretches of a track during which the filter was searching or lost.

    Parameters
    ----------
    axes : Axes
    estimate : TrackEstimate
    along : (N,) array
        Where each epoch is on the level axis.
    named : bool
        Whether the legend names them.
    """
    for status, colour in ((Status.SEARCHING, _SEARCHING), (Status.LOST, _LOST)):
        name = status.lower() if named else None
        _shade(axes, estimate, along, status, colour, name)


def _draw_score(axes: Axes, score: Accuracy, length_m: float) -> None:
    """Draw the switch, and mean and percentiles from there on."""
    at_m = score.switch_distance_m
    axes.plot(
        [at_m], [score.error_at_switch_m], linestyle="", marker="*", markersize=15,
        color=VERMILLION, markeredgecolor="white", zorder=6, clip_on=False,
        label=f"switch: {score.error_at_switch_m:.0f} m off after {at_m:.0f} m",
    )  # fmt: skip
    figures = (
        ("mean", score.error_mean_m, "-", BLACK),
        ("67 %", score.error_67_m, (0, (6, 2)), GREEN),
        ("95 %", score.error_95_m, (0, (1.5, 1.5)), GREY),
    )
    for name, error_m, dashes, colour in figures:
        if np.isfinite(error_m):
            axes.plot(
                [at_m, length_m], [error_m, error_m], color=colour, linewidth=1.4,
                linestyle=dashes, zorder=5, label=f"{name} after it: {error_m:.1f} m",
            )  # fmt: skip


def _shade(
    axes: Axes,
    estimate: TrackEstimate,
    along: Floats,
    status: Status,
    colour: str,
    name: str | None,
) -> None:
    """Shade the stretches during which the filter had a status."""
    has = np.array([s is status for s in estimate.status], dtype=bool)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], has, [False]]).astype(np.int8)))
    for index, (first, end) in enumerate(zip(edges[::2], edges[1::2], strict=True)):
        last = min(int(end), along.size - 1)
        axes.axvspan(
            float(along[first]), float(along[last]), color=colour, linewidth=0,
            zorder=0, label=name if index == 0 else None,
        )  # fmt: skip


_CURVES_SIZE_IN = (6.4, 4.6)
_CURVES_LEAST_M, _MOST_M = 1.0, 1000.0


def plot_error_curves(errors_m: Mapping[str, Sequence[float]], path: Path, *, title: str) -> None:
    """Draw the cumulative distribution of each method's errors.

    Parameters
    ----------
    errors_m : mapping of str to sequence of float
        By method; those without any are left out.
    path : Path
        PNG to write.
    title : str

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    known = {name: np.sort(np.asarray(values)) for name, values in errors_m.items() if values}
    with picture(path, *_CURVES_SIZE_IN) as figure:
        axes = figure.subplots()
        for (name, values), colour in zip(known.items(), distinct_colours(len(known)), strict=True):
            share = 100 * np.arange(1, values.size + 1) / values.size
            label = f"{name}: median {np.median(values):.0f} m"
            axes.step(
                np.maximum(values, _CURVES_LEAST_M), share, where="post", color=colour, label=label
            )
        axes.set_xscale("log")
        axes.set_xlim(_CURVES_LEAST_M, _MOST_M)
        axes.set_ylim(0, 101)
        axes.set_xlabel("error / m")
        axes.set_ylabel("share of the scored fixes / %")
        axes.grid(color="#e8e8e8", linewidth=0.7)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
        axes.set_title(title)
        if known:
            bottom_legend(figure, 2)


_TIME_SIZE_IN = (9.0, 4.8)
_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, VERMILLION, GREY)
_SHADES = ("#eeeeee", "#f7d9c9", "#dce9f5")
_TIME_LEAST_M = 0.3


def plot_errors_over_time(
    estimates: Mapping[str, TrackEstimate],
    truth: Truth,
    path: Path,
    *,
    spans: Sequence[tuple[str, float, float]] = (),
    title: str = "",
) -> None:
    """Draw the position errors of several estimates, on a logarithmic axis.

    Parameters
    ----------
    estimates : mapping of str to TrackEstimate
        By what the legend calls them; up to six.
    truth : Truth
    path : Path
        PNG to write.
    spans : sequence of (str, float, float)
        Stretches of time to shade: what they are called, begin and end in seconds.
    title : str

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    with picture(path, *_TIME_SIZE_IN) as figure:
        axes = figure.subplots()
        for (name, begin_s, end_s), shade in zip(spans, _SHADES, strict=False):
            axes.axvspan(begin_s, end_s, color=shade, linewidth=0, zorder=0, label=name)
        for (name, estimate), colour in zip(estimates.items(), _COLOURS, strict=False):
            axes.plot(
                estimate.time_s, position_errors_m(estimate, truth).clip(_TIME_LEAST_M),
                color=colour, linewidth=1.4, label=name,
            )  # fmt: skip
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.set_ylim(bottom=_TIME_LEAST_M)
        axes.set_xlim(float(truth.time_s[0]), float(truth.time_s[-1]))
        axes.set_xlabel("time / s")
        axes.set_ylabel("position error / m")
        axes.set_title(title)
        axes.spines[["top", "right"]].set_visible(False)
        figure.legend(loc="outside lower center", ncols=3, frameon=False)
