"""Fritsche & Klein (2009): hybrid GPS and GSM tracking, its Fig. 2 and Table III, and beyond.

Beyond the paper are the smoothed GSM track and a layout in which linearised filters go astray.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.evaluation.bounds import (
    bound_of,
    expected_information,
    posterior_bound,
    quantities,
    rmse_over_time,
)
from mapfilter.experiments.papers.fritsche_klein_2009.scene import (
    COMBINATIONS,
    Combination,
    Layout,
    Scene,
    Trials,
    draw,
    hard_layout,
    read_layout,
    scene,
)
from mapfilter.experiments.papers.paper import Paper, PaperSettings, Picture, share_beyond
from mapfilter.filters.gaussian import CKF, EKF, IEKF, RBUKF, UKF, Method
from mapfilter.filters.gaussian_sum import run_mixtures, split
from mapfilter.filters.kalman import smooth
from mapfilter.filters.trials import run_trials
from mapfilter.positioning.kalman.models import compiled
from mapfilter.report.canvas import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION, Drawn
from mapfilter.report.curves import Curve, Panel, curves_of, plot_error_panels, plot_scene

Curves = dict[str, Floats]

QUANTITIES = ("location_m", "velocity_mps", "bias_m", "drift_mps")
SUM_PARTS = MappingProxyType({0: 9, 2: 9, 1: 5, 3: 5})
"""Into how many the hard start is cut along east, north and their rates."""

FAR_M = 500.0
MOST_TRIALS = 20_000

TABLE_III: dict[str, dict[str, tuple[float | None, ...]]] = {
    "rbukf": {
        "gsm": (74.5, 3.7, None, None),
        "hybrid1": (71.9, 3.4, 33.6, 1.9),
        "hybrid2": (44.4, 2.7, 4.6, 1.2),
    },
    "ekf": {
        "gsm": (74.8, 3.7, None, None),
        "hybrid1": (73.5, 3.5, 34.2, 1.9),
        "hybrid2": (45.3, 2.8, 4.6, 1.2),
    },
}
"""As published, in the order of :data:`QUANTITIES`."""

ASSUMPTIONS = (
    "positions and directions of antennas and satellites are read off no table: a hexagonal grid "
    "with 800 m between sites, satellites at 12° and 190° and 45° up, 2e7 m away",
    "300 steps of 0.48 s; averages are over k = 1 ... 300",
    "first guesses of position and velocity are normal, those of bias and drift uniform; over "
    "all trials they are scaled to the covariance P(0|0)",
    "P_t is the EIRP; A_m caps the attenuation; Q12 of the clock as printed",
    "sigma points after Wan & van der Merwe with α 1e-3, β 2, κ 0; GSM alone has 4 states",
    "the bound takes the true process noise, filters 100 and 5 times of it",
    "hard layout: the serving station amid six at 1000 m, all looking at it, GSM, 400 steps",
)


class CombinationRun(NamedTuple):
    """Root mean square errors by filter or bound and quantity, (K,), and the share of divergence.

    ``astray`` is the share of trials more than 500 m off at the end.
    """

    curves: dict[str, Curves]
    astray: dict[str, float]


class PaperRun(NamedTuple):
    """Filters by combination and in the hard layout (GSM), and true positions (K, 2) of a trial."""

    trials: int
    layout: Layout
    hard_layout: Layout
    nominal: dict[str, CombinationRun]
    hard: CombinationRun
    track: Floats


def run_paper(settings: PaperSettings) -> PaperRun:
    """Run all filters over all combinations, and over the hard layout."""
    layout, hard = Layout(), hard_layout()
    if settings.layout_file is not None:
        layout = read_layout(settings.layout_file)
    cases: list[tuple[Combination, Layout, Sequence[Method]]]
    cases = [(name, layout, (RBUKF, EKF)) for name in COMBINATIONS]
    cases.append(("gsm", hard, (EKF, RBUKF, IEKF, CKF, UKF)))
    streams = np.random.default_rng(settings.seed).spawn(len(cases))
    found = []
    for (name, own, methods), rng in zip(cases, streams, strict=True):
        given = scene(name, own)
        drawn = draw(given, settings.trials, own.steps, rng)
        found.append(_run_filters(given, drawn, methods, with_sum=own is hard))
        if own is layout:
            track = drawn.states[0][:, [0, 2]]
        if settings.progress is not None:
            settings.progress(len(found), len(cases))
    nominal: dict[str, CombinationRun] = dict(zip(COMBINATIONS, found, strict=False))
    return PaperRun(settings.trials, layout, hard, nominal, found[-1], track)


def bound_curves(given: Scene, states: Floats) -> Curves:
    """Return the posterior Cramér-Rao bound of each quantity over time."""
    covariance = posterior_bound(
        given.truth.transition,
        given.truth.noise,
        given.first_covariance,
        expected_information(given.measurement, states),
    )
    return {name: bound_of(covariance, own) for name, own in quantities(given.layout).items()}


def _run_filters(
    given: Scene, drawn: Trials, methods: Sequence[Method], *, with_sum: bool
) -> CombinationRun:
    """Run filters and a Gaussian sum if wanted; smooth the sum, or else the EKF.

    Without the sum, in the nominal layout, all filters sit on the bound: one smoothed track does.
    """
    parts, states = quantities(given.layout), drawn.states
    moving = given.assumed.transition, given.assumed.noise
    model, starts = compiled(given.measurement), drawn.first_means
    curves, astray = {"pcrlb": bound_curves(given, states)}, {}

    def errors(means: Floats) -> Curves:
        return {name: rmse_over_time(means, states, own) for name, own in parts.items()}

    for method in methods:
        keep = method is EKF and not with_sum
        begin = starts, given.first_covariance
        run = run_trials(model, *moving, method, *begin, drawn.readings, covariances=keep)
        curves[method.name] = errors(run.means)
        astray[method.name] = share_beyond(run.means, states, FAR_M)
        if keep:
            curves["smoothed"] = errors(smooth(*moving, run.means, run.covariances).means)
    if with_sum:
        first = split(np.zeros(given.layout.size), given.first_covariance, SUM_PARTS)
        total = run_mixtures(model, *moving, EKF, first, starts, drawn.readings)
        curves["gaussian_sum"] = errors(total.means)
        astray["gaussian_sum"] = share_beyond(total.means, states, FAR_M)
        later = smooth(*moving, total.means, total.covariances)
        curves["gaussian_sum_smoothed"] = errors(later.means)
    return CombinationRun(curves, astray)


_PUBLISHED: dict[str, dict[str, dict[str, float | None]]] = {
    name: {kind: dict(zip(QUANTITIES, row, strict=True)) for kind, row in table.items()}
    for name, table in TABLE_III.items()
}


def summary(run: PaperRun) -> dict[str, Any]:
    """Return averages over time of root mean square errors, as in Table III.

    ``rbukf``, ``ekf``, ``pcrlb``, ``smoothed``: by combination of measurements and quantity;
    ``smoothed`` is the EKF's track, smoothed. ``published``: Table III, by filter, combination and
    quantity. ``worst_ratio``: largest deviation of a measured figure from the published one, as a
    share of it. ``lowest_over_bound``: smallest ratio of a filter's figure and the bound. ``hard``:
    by filter, the location's average in the hard layout. ``hard_astray``: by filter, the share of
    trials there more than 500 m off at the end.
    """
    found = _averages(run)
    apart, over = [0.0], [np.inf]
    for name, table in _PUBLISHED.items():
        for kind, row in table.items():
            for quantity, published in row.items():
                value, bound = found[name][kind][quantity], found["pcrlb"][kind][quantity]
                if value is not None and published is not None and bound is not None:
                    apart.append(abs(value / published - 1))
                    over.append(value / bound)
    return {
        **found,
        "published": _PUBLISHED,
        "worst_ratio": max(apart),
        "lowest_over_bound": float(min(over)),
        "hard": {name: float(own["location_m"].mean()) for name, own in run.hard.curves.items()},
        "hard_astray": run.hard.astray,
        "trials": run.trials,
        "assumptions": ASSUMPTIONS,
    }


def tables(run: PaperRun) -> dict[str, pd.DataFrame]:
    """Return Table III, measured and published."""
    rows = []
    for name, kinds in _averages(run).items():
        for kind, row in kinds.items():
            published = _PUBLISHED.get(name, {}).get(kind, {})
            beside = {f"published_{quantity}": published.get(quantity) for quantity in QUANTITIES}
            rows.append({"algorithm": name, "method": kind, **row, **beside})
    return {"table-3": pd.DataFrame(rows, dtype=object)}


def _averages(run: PaperRun) -> dict[str, dict[str, dict[str, float | None]]]:
    """Return averages over time, as in Table III; None for a state without a clock."""
    found: dict[str, dict[str, dict[str, float | None]]] = {}
    for name in ("rbukf", "ekf", "pcrlb", "smoothed"):
        by_kind = {kind: own.curves[name] for kind, own in run.nominal.items()}
        found[name] = {
            kind: {q: float(own[q].mean()) if q in own else None for q in QUANTITIES}
            for kind, own in by_kind.items()
        }
    return found


_KINDS = {
    "gsm": ("GSM", VERMILLION),
    "hybrid1": ("Hybrid 1", ORANGE),
    "hybrid2": ("Hybrid 2", BLUE),
}
_LABELS = {
    "location_m": ("(a) location", "RMSE / m", 300.0),
    "velocity_mps": ("(b) velocity", "RMSE / (m/s)", 12.0),
    "bias_m": ("(c) clock bias", "RMSE / m", 150.0),
    "drift_mps": ("(d) clock drift", "RMSE / (m/s)", 7.0),
}
_HARD = {
    "ekf": ("EKF", VERMILLION, "-"),
    "rbukf": ("RBUKF", ORANGE, "-"),
    "iekf": ("iterated EKF", PURPLE, "-"),
    "ukf": ("UKF, α = 1", SKY, "-"),
    "gaussian_sum": ("Gaussian sum", BLUE, "-"),
    "gaussian_sum_smoothed": ("Gaussian sum, smoothed", GREEN, "-"),
    "pcrlb": ("PCRLB", BLACK, "--"),
}
_SMOOTHED = {
    "ekf": ("EKF", VERMILLION, "-"),
    "smoothed": ("smoothed", GREEN, "-"),
    "pcrlb": ("PCRLB of filters", BLACK, "--"),
}


def pictures(run: PaperRun) -> Iterator[Picture]:
    """Draw Fig. 1, Fig. 2 by both filters, the smoothed tracks, and the hard layout."""
    yield "figure-1", _scene(run.layout, run.track, "Fig. 1: scenario")
    for name, key in (("figure-2", "rbukf"), ("figure-2-ekf", "ekf")):
        panels = []
        for quantity, (title, label, top) in _LABELS.items():
            curves = []
            for kind, (words, colour) in _KINDS.items():
                own = run.nominal[kind].curves
                if quantity in own[key]:
                    bound = own["pcrlb"][quantity]
                    curves.append(Curve(f"{words}, {key.upper()}", own[key][quantity], colour))
                    curves.append(Curve(f"{words}, PCRLB", bound, colour, "--"))
            panels.append(Panel(title, label, curves, top=top))
        title = f"Fig. 2 with the {key.upper()}, {run.trials} trials"
        yield name, plot_error_panels(panels, title=title)
    label = "location RMSE / m"
    panels = [
        Panel(_KINDS[kind][0], label, _locations(own, _SMOOTHED))
        for kind, own in run.nominal.items()
    ]
    title = f"Smoothing, {run.trials} trials"
    yield "smoothed", plot_error_panels(panels, title=title, columns=3)
    steps = np.arange(run.hard_layout.steps)[:, None]
    road_m = run.track[:1] + steps * np.diff(run.track[:2], axis=0)
    yield "hard-layout", _scene(run.hard_layout, road_m, "Hard layout")
    hard = Panel("", label, _locations(run.hard, _HARD), top=300.0)
    yield "hard", plot_error_panels([hard], title=f"Hard layout, GSM, {run.trials} trials")


def _scene(layout: Layout, track_m: Floats, title: str) -> Drawn:
    network = layout.sites_m, layout.boresights_deg, layout.serving
    return plot_scene(*network, layout.satellite_azimuths_deg, track_m, title=title)


def _locations(run: CombinationRun, names: Mapping[str, tuple[str, str, str]]) -> list[Curve]:
    return curves_of({name: own["location_m"] for name, own in run.curves.items()}, names)


PAPER = Paper(
    name="fritsche-klein-2009",
    title="Fritsche & Klein (2009): hybrid tracking by GPS and GSM",
    trials=500,
    trial_limits=(1, MOST_TRIALS),
    why="all trials are in memory at once",
    unit="parts",
    options=("--layout",),
    run=run_paper,
    summary=summary,
    tables=tables,
    pictures=pictures,
)
