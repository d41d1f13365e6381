"""DLR: hybrid positioning by satellites and LTE time differences of arrival."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Literal

import numpy as np

from mapfilter._parallel import Progress, ordered_results
from mapfilter._types import Bools, Floats, Ints
from mapfilter.experiments.papers.dlr import filters
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
from mapfilter.models.state import POSITION_CLOCK_3D, StateLayout

Name = Literal["static", "pkf", "ekf", "pf"]
Systems = Literal["none", "gps", "gps+galileo"]

FEW = 4
"""Fewer satellites than this are a critical situation."""

THRESHOLDS_DB = (-8.0, -11.0, -14.0, -17.0, -20.0, -23.0, -26.0)


@dataclass(frozen=True, slots=True)
class Run:
    """One filter on one kind of measurements.

    Parameters
    ----------
    filter : {"static", "pkf", "ekf", "pf"}
    satellites : {"none", "gps", "gps+galileo"}
    where : {"edge", "near"} or None
        Where in the network time differences are measured; None without them.
    above_db : float or None
        SINR below which stations are dropped; None for the three best ones.
    open_sky : bool
        Without houses and echoes.
    mobility : {"diagonal", "discretised"}
    """

    filter: Name
    satellites: Systems = "gps+galileo"
    where: Where | None = None
    above_db: float | None = None
    open_sky: bool = False
    mobility: filters.Mobility = "diagonal"


STATIC, PKF, EKF, PF = Run("static"), Run("pkf"), Run("ekf"), Run("pf")
GPS = Run("ekf", "gps")
AT_EDGE = Run("ekf", where=EDGE, above_db=THRESHOLD_DB)
AT_NEAR = Run("ekf", where=NEAR, above_db=THRESHOLD_DB)
FIXED_EDGE, FIXED_NEAR = Run("ekf", where=EDGE), Run("ekf", where=NEAR)
TDOA_STATIC, TDOA_PKF = Run("static", "none", EDGE), Run("pkf", "none", EDGE)
TDOA_EKF, TDOA_PF = Run("ekf", "none", EDGE), Run("pf", "none", EDGE)
TDOA_EKF_NEAR, TDOA_PF_NEAR = Run("ekf", "none", NEAR), Run("pf", "none", NEAR)
RUNS = (
    STATIC, PKF, EKF, PF,
    Run("static", "gps"), GPS,
    *(Run(name, systems, open_sky=True) for systems in ("gps", "gps+galileo")
      for name in ("static", "ekf")),
    TDOA_STATIC, TDOA_PKF, TDOA_EKF, TDOA_PF, TDOA_EKF_NEAR, TDOA_PF_NEAR,
    FIXED_EDGE, FIXED_NEAR,
    *(Run("ekf", where=where, above_db=above) for where in (EDGE, NEAR) for above in THRESHOLDS_DB),
    Run("ekf", mobility="discretised"),
    Run("ekf", where=EDGE, above_db=THRESHOLD_DB, mobility="discretised"),
)  # fmt: skip
OVER_TIME = (EKF, AT_NEAR, AT_EDGE)
"""What Fig. 12 compares."""


@dataclass(frozen=True, eq=False)
class TrackErrors:
    """What came of one track.

    Parameters
    ----------
    errors_m : (runs, K) array
        East and north; NaN where a static fix is none.
    satellites, gps : (K,) integer arrays
        Seen at each epoch: of both systems, and of GPS.
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
    particles: int = filters.PARTICLES,
) -> Floats:
    """Return a filter's error at each epoch, (K,); ``about_m`` is where its belief begins."""
    layout = filters.FLAT if run.satellites == "none" else filters.HYBRID
    if run.filter in ("static", "pkf"):
        solved = filters.PLACE if run.satellites == "none" else POSITION_CLOCK_3D
        fixes = filters.run_static(solved, _epochs(run, solved, scene, track, readings))
        if run.filter == "static":
            told = np.array([fix.state[:2] for fix in fixes])
        else:
            smooth = filters.FLAT if run.satellites == "none" else filters.FIXES
            told = filters.run_pkf(smooth, fixes, about_m)
    else:
        epochs = _epochs(run, layout, scene, track, readings)
        told = (
            filters.run_ekf(layout, epochs, about_m, run.mobility)
            if run.filter == "ekf"
            else filters.run_pf(layout, epochs, about_m, rng, particles)
        )
    return np.asarray(np.hypot(*(told - track.place_m[:, :2]).T))


