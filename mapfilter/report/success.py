"""Success over the noise of headings, in the manner of Khalaf-Allah (2007), Fig. 5."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M
from mapfilter.evaluation.success import HEADING, SuccessCell, axes_of
from mapfilter.report.canvas import (
    BLACK,
    GREY,
    VERMILLION,
    Look,
    bottom_legend,
    distinct_colours,
    draw_shares,
    figure_of,
    legend,
    new_figure,
    single_axes,
    styled,
    tidy,
)

_SIZE_IN = (8.4, 5.2)
_RUNS_SIZE_IN = (11.0, 4.6)
_FARTHEST_M = 200.0
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


def success_curves(cells: Sequence[SuccessCell]) -> list[tuple[str, list[SuccessCell]]]:
    """Return the curves of a grid over the noise of headings, each with its name.

    Cells of one curve differ in that noise alone; filters name the curves, and the other
    coordinates in which cells of one filter differ.
    """
    axes = [axis for axis in axes_of(cells, by_reading=True) if axis.split(".")[-1] != HEADING]
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
) -> Axes:
    """Draw a curve of success over the deviation of headings for each of several groups.

    Parameters
    ----------
    curves : sequence of (str, sequence of SuccessCell)
        A name and the cells along the curve; bars are Wilson intervals.
    claims : sequence of (float, float)
        Published: more than this share of success (0 to 1), the second, up to a deviation of
        headings in degrees, the first. Drawn as steps; what lies above them agrees.
    claimant : str
        Who claims, for the legend.
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
    # Bars of curves that lie on each other stand side by side.
    widest = max((c.sigma_orient_deg for _, cells in curves for c in cells), default=1.0)
    apart = min(0.012, 0.06 / max(len(curves), 1)) * max(widest, 1.0)
    shifts = apart * (np.arange(len(curves)) - (len(curves) - 1) / 2)
    bars = {"marker": "o", "markersize": 4, "linewidth": 1.4, "elinewidth": 0.9, "capsize": 2}
    colours = distinct_colours(len(curves))
    for (label, cells), shift, colour in zip(curves, shifts, colours, strict=True):
        ordered = sorted(cells, key=lambda cell: cell.sigma_orient_deg)
        success = np.array([cell.success for cell in ordered])
        error = success - [c.low for c in ordered], [c.high for c in ordered] - success
        at = np.array([cell.sigma_orient_deg for cell in ordered]) + shift
        look = Look(yerr=100 * np.abs(np.array(error)), color=colour, label=label) | bars
        axes.errorbar(at, 100 * success, **look)
    axes.set(xlabel="standard deviation of the heading / °", ylim=(0, 102), title=title)
    axes.set_ylabel("successful global positioning / %")
    tidy(axes)
    legend(axes, ax, 3)
    return axes


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


@styled
def plot_run_distributions(groups: Sequence[tuple[str, pd.DataFrame]], *, title: str) -> Figure:
    """Draw three cumulative distributions for each group of runs.

    The error at the switch and the distance to the switch are shares of *all* runs: a curve that
    ends below 100 % shows how many never switched; what lies beyond 50 m switched wrongly. The
    mean error after the switch is that of the successful runs. A group is a name and the rows of a
    sweep's table.
    """
    figure = new_figure(*_RUNS_SIZE_IN)
    at_switch, after, distance = figure.subplots(1, 3)
    for (name, rows), colour in zip(groups, distinct_colours(len(groups)), strict=True):
        right = rows[rows["success"]]
        look = Look(color=colour, linewidth=1.3)
        draw_shares(at_switch, rows["error_at_switch_m"], label=name, **look)
        draw_shares(after, right["error_mean_m"], **look)
        draw_shares(distance, rows["switch_distance_m"], **look)
    at_switch.axvline(SUCCESS_RADIUS_M, color=VERMILLION, linestyle=(0, (5, 3)), linewidth=1.1)
    radius = f"{SUCCESS_RADIUS_M:.0f} m"
    at_switch.text(SUCCESS_RADIUS_M + 3, 2, radius, color=GREY, fontsize=8.5)
    for axes, label, of in (
        (at_switch, "error at the switch / m", "all"),
        (after, "mean error after the switch / m", "successful"),
        (distance, "distance travelled to the switch / m", "all"),
    ):
        axes.set(xlabel=label, ylabel=f"share of {of} runs / %", ylim=(0, 101))
        axes.set_xlim(left=0)
        tidy(axes)
    at_switch.set_xlim(0, _FARTHEST_M)
    figure.suptitle(title, fontsize=11)
    bottom_legend(figure, 4)
    return figure
