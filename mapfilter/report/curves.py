"""Curves of errors over time and over a threshold, and scenes seen from above."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.ticker import FuncFormatter

from mapfilter._types import Bools, Floats
from mapfilter.evaluation.track_percentiles import Percentile
from mapfilter.report.canvas import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    VERMILLION,
    Look,
    bottom_legend,
    legend,
    new_figure,
    single_axes,
    stretches,
    styled,
    tidy,
)

_SIZE_IN = (7.6, 5.2)
_SHADE, _NONE = "#f3ddd0", np.zeros(0, dtype=np.bool_)
_HOUSE = "#d9d9d9"


class Curve(NamedTuple):
    """A named line of a panel: values at k = 1 ... K; solid for filters, dashed for bounds."""

    name: str
    values: Floats
    colour: str
    style: str = "-"


class Panel(NamedTuple):
    """One pair of axes; ``label``, ``top`` and ``bottom`` are of the upright axis."""

    title: str
    label: str
    curves: Sequence[Curve]
    logarithmic: bool = False
    top: float | None = None
    bottom: float | None = 0.0


@styled
def plot_error_panels(
    panels: Sequence[Panel],
    *,
    title: str,
    columns: int = 2,
    across: str = "time index k",
    shaded: tuple[str, Bools] = ("", _NONE),
) -> Figure:
    """Draw errors over the time index, at most so many panels side by side.

    ``across`` is the label of the level axis; ``shaded`` names indices, (K,), to shade.
    """
    columns = min(columns, len(panels))
    rows = -(-len(panels) // columns)
    figure = new_figure(5.6 * columns, 3.7 * rows + 0.7)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for one, panel in zip(axes, panels, strict=False):
        _draw_panel(one, panel, across)
        name, where = shaded
        for first, end in stretches(where):
            one.axvspan(first + 0.5, end + 0.5, color=_SHADE, linewidth=0, zorder=0, label=name)
    for spare in axes[len(panels) :]:
        spare.remove()
    figure.suptitle(title, fontsize=12)
    # Panels share most of their curves: each is named once.
    known: dict[str, Any] = {}
    for one in axes[: len(panels)]:
        for handle, name in zip(*one.get_legend_handles_labels(), strict=True):
            known.setdefault(name, handle)
    bottom_legend(figure, 3 * columns, list(known.values()))
    return figure


def _draw_panel(axes: Axes, panel: Panel, across: str) -> None:
    for curve in panel.curves:
        look = Look(color=curve.colour, linestyle=curve.style, label=curve.name)
        look["linewidth"] = 1.2 if curve.style == "-" else 1.6
        axes.plot(np.arange(1, curve.values.size + 1), curve.values, **look)
    axes.set_xlim(0, max(curve.values.size for curve in panel.curves))
    if panel.logarithmic:
        axes.set_yscale("log")
        # Powers would need mathematical text, which pictures here go without.
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        twos_and_fives = FuncFormatter(lambda v, _: f"{v:g}" if f"{v:e}"[0] in "25" else "")
        axes.yaxis.set_minor_formatter(twos_and_fives)
    else:
        axes.set_ylim(panel.bottom, panel.top)
    axes.set(title=panel.title, xlabel=across, ylabel=panel.label)
    tidy(axes)


def curves_of(
    found: Mapping[str, Floats], names: Mapping[str, tuple[str, str, str]]
) -> list[Curve]:
    """Return the curves that there are, with name, colour and style of each by its key."""
    return [
        Curve(name, found[key], colour, style)
        for key, (name, colour, style) in names.items()
        if key in found
    ]


class OverThreshold(NamedTuple):
    """Percentiles of errors by a threshold in dB, their intervals drawn as bands.

    ``without`` is a figure that does not depend on the threshold, drawn dashed.
    """

    name: str
    threshold_db: Sequence[float]
    found: Sequence[Percentile]
    without: Percentile
    without_name: str
    colour: str


@styled
def plot_over_threshold(
    lines: Sequence[OverThreshold],
    ax: Axes | None = None,
    *,
    title: str,
    chosen_db: float,
    bound: tuple[str, float] | None = None,
) -> Axes:
    """Draw percentiles over a threshold of the SINR, with the one that was chosen.

    ``bound`` is the name and value of a figure for comparison.
    """
    axes = single_axes(ax, *_SIZE_IN)
    for line in lines:
        at, colour = line.threshold_db, line.colour
        low, high = [one.low for one in line.found], [one.high for one in line.found]
        axes.fill_between(at, low, high, color=colour, alpha=0.16, lw=0)
        values = [one.value for one in line.found]
        axes.plot(at, values, "o-", color=colour, linewidth=1.6, markersize=5, label=line.name)
        dashed = Look(color=colour, linestyle=(0, (5, 3)), linewidth=1.3)
        axes.axhline(line.without.value, label=line.without_name, **dashed)
    if bound is not None:
        axes.axhline(bound[1], color=GREY, linewidth=1.3, label=bound[0])
    name = f"published choice, {chosen_db:g} dB".replace("-", "−")
    axes.axvline(chosen_db, color=GREY, linestyle=(0, (2, 2)), linewidth=1.1, label=name)
    axes.set_ylim(bottom=0)
    axes.set_xticks(sorted({value for line in lines for value in line.threshold_db}))
    axes.set(xlabel="SINR below which stations are dropped / dB", ylabel="90 % error / m")
    axes.set_title(title)
    tidy(axes)
    legend(axes, ax, 3)
    return axes


@styled
def plot_scene(
    sites_m: Sequence[tuple[float, float]],
    boresights_deg: Sequence[float],
    serving: int,
    satellite_azimuths_deg: Sequence[float],
    track_m: Floats,
    ax: Axes | None = None,
    *,
    title: str,
) -> Axes:
    """Draw base stations with their directions, the satellites' directions and a track.

    Sites and track are east and north in metres, boresights degrees counter-clockwise from east,
    azimuths clockwise from north; ``serving`` is the index of a site.
    """
    sites, angles = np.array(sites_m), np.radians(boresights_deg)
    axes = single_axes(ax, 6.4, 6.4)
    arrows = Look(angles="xy", scale_units="xy", scale=1 / 330.0, width=0.006)
    axes.quiver(*sites.T, np.cos(angles), np.sin(angles), color=BLUE, **arrows)
    axes.plot(*sites.T, "o", color=BLACK, markersize=7, label="base station")
    axes.plot(*sites[serving], "o", color=VERMILLION, markersize=10, label="serving base station")
    axes.plot(track_m[:, 0], track_m[:, 1], color=ORANGE, linewidth=2, label="car")
    axes.plot(*track_m[0], "s", color=ORANGE, markersize=7)
    together = np.vstack([sites, track_m])
    low, high = together.min(axis=0) - 700.0, together.max(axis=0) + 700.0
    side = float(np.max(high - low)) / 2
    middle = (low + high) / 2
    for index, azimuth_deg in enumerate(satellite_azimuths_deg, start=1):
        azimuth = np.radians(azimuth_deg)
        ray = np.array([np.sin(azimuth), np.cos(azimuth)])
        tip, foot = middle + 0.97 * side * ray, middle + 0.85 * side * ray
        axes.annotate("", tip, foot, arrowprops={"arrowstyle": "->", "color": GREY})
        name = axes.annotate(f"to satellite {index}", tip, (8, 0), textcoords="offset points")
        name.set(color=GREY, ha="left", va="center", fontsize=9)
    axes.set(xlim=middle[0] + side * np.array([-1, 1]), ylim=middle[1] + side * np.array([-1, 1]))
    axes.set(xlabel="east / m", ylabel="north / m", title=title, aspect="equal")
    axes.legend(loc="lower right")
    return axes


class SeenMap(NamedTuple):
    """Counts of satellites on a grid, (rows, cols), from the north; NaN inside buildings.

    ``extent_m`` is west, east, south, north.
    """

    title: str
    seen: Floats
    extent_m: tuple[float, float, float, float]


@styled
def plot_seen_satellites(
    maps: Sequence[SeenMap],
    houses: Sequence[shapely.Polygon],
    tracks_m: Sequence[Floats],
    *,
    title: str,
) -> Figure:
    """Draw how many satellites are seen on maps side by side, houses and tracks over them."""
    most = int(max(np.nanmax(one.seen) for one in maps))
    colours = ListedColormap(colormaps["viridis"](np.linspace(0.05, 1.0, most + 1)))
    norm = BoundaryNorm(np.arange(-0.5, most + 1), most + 1)
    figure = new_figure(5.4 * len(maps) + 0.8, 5.6)
    axes = figure.subplots(1, len(maps), squeeze=False).ravel()
    for one, drawn in zip(axes, maps, strict=True):
        look = Look(cmap=colours, norm=norm, interpolation="nearest")
        image = one.imshow(drawn.seen, extent=drawn.extent_m, **look)
        for house in houses:
            corners = shapely.get_coordinates(house.exterior)
            one.add_patch(Polygon(corners, facecolor=_HOUSE, edgecolor="white", linewidth=0.6))
        for track in tracks_m:
            one.plot(track[:, 0], track[:, 1], color=VERMILLION, linewidth=0.6, alpha=0.7)
        one.plot([], [], color=VERMILLION, linewidth=1.5, label="tracks")
        one.set(xlim=drawn.extent_m[:2], ylim=drawn.extent_m[2:], aspect="equal")
        one.set(title=drawn.title, xlabel="east / m")
    axes[0].set_ylabel("north / m")
    axes[0].legend(loc="upper left")
    bar = figure.colorbar(image, ax=list(axes), ticks=np.arange(most + 1), shrink=0.85)
    bar.set_label("satellites in line of sight")
    bar.ax.minorticks_off()
    figure.suptitle(title, fontsize=12)
    return figure