def _epochs(
    run: Run, layout: StateLayout, scene: Scene, track: Track, readings: Readings
) -> list[filters.Epoch]:
    seen = []
    if run.satellites != "none":
        used = track.gps if run.satellites == "gps" else np.ones_like(track.gps)
        ranges = readings.open_m if run.open_sky else readings.ranges_m
        sigma = track.sigma_m if run.open_sky else np.hypot(track.sigma_m, ECHO_M)
        seen = filters.satellites(layout, track.satellites_m[used], sigma[used], ranges[:, used])
    if run.where is None:
        return seen
    heard = filters.differences(
        layout, scene.stations_m[run.where], track.sinr_db[run.where], readings.times_m[run.where],
        run.above_db,
    )  # fmt: skip
    return filters.joined(seen, heard) if seen else heard


def track_errors(
    trial: int, seed: int, particles: int = filters.PARTICLES, runs: Sequence[Run] = RUNS
) -> TrackErrors:
    """Draw a track and its readings, and run all filters over it."""
    scene, track, rng = _scene(), *_track(trial, seed)
    drawn, first, *streams = rng.spawn(2 + len(runs))
    readings = draw_readings(scene, track, drawn)
    about = track.place_m[0, :2] + filters.FIRST_M * first.standard_normal(2)
    found = np.array([
        errors_of(run, scene, track, readings, about, own, particles)
        for run, own in zip(runs, streams, strict=True)
    ])  # fmt: skip
    return TrackErrors(found, track.seen.sum(axis=1), (track.seen & track.gps).sum(axis=1))


def errors_over_time(draw: int, trial: int, seed: int) -> Floats:
    """Draw the readings of a track once more; return errors of :data:`OVER_TIME`, (3, K)."""
    scene, track, _ = _scene(), *_track(trial, seed)
    rng = np.random.default_rng([seed, trial, 1 + draw])
    readings = draw_readings(scene, track, rng)
    about = track.place_m[0, :2] + filters.FIRST_M * rng.standard_normal(2)
    return np.array([
        errors_of(run, scene, track, readings, about, rng) for run in OVER_TIME
    ])  # fmt: skip


@dataclass(frozen=True, eq=False)
class PaperRun:
    """Errors of all tracks.

    Parameters
    ----------
    errors_m : dict
        By run, (T, K).
    satellites, gps : (T, K) integer arrays
    shown : int
        The track over whose time errors are told.
    over_time_m : (draws, 3, K) array
        Errors of :data:`OVER_TIME` on it.
    """

    errors_m: dict[Run, Floats]
    satellites: Ints
    gps: Ints
    shown: int
    over_time_m: Floats

    @property
    def every(self) -> Bools:
        """All epochs."""
        return np.ones(self.satellites.shape, dtype=np.bool_)

    @property
    def fixed(self) -> Bools:
        """Epochs with a static fix."""
        return np.isfinite(self.errors_m[STATIC])

    @property
    def critical(self) -> Bools:
        """Epochs with fewer than four satellites."""
        return self.satellites < FEW


def run_paper(
    trials: int, seed: int, draws: int, executor: Executor, progress: Progress | None = None
) -> PaperRun:
    """Run all filters over all tracks, and some of them over many draws of one track.

    Parameters
    ----------
    trials : int
        Tracks.
    seed : int
    draws : int
        Of the readings of the one track; the one of which a quarter of the epochs is critical, or
        nearest to it.
    executor : concurrent.futures.Executor
    progress : callable, optional
        Called with tasks done and tasks in all, tracks and draws.
    """
    total = trials + draws
    first = None if progress is None else lambda done, _: progress(done, total)
    then = None if progress is None else lambda done, _: progress(trials + done, total)
    tracks = list(ordered_results(
        executor, partial(track_errors, seed=seed), range(trials), progress=first
    ))  # fmt: skip
    satellites = np.array([track.satellites for track in tracks])
    shown = int(np.argmin(np.abs((satellites < FEW).mean(axis=1) - 0.25)))
    again = partial(errors_over_time, trial=shown, seed=seed)
    over_time = np.array(list(ordered_results(executor, again, range(draws), progress=then)))
    errors = np.stack([track.errors_m for track in tracks], axis=1)
    gps = np.array([track.gps for track in tracks])
    return PaperRun(dict(zip(RUNS, errors, strict=True)), satellites, gps, shown, over_time)


def paper_track(trial: int, seed: int) -> Track:
    """Return a track as it was drawn."""
    return _track(trial, seed)[0]


@lru_cache(maxsize=1)
def _scene() -> Scene:
    return dlr_scene()


def _track(trial: int, seed: int) -> tuple[Track, np.random.Generator]:
    rng = np.random.default_rng([seed, trial])
    return draw_track(_scene(), rng), rng
