"""TESA's paper: its scenarios and a halt, with tables and pictures."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from typing import Any

import numpy as np
import pandas as pd

from mapfilter.experiments.papers.paper import Paper, Picture
from mapfilter.experiments.papers.tesa import experiment as tesa
from mapfilter.experiments.papers.tesa import scene
from mapfilter.experiments.papers.tesa.models import IDENTITY, KNOWN_BEARING, VELOCITY, Motion
from mapfilter.experiments.papers.tesa.scene import ASSUMPTIONS, BETA_DB
from mapfilter.report.canvas import BLACK, BLUE, GREY, ORANGE, PURPLE, SKY, VERMILLION, Look
from mapfilter.report.curves import Curve, Panel, plot_error_panels
from mapfilter.simulation.drives import shadowing_db, straight_drive

CLAIMS = (
    "Figs. 6 and 7: with powers of GSM the accuracy improves slightly",
    "Fig. 8: without satellites a position is still available, with a far larger error",
)
"""What the paper says; it prints no values."""

_GNSS, _HYBRID = tesa.Run(1, IDENTITY), tesa.Run(1, IDENTITY, BETA_DB)
_MEASURES = {
    "mean_m": "mean_interval_m",
    "outage_m": "outage_interval_m",
    "below_100m": "below_interval",
    "availability": "availability_interval",
}
"""Names of the measures and of their intervals."""


def measures(run: tesa.PaperRun, key: tesa.Run) -> dict[str, tesa.Estimate]:
    """Return means over trials by the names of :data:`_MEASURES`.

    The error over all epochs and over those of the outage; shares of the outage's epochs and of all
    with less than 100 m.
    """
    errors, outage = run.errors_m[key], run.scene.outage
    near = errors < tesa.AVAILABLE_M
    return {
        "mean_m": tesa.estimate(errors.mean(axis=1), 0.0, inf),
        "outage_m": tesa.estimate(errors[:, outage].mean(axis=1), 0.0, inf),
        "below_100m": tesa.estimate(near[:, outage].mean(axis=1), 0.0, 1.0),
        "availability": tesa.estimate(near.mean(axis=1), 0.0, 1.0),
    }


def summary(run: tesa.PaperRun) -> dict[str, Any]:
    """Return mean errors by scenario, and all filters by β.

    Errors are norms in three dimensions, β = 1 dB. ``scenario1``: five satellites all the way, by
    the identity model, without and with GSM. ``scenario2``: over an outage of 200 s, and shares of
    all 720 s and of the outage with less than 100 m of error; ``hybrid_outage_m``, by the velocity
    model, is the headline; only ``hybrid_known_bearing_outage_m`` uses the true bearing of the
    road. ``scenario3``: over the same outage where the vehicle halts in it, which is not in the
    paper: at constant speed a velocity model keeps its position even without levels.
    ``hybrid_less_gnss_m``: of scenario 1, trial by trial; below 0 where GSM helps. ``rows``: every
    filter over every scenario, ``beta_db`` None without GSM; intervals are of 95 % over trials.
    """
    found = {key: measures(run, key) for key in tesa.RUNS}

    def of(name: str, scenario: int, motion: Motion, beta: float | None = BETA_DB) -> float:
        return found[tesa.Run(scenario, motion, beta)][name].value

    gain = tesa.estimate((run.errors_m[_HYBRID] - run.errors_m[_GNSS]).mean(axis=1))
    outage = found[tesa.Run(2, VELOCITY, BETA_DB)]["outage_m"]
    rows = []
    for key, own in found.items():
        row: dict[str, Any] = {"scenario": key.scenario, "motion": key.motion}
        row["beta_db"] = key.beta_db
        for name, one in own.items():
            row |= {name: one.value, _MEASURES[name]: (one.low, one.high)}
        rows.append(row)
    return {
        "scenario1": {
            "gnss_m": of("mean_m", 1, IDENTITY, None),
            "hybrid_m": of("mean_m", 1, IDENTITY),
        },
        "scenario2": {
            "hybrid_outage_m": outage.value,
            "hybrid_outage_interval_m": (outage.low, outage.high),
            "gnss_velocity_outage_m": of("outage_m", 2, VELOCITY, None),
            "hybrid_identity_outage_m": of("outage_m", 2, IDENTITY),
            "gnss_outage_m": of("outage_m", 2, IDENTITY, None),
            "hybrid_known_bearing_outage_m": of("outage_m", 2, KNOWN_BEARING),
            "availability_gnss": of("availability", 2, IDENTITY, None),
            "availability_hybrid_identity": of("availability", 2, IDENTITY),
            "availability_hybrid": of("availability", 2, VELOCITY),
            "outage_below_100m": {
                motion.replace("-", "_"): of("below_100m", 2, motion)
                for motion in (VELOCITY, IDENTITY, KNOWN_BEARING)
            },
        },
        "scenario3": {
            "hybrid_outage_m": of("outage_m", 3, VELOCITY),
            "gnss_velocity_outage_m": of("outage_m", 3, VELOCITY, None),
            "hybrid_identity_outage_m": of("outage_m", 3, IDENTITY),
        },
        "hybrid_less_gnss_m": gain.value,
        "hybrid_less_gnss_interval_m": (gain.low, gain.high),
        "rows": rows,
        "claims": CLAIMS,
        "trials": len(run.errors_m[_GNSS]),
        "assumptions": ASSUMPTIONS,
    }


def tables(run: tesa.PaperRun) -> dict[str, pd.DataFrame]:
    """Return all filters over all scenarios."""
    rows = []
    for key in tesa.RUNS:
        beta = None if key.beta_db is None else f"{key.beta_db:g}"
        row: dict[str, Any] = {"scenario": key.scenario, "motion": key.motion, "beta_db": beta}
        for name, one in measures(run, key).items():
            row |= {name: one.value, f"{name}_low": one.low, f"{name}_high": one.high}
        rows.append(row)
    return {"scenarios": pd.DataFrame(rows, dtype=object)}


_COLOURS = {0.0: SKY, 1.0: BLUE, 4.0: PURPLE}
_FIGURE_4_S = 300.0
_SEED = 4


def pictures(run: tesa.PaperRun) -> Iterator[Picture]:
    """Draw Figs. 4, 6, 7 and 8, and the outage by β, by model of motion, and with a halt."""
    time = Look(across="time / s")
    panel = Panel("", "received power / dBm", _profiles(), bottom=None)
    title = "Fig. 4: power of a base station behind, 50 km/h"
    yield "figure-4", plot_error_panels([panel], title=title, **time)

    trials = len(run.errors_m[_GNSS])
    top = 1.15 * max(float(run.errors_m[key][0].max()) for key in (_GNSS, _HYBRID))
    for figure, name, key in ((6, "GNSS", _GNSS), (7, "GNSS + GSM", _HYBRID)):
        panel = Panel("", "error / m", _one_and_mean(run, key, name, BLUE), top=top)
        title = f"Fig. {figure}: scenario 1, {name}, identity model, {trials} trials"
        yield f"figure-{figure}", plot_error_panels([panel], title=title, **time)

    alone, identity = tesa.Run(2, IDENTITY), tesa.Run(2, IDENTITY, BETA_DB)
    velocity = tesa.Run(2, VELOCITY, BETA_DB)
    panels = [
        Panel(name, "error / m", _one_and_mean(run, key, label, colour))
        for name, key, label, colour in (
            ("GNSS alone, identity model", alone, "GNSS", VERMILLION),
            ("GNSS + GSM, identity model (the paper's)", identity, "identity", BLUE),
            ("GNSS + GSM, velocity model", velocity, "velocity", ORANGE),
        )
    ]
    title = f"Fig. 8: scenario 2, β = {BETA_DB:g} dB, {trials} trials"
    yield "figure-8", plot_error_panels(panels, title=title, columns=3, **time)

    panels = []
    for motion in (IDENTITY, VELOCITY):
        by_beta = {beta: tesa.Run(2, motion, beta) for beta in scene.BETAS_DB}
        curves = [
            Curve(f"β = {beta:g} dB", run.errors_m[key].mean(axis=0), _COLOURS[beta])
            for beta, key in by_beta.items()
        ]
        panels.append(Panel(f"{motion} model", "mean error / m", curves, logarithmic=True))
    title = f"Scenario 2 by shadowing, GNSS + GSM, {trials} trials"
    yield "outage", plot_error_panels(panels, title=title, **time)

    panels = []
    for scenario, name in ((2, "scenario 2: constant speed"), (3, "scenario 3: halt")):
        compared = (
            ("GNSS alone, velocity model", tesa.Run(scenario, VELOCITY), VERMILLION),
            ("GNSS + GSM, velocity model", tesa.Run(scenario, VELOCITY, BETA_DB), ORANGE),
            ("GNSS + GSM, identity model", tesa.Run(scenario, IDENTITY, BETA_DB), BLUE),
        )
        curves = [
            Curve(label, run.errors_m[key].mean(axis=0), colour) for label, key, colour in compared
        ]
        panels.append(Panel(name, "mean error / m", curves))
    title = f"Outage with and without a halt, β = {BETA_DB:g} dB, {trials} trials"
    yield "halt", plot_error_panels(panels, title=title, **time)


def _one_and_mean(run: tesa.PaperRun, key: tesa.Run, name: str, colour: str) -> list[Curve]:
    errors = run.errors_m[key]
    one = Curve(f"{name}, one trial", errors[0], GREY)
    return [one, Curve(f"{name}, mean", errors.mean(axis=0), colour)]


def _profiles() -> list[Curve]:
    drive = straight_drive(scene.LENGTH_M * _FIGURE_4_S / scene.DURATION_S, 90.0, _FIGURE_4_S)
    free = scene.EIRP_DBM - scene.loss_at_km_db() - 20 * np.log10(drive.travelled_m / 1000.0)
    shadow = shadowing_db(drive, 1, 1.0, scene.CORRELATION_M, np.random.default_rng(_SEED))[:, 0]
    shadowed = [
        Curve(f"β = {beta:g} dB", free + beta * shadow, _COLOURS[beta])
        for beta in reversed(scene.BETAS_DB)
        if beta > 0
    ]
    return [*shadowed, Curve("free space", free, BLACK, "--")]


PAPER = Paper(
    name="tesa",
    title="TESA: GNSS and powers of GSM by a Rao-Blackwellised particle filter",
    trials=50,
    trial_limits=(2, None),
    why="a single trial has no interval",
    run=tesa.run_paper,
    summary=summary,
    tables=tables,
    pictures=pictures,
)
