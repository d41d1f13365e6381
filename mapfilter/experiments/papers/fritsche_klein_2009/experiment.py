"""Fritsche & Klein (2009): hybrid GPS and GSM tracking, its Fig. 2 and Table III, and beyond.

Beyond the paper are the smoothed GSM track and a layout in which linearised filters go astray.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

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
    read_layout,
    scene,
)
from mapfilter.experiments.papers.paper import PaperSettings
from mapfilter.filters.gaussian import CKF, EKF, IEKF, RBUKF, UKF, Method
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


class CombinationRun(NamedTuple):
    """Root mean square errors by filter or bound and quantity, (K,), and how many went astray.

    ``astray`` is the share of trials more than 500 m off at the end.
    """

    curves: dict[str, Curves]
    astray: dict[str, float]

    def averages(self, name: str) -> dict[str, float | None]:
        """Return the averages over time, as in Table III; None for a state without a clock."""
        own = self.curves[name]
        return {
            quantity: float(own[quantity].mean()) if quantity in own else None
            for quantity in QUANTITIES
        }


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
    given = [scene(name, layout) for name in COMBINATIONS] + [scene("gsm", hard)]
    methods = [(RBUKF, EKF)] * len(COMBINATIONS) + [(EKF, RBUKF, IEKF, CKF, UKF)]
    streams = np.random.default_rng(settings.seed).spawn(len(given))
    track = np.zeros((0, 2))
    found: list[CombinationRun] = []
    for one, used, rng in zip(given, methods, streams, strict=True):
        is_hard = len(found) == len(COMBINATIONS)
        drawn = draw(one, settings.trials, (hard if is_hard else layout).steps, rng)
        found.append(_run_filters(one, drawn, used, with_sum=is_hard))
        if not is_hard:
            track = drawn.states[0][:, [0, 2]]
        if settings.progress is not None:
            settings.progress(len(found), len(given))
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
    parts = quantities(given.layout)
    moving = given.assumed.transition, given.assumed.noise
    model, starts = compiled(given.measurement), drawn.first_means
    found = CombinationRun({"pcrlb": bound_curves(given, drawn.states)}, {})

    def add(name: str, means: Floats, covariances: Floats | None, smoothed: str) -> None:
        shown = {name: means}
        off = means[:, -1][:, [0, 2]] - drawn.states[:, -1][:, [0, 2]]
        found.astray[name] = float(np.mean(np.hypot(*off.T) > FAR_M))
        if covariances is not None:
            shown[smoothed] = smooth(*moving, means, covariances).means
        for key, own in shown.items():
            errors = {q: rmse_over_time(own, drawn.states, at) for q, at in parts.items()}
            found.curves[key] = errors

    for method in methods:
        keep = method is EKF and not with_sum
        begin = starts, given.first_covariance
        run = run_trials(model, *moving, method, *begin, drawn.readings, covariances=keep)
        add(method.name, run.means, run.covariances if keep else None, "smoothed")
    if with_sum:
        first = split(np.zeros(given.layout.size), given.first_covariance, SUM_PARTS)
        total = run_mixtures(model, *moving, EKF, first, starts, drawn.readings)
        add("gaussian_sum", total.means, total.covariances, "gaussian_sum_smoothed")
    return found
