"""Success over the noise of headings, in the manner of Khalaf-Allah (2007), Fig. 5."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from mapfilter.evaluation.success_cells import SuccessCell
from mapfilter.report.canvas import BLACK, bottom_legend, distinct_colours, picture

_SIZE_IN = (8.4, 5.2)


@dataclass(frozen=True, slots=True)
class Claim:
    """What somebody claims: more success than ``success`` up to a deviation of headings."""

    sigma_orient_deg: float
    success: float


def plot_success_curves(
    curves: Sequence[tuple[str, Sequence[SuccessCell]]],
    path: Path,
    *,
    title: str,
    claims: Sequence[Claim] = (),
    claimant: str = "",
) -> None:
    """Draw a curve of success over the deviation of headings for each of several groups.

    Parameters
    ----------
    curves : sequence of (str, sequence of SuccessCell)
        A name and the cells along the curve; bars are Wilson intervals.
    path : Path
        PNG to write.
    title : str
    claims : sequence of Claim
        Drawn as steps; what lies above them agrees.
    claimant : str
        Who claims.

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    with picture(path, *_SIZE_IN) as figure:
        axes = figure.subplots()
        widest = max((c.sigma_orient_deg for _, cells in curves for c in cells), default=1.0)
        _draw_claims(axes, claims, claimant)
        # Bars of curves that lie on each other stand side by side.
        apart = min(0.012, 0.06 / max(len(curves), 1)) * max(widest, 1.0)
        shifts = apart * (np.arange(len(curves)) - (len(curves) - 1) / 2)
        for (name, cells), shift, colour in zip(
            curves, shifts, distinct_colours(len(curves)), strict=True
        ):
            ordered = sorted(cells, key=lambda cell: cell.sigma_orient_deg)
            share = np.array([cell.success for cell in ordered])
            bars = share - [c.low for c in ordered], [c.high for c in ordered] - share
            axes.errorbar(
                np.array([cell.sigma_orient_deg for cell in ordered]) + shift, 100 * share,
                yerr=100 * np.abs(np.array(bars)), color=colour, marker="o", markersize=4,
                linewidth=1.4, elinewidth=0.9, capsize=2, label=name,
            )  # fmt: skip
        axes.set_ylim(0, 102)
        axes.set_xlabel("standard deviation of the heading / °")
        axes.set_ylabel("successful global positioning / %")
        axes.set_title(title)
        axes.grid(color="#e8e8e8", linewidth=0.7)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
        if curves or claims:
            bottom_legend(figure, 3)


def _draw_claims(axes: Axes, claims: Sequence[Claim], claimant: str) -> None:
    """Draw each claim as a line up to its deviation, with one entry for all in the legend."""
    told = ", ".join(
        f"over {100 * claim.success:.0f} % up to {claim.sigma_orient_deg:g}°" for claim in claims
    )
    for index, claim in enumerate(claims):
        axes.plot(
            [0.0, claim.sigma_orient_deg], [100 * claim.success] * 2, color=BLACK, linewidth=2.6,
            linestyle=(0, (3, 1.2)), zorder=4,
            label=f"{claimant}: {told}" if index == 0 else None,
        )  # fmt: skip
        axes.plot(
            [claim.sigma_orient_deg], [100 * claim.success], color=BLACK, marker="|",
            markersize=11, markeredgewidth=2.6, zorder=4,
        )  # fmt: skip
