"""The paper's figures and tables.

The paper prints neither the positions of its three base stations nor how filters were started
exactly; the defaults here are stated with the results.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.evaluation.bounds import bound_of, rmse_over_time
from mapfilter.experiments.papers.paper import (
    Paper,
    PaperSettings,
    Picture,
    share_beyond,
    true_states,
)
from mapfilter.experiments.papers.zhang_2006.scene import (
    COMBINATIONS,
    MOTION,
    POSITION,
    SIGMA_RSS_DB,
    START,
    VELOCITY,
    bounds,
    run_filter,
    run_sum,
    started_from_fix,
    started_wide,
)
from mapfilter.filters.gaussian import EKF, IEKF, UKF
from mapfilter.report.canvas import BLACK, BLUE, GREY, ORANGE, PURPLE, SKY, VERMILLION
from mapfilter.report.curves import Curve, Panel, curves_of, plot_error_panels

SIGMAS_DB = (0.4, 4.0, 40.0)
STEPS = 400
FAR_M = 1000.0

MOST_TRIALS = 20_000
"""All are in memory at once."""

AT = (10, 100, 400)
OVER_AT = (50, 100, 200, 400)

PUBLISHED = (
    "Fig. 1: fusion is better than either kind alone",
    "Fig. 2: fusion gains most where levels are noisy",
    "Fig. 3: the EKF started from a timing advance attains the bound",
)
"""What the paper claims; it prints no values."""

ASSUMPTIONS = (
    "base stations at (0, 0), (6000, 0) and (3000, 6000) m, which the paper does not print",
    "400 steps of 0.48 s; the bound at k holds the readings of steps 1 to k and the prior, not "
    "the timing advances that filters are started from",
    "filters are started from a fix by the three timing advances at k = 0, by least squares with "
    "its covariance, and a velocity drawn with 50 m/s about the truth",
    "wide starts are drawn with 5 km and 50 m/s about the truth, as P(0) says",
    "filters know the true process noise; timing advance is not rounded",
)


@dataclass(frozen=True, eq=False)
class PaperRun:
    """Curves over k = 1 ... 400; the first index of each is k = 1.

    ``bounds``: by σ_l in dB, then by combination, the bound's covariances (K, 4, 4). By combination
    ``from_fix`` and ``velocity_from_fix`` are the errors of the EKF started from a fix; ``wide``,
    by filter, the position error from the wide start, and ``astray`` the share of its trials more
    than 1 km off at the end.
    """

    trials: int
    bounds: dict[float, dict[str, Floats]]
    from_fix: dict[str, Floats]
    velocity_from_fix: dict[str, Floats]
    wide: dict[str, dict[str, Floats]]
    astray: dict[str, dict[str, float]]


def run_paper(settings: PaperSettings) -> PaperRun:
    """Run bounds and filters of all figures, and the wide starts."""
    trials, progress = settings.trials, settings.progress
    truth_rng, rng = np.random.default_rng(settings.seed).spawn(2)
    states = true_states(MOTION, np.array(START), trials, STEPS, truth_rng)
    found: dict[float, dict[str, Floats]] = {
        sigma: {name: bounds(states, name, sigma) for name in COMBINATIONS} for sigma in SIGMAS_DB
    }
    start, vague = started_from_fix(trials, rng), started_wide(trials, rng)
    run = PaperRun(trials, found, {}, {}, {}, {})
    for done, name in enumerate(COMBINATIONS, start=1):
        means = run_filter(EKF, states, name, start, rng)
        run.from_fix[name] = rmse_over_time(means, states, POSITION)
        run.velocity_from_fix[name] = rmse_over_time(means, states, VELOCITY)
        wide = {one.name: run_filter(one, states, name, vague, rng) for one in (EKF, IEKF, UKF)}
        wide["gaussian_sum"] = run_sum(states, name, vague, rng)
        run.wide[name] = {
            one: rmse_over_time(means, states, POSITION) for one, means in wide.items()
        }
        run.astray[name] = {one: share_beyond(own, states, FAR_M) for one, own in wide.items()}
        if progress is not None:
            progress(done, len(COMBINATIONS))
    return run


def summary(run: PaperRun) -> dict[str, Any]:
    """Return bounds and what filters reach of them; indices are k.

    ``bound_m``: by σ_l in dB, combination and k, the bound on the position. ``ekf_over_bound``: by
    k, the position error of the EKF started from a fix, over the bound; TA and RSS.
    ``single_over_fusion_bound``: the same of filters with one kind of measurement, over the bound
    of both (Fig. 3). ``wide_over_bound``: by combination, filter and k, from the start known to
    5 km, over the combination's bound. ``wide_astray``: by combination and filter, the share of
    trials more than 1 km off at the end of that.
    """
    bound = _position_bounds(run)
    own_bound = bound[SIGMA_RSS_DB]
    over = {kind: _at(own / own_bound["fusion"], OVER_AT) for kind, own in run.from_fix.items()}
    return {
        "bound_m": {
            f"{sigma:g}": {kind: _at(own, AT) for kind, own in kinds.items()}
            for sigma, kinds in bound.items()
        },
        "ekf_over_bound": over["fusion"],
        "single_over_fusion_bound": {kind: over[kind] for kind in ("ta", "rss")},
        "wide_over_bound": {
            kind: {name: _at(error / own_bound[kind], AT) for name, error in filters.items()}
            for kind, filters in run.wide.items()
        },
        "wide_astray": run.astray,
        "claims": PUBLISHED,
        "trials": run.trials,
        "assumptions": ASSUMPTIONS,
    }


def tables(run: PaperRun) -> dict[str, pd.DataFrame]:
    """Return the bounds on the position by σ_l and combination."""
    rows = [
        {"sigma_l_db": f"{sigma:g}", "method": kind}
        | {f"bound_m_{k}": value for k, value in _at(own, AT).items()}
        for sigma, kinds in _position_bounds(run).items()
        for kind, own in kinds.items()
    ]
    return {"bounds": pd.DataFrame(rows)}


def _position_bounds(run: PaperRun) -> dict[float, dict[str, Floats]]:
    return {
        sigma: {kind: bound_of(own, POSITION) for kind, own in kinds.items()}
        for sigma, kinds in run.bounds.items()
    }


def _at(curve: Floats, indices: Iterable[int]) -> dict[str, float]:
    return {str(k): float(curve[k - 1]) for k in indices}


_KINDS = {"fusion": ("TA + RSS", BLUE), "ta": ("TA", ORANGE), "rss": ("RSS", VERMILLION)}
_FILTERS = {
    "ekf": ("EKF", VERMILLION, "-"),
    "iekf": ("iterated EKF", PURPLE, "-"),
    "ukf": ("UKF, α = 1", SKY, "-"),
    "gaussian_sum": ("Gaussian sum", BLUE, "-"),
}


def pictures(run: PaperRun) -> Iterator[Picture]:
    """Draw Figs. 1 to 3, and what filters make of a start known to 5 km."""
    found = run.bounds[SIGMA_RSS_DB]

    def bound(own: dict[str, Floats], kind: str, parts: tuple[int, ...] = POSITION) -> Curve:
        name, colour = _KINDS[kind]
        return Curve(f"PCRB, {name}", bound_of(own[kind], parts), colour, "--")

    of = (("position", "m", POSITION), ("velocity", "(m/s)", VELOCITY))
    panels = [
        Panel(title, f"bound / {unit}", [bound(found, kind, parts) for kind in _KINDS], True)
        for title, unit, parts in of
    ]
    yield "figure-1", plot_error_panels(panels, title="Fig. 1: bounds, σ_d 288 m, σ_l 4 dB")
    label = "bound on position / m"
    panels = [
        Panel(f"σ_l = {sigma:g} dB", label, [bound(own, kind) for kind in ("fusion", "rss")], True)
        for sigma, own in run.bounds.items()
    ]
    title = "Fig. 2: bounds and the noise of levels"
    yield "figure-2", plot_error_panels(panels, title=title, columns=3)
    panels = []
    for (title, unit, parts), errors in zip(of, (run.from_fix, run.velocity_from_fix), strict=True):
        curves = [Curve(f"EKF, {name}", errors[kind], col) for kind, (name, col) in _KINDS.items()]
        curves.append(Curve("PCRB, TA + RSS", bound_of(found["fusion"], parts), BLACK, "--"))
        panels.append(Panel(title, f"RMSE / {unit}", curves, True))
    title = f"Fig. 3: EKF started from a timing advance, {run.trials} trials"
    yield "figure-3", plot_error_panels(panels, title=title)
    panels = []
    for kind, own in run.wide.items():
        limit = Curve("PCRB", bound_of(found[kind], POSITION), GREY, "--")
        curves = [*curves_of(own, _FILTERS), limit]
        panels.append(Panel(_KINDS[kind][0], "position RMSE / m", curves, True))
    title = f"Started within 5 km, σ_l 4 dB, {run.trials} trials"
    yield "wide-start", plot_error_panels(panels, title=title, columns=3)


PAPER = Paper(
    name="zhang-2006",
    title="Zhang, Knedlik & Loffeld (2006): timing advances and levels of GSM",
    trials=1000,
    trial_limits=(1, MOST_TRIALS),
    why="all trials are in memory at once",
    unit="parts",
    run=run_paper,
    summary=summary,
    tables=tables,
    pictures=pictures,
)
