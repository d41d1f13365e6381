"""Land use: the classes, and where one can walk (Fig. 3 of Khalaf-Allah 2007)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D

from mapfilter.errors import InputError
from mapfilter.geodesy import Lattice
from mapfilter.report.basemap import BaseMap, attribute, draw_base, map_height_in
from mapfilter.report.canvas import BLACK, BLUE, GREY, distinct_colours, picture
from mapfilter.report.layers import OVER_RASTER, keep_extent, raster_extent, shape_faults
from mapfilter.roads.landuse import LandUse

_PANEL_IN = 5.2
_LEGEND_ROW_IN = 0.24
_COLUMNS = 4
_NOT_WALKABLE = "#ececec"
_UNKNOWN = "white"


def plot_landuse(
    landuse: LandUse,
    lattice: Lattice,
    base: BaseMap,
    path: Path,
    *,
    title: str = "Land use",
) -> None:
    """Draw the classes beside where one can walk, with each one's share of the area.

    Classes that are nowhere in the area are left out of the legend.

    Parameters
    ----------
    landuse : LandUse
    lattice : Lattice
        Where the pixels lie.
    base : BaseMap
        The map below.
    path : Path
        PNG to write.
    title : str
        Above the classes.

    Raises
    ------
    InputError
        The raster does not fit the lattice.
    OutputError
        The picture cannot be written.
    """
    shape_faults(landuse.code, lattice).raise_if_any(InputError)
    colours = list(landuse.colours) or distinct_colours(len(landuse.names))
    counts = np.bincount(landuse.code[landuse.code >= 0], minlength=len(landuse.names))
    there = np.flatnonzero(counts)
    rows = -(-len(there) // _COLUMNS)
    height_in = map_height_in(base, _PANEL_IN) + 1.15 + _LEGEND_ROW_IN * rows
    walkable = landuse.walkable
    with picture(path, 2 * _PANEL_IN + 0.9, height_in) as figure:
        left, right = figure.subplots(1, 2)
        panels = (
            (left, np.ma.masked_less(landuse.code, 0), colours or [_UNKNOWN]),
            (right, np.ma.masked_where(landuse.code < 0, walkable), [_NOT_WALKABLE, BLUE]),
        )
        for axes, shown, palette in panels:
            frame = draw_base(axes, base, streets=OVER_RASTER, scale_bar=axes is left)
            axes.imshow(
                shown, extent=raster_extent(lattice, base, frame.unit_m),
                cmap=ListedColormap(palette), vmin=-0.5, vmax=len(palette) - 0.5,
                interpolation="nearest", zorder=2,
            )  # fmt: skip
            keep_extent(axes, base, frame.unit_m)
        left.set_title(title)
        right.set_title(f"Where one can walk: {100 * walkable.mean():.1f} % of the area")
        right.set_ylabel("")
        right.set_yticklabels([])
        attribute(right, base)
        handles = [
            Line2D(
                [], [], linestyle="", marker="s", markersize=8, color=colours[code],
                markeredgecolor=BLACK if landuse.can_walk[code] else GREY,
                markeredgewidth=1.0 if landuse.can_walk[code] else 0.4,
                label=f"{landuse.names[code]}{' (walkable)' if landuse.can_walk[code] else ''}: "
                f"{100 * counts[code] / landuse.code.size:.1f} %",
            )
            for code in there
        ]  # fmt: skip
        figure.legend(
            handles=handles, loc="outside lower center", ncols=_COLUMNS, frameon=False,
            handletextpad=0.3,
        )  # fmt: skip
