"""Margin: how far the best server is above the second, and so how surely it is heard."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap, to_hex
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from mapfilter._types import Ints
from mapfilter.errors import InputError
from mapfilter.geodesy import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.report.basemap import BaseMap, attribute, draw_base
from mapfilter.report.canvas import GREY
from mapfilter.report.layers import (
    OVER_RASTER,
    keep_extent,
    map_picture,
    raster_extent,
    shape_faults,
    side_legend,
)
from mapfilter.report.network import draw_cells, network_legend

STEPS_DB = (0.0, 1.0, 3.0, 6.0, 10.0, 15.0, 20.0)
"""Where the classes of the picture begin; the last has no end."""

_SIDE_IN = 3.4
_ONE_CELL = "#fff7bc"


def plot_margin(
    margin_db: NDArray[np.floating],
    lattice: Lattice,
    plan: CellPlan,
    base: BaseMap,
    path: Path,
    *,
    title: str = "Margin of the best server over the second",
) -> None:
    """Draw the margin in classes, dark where two cells are nearly equal, with each one's share.

    Parameters
    ----------
    margin_db : (rows, cols) array
        Best level above the second best, >= 0; infinite where one cell is heard alone, NaN where
        none is or where it is not to be drawn, such as beside the ways.
    lattice : Lattice
        Where the pixels lie.
    plan : CellPlan
        Sites, sector azimuths and indoor cells to mark; those outside the extent are left out.
    base : BaseMap
        The map below.
    path : Path
        PNG to write.
    title : str
        Above the map.

    Raises
    ------
    InputError
        The raster does not fit the lattice, or a margin is negative.
    OutputError
        The picture cannot be written.
    """
    faults = shape_faults(margin_db, lattice)
    known = ~np.isnan(margin_db)
    if known.any() and float(margin_db[known].min()) < 0:
        faults.add("margin", "dB >= 0", float(margin_db[known].min()))
    faults.raise_if_any(InputError)
    counts = np.bincount(_classes(margin_db[known]), minlength=len(STEPS_DB) + 1)
    ramp = matplotlib.colormaps["cividis"](np.linspace(0.0, 0.93, len(STEPS_DB)))
    colours = [*(to_hex(colour) for colour in ramp), _ONE_CELL]
    shown = np.ma.masked_array(np.zeros(margin_db.shape, dtype=np.int64), ~known)
    shown[known] = _classes(margin_db[known])
    with map_picture(path, base, _SIDE_IN) as (figure, axes):
        frame = draw_base(axes, base, streets=OVER_RASTER)
        axes.imshow(
            shown, extent=raster_extent(lattice, base, frame.unit_m), cmap=ListedColormap(colours),
            norm=BoundaryNorm(np.arange(-0.5, len(colours)), len(colours)),
            interpolation="nearest", zorder=2,
        )  # fmt: skip
        keep_extent(axes, base, frame.unit_m)
        draw_cells(axes, frame, plan, base.bounds_m)
        axes.set_title(title)
        attribute(axes, base)
        handles = [
            Line2D(
                [], [], linestyle="", marker="s", markersize=8, color=colour,
                markeredgecolor=GREY, markeredgewidth=0.4, label=f"{name}: {share:.1f} %",
            )
            for name, colour, share in zip(
                _names(), colours, 100 * counts / max(int(counts.sum()), 1), strict=True
            )
        ]  # fmt: skip
        side_legend(
            figure, "margin: share of pixels", handles, counts.tolist(), network_legend(plan)
        )


def _classes(margin_db: NDArray[np.floating]) -> Ints:
    """Return the class of each margin; the last is that of one cell alone."""
    found = np.searchsorted(np.array(STEPS_DB), margin_db, side="right") - 1
    return np.where(np.isinf(margin_db), len(STEPS_DB), found)


def _names() -> list[str]:
    between = [f"{low:g} to {high:g} dB" for low, high in pairwise(STEPS_DB)]
    return [*between, f"{STEPS_DB[-1]:g} dB and more", "one cell alone"]
