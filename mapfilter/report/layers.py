"""What pictures with a raster on the map share: size, place, frame, names and legend."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from mapfilter._types import Floats
from mapfilter.errors import Faults
from mapfilter.geodesy import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.report.basemap import HALO, BaseMap, map_height_in
from mapfilter.report.canvas import picture

MAP_IN = 7.0
"""Width of a single map."""
OVER_RASTER = "#00000030"
"""Colour of streets that lie over a raster."""

_ROW_IN = 0.205
_HEADING_IN = 0.55
_MOST_NAMES = 60


@contextmanager
def map_picture(path: Path, base: BaseMap, beside_in: float) -> Iterator[tuple[Figure, Axes]]:
    """Give a figure with one map and so much room beside it; write it as :func:`picture` does."""
    with picture(path, MAP_IN + beside_in, map_height_in(base, MAP_IN) + 0.85) as figure:
        axes = figure.subplots()
        # Kept at the left: the layout reckons the room for its labels before the map's shape is
        # fitted, and a map moved off its labels' room would have them cut off.
        axes.set_anchor("W")
        yield figure, axes


def shape_faults(raster: NDArray[np.generic], lattice: Lattice) -> Faults:
    """Return a fault if a raster does not have the lattice's size."""
    faults = Faults()
    if raster.shape != (lattice.rows, lattice.cols):
        faults.add("raster", f"{lattice.rows} x {lattice.cols} pixels", raster.shape)
    return faults


def raster_extent(
    lattice: Lattice, base: BaseMap, unit_m: float
) -> tuple[float, float, float, float]:
    """Return left, right, bottom, top of a raster in the units of the axes."""
    west, south, east, north = lattice.bounds_m
    west0, south0 = base.bounds_m[:2]
    return (
        (west - west0) / unit_m,
        (east - west0) / unit_m,
        (south - south0) / unit_m,
        (north - south0) / unit_m,
    )


def keep_extent(axes: Axes, base: BaseMap, unit_m: float) -> None:
    """Undo the zoom of ``imshow`` to its own raster."""
    west, south, east, north = base.bounds_m
    axes.set_xlim(0.0, (east - west) / unit_m)
    axes.set_ylim(0.0, (north - south) / unit_m)


def is_indoor(plan: CellPlan, cell_id: str) -> bool:
    """Tell whether a cell is named beside its own mark, not amid its points."""
    return cell_id in plan and plan[cell_id].indoor


def largest(counts: Sequence[int], most: int) -> set[int]:
    """Return the places of the ``most`` largest counts; of equal ones the first.

    Examples
    --------
    >>> sorted(largest([3, 9, 3, 0], 2))
    [0, 1]
    """
    return set(np.argsort(-np.asarray(counts), kind="stable")[:most].tolist())


def named_groups(counts: Sequence[int]) -> set[int]:
    """Return the places of the groups to name on the map: not so many that no name is read."""
    return {i for i in largest(counts, _MOST_NAMES) if counts[i] > 0}


def short_names(names: Sequence[str]) -> list[str]:
    """Return names without what they all begin with, up to a hyphen, for want of room on a map.

    Examples
    --------
    >>> short_names(["302-720-29100-95", "302-720-29100-9"])
    ['95', '9']
    >>> short_names(["S1A", "S1B"])
    ['S1A', 'S1B']
    """
    if len(names) < 2:
        return list(names)
    # What the first and the last in order share, all share.
    first, last = min(names), max(names)
    differ = (i for i, (a, b) in enumerate(zip(first, last, strict=False)) if a != b)
    cut = first[: next(differ, len(first))].rfind("-") + 1
    return [name[cut:] or name for name in names]


def name_group(axes: Axes, x: Floats, y: Floats, name: str) -> None:
    """Write a group's name on that one of its points that lies nearest to their median."""
    middle = int(np.argmin(np.hypot(x - np.median(x), y - np.median(y))))
    axes.text(
        float(x[middle]), float(y[middle]), name, ha="center", va="center", fontsize=8,
        fontweight="bold", path_effects=list(HALO), zorder=12, clip_on=True,
    )  # fmt: skip


def side_legend(
    figure: Figure, heading: str, groups: Sequence[Line2D], counts: Sequence[int],
    marks: Sequence[Line2D],
) -> None:  # fmt: skip
    """Put a legend to the right of the map: the largest groups that it has room for, and marks.

    Parameters
    ----------
    figure : Figure
    heading : str
    groups : sequence of Line2D
        Labelled, one per group.
    counts : sequence of int
        Size of each group.
    marks : sequence of Line2D
        Labelled; always shown.
    """
    room = int((figure.get_figheight() - _HEADING_IN) / _ROW_IN) - len(marks)
    shown = list(groups)
    if len(groups) > room:
        kept = largest(counts, max(room - 1, 1))
        shown = [groups[i] for i in sorted(kept)]
        left = len(groups) - len(kept)
        shown.append(Line2D([], [], linestyle="", label=f"and {left} with less"))
    figure.legend(
        handles=[*shown, *marks], title=heading, alignment="left", labelspacing=0.4, frameon=False,
        loc="outside right upper", borderpad=0.9,
    )  # fmt: skip
