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
from mapfilter._threads import ONE, Threads
from mapfilter._types import Floats32
from mapfilter.config.load import load_config
from mapfilter.database.store import open_database
from mapfilter.filters.contract import MotionStep
from mapfilter.filters.copies import Copies, copies_of
from mapfilter.filters.particle import ParticleBelief, ParticleFilter, ParticleOptions
from mapfilter.filters.resampling import (
    copy_with_jitter,
    normalise,
    normalise_by,
    systematic,
    systematic_by,
)
from mapfilter.models.level_errors import LevelReport
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.beliefs.first_hypotheses import Start
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.merging import epochs
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.log_folders import list_logs
from mapfilter.tracks.store import read_log
from mapfilter.workflows.bench import median_seconds
from mapfilter.workflows.benchmarks.locating_memory import locating_memory_bytes
from mapfilter.workflows.build import run_build
from mapfilter.workflows.predict import run_predict
from mapfilter.workflows.simulate import run_simulate

_LEVELS, _PER_ROW = 7, 20
JITTER = (0.5, 0.5, 0.005, 0.003, 0.0, 0.004, 0.004, 1e-4)
_TRACKS, _LENGTH_M, _CUT_M = 5, 1940.0, 300.0


@dataclass(frozen=True)
class StepBench:
    """A whole step: motion, map, serving cell, seven levels, normalise, resample.

    Particles keep the errors of levels from an earlier report.

    Nanoseconds are per particle, medians over the runs, which take turns.

    Parameters
    ----------
    step_ns : float
        The kernels alone.
    filter_ns : float
        The filter, which also summarises its belief: mean, radii, entropy.
    """

    particles: int
    step_ns: float
    filter_ns: float


@dataclass(frozen=True, eq=False)
class StepInputs:
    """What a step takes: the model, a step of dead reckoning, and a report with levels."""

    model: BayesModel
    motion: MotionStep
    reading: RadioReading
    levels: LevelReport


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
    with_alternative : int
        Walks without measurements over 300 m in their middle, after which the filter started an
        alternative hypothesis.
    with_alternative_track_s : float or None
        Time of these walks; None where there is none.
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
    with_alternative: int
    with_alternative_track_s: float | None
    loaded_memory_bytes: int
    peak_memory_bytes: int
    smoothing_peak_memory_bytes: int


