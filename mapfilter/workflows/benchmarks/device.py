"""``mapfilter bench filter --device gpu``: a step on a graphics processor beside the processor."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._device import Device, on_host
from mapfilter._kernels import draw_key
from mapfilter._types import Floats
from mapfilter.database.store import open_database
from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.beliefs.device_step import DeviceStep
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.store import read_log
from mapfilter.workflows.bench import median_seconds
from mapfilter.workflows.benchmarks.filter import (
    JITTER,
    StepInputs,
    make_world,
    step_inputs,
    whole_step,
)

_PER_RUN = 20


@dataclass(frozen=True)
class DeviceStepBench:
    """A whole step, as in ``mapfilter bench filter``; nanoseconds of wall time per particle.

    Parameters
    ----------
    cpu_ns, gpu_ns : float
        On the processor and on the device, where particles stay from one step to the next.
    speedup : float
        Ratio of the two.
    difference_m : float
        Distance of the mean positions after one step with the same random numbers.
    """

    particles: int
    cpu_ns: float
    gpu_ns: float
    speedup: float
    difference_m: float


@dataclass(frozen=True)
class DeviceBench:
    """Steps on a device beside the processor's, which take turns; medians over the runs.

    Parameters
    ----------
    device : str
        Its own name.
    """

    device: str
    runs: int
    steps: list[DeviceStepBench]


def bench_device(
    device: Device,
    *,
    runs: int = 5,
    particles: Sequence[int] = (10_000, 100_000, 1_000_000),
    settings: Sequence[str] = (),
) -> DeviceBench:
    """Measure a step of the Bayes map filter on a device, on the embedded map.

    Parameters
    ----------
    runs : int
        Repetitions that the medians are of.
    particles : sequence of int
        Numbers of particles.
    settings : sequence of str
        ``section.key=value`` of the world.
    """
    with tempfile.TemporaryDirectory(prefix="mapfilter-bench-") as name:
        database, folders = make_world(Path(name), ["journeys.count=1", *settings])
        model, log = BayesFilter().over(open_database(database)).model, read_log(folders[0])
    steps = [measured(model, log, device, count, runs) for count in particles]
    return DeviceBench(device.title, runs, steps)


def measured(
    model: BayesModel, log: TrackLog, device: Device, count: int, runs: int
) -> DeviceStepBench:
    """Return the time of a step of so many particles on both, and how far the results differ."""
    given, belief = step_inputs(model, log, count)
    step, rng, jitter = DeviceStep(model, device), np.random.default_rng(1), np.array(JITTER)
    jitter = jitter.astype(np.float32)
    cloud, log_weight = step.placed(belief.cloud), device.placed(belief.log_weight)

    def by_processor() -> None:
        for _ in range(_PER_RUN):
            whole_step(given, belief, jitter, rng)

    def by_device() -> None:
        for _ in range(_PER_RUN):
            moved, weighed = _weighed(step, given, cloud, log_weight, draw_key(rng))
            step.resample(moved, weighed, jitter, rng)
        device.wait()

    tasks: dict[str, Callable[[], object]] = {"cpu": by_processor, "gpu": by_device}
    took_s = median_seconds(tasks, runs)
    cpu_ns, gpu_ns = (1e9 * took_s[name] / (_PER_RUN * count) for name in tasks)
    return DeviceStepBench(count, cpu_ns, gpu_ns, cpu_ns / gpu_ns, _apart_m(step, given, belief))


def _weighed(
    step: DeviceStep, given: StepInputs, cloud: Cloud, log_weight: Any, key: np.uint64
) -> tuple[Cloud, Any]:
    """Return particles and their log weights after motion, map and report."""
    state, weighed = step.move(cloud.state, log_weight, given.motion, key)
    moved, _ = step.weigh(cloud._replace(state=state), weighed, given.reading)
    return moved, weighed


def _apart_m(step: DeviceStep, given: StepInputs, belief: ParticleBelief) -> float:
    """Return how far mean positions after a step lie apart, with the same random numbers."""
    model, placed, key = given.model, step.device.placed, np.uint64(7)
    state, here = model.move(belief.state, belief.log_weight, given.motion, key)
    model.weigh(belief.cloud._replace(state=state), here, given.reading)
    moved, there = _weighed(step, given, step.placed(belief.cloud), placed(belief.log_weight), key)
    one, other = _mean(state, here), _mean(on_host(moved.state), on_host(there))
    return hypot(*(one - other).tolist())


def _mean(state: Any, log_weight: Floats) -> Floats:
    """Return the mean position, east and north, by log weights."""
    weight = np.exp(log_weight - log_weight.max())
    return np.asarray((state[:2] @ weight) / weight.sum(), dtype=np.float64)
