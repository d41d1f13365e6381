"""Land use: the classes, and where one can walk (Fig. 3 of Khalaf-Allah 2007)."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from mapfilter.errors import InputError
from mapfilter.geodesy import Lattice
from mapfilter.report.basemap import (
    OVER_RASTER,
    BaseMap,
    attribute,
    draw_base,
    draw_raster,
    map_height_in,
    shape_faults,
)
from mapfilter.report.canvas import (
    BLACK,
    BLUE,
    GREY,
    Look,
    distinct_colours,
    mark,
    new_figure,
    styled,
)
from mapfilter.roads.landuse import LandUse

_PANEL_IN = 5.2
_LEGEND_ROW_IN = 0.24
_COLUMNS = 4
_NOT_WALKABLE = "#ececec"
_UNKNOWN = "white"


@styled
def plot_landuse(
    landuse: LandUse, lattice: Lattice, base: BaseMap, *, title: str = "Land use"
) -> Figure:
    """Draw the classes beside where one can walk, with each one's share of the area.

    Classes that are nowhere in the area are left out of the legend.

    Parameters
    ----------
    lattice : Lattice
        Where the pixels lie.
    base : BaseMap
        The map below.
    title : str
        Above the classes.

    Raises
    ------
    InputError
        The raster does not fit the lattice.
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
