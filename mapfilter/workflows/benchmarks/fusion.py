"""``mapfilter bench fusion``: Kalman-type filters on the problems of Fritsche & Klein 2009."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats
from mapfilter.experiments.papers.fritsche_klein_2009.paper import bound_curves
from mapfilter.experiments.papers.fritsche_klein_2009.scene import (
    COMBINATIONS,
    Layout,
    Scene,
    Trials,
    draw,
    scene,
)
from mapfilter.filters.gaussian import EKF, RBUKF, Method
from mapfilter.filters.trials import run_trials
from mapfilter.positioning.kalman.models import compiled
from mapfilter.workflows.bench import median_seconds

_TRIALS = 500


@dataclass(frozen=True)
class FusionBench:
    """Kalman-type filters on the hybrid problem of 6 states and 10 measurements, one process.

    Figures are medians over the runs, which take turns; compilation is not counted.

    Parameters
    ----------
    trials, steps, runs : int
        The task.
    ekf_per_s, rbukf_per_s : float
        Steps of trials per second.
    table_3_s : float
        Table III of Fritsche & Klein 2009: three combinations, two filters, drawing and bounds.
    """

    trials: int
    steps: int
    runs: int
    ekf_per_s: float
    rbukf_per_s: float
    table_3_s: float


def bench_fusion(*, runs: int = 5) -> FusionBench:
    """Measure the filters of one run."""
    given = scene("hybrid2", Layout())
    steps = Layout().steps
    drawn = draw(given, _TRIALS, steps, np.random.default_rng(0))

    def run(method: Method) -> Callable[[], object]:
        return lambda: estimates(given, drawn, method, drawn.first_means, given.first_covariance)

    took_s = median_seconds({"ekf": run(EKF), "rbukf": run(RBUKF), "table": _table_3}, runs)
    ekf_per_s, rbukf_per_s = (_TRIALS * steps / took_s[name] for name in ("ekf", "rbukf"))
    return FusionBench(_TRIALS, steps, runs, ekf_per_s, rbukf_per_s, took_s["table"])


def estimates(given: Scene, drawn: Trials, method: Method, means: Floats, first: Floats) -> Floats:
    """Run a filter over trials and return its means."""
    run = run_trials(
        compiled(given.measurement),
        given.assumed.transition,
        given.assumed.noise,
        method,
        means,
        first,
        drawn.readings[: len(means)],
    )
    return run.means


def _table_3() -> None:
    rng = np.random.default_rng(1)
    for name in COMBINATIONS:
        given = scene(name, Layout())
        drawn = draw(given, _TRIALS, Layout().steps, rng)
        bound_curves(given, drawn.states)
        for method in (RBUKF, EKF):
            estimates(given, drawn, method, drawn.first_means, given.first_covariance)
