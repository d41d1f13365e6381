"""TESA's paper: its scenarios and a halt, with tables and pictures."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from mapfilter._types import Floats
from mapfilter.experiments.papers.paper import Paper, Picture, interval_columns
from mapfilter.experiments.papers.tesa import experiment as tesa
from mapfilter.experiments.papers.tesa import scene
from mapfilter.experiments.papers.tesa.experiment import IDENTITY, KNOWN_BEARING, VELOCITY, Motion
from mapfilter.experiments.papers.tesa.scene import ASSUMPTIONS, BETA_DB
from mapfilter.report.canvas import BLACK, BLUE, GREY, ORANGE, PURPLE, SKY, VERMILLION, Look
from mapfilter.report.curves import Curve, Panel, plot_error_panels
from mapfilter.simulation.drives import shadowing_db, straight_drive

AVAILABLE_M = 100.0

CLAIMS = (
    "Figs. 6 and 7: with powers of GSM the accuracy improves slightly",
    "Fig. 8: without satellites a position is still available, with a far larger error",
)
"""The paper's claims; it prints no values."""

_GNSS, _HYBRID = tesa.Run(1, IDENTITY), tesa.Run(1, IDENTITY, BETA_DB)


class Estimate(NamedTuple):
    """A mean over trials, and its 95 % interval by Student's t."""

    value: float
    low: float
    high: float


def estimate(values: Floats, least: float = -inf, most: float = inf) -> Estimate:
    """Return the mean over trials of (T,) values, its interval cut to what is possible.

    Examples
    --------
    >>> found = estimate(np.array([1.0, 3.0]), least=0.0)
    >>> found.value, found.low, round(found.high, 2)
    (2.0, 0.0, 14.71)
    """
    mean, half = float(np.mean(values)), 0.0
    if values.size > 1:
        factor = float(stdtrit(values.size - 1, 0.975))
        half = factor * float(np.std(values, ddof=1)) / float(np.sqrt(values.size))
    return Estimate(mean, max(mean - half, least), min(mean + half, most))


def rows_of(run: tesa.PaperRun) -> dict[tesa.Run, dict[str, Any]]:
    """Return every filter over every scenario: means over trials, and their 95 % intervals.

    The error over all epochs and over those of the outage; shares of the outage's epochs and of all
    with less than 100 m of error. ``beta_db`` is None without GSM.
    """
    found: dict[tesa.Run, dict[str, Any]] = {}
    for key in tesa.RUNS:
        errors, outage = run.errors_m[key], run.scene.outage
        near = errors < AVAILABLE_M
        found[key] = row = key._asdict()
        for name, interval, values, most in (
            ("mean_m", "mean_interval_m", errors, inf),
            ("outage_m", "outage_interval_m", errors[:, outage], inf),
            ("below_100m", "below_interval", near[:, outage], 1.0),
            ("availability", "availability_interval", near, 1.0),
        ):
            row[name], *ends = estimate(values.mean(axis=1), 0.0, most)
            row[interval] = tuple(ends)
    return found


