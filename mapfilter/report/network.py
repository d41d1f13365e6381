"""A network on the map: cells, best server, levels, margin, land use, bounds at points.

Figs. 2 to 4 of Khalaf-Allah (2007) are points by cell (of one site, and of all) and land use.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import cos, hypot, sin

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from mapfilter._types import Floats
from mapfilter.errors import InputError
from mapfilter.geodesy import Lattice, grid_convergence_rad, heading_from_azimuth_rad, unproject
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
    map_height_in,
    shape_faults,
    short_names,
    side_legend,
)
from mapfilter.report.canvas import (
    BLACK,
    BLUE,
    GREY,
    Look,
    distinct_colours,
    figure_of,
    grouped,
    mark,
    new_figure,
    styled,
)
from mapfilter.roads.landuse import LandUse

STEPS_DB = (0.0, 1.0, 3.0, 6.0, 10.0, 15.0, 20.0)
"""Where the classes of margins begin; the last has no end."""

_ARROW_SHARE = 0.06
"""Length of a sector's arrow, as a share of the extent's diagonal."""

_LEGEND_IN, _WIDE_LEGEND_IN, _BAR_IN, _POINT_BAR_IN = 2.7, 3.4, 1.7, 1.5
_ONE_CELL = "#fff7bc"
_PANEL_IN, _LEGEND_ROW_IN, _COLUMNS = 5.2, 0.24, 4
_NOT_WALKABLE, _UNKNOWN = "#ececec", "white"
_MOST_NAMES, _MOST_TWINS = 60, 25
_SHOWN = (2.0, 98.0)


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

    With the cells of one site this is Fig. 2 of the paper, with all cells Fig. 4. Every group is
    named on the map and, with its number of points, in the legend.

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
        groups.add(index, grouped(counts[index]), (x, y))
    _finish(axes, base, plan, title)
    side_legend(axes, "cell: points", groups.handles, counts, network_legend(plan))
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
    for index, count in enumerate(counts):
        places_m = lattice.east_north(*np.nonzero(best_server == index))
        groups.add(index, f"{100 * count / best_server.size:.1f} %", frame(*places_m))
    _finish(axes, base, plan, title)
    side_legend(axes, "cell: share of area", groups.handles, counts, network_legend(plan))
    return axes


class _Groups:
    """The colours, names and legend of the cells on a map."""

    def __init__(
        self, axes: Axes, plan: CellPlan, cell_ids: Sequence[str], counts: Sequence[int]
    ) -> None:
        self.colours = distinct_colours(len(cell_ids))
        self.handles: list[Line2D] = []
        self._axes, self._plan, self._ids = axes, plan, cell_ids
        self._names, self._named = short_names(cell_ids), largest(counts, _MOST_NAMES)

    def add(self, index: int, amount: str, at: tuple[Floats, Floats]) -> None:
        """Add a cell to the legend; name it at the place nearest to their median.

        Indoor cells are named at their marks, and so are not named here.
        """
        name, colour = self._ids[index], self.colours[index]
        self.handles.append(mark(f"{name}: {amount}", "s", 7, color=colour))
        indoor = name in self._plan and self._plan[name].indoor
        if at[0].size and index in self._named and not indoor:
            x, y = at
            middle = int(np.argmin(np.hypot(x - np.median(x), y - np.median(y))))
            look = Look(fontsize=8, zorder=12, clip_on=True) | MAP_NAME
            self._axes.text(float(x[middle]), float(y[middle]), self._names[index], **look)


@styled
def plot_level(
    level_dbm: NDArray[np.floating],
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    ax: Axes | None = None,
    *,
    title: str = "Level of the best server",
    range_dbm: tuple[float, float] = (-110.0, -50.0),
) -> Axes:
    """Draw a level raster, of one cell or of the best server.

    Levels are NaN where nothing is known; ``range_dbm`` are the two ends of the colour scale.
    """
    shape_faults(level_dbm, lattice).raise_if_any(InputError)
    axes = map_axes(ax, base, _BAR_IN)
    draw_base(axes, base, streets=OVER_RASTER)
    image = draw_raster(axes, base, lattice, level_dbm, cmap="viridis", clim=range_dbm, zorder=1)
    look = Look(shrink=0.75, pad=0.02, aspect=32, extend="both")
    figure_of(axes).colorbar(image, ax=axes, label="level / dBm", **look)
    _finish(axes, base, plan, title)
    return axes


@styled
def plot_margin(
    margin_db: NDArray[np.floating],
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    ax: Axes | None = None,
    *,
    title: str = "Margin of the best server over the second",
) -> Axes:
    """Draw the margin in classes, dark where two cells are nearly equal, with each one's share.

    The margin, >= 0, is the best level above the second best; infinite where one cell is received
    alone, NaN where none is or where it is not to be drawn, such as beside the ways.
    """
    faults = shape_faults(margin_db, lattice)
    known = ~np.isnan(margin_db)
    if known.any() and float(margin_db[known].min()) < 0:
        faults.add("margin", "dB >= 0", float(margin_db[known].min()))
    faults.raise_if_any(InputError)
    ramp = matplotlib.colormaps["cividis"](np.linspace(0.0, 0.93, len(STEPS_DB)))
    colours = [*(to_hex(colour) for colour in ramp), _ONE_CELL]
    classes = np.searchsorted(np.array(STEPS_DB), margin_db[known], side="right") - 1
    classes[np.isinf(margin_db[known])] = len(STEPS_DB)
    counts = np.bincount(classes, minlength=len(colours))
    shown = np.ma.masked_array(np.zeros(margin_db.shape, dtype=np.int64), ~known)
    shown[known] = classes
    axes = map_axes(ax, base, _WIDE_LEGEND_IN)
    draw_base(axes, base, streets=OVER_RASTER)
    norm = BoundaryNorm(np.arange(-0.5, len(colours)), len(colours))
    draw_raster(axes, base, lattice, shown, cmap=ListedColormap(colours), norm=norm)
    _finish(axes, base, plan, title)
    between = [f"{low:g} to {high:g} dB" for low, high in pairwise(STEPS_DB)]
    names = [*between, f"{STEPS_DB[-1]:g} dB and more", "one cell alone"]
    rim = Look(markeredgecolor=GREY, markeredgewidth=0.4)
    shares = 100 * counts / max(counts.sum(), 1)
    handles = [
        mark(f"{name}: {share:.1f} %", "s", 8, color=colour, **rim)
        for name, colour, share in zip(names, colours, shares, strict=True)
    ]
    side_legend(axes, "margin: share of pixels", handles, counts.tolist(), network_legend(plan))
    return axes


def _finish(axes: Axes, base: BaseMap, plan: CellPlan, title: str) -> None:
    draw_cells(axes, local_frame(base), plan, base.bounds_m)
    axes.set_title(title)
    attribute(axes, base)


@styled
def plot_landuse(
    landuse: LandUse, lattice: Lattice, base: BaseMap, *, title: str = "Land use"
) -> Figure:
    """Draw the classes beside the walkable places, with the share of each class in the area.

    Classes that are nowhere in the area are left out of the legend.
    """
    shape_faults(landuse.code, lattice).raise_if_any(InputError)
    colours = list(landuse.colours) or distinct_colours(len(landuse.names))
    counts = np.bincount(landuse.code[landuse.code >= 0], minlength=len(landuse.names))
    there = np.flatnonzero(counts)
    rows = -(-len(there) // _COLUMNS)
    height_in = map_height_in(base, _PANEL_IN) + 1.15 + _LEGEND_ROW_IN * rows
    figure = new_figure(2 * _PANEL_IN + 0.9, height_in)
    left, right = figure.subplots(1, 2)
    walkable = np.ma.masked_where(landuse.code < 0, landuse.walkable)
    panels = (
        (left, np.ma.masked_less(landuse.code, 0), colours or [_UNKNOWN]),
        (right, walkable, [_NOT_WALKABLE, BLUE]),
    )
    for axes, shown, palette in panels:
        draw_base(axes, base, streets=OVER_RASTER, scale_bar=axes is left)
        limits = (-0.5, len(palette) - 0.5)
        draw_raster(axes, base, lattice, shown, cmap=ListedColormap(palette), clim=limits)
    left.set_title(title)
    right.set_title(f"Where one can walk: {100 * landuse.walkable.mean():.1f} % of the area")
    right.set_ylabel("")
    right.set_yticklabels([])
    attribute(right, base)
    handles = []
    for code in there:
        can_walk, share = landuse.can_walk[code], 100 * counts[code] / landuse.code.size
        label = f"{landuse.names[code]}{' (walkable)' if can_walk else ''}: {share:.1f} %"
        rim = (BLACK, 1.0) if can_walk else (GREY, 0.4)
        handles.append(mark(label, "s", 8, color=colours[code], mec=rim[0], mew=rim[1]))
    where = Look(loc="outside lower center", frameon=False, handletextpad=0.3)
    figure.legend(handles=handles, ncols=_COLUMNS, **where)
    return figure


@styled
def plot_point_values(
    values: NDArray[np.floating],
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    ax: Axes | None = None,
    *,
    title: str,
    label: str,
    limits: tuple[float, float] | None = None,
) -> Axes:
    """Draw a figure of every point, such as a bound or the metres to a fix; light is small.

    Values are NaN off the points, and where levels carry no information. ``label`` stands beside
    the colour scale, ``limits`` are its ends, by default those of nearly all values.
    """
    shape_faults(values, lattice).raise_if_any(InputError)
    known = values[np.isfinite(values)]
    low, high = limits or (np.percentile(known, _SHOWN) if known.size else (0.0, 1.0))
    ends = float(low), max(float(high), float(low) + 1e-9)
    axes = map_axes(ax, base, _POINT_BAR_IN)
    draw_base(axes, base)
    image = draw_raster(axes, base, lattice, values, cmap="viridis_r", clim=ends)
    _finish(axes, base, plan, title)
    figure_of(axes).colorbar(image, ax=axes, shrink=0.75, label=label, extend="neither")
    return axes


def plot_twins(
    twin_error: NDArray[np.floating],
    pairs_m: Floats,
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
) -> Axes:
    """Draw the similarity of each point's twin, and the worst pairs joined by lines.

    The probability of an error is 0 to 0.5; ``pairs_m``, (n, 4), are east and north of both
    places, the worst first, of which some are drawn.
    """
    title, label = "Probability of confusion with another place", "probability of an error"
    look = Look(title=title, label=label, limits=(0.0, 0.5))
    axes = plot_point_values(twin_error, lattice, plan, base, **look)
    frame = local_frame(base)
    ends = [np.column_stack(frame(pair[[0, 2]], pair[[1, 3]])) for pair in pairs_m[:_MOST_TWINS]]
    axes.add_collection(LineCollection(ends, colors=BLACK, linewidths=0.9, zorder=8))
    for end in ends:
        axes.scatter(end[:, 0], end[:, 1], s=10, color=BLACK, zorder=9, linewidths=0)
    return axes
