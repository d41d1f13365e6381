"""``mapfilter bench filter``: what a step and a track cost."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import radians
from pathlib import Path
from statistics import median

import numpy as np

from mapfilter._kernels import draw_key
from mapfilter._types import Floats32
from mapfilter.config.load import load_config
from mapfilter.database.store import open_database
from mapfilter.filters.contract import MotionStep
from mapfilter.filters.particle import ParticleBelief, ParticleFilter, ParticleOptions
from mapfilter.filters.resampling import copy_with_jitter, normalise, systematic
from mapfilter.models.fingerprint import LevelReading
from mapfilter.positioning.bayes.evidence import RadioReading
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.model import BayesModel, Start
from mapfilter.positioning.bayes.options import BayesOptions, open_area
from mapfilter.positioning.epochs import epochs
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.store import list_logs, read_log
from mapfilter.workflows.bench_filter_memory import locating_memory_bytes
from mapfilter.workflows.bench_filter_peers import (
    NumpyModel,
    numpy_step,
    particles_step,
    stone_soup_step,
)
from mapfilter.workflows.build import run_build
from mapfilter.workflows.predict import run_predict
from mapfilter.workflows.simulate import run_simulate

_LEVELS, _PER_ROW, _PEER_STEPS = 7, 20, 10
_JITTER = (0.5, 0.5, 0.005, 0.003, 0.0)
_TRACKS, _LENGTH_M, _CUT_M = 5, 1940.0, 300.0


@dataclass(frozen=True)
class StepBench:
    """A whole step: motion, map, serving cell, seven levels, normalise, resample.

    Nanoseconds are per particle, medians over the runs, which take turns; ratios are of these.

    Parameters
    ----------
    particles : int
    step_ns : float
    filter_ns : float
        The same by the filter, which also says what the belief is: mean, radii, entropy.
    numpy_ns, particles_ns, stonesoup_ns : float or None
        The same model in NumPy, alone and under two packages; None where one is not installed.
    numpy_ratio, particles_ratio, stonesoup_ratio : float or None
        Of these to ``step_ns``.
    """

    particles: int
    step_ns: float
    filter_ns: float
    numpy_ns: float
    particles_ns: float | None
    stonesoup_ns: float | None
    numpy_ratio: float
    particles_ratio: float | None
    stonesoup_ratio: float | None


@dataclass(frozen=True)
class FilterBench:
    """One process, on the embedded map; times are processor times.

    Parameters
    ----------
    runs, tracks, epochs : int
        Repetitions; walks, one report with levels a second; epochs of the first of them.
    length_m, area_km2 : float
        Of a walk; of the database.
    steps : list of StepBench
        By number of particles.
    track_s : float
        A walk from an unknown start; median over walks and repetitions.
    challenged : int
        Walks with 300 m that nobody measured in their middle, and an alternative because of it.
    challenged_track_s : float or None
        These walks; None where none did.
    loaded_memory_bytes, peak_memory_bytes, smoothing_peak_memory_bytes : int
        Of a process that opens the database and locates a walk: its libraries alone, and in all.
    """

    runs: int
    tracks: int
    epochs: int
    length_m: float
    area_km2: float
    steps: list[StepBench]
    track_s: float
    challenged: int
    challenged_track_s: float | None
    loaded_memory_bytes: int
    peak_memory_bytes: int
    smoothing_peak_memory_bytes: int


def bench_filter(
    *,
    runs: int = 5,
    particles: Sequence[int] = (10_000, 100_000),
    tracks: int = _TRACKS,
    length_m: float = _LENGTH_M,
    settings: Sequence[str] = (),
) -> FilterBench:
    """Measure the Bayes map filter on the embedded map.

    Parameters
    ----------
    runs : int
        Repetitions that the medians are of.
    particles : sequence of int
        Numbers of particles of the single step.
    tracks : int
    length_m : float
    settings : sequence of str
        ``section.key=value`` of the world.

    Raises
    ------
    MapfilterError
        The temporary folder cannot be written.
    """
    with tempfile.TemporaryDirectory(prefix="mapfilter-bench-") as name:
        given = [f"journeys.count={tracks}", f"journeys.length_m={length_m}", *settings]
        database, folders = make_world(Path(name), given)
        logs = [read_log(folder) for folder in folders]
        area = open_area(open_database(database))
        positioner = BayesOptions().over_area(area)
        steps = [_step(positioner.model, logs[0], count, runs) for count in particles]
        # The first loads what is compiled.
        timed = [_track(positioner, log) for _ in range(runs + 1) for log in logs][len(logs) :]
        cut = [_track(positioner, _without_middle(log)) for _ in range(runs) for log in logs]
        challenged = [took_s for took_s, challenges in cut if challenges]
        loaded, peak = locating_memory_bytes(database, folders[0], smooth=False)
        _, smoothing_peak = locating_memory_bytes(database, folders[0], smooth=True)
        east_m, north_m = area.size_m
        return FilterBench(
            runs=runs,
            tracks=len(logs),
            epochs=len(epochs(logs[0])),
            length_m=length_m,
            area_km2=east_m * north_m / 1e6,
            steps=steps,
            track_s=median(took_s for took_s, _ in timed),
            challenged=len(challenged) // runs,
            challenged_track_s=median(challenged) if challenged else None,
            loaded_memory_bytes=loaded,
            peak_memory_bytes=peak,
            smoothing_peak_memory_bytes=smoothing_peak,
        )


def make_world(folder: Path, settings: Sequence[str]) -> tuple[Path, Sequence[Path]]:
    """Return a database of the embedded map, and the folders of walks in a perturbed reality."""
    config = load_config(None, ["output.pictures=none", *settings], out=folder)
    run_predict(config)
    run_build(config)
    return config.database_path, list_logs(run_simulate(config).path)


def step_inputs(model: BayesModel, log: TrackLog, count: int) -> tuple[NumpyModel, ParticleBelief]:
    """Return a step's motion and report, and particles about a place of a walk with truth."""
    area, truth = model.area, log.truth.iloc[len(log.truth) // 2]
    belief = ParticleFilter(model, ParticleOptions(max_particles=count, min_particles=count)).init(
        Start(None, True, float(truth["east_m"]), float(truth["north_m"]), 50.0),
        np.random.default_rng(0),
    )
    pixel = area.lattice.row_col(float(truth["east_m"]), float(truth["north_m"]))
    level = area.level_dbm[int(pixel[0]), int(pixel[1]), : len(area.cell_ids)]
    cell = np.argsort(-level, kind="stable")[:_LEVELS].astype(np.int32)
    size = cell.size
    rho = np.full(size, 0.7, dtype=np.float32)
    levels = LevelReading(
        cell, (0.3 * level[cell]).astype(np.float32), rho,
        np.full(size, 0.1, dtype=np.float32), 0.3, 0.7, 3.0, 4.0, 3.0,
    )  # fmt: skip
    reading = RadioReading(int(cell[0]), 5 / 40, levels, length_m=5.0)
    return NumpyModel(model, MotionStep(1.4, radians(37.0)), reading, levels), belief


def _step(model: BayesModel, log: TrackLog, count: int, runs: int) -> StepBench:
    peer, belief = step_inputs(model, log, count)
    rng = np.random.default_rng(1)
    jitter = np.array(_JITTER)
    wide = np.vstack([belief.state.astype(np.float64), np.zeros(count)])
    always = ParticleOptions(count, count, count, resample_below=0.999999, mass_exponent=1.0)
    filter_ = ParticleFilter(model, always)

    def own() -> object:
        return whole_step(peer, belief, jitter.astype(np.float32), rng)

    def by_filter() -> object:
        moved, _ = filter_.predict(belief, peer.motion, rng)
        return filter_.update(moved, peer.reading, rng)

    numpy_ = numpy_step(peer, jitter, rng)
    package, soup = particles_step(peer, rng, _PEER_STEPS), stone_soup_step(peer, rng)
    tasks: dict[str, tuple[Callable[[], object], int]] = {
        "own": (own, _PER_ROW),
        "filter": (by_filter, _PER_ROW),
        "numpy": (lambda: numpy_(wide), 1),
    }
    if package is not None:
        tasks["particles"] = (lambda: package(wide), 1)
    if soup is not None:
        tasks["stonesoup"] = (lambda: soup(wide), 1)
    took: dict[str, list[float]] = {name: [] for name in tasks}
    for run in range(runs + 1):
        for name, (task, times) in tasks.items():
            began_s = time.process_time()
            for _ in range(times):
                task()
            if run > 0:
                steps = _PEER_STEPS if name == "particles" else times
                took[name].append(1e9 * (time.process_time() - began_s) / (steps * count))
    ns = {name: median(times) for name, times in took.items()}
    peers = {name: ns.get(name) for name in ("particles", "stonesoup")}
    ratios = {name: None if t is None else t / ns["own"] for name, t in peers.items()}
    return StepBench(
        count, ns["own"], ns["filter"], ns["numpy"], peers["particles"], peers["stonesoup"],
        ns["numpy"] / ns["own"], ratios["particles"], ratios["stonesoup"],
    )  # fmt: skip


def whole_step(
    given: NumpyModel, belief: ParticleBelief, jitter: Floats32, rng: np.random.Generator
) -> Floats32:
    """Return the particles after a step that always resamples, shape (5, N)."""
    model, count = given.model, belief.log_weight.size
    state, log_weight = model.move(belief.state, belief.log_weight, given.motion, draw_key(rng))
    model.weigh(state, log_weight, given.reading)
    weight = np.empty(count, dtype=np.float32)
    normalise(log_weight, weight)
    chosen = np.empty(count, dtype=np.int32)
    systematic(weight, rng.random(), chosen)
    copies = np.empty_like(state)
    copy_with_jitter(state, chosen, jitter, draw_key(rng), copies)
    return copies


def _track(positioner: BayesPositioner, log: TrackLog) -> tuple[float, int]:
    """Return the seconds that a walk takes, and how many alternatives were started."""
    rng, merged = np.random.default_rng(2), epochs(log)
    track, challenges = positioner.begin(), 0
    began_s = time.process_time()
    for epoch in merged:
        before = track.alternative
        track, _ = positioner.step(track, epoch, rng)
        challenges += before is None and track.alternative is not None
    return time.process_time() - began_s, challenges


def _without_middle(log: TrackLog) -> TrackLog:
    """Return a log that was switched off for a while, and carried on as if nobody had moved."""
    gone_m = log.motion["step_m"].cumsum()
    whole_m = float(gone_m.iloc[-1])
    off = (gone_m > 0.5 * whole_m) & (gone_m < 0.5 * whole_m + _CUT_M)
    times = log.motion["time_s"][off]
    heard = log.radio["time_s"].between(times.min(), times.max())
    return replace(
        log,
        motion=log.motion[~off].reset_index(drop=True),
        radio=log.radio[~heard].reset_index(drop=True),
    )
