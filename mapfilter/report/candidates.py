"""Candidates thinning out, as in Fig. 1 of Khalaf-Allah (2007)."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, sqrt
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D

from mapfilter.errors import InputError, fail
from mapfilter.evaluation.accuracy import Truth
from mapfilter.positioning.snapshot import Snapshot
from mapfilter.report.basemap import BaseMap, LocalFrame, attribute, draw_base, map_height_in
from mapfilter.report.canvas import BLACK, BLUE, STREET, VERMILLION, grouped, picture

MAX_PANELS = 6

_PANEL_IN = 4.0
_FAINTEST = 0.15


def plot_candidates(
    snapshots: Sequence[Snapshot], truth: Truth | None, base: BaseMap, path: Path
) -> None:
    """Draw the hypotheses at up to six moments, one panel each, with truth and estimate.

    Every panel shows the whole area and says how far the journey has gone, in true metres where the
    truth is known, and how many hypotheses are left; a hypothesis fades with its share of the
    belief.

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
    height_in = rows * (map_height_in(base, _PANEL_IN) + 0.3) + 0.9
    with picture(path, columns * (_PANEL_IN + 0.1) + 0.6, height_in) as figure:
        panels = figure.subplots(rows, columns, squeeze=False)
        for index, axes in enumerate(panels.flat):
            if index >= count:
                axes.set_visible(False)
                continue
            frame = draw_base(axes, base, scale_bar=index == 0)
            _draw_snapshot(axes, frame, snapshots[index], truth)
            axes.set_title(_title(index, snapshots[index], truth), fontsize=10.5)
            if index % columns:
                axes.set_ylabel("")
                axes.set_yticklabels([])
            if index + columns < count:
                axes.set_xlabel("")
                axes.set_xticklabels([])
        attribute(panels[(count - 1) // columns, (count - 1) % columns], base)
        figure.legend(
            handles=_legend(
                with_truth=truth is not None,
                with_estimate=any(np.isfinite(s.east_m) for s in snapshots),
            ),
            loc="outside lower center",
            ncols=5,
            frameon=False,
            handletextpad=0.4,
        )


def _title(index: int, snapshot: Snapshot, truth: Truth | None) -> str:
    left = snapshot.hypothesis_east_m.size
    noun = "candidate" if left == 1 else "candidates"
    gone = f"{snapshot.travelled_m:.0f} m by dead reckoning"
    if truth is not None and truth.time_s.size:
        gone = f"{float(truth.distance_at(snapshot.time_s)):.0f} m travelled"
    return f"({'abcdef'[index]}) {gone}, {grouped(left)} {noun}"


def _draw_snapshot(axes: Axes, frame: LocalFrame, snapshot: Snapshot, truth: Truth | None) -> None:
    count = snapshot.hypothesis_east_m.size
    if count:
        x, y = frame(snapshot.hypothesis_east_m, snapshot.hypothesis_north_m)
        colours = np.empty((count, 4))
        colours[:, :3] = to_rgb(BLUE)
        share = snapshot.weight / snapshot.weight.max()
        colours[:, 3] = _FAINTEST + (1 - _FAINTEST) * np.clip(share, 0.0, 1.0)
        # Few are drawn large, thousands small enough to show the streets they lie on.
        size = float(np.clip(90.0 / sqrt(count), 2.0, 36.0))
        axes.scatter(x, y, s=size, c=colours, linewidths=0, zorder=4)
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


def _legend(*, with_truth: bool, with_estimate: bool) -> list[Line2D]:
    """Return what the marks of the panels mean."""
    handles = [
        Line2D([], [], color=STREET, linewidth=2, label="where one can be"),
        Line2D([], [], linestyle="", marker="o", markersize=5, color=BLUE, label="candidates"),
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
