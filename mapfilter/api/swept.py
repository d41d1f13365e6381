"""Results of a sweep: a table, and pictures of its figures."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Literal

import pandas as pd

from mapfilter._arguments import Argument, Setting, check_arguments
from mapfilter._words import number_of
from mapfilter.errors import ConfigError, fail, listed
from mapfilter.evaluation.paired import paired_cells
from mapfilter.evaluation.success_cells import HEADING, READING, success_cells
from mapfilter.experiments.sweep.table import SCHEMA

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SweepFigure = Literal[
    "success",
    "coverage_95",
    "radius_95_median_m",
    "error_at_switch_m",
    "error_mean_m",
    "switch_distance_m",
]
_RUN_TITLES = {
    "error_at_switch_m": "Errors at the switch",
    "error_mean_m": "Errors after the switch",
    "switch_distance_m": "Distances to the switch",
}


@dataclass(frozen=True, repr=False, eq=False)
class Sweep:
    """Results of a sweep.

    Parameters
    ----------
    runs : DataFrame
        One row for each run, see :data:`mapfilter.experiments.sweep.table.SCHEMA`; also some of
        them, or as they were kept in a file.

    Raises
    ------
    ConfigError
        It is no table, or lacks a column.
    """

    runs: pd.DataFrame

    def __post_init__(self) -> None:
        check_arguments(
            "Sweep", Argument("runs", self.runs, pd.DataFrame, "a table such as runs of a sweep")
        )
        lacking = [name for name in SCHEMA.names if name not in self.runs.columns]
        if lacking:
            expected = "the columns of mapfilter.experiments.sweep.table.SCHEMA"
            raise fail(ConfigError, "Sweep, runs", expected, f"no {listed(lacking)}")

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

    def compare(self, baseline: str) -> pd.DataFrame:
        """Return what each other filter gains over one of them, one row for each grid cell.

        All filters locate the same logs, so their difference is known better than from the
        intervals of each. Columns are those of :class:`mapfilter.evaluation.paired.PairedCell`:
        ``success`` with ``success_low``, ``success_high`` is the difference of the success rates
        with its 95 % interval for these routes, ``success_routes_low``, ``success_routes_high`` for
        all routes of the area. Where the interval holds 0 the sweep does not tell which is better.

        Parameters
        ----------
        baseline : str
            Name of the filter that the others are compared with, as given to :func:`sweep`.

        Raises
        ------
        ConfigError
            The sweep has no filter of that name, or no other one.

        Examples
        --------
        See :doc:`/notebooks/own-filter-and-sweep`.
        """
        names = list(dict.fromkeys(self.runs[READING]))
        if baseline not in names or len(names) == 1:
            expected = f"one of {', '.join(map(repr, names))}, beside another filter"
            raise fail(ConfigError, "compare, baseline", expected, repr(baseline))
        return pd.DataFrame([pair.row for pair in paired_cells(self.runs, baseline)])

    def plot(self, ax: Axes | None = None, *, figure: SweepFigure = "success") -> Axes:
        """Draw a figure over the deviation of headings, or over another value that differs.

        There is a curve for each filter, and for each other noise or option that differs. With one
        deviation of headings the first of these is drawn along the axis; where nothing but the
        filters differs, they stand side by side. Errors and distances of the runs are cumulative
        distributions, one for each filter over all of its runs.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; a new figure when left out.
        figure : str
            "success", "coverage_95" or "radius_95_median_m" of :meth:`to_dataframe`, or
            "error_at_switch_m", "error_mean_m" or "switch_distance_m" of ``runs``.

        Raises
        ------
        ConfigError
            There is no such figure, what is given are no axes, or no filter of the sweep claimed a
            position with a radius.
        """
        from mapfilter.report import claimed_radii
        from mapfilter.report.run_distributions import plot_run_distribution
        from mapfilter.report.success import curve_axis, plot_success_curves, success_curves

        check_arguments("plot", keywords=[Setting("figure", figure, SweepFigure)])
        if figure in ("error_at_switch_m", "error_mean_m", "switch_distance_m"):
            groups = [(str(name), rows) for name, rows in self.runs.groupby(READING, sort=False)]
            return plot_run_distribution(groups, figure, ax, title=_RUN_TITLES[figure])
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
