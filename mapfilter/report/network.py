"""A network on the map: its cells, their points, and the best server at each pixel.

Figs. 2 and 4 of Khalaf-Allah (2007) are points by cell, of one site and of all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import cos, hypot, sin
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.transforms import offset_copy
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, find_objects

from mapfilter._types import Floats
from mapfilter.angles import heading_from_azimuth_rad
from mapfilter.errors import InputError
from mapfilter.geodesy import grid_convergence_rad, unproject
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.report.basemap import (
    HALO,
    MAP_IN,
    MAP_NAME,
    OVER_RASTER,
    BaseMap,
    Bounds,
    LocalFrame,
    attribute,
    draw_base,
    draw_raster,
    largest,
    local_frame,
    map_axes,
    shape_faults,
    short_names,
    side_legend,
)
from mapfilter.report.canvas import (
    BLACK,
    GREY,
    Look,
    distinct_colours,
    figure_of,
    grouped,
    mark,
    styled,
)

_ARROW_SHARE = 0.06
"""Length of a sector's arrow, as a share of the extent's diagonal."""

_LEGEND_IN, _MOST_NAMES = 2.7, 60
_LETTER_PT, _LINE_PT = 5.6, 11.0
"""Room that a letter of a name takes, and a line."""
_DEEP_ROWS, _DEEP_ENOUGH = 400, 0.6


def draw_cells(axes: Axes, frame: LocalFrame, plan: CellPlan, bounds_m: Bounds) -> None:
    """Mark every cell inside the extent: a dot and an arrow, or a square and a name if indoors.

    Azimuths count from true north, the map from grid north: arrows are turned by the grid
    convergence at their site.
    """
    west, south, east, north = bounds_m
    length_m = _ARROW_SHARE * hypot(east - west, north - south)
    arrow = Look(arrowstyle="-|>", color=BLACK, linewidth=1.6, shrinkA=0)
    for cell in plan.cells:
        if not (west <= cell.east_m <= east and south <= cell.north_m <= north):
            continue
        x, y = (float(at) for at in frame(np.array(cell.east_m), np.array(cell.north_m)))
        dot = Look(s=62, color=BLACK, edgecolors="white", linewidths=1.2)
        if cell.indoor:
            dot = Look(s=46, marker="s", color="white", edgecolors=BLACK, linewidths=1.6)
            name = axes.annotate(cell.id, (x, y), (7, 0), textcoords="offset points", zorder=12)
            name.set(va="center", fontsize=8, fontweight="bold", path_effects=HALO)
        elif cell.azimuth_deg is not None:
            lon_deg, lat_deg = (float(d) for d in unproject(plan.crs, cell.east_m, cell.north_m))
            convergence_rad = grid_convergence_rad(plan.crs, lon_deg, lat_deg)
            heading_rad = float(heading_from_azimuth_rad(cell.azimuth_deg, convergence_rad))
            length = length_m / frame.unit_m
            tip = x + length * cos(heading_rad), y + length * sin(heading_rad)
            drawn = axes.annotate("", tip, (x, y), arrowprops=arrow, annotation_clip=False)
            drawn.set_zorder(10)
            if drawn.arrow_patch is not None:
                drawn.arrow_patch.set_path_effects([withStroke(linewidth=3.6, foreground="white")])
        axes.scatter([x], [y], zorder=11, **dot)


def network_legend(plan: CellPlan) -> list[Line2D]:
    """Return what the marks of a plan mean; only those that it has."""
    outdoor = [cell for cell in plan.cells if not cell.indoor]
    handles = []
    if outdoor:
        handles.append(mark("site", "o", 7, color=BLACK))
    if any(cell.azimuth_deg is not None for cell in outdoor):
        handles.append(mark("sector azimuth", (3, 0, -90), 8, color=BLACK))
    if len(outdoor) < len(plan.cells):
        rim = Look(markerfacecolor="white", markeredgecolor=BLACK, markeredgewidth=1.6)
        handles.append(mark("indoor cell", "s", 6, **rim))
    return handles


@styled
def plot_points_per_cell(
    points_by_cell: Mapping[str, tuple[Floats, Floats]],
    plan: CellPlan,
    base: BaseMap,
    ax: Axes | None = None,
    *,
    title: str = "",
    counts: Sequence[int] | None = None,
    resolution_m: float = 5.0,
) -> Axes:
    """Draw the points that belong to each cell in a colour of its own.

    With the cells of one site this is Fig. 2 of the paper, with all cells Fig. 4. Groups are named
    on the map where their names do not overlap those of larger ones, and all of them, with their
    numbers of points, in the legend.

    Parameters
    ----------
    points_by_cell : mapping from cell id to (east_m, north_m)
        Points of each cell, arrays of equal length in the base map's CRS. The order is that of the
        colours. A point that several cells claim takes the colour of the last.
    counts : sequence of int, optional
        Points of each cell, where only some of them are given to be drawn.
    resolution_m : float
        Distance between neighbouring points, which sets the size of their marks.
    """
    axes = map_axes(ax, base, _LEGEND_IN)
    frame = draw_base(axes, base)
    pitch_pt = 72 * MAP_IN * resolution_m / (base.bounds_m[2] - base.bounds_m[0])
    size = float(np.clip((1.05 * pitch_pt) ** 2, 1.2, 400.0))
    if counts is None:
        counts = [len(east_m) for east_m, _ in points_by_cell.values()]
    groups = _Groups(axes, plan, list(points_by_cell), counts)
    for index, places_m in enumerate(points_by_cell.values()):
        x, y = frame(*places_m)
        axes.scatter(x, y, s=size, color=groups.colours[index], marker="s", linewidths=0, zorder=3)
        named_at = _nearest_to_median(x, y) if x.size and groups.is_named(index) else None
        groups.add(index, grouped(counts[index]), named_at)
    groups.write_names()
    finish_map(axes, base, plan, title)
    side_legend(axes, "cell: points", groups.handles, groups.counts, network_legend(plan))
    return axes


@styled
def plot_best_server(
    best_server: NDArray[np.integer],
    cell_ids: Sequence[str],
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    ax: Axes | None = None,
    *,
    title: str = "Best server",
) -> Axes:
    """Draw which cell is received best at every pixel, with each cell's share of the area.

    ``best_server`` is an index into ``cell_ids``; negative where no cell is received.
    """
    faults = shape_faults(best_server, lattice)
    if best_server.size and int(best_server.max()) >= len(cell_ids):
        faults.add("best server", f"indices below {len(cell_ids)}", int(best_server.max()))
    faults.raise_if_any(InputError)
    axes = map_axes(ax, base, _LEGEND_IN)
    frame = draw_base(axes, base, streets=OVER_RASTER)
    counts = np.bincount(best_server[best_server >= 0], minlength=len(cell_ids)).tolist()
    groups = _Groups(axes, plan, cell_ids, counts)
    shown = np.ma.masked_less(best_server, 0)
    colours, limits = ListedColormap(groups.colours or "w"), (-0.5, max(len(cell_ids), 1) - 0.5)
    draw_raster(axes, base, lattice, shown, cmap=colours, clim=limits, alpha=0.85, zorder=1)
    # Each cell is looked at in its own window, as there may be a thousand.
    labels = np.maximum(best_server, -1).astype(np.int32) + 1
    windows = find_objects(labels, max_label=len(cell_ids))
    for index, count in enumerate(counts):
        named_at, window = None, windows[index]
        if window is not None and groups.is_named(index):
            row, col = _deepest(best_server[window] == index)
            named_at = frame(*lattice.east_north(row + window[0].start, col + window[1].start))
        groups.add(index, f"{100 * count / best_server.size:.1f} %", named_at)
    groups.write_names()
    finish_map(axes, base, plan, title)
    marks = network_legend(plan)
    without = best_server.size - sum(counts)
    if without:
        share = f"no cell: {100 * without / best_server.size:.1f} %"
        marks = [mark(share, "s", 7, color="white", markeredgecolor=GREY), *marks]
    side_legend(axes, "cell: share of area", groups.handles, groups.counts, marks)
    return axes


class _Groups:
    """The colours, names and legend of the cells on a map; the legend lacks those without any."""

    def __init__(
        self, axes: Axes, plan: CellPlan, cell_ids: Sequence[str], counts: Sequence[int]
    ) -> None:
        self.colours = distinct_colours(len(cell_ids))
        self.handles: list[Line2D] = []
        self.counts = [count for count in counts if count]
        self._sizes = counts
        self._places: dict[int, tuple[float, float]] = {}
        self._axes, self._plan, self._ids = axes, plan, cell_ids
        self._names, self._named = short_names(cell_ids), largest(counts, _MOST_NAMES)

    def is_named(self, index: int) -> bool:
        """Return whether a cell is named on the map: it is large, and has no name at its mark."""
        name = self._ids[index]
        indoor = name in self._plan and self._plan[name].indoor
        return index in self._named and not indoor

    def add(self, index: int, amount: str, named_at: tuple[Any, Any] | None) -> None:
        """Add a cell to the legend, if it has any of the map, and name it at a place."""
        name, colour = self._ids[index], self.colours[index]
        if self._sizes[index]:
            self.handles.append(mark(f"{name}: {amount}", "s", 7, color=colour))
        if named_at is not None:
            self._places[index] = float(named_at[0]), float(named_at[1])

    def write_names(self) -> None:
        """Write names at their places, those of large cells first, where none is written yet.

        Near an edge a name is shifted by so much that all of it is on the map.
        """
        (left, right), (bottom, top) = self._axes.get_xlim(), self._axes.get_ylim()
        pt = (right - left) / (72 * MAP_IN)
        written: list[Bounds] = []
        for index in sorted(self._places, key=lambda index: -self._sizes[index]):
            (x, y), name = self._places[index], self._names[index]
            half_x, half_y = _LETTER_PT * pt * len(name) / 2, _LINE_PT * pt / 2
            at_x = float(np.clip(x, left + half_x, max(right - half_x, left + half_x)))
            at_y = float(np.clip(y, bottom + half_y, top - half_y))
            box = at_x - half_x, at_y - half_y, at_x + half_x, at_y + half_y
            if any(_overlap(box, other) for other in written):
                continue
            written.append(box)
            shift_pt = (at_x - x) / pt, (at_y - y) / pt
            data, figure = self._axes.transData, figure_of(self._axes)
            look = Look(fontsize=8, zorder=12, clip_on=True) | MAP_NAME
            look["transform"] = offset_copy(data, figure, *shift_pt, units="points")
            self._axes.text(x, y, name, **look)


def _overlap(a: Bounds, b: Bounds) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _deepest(own: NDArray[np.bool_]) -> tuple[Any, Any]:
    """Return row and column of the most central pixel of those that lie deep in a cell's own.

    ``own`` is the smallest window that holds all of them.
    """
    # A name needs no better place than one of some hundred rows.
    step = max(max(own.shape) // _DEEP_ROWS, 1)
    some = own[::step, ::step]
    if not some.any():
        step, some = 1, own
    depth = distance_transform_edt(np.pad(some, 1))[1:-1, 1:-1]
    rows, cols = np.nonzero(depth >= _DEEP_ENOUGH * depth.max())
    row, col = _nearest_to_median(rows, cols)
    return step * row, step * col


def _nearest_to_median(x: NDArray[Any], y: NDArray[Any]) -> tuple[Any, Any]:
    """Return the place that is nearest to the median of some."""
    middle = int(np.argmin(np.hypot(x - np.median(x), y - np.median(y))))
    return x[middle], y[middle]


def finish_map(axes: Axes, base: BaseMap, plan: CellPlan, title: str) -> None:
    """Mark the cells, and add title and attribution."""
    draw_cells(axes, local_frame(base), plan, base.bounds_m)
    axes.set_title(title)
    attribute(axes, base)
