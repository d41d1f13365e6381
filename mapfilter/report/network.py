"""Sites, sector azimuths and indoor cells as marks on a map."""

from __future__ import annotations

from math import cos, hypot, sin

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from mapfilter.geodesy import grid_convergence_rad, heading_from_azimuth_rad, unproject
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.report.basemap import HALO, Bounds, LocalFrame
from mapfilter.report.canvas import BLACK

_ARROW_SHARE = 0.06
"""Length of a sector's arrow, as a share of the extent's diagonal."""


def draw_cells(axes: Axes, frame: LocalFrame, plan: CellPlan, bounds_m: Bounds) -> None:
    """Mark every cell inside the extent: a dot and an arrow, or a square and a name if indoors.

    Azimuths count from true north, the map from grid north: arrows are turned by the grid
    convergence at their site.
    """
    west, south, east, north = bounds_m
    length_m = _ARROW_SHARE * hypot(east - west, north - south)
    for cell in plan.cells:
        if not (west <= cell.east_m <= east and south <= cell.north_m <= north):
            continue
        x, y = frame(np.array([cell.east_m]), np.array([cell.north_m]))
        if cell.indoor:
            axes.scatter(
                x, y, s=46, marker="s", color="white", edgecolors=BLACK, linewidths=1.6, zorder=11
            )
            axes.annotate(
                cell.id, (float(x[0]), float(y[0])), xytext=(7, 0), textcoords="offset points",
                va="center", fontsize=8, fontweight="bold", path_effects=list(HALO), zorder=12,
            )  # fmt: skip
            continue
        if cell.azimuth_deg is not None:
            heading_rad = _heading_rad(plan.crs, cell, cell.azimuth_deg)
            tip = (
                float(x[0]) + length_m / frame.unit_m * cos(heading_rad),
                float(y[0]) + length_m / frame.unit_m * sin(heading_rad),
            )
            arrow = axes.annotate(
                "", xy=tip, xytext=(float(x[0]), float(y[0])), zorder=10, annotation_clip=False,
                arrowprops={"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.6, "shrinkA": 0},
            )  # fmt: skip
            if arrow.arrow_patch is not None:
                arrow.arrow_patch.set_path_effects([withStroke(linewidth=3.6, foreground="white")])
        axes.scatter(x, y, s=62, color=BLACK, edgecolors="white", linewidths=1.2, zorder=11)


def network_legend(plan: CellPlan) -> list[Line2D]:
    """Return what the marks of a plan mean; only those that it has."""
    handles = []
    if any(not cell.indoor for cell in plan.cells):
        handles.append(
            Line2D([], [], linestyle="", marker="o", markersize=7, color=BLACK, label="site")
        )
    if any(not cell.indoor and cell.azimuth_deg is not None for cell in plan.cells):
        handles.append(
            Line2D(
                [], [], linestyle="", marker=(3, 0, -90), markersize=8, color=BLACK,
                label="sector azimuth",
            )
        )  # fmt: skip
    if any(cell.indoor for cell in plan.cells):
        handles.append(
            Line2D(
                [], [], linestyle="", marker="s", markersize=6, markerfacecolor="white",
                markeredgecolor=BLACK, markeredgewidth=1.6, label="indoor cell",
            )
        )  # fmt: skip
    return handles


def _heading_rad(crs: str, cell: Cell, azimuth_deg: float) -> float:
    lon_deg, lat_deg = unproject(crs, cell.east_m, cell.north_m)
    convergence_rad = grid_convergence_rad(crs, float(lon_deg), float(lat_deg))
    return float(heading_from_azimuth_rad(azimuth_deg, convergence_rad))
