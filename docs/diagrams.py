"""Pictures of the pages, drawn by each build of the documentation from small made cases."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from mapfilter.evaluation.intervals import share_interval
from mapfilter.evaluation.stanford import stanford_bins, stanford_counts
from mapfilter.positioning.gaussian_tail import GaussianTail
from mapfilter.positioning.integrity import sample_tail
from mapfilter.report.canvas import BLUE, GREY, ORANGE, VERMILLION, new_figure, styled, tidy
from mapfilter.report.integrity import plot_coverage, plot_stanford
from mapfilter.report.saving import save
from mapfilter.workflows.evaluations.foreign import load_foreign, run_foreign

SMALL_CITY = (
    'area.map="manhattan"',
    "area.size_m=600,600",
    "area.resolution_m=10",
    "cells.sites=2",
    "cells.indoor=1",
    "journeys.length_m=600",
)
SHARES = (50, 67, 95, 99)


def draw(folder: Path, made: int = 20_000) -> list[Path]:
    """Draw all pictures into a folder, those of made epochs with a number of them."""
    folder.mkdir(parents=True, exist_ok=True)
    return [
        draw_tails(folder / "protection-tail.png"),
        draw_stanford(folder / "protection-stanford.png", made),
        draw_coverage(folder / "coverage-made.png"),
        draw_worst(folder / "worst-run.png"),
    ]


@styled
def draw_tails(path: Path, count: int = 300, sd_m: float = 6.0) -> Path:
    """Draw the tail of a normal belief, of samples of it, and the levels of three risks."""
    rng = np.random.default_rng(12)
    places = (sd_m * rng.standard_normal((2, count))).astype(np.float32)
    weight = np.full(count, 1 / count, dtype=np.float32)
    tail = sample_tail(*places, weight, (0.0, 0.0), 0.0)
    exact = GaussianTail(np.ones(1), np.zeros((1, 2)), sd_m**2 * np.eye(2)[np.newaxis])
    radius_m = np.linspace(0.05, 48.0, 400)
    risks = np.logspace(-0.3, -5.3, 120)
    axes = new_figure(8.0, 4.6).subplots()
    outside = [exact.outside(r) for r in radius_m]
    axes.plot(radius_m, outside, color=GREY, linewidth=1.5, label="normal belief, 6 m: exact")
    held = [tail.outside(r) for r in radius_m]
    axes.step(radius_m, held, color=BLUE, where="post", label=f"{count} samples of it")
    levels_m = [tail.protection_m(risk) for risk in risks]
    axes.plot(levels_m, risks, color=VERMILLION, label="protection level of the samples")
    for risk in (1e-2, 1e-3, 1e-5):
        level_m = tail.protection_m(risk)
        axes.plot([0, level_m], [risk, risk], color=ORANGE, linewidth=1.0, linestyle="--")
        text = f"risk {risk:g}: {level_m:.0f} m (exact {exact.protection_m(risk):.0f} m)"
        axes.annotate(text, (0.6, risk), (0, 4), textcoords="offset points", fontsize=9)
    axes.set(yscale="log", ylim=(4e-6, 1.3), xlim=(0, 48))
    axes.set(xlabel="distance from the reported position / m", ylabel="probability beyond")
    axes.yaxis.set_major_formatter("{x:g}")
    tidy(axes)
    axes.legend(loc="upper right", frameon=False)
    return save(axes, path)


def made_epochs(narrowed: float, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return errors and levels of made beliefs of 1000 samples, each deviation divided."""
    rng = np.random.default_rng(seed)
    errors, levels = np.empty(count), np.empty(count)
    weight = np.full(1000, 1e-3, dtype=np.float32)
    for i in range(count):
        sd_m = 5.0 * np.exp(0.45 * rng.standard_normal())
        samples = (sd_m / narrowed * rng.standard_normal((2, 1000))).astype(np.float32)
        levels[i] = sample_tail(*samples, weight, (0.0, 0.0), 0.0).protection_m(1e-3)
        errors[i] = np.hypot(*(sd_m * rng.standard_normal(2)))
    return errors, levels


@styled
def draw_stanford(path: Path, count: int) -> Path:
    """Draw the Stanford diagrams of calibrated beliefs, and of beliefs that are too narrow."""
    figure = new_figure(12.4, 5.8)
    for axes, (name, narrowed) in zip(
        figure.subplots(1, 2),
        (("calibrated beliefs", 1.0), ("deviations half as large as the errors", 2.0)),
        strict=True,
    ):
        errors, levels = made_epochs(narrowed, count, 5)
        counts = stanford_counts(errors, levels, 50.0)
        plot_stanford(stanford_bins(errors, levels, 50.0), counts, 50.0, axes, title=name)
    return save(figure, path)


def draw_coverage(path: Path, journeys: int = 60, epochs: int = 500) -> Path:
    """Draw the coverage of made radii, over journeys whose epochs share half of their variance."""
    rng = np.random.default_rng(2)
    cases = {}
    for name, scale in (("calibrated", 1.0), ("too narrow", 1.6), ("too wide", 0.7)):
        common = rng.standard_normal((2, journeys, 1))
        own = rng.standard_normal((2, journeys, epochs))
        errors = scale * np.hypot(*(common + own)) / np.sqrt(2)
        triples = []
        for share in SHARES:
            held = (errors <= np.sqrt(-2 * np.log(1 - share / 100))).sum(axis=1)
            whole = np.full(journeys, epochs)
            triples.append((held.sum() / whole.sum(), *share_interval(held, whole)))
        cases[name] = triples
    axes = plot_coverage(cases, SHARES, title=f"{journeys} journeys of {epochs} epochs")
    return save(axes, path)


def draw_worst(path: Path) -> Path:
    """Run a small benchmark, and keep the picture of its worst run."""
    config, fixed = load_foreign(None, SMALL_CITY)
    with TemporaryDirectory() as folder:
        out = Path(folder)
        given = {"runs": 2, "seed": 3, "cases": ("cell-6",), "workers": 1, "fixed": fixed}
        run_foreign(config, "foreign", out, **given)
        path.write_bytes((out / "pictures" / "cell-6-worst.png").read_bytes())
    return path


if __name__ == "__main__":
    draw(Path(__file__).parent / "_static" / "drawn")
