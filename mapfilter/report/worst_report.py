"""Picture of the worst of many single reports."""

from __future__ import annotations

from textwrap import fill

import numpy as np
from matplotlib.figure import Figure

from mapfilter._types import Floats
from mapfilter.report.canvas import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    draw_shares,
    new_figure,
    styled,
    tidy,
)

_SIZE_IN = (13.0, 6.4)
_WRAP = 150
_AROUND = 1.2


@styled
def plot_worst_report(
    truth_m: Floats,
    place_m: Floats,
    radius_m: float,
    map_m: Floats,
    places_m: Floats,
    errors_m: Floats,
    *,
    title: str,
    reason: str,
) -> Figure:
    """Draw where the worst report was and where it was located, and the errors of all reports.

    Parameters
    ----------
    truth_m, place_m : (2,) array
        East and north of its true and of its estimated position, m; NaN without an estimate.
    radius_m : float
        That should hold 95 %; NaN for none.
    map_m : (M, 2) array
        Places of the database's reports.
    places_m : (N, 2) array
        True places of all reports.
    errors_m : (N,) array
        Their errors, m.
    """
    figure = new_figure(*_SIZE_IN)
    left, right = figure.subplots(1, 2, width_ratios=[1.2, 1.0])
    everything = np.vstack([part for part in (map_m, places_m, truth_m[None]) if len(part)])
    west, south = np.nanmin(everything, axis=0)

    def local(points: Floats) -> Floats:
        return np.asarray(np.atleast_2d(points) - [west, south])

    if len(map_m):
        left.plot(*local(map_m).T, ".", color="#d9d9d9", markersize=3, label="database")
    if len(places_m):
        worst_m = float(np.max(errors_m)) if len(errors_m) else 1.0
        sizes = 4 + 60 * errors_m / max(worst_m, 1.0)
        left.scatter(
            *local(places_m).T,
            s=sizes,
            color=BLUE,
            alpha=0.35,
            linewidth=0,
            label="reports by error",
        )
    here = local(truth_m)[0]
    left.plot(*here, "o", color=BLACK, markersize=9, fillstyle="none", label="worst: true place")
    if np.isfinite(place_m).all():
        there = local(place_m)[0]
        left.plot(*np.stack([here, there]).T, color=BLACK, linewidth=1.2)
        left.plot(*there, "*", color=BLACK, markersize=13, label="worst: estimate")
        if np.isfinite(radius_m):
            angle = np.linspace(0.0, 2 * np.pi, 181)
            ring = there[:, None] + radius_m * np.stack([np.cos(angle), np.sin(angle)])
            left.plot(*ring, color=ORANGE, label="95 % radius")
    left.set(xlabel="east of local origin / m", ylabel="north of local origin / m")
    left.set_aspect("equal", adjustable="datalim")
    tidy(left)
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3, frameon=False)
    if len(errors_m):
        draw_shares(right, errors_m, color=BLUE)
        right.axvline(float(np.median(errors_m)), color=GREY, linewidth=1.0, linestyle=(0, (5, 3)))
        right.set_title(f"median {np.median(errors_m):.1f} m (dashed)", fontsize=9, color=GREY)
        right.set_xlim(0.0, _AROUND * float(np.max(errors_m)) + 1.0)
    right.set(xlabel="error / m", ylabel="reports / %")
    tidy(right)
    figure.suptitle(title, fontweight="bold")
    figure.supxlabel(fill(reason, _WRAP), fontsize=10, x=0.01, ha="left")
    return figure
