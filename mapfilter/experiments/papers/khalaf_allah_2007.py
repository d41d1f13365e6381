"""Khalaf-Allah (2007), Fig. 5 and Table 4: every reading of what the paper leaves open.

Ten cells on 9 km², a lattice of 5 m, walks of 1 940 m: the numbers of section 6.1. What differs
from the paper is the place, the prediction and the walk: each reading is run on many routes, and
one on a single route, as the paper repeats the route that was measured.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from mapfilter.errors import ConfigError, fail
from mapfilter.evaluation.success_cells import SuccessCell, success_cells
from mapfilter.experiments.papers.paper import Paper, PaperSettings, Picture
from mapfilter.experiments.sweep.noises import noise_grid
from mapfilter.experiments.sweep.plan import Radio, Reading, SweepPlan
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.report.run_distributions import plot_run_distributions
from mapfilter.report.success import (
    plot_success_curves,
    plot_success_map,
)
from mapfilter.simulation.reports import ReportModel

SIGMA_ORIENT_DEG = (0.0, 3.0, 6.0, 10.0, 15.0, 20.0)
SIGMA_TRANS_M = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
ONE_SIGMA_TRANS_M = 0.2
RESOLUTION_M = 5.0
UPDATE_LENGTH_M = 22.0
ROW_PERIOD_S = 16.0
"""At a walking speed of 1.4 m/s, 16 s are 22 m: one row of dead reckoning for each update."""

MAP_SETTINGS = (
    f"area.resolution_m={RESOLUTION_M}",
    *("cells.sites=2", "cells.sectors=3", "cells.indoor=4", "database.margin_db=6.0"),
    # Random clutter stands for the detail of the paper's measured map.
    "prediction.shadowing_db=6.0",
)
"""The paper's set-up: two sites of three sectors, four indoor cells."""

MAIN, ONE_ROUTE = "set", "set, one route"
ROUTES = 40

CLAIMS = ((3.0, 0.80), (6.0, 0.65))
"""Section 6.2: more than 80 % up to 3°, more than 65 % up to 6°."""

TABLE_4_M = {"error_mean_m": (15.0, 20.0), "error_67_m": (14.0, 20.0), "error_95_m": (52.0, 56.0)}
"""Table 4: ranges over the cases that succeed."""

GROUND_TRUTH = Radio("ground truth", math.nan)


@dataclass(frozen=True, slots=True)
class Fit:
    """How near a reading comes to what the paper claims.

    Parameters
    ----------
    misfit : float
        0 where all claims hold: the mean of two, by how much success falls short (as a share, the
        mean of up to 3° and up to 6°), and by how much of itself a figure of Table 4 is missed, too
        small or too large (the mean of the three).
    success_3_deg, success_6_deg : float
        Least success up to there.
    error_mean_m, error_67_m, error_95_m : float
        Means over the cells up to 6°.
    """

    reading: str
    misfit: float
    success_3_deg: float
    success_6_deg: float
    error_mean_m: float
    error_67_m: float
    error_95_m: float


