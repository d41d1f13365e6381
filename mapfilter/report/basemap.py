"""The map under a picture: extent, streets, scale bar and north; rasters, names and legends on it.

Maps are drawn in metres or kilometres east and north of the south-western corner of their area.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import floor, log10
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from mapfilter._types import Floats
from mapfilter.errors import Faults
from mapfilter.lattice import Lattice
from mapfilter.report.canvas import BLACK, GREY, STREET, Look, check_axes, figure_of, new_figure
from mapfilter.report.ground import BaseMap as BaseMap
from mapfilter.report.ground import Bounds as Bounds

HALO = (withStroke(linewidth=2.5, foreground="white"),)
"""White rim that keeps text and marks readable on any ground."""

MAP_NAME = Look(ha="center", va="center", fontweight="bold", path_effects=HALO)
"""Bold text on a map."""

OVER_RASTER = "#00000030"
"""Colour of streets that lie over a raster."""

MAP_IN = 7.0
"""Width of a single map."""

_KILOMETRE_FROM_M = 1500.0
_MOST_PX = 2400
_BEYOND_PX = 8
_ROW_IN, _HEADING_IN = 0.205, 0.55


@dataclass(frozen=True, slots=True)
class LocalFrame:
    """Conversion of metres of the CRS to the units of the axes: m or km from the local origin."""

    west_m: float
    south_m: float
    unit_m: float

    def __call__(self, east_m: Floats, north_m: Floats) -> tuple[Floats, Floats]:
        """Return east and north in the units of the axes."""
        return (
            (np.asarray(east_m, dtype=np.float64) - self.west_m) / self.unit_m,
            (np.asarray(north_m, dtype=np.float64) - self.south_m) / self.unit_m,
        )

    def extent(self, bounds_m: Bounds) -> tuple[float, float, float, float]:
        """Return left, right, bottom, top of an area, as ``imshow`` takes them."""
        west, south, east, north = bounds_m
        (left, right), (bottom, top) = self(np.array([west, east]), np.array([south, north]))
        return float(left), float(right), float(bottom), float(top)


def local_frame(base: BaseMap) -> LocalFrame:
    """Return the frame of a map and of all parts of it: metres, of large areas kilometres."""
    west, south, east, north = base.whole_m or base.bounds_m
    large = max(east - west, north - south) > _KILOMETRE_FROM_M
    return LocalFrame(west, south, 1000.0 if large else 1.0)


def map_height_in(base: BaseMap, width_in: float) -> float:
    """Return the height of a map ``width_in`` wide, kept within what still reads well."""
    west, south, east, north = base.bounds_m
    height_in = width_in * (north - south) / (east - west)
    return float(np.clip(height_in, 0.45 * width_in, 1.6 * width_in))


def map_axes(given: Axes | None, base: BaseMap, beside_in: float) -> Axes:
    """Return the axes of one map: those given, or new ones with so much room beside them."""
    check_axes(given)
    if given is not None:
        return given
    axes = new_figure(MAP_IN + beside_in, map_height_in(base, MAP_IN) + 0.85).subplots()
    # Kept at the left: the layout reckons the room for its labels before the map's shape is
    # fitted, and a map moved off its labels' room would have them cut off.
    axes.set_anchor("W")
    return axes


def draw_base(
    axes: Axes,
    base: BaseMap,
    *,
    streets: str = STREET,
    scale_bar: bool = True,
    north_at: float = 0.96,
) -> LocalFrame:
    """Draw streets and points, set extent and labels, and add scale bar and north arrow.

    ``streets`` is their colour, ``north_at`` the arrow's place along the upper edge, 0 to 1.
    Return the frame, which converts data to the units of the axes.
    """
    frame = local_frame(base)
    if base.points_m is not None and len(base.points_m):
        _draw_points(axes, frame, base.points_m, base)
    lines = [np.column_stack(frame(line[:, 0], line[:, 1])) for line in base.streets]
    if lines:
        axes.add_collection(LineCollection(lines, colors=streets, linewidths=0.6, zorder=1.5))
    _show_extent(axes, frame, base)
    axes.set_aspect("equal")
    unit = "m" if frame.unit_m == 1.0 else "km"
    axes.set_xlabel(f"east of local origin / {unit}")
    axes.set_ylabel(f"north of local origin / {unit}")
    axes.tick_params(length=3)
    if scale_bar:
        _draw_scale_bar(axes, base.bounds_m[2] - base.bounds_m[0])
        arrow = Look(arrowstyle="-|>", color=BLACK, linewidth=1.4, shrinkA=1)
        at = Look(xycoords="axes fraction", textcoords="offset points", arrowprops=arrow)
        north = axes.annotate("N", (north_at, 0.985), (0, -38), **at, **MAP_NAME, fontsize=9.5)
        # It lies within the map; to measure where takes long.
        north.set(zorder=19, in_layout=False)
    return frame


def attribute(axes: Axes, base: BaseMap) -> None:
    """Write whose map it is into the lower right corner."""
    if base.attribution:
        text = axes.text(0.992, 0.01, base.attribution, transform=axes.transAxes, zorder=20)
        text.set(ha="right", va="bottom", fontsize=6.5, color=GREY, path_effects=HALO)


def draw_raster(
    axes: Axes, base: BaseMap, lattice: Lattice, values: NDArray[Any], **image: Any
) -> AxesImage:
    """Draw a raster over the map, pixel by pixel; masked pixels and NaN are left out.

    The map is drawn already by :func:`draw_base`; ``image`` is as of ``axes.imshow``.
    """
    frame = local_frame(base)
    shown = np.ma.masked_invalid(values)
    given: Look = {
        "extent": frame.extent(lattice.bounds_m),
        "interpolation": "nearest",
        "zorder": 2,
    }
    drawn = axes.imshow(shown, **(given | image))
    # Undoes the zoom of imshow to its own raster.
    _show_extent(axes, frame, base)
    return drawn


def _show_extent(axes: Axes, frame: LocalFrame, base: BaseMap) -> None:
    left, right, bottom, top = frame.extent(base.bounds_m)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)


def _draw_points(axes: Axes, frame: LocalFrame, points_m: Floats, base: BaseMap) -> None:
    """Draw points as the pixels that they are the centres of; of large areas, as larger pixels.

    Those beyond the extent are left out, which takes less than not to show them.
    """
    low = points_m.min(axis=0) - base.resolution_m / 2
    side_m = max(base.resolution_m, float(np.ptp(points_m, axis=0).max()) / _MOST_PX)
    at = ((points_m - low) / side_m).astype(np.int64)
    corners = (np.array(base.bounds_m).reshape(2, 2) - low) / side_m
    first, end = np.floor(corners[0]) - _BEYOND_PX, np.ceil(corners[1]) + _BEYOND_PX
    at = at[((at >= first) & (at < end)).all(axis=1)]
    if not len(at):
        return
    corner = at.min(axis=0)
    col, row = (at - corner).T
    # Bytes, not fractions: matplotlib resamples them in a quarter of the time.
    pixels = np.zeros((int(row.max()) + 1, int(col.max()) + 1, 4), dtype=np.uint8)
    pixels[..., :3] = np.round(255 * np.array(to_rgb(STREET)))
    pixels[row, col, 3] = round(255 * 0.75)
    west_south = low + side_m * corner
    high = west_south + side_m * np.array(pixels.shape[1::-1])
    axes.imshow(pixels, extent=frame.extent((*west_south, *high)), origin="lower", zorder=1)


def _draw_scale_bar(axes: Axes, width_m: float) -> None:
    # The longest of 1, 2, 5 times a power of ten that is no more than a quarter of the width.
    power = 10.0 ** floor(log10(width_m / 4))
    # A little less than a power of ten may be rounded to it: then half of it is the longest.
    lengths_m = (factor * power for factor in (5.0, 2.0, 1.0, 0.5))
    length_m = next(length_m for length_m in lengths_m if length_m <= width_m / 4)
    text = f"{length_m / 1000:g} km" if length_m >= 1000 else f"{length_m:g} m"
    x = np.array([0.04, 0.04 + length_m / width_m])
    (bar,) = axes.plot(x, [0.045, 0.045], color=BLACK, linewidth=2.5, solid_capstyle="butt")
    rim = [withStroke(linewidth=5, foreground="white")]
    bar.set(transform=axes.transAxes, path_effects=rim, zorder=19)
    named = axes.text(float(x.mean()), 0.06, text, transform=axes.transAxes, zorder=19)
    named.set(ha="center", va="bottom", fontsize=8.5, path_effects=HALO)


def shape_faults(raster: NDArray[np.generic], lattice: Lattice) -> Faults:
    """Return a fault if a raster does not have the lattice's size."""
    faults = Faults()
    if raster.shape != (lattice.rows, lattice.cols):
        faults.add("raster", f"{lattice.rows} x {lattice.cols} pixels", raster.shape)
    return faults


