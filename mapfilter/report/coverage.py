"""Coverage: points by serving cell (Figs. 2 and 4 of Khalaf-Allah 2007), levels, best servers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from mapfilter._types import Floats
from mapfilter.errors import InputError
from mapfilter.geodesy import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.report.basemap import BaseMap, attribute, draw_base
from mapfilter.report.canvas import distinct_colours, grouped
from mapfilter.report.layers import (
    MAP_IN,
    OVER_RASTER,
    is_indoor,
    keep_extent,
    map_picture,
    name_group,
    named_groups,
    raster_extent,
    shape_faults,
    short_names,
    side_legend,
)
from mapfilter.report.network import draw_cells, network_legend

_SIDE_IN = 2.7
_BAR_IN = 1.7


def plot_points_per_cell(
    points_by_cell: Mapping[str, tuple[Floats, Floats]],
    plan: CellPlan,
    base: BaseMap,
    path: Path,
    *,
    title: str = "",
    counts: Sequence[int] | None = None,
    resolution_m: float = 5.0,
) -> None:
    """Draw the points that belong to each cell in a colour of its own.

    With the cells of one site this is Fig. 2 of the paper, with all cells Fig. 4. Every group is
    named on the map and, with its number of points, in the legend.

    Parameters
    ----------
    points_by_cell : mapping from cell id to (east_m, north_m)
        Points of each cell, arrays of equal length in the base map's CRS. The order is that of the
        colours. A point that several cells claim takes the colour of the last.
    plan : CellPlan
        Sites, sector azimuths and indoor cells to mark; those outside the extent are left out.
    base : BaseMap
        The map below.
    path : Path
        PNG to write.
    title : str
        Above the map.
    counts : sequence of int, optional
        Points of each cell, where only some of them are given to be drawn.
    resolution_m : float
        Distance between neighbouring points, which sets the size of their marks.

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    colours = distinct_colours(len(points_by_cell))
    pitch_pt = 72 * MAP_IN * resolution_m / (base.bounds_m[2] - base.bounds_m[0])
    size = float(np.clip((1.05 * pitch_pt) ** 2, 1.2, 400.0))
    with map_picture(path, base, _SIDE_IN) as (figure, axes):
        frame = draw_base(axes, base)
        handles = []
        if counts is None:
            counts = [len(east_m) for east_m, _ in points_by_cell.values()]
        names = short_names(list(points_by_cell))
        named = named_groups(counts)
        for index, (cell_id, (east_m, north_m)) in enumerate(points_by_cell.items()):
            colour = colours[index]
            x, y = frame(east_m, north_m)
            axes.scatter(x, y, s=size, color=colour, marker="s", linewidths=0, zorder=3)
            if x.size and index in named and not is_indoor(plan, cell_id):
                name_group(axes, x, y, names[index])
            label = f"{cell_id}: {grouped(counts[index])}"
            handles.append(
                Line2D([], [], linestyle="", marker="o", markersize=6, color=colour, label=label)
            )
        draw_cells(axes, frame, plan, base.bounds_m)
        axes.set_title(title)
        attribute(axes, base)
        side_legend(figure, "cell: points", handles, counts, network_legend(plan))


def plot_best_server(
    best_server: NDArray[np.integer],
    cell_ids: Sequence[str],
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    path: Path,
    *,
    title: str = "Best server",
) -> None:
    """Draw which cell is heard best at every pixel, with each cell's share of the area.

    Parameters
    ----------
    best_server : (rows, cols) integer array
        Index into ``cell_ids``; negative where no cell is heard.
    cell_ids : sequence of str
        Ids of the cells.
    lattice : Lattice
        Where the pixels lie.
    plan, base, path, title
        As in :func:`plot_points_per_cell`.

    Raises
    ------
    InputError
        The raster does not fit the lattice or the cells.
    OutputError
        The picture cannot be written.
    """
    faults = shape_faults(best_server, lattice)
    if best_server.size and int(best_server.max()) >= len(cell_ids):
        faults.add("best server", f"indices below {len(cell_ids)}", int(best_server.max()))
    faults.raise_if_any(InputError)
    colours = distinct_colours(len(cell_ids))
    shown = np.ma.masked_less(best_server, 0)
    with map_picture(path, base, _SIDE_IN) as (figure, axes):
        frame = draw_base(axes, base, streets=OVER_RASTER)
        axes.imshow(
            shown, extent=raster_extent(lattice, base, frame.unit_m),
            cmap=ListedColormap(colours or "w"),
            vmin=-0.5, vmax=max(len(cell_ids), 1) - 0.5, interpolation="nearest", alpha=0.85,
            zorder=1,
        )  # fmt: skip
        keep_extent(axes, base, frame.unit_m)
        handles = []
        counts = np.bincount(best_server[best_server >= 0], minlength=len(cell_ids)).tolist()
        names = short_names(cell_ids)
        named = named_groups(counts)
        for index, (cell_id, colour) in enumerate(zip(cell_ids, colours, strict=True)):
            label = f"{cell_id}: {100 * counts[index] / best_server.size:.1f} %"
            handles.append(
                Line2D([], [], linestyle="", marker="s", markersize=7, color=colour, label=label)
            )
            if index in named and not is_indoor(plan, cell_id):
                rows, cols = np.nonzero(best_server == index)
                x, y = frame(*lattice.east_north(rows, cols))
                name_group(axes, x, y, names[index])
        draw_cells(axes, frame, plan, base.bounds_m)
        axes.set_title(title)
        attribute(axes, base)
        side_legend(figure, "cell: share of area", handles, counts, network_legend(plan))


def plot_level(
    level_dbm: NDArray[np.floating],
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    path: Path,
    *,
    title: str = "Level of the best server",
    range_dbm: tuple[float, float] = (-110.0, -50.0),
) -> None:
    """Draw a level raster, of one cell or of the best server.

    Parameters
    ----------
    level_dbm : (rows, cols) array
        Levels in dBm; NaN where nothing is known.
    lattice : Lattice
        Where the pixels lie.
    plan, base, path, title
        As in :func:`plot_points_per_cell`.
    range_dbm : (low, high)
        Levels at the two ends of the colour scale.

    Raises
    ------
    InputError
        The raster does not fit the lattice.
    OutputError
        The picture cannot be written.
    """
    shape_faults(level_dbm, lattice).raise_if_any(InputError)
    with map_picture(path, base, _BAR_IN) as (figure, axes):
        frame = draw_base(axes, base, streets=OVER_RASTER)
        image = axes.imshow(
            np.ma.masked_invalid(level_dbm), extent=raster_extent(lattice, base, frame.unit_m),
            cmap="viridis", vmin=range_dbm[0], vmax=range_dbm[1], interpolation="nearest",
            zorder=1,
        )  # fmt: skip
        keep_extent(axes, base, frame.unit_m)
        draw_cells(axes, frame, plan, base.bounds_m)
        bar = figure.colorbar(image, ax=axes, shrink=0.75, pad=0.02, aspect=32, extend="both")
        bar.set_label("level / dBm")
        axes.set_title(title)
        attribute(axes, base)
