"""Errors over time beside their bounds, and the scene of a network with satellites."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter

from mapfilter._types import Bools, Floats
from mapfilter.report.canvas import BLACK, BLUE, GREY, ORANGE, VERMILLION, picture


@dataclass(frozen=True, eq=False)
class Curve:
    """One line of a panel.

    Parameters
    ----------
    name : str
        In the legend.
    values : (K,) array
        At k = 1 ... K.
    colour : str
    style : str
        Solid for filters, dashed for bounds.
    """

    name: str
    values: Floats
    colour: str
    style: str = "-"


@dataclass(frozen=True, eq=False)
class Panel:
    """One pair of axes.

    Parameters
    ----------
    title, label : str
        Label of the upright axis.
    curves : sequence of Curve
    logarithmic : bool
    top, bottom : float or None
        Ends of the upright axis.
    """

    title: str
    label: str
    curves: Sequence[Curve]
    logarithmic: bool = False
    top: float | None = None
    bottom: float | None = 0.0


def plot_error_panels(
    panels: Sequence[Panel],
    path: Path,
    *,
    title: str,
    columns: int = 2,
    across: str = "time index k",
    shaded: tuple[str, Bools] | None = None,
) -> None:
    """Draw errors over the time index in panels side by side; ``across`` says what it counts.

    Some indices may be ``shaded``, under a name.

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    columns = min(columns, len(panels))
    rows = -(-len(panels) // columns)
    with picture(path, 5.6 * columns, 3.7 * rows + 0.7) as figure:
        axes = figure.subplots(rows, columns, squeeze=False).ravel()
        for one, panel in zip(axes, panels, strict=False):
            _draw_panel(one, panel, across)
            if shaded is not None:
                _shade(one, *shaded)
        for spare in axes[len(panels) :]:
            spare.remove()
        figure.suptitle(title, fontsize=12)
        known: dict[str, Artist] = {}
        for one in axes[: len(panels)]:
            for handle, name in zip(*one.get_legend_handles_labels(), strict=True):
                known.setdefault(name, handle)
        figure.legend(
            list(known.values()), list(known), loc="outside lower center", frameon=False,
            ncols=min(len(known), 3 * columns),
        )  # fmt: skip


def _draw_panel(axes: Axes, panel: Panel, across: str) -> None:
    for curve in panel.curves:
        k = np.arange(1, curve.values.size + 1)
        axes.plot(
            k, curve.values, color=curve.colour, linestyle=curve.style, label=curve.name,
            linewidth=1.2 if curve.style == "-" else 1.6,
        )  # fmt: skip
    axes.set_xlim(0, max(curve.values.size for curve in panel.curves))
    if panel.logarithmic:
        axes.set_yscale("log")
        # Powers would need mathematical text, which pictures here go without.
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_formatter(FuncFormatter(_minor_label))
    else:
        axes.set_ylim(panel.bottom, panel.top)
    axes.set_title(panel.title)
    axes.set_xlabel(across)
    axes.set_ylabel(panel.label)
    axes.grid(color="#e6e6e6", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)


def _shade(axes: Axes, name: str, where: Bools) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], where, [0]]).astype(np.int8)))
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        axes.axvspan(first + 0.5, end + 0.5, color="#f3ddd0", linewidth=0, zorder=0, label=name)


def _minor_label(value: float, _: object) -> str:
    """Label twos and fives of each decade."""
    leading = f"{value:e}"[0]
    return f"{value:g}" if leading in "25" else ""


def plot_scene(
    sites_m: Sequence[tuple[float, float]],
    boresights_deg: Sequence[float],
    serving: int,
    satellite_azimuths_deg: Sequence[float],
    track_m: Floats,
    path: Path,
    *,
    title: str,
) -> None:
    """Draw base stations with their directions, the satellites' directions and a track.

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    sites, angles = np.array(sites_m), np.radians(boresights_deg)
    with picture(path, 6.4, 6.4) as figure:
        axes = figure.subplots()
        # A little to the side, so that the arrow's foot stays on its site.
        axes.quiver(
            sites[:, 0], sites[:, 1], np.cos(angles), np.sin(angles), color=BLUE, angles="xy",
            scale_units="xy", scale=1 / 330.0, width=0.006,
        )  # fmt: skip
        axes.plot(sites[:, 0], sites[:, 1], "o", color=BLACK, markersize=7, label="base station")
        axes.plot(
            *sites[serving], "o", color=VERMILLION, markersize=10, label="serving base station"
        )
        axes.plot(track_m[:, 0], track_m[:, 1], color=ORANGE, linewidth=2, label="car")
        axes.plot(*track_m[0], "s", color=ORANGE, markersize=7)
        together = np.vstack([sites, track_m])
        low, high = together.min(axis=0) - 700.0, together.max(axis=0) + 700.0
        side = float(np.max(high - low)) / 2
        middle = (low + high) / 2
        axes.set_xlim(middle[0] - side, middle[0] + side)
        axes.set_ylim(middle[1] - side, middle[1] + side)
        for index, azimuth_deg in enumerate(satellite_azimuths_deg, start=1):
            azimuth = np.radians(azimuth_deg)
            ray = np.array([np.sin(azimuth), np.cos(azimuth)])
            tip, foot = middle + 0.97 * side * ray, middle + 0.85 * side * ray
            axes.annotate("", tip, foot, arrowprops={"arrowstyle": "->", "color": GREY})
            axes.annotate(
                f"to satellite {index}", tip, (8, 0), textcoords="offset points", color=GREY,
                ha="left", va="center", fontsize=9,
            )  # fmt: skip
        axes.set_aspect("equal")
        axes.set_xlabel("east / m")
        axes.set_ylabel("north / m")
        axes.set_title(title)
        axes.legend(loc="lower right")


def curves_of(
    found: Mapping[str, Floats], names: Mapping[str, tuple[str, str, str]]
) -> list[Curve]:
    """Return the curves that there are, with name, colour and style of each by its key."""
    return [
        Curve(name, found[key], colour, style)
        for key, (name, colour, style) in names.items()
        if key in found
    ]
