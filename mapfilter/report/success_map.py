"""Success over both noises as a map of numbers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mapfilter.evaluation.success_cells import SuccessCell
from mapfilter.report.canvas import picture


def plot_success_map(cells: Sequence[SuccessCell], path: Path, *, title: str) -> None:
    """Draw success by the deviations of headings (across) and of steps (upwards).

    Parameters
    ----------
    cells : sequence of SuccessCell
        One for each pair of deviations.
    path : Path
        PNG to write.
    title : str

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    orient = sorted({cell.sigma_orient_deg for cell in cells})
    trans = sorted({cell.sigma_trans_m for cell in cells})
    share = np.full((len(trans), len(orient)), np.nan)
    for cell in cells:
        place = trans.index(cell.sigma_trans_m), orient.index(cell.sigma_orient_deg)
        share[place] = 100 * cell.success
    size_in = 2.8 + 0.8 * len(orient), 1.9 + 0.55 * len(trans)
    with picture(path, max(size_in[0], 6.0), max(size_in[1], 3.2)) as figure:
        axes = figure.subplots()
        image = axes.imshow(share, origin="lower", cmap="viridis", vmin=0, vmax=100, aspect="auto")
        for (row, col), percent in np.ndenumerate(share):
            if np.isfinite(percent):
                colour = "black" if percent > 55 else "white"
                axes.text(col, row, f"{percent:.0f}", ha="center", va="center", color=colour)
        axes.set_xticks(range(len(orient)), [f"{value:g}" for value in orient])
        axes.set_yticks(range(len(trans)), [f"{value:g}" for value in trans])
        axes.set_xlabel("standard deviation of the heading / °")
        axes.set_ylabel("standard deviation of a step / m")
        axes.set_title(title)
        figure.colorbar(image, ax=axes, label="success / %")
