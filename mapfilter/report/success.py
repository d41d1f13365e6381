"""Success over the noise of headings, in the manner of Khalaf-Allah (2007), Fig. 5."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M
from mapfilter.evaluation.success import SuccessCell
from mapfilter.report.canvas import (
    BLACK,
    GREY,
    VERMILLION,
    bottom_legend,
    distinct_colours,
    picture,
)

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


_RUNS_SIZE_IN = (11.0, 4.6)
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
    with picture(path, *_RUNS_SIZE_IN) as figure:
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
