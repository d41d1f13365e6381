"""Cumulative distributions of the errors and switch distances of a sweep's runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M
from mapfilter.report.canvas import (
    GREY,
    VERMILLION,
    Look,
    bottom_legend,
    distinct_colours,
    draw_shares,
    legend,
    new_figure,
    single_axes,
    styled,
    tidy,
)

_SIZE_IN, _THREE_SIZE_IN = (8.4, 5.2), (11.0, 4.6)
_FARTHEST_M = 200.0

Groups = Sequence[tuple[str, pd.DataFrame]]
RunFigure = Literal["error_at_switch_m", "error_mean_m", "switch_distance_m"]


@styled
def plot_run_distributions(groups: Groups, *, title: str) -> Figure:
    """Draw three cumulative distributions for each group of runs.

    The error at the switch and the distance to the switch are shares of *all* runs: a curve that
    ends below 100 % shows how many never switched; what lies beyond 50 m switched wrongly. The
    mean error after the switch is that of the successful runs. A group is a name and the rows of a
    sweep's table.
    """
    figure = new_figure(*_THREE_SIZE_IN)
    for axes, draw in zip(figure.subplots(1, 3), _DRAWN.values(), strict=True):
        draw(axes, groups)
    figure.suptitle(title, fontsize=11)
    # All panels have the same curves: each is named once.
    bottom_legend(figure, 4, figure.axes[0].get_legend_handles_labels()[0])
    return figure


@styled
def plot_run_distribution(
    groups: Groups, figure: RunFigure, ax: Axes | None = None, *, title: str
) -> Axes:
    """Draw one of the distributions of :func:`plot_run_distributions`."""
    axes = single_axes(ax, *_SIZE_IN)
    _DRAWN[figure](axes, groups)
    axes.set_title(title)
    legend(axes, ax, 3)
    return axes


def _draw_error_at_switch(axes: Axes, groups: Groups) -> None:
    _draw(axes, groups, "error_at_switch_m", "error at the switch / m")
    axes.axvline(SUCCESS_RADIUS_M, color=VERMILLION, linestyle=(0, (5, 3)), linewidth=1.1)
    axes.text(SUCCESS_RADIUS_M + 3, 2, f"{SUCCESS_RADIUS_M:.0f} m", color=GREY, fontsize=8.5)
    axes.set_xlim(0, _FARTHEST_M)


def _draw_error(axes: Axes, groups: Groups) -> None:
    right = [(name, rows[rows["success"]]) for name, rows in groups]
    _draw(axes, right, "error_mean_m", "mean error after the switch / m", "successful")


def _draw_distance(axes: Axes, groups: Groups) -> None:
    _draw(axes, groups, "switch_distance_m", "distance travelled to the switch / m")


def _draw(axes: Axes, groups: Groups, column: str, label: str, of: str = "all") -> None:
    none = "no run succeeded" if of == "successful" else "no run switched"
    for (name, rows), colour in zip(groups, distinct_colours(len(groups)), strict=True):
        look = Look(color=colour, linewidth=1.3)
        shown = name if rows[column].notna().any() else f"{name}: {none}"
        draw_shares(axes, rows[column], label=shown, **look)
    axes.set(xlabel=label, ylabel=f"share of {of} runs / %", ylim=(0, 101))
    axes.set_xlim(left=0)
    if not any(rows[column].notna().any() for _, rows in groups):
        axes.text(0.5, 0.5, none, transform=axes.transAxes, ha="center", color=GREY)
        axes.set_xticks([])
    tidy(axes)


_DRAWN: dict[RunFigure, Callable[[Axes, Groups], None]] = {
    "error_at_switch_m": _draw_error_at_switch,
    "error_mean_m": _draw_error,
    "switch_distance_m": _draw_distance,
}
