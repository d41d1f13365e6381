"""Results of a sweep: a table, and pictures of its figures."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Literal

import pandas as pd

from mapfilter._arguments import Setting, check_arguments
from mapfilter._words import number_of
from mapfilter.errors import ConfigError, fail
from mapfilter.evaluation.success_cells import HEADING, READING, success_cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SweepFigure = Literal["success", "coverage_95", "radius_95_median_m"]


@dataclass(frozen=True, repr=False, eq=False)
class Sweep:
    """Results of a sweep.

    Parameters
    ----------
    runs : DataFrame
        One row for each run, see :data:`mapfilter.experiments.sweep.table.SCHEMA`.
    """

    runs: pd.DataFrame

    def __repr__(self) -> str:
        runs = number_of(len(self.runs), "run")
        return f"Sweep: {runs} in {number_of(len(success_cells(self.runs)), 'cell')} of its grid"

    def _repr_html_(self) -> str:
        """Return the summary and the success rates, as notebooks show them."""
        return f"<p>{escape(repr(self))}</p>{self.to_dataframe().head(20).to_html()}"

    def to_dataframe(self) -> pd.DataFrame:
        """Return success, errors and coverage, one row for each grid cell.

        Errors are those of the successful runs alone: a filter that is mostly ``wrong`` may have
        the smallest ones. Compare ``success`` and ``wrong`` first. ``coverage_95`` and
        ``radius_95_median_m`` are of what all runs claimed. Shares have 95 % intervals.

        Columns are those of :class:`mapfilter.evaluation.success_cells.SuccessCell`, with one for
        each varied option in place of ``varied``, named by its key as in ``runs``.
        """
        return pd.DataFrame([cell.row for cell in success_cells(self.runs)])

    def plot(self, ax: Axes | None = None, *, figure: SweepFigure = "success") -> Axes:
        """Draw a figure over the deviation of headings, or over another value that differs.

        There is a curve for each filter, and for each other noise or option that differs. With one
        deviation of headings the first of these is drawn along the axis; where nothing but the
        filters differs, they stand side by side.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; a new figure when left out.
        figure : {"success", "coverage_95", "radius_95_median_m"}
            The column of :meth:`to_dataframe` that is drawn.

        Raises
        ------
        ConfigError
            There is no such figure, or no filter of the sweep claimed a position with a radius.
        """
        from mapfilter.report import claimed_radii
        from mapfilter.report.success import curve_axis, plot_success_curves, success_curves

        check_arguments("plot", keywords=[Setting("figure", figure, SweepFigure)])
        cells = success_cells(self.runs)
        if figure != "success" and not claimed_radii.have_radii(cells):
            expected = "'success', as no position with a radius was claimed"
            raise fail(ConfigError, "plot, figure", expected, figure)
        draw, name = {
            "success": (plot_success_curves, "Success"),
            "coverage_95": (claimed_radii.plot_coverage_curves, "Coverage of the 95 % radius"),
            "radius_95_median_m": (claimed_radii.plot_radius_curves, "95 % radius"),
        }[figure]
        axis = curve_axis(cells)
        over = "the noise of headings" if axis == HEADING else axis
        title = f"{name} of filters" if axis == READING else f"{name} over {over}"
        return draw(success_curves(cells, axis), ax, title=title, axis=axis)
