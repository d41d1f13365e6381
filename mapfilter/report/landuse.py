"""Land use: the classes, and where one can walk (Fig. 3 of Khalaf-Allah 2007)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import Lattice
from mapfilter.report.basemap import BaseMap, attribute, draw_base, map_height_in
from mapfilter.report.canvas import BLACK, BLUE, distinct_colours, picture
from mapfilter.report.layers import OVER_RASTER, keep_extent, raster_extent, shape_faults

_PANEL_IN = 5.2
_LEGEND_ROW_IN = 0.24
_COLUMNS = 4
_NOT_WALKABLE = "#ececec"
_UNKNOWN = "white"


@dataclass(frozen=True, slots=True, eq=False)
class LandUseClasses:
    """A classified raster.

    Parameters
    ----------
    code : (rows, cols) integer array
        Index into ``names``; negative where nothing is known.
    names : tuple of str
        Of the classes.
    walkable : tuple of bool
        Whether one can walk in each class.
    colours : tuple of str
        Of the classes, such as "#8c8c8c"; without them those of
        :func:`~mapfilter.report.canvas.distinct_colours`.

    Raises
    ------
    InputError
        Names, ``walkable`` and colours differ in number, or a code has no name.
    """

    code: NDArray[np.integer]
    names: tuple[str, ...]
    walkable: tuple[bool, ...]
    colours: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        faults = Faults()
        if len(self.names) != len(self.walkable):
            faults.add("land use, walkable", f"{len(self.names)} of them", len(self.walkable))
        if self.colours and len(self.names) != len(self.colours):
            faults.add("land use, colours", f"{len(self.names)} of them", len(self.colours))
        if self.code.size and int(self.code.max()) >= len(self.names):
            faults.add("land use, code", f"below {len(self.names)}", int(self.code.max()))
        faults.raise_if_any(InputError)

    @property
    def can_walk(self) -> NDArray[np.bool_]:
        """Where one can walk, shape (rows, cols)."""
        return np.isin(self.code, np.flatnonzero(self.walkable))


def plot_landuse(
    landuse: LandUseClasses,
    lattice: Lattice,
    base: BaseMap,
    path: Path,
    *,
    title: str = "Land use",
) -> None:
    """Draw the classes beside where one can walk, with each one's share of the area.

    Parameters
    ----------
    landuse : LandUseClasses
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
    rows = -(-len(landuse.names) // _COLUMNS)
    height_in = map_height_in(base, _PANEL_IN) + 1.15 + _LEGEND_ROW_IN * rows
    can_walk = landuse.can_walk
    with picture(path, 2 * _PANEL_IN + 0.9, height_in) as figure:
        left, right = figure.subplots(1, 2)
        panels = (
            (left, np.ma.masked_less(landuse.code, 0), colours or [_UNKNOWN]),
            (right, np.ma.masked_where(landuse.code < 0, can_walk), [_NOT_WALKABLE, BLUE]),
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
        right.set_title(f"Where one can walk: {100 * can_walk.mean():.1f} % of the area")
        right.set_ylabel("")
        right.set_yticklabels([])
        attribute(right, base)
        handles = [
            Line2D(
                [], [], linestyle="", marker="s", markersize=8, color=colour,
                markeredgecolor=BLACK if can_walk_there else "none",
                label=f"{name}{' (walkable)' if can_walk_there else ''}: "
                f"{100 * float((landuse.code == code).mean()):.1f} %",
            )
            for code, (name, can_walk_there, colour) in enumerate(
                zip(landuse.names, landuse.walkable, colours, strict=True)
            )
        ]  # fmt: skip
        figure.legend(
            handles=handles, loc="outside lower center", ncols=_COLUMNS, frameon=False,
            handletextpad=0.3,
        )  # fmt: skip
