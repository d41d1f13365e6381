"""DLR: the runs of filters by satellites and LTE time differences, and their errors on tracks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import Literal, NamedTuple

import numpy as np

from mapfilter._parallel import SerialExecutor, ordered_results
from mapfilter._types import Bools, Floats, Ints
from mapfilter.evaluation.track_percentiles import Percentile, percentile_of_tracks
from mapfilter.experiments.papers.dlr.filters import (
    FIRST_M,
    FIXES,
    FLAT,
    HYBRID,
    PARTICLES,
    PLACE,
    Epoch,
    Mobility,
    differences,
    joined,
    motion,
    run_ekf,
    run_pf,
    run_static,
    satellites,
    start,
)
from mapfilter.experiments.papers.dlr.scene import (
    ECHO_M,
    EDGE,
    NEAR,
    THRESHOLD_DB,
    Readings,
    Scene,
    Track,
    Where,
    dlr_scene,
    draw_readings,
    draw_track,
)
from mapfilter.experiments.papers.paper import PaperSettings
from mapfilter.models.state import POSITION_CLOCK_3D, StateLayout
from mapfilter.positioning.kalman.static_fix import filter_fixes

Name = Literal["static", "pkf", "ekf", "pf"]
Systems = Literal["none", "gps", "gps+galileo"]

FEW = 4
"""Fewer satellites than this are a critical situation."""

DRAWS = 40
"""Draws of the readings of the one track of Fig. 12."""

SHARE = 0.9
"""Share of the epochs whose largest error is compared."""

PUBLISHED: dict[str, dict[str, float | None]] = {
    "all": {"static": 40.0, "pkf": 27.0, "ekf": 9.0, "pf": None},
    "tdoa_only": {"ekf_edge": None, "pf_edge": 40.0, "pf_near": None},
    "hybrid": {"ekf_gnss": 17.0, "ekf_edge": 10.0, "ekf_near": None, "fixed3_edge": None},
    "critical": {"gps": 30.0, "gps_galileo": 18.0, "near": 15.0, "edge": 11.0},
}
"""The paper's 90 % errors in metres, where its text prints them (Figs. 7 to 10)."""

THRESHOLDS_DB = (-8.0, -11.0, -14.0, -17.0, -20.0, -23.0, -26.0)


class Run(NamedTuple):
    """One filter on one kind of measurements.

    Time differences are measured ``where`` in the network (None: they are not), of the stations
    with a SINR above ``above_db`` (None: of the three best ones). Under the open sky there are
    neither houses nor echoes.
    """

    filter: Name
    satellites: Systems = "gps+galileo"
    where: Where | None = None
    above_db: float | None = None
    open_sky: bool = False
    mobility: Mobility = "diagonal"


STATIC, PKF, EKF, PF = Run("static"), Run("pkf"), Run("ekf"), Run("pf")
GPS = Run("ekf", "gps")
AT_EDGE = Run("ekf", where=EDGE, above_db=THRESHOLD_DB)
AT_NEAR = Run("ekf", where=NEAR, above_db=THRESHOLD_DB)
FIXED_EDGE, FIXED_NEAR = Run("ekf", where=EDGE), Run("ekf", where=NEAR)
TDOA_STATIC, TDOA_PKF = Run("static", "none", EDGE), Run("pkf", "none", EDGE)
TDOA_EKF, TDOA_PF = Run("ekf", "none", EDGE), Run("pf", "none", EDGE)
TDOA_EKF_NEAR, TDOA_PF_NEAR = Run("ekf", "none", NEAR), Run("pf", "none", NEAR)
_SYSTEMS: tuple[Systems, ...] = ("gps", "gps+galileo")
RUNS = (
    *(STATIC, PKF, EKF, PF, Run("static", "gps"), GPS),
    *(Run(name, one, open_sky=True) for one in _SYSTEMS for name in ("static", "ekf")),
    *(TDOA_STATIC, TDOA_PKF, TDOA_EKF, TDOA_PF, TDOA_EKF_NEAR, TDOA_PF_NEAR),
    *(FIXED_EDGE, FIXED_NEAR),
    *(Run("ekf", where=where, above_db=above) for where in (EDGE, NEAR) for above in THRESHOLDS_DB),
    Run("ekf", mobility="discretised"),
    Run("ekf", where=EDGE, above_db=THRESHOLD_DB, mobility="discretised"),
)
OVER_TIME = (EKF, AT_NEAR, AT_EDGE)
"""What Fig. 12 compares."""


class TrackErrors(NamedTuple):
    """The errors of all filters on one track, (runs, K); NaN where there is no static fix.

    Satellites seen at each epoch, (K,), are those of both systems, and those of GPS.
    """

    errors_m: Floats
    satellites: Ints
    gps: Ints


def errors_of(
    run: Run,
    scene: Scene,
    track: Track,
    readings: Readings,
    about_m: Floats,
    rng: np.random.Generator,
    particles: int = PARTICLES,
) -> Floats:
    """Return a filter's error at each epoch, (K,); ``about_m`` is where its belief begins."""
    clock = run.satellites != "none"
    if run.filter in ("static", "pkf"):
        layout = POSITION_CLOCK_3D if clock else PLACE
        fixes = run_static(layout, _epochs(run, layout, scene, track, readings))
        if run.filter == "static":
            found = np.array([fix.state[:2] for fix in fixes])
        else:
            layout = FIXES if clock else FLAT
            first = start(layout, about_m)
            own = filter_fixes(layout, motion(layout), first.mean, first.covariance, fixes)
            found = own.means[:, [0, 2]]
    else:
        layout = HYBRID if clock else FLAT
        epochs = _epochs(run, layout, scene, track, readings)
        if run.filter == "ekf":
            found = run_ekf(layout, epochs, about_m, run.mobility)
        else:
            found = run_pf(layout, epochs, about_m, rng, particles)
    return np.asarray(np.hypot(*(found - track.place_m[:, :2]).T))


