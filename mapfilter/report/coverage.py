"""What there is at each place of a map: levels, margin, land use, bounds, twins.

Fig. 3 of Khalaf-Allah (2007) is land use.
"""

from __future__ import annotations

from itertools import pairwise

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap, to_hex
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mapfilter._types import Floats
from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.report.basemap import (
    OVER_RASTER,
    BaseMap,
    attribute,
    draw_base,
    draw_raster,
    local_frame,
    map_axes,
    map_height_in,
    shape_faults,
    side_legend,
)
from mapfilter.report.canvas import (
    BLACK,
    BLUE,
    GREY,
    Look,
    distinct_colours,
    figure_of,
    mark,
    new_figure,
    styled,
)
from mapfilter.report.network import finish_map, network_legend
from mapfilter.roads.landuse import LandUse

STEPS_DB = (0.0, 1.0, 3.0, 6.0, 10.0, 15.0, 20.0)
"""Where the classes of margins begin; the last has no end."""

_WIDE_LEGEND_IN, _BAR_IN, _POINT_BAR_IN = 3.4, 1.7, 1.5
_ONE_CELL = "#fff7bc"
_PANEL_IN, _LEGEND_ROW_IN, _COLUMNS = 5.2, 0.24, 4
_NOT_WALKABLE, _UNKNOWN = "#ececec", "white"
_MOST_TWINS, _SHOWN = 25, (2.0, 98.0)


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
    finish_map(axes, base, plan, title)
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
    finish_map(axes, base, plan, title)
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
    finish_map(axes, base, plan, title)
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
