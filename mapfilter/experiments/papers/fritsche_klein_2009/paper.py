"""Fritsche & Klein (2009): its figures, Table III, and what is added to them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.experiments.papers.fritsche_klein_2009.experiment import (
    ASSUMPTIONS,
    QUANTITIES,
    TABLE_III,
    Curves,
    PaperRun,
    run_paper,
)
from mapfilter.experiments.papers.fritsche_klein_2009.scene import COMBINATIONS, Layout
from mapfilter.experiments.papers.paper import Paper, Picture
from mapfilter.report.canvas import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION, Drawn
from mapfilter.report.curves import Curve, Panel, curves_of, plot_error_panels, plot_scene

MOST_TRIALS = 20_000

_ALGORITHMS = ("rbukf", "ekf", "pcrlb", "smoothed")
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
    return {
        name: {kind: run.nominal[kind].averages(name) for kind in COMBINATIONS}
        for name in _ALGORITHMS
    }


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
        Panel(_KINDS[kind][0], label, curves_of(_locations(own.curves), _SMOOTHED))
        for kind, own in run.nominal.items()
    ]
    title = f"Smoothing, {run.trials} trials"
    yield "smoothed", plot_error_panels(panels, title=title, columns=3)
    steps = np.arange(run.hard_layout.steps)[:, None]
    road_m = run.track[:1] + steps * np.diff(run.track[:2], axis=0)
    yield "hard-layout", _scene(run.hard_layout, road_m, "Hard layout")
    hard = Panel("", label, curves_of(_locations(run.hard.curves), _HARD), top=300.0)
    yield "hard", plot_error_panels([hard], title=f"Hard layout, GSM, {run.trials} trials")


def _scene(layout: Layout, track_m: Floats, title: str) -> Drawn:
    network = layout.sites_m, layout.boresights_deg, layout.serving
    return plot_scene(*network, layout.satellite_azimuths_deg, track_m, title=title)


def _locations(curves: dict[str, Curves]) -> dict[str, Floats]:
    return {name: own["location_m"] for name, own in curves.items()}


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
