"""Candidates thinning out, as in Fig. 1 of Khalaf-Allah (2007)."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D

from mapfilter.evaluation.accuracy import Truth
from mapfilter.positioning.snapshot import Snapshot
from mapfilter.report.basemap import BaseMap, LocalFrame
from mapfilter.report.canvas import BLUE, grouped
from mapfilter.report.panels import plot_panels

_FAINTEST = 0.15


def plot_candidates(
    snapshots: Sequence[Snapshot], truth: Truth | None, base: BaseMap, path: Path
) -> None:
    """Draw the hypotheses at up to six moments, one panel each, with truth and estimate.

    Every panel says how many hypotheses are left; a hypothesis fades with its share of the belief.

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
    dot = Line2D([], [], linestyle="", marker="o", markersize=5, color=BLUE, label="candidates")
    plot_panels(snapshots, truth, base, path, draw=_draw, said=_left, marks=[dot])


def _left(snapshot: Snapshot) -> str:
    left = snapshot.hypothesis_east_m.size
    return f"{grouped(left)} {'candidate' if left == 1 else 'candidates'}"


def _draw(axes: Axes, frame: LocalFrame, snapshot: Snapshot) -> None:
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
