"""How errors are distributed, with claims drawn in, and percentiles over a threshold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from mapfilter._types import Floats
from mapfilter.evaluation.track_percentiles import Percentile
from mapfilter.report.canvas import GREY, bottom_legend, picture

_SIZE_IN = (7.6, 5.2)


@dataclass(frozen=True, eq=False)
class Distribution:
    """The errors of one filter.

    Parameters
    ----------
    name : str
    errors_m : array
        NaN where it tells no position: the curve then ends below 100 %.
    colour : str
    style : str
    claim_m : float or None
        What is published for the share that is marked.
    """

    name: str
    errors_m: Floats
    colour: str
    style: str = "-"
    claim_m: float | None = None


def plot_cumulative(
    curves: Sequence[Distribution], path: Path, *, title: str, most_m: float, share: float = 0.9
) -> None:
    """Draw cumulative distributions, a line at a share, and what is claimed for it.

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    with picture(path, *_SIZE_IN) as figure:
        axes = figure.subplots()
        claimed = False
        axes.axhline(100 * share, color=GREY, linewidth=0.9, linestyle=(0, (2, 2)))
        for curve in curves:
            _draw(axes, curve)
            if curve.claim_m is not None:
                axes.plot(
                    [curve.claim_m], [100 * share], linestyle="", marker="D", markersize=8,
                    markerfacecolor="white", markeredgecolor=curve.colour, markeredgewidth=1.8,
                    zorder=5, clip_on=False,
                )  # fmt: skip
                claimed = True
        if claimed:
            axes.plot(
                [], [], linestyle="", marker="D", markersize=8, markerfacecolor="white",
                markeredgecolor=GREY, markeredgewidth=1.8, label=f"published, {100 * share:g} %",
            )  # fmt: skip
        axes.set_xlim(0, most_m)
        axes.set_ylim(0, 101)
        axes.set_xlabel("position error / m")
        axes.set_ylabel("share of epochs / %")
        _finish(axes)
        figure.suptitle(title, fontsize=11)
        bottom_legend(figure, 3)


def _draw(axes: Axes, curve: Distribution) -> None:
    values = curve.errors_m.ravel()
    known = np.sort(values[np.isfinite(values)])
    share = 100 * np.arange(1, known.size + 1) / max(values.size, 1)
    axes.plot(
        np.concatenate([[0.0], known]), np.concatenate([[0.0], share]), color=curve.colour,
        linestyle=curve.style, linewidth=1.6, label=curve.name,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class OverThreshold:
    """Percentiles of errors by a threshold.

    Parameters
    ----------
    name : str
    threshold_db : (N,) sequence of float
    found : (N,) sequence of Percentile
        The intervals are drawn as bands.
    without : Percentile
        A figure that does not depend on it, drawn dashed.
    without_name, colour : str
    """

    name: str
    threshold_db: Sequence[float]
    found: Sequence[Percentile]
    without: Percentile
    without_name: str
    colour: str


def plot_over_threshold(
    lines: Sequence[OverThreshold], path: Path, *, title: str, chosen_db: float,
    bound: tuple[str, float] | None = None,
) -> None:  # fmt: skip
    """Draw percentiles over a threshold of the SINR, with the one that was chosen.

    Parameters
    ----------
    lines : sequence of OverThreshold
    path : Path
    title : str
    chosen_db : float
    bound : (str, float), optional
        A figure for comparison, and its name.

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    with picture(path, *_SIZE_IN) as figure:
        axes = figure.subplots()
        for line in lines:
            low, high = [one.low for one in line.found], [one.high for one in line.found]
            axes.fill_between(line.threshold_db, low, high, color=line.colour, alpha=0.16, lw=0)
            axes.plot(
                line.threshold_db, [one.value for one in line.found], "o-", color=line.colour,
                linewidth=1.6, markersize=5, label=line.name,
            )  # fmt: skip
            axes.axhline(
                line.without.value, color=line.colour, linestyle=(0, (5, 3)), linewidth=1.3,
                label=line.without_name,
            )  # fmt: skip
        if bound is not None:
            axes.axhline(bound[1], color=GREY, linewidth=1.3, label=bound[0])
        axes.axvline(
            chosen_db, color=GREY, linestyle=(0, (2, 2)), linewidth=1.1,
            label=f"published choice, {chosen_db:g} dB".replace("-", "−"),
        )  # fmt: skip
        axes.set_ylim(bottom=0)
        axes.set_xticks(sorted({value for line in lines for value in line.threshold_db}))
        axes.set_xlabel("SINR below which stations are dropped / dB")
        axes.set_ylabel("90 % error / m")
        _finish(axes)
        figure.suptitle(title, fontsize=11)
        bottom_legend(figure, 3)


def _finish(axes: Axes) -> None:
    axes.grid(color="#e8e8e8", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
