"""The pictures of TESA's scenarios."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mapfilter.experiments.papers.tesa import experiment as tesa
from mapfilter.experiments.papers.tesa import scene
from mapfilter.experiments.papers.tesa.models import IDENTITY, VELOCITY
from mapfilter.report.canvas import BLACK, BLUE, GREY, ORANGE, PURPLE, SKY, VERMILLION
from mapfilter.report.fusion import Curve, Panel, plot_error_panels
from mapfilter.simulation.drives import Drive, shadowing_db, straight_drive

_ACROSS = "time / s"
_COLOURS = {0.0: SKY, 1.0: BLUE, 4.0: PURPLE}
_FIGURE_4_S = 300.0
_SEED = 4


def draw_tesa(run: tesa.PaperRun, out: Path) -> tuple[Path, ...]:
    """Draw Figs. 4, 6, 7 and 8, and the outage by β, by model of motion, and with a halt."""
    paths = tuple(out / f"{name}.png" for name in (
        "figure-4", "figure-6", "figure-7", "figure-8", "outage", "halt",
    ))  # fmt: skip
    drive = straight_drive(scene.LENGTH_M * _FIGURE_4_S / scene.DURATION_S, 90.0, _FIGURE_4_S)
    plot_error_panels(
        [Panel("", "received power / dBm", _profiles(drive), bottom=None)],
        paths[0], title="Fig. 4: power of a base station behind, 50 km/h", across=_ACROSS,
    )  # fmt: skip
    beta = scene.BETA_DB
    first = {"GNSS": tesa.Run(1, "identity"), "GNSS + GSM": tesa.Run(1, "identity", beta)}
    trials = len(run.errors_m[first["GNSS"]])
    top = 1.15 * max(float(run.errors_m[key][0].max()) for key in first.values())
    for path, figure, name in zip(paths[1:3], ("6", "7"), first, strict=True):
        plot_error_panels(
            [Panel("", "error / m", _of(run, first[name], name, BLUE), top=top)], path,
            title=f"Fig. {figure}: scenario 1, {name}, identity model, {trials} trials",
            across=_ACROSS,
        )  # fmt: skip
    panels = [
        Panel("GNSS alone, identity model", "error / m",
              _of(run, tesa.Run(2, "identity"), "GNSS", VERMILLION)),
        Panel("GNSS + GSM, identity model (the paper's)", "error / m",
              _of(run, tesa.Run(2, "identity", beta), "identity", BLUE)),
        Panel("GNSS + GSM, velocity model", "error / m",
              _of(run, tesa.Run(2, "velocity", beta), "velocity", ORANGE)),
    ]  # fmt: skip
    title = f"Fig. 8: scenario 2, β = {beta:g} dB, {trials} trials"
    plot_error_panels(panels, paths[3], title=title, columns=3, across=_ACROSS)
    panels = [
        Panel(
            f"{motion} model", "mean error / m",
            [
                Curve(f"β = {beta:g} dB", run.errors_m[tesa.Run(2, motion, beta)].mean(axis=0),
                      _COLOURS[beta])
                for beta in scene.BETAS_DB
            ],
            logarithmic=True,
        )
        for motion in (IDENTITY, VELOCITY)
    ]  # fmt: skip
    title = f"Scenario 2 by shadowing, GNSS + GSM, {trials} trials"
    plot_error_panels(panels, paths[4], title=title, across=_ACROSS)
    panels = [
        Panel(name, "mean error / m", _compared(run, scenario, beta))
        for scenario, name in ((2, "scenario 2: constant speed"), (3, "scenario 3: halt"))
    ]
    title = f"Outage with and without a halt, β = {beta:g} dB, {trials} trials"
    plot_error_panels(panels, paths[5], title=title, across=_ACROSS)
    return paths


def _compared(run: tesa.PaperRun, scenario: int, beta: float) -> list[Curve]:
    compared = (
        ("GNSS alone, velocity model", tesa.Run(scenario, "velocity"), VERMILLION),
        ("GNSS + GSM, velocity model", tesa.Run(scenario, "velocity", beta), ORANGE),
        ("GNSS + GSM, identity model", tesa.Run(scenario, "identity", beta), BLUE),
    )
    return [Curve(name, run.errors_m[key].mean(axis=0), colour) for name, key, colour in compared]


def _of(run: tesa.PaperRun, key: tesa.Run, name: str, colour: str) -> list[Curve]:
    errors = run.errors_m[key]
    return [
        Curve(f"{name}, one trial", errors[0], GREY),
        Curve(f"{name}, mean", errors.mean(axis=0), colour),
    ]


def _profiles(drive: Drive) -> list[Curve]:
    free = scene.EIRP_DBM - scene.loss_at_km_db() - 20 * np.log10(drive.travelled_m / 1000.0)
    shadow = shadowing_db(drive, 1, 1.0, scene.CORRELATION_M, np.random.default_rng(_SEED))[:, 0]
    shadowed = [
        Curve(f"β = {beta:g} dB", free + beta * shadow, _COLOURS[beta])
        for beta in reversed(scene.BETAS_DB)
        if beta > 0
    ]
    return [*shadowed, Curve("free space", free, BLACK, "--")]