def plans(trials: int, seed: int) -> tuple[SweepPlan, ...]:
    """Return the sweeps that together are the reproduction.

    Each cell of the grid gets at least so many runs, ``trials``.
    """
    best, at_22_m = CandidateFilter(RESOLUTION_M), CandidateFilter(UPDATE_LENGTH_M)
    as_list = replace(best, duplicates="list", threshold=10)
    next_call = replace(best, switch_check="next_call")
    projected = replace(at_22_m, prediction="last_heading")
    printed = replace(next_call, tracking_length_m=0.0, prediction="last_heading")
    routes = min(ROUTES, trials)
    main = SweepPlan(
        (_reading(MAIN, best),),
        noises=noise_grid(SIGMA_TRANS_M, SIGMA_ORIENT_DEG),
        report_periods_s=(ROW_PERIOD_S,),
        routes=routes,
        draws=-(-trials // routes),
        # The filter uses no neighbours, and which cell serves does not depend on them.
        reports=ReportModel(max_neighbours=0),
        seed=seed,
    )
    one_route = replace(main, readings=(_reading(ONE_ROUTE, best),), routes=1, draws=trials)
    some = replace(main, noises=noise_grid((ONE_SIGMA_TRANS_M,), SIGMA_ORIENT_DEG))
    each_second = replace(some, report_periods_s=(1.0,))
    left_open = (
        _reading("set, switch at the next call", next_call),
        _reading("list, α = 10", as_list),
    )
    realistic = (
        _reading("set, realistic cell", best),
        _reading("set, realistic cell, 6 dB", best, 6.0),
        _reading("list, α = 10, realistic cell, 6 dB", as_list, 6.0),
    )
    at_1_hz = (
        _reading("set, 1 Hz", at_22_m),
        _reading("set, 1 Hz, projected along the last heading", projected),
        _reading("set, 1 Hz, as printed", printed),
    )
    realistic_1_hz = (_reading("set, 1 Hz, realistic cell, 6 dB", at_22_m, 6.0),)
    return (
        main,
        one_route,
        replace(some, readings=left_open),
        replace(some, readings=realistic, radios=(GROUND_TRUTH,)),
        replace(each_second, readings=at_1_hz),
        replace(each_second, readings=realistic_1_hz, radios=(GROUND_TRUTH,)),
    )


def _reading(name: str, options: CandidateFilter, margin_db: float = 0.0) -> Reading:
    return Reading(name, replace(options, margin_db=margin_db), options.update_length_m)


def fits(cells: Iterable[SuccessCell]) -> tuple[Fit, ...]:
    """Return how near each reading comes to the paper's claims, the nearest first."""
    found = [_fit(name, some) for name, some in _by_reading(cells).items()]
    return tuple(sorted(found, key=lambda fit: fit.misfit))


def _by_reading(cells: Iterable[SuccessCell]) -> dict[str, list[SuccessCell]]:
    """Return the cells of the steps' noise that all readings share, by reading."""
    found: dict[str, list[SuccessCell]] = {}
    for cell in cells:
        if cell.sigma_trans_m == ONE_SIGMA_TRANS_M:
            found.setdefault(cell.reading, []).append(cell)
    return found


def _fit(name: str, cells: Sequence[SuccessCell]) -> Fit:
    least = {
        sigma: min(cell.success for cell in cells if cell.sigma_orient_deg <= sigma)
        for sigma, _ in CLAIMS
    }
    short = [max(0.0, claim - least[sigma]) for sigma, claim in CLAIMS]
    missed = []
    errors_m = {}
    for figure, (low_m, high_m) in TABLE_4_M.items():
        known = [
            getattr(cell, figure)
            for cell in cells
            if cell.sigma_orient_deg <= CLAIMS[-1][0] and math.isfinite(getattr(cell, figure))
        ]
        errors_m[figure] = mean_m = sum(known) / len(known) if known else math.nan
        away_m = max(low_m - mean_m, mean_m - high_m, 0.0) if known else math.inf
        missed.append(min(away_m / high_m, 1.0))
    misfit = (sum(short) / len(short) + sum(missed) / len(missed)) / 2
    return Fit(name, misfit, *least.values(), **errors_m)


class PaperRun(NamedTuple):
    """The map's name or file, a row for each run, and success by reading and noises."""

    area_map: str
    runs: pd.DataFrame
    cells: tuple[SuccessCell, ...]
    fits: tuple[Fit, ...]


def run_paper(settings: PaperSettings) -> PaperRun:
    """Predict, build and run all sweeps; ConfigError where nothing makes the map."""
    if settings.sweep is None:
        hint = "mapfilter.workflows.reproduce.run_reproduce makes the map"
        raise fail(ConfigError, "PaperSettings, sweep", "what runs sweeps over a map", "None", hint)
    area_map, runs = settings.sweep(MAP_SETTINGS, plans(settings.trials, settings.seed))
    cells = success_cells(runs)
    return PaperRun(area_map, runs, cells, fits(cells))


def summary(run: PaperRun) -> dict[str, Any]:
    """Return the success in each cell of the grid, and how near each reading comes.

    ``success``: for every reading and every pair of noises. ``fits``: the claims, the nearest
    reading first.
    """
    return {
        "paper": PAPER.name,
        "map": run.area_map,
        "success": run.cells,
        "fits": run.fits,
        "outputs": (),
        "runs": len(run.runs),
    }


def tables(run: PaperRun) -> dict[str, pd.DataFrame]:
    """Return each reading's figures beside the paper's Table 4 and claims."""
    published = {name: f"{low:g}-{high:g}" for name, (low, high) in TABLE_4_M.items()}
    shares = [f"success_{sigma:g}_deg" for sigma, _ in CLAIMS]
    claims = {name: f"> {share:g}" for name, (_, share) in zip(shares, CLAIMS, strict=True)}
    rows = [{"reading": "Khalaf-Allah 2007"} | published | claims]
    for fit in run.fits:
        errors = {name: f"{getattr(fit, name):.1f}" for name in TABLE_4_M}
        success = {name: f"{getattr(fit, name):.3f}" for name in shares}
        rows.append({"reading": fit.reading} | errors | success)
    return {"table-4": pd.DataFrame(rows)}


def pictures(run: PaperRun) -> Iterator[Picture]:
    """Draw Fig. 5 over many routes and over one, the readings side by side, map, distributions."""
    place = Path(run.area_map).name
    look: dict[str, Any] = {"claims": CLAIMS, "claimant": "paper"}
    by_reading = {
        name: [cell for cell in run.cells if cell.reading == name] for name in (MAIN, ONE_ROUTE)
    }
    titles = {name: f"{place}: {_design(cells)}" for name, cells in by_reading.items()}
    for file, name in (("figure-5", MAIN), ("figure-5-one-route", ONE_ROUTE)):
        curves = [
            (f"step {at:g} m", [cell for cell in by_reading[name] if cell.sigma_trans_m == at])
            for at in SIGMA_TRANS_M
        ]
        yield file, plot_success_curves(curves, title=titles[name], **look)
    title = f"{place}: readings of the paper, steps of ± {ONE_SIGMA_TRANS_M:g} m"
    shared = list(_by_reading(run.cells).items())
    yield "readings", plot_success_curves(shared, title=title, **look)
    yield "success-map", plot_success_map(by_reading[MAIN], title=titles[MAIN])
    runs = run.runs
    rows = runs[(runs["reading"] == MAIN) & (runs["sigma_trans_m"] == ONE_SIGMA_TRANS_M)]
    groups = [(f"heading {sigma:g}°", some) for sigma, some in rows.groupby("sigma_orient_deg")]
    yield "distributions", plot_run_distributions(groups, title=titles[MAIN])


def _design(cells: Sequence[SuccessCell]) -> str:
    routes, runs = cells[0].routes, cells[0].runs
    many = "one route" if routes == 1 else f"{routes} routes"
    return f"candidate filter, {runs} runs over {many} in each cell"


PAPER = Paper(
    name="khalaf-allah-2007",
    title="Khalaf-Allah (2007): global positioning by the candidate filter",
    trials=100,
    unit="runs",
    options=("--map", "--bbox"),
    run=run_paper,
    summary=summary,
    tables=tables,
    pictures=pictures,
)
