"""A belief at up to six moments, one map each, with truth and estimate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from mapfilter.errors import InputError, fail
from mapfilter.evaluation.accuracy import Truth
from mapfilter.positioning.estimate import Snapshot
from mapfilter.report.basemap import BaseMap, LocalFrame, attribute, draw_base, map_height_in
from mapfilter.report.canvas import BLACK, STREET, VERMILLION, bottom_legend, picture

MAX_PANELS = 6

_PANEL_IN = 4.0

Draw = Callable[[Axes, LocalFrame, Snapshot], None]
"""Draws the hypotheses of one moment."""


def plot_panels(
    snapshots: Sequence[Snapshot],
    truth: Truth | None,
    base: BaseMap,
    path: Path,
    *,
    draw: Draw,
    said: Callable[[Snapshot], str],
    marks: Sequence[Line2D],
) -> None:
    """Draw one map for each moment.

    Every panel shows the whole area and says how far the journey has gone, in true metres where the
    truth is known.

    Parameters
    ----------
    snapshots : sequence of Snapshot
        One to six, in the order of the panels.
    truth : Truth or None
        The true path, where known.
    base : BaseMap
        The map below.
    path : Path
        PNG to write.
    draw : callable
        Draws a moment's hypotheses.
    said : callable
        Says in a few words, for the title, what the hypotheses say.
    marks : sequence of Line2D
        What the hypotheses' marks mean, for the legend.

    Raises
    ------
    InputError
        There is no snapshot, or more than six.
    OutputError
        The picture cannot be written.
    """
    count = len(snapshots)
    if not 1 <= count <= MAX_PANELS:
        raise fail(InputError, "snapshots", f"1 to {MAX_PANELS}", count)
    columns = count if count <= 3 else ceil(count / 2)
    rows = ceil(count / columns)
    height_in = rows * (map_height_in(base, _PANEL_IN) + 0.45) + 0.9
    with picture(path, columns * (_PANEL_IN + 0.1) + 0.6, height_in) as figure:
        panels = figure.subplots(rows, columns, squeeze=False)
        for index, axes in enumerate(panels.flat):
            if index >= count:
                axes.set_visible(False)
                continue
            snapshot = snapshots[index]
            frame = draw_base(axes, base, scale_bar=index == 0)
            draw(axes, frame, snapshot)
            _draw_path(axes, frame, snapshot, truth)
            title = f"({'abcdef'[index]}) {_gone(snapshot, truth)}, {said(snapshot)}"
            axes.set_title(title, fontsize=10.5)
            if index % columns:
                axes.set_ylabel("")
                axes.set_yticklabels([])
            if index + columns < count:
                axes.set_xlabel("")
                axes.set_xticklabels([])
        attribute(panels[(count - 1) // columns, (count - 1) % columns], base)
        handles = _legend(
            marks,
            with_truth=truth is not None,
            with_estimate=any(np.isfinite(s.east_m) for s in snapshots),
        )
        bottom_legend(figure, len(handles), handles)


def _gone(snapshot: Snapshot, truth: Truth | None) -> str:
    if truth is not None and truth.time_s.size:
        return f"{float(truth.distance_at(snapshot.time_s)):.0f} m travelled"
    return f"{snapshot.travelled_m:.0f} m by dead reckoning"


def _draw_path(axes: Axes, frame: LocalFrame, snapshot: Snapshot, truth: Truth | None) -> None:
    if truth is not None and truth.time_s.size:
        past = truth.time_s <= snapshot.time_s
        x, y = frame(truth.east_m[past], truth.north_m[past])
        axes.plot(x, y, color=BLACK, linewidth=1.3, zorder=5)
        x, y = frame(*truth.at(snapshot.time_s))
        axes.scatter(
            x, y, s=52, marker="D", facecolors="none", edgecolors=BLACK, linewidths=1.6, zorder=7
        )
    if np.isfinite(snapshot.east_m) and np.isfinite(snapshot.north_m):
        x, y = frame(np.array([snapshot.east_m]), np.array([snapshot.north_m]))
        axes.scatter(
            x, y, s=150, marker="*", color=VERMILLION, edgecolors="white", linewidths=0.7, zorder=8
        )


def _legend(marks: Sequence[Line2D], *, with_truth: bool, with_estimate: bool) -> list[Line2D]:
    """Return what the marks of the panels mean."""
    handles = [
        Line2D([], [], color=STREET, linewidth=2, label="where one can be"),
        *marks,
    ]
    if with_truth:
        handles += [
            Line2D([], [], color=BLACK, linewidth=1.3, label="true path so far"),
            Line2D(
                [], [], linestyle="", marker="D", markersize=7, markerfacecolor="none",
                markeredgecolor=BLACK, markeredgewidth=1.6, label="true position",
            ),
        ]  # fmt: skip
    if with_estimate:
        handles.append(
            Line2D(
                [], [], linestyle="", marker="*", markersize=13, color=VERMILLION,
                markeredgecolor="white", label="estimate",
            )
        )  # fmt: skip
    return handles