def bench_filter(
    *,
    runs: int = 5,
    particles: Sequence[int] = (10_000, 100_000, 1_000_000),
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
    settings : sequence of str
        ``section.key=value`` of the world.
    """
    with tempfile.TemporaryDirectory(prefix="mapfilter-bench-") as name:
        given = [f"journeys.count={tracks}", f"journeys.length_m={length_m}", *settings]
        database, folders = make_world(Path(name), given)
        logs = [read_log(folder) for folder in folders]
        area = open_area(open_database(database))
        positioner = BayesFilter().over_area(area)
        steps = [_step(positioner.model, logs[0], count, runs) for count in particles]
        # The first loads what is compiled.
        timed = [_track(positioner, log) for _ in range(runs + 1) for log in logs][len(logs) :]
        cut = [_track(positioner, _without_middle(log)) for _ in range(runs) for log in logs]
        lost_s = [took_s for took_s, alternatives in cut if alternatives]
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
            with_alternative=len(lost_s) // runs,
            with_alternative_track_s=median(lost_s) if lost_s else None,
            loaded_memory_bytes=loaded,
            peak_memory_bytes=peak,
            smoothing_peak_memory_bytes=smoothing_peak,
        )


def make_world(folder: Path, settings: Sequence[str]) -> tuple[Path, Sequence[Path]]:
    """Return a database of the embedded map, and the folders of walks in a ground truth."""
    config = load_config(None, ["output.pictures=none", *settings], out=folder)
    run_predict(config)
    run_build(config)
    return config.database_path, list_logs(run_simulate(config).path)


def step_inputs(model: BayesModel, log: TrackLog, count: int) -> tuple[StepInputs, ParticleBelief]:
    """Return a step's motion and report, and particles about a place of a walk with truth."""
    area, truth = model.whole, log.truth.iloc[len(log.truth) // 2]
    belief = ParticleFilter(model, ParticleOptions(max_particles=count, min_particles=count)).init(
        Start(None, True, float(truth["east_m"]), float(truth["north_m"]), 50.0),
        np.random.default_rng(0),
    )
    pixel = area.lattice.row_col(float(truth["east_m"]), float(truth["north_m"]))
    level = area.level_dbm[int(pixel[0]), int(pixel[1]), : len(area.cell_ids)]
    cell = np.argsort(-level, kind="stable")[:_LEVELS].astype(np.int32)
    absent = np.setdiff1d(np.arange(len(area.cell_ids), dtype=np.int32), cell)
    limit_dbm = np.full(absent.size, level[cell].min(), dtype=np.float32)
    levels = LevelReport(cell, level[cell] + np.float32(3.0), absent, limit_dbm, 3.0)
    reading = RadioReading(int(cell[0]), 5 / 40, levels, length_m=5.0)
    # As in a filter under way, particles know of the errors of levels by an earlier report, and
    # what they keep of these is still to be copied from those that were chosen then.
    log_weight, weight = belief.log_weight.copy(), np.empty(count, dtype=np.float32)
    cloud, _ = model.weigh(belief.cloud, log_weight, reading)
    normalise(log_weight, weight)
    chosen = np.empty(count, dtype=np.int32)
    systematic(weight, 0.5, chosen)
    belief = replace(belief, kept=copies_of(cloud.kept, chosen), shared=cloud.shared)
    return StepInputs(model, MotionStep(1.4, radians(37.0)), reading, levels), belief


def _step(model: BayesModel, log: TrackLog, count: int, runs: int) -> StepBench:
    given, belief = step_inputs(model, log, count)
    rng, jitter = np.random.default_rng(1), np.array(JITTER, np.float32)

    def often(task: Callable[[], object]) -> Callable[[], object]:
        def row() -> None:
            # Results are dropped, as a filter drops its last belief but one.
            for _ in range(_PER_ROW):
                task()

        return row

    tasks = {
        "step": often(lambda: whole_step(given, belief, jitter, rng)),
        "filter": often(filter_step(given, belief, rng)),
    }
    took_s = median_seconds(tasks, runs, time.process_time)
    step_ns, filter_ns = (1e9 * took_s[name] / (_PER_ROW * count) for name in tasks)
    return StepBench(count, step_ns, filter_ns)


def whole_step(
    given: StepInputs, belief: ParticleBelief, jitter: Floats32, rng: np.random.Generator
) -> tuple[Floats32, Copies]:
    """Return the particles after a step that always resamples: state and what they keep.

    The latter is copied by the next step, as this one copies that of the step before.
    """
    model, count = given.model, belief.log_weight.size
    state, log_weight = model.move(belief.state, belief.log_weight, given.motion, draw_key(rng))
    cloud, _ = model.weigh(belief.cloud._replace(state=state), log_weight, given.reading)
    weight = np.empty(count, dtype=np.float32)
    normalise_by(model.threads, log_weight, weight)
    chosen = np.empty(count, dtype=np.int32)
    systematic_by(model.threads, weight, rng.random(), chosen)
    copies = np.empty_like(state)
    model.threads.over(count, (copy_with_jitter, state, chosen, jitter, draw_key(rng), copies))
    return copies, copies_of(cloud.kept, chosen)


def filter_step(
    given: StepInputs, belief: ParticleBelief, rng: np.random.Generator, threads: Threads = ONE
) -> Callable[[], object]:
    """Return a step of the filter, which always resamples."""
    count = belief.log_weight.size
    always = ParticleOptions(count, count, count, resample_below=0.999999, mass_exponent=1.0)
    filter_ = ParticleFilter(given.model, always, threads)

    def by_filter() -> object:
        moved, _ = filter_.predict(belief, given.motion, rng)
        return filter_.update(moved, given.reading, rng)

    return by_filter


def _track(positioner: BayesPositioner, log: TrackLog) -> tuple[float, int]:
    """Return the seconds that a walk takes, and how many alternatives were started."""
    rng, merged = np.random.default_rng(2), epochs(log)
    track, alternatives = positioner.begin(), 0
    began_s = time.process_time()
    for epoch in merged:
        before = track.alternative
        track, _ = positioner.step(track, epoch, rng)
        alternatives += before is None and track.alternative is not None
    return time.process_time() - began_s, alternatives


def _without_middle(log: TrackLog) -> TrackLog:
    """Return a log without 300 m of motion and reports in its middle."""
    gone_m = log.motion["step_m"].cumsum()
    whole_m = float(gone_m.iloc[-1])
    off = (gone_m > 0.5 * whole_m) & (gone_m < 0.5 * whole_m + _CUT_M)
    times = log.motion["time_s"][off]
    received = log.radio["time_s"].between(times.min(), times.max())
    return replace(
        log,
        motion=log.motion[~off].reset_index(drop=True),
        radio=log.radio[~received].reset_index(drop=True),
    )
