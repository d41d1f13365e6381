"""Khalaf-Allah (2007), Fig. 5 and Table 4: every reading of what the paper leaves open.

Ten cells on 9 km², a lattice of 5 m, walks of 1 940 m: the numbers of section 6.1. What differs
from the paper is the place, the prediction and the walk: each reading is run on many routes, and
one on a single route, as the paper repeats the route that was measured.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from mapfilter.evaluation.success import SuccessCell
from mapfilter.experiments.sweep.plan import (
    Noise,
    Radio,
    Reading,
    SweepPlan,
    noise_grid,
)
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.simulation.reports import ReportModel

SIGMA_ORIENT_DEG = (0.0, 3.0, 6.0, 10.0, 15.0, 20.0)
SIGMA_TRANS_M = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
ONE_SIGMA_TRANS_M = 0.2
RESOLUTION_M = 5.0
UPDATE_LENGTH_M = 22.0
ROW_PERIOD_S = 16.0
"""Walking at 1.4 m/s one is 22 m farther after 16 s: one row of dead reckoning for each update."""

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
    reading : str
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

    Parameters
    ----------
    trials : int
        Runs in each cell of the grid, at least.
    seed : int
    """
    routes = min(ROUTES, trials)
    draws = -(-trials // routes)
    every = noise_grid(SIGMA_TRANS_M, SIGMA_ORIENT_DEG)
    some = noise_grid((ONE_SIGMA_TRANS_M,), SIGMA_ORIENT_DEG)
    best = CandidateFilter(RESOLUTION_M)
    projected = CandidateFilter(UPDATE_LENGTH_M, prediction="last_heading")
    next_call = CandidateFilter(RESOLUTION_M, switch_check="next_call")
    as_list = CandidateFilter(RESOLUTION_M, duplicates="list", threshold=10)
    at_22_m = CandidateFilter(UPDATE_LENGTH_M)
    printed = CandidateFilter(
        RESOLUTION_M,
        tracking_length_m=0.0,
        prediction="last_heading",
        switch_check="next_call",
    )
    row, second = ROW_PERIOD_S, 1.0
    return (
        _plan((_reading(MAIN, best),), every, Radio(), row, routes, draws, seed),
        _plan((_reading(ONE_ROUTE, best),), every, Radio(), row, 1, trials, seed),
        _plan(
            (
                _reading("set, switch at the next call", next_call),
                _reading("list, α = 10", as_list),
            ),
            some, Radio(), row, routes, draws, seed,
        ),
        _plan(
            (
                _reading("set, realistic cell", best),
                _reading("set, realistic cell, 6 dB", best, 6.0),
                _reading("list, α = 10, realistic cell, 6 dB", as_list, 6.0),
            ),
            some, GROUND_TRUTH, row, routes, draws, seed,
        ),
        _plan(
            (
                _reading("set, 1 Hz", at_22_m),
                _reading("set, 1 Hz, projected along the last heading", projected),
                _reading("set, 1 Hz, as printed", printed),
            ),
            some, Radio(), second, routes, draws, seed,
        ),
        _plan(
            (_reading("set, 1 Hz, realistic cell, 6 dB", at_22_m, 6.0),),
            some, GROUND_TRUTH, second, routes, draws, seed,
        ),
    )  # fmt: skip


def fits(cells: Iterable[SuccessCell]) -> tuple[Fit, ...]:
    """Return how near each reading comes to the paper's claims, the nearest first.

    Parameters
    ----------
    cells : iterable of SuccessCell
        Of the steps' noise that all readings share.
    """
    by_reading: dict[str, list[SuccessCell]] = {}
    for cell in cells:
        if cell.sigma_trans_m == ONE_SIGMA_TRANS_M:
            by_reading.setdefault(cell.reading, []).append(cell)
    found = [_fit(name, some) for name, some in by_reading.items()]
    return tuple(sorted(found, key=lambda fit: fit.misfit))


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


def _reading(name: str, options: CandidateFilter, margin_db: float = 0.0) -> Reading:
    return Reading(name, replace(options, margin_db=margin_db), options.update_length_m)


def _plan(
    readings: tuple[Reading, ...],
    noises: tuple[Noise, ...],
    radio: Radio,
    period_s: float,
    routes: int,
    draws: int,
    seed: int,
) -> SweepPlan:
    return SweepPlan(
        readings,
        noises=noises,
        radios=(radio,),
        report_periods_s=(period_s,),
        routes=routes,
        draws=draws,
        # The filter knows no neighbours, and which cell serves does not depend on them.
        reports=ReportModel(max_neighbours=0),
        seed=seed,
    )
