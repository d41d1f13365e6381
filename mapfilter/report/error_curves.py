"""How errors of several methods are distributed: cumulative, on a logarithmic axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from mapfilter.report.canvas import bottom_legend, distinct_colours, picture

_SIZE_IN = (6.4, 4.6)
_LEAST_M, _MOST_M = 1.0, 1000.0


def plot_error_curves(errors_m: Mapping[str, Sequence[float]], path: Path, *, title: str) -> None:
    """Draw the cumulative distribution of each method's errors.

    Parameters
    ----------
    errors_m : mapping of str to sequence of float
        By method; those without any are left out.
    path : Path
        PNG to write.
    title : str

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    known = {name: np.sort(np.asarray(values)) for name, values in errors_m.items() if values}
    with picture(path, *_SIZE_IN) as figure:
        axes = figure.subplots()
        for (name, values), colour in zip(known.items(), distinct_colours(len(known)), strict=True):
            share = 100 * np.arange(1, values.size + 1) / values.size
            label = f"{name}: median {np.median(values):.0f} m"
            axes.step(np.maximum(values, _LEAST_M), share, where="post", color=colour, label=label)
        axes.set_xscale("log")
        axes.set_xlim(_LEAST_M, _MOST_M)
        axes.set_ylim(0, 101)
        axes.set_xlabel("error / m")
        axes.set_ylabel("share of the scored fixes / %")
        axes.grid(color="#e8e8e8", linewidth=0.7)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
        axes.set_title(title)
        if known:
            bottom_legend(figure, 2)
