"""How well the 95 % radius of what was claimed holds, and how large it is, over a sweep's grid."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import isfinite, nan

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mapfilter.evaluation.success_cells import HEADING, SuccessCell
from mapfilter.report.canvas import (
    GREY,
    bottom_legend,
    legend,
    new_figure,
    single_axes,
    styled,
)
from mapfilter.report.success import draw_curves

_SIZE_IN = (8.4, 5.2)
_BOTH_SIZE_IN = (11.0, 4.8)
_WANTED = 95.0
_ABOVE = 1.08

Curves = Sequence[tuple[str, Sequence[SuccessCell]]]


def have_radii(cells: Sequence[SuccessCell]) -> bool:
    """Return whether a filter of a sweep claimed a position with a radius."""
    return any(isfinite(cell.coverage_95) for cell in cells)


@styled
def plot_coverage_curves(
    curves: Curves, ax: Axes | None = None, *, title: str, axis: str = HEADING
) -> Axes:
    """Draw how often the 95 % radius of claimed positions held the truth, with its intervals.

    Parameters are those of :func:`mapfilter.report.success.plot_success_curves`.
    """
    return _alone(_draw_coverage, curves, ax, title, axis)


@styled
def plot_radius_curves(
    curves: Curves, ax: Axes | None = None, *, title: str, axis: str = HEADING
) -> Axes:
    """Draw the median 95 % radius of claimed positions.

    Parameters are those of :func:`mapfilter.report.success.plot_success_curves`.
    """
    return _alone(_draw_radius, curves, ax, title, axis)


@styled
def plot_claimed_radii(curves: Curves, *, title: str, axis: str = HEADING) -> Figure:
    """Draw coverage and median of the 95 % radius side by side.

    Parameters are those of :func:`mapfilter.report.success.plot_success_curves`.
    """
    figure = new_figure(*_BOTH_SIZE_IN)
    coverage, radius = figure.subplots(1, 2)
    _draw_coverage(coverage, curves, axis)
    _draw_radius(radius, curves, axis)
    figure.suptitle(title, fontsize=11)
    # Both panels have the same curves: each is named once.
    bottom_legend(figure, 4, coverage.get_legend_handles_labels()[0])
    return figure


def _alone(
    draw: Callable[[Axes, Curves, str], None],
    curves: Curves,
    ax: Axes | None,
    title: str,
    axis: str,
) -> Axes:
    axes = single_axes(ax, *_SIZE_IN)
    draw(axes, curves, axis)
    axes.set_title(title)
    legend(axes, ax, 3)
    return axes


def _draw_coverage(axes: Axes, curves: Curves, axis: str) -> None:
    axes.axhline(_WANTED, color=GREY, linestyle=(0, (5, 3)), linewidth=1.1)
    draw_curves(
        axes,
        _named(curves),
        axis,
        lambda one: (one.coverage_95, one.coverage_95_low, one.coverage_95_high),
        100,
    )
    axes.set(ylabel="claimed epochs within the 95 % radius / %", ylim=(0, 102))


def _draw_radius(axes: Axes, curves: Curves, axis: str) -> None:
    draw_curves(axes, _named(curves), axis, lambda one: (one.radius_95_median_m, nan, nan))
    largest_m = max(
        (cell.radius_95_median_m for _, cells in curves for cell in cells if have_radii([cell])),
        default=1.0,
    )
    axes.set(ylabel="median 95 % radius of claimed epochs / m", ylim=(0, _ABOVE * largest_m))


def _named(curves: Curves) -> Curves:
    """Return curves, with a word on those that nothing can be drawn of."""
    return [(name if have_radii(cells) else f"{name}: no radius", cells) for name, cells in curves]
