"""What journeys propose to change in a database, on a map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from mapfilter._types import Floats
from mapfilter.learning.patch import Change
from mapfilter.radio.cells import CellPlan
from mapfilter.report.basemap import HALO, BaseMap, attribute, draw_base, map_axes
from mapfilter.report.canvas import BLACK, styled
from mapfilter.report.network import draw_cells

_COLOURS = {
    "offset": "#0072B2",
    "dead": "#000000",
    "moved": "#CC79A7",
    "turned": "#E69F00",
    "rotated": "#D55E00",
    "swapped": "#009E73",
    "way": "#C00000",
}
_LEGEND_IN = 2.1


@styled
def plot_learned(
    changes: Sequence[Change],
    plan: CellPlan,
    base: BaseMap,
    tracks: Sequence[Floats] = (),
    ax: Axes | None = None,
) -> Axes:
    """Draw proposed changes: cells ringed and labelled, moves as arrows, new ways as lines.

    Parameters
    ----------
    changes : sequence of Change
    plan : CellPlan
        Of the database.
    base : BaseMap
    tracks : sequence of (n, 2) arrays
        Of the journeys that were used, drawn thin.
    """
    axes = map_axes(ax, base, _LEGEND_IN)
    frame = draw_base(axes, base)
    for track in tracks:
        axes.plot(*frame(track[:, 0], track[:, 1]), color="#4477AA", lw=0.4, alpha=0.35, zorder=2)
    draw_cells(axes, frame, plan, base.bounds_m)
    labels: dict[tuple[float, float], list[str]] = {}
    for change in changes:
        colour = _COLOURS[change.kind]
        if change.kind == "way":
            line = np.array(change.line_m)
            axes.plot(*frame(line[:, 0], line[:, 1]), color=colour, lw=2.2, zorder=6)
            continue
        for name in change.cells:
            cell = plan[name]
            x, y = frame(np.array([cell.east_m]), np.array([cell.north_m]))
            axes.plot(x, y, "o", ms=15, mfc="none", mec=colour, mew=1.8, zorder=7)
            if change.kind == "moved":
                there = frame(np.array([change.east_m]), np.array([change.north_m]))
                axes.annotate(
                    "",
                    (there[0][0], there[1][0]),
                    (x[0], y[0]),
                    arrowprops={"arrowstyle": "->", "color": colour, "lw": 1.8},
                    zorder=7,
                )
        cell = plan[change.cells[0]]
        place = cell.east_m, cell.north_m
        labels.setdefault(place, []).append(label_of(change))
    for (east_m, north_m), texts in labels.items():
        x, y = frame(np.array([east_m]), np.array([north_m]))
        axes.annotate(
            "\n".join(texts),
            (x[0], y[0]),
            (10, 8),
            textcoords="offset points",
            fontsize=7,
            color=BLACK,
            path_effects=HALO,
            zorder=8,
        )
    kinds = dict.fromkeys(change.kind for change in changes)
    handles = [
        Line2D([], [], color=_COLOURS["way"], lw=2.2, label="missing way")
        if kind == "way"
        else Line2D([], [], ls="", marker="o", ms=9, mfc="none", mec=_COLOURS[kind], label=kind)
        for kind in kinds
    ]
    if handles:
        axes.legend(
            handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False, fontsize=8
        )
    attribute(axes, base)
    axes.set_title("Proposed changes" if changes else "Nothing to change")
    return axes


def label_of(change: Change) -> str:
    """Return a change in a few words."""
    cells = ", ".join(change.cells)
    if change.kind == "offset":
        return f"{cells}: {change.offset_db:+.0f} dB"
    if change.kind in ("turned", "rotated"):
        return f"{cells}: turned by {change.turn_deg:.0f}°"
    return f"{cells}: {change.kind}"
