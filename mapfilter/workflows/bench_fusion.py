"""``mapfilter bench fusion``: Kalman-type filters against filterpy, and the time of Table III."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median

import numpy as np
from numba import njit

from mapfilter._types import Floats
from mapfilter.errors import ConfigError, fail
from mapfilter.experiments.papers.fritsche_klein_2009.experiment import bound_curves
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

_TRIALS = 500


@dataclass(frozen=True)
class FusionBench:
    """Trial-steps per second on the hybrid problem of 6 states and 10 measurements, one process.

    Seconds and rates are medians over the runs, which take turns; compilation is not counted.

    Parameters
    ----------
    trials, steps, runs : int
        The task.
    ekf_per_s, rbukf_per_s : float
        Ours.
    peer_ekf_per_s, peer_ukf_per_s : float
        filterpy's extended and unscented filters with the same models, over fewer trials.
    ekf_ratio, rbukf_ratio : float
        Ours over filterpy's.
    largest_difference : float
        Between our EKF's and filterpy's means, in standard deviations.
    table_3_s : float
        All of Table III: three combinations, two filters, their drawing and bounds.
    """

    trials: int
    steps: int
    runs: int
    ekf_per_s: float
    rbukf_per_s: float
    peer_ekf_per_s: float
    peer_ukf_per_s: float
    ekf_ratio: float
    rbukf_ratio: float
    largest_difference: float
    table_3_s: float


def bench_fusion(*, runs: int = 5) -> FusionBench:
    """Measure the filters of one run against filterpy.

    Raises
    ------
    ConfigError
        filterpy is not installed.
    """
    given = scene("hybrid2", Layout())
    steps = Layout().steps
    drawn = draw(given, _TRIALS, steps, np.random.default_rng(0))
    # The peers take what a wide clock leaves: they lose positive definiteness with 300 km.
    first = given.first_covariance.copy()
    first[4, 4] = 300.0**2 / 3
    means = drawn.first_means.copy()
    means[:, 4] = drawn.states[:, 0, 4]
    peer_steps = 100
    results: dict[str, Floats] = {}

    def ours(method: Method, count: int) -> Callable[[], object]:
        def run() -> None:
            results[method.name] = _ours(given, drawn, method, means[:count], first)

        return run

    def ekf_peer() -> None:
        results["peer"] = _peer_ekf(given, drawn.readings[0, :peer_steps], means[0], first)

    tasks: dict[str, tuple[Callable[[], object], int]] = {
        "ekf": (ours(EKF, _TRIALS), _TRIALS * steps),
        "peer_ekf": (ekf_peer, peer_steps),
        "rbukf": (ours(RBUKF, _TRIALS), _TRIALS * steps),
        "peer_ukf": (
            lambda: _peer_ukf(given, drawn.readings[0, :peer_steps], means[0], first),
            peer_steps,
        ),
        "table": (_table_3, 1),
    }
    rates: dict[str, list[float]] = {name: [] for name in tasks}
    for turn in range(runs + 1):
        for name, (task, count) in tasks.items():
            began_s = time.perf_counter()
            task()
            if turn > 0:
                rates[name].append(count / (time.perf_counter() - began_s))
    rate = {name: median(own) for name, own in rates.items()}
    deviation = np.sqrt(np.diagonal(given.assumed.noise)) + 1.0
    off = np.abs(results["ekf"][0, :peer_steps] - results["peer"]) / deviation
    return FusionBench(
        _TRIALS, steps, runs, rate["ekf"], rate["rbukf"], rate["peer_ekf"], rate["peer_ukf"],
        rate["ekf"] / rate["peer_ekf"], rate["rbukf"] / rate["peer_ukf"], float(off.max()),
        1 / rate["table"],
    )  # fmt: skip


def _ours(given: Scene, drawn: Trials, method: Method, means: Floats, first: Floats) -> Floats:
    run = run_trials(
        compiled(given.measurement), given.assumed.transition, given.assumed.noise, method, means,
        first, drawn.readings[: len(means)],
    )  # fmt: skip
    return run.means


def _table_3() -> None:
    rng = np.random.default_rng(1)
    for name in COMBINATIONS:
        given = scene(name, Layout())
        drawn = draw(given, _TRIALS, Layout().steps, rng)
        bound_curves(given, drawn.states)
        for method in (RBUKF, EKF):
            _ours(given, drawn, method, drawn.first_means, given.first_covariance)


@njit(cache=True)
def _mean(x: Floats, sats: Floats, sites: Floats, boresight: Floats) -> Floats:  # pragma: no cover
    """Return the hybrid measurement, compiled for filterpy, too: it costs the peer nothing."""
    found = np.empty(10)
    for i in range(2):
        up = np.sqrt((x[0] - sats[i, 0]) ** 2 + (x[2] - sats[i, 1]) ** 2 + sats[i, 2] ** 2)
        found[i] = up + x[4]
    for i in range(7):
        east, north = x[0] - sites[i, 0], x[2] - sites[i, 1]
        distance = np.sqrt(east**2 + north**2)
        if i == 0:
            found[2] = distance
        angle = (np.arctan2(north, east) - boresight[i] + np.pi) % (2 * np.pi) - np.pi
        gain = -min(12 * (angle / (np.pi / 3)) ** 2, 20.0)
        found[3 + i] = 50.0 - (132.8 + 38.0 * np.log10(distance / 1000.0)) + gain
    return found


@njit(cache=True)
def _jacobian(
    x: Floats, sats: Floats, sites: Floats, boresight: Floats
) -> Floats:  # pragma: no cover
    slope = np.zeros((10, 6))
    for i in range(2):
        east, north = x[0] - sats[i, 0], x[2] - sats[i, 1]
        up = np.sqrt(east**2 + north**2 + sats[i, 2] ** 2)
        slope[i, 0], slope[i, 2], slope[i, 4] = east / up, north / up, 1.0
    for i in range(7):
        east, north = x[0] - sites[i, 0], x[2] - sites[i, 1]
        squared = east**2 + north**2
        if i == 0:
            slope[2, 0], slope[2, 2] = east / np.sqrt(squared), north / np.sqrt(squared)
        angle = (np.arctan2(north, east) - boresight[i] + np.pi) % (2 * np.pi) - np.pi
        ratio = angle / (np.pi / 3)
        turn = -24 * ratio / (np.pi / 3) if 12 * ratio**2 < 20.0 else 0.0
        fall = -38.0 / np.log(10.0)
        slope[3 + i, 0] = (fall * east - turn * north) / squared
        slope[3 + i, 2] = (fall * north + turn * east) / squared
    return slope


def _peer_arguments() -> tuple[Floats, Floats, Floats]:
    layout = Layout()
    sites, boresights = np.array(layout.sites_m), np.radians(layout.boresights_deg)
    return layout.satellites_m(2), sites, boresights


def _peer_ekf(given: Scene, readings: Floats, mean: Floats, first: Floats) -> Floats:
    try:
        from filterpy.kalman import ExtendedKalmanFilter
    except ImportError as error:
        raise fail(ConfigError, "bench fusion", "the package filterpy", "none") from error
    model, peer = _peer_arguments(), ExtendedKalmanFilter(dim_x=6, dim_z=10)
    peer.x, peer.P = mean.copy(), first.copy()
    peer.F, peer.Q = given.assumed.transition, given.assumed.noise
    peer.R = given.measurement.covariance()
    found = np.empty((len(readings), 6))
    for k, reading in enumerate(readings):
        peer.predict()
        peer.update(reading, _jacobian, _mean, args=model, hx_args=model)
        found[k] = peer.x
    return found


def _peer_ukf(given: Scene, readings: Floats, mean: Floats, first: Floats) -> None:
    from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

    model, phi = _peer_arguments(), given.assumed.transition
    # With α = 1e-3 its covariances lose positive definiteness; the work is the same.
    points = MerweScaledSigmaPoints(6, 1.0, 2.0, 0.0)
    peer = UnscentedKalmanFilter(
        6, 10, 0.48, lambda x: _mean(x, *model), lambda x, _: phi @ x, points
    )
    peer.x, peer.P, peer.Q = mean.copy(), first.copy(), given.assumed.noise
    peer.R = given.measurement.covariance()
    for reading in readings:
        peer.predict()
        peer.update(reading)
