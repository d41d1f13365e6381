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
from mapfilter.report.canvas import BLACK, figure_of, styled
from mapfilter.report.network import draw_cells

_BAR_IN = 1.5
_MOST_TWINS = 25
_SHOWN = (2.0, 98.0)


def plot_position_bound(
    bound_m: NDArray[np.floating],
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    ax: Axes | None = None,
    *,
    title: str = "Least position error along the street from one report of levels",
) -> Axes:
    """Draw the bound at every point; light is good.

    Parameters
    ----------
    bound_m : (rows, cols) array
        NaN off the points, and where levels carry no information.
    lattice : Lattice
        Where the pixels lie.
    plan : CellPlan
        Cells to mark.
    base : BaseMap
        The map below.
    ax : Axes, optional
        Drawn on; a figure of its own by default.
    title : str
        Above the map.

    Raises
    ------
    InputError
        The raster does not fit the lattice.
    """
    return _map(bound_m, lattice, plan, base, ax, title, "bound / m")


def plot_metres_to_fix(
    metres_m: NDArray[np.floating],
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    ax: Axes | None = None,
    *,
    title: str = "Expected metres until an ideal filter knows where it is",
) -> Axes:
    """Draw the metres to the first fix from every point, as :func:`plot_position_bound`."""
    return _map(metres_m, lattice, plan, base, ax, title, "metres to convergence / m")


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
        As for :func:`plot_position_bound`.
    """
    axes = _map(twin_error, lattice, plan, base, ax, title, "chance of an error", (0.0, 0.5))
    frame = local_frame(base)
    ends = [np.column_stack(frame(pair[[0, 2]], pair[[1, 3]])) for pair in pairs_m[:_MOST_TWINS]]
    axes.add_collection(LineCollection(ends, colors=BLACK, linewidths=0.9, zorder=8))
    for end in ends:
        axes.scatter(end[:, 0], end[:, 1], s=10, color=BLACK, zorder=9, linewidths=0)
    return axes


@styled
def _map(
    values: NDArray[np.floating],
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    ax: Axes | None,
    title: str,
    label: str,
    limits: tuple[float, float] | None = None,
) -> Axes:
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
