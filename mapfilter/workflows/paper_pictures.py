"""The pictures of a reproduced paper."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from mapfilter.evaluation.success import SuccessCell
from mapfilter.experiments.papers.khalaf_allah_2007 import experiment as paper
from mapfilter.report.success import (
    Claim,
    plot_run_distributions,
    plot_success_curves,
    plot_success_map,
)

_CLAIMANT = "paper"


def draw_khalaf_allah_2007(
    runs: pd.DataFrame, cells: Sequence[SuccessCell], out: Path, place: str
) -> tuple[Path, ...]:
    """Draw Fig. 5 over many routes and over one, the readings side by side, map, distributions."""
    names = ("figure-5", "figure-5-one-route", "readings", "success-map", "distributions")
    paths = tuple(out / f"{name}.png" for name in names)
    claims = [Claim(sigma_deg, share) for sigma_deg, share in paper.CLAIMS]
    for path, reading in zip(paths, (paper.MAIN, paper.ONE_ROUTE), strict=False):
        mine = [cell for cell in cells if cell.reading == reading]
        curves = [
            (
                f"step {sigma_m:g} m",
                [cell for cell in mine if cell.sigma_trans_m == sigma_m],
            )
            for sigma_m in paper.SIGMA_TRANS_M
        ]
        plot_success_curves(
            curves, path, title=f"{place}: {_told(mine)}", claims=claims, claimant=_CLAIMANT
        )
    shared = [cell for cell in cells if cell.sigma_trans_m == paper.ONE_SIGMA_TRANS_M]
    readings = list(dict.fromkeys(cell.reading for cell in shared))
    plot_success_curves(
        [(name, [cell for cell in shared if cell.reading == name]) for name in readings],
        paths[2],
        title=f"{place}: readings of the paper, steps of ± {paper.ONE_SIGMA_TRANS_M:g} m",
        claims=claims,
        claimant=_CLAIMANT,
    )
    main = [cell for cell in cells if cell.reading == paper.MAIN]
    plot_success_map(main, paths[3], title=f"{place}: {_told(main)}")
    rows = runs[
        (runs["reading"] == paper.MAIN) & (runs["sigma_trans_m"] == paper.ONE_SIGMA_TRANS_M)
    ]
    groups = [(f"heading {sigma:g}°", some) for sigma, some in rows.groupby("sigma_orient_deg")]
    plot_run_distributions(groups, paths[4], title=f"{place}: {_told(main)}")
    return paths


def _told(cells: Sequence[SuccessCell]) -> str:
    routes, runs = cells[0].routes, cells[0].runs
    many = "one route" if routes == 1 else f"{routes} routes"
    return f"candidate filter, {runs} runs over {many} in each cell"