def _epochs(
    run: Run, layout: StateLayout, scene: Scene, track: Track, readings: Readings
) -> list[Epoch]:
    seen: list[Epoch] = []
    if run.satellites != "none":
        used = track.gps if run.satellites == "gps" else np.ones_like(track.gps)
        ranges = readings.open_m if run.open_sky else readings.ranges_m
        sigma = track.sigma_m if run.open_sky else np.hypot(track.sigma_m, ECHO_M)
        seen = satellites(layout, track.satellites_m[used], sigma[used], ranges[:, used])
    if run.where is None:
        return seen
    stations, sinr = scene.stations_m[run.where], track.sinr_db[run.where]
    times = readings.times_m[run.where]
    received = differences(layout, stations, sinr, times, run.above_db)
    return joined(seen, received) if seen else received


def track_errors(
    trial: int, seed: int, particles: int = PARTICLES, runs: Sequence[Run] = RUNS
) -> TrackErrors:
    """Draw a track and its readings, and run all filters over it."""
    scene, (track, rng) = _scene(), _track(trial, seed)
    drawn, first, *streams = rng.spawn(2 + len(runs))
    readings = draw_readings(scene, track, drawn)
    about = track.place_m[0, :2] + FIRST_M * first.standard_normal(2)
    found = [
        errors_of(run, scene, track, readings, about, own, particles)
        for run, own in zip(runs, streams, strict=True)
    ]
    of_gps = track.seen & track.gps
    return TrackErrors(np.array(found), track.seen.sum(axis=1), of_gps.sum(axis=1))


def errors_over_time(draw: int, trial: int, seed: int) -> Floats:
    """Draw the readings of a track once more; return errors of :data:`OVER_TIME`, (3, K)."""
    scene, (track, _) = _scene(), _track(trial, seed)
    rng = np.random.default_rng([seed, trial, 1 + draw])
    readings = draw_readings(scene, track, rng)
    about = track.place_m[0, :2] + FIRST_M * rng.standard_normal(2)
    return np.array([errors_of(run, scene, track, readings, about, rng) for run in OVER_TIME])


@dataclass(frozen=True, eq=False)
class PaperRun:
    """Errors of all tracks: by run, (T, K).

    ``satellites`` and ``gps``, (T, K), are how many are seen, of both systems and of GPS;
    ``over_time_m``, (draws, 3, K), errors of :data:`OVER_TIME` on the track ``shown``; ``walks_m``,
    (K, 2) each, the tracks, east and north.
    """

    errors_m: dict[Run, Floats]
    satellites: Ints
    gps: Ints
    shown: int
    over_time_m: Floats
    walks_m: list[Floats]

    @cached_property
    def epochs(self) -> dict[str, Bools]:
        """Sets of epochs, (T, K) each.

        All; those with a static fix of both systems; those with fewer than four satellites of both
        systems, and of GPS.
        """
        return {
            "every": np.ones(self.satellites.shape, dtype=np.bool_),
            "fixed": np.isfinite(self.errors_m[STATIC]),
            "critical": self.satellites < FEW,
            "gps_critical": self.gps < FEW,
        }

    def error_90(self, key: Run, epochs: str) -> Percentile:
        """Return the 90 % error of a filter on a set of epochs."""
        return percentile_of_tracks(self.errors_m[key], self.epochs[epochs], SHARE)


def run_paper(settings: PaperSettings) -> PaperRun:
    """Run all filters over all tracks, and some of them over many draws of one track.

    That track is the one of which a quarter of the epochs is critical, or nearest to it.
    """
    seed, trials, progress = settings.seed, settings.trials, settings.progress
    total = trials + DRAWS
    first = None if progress is None else lambda done, _: progress(done, total)
    then = None if progress is None else lambda done, _: progress(trials + done, total)
    one_track = partial(track_errors, seed=seed)
    executor = settings.executor or SerialExecutor()
    tracks = list(ordered_results(executor, one_track, range(trials), progress=first))
    errors, satellites, gps = (np.array(values) for values in zip(*tracks, strict=True))
    shown = int(np.argmin(np.abs((satellites < FEW).mean(axis=1) - 0.25)))
    again = partial(errors_over_time, trial=shown, seed=seed)
    over_time = np.array(list(ordered_results(executor, again, range(DRAWS), progress=then)))
    by_run = dict(zip(RUNS, errors.swapaxes(0, 1), strict=True))
    walks = [_track(trial, seed)[0].place_m[:, :2] for trial in range(trials)]
    return PaperRun(by_run, satellites, gps, shown, over_time, walks)


@lru_cache(maxsize=1)
def _scene() -> Scene:
    return dlr_scene()


def _track(trial: int, seed: int) -> tuple[Track, np.random.Generator]:
    rng = np.random.default_rng([seed, trial])
    return draw_track(_scene(), rng), rng
