"""How errors and switch distances of many runs are distributed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M
from mapfilter.report.canvas import GREY, VERMILLION, bottom_legend, distinct_colours, picture

_SIZE_IN = (11.0, 4.6)
_FARTHEST_M = 200.0


def plot_run_distributions(
    groups: Sequence[tuple[str, pd.DataFrame]], path: Path, *, title: str
) -> None:
    """Draw three cumulative distributions for each group of runs.

    The error at the switch and the distance to the switch are shares of *all* runs: a curve that
    ends below 100 % tells how many never switched; what lies beyond 50 m switched wrongly. The
    mean error after the switch is that of the successful runs.

    Parameters
    ----------
    groups : sequence of (str, pandas.DataFrame)
        A name and the rows of a sweep's table.
    path : Path
        PNG to write.
    title : str

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    with picture(path, *_SIZE_IN) as figure:
        at_switch, after, distance = figure.subplots(1, 3)
        for (name, rows), colour in zip(groups, distinct_colours(len(groups)), strict=True):
            right = rows[rows["success"]]
            _draw(at_switch, rows["error_at_switch_m"], len(rows), colour, name)
            _draw(after, right["error_mean_m"], len(right), colour, "")
            _draw(distance, rows["switch_distance_m"], len(rows), colour, "")
        at_switch.axvline(SUCCESS_RADIUS_M, color=VERMILLION, linestyle=(0, (5, 3)), linewidth=1.1)
        at_switch.text(
            SUCCESS_RADIUS_M + 3, 2, f"{SUCCESS_RADIUS_M:.0f} m", color=GREY, fontsize=8.5
        )
        at_switch.set_xlim(0, _FARTHEST_M)
        at_switch.set_ylabel("share of all runs / %")
        after.set_ylabel("share of successful runs / %")
        distance.set_ylabel("share of all runs / %")
        for axes, label in (
            (at_switch, "error at the switch / m"),
            (after, "mean error after the switch / m"),
            (distance, "distance travelled to the switch / m"),
        ):
            axes.set_xlabel(label)
            axes.set_xlim(left=0)
            axes.set_ylim(0, 101)
            axes.grid(color="#e8e8e8", linewidth=0.7)
            axes.set_axisbelow(True)
            axes.spines[["top", "right"]].set_visible(False)
        figure.suptitle(title, fontsize=11)
        if groups:
            bottom_legend(figure, 4)


def _draw(axes: Axes, values: pd.Series, total: int, colour: str, name: str) -> None:
    known = np.sort(values.dropna().to_numpy(dtype=np.float64))
    if not known.size:
        axes.plot([], [], color=colour, label=name or None)
        return
    share = 100 * np.arange(1, known.size + 1) / total
    axes.step(
        np.concatenate([[0.0], known]), np.concatenate([[0.0], share]), where="post",
        color=colour, linewidth=1.3, label=name or None,
    )  # fmt: skip
