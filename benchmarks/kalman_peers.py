"""Kalman-type filters against filterpy, on the hybrid problem of Fritsche & Klein (2009).

Run by hand, after ``pip install filterpy``: ``python benchmarks/kalman_peers.py``.
Rates are medians over repetitions that take turns; compilation is not counted.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from filterpy.kalman import (
    ExtendedKalmanFilter,
    MerweScaledSigmaPoints,
    UnscentedKalmanFilter,
)
from numba import njit

from mapfilter._types import Floats
from mapfilter.experiments.papers.fritsche_klein_2009.scene import Layout, Scene, draw, scene
from mapfilter.filters.gaussian import EKF, RBUKF, Method
from mapfilter.workflows.bench import median_seconds
from mapfilter.workflows.benchmarks.fusion import estimates

_TRIALS, _PEER_STEPS, _RUNS = 500, 100, 5


def compare(trials: int = _TRIALS, runs: int = _RUNS) -> tuple[dict[str, float], float]:
    """Measure trial-steps per second, and how far the two EKFs are apart.

    Returns
    -------
    rates : dict of str to float
    largest_difference : float
        Between the EKFs' means, in standard deviations.
    """
    given = scene("hybrid2", Layout())
    drawn = draw(given, trials, Layout().steps, np.random.default_rng(0))
    # With a clock of 300 km filterpy's covariances lose positive definiteness.
    first = given.first_covariance.copy()
    first[4, 4] = 300.0**2 / 3
    means = drawn.first_means.copy()
    means[:, 4] = drawn.states[:, 0, 4]
    readings = drawn.readings[0, :_PEER_STEPS]
    results: dict[str, Floats] = {}

    def ours(method: Method) -> Callable[[], object]:
        def run() -> None:
            results[method.name] = estimates(given, drawn, method, means, first)

        return run

    def ekf_peer() -> None:
        results["peer"] = _peer_ekf(given, readings, means[0], first)

    steps = trials * Layout().steps
    tasks: dict[str, tuple[Callable[[], object], int]] = {
        "ekf": (ours(EKF), steps),
        "filterpy ekf": (ekf_peer, _PEER_STEPS),
        "rbukf": (ours(RBUKF), steps),
        "filterpy ukf": (lambda: _peer_ukf(given, readings, means[0], first), _PEER_STEPS),
    }
    took_s = median_seconds({name: task for name, (task, _) in tasks.items()}, runs)
    rates = {name: count / took_s[name] for name, (_, count) in tasks.items()}
    deviation = np.sqrt(np.diagonal(given.assumed.noise)) + 1.0
    off = np.abs(results["ekf"][0, :_PEER_STEPS] - results["peer"]) / deviation
    return rates, float(off.max())


@njit(cache=True)
def _mean(x: Floats, sats: Floats, sites: Floats, boresight: Floats) -> Floats:  # pragma: no cover
    """Return the hybrid measurement; compiled for filterpy, too, so that it costs nothing there."""
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


def main() -> None:
    """Print a line for each filter."""
    rates, off = compare()
    for name, rate in rates.items():
        print(f"{name}: {rate:.0f} steps of trials per second")
    print(f"largest difference of the EKFs: {off:.1e} standard deviations")


if __name__ == "__main__":
    main()
