"""Errors of several replays of one journey beside each other, against time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from mapfilter.evaluation.accuracy import Truth, position_errors_m
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.report.canvas import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION, picture

_SIZE_IN = (9.0, 4.8)
_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, VERMILLION, GREY)
_SHADES = ("#eeeeee", "#f7d9c9", "#dce9f5")
_LEAST_M = 0.3


def plot_errors_over_time(
    estimates: Mapping[str, TrackEstimate],
    truth: Truth,
    path: Path,
    *,
    spans: Sequence[tuple[str, float, float]] = (),
    title: str = "",
) -> None:
    """Draw the position errors of several estimates, on a logarithmic axis.

    Parameters
    ----------
    estimates : mapping of str to TrackEstimate
        By what the legend calls them; up to six.
    truth : Truth
    path : Path
        PNG to write.
    spans : sequence of (str, float, float)
        Stretches of time to shade: what they are called, begin and end in seconds.
    title : str

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    with picture(path, *_SIZE_IN) as figure:
        axes = figure.subplots()
        for (name, begin_s, end_s), shade in zip(spans, _SHADES, strict=False):
            axes.axvspan(begin_s, end_s, color=shade, linewidth=0, zorder=0, label=name)
        for (name, estimate), colour in zip(estimates.items(), _COLOURS, strict=False):
            axes.plot(
                estimate.time_s, position_errors_m(estimate, truth).clip(_LEAST_M), color=colour,
                linewidth=1.4, label=name,
            )  # fmt: skip
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.set_ylim(bottom=_LEAST_M)
        axes.set_xlim(float(truth.time_s[0]), float(truth.time_s[-1]))
        axes.set_xlabel("time / s")
        axes.set_ylabel("position error / m")
        axes.set_title(title)
        axes.spines[["top", "right"]].set_visible(False)
        figure.legend(loc="outside lower center", ncols=3, frameon=False)
