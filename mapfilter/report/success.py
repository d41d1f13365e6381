"""Success over the noise of headings, in the manner of Khalaf-Allah (2007), Fig. 5."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from mapfilter._types import Floats
from mapfilter.evaluation.success_cells import HEADING, READING, SuccessCell, axes_of
from mapfilter.report.canvas import (
    BLACK,
    Look,
    distinct_colours,
    figure_of,
    legend,
    single_axes,
    styled,
    tidy,
)

_SIZE_IN = (8.4, 5.2)
_MOST_TICKS = 8
_LABELS = {
    HEADING: "standard deviation of the heading / °",
    "sigma_trans_m": "standard deviation of a step / m",
    "bias_sd_deg": "standard deviation of the heading's constant error / °",
    "drift_deg_per_sqrt_s": "random walk of the heading error / (°/√s)",
    "scale": "standard deviation of the step scale",
    "prediction_error_db": "error of the predicted levels / dB",
    "report_period_s": "time between reports / s",
    "imu_period_s": "time between rows of dead reckoning / s",
    "update_length_m": "length of updates / m",
    READING: "filter",
}
_UNITS = {
    "prediction_error_db": "prediction error {:g} dB",
    "report_period_s": "reports every {:g} s",
    "imu_period_s": "dead reckoning every {:g} s",
    "update_length_m": "updates of {:g} m",
    "sigma_trans_m": "step {:g} m",
    "bias_sd_deg": "bias {:g}°",
    "drift_deg_per_sqrt_s": "drift {:g}°/√s",
    "scale": "scale {:g}",
}


def place_words(at: Mapping[str, Any], axes: Iterable[str]) -> Iterator[str]:
    """Yield words for a place in a grid, by some of its coordinates."""
    for axis in axes:
        if axis in _UNITS and pd.notna(at[axis]):
            yield _UNITS[axis].format(at[axis])
        elif axis in ("database", "radio"):
            yield str(at[axis])
        elif "." in axis:
            yield f"{axis} {at[axis]:g}"


def curve_axis(cells: Sequence[SuccessCell]) -> str:
    """Return the coordinate over which the curves of a grid are drawn.

    The noise of headings where it differs, else the first number that does for cells of one filter;
    ``reading`` where there is none.
    """
    axes = axes_of(cells, by_reading=True)
    if not axes or HEADING in axes:
        return HEADING
    numbers = [axis for axis in axes if axis in _UNITS or "." in axis]
    known = [axis for axis in numbers if all(pd.notna(cell.place[axis]) for cell in cells)]
    return known[0] if known else READING


def success_curves(
    cells: Sequence[SuccessCell], over: str = HEADING
) -> list[tuple[str, list[SuccessCell]]]:
    """Return the curves of a grid over one of its coordinates, each with its name.

    Cells of one curve differ in that coordinate alone; filters name the curves, and the other
    coordinates in which cells of one filter differ.
    """
    axes = axes_of(cells, by_reading=True)
    # An option of dead reckoning that is varied stands for its own column, none of a filter does.
    axes = [one for one in axes if over not in (one, one.partition(".")[2])]
    curves: dict[str, list[SuccessCell]] = {}
    for cell in cells:
        name = ", ".join([cell.reading, *place_words(cell.place, axes)])
        curves.setdefault(name, []).append(cell)
    return list(curves.items())


@styled
def plot_success_curves(
    curves: Sequence[tuple[str, Sequence[SuccessCell]]],
    ax: Axes | None = None,
    *,
    title: str,
    claims: Sequence[tuple[float, float]] = (),
    claimant: str = "",
    axis: str = HEADING,
) -> Axes:
    """Draw a curve of success over a coordinate of the grid for each of several groups.

    Parameters
    ----------
    curves : sequence of (str, sequence of SuccessCell)
        A name and the cells along the curve; bars are Wilson intervals.
    claims : sequence of (float, float)
        Published: more than this share of success (0 to 1), the second, up to a deviation of
        headings in degrees, the first. Drawn as steps; what lies above them agrees.
    claimant : str
        Who claims, for the legend.
    axis : str
        The coordinate, as :func:`curve_axis` returns it. Over ``reading`` the curves, of one cell
        each, stand side by side.
    """
    axes = single_axes(ax, *_SIZE_IN)
    words = ", ".join(f"over {100 * share:.0f} % up to {deg:g}°" for deg, share in claims)
    name: str | None = f"{claimant}: {words}"
    for deg, share in claims:
        line = Look(linewidth=2.6, linestyle=(0, (3, 1.2)))
        axes.plot([0.0, deg], [100 * share] * 2, color=BLACK, zorder=4, label=name, **line)
        end = Look(marker="|", markersize=11, markeredgewidth=2.6)
        axes.plot([deg], [100 * share], color=BLACK, zorder=4, **end)
        name = None
    draw_curves(axes, curves, axis, lambda one: (one.success, one.low, one.high), 100)
    axes.set(ylabel="successful global positioning / %", ylim=(0, 102), title=title)
    legend(axes, ax, 3)
    return axes


def draw_curves(
    axes: Axes,
    curves: Sequence[tuple[str, Sequence[SuccessCell]]],
    axis: str,
    figure_of_cell: Callable[[SuccessCell], tuple[float, float, float]],
    factor: float = 1.0,
) -> None:
    """Draw a figure of cells over a coordinate of the grid, a curve for each group.

    Parameters
    ----------
    curves, axis
        As for :func:`plot_success_curves`.
    figure_of_cell : callable
        Returns the figure of a cell, and the ends of its interval; NaN where there is none.
    factor : float
        Of figures in the unit of the axis.
    """
    places, shifts = _across(curves, axis)
    bars = {"marker": "o", "markersize": 4, "linewidth": 1.4, "elinewidth": 0.9, "capsize": 2}
    colours = distinct_colours(len(curves))
    for (label, cells), at, shift, colour in zip(curves, places, shifts, colours, strict=True):
        order = np.argsort(at, kind="stable")
        found = factor * np.array([figure_of_cell(cells[index]) for index in order]).reshape(-1, 3)
        value, low, high = found.T
        error = np.abs(np.array([value - low, high - value]))
        look = Look(yerr=error, color=colour, label=label) | bars
        axes.errorbar(at[order] + shift, value, **look)
    axes.set_xlabel(_LABELS.get(axis, axis))
    if axis != HEADING:
        _mark(axes, [name for name, _ in curves], places, axis)
    tidy(axes)


def _across(curves: Sequence[tuple[str, Sequence[SuccessCell]]], axis: str) -> tuple[Any, Any]:
    """Return the places of each curve's cells, and its shift.

    Bars of curves that lie on each other stand side by side.
    """
    if axis == READING:
        return [np.full(len(cells), float(n)) for n, (_, cells) in enumerate(curves)], np.zeros(
            len(curves)
        )
    places = [np.array([float(cell.place[axis]) for cell in cells]) for _, cells in curves]
    every = np.concatenate([*places, [0.0]])
    # Headings are drawn from 0 degrees on.
    widest = max(float(every.max()), 1.0) if axis == HEADING else float(np.ptp(every[:-1]))
    apart = min(0.012, 0.06 / max(len(curves), 1)) * widest
    return places, apart * (np.arange(len(curves)) - (len(curves) - 1) / 2)


def _mark(axes: Axes, names: Sequence[str], places: Sequence[Floats], axis: str) -> None:
    """Put a tick at each value that was simulated, or at each name, while they can be read."""
    if axis == READING:
        axes.set_xticks(range(len(names)), names)
        axes.set_xlim(-0.5, max(len(names), 1) - 0.5)
        return
    values = np.unique(np.concatenate(places)).tolist()
    if len(values) <= _MOST_TICKS:
        axes.set_xticks(values, [f"{value:g}" for value in values])


@styled
def plot_success_map(cells: Sequence[SuccessCell], ax: Axes | None = None, *, title: str) -> Axes:
    """Draw success by the deviations of headings (across) and of steps (upwards), one cell each."""
    orient = sorted({cell.sigma_orient_deg for cell in cells})
    trans = sorted({cell.sigma_trans_m for cell in cells})
    share = np.full((len(trans), len(orient)), np.nan)
    for cell in cells:
        place = trans.index(cell.sigma_trans_m), orient.index(cell.sigma_orient_deg)
        share[place] = 100 * cell.success
    axes = single_axes(ax, max(2.8 + 0.8 * len(orient), 6.0), max(1.9 + 0.55 * len(trans), 3.2))
    image = axes.imshow(share, origin="lower", cmap="viridis", vmin=0, vmax=100, aspect="auto")
    for (row, col), percent in np.ndenumerate(share):
        if np.isfinite(percent):
            colour = "black" if percent > 55 else "white"
            axes.text(col, row, f"{percent:.0f}", ha="center", va="center", color=colour)
    axes.set_xticks(range(len(orient)), [f"{value:g}" for value in orient])
    axes.set_yticks(range(len(trans)), [f"{value:g}" for value in trans])
    axes.set(xlabel="standard deviation of the heading / °", title=title)
    axes.set_ylabel("standard deviation of a step / m")
    figure_of(axes).colorbar(image, ax=axes, label="success / %")
    return axes
