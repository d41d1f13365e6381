"""The pictures of the two papers on fusion."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mapfilter._types import Floats
from mapfilter.evaluation.bounds import bound_of
from mapfilter.experiments.papers.fritsche_klein_2009 import experiment as fritsche_klein
from mapfilter.experiments.papers.fritsche_klein_2009.scene import COMBINATIONS
from mapfilter.experiments.papers.zhang_2006 import experiment as zhang
from mapfilter.report.canvas import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION
from mapfilter.report.fusion import Curve, Panel, curves_of, plot_error_panels, plot_scene

_COLOURS = {"gsm": VERMILLION, "hybrid1": ORANGE, "hybrid2": BLUE}
_TITLES = {"gsm": "GSM", "hybrid1": "Hybrid 1", "hybrid2": "Hybrid 2"}
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
_KINDS = {"fusion": ("TA + RSS", BLUE), "ta": ("TA", ORANGE), "rss": ("RSS", VERMILLION)}


def draw_fritsche_klein_2009(
    run: fritsche_klein.PaperRun, trials: int, out: Path
) -> tuple[Path, ...]:
    """Draw Fig. 1, Fig. 2 by both filters, the smoothed tracks, and the hard layout."""
    names = ("figure-1", "figure-2", "figure-2-ekf", "smoothed", "hard-layout", "hard")
    paths = tuple(out / f"{name}.png" for name in names)
    for path, layout, title in (
        (paths[0], run.layout, "Fig. 1: scenario"),
        (paths[4], run.hard_layout, "Hard layout"),
    ):
        steps = np.arange(layout.steps)[:, None]
        road = run.track[:1] + steps * np.diff(run.track[:2], axis=0)
        plot_scene(
            layout.sites_m, layout.boresights_deg, layout.serving, layout.satellite_azimuths_deg,
            road if layout is run.hard_layout else run.track, path, title=title,
        )  # fmt: skip
    for path, key, name in ((paths[1], "rbukf", "RBUKF"), (paths[2], "ekf", "EKF")):
        panels = []
        for quantity, (title, label, top) in _LABELS.items():
            curves = []
            for combination in COMBINATIONS:
                own = run.nominal[combination].curves
                if quantity not in own[key]:
                    continue
                colour, told = _COLOURS[combination], _TITLES[combination]
                curves.append(Curve(f"{told}, {name}", own[key][quantity], colour))
                curves.append(Curve(f"{told}, PCRLB", own["pcrlb"][quantity], colour, "--"))
            panels.append(Panel(title, label, curves, top=top))
        plot_error_panels(panels, path, title=f"Fig. 2 with the {name}, {trials} trials")
    located = "location_m"
    panels = [
        Panel(_TITLES[name], "location RMSE / m", curves_of(_of(own.curves, located), _SMOOTHED))
        for name, own in run.nominal.items()
    ]
    plot_error_panels(panels, paths[3], title=f"Smoothing, {trials} trials", columns=3)
    hard = curves_of(_of(run.hard.curves, located), _HARD)
    plot_error_panels(
        [Panel("", "location RMSE / m", hard, top=300.0)],
        paths[5],
        title=f"Hard layout, GSM, {trials} trials",
    )
    return paths


def draw_zhang_2006(run: zhang.PaperRun, trials: int, out: Path) -> tuple[Path, ...]:
    """Draw Figs. 1 to 3, and what filters make of a start known to 5 km."""
    names = ("figure-1", "figure-2", "figure-3", "wide-start")
    paths = tuple(out / f"{name}.png" for name in names)
    found = run.bounds[zhang.SIGMA_RSS_DB]
    panels = [
        Panel(
            title,
            label,
            [
                Curve(f"PCRB, {told}", bound_of(found[kind], parts), colour, "--")
                for kind, (told, colour) in _KINDS.items()
            ],
            logarithmic=True,
        )
        for title, label, parts in (
            ("position", "bound / m", zhang.POSITION),
            ("velocity", "bound / (m/s)", zhang.VELOCITY),
        )
    ]
    plot_error_panels(panels, paths[0], title="Fig. 1: bounds, σ_d 288 m, σ_l 4 dB")
    panels = [
        Panel(
            f"σ_l = {sigma:g} dB",
            "bound on position / m",
            [
                Curve(f"PCRB, {_KINDS[kind][0]}", bound_of(own[kind], zhang.POSITION),
                      _KINDS[kind][1], "--")
                for kind in ("fusion", "rss")
            ],
            logarithmic=True,
        )
        for sigma, own in run.bounds.items()
    ]  # fmt: skip
    plot_error_panels(panels, paths[1], title="Fig. 2: bounds and the noise of levels", columns=3)
    panels = []
    for title, label, parts, errors in (
        ("position", "RMSE / m", zhang.POSITION, run.from_fix),
        ("velocity", "RMSE / (m/s)", zhang.VELOCITY, run.velocity_from_fix),
    ):
        curves = [
            Curve(f"EKF, {told}", errors[kind], colour) for kind, (told, colour) in _KINDS.items()
        ]
        curves.append(Curve("PCRB, TA + RSS", bound_of(found["fusion"], parts), BLACK, "--"))
        panels.append(Panel(title, label, curves, logarithmic=True))
    plot_error_panels(
        panels, paths[2], title=f"Fig. 3: EKF started from a timing advance, {trials} trials"
    )
    styles = {
        "ekf": ("EKF", VERMILLION, "-"), "iekf": ("iterated EKF", PURPLE, "-"),
        "ukf": ("UKF, α = 1", SKY, "-"), "gaussian_sum": ("Gaussian sum", BLUE, "-"),
    }  # fmt: skip
    panels = [
        Panel(
            _KINDS[kind][0],
            "position RMSE / m",
            [
                *curves_of(own, styles),
                Curve("PCRB", bound_of(found[kind], zhang.POSITION), GREY, "--"),
            ],
            logarithmic=True,
        )
        for kind, own in run.wide.items()
    ]
    plot_error_panels(
        panels, paths[3], title=f"Started within 5 km, σ_l 4 dB, {trials} trials", columns=3
    )
    return paths


def _of(curves: dict[str, fritsche_klein.Curves], quantity: str) -> dict[str, Floats]:
    return {name: own[quantity] for name, own in curves.items() if quantity in own}
