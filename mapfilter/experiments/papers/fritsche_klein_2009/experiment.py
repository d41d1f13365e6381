"""Fritsche & Klein (2009): hybrid GPS and GSM tracking, its Fig. 2 and Table III, and beyond.

Beyond the paper are the smoothed GSM track and a layout in which linearised filters go astray.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from mapfilter._parallel import Progress
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
    Layout,
    Scene,
    Trials,
    draw,
    hard_layout,
    scene,
)
from mapfilter.filters.gaussian import CKF, EKF, IEKF, RBUKF, UKF
from mapfilter.filters.gaussian_sum import run_mixtures, split
from mapfilter.filters.kalman import smooth
from mapfilter.filters.trials import run_trials
from mapfilter.positioning.kalman.models import compiled

Curves = dict[str, Floats]

QUANTITIES = ("location_m", "velocity_mps", "bias_m", "drift_mps")
SUM_PARTS = MappingProxyType({0: 9, 2: 9, 1: 5, 3: 5})
"""Into how many the hard start is cut along east, north and their rates."""

FAR_M = 500.0

TABLE_III: Mapping[str, Mapping[str, tuple[float | None, ...]]] = MappingProxyType(
    {
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
)
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


@dataclass(frozen=True, eq=False)
class CombinationRun:
    """What filters and the bound make of one combination of measurements.

    Parameters
    ----------
    curves : dict
        By ``rbukf``, ``ekf``, ``pcrlb``, ... the root mean square error of each quantity at each
        step.
    astray : dict
        By filter the share of trials more than 500 m off at the end.
    """

    curves: dict[str, Curves]
    astray: dict[str, float]

    def averages(self, name: str) -> dict[str, float | None]:
        """Return the averages over time, as in Table III; None for what there is not."""
        own = self.curves[name]
        return {
            quantity: float(own[quantity].mean()) if quantity in own else None
            for quantity in QUANTITIES
        }


@dataclass(frozen=True, eq=False)
class PaperRun:
    """Everything that is drawn and told.

    Parameters
    ----------
    layout, hard_layout : Layout
    nominal : dict
        By combination.
    hard : CombinationRun
        The hard layout, GSM.
    track : (K, 2) array
        True positions of one trial.
    """

    layout: Layout
    hard_layout: Layout
    nominal: dict[str, CombinationRun]
    hard: CombinationRun
    track: Floats


def run_paper(layout: Layout, trials: int, seed: int, progress: Progress | None = None) -> PaperRun:
    """Run all filters over all combinations.

    Parameters
    ----------
    layout : Layout
    trials : int
        500 in the paper.
    seed : int
    progress : callable, optional
        Called with parts done and parts in all.
    """
    streams = np.random.default_rng(seed).spawn(len(COMBINATIONS) + 1)
    nominal: dict[str, CombinationRun] = {}
    track = np.zeros((0, 2))
    for done, (name, rng) in enumerate(zip(COMBINATIONS, streams, strict=False)):
        given = scene(name, layout)
        drawn = draw(given, trials, layout.steps, rng)
        nominal[name] = _nominal(given, drawn)
        track = drawn.states[0][:, [0, 2]]
        if progress is not None:
            progress(done + 1, len(COMBINATIONS) + 1)
    hard = hard_layout()
    given = scene("gsm", hard)
    found = _hard(given, draw(given, trials, hard.steps, streams[-1]))
    if progress is not None:
        progress(len(COMBINATIONS) + 1, len(COMBINATIONS) + 1)
    return PaperRun(layout, hard, nominal, found, track)


def bound_curves(given: Scene, states: Floats) -> Curves:
    """Return the posterior Cramér-Rao bound of each quantity over time."""
    covariance = posterior_bound(
        given.truth.transition,
        given.truth.noise,
        given.first_covariance,
        expected_information(given.measurement, states),
    )
    return {name: bound_of(covariance, own) for name, own in quantities(given.layout).items()}


def _nominal(given: Scene, drawn: Trials) -> CombinationRun:
    curves, astray = {"pcrlb": bound_curves(given, drawn.states)}, {}
    motion = given.assumed
    for method in (RBUKF, EKF):
        # Smoothing is shown for one filter of the three states: all sit on the bound.
        smoothing = method is EKF
        run = run_trials(
            compiled(given.measurement), motion.transition, motion.noise, method,
            drawn.first_means, given.first_covariance, drawn.readings, covariances=smoothing,
        )  # fmt: skip
        curves[method.name] = _curves(given, run.means, drawn.states)
        astray[method.name] = _astray(run.means, drawn.states)
        if smoothing:
            later = smooth(motion.transition, motion.noise, run.means, run.covariances)
            curves["smoothed"] = _curves(given, later.means, drawn.states)
    return CombinationRun(curves, astray)


def _hard(given: Scene, drawn: Trials) -> CombinationRun:
    curves, astray = {"pcrlb": bound_curves(given, drawn.states)}, {}
    motion = given.assumed
    for method in (EKF, RBUKF, IEKF, CKF, UKF):
        run = run_trials(
            compiled(given.measurement), motion.transition, motion.noise, method,
            drawn.first_means, given.first_covariance, drawn.readings,
        )  # fmt: skip
        curves[method.name] = _curves(given, run.means, drawn.states)
        astray[method.name] = _astray(run.means, drawn.states)
    first = split(np.zeros(given.layout.size), given.first_covariance, SUM_PARTS)
    total = run_mixtures(
        compiled(given.measurement), motion.transition, motion.noise, EKF, first,
        drawn.first_means, drawn.readings,
    )  # fmt: skip
    curves["gaussian_sum"] = _curves(given, total.means, drawn.states)
    astray["gaussian_sum"] = _astray(total.means, drawn.states)
    later = smooth(motion.transition, motion.noise, total.means, total.covariances)
    curves["gaussian_sum_smoothed"] = _curves(given, later.means, drawn.states)
    return CombinationRun(curves, astray)


def _curves(given: Scene, means: Floats, states: Floats) -> Curves:
    own = quantities(given.layout)
    return {name: rmse_over_time(means, states, parts) for name, parts in own.items()}


def _astray(means: Floats, states: Floats) -> float:
    off = means[:, -1][:, [0, 2]] - states[:, -1][:, [0, 2]]
    return float(np.mean(np.hypot(*off.T) > FAR_M))
