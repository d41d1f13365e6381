"""Where a radio map will work: position bound, metres to the first fix, places that look alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mapfilter._types import Floats
from mapfilter.errors import InputError
from mapfilter.geodesy import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.report.basemap import BaseMap, LocalFrame, attribute, draw_base
from mapfilter.report.canvas import BLACK
from mapfilter.report.layers import keep_extent, map_picture, raster_extent, shape_faults
from mapfilter.report.network import draw_cells

_BAR_IN = 1.5
_MOST_TWINS = 25
_SHOWN = (2.0, 98.0)


def plot_position_bound(
    bound_m: NDArray[np.floating],
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    path: Path,
    *,
    title: str = "Least position error along the street from one report of levels",
) -> None:
    """Draw the bound at every point; light is good.

    Parameters
    ----------
    bound_m : (rows, cols) array
        NaN off the points, and where levels tell nothing.
    lattice : Lattice
        Where the pixels lie.
    plan : CellPlan
        Cells to mark.
    base : BaseMap
        The map below.
    path : Path
        PNG to write.
    title : str
        Above the map.

    Raises
    ------
    InputError
        The raster does not fit the lattice.
    OutputError
        The picture cannot be written.
    """
    _map(bound_m, lattice, plan, base, path, title, "bound / m")


def plot_metres_to_fix(
    metres_m: NDArray[np.floating],
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    path: Path,
    *,
    title: str = "Expected metres until an ideal filter knows where it is",
) -> None:
    """Draw the metres to the first fix from every point; arguments as of the function above."""
    _map(metres_m, lattice, plan, base, path, title, "metres to convergence / m")


def plot_twins(
    twin_error: NDArray[np.floating],
    pairs_m: Floats,
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    path: Path,
    *,
    title: str = "Chance of taking another place for this one",
) -> None:
    """Draw how alike each point's twin looks, and the worst pairs joined by lines.

    Parameters
    ----------
    twin_error : (rows, cols) array
        0 to 0.5.
    pairs_m : (n, 4) array
        East and north of both places, the worst first; some are drawn.
    lattice, plan, base, path, title
        As for :func:`plot_position_bound`.
    """
    _map(twin_error, lattice, plan, base, path, title, "chance of an error", pairs_m, (0.0, 0.5))


def _map(
    values: NDArray[np.floating],
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    path: Path,
    title: str,
    label: str,
    pairs_m: Floats | None = None,
    limits: tuple[float, float] | None = None,
) -> None:
    shape_faults(values, lattice).raise_if_any(InputError)
    known = values[np.isfinite(values)]
    low, high = limits or (np.percentile(known, _SHOWN) if known.size else (0.0, 1.0))
    scale = Normalize(float(low), max(float(high), float(low) + 1e-9))
    with map_picture(path, base, _BAR_IN) as (figure, axes):
        frame = draw_base(axes, base)
        extent = raster_extent(lattice, base, frame.unit_m)
        image = axes.imshow(
            np.ma.masked_invalid(values), extent=extent, cmap="viridis_r", norm=scale,
            interpolation="nearest", zorder=2,
        )  # fmt: skip
        keep_extent(axes, base, frame.unit_m)
        if pairs_m is not None:
            _join(axes, frame, pairs_m[:_MOST_TWINS])
        draw_cells(axes, frame, plan, base.bounds_m)
        axes.set_title(title)
        attribute(axes, base)
        _bar(figure, image, axes, label)


def _join(axes: Axes, frame: LocalFrame, pairs_m: Floats) -> None:
    ends = [np.column_stack(frame(pair[[0, 2]], pair[[1, 3]])) for pair in pairs_m]
    axes.add_collection(LineCollection(ends, colors=BLACK, linewidths=0.9, zorder=8))
    for end in ends:
        axes.scatter(end[:, 0], end[:, 1], s=10, color=BLACK, zorder=9, linewidths=0)


def _bar(figure: Figure, image: object, axes: Axes, label: str) -> None:
    figure.colorbar(image, ax=axes, shrink=0.75, label=label, extend="neither")  # type: ignore[arg-type]
