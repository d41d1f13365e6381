"""Where a radio map will work: position bound, metres to the first fix, places that look alike."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from numpy.typing import NDArray

from mapfilter._types import Floats
from mapfilter.errors import InputError
from mapfilter.geodesy import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.report.basemap import (
    BaseMap,
    attribute,
    draw_base,
    draw_raster,
    local_frame,
    map_axes,
    shape_faults,
)
from mapfilter.report.canvas import BLACK, Look, figure_of, styled
from mapfilter.report.network import draw_cells

_BAR_IN = 1.5
_MOST_TWINS = 25
_SHOWN = (2.0, 98.0)


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

    Parameters
    ----------
    values : (rows, cols) array
        NaN off the points, and where levels carry no information.
    lattice : Lattice
        Where the pixels lie.
    plan : CellPlan
        Cells to mark.
    base : BaseMap
        The map below.
    ax : Axes, optional
        Drawn on; a figure of its own by default.
    title, label : str
        Above the map, and beside the scale of colours.
    limits : (float, float), optional
        Ends of that scale; by default those of nearly all values.

    Raises
    ------
    InputError
        The raster does not fit the lattice.
    """
    shape_faults(values, lattice).raise_if_any(InputError)
    known = values[np.isfinite(values)]
    low, high = limits or (np.percentile(known, _SHOWN) if known.size else (0.0, 1.0))
    ends = float(low), max(float(high), float(low) + 1e-9)
    axes = map_axes(ax, base, _BAR_IN)
    frame = draw_base(axes, base)
    image = draw_raster(axes, base, lattice, values, cmap="viridis_r", clim=ends)
    draw_cells(axes, frame, plan, base.bounds_m)
    axes.set_title(title)
    attribute(axes, base)
    figure_of(axes).colorbar(image, ax=axes, shrink=0.75, label=label, extend="neither")
    return axes


def plot_twins(
    twin_error: NDArray[np.floating],
    pairs_m: Floats,
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    ax: Axes | None = None,
    *,
    title: str = "Chance of taking another place for this one",
) -> Axes:
    """Draw how alike each point's twin looks, and the worst pairs joined by lines.

    Parameters
    ----------
    twin_error : (rows, cols) array
        0 to 0.5.
    pairs_m : (n, 4) array
        East and north of both places, the worst first; some are drawn.
    lattice, plan, base, ax, title
        As for :func:`plot_point_values`.
    """
    look = Look(title=title, label="chance of an error", limits=(0.0, 0.5))
    axes = plot_point_values(twin_error, lattice, plan, base, ax, **look)
    frame = local_frame(base)
    ends = [np.column_stack(frame(pair[[0, 2]], pair[[1, 3]])) for pair in pairs_m[:_MOST_TWINS]]
    axes.add_collection(LineCollection(ends, colors=BLACK, linewidths=0.9, zorder=8))
    for end in ends:
        axes.scatter(end[:, 0], end[:, 1], s=10, color=BLACK, zorder=9, linewidths=0)
    return axes
