"""A belief of probabilities, from everywhere to one place."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D

from mapfilter._types import Floats
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M, Truth
from mapfilter.filters.contract import Status
from mapfilter.positioning.estimate import Snapshot
from mapfilter.report.basemap import BaseMap, LocalFrame
from mapfilter.report.canvas import BLUE, grouped
from mapfilter.report.panels import plot_panels

_SIDE_M, _MOST_SQUARES = 10.0, 200
_DECADES, _FAINTEST = 2.0, 0.12


def plot_belief(
    snapshots: Sequence[Snapshot], truth: Truth | None, base: BaseMap, path: Path
) -> None:
    """Draw where a filter believes to be at up to six moments, one panel each.

    A square of 10 m (or of half a percent of a larger area) fades with its probability, down to a
    hundredth of the likeliest square's; squares with less than a thousandth are not drawn.

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
    west, south, east, north = base.bounds_m
    side_m = max(_SIDE_M, max(east - west, north - south) / _MOST_SQUARES)

    def draw(axes: Axes, frame: LocalFrame, snapshot: Snapshot) -> None:
        _draw(axes, frame, snapshot, side_m)

    plot_panels(snapshots, truth, base, path, draw=draw, said=_said, marks=_marks())


def fading(share: Floats) -> Floats:
    """Return how opaque a square is drawn that has a share of the likeliest square's probability.

    Examples
    --------
    >>> fading(np.array([1.0, 0.1, 0.01, 0.001, 0.0005])).round(2).tolist()
    [1.0, 0.5, 0.12, 0.12, 0.0]
    """
    with np.errstate(divide="ignore"):
        decades = np.log10(share)
    opaque = np.clip(1.0 + decades / _DECADES, _FAINTEST, 1.0)
    return np.where(share >= 1e-3, opaque, 0.0)


def _draw(axes: Axes, frame: LocalFrame, snapshot: Snapshot, side_m: float) -> None:
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
    ends_m = np.transpose([low, low + mass.shape[1::-1]]) * side_m
    x, y = frame(*ends_m)
    extent = (float(x[0]), float(x[1]), float(y[0]), float(y[1]))
    limits = axes.get_xlim(), axes.get_ylim()
    axes.imshow(pixels, extent=extent, origin="lower", interpolation="nearest", zorder=4)
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])


def _said(snapshot: Snapshot) -> str:
    off_m = np.hypot(
        snapshot.hypothesis_east_m - snapshot.east_m, snapshot.hypothesis_north_m - snapshot.north_m
    )
    share = float(snapshot.weight[off_m <= SUCCESS_RADIUS_M].sum())
    shown = "> 99.9" if share > 0.999 else f"{100 * share:.{1 if share > 0.99 else 0}f}"
    words = f"{shown} % within {SUCCESS_RADIUS_M:.0f} m"
    return f"{words}: converged" if snapshot.status is Status.CONVERGED else words


def _marks() -> list[Line2D]:
    shares = {"likeliest": 1.0, "a tenth of it": 0.1, "a hundredth": 0.01}
    return [
        Line2D(
            [], [], linestyle="", marker="s", markersize=7, markeredgewidth=0, color=BLUE,
            alpha=float(fading(np.array(share))), label=name,
        )
        for name, share in shares.items()
    ]  # fmt: skip


_FAINTEST_CANDIDATE = 0.15


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
    plot_panels(snapshots, truth, base, path, draw=_draw_candidates, said=_left, marks=[dot])


def _left(snapshot: Snapshot) -> str:
    left = snapshot.hypothesis_east_m.size
    return f"{grouped(left)} {'candidate' if left == 1 else 'candidates'}"


def _draw_candidates(axes: Axes, frame: LocalFrame, snapshot: Snapshot) -> None:
    count = snapshot.hypothesis_east_m.size
    if count:
        x, y = frame(snapshot.hypothesis_east_m, snapshot.hypothesis_north_m)
        colours = np.empty((count, 4))
        colours[:, :3] = to_rgb(BLUE)
        share = snapshot.weight / snapshot.weight.max()
        colours[:, 3] = _FAINTEST_CANDIDATE + (1 - _FAINTEST_CANDIDATE) * np.clip(share, 0.0, 1.0)
        # Few are drawn large, thousands small enough to show the streets they lie on.
        size = float(np.clip(90.0 / sqrt(count), 2.0, 36.0))
        axes.scatter(x, y, s=size, c=colours, linewidths=0, zorder=4)
