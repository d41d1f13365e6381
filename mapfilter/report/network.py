"""Sites, sector azimuths and indoor cells as marks on a map."""

from __future__ import annotations

from itertools import pairwise
from math import cos, hypot, sin
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, to_hex
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from mapfilter._types import Ints
from mapfilter.errors import InputError
from mapfilter.geodesy import Lattice, grid_convergence_rad, heading_from_azimuth_rad, unproject
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.report.basemap import HALO, BaseMap, Bounds, LocalFrame, attribute, draw_base
from mapfilter.report.canvas import BLACK, GREY
from mapfilter.report.layers import (
    OVER_RASTER,
    keep_extent,
    map_picture,
    raster_extent,
    shape_faults,
    side_legend,
)

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


STEPS_DB = (0.0, 1.0, 3.0, 6.0, 10.0, 15.0, 20.0)
"""Where the classes of the picture begin; the last has no end."""

_SIDE_IN = 3.4
_ONE_CELL = "#fff7bc"


def plot_margin(
    margin_db: NDArray[np.floating],
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    path: Path,
    *,
    title: str = "Margin of the best server over the second",
) -> None:
    """Draw the margin in classes, dark where two cells are nearly equal, with each one's share.

    Parameters
    ----------
    margin_db : (rows, cols) array
        Best level above the second best, >= 0; infinite where one cell is heard alone, NaN where
        none is or where it is not to be drawn, such as beside the ways.
    lattice : Lattice
        Where the pixels lie.
    plan : CellPlan
        Sites, sector azimuths and indoor cells to mark; those outside the extent are left out.
    base : BaseMap
        The map below.
    path : Path
        PNG to write.
    title : str
        Above the map.

    Raises
    ------
    InputError
        The raster does not fit the lattice, or a margin is negative.
    OutputError
        The picture cannot be written.
    """
    faults = shape_faults(margin_db, lattice)
    known = ~np.isnan(margin_db)
    if known.any() and float(margin_db[known].min()) < 0:
        faults.add("margin", "dB >= 0", float(margin_db[known].min()))
    faults.raise_if_any(InputError)
    counts = np.bincount(_classes(margin_db[known]), minlength=len(STEPS_DB) + 1)
    ramp = matplotlib.colormaps["cividis"](np.linspace(0.0, 0.93, len(STEPS_DB)))
    colours = [*(to_hex(colour) for colour in ramp), _ONE_CELL]
    shown = np.ma.masked_array(np.zeros(margin_db.shape, dtype=np.int64), ~known)
    shown[known] = _classes(margin_db[known])
    with map_picture(path, base, _SIDE_IN) as (figure, axes):
        frame = draw_base(axes, base, streets=OVER_RASTER)
        axes.imshow(
            shown, extent=raster_extent(lattice, base, frame.unit_m), cmap=ListedColormap(colours),
            norm=BoundaryNorm(np.arange(-0.5, len(colours)), len(colours)),
            interpolation="nearest", zorder=2,
        )  # fmt: skip
        keep_extent(axes, base, frame.unit_m)
        draw_cells(axes, frame, plan, base.bounds_m)
        axes.set_title(title)
        attribute(axes, base)
        handles = [
            Line2D(
                [], [], linestyle="", marker="s", markersize=8, color=colour,
                markeredgecolor=GREY, markeredgewidth=0.4, label=f"{name}: {share:.1f} %",
            )
            for name, colour, share in zip(
                _names(), colours, 100 * counts / max(int(counts.sum()), 1), strict=True
            )
        ]  # fmt: skip
        side_legend(
            figure, "margin: share of pixels", handles, counts.tolist(), network_legend(plan)
        )


def _classes(margin_db: NDArray[np.floating]) -> Ints:
    """Return the class of each margin; the last is that of one cell alone."""
    found = np.searchsorted(np.array(STEPS_DB), margin_db, side="right") - 1
    return np.where(np.isinf(margin_db), len(STEPS_DB), found)


def _names() -> list[str]:
    between = [f"{low:g} to {high:g} dB" for low, high in pairwise(STEPS_DB)]
    return [*between, f"{STEPS_DB[-1]:g} dB and more", "one cell alone"]