def summary(run: tesa.PaperRun) -> dict[str, Any]:
    """Return mean errors by scenario, and all filters by β.

    Errors are norms in three dimensions, β = 1 dB. ``scenario1``: five satellites all the way, by
    the identity model, without and with GSM. ``scenario2``: over an outage of 200 s, and shares of
    all 720 s and of the outage with less than 100 m of error; ``hybrid_outage_m``, by the velocity
    model, is the headline; only ``hybrid_known_bearing_outage_m`` uses the true bearing of the
    road. ``scenario3``: over the same outage where the vehicle halts in it, which is not in the
    paper: at constant speed a velocity model keeps its position even without levels.
    ``hybrid_less_gnss_m``: of scenario 1, trial by trial; below 0 where GSM helps. ``rows``: see
    :func:`rows_of`.
    """
    rows = rows_of(run)

    def of(name: str, scenario: int, motion: Motion, beta: float | None = BETA_DB) -> Any:
        return rows[tesa.Run(scenario, motion, beta)][name]

    gain = estimate((run.errors_m[_HYBRID] - run.errors_m[_GNSS]).mean(axis=1))
    return {
        "scenario1": {
            "gnss_m": of("mean_m", 1, IDENTITY, None),
            "hybrid_m": of("mean_m", 1, IDENTITY),
        },
        "scenario2": {
            "hybrid_outage_m": of("outage_m", 2, VELOCITY),
            "hybrid_outage_interval_m": of("outage_interval_m", 2, VELOCITY),
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
        "rows": list(rows.values()),
        "claims": CLAIMS,
        "trials": len(run.errors_m[_GNSS]),
        "assumptions": ASSUMPTIONS,
    }


def tables(run: tesa.PaperRun) -> dict[str, pd.DataFrame]:
    """Return all filters over all scenarios."""
    found = []
    for row in rows_of(run).values():
        beta = None if row["beta_db"] is None else f"{row['beta_db']:g}"
        found.append(interval_columns(row | {"beta_db": beta}))
    return {"scenarios": pd.DataFrame(found, dtype=object)}


_COLOURS = {0.0: SKY, 1.0: BLUE, 4.0: PURPLE}
_FIGURE_4_S = 300.0
_SEED = 4


def pictures(run: tesa.PaperRun) -> Iterator[Picture]:
    """Draw Figs. 4, 6, 7 and 8, and the outage by β, by model of motion, and with a halt."""
    time, trials = Look(across="time / s"), f"{len(run.errors_m[_GNSS])} trials"

    def mean(name: str, key: tesa.Run, colour: str) -> Curve:
        return Curve(name, run.errors_m[key].mean(axis=0), colour)

    def one_and_mean(name: str, key: tesa.Run, colour: str) -> list[Curve]:
        one = Curve(f"{name}, one trial", run.errors_m[key][0], GREY)
        return [one, mean(f"{name}, mean", key, colour)]

    panel = Panel("", "received power / dBm", _profiles(), bottom=None)
    title = "Fig. 4: power of a base station behind, 50 km/h"
    yield "figure-4", plot_error_panels([panel], title=title, **time)

    top = 1.15 * max(float(run.errors_m[key][0].max()) for key in (_GNSS, _HYBRID))
    for figure, name, key in ((6, "GNSS", _GNSS), (7, "GNSS + GSM", _HYBRID)):
        panel = Panel("", "error / m", one_and_mean(name, key, BLUE), top=top)
        title = f"Fig. {figure}: scenario 1, {name}, identity model, {trials}"
        yield f"figure-{figure}", plot_error_panels([panel], title=title, **time)

    panels = [
        Panel(name, "error / m", one_and_mean(label, tesa.Run(2, motion, beta), colour))
        for name, label, motion, beta, colour in (
            ("GNSS alone, identity model", "GNSS", IDENTITY, None, VERMILLION),
            ("GNSS + GSM, identity model (the paper's)", "identity", IDENTITY, BETA_DB, BLUE),
            ("GNSS + GSM, velocity model", "velocity", VELOCITY, BETA_DB, ORANGE),
        )
    ]
    title = f"Fig. 8: scenario 2, β = {BETA_DB:g} dB, {trials}"
    yield "figure-8", plot_error_panels(panels, title=title, columns=3, **time)

    panels = []
    for motion in (IDENTITY, VELOCITY):
        curves = [
            mean(f"β = {beta:g} dB", tesa.Run(2, motion, beta), _COLOURS[beta])
            for beta in scene.BETAS_DB
        ]
        panels.append(Panel(f"{motion} model", "mean error / m", curves, logarithmic=True))
    title = f"Scenario 2 by shadowing, GNSS + GSM, {trials}"
    yield "outage", plot_error_panels(panels, title=title, **time)

    panels = []
    for scenario, name in ((2, "scenario 2: constant speed"), (3, "scenario 3: halt")):
        curves = [
            mean("GNSS alone, velocity model", tesa.Run(scenario, VELOCITY), VERMILLION),
            mean("GNSS + GSM, velocity model", tesa.Run(scenario, VELOCITY, BETA_DB), ORANGE),
            mean("GNSS + GSM, identity model", tesa.Run(scenario, IDENTITY, BETA_DB), BLUE),
        ]
        panels.append(Panel(name, "mean error / m", curves))
    title = f"Outage with and without a halt, β = {BETA_DB:g} dB, {trials}"
    yield "halt", plot_error_panels(panels, title=title, **time)


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