def largest(counts: Sequence[int], most: int) -> set[int]:
    """Return the places of the ``most`` largest counts; of equal ones the first.

    Examples
    --------
    >>> sorted(largest([3, 9, 3, 0], 2))
    [0, 1]
    """
    return set(np.argsort(-np.asarray(counts), kind="stable")[:most].tolist())


def short_names(names: Sequence[str]) -> list[str]:
    """Return names without numbers that they all begin with, up to a hyphen, to fit on a map.

    Examples
    --------
    >>> short_names(["302-720-29100-95", "302-720-29100-9"])
    ['95', '9']
    >>> short_names(["Saint-Denis 1", "Saint-Denis 2"])
    ['Saint-Denis 1', 'Saint-Denis 2']
    """
    if len(names) < 2:
        return list(names)
    # What the first and the last in order share, all share.
    first, last = min(names), max(names)
    differ = (i for i, (a, b) in enumerate(zip(first, last, strict=False)) if a != b)
    cut = first[: next(differ, len(first))].rfind("-") + 1
    if any(sign.isalpha() for sign in first[:cut]):
        return list(names)
    return [name[cut:] or name for name in names]


def side_legend(
    axes: Axes,
    heading: str,
    groups: Sequence[Line2D],
    counts: Sequence[int],
    marks: Sequence[Line2D],
) -> None:
    """Put a legend to the right of the map: the largest groups that it has room for, all marks.

    ``counts`` are the sizes of the groups.
    """
    figure = figure_of(axes)
    room = int((figure.get_figheight() - _HEADING_IN) / _ROW_IN) - len(marks)
    shown = list(groups)
    if len(groups) > room:
        kept = largest(counts, max(room - 1, 1))
        shown = [groups[i] for i in sorted(kept)]
        left = len(groups) - len(kept)
        shown.append(Line2D([], [], linestyle="", label=f"and {left} with less"))
    look = Look(alignment="left", labelspacing=0.4, borderpad=0.9)
    where = Look(loc="outside right upper", frameon=False)
    figure.legend(handles=[*shown, *marks], title=heading, **where, **look)
