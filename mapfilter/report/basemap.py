"""The map under a picture: extent, streets, local axes, scale bar, north, attribution."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import floor, log10

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.patheffects import withStroke

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError
from mapfilter.report.canvas import BLACK, GREY, STREET

Bounds = tuple[float, float, float, float]

HALO = (withStroke(linewidth=2.5, foreground="white"),)
"""White rim that keeps text and marks readable on any ground."""

_KILOMETRE_FROM_M = 1500.0
_MOST_PX = 2400


@dataclass(frozen=True, slots=True, eq=False)
class BaseMap:
    """What lies under the data of a map picture; all in metres of one projected CRS.

    Parameters
    ----------
    bounds_m : (west, south, east, north)
        Extent of the area; its south-western corner is the local origin of the axes.
    streets : tuple of (k, 2) arrays
        Lines as east, north.
    points_m : (n, 2) array or None
        Places where one can be, as east, north, on a lattice; drawn as pale pixels.
    resolution_m : float
        Distance between neighbouring points.
    attribution : str
        Whose map it is, such as "© OpenStreetMap contributors"; drawn small in a corner.

    Raises
    ------
    InputError
        The extent is not finite or is empty.
    """

    bounds_m: Bounds
    streets: tuple[Floats, ...] = ()
    points_m: Floats | None = None
    attribution: str = ""
    resolution_m: float = 5.0

    def __post_init__(self) -> None:
        west, south, east, north = self.bounds_m
        faults = Faults()
        if not np.isfinite(self.bounds_m).all():
            faults.add("map extent", "four finite numbers", self.bounds_m)
        elif west >= east or south >= north:
            faults.add("map extent", "west < east and south < north", self.bounds_m)
        if not (np.isfinite(self.resolution_m) and self.resolution_m > 0):
            faults.add("map resolution", "metres > 0", self.resolution_m)
        faults.raise_if_any(InputError)

    @property
    def aspect(self) -> float:
        """Height over width of the extent."""
        west, south, east, north = self.bounds_m
        return (north - south) / (east - west)

    def zoomed(self, bounds_m: Bounds) -> BaseMap:
        """Return the same map with another extent (and so another local origin)."""
        return replace(self, bounds_m=bounds_m)


@dataclass(frozen=True, slots=True)
class LocalFrame:
    """Turns metres of the CRS into the units of the axes: m or km from the local origin."""

    west_m: float
    south_m: float
    unit_m: float

    def __call__(self, east_m: Floats, north_m: Floats) -> tuple[Floats, Floats]:
        """Return east and north in the units of the axes."""
        return (
            (np.asarray(east_m, dtype=np.float64) - self.west_m) / self.unit_m,
            (np.asarray(north_m, dtype=np.float64) - self.south_m) / self.unit_m,
        )


def map_height_in(base: BaseMap, width_in: float) -> float:
    """Return the height of a map ``width_in`` wide, kept within what still reads well."""
    return float(np.clip(width_in * base.aspect, 0.45 * width_in, 1.6 * width_in))


def draw_base(
    axes: Axes, base: BaseMap, *, streets: str = STREET, scale_bar: bool = True
) -> LocalFrame:
    """Draw streets and points, set extent and labels, and add scale bar and north arrow.

    Parameters
    ----------
    axes : Axes
        Empty axes.
    base : BaseMap
    streets : str
        Colour of the streets.
    scale_bar : bool
        Whether to draw the scale bar and the north arrow.

    Returns
    -------
    LocalFrame
        By which data are put onto the axes.
    """
    west, south, east, north = base.bounds_m
    in_km = max(east - west, north - south) > _KILOMETRE_FROM_M
    frame = LocalFrame(west, south, 1000.0 if in_km else 1.0)
    if base.points_m is not None and len(base.points_m):
        _draw_points(axes, frame, base.points_m, base.resolution_m)
    lines = [np.column_stack(frame(line[:, 0], line[:, 1])) for line in base.streets]
    if lines:
        axes.add_collection(LineCollection(lines, colors=streets, linewidths=0.6, zorder=1.5))
    axes.set_xlim(0.0, (east - west) / frame.unit_m)
    axes.set_ylim(0.0, (north - south) / frame.unit_m)
    axes.set_aspect("equal")
    unit = "km" if in_km else "m"
    axes.set_xlabel(f"east of local origin / {unit}")
    axes.set_ylabel(f"north of local origin / {unit}")
    axes.tick_params(length=3)
    if scale_bar:
        _draw_scale_bar(axes, east - west)
        _draw_north(axes)
    return frame


def attribute(axes: Axes, base: BaseMap) -> None:
    """Write whose map it is into the lower right corner."""
    if base.attribution:
        axes.text(
            0.992, 0.01, base.attribution, transform=axes.transAxes, ha="right", va="bottom",
            fontsize=6.5, color=GREY, path_effects=list(HALO), zorder=20,
        )  # fmt: skip


def _draw_points(axes: Axes, frame: LocalFrame, points_m: Floats, resolution_m: float) -> None:
    """Draw points as the pixels that they are the centres of; of large areas, as larger pixels."""
    low = points_m.min(axis=0) - resolution_m / 2
    side_m = max(resolution_m, float(np.ptp(points_m, axis=0).max()) / _MOST_PX)
    col, row = ((points_m - low) / side_m).astype(np.int64).T
    pixels = np.zeros((int(row.max()) + 1, int(col.max()) + 1, 4), dtype=np.float32)
    pixels[..., :3] = to_rgb(STREET)
    pixels[row, col, 3] = 0.75
    x, y = frame(*np.transpose([low, low + side_m * np.array(pixels.shape[1::-1])]))
    axes.imshow(pixels, extent=(x[0], x[1], y[0], y[1]), origin="lower", zorder=1)


def _draw_scale_bar(axes: Axes, width_m: float) -> None:
    length_m = _round_length_m(width_m / 4)
    text = f"{length_m / 1000:g} km" if length_m >= 1000 else f"{length_m:g} m"
    share = length_m / width_m
    x = np.array([0.04, 0.04 + share])
    axes.plot(
        x, [0.045, 0.045], transform=axes.transAxes, color=BLACK, linewidth=2.5,
        solid_capstyle="butt", path_effects=[withStroke(linewidth=5, foreground="white")],
        zorder=19,
    )  # fmt: skip
    axes.text(
        float(x.mean()), 0.06, text, transform=axes.transAxes, ha="center", va="bottom",
        fontsize=8.5, path_effects=list(HALO), zorder=19,
    )  # fmt: skip


def _draw_north(axes: Axes) -> None:
    axes.annotate(
        "N", xy=(0.96, 0.985), xytext=(0, -38), xycoords="axes fraction",
        textcoords="offset points", ha="center", va="center", fontsize=9.5, fontweight="bold",
        arrowprops={"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.4, "shrinkA": 1},
        path_effects=list(HALO), zorder=19,
    )  # fmt: skip


def _round_length_m(at_most_m: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is not longer."""
    power = 10.0 ** floor(log10(at_most_m))
    return next(factor * power for factor in (5.0, 2.0, 1.0) if factor * power <= at_most_m)
