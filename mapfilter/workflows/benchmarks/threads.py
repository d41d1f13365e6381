"""``mapfilter bench filter --threads N``: a step of the filter divided among threads."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

import numpy as np

from mapfilter._threads import ONE, Threads
from mapfilter.database.store import open_database
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.tracks.store import read_log
from mapfilter.workflows.benchmarks.filter import (
    JITTER,
    StepInputs,
    filter_step,
    make_world,
    step_inputs,
    whole_step,
)

PARTICLES = (10_000, 100_000, 1_000_000)
_PARTICLES_OF_A_TURN, _LEAST_STEPS = 1_000_000, 2
Task = Callable[[], object]


@dataclass(frozen=True)
class DividedStep:
    """A whole step in one thread and divided; nanoseconds of wall time per particle.

    Parameters
    ----------
    is_divided : bool
        Whether there are enough particles to divide.
    one_ns, divided_ns : float
        Medians over the steps.
    speedup, best_speedup : float
        Ratios of the medians, and of the shortest steps.
    filter_speedup, best_filter_speedup : float
        The same for the filter, which also summarises its belief, in one thread.
    """

    particles: int
    is_divided: bool
    one_ns: float
    divided_ns: float
    speedup: float
    best_speedup: float
    filter_speedup: float
    best_filter_speedup: float


@dataclass(frozen=True)
class ThreadsBench:
    """A step divided among threads beside the same step in one, in turns.

    Parameters
    ----------
    threads, runs : int
        Number of threads; turns of each.
    processors : int
        Of this machine.
    load_average : float
        Processes that ran or waited for a processor in the last minute before the first turn. Where
        these are not far fewer than processors, ratios say little.
    """

    threads: int
    runs: int
    processors: int
    load_average: float
    steps: list[DividedStep]


def bench_threads(
    threads: int,
    *,
    runs: int = 5,
    particles: Sequence[int] = PARTICLES,
    least: int | None = None,
    settings: Sequence[str] = (),
) -> ThreadsBench:
    """Measure a step of the Bayes map filter in one thread and in several, on the embedded map.

    Parameters
    ----------
    threads : int
        Number of threads.
    runs : int
        Turns of each.
    particles : sequence of int
        Numbers of particles.
    least : int, optional
        Least number of particles that is divided; that of the filter by default.
    settings : sequence of str
        ``section.key=value`` of the world.
    """
    with tempfile.TemporaryDirectory(prefix="mapfilter-bench-") as name:
        database, folders = make_world(Path(name), ["journeys.count=1", *settings])
        model, log = BayesFilter().over(open_database(database)).model, read_log(folders[0])
    several = Threads(threads) if least is None else Threads(threads, least)
    load = os.getloadavg()[0]
    steps = [_measured(*step_inputs(model, log, count), several, runs) for count in particles]
    return ThreadsBench(threads, runs, os.cpu_count() or 1, load, steps)


def _measured(
    given: StepInputs, belief: ParticleBelief, several: Threads, runs: int
) -> DividedStep:
    count = belief.log_weight.size
    tasks: dict[str, Task] = {}
    for name, threads in (("one", ONE), ("several", several)):
        tasks[f"step, {name}"], tasks[f"filter, {name}"] = _tasks(given, belief, threads)
    took_s = _wall_s(tasks, runs, max(_PARTICLES_OF_A_TURN // count, _LEAST_STEPS))
    one_s, several_s = took_s["step, one"], took_s["step, several"]
    filter_s = took_s["filter, one"], took_s["filter, several"]
    return DividedStep(
        count,
        several.divide(count),
        1e9 * median(one_s) / count,
        1e9 * median(several_s) / count,
        median(one_s) / median(several_s),
        min(one_s) / min(several_s),
        median(filter_s[0]) / median(filter_s[1]),
        min(filter_s[0]) / min(filter_s[1]),
    )


def _tasks(given: StepInputs, belief: ParticleBelief, threads: Threads) -> tuple[Task, Task]:
    """Return a whole step, and one of the filter, both of which always resample."""
    rng = np.random.default_rng(1)
    inputs = replace(given, model=replace(given.model, threads=threads))
    jitter = np.array(JITTER, np.float32)
    by_filter = filter_step(inputs, belief, rng, threads)
    return lambda: whole_step(inputs, belief, jitter, rng), by_filter


def _wall_s(tasks: Mapping[str, Task], runs: int, steps: int) -> dict[str, list[float]]:
    """Return the wall time of each step, after a first turn that loads what is compiled."""
    took_s: dict[str, list[float]] = {name: [] for name in tasks}
    for turn in range(runs + 1):
        for name, task in tasks.items():
            for _ in range(steps):
                began_s = time.perf_counter()
                task()
                if turn > 0:
                    took_s[name].append(time.perf_counter() - began_s)
    return took_s
