"""``mapfilter bench filter --peers``: a step of the filter beside NumPy and other packages.

All take the same step of the same model: motion, map, serving cell, seven levels, normalise,
resample. What particles keep of the errors of levels is used by all; NumPy, filterpy and the filter
also update and copy it. Packages that are not installed are left out, and named.
"""

from __future__ import annotations

import importlib.util
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from mapfilter._types import Floats
from mapfilter.database.store import open_database
from mapfilter.errors import MapfilterError, fail
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.tracks.store import read_log
from mapfilter.workflows.bench import median_seconds
from mapfilter.workflows.benchmarks.filter import (
    JITTER,
    StepInputs,
    make_world,
    step_inputs,
    whole_step,
)
from mapfilter.workflows.benchmarks.numpy_reference import MAP, NumpyModel, Step, numpy_step

OWN, NUMPY = "mapfilter", "numpy"
PACKAGES = ("particles", "stonesoup", "filterpy")
PARTICLES = (10_000, 100_000, 1_000_000)
_MOST_STEPS, _MOST_MOVED = 10, 2_000_000
"""Steps of a turn, and particles that they move in all, so that a turn of many stays short."""
_ACCESSES_OF_STATE, _ACCESSES_OF_KEPT = 4, 4
"""How often a step reads or writes what it has of a particle, if each pass is through memory."""


AnyStep = Callable[[Floats], object]
"""A step or several from a state."""


@dataclass(frozen=True)
class PeerStep:
    """A step of so many particles; nanoseconds of processor time per particle.

    Medians over runs, which take turns, and ratios to the filter's own. In its turn each takes the
    same step up to ten times, so that at most two million particles move; ``particles``, whose loop
    cannot repeat a step, takes as many that follow each other.

    Parameters
    ----------
    ns, ratio : mapping of str to float
        By package; ``mapfilter`` itself has the ratio 1.
    limit_ns : float
        Reading and writing ``limit_bytes`` by a copy of arrays as large: no step that keeps as much
        of each particle can take less, from the number of particles on that no cache holds.
    limit_bytes : int
        What a step reads and writes of each particle.
    """

    particles: int
    ns: Mapping[str, float]
    ratio: Mapping[str, float]
    limit_ns: float
    limit_bytes: int


@dataclass(frozen=True)
class PeersBench:
    """A step of the filter beside peers.

    Parameters
    ----------
    runs : int
        Repetitions that the medians are of.
    not_installed : list of str
        Packages that were left out.
    """

    runs: int
    not_installed: list[str]
    steps: list[PeerStep]


def bench_peers(
    *, runs: int = 5, particles: Sequence[int] = PARTICLES, settings: Sequence[str] = ()
) -> PeersBench:
    """Measure a step of the Bayes map filter beside peers, on the embedded map.

    Parameters
    ----------
    runs : int
        Repetitions that the medians are of.
    particles : sequence of int
        Numbers of particles.
    settings : sequence of str
        ``section.key=value`` of the world.

    Raises
    ------
    MapfilterError
        A peer is installed, but a package that it needs is not.
    """
    with tempfile.TemporaryDirectory(prefix="mapfilter-bench-") as name:
        database, folders = make_world(Path(name), ["journeys.count=1", *settings])
        model, log = BayesFilter().over(open_database(database)).model, read_log(folders[0])
    steps = [_compared(*step_inputs(model, log, count), runs) for count in particles]
    return PeersBench(runs, [name for name in PACKAGES if not _installed(name)], steps)


def compare(inputs: StepInputs, belief: ParticleBelief, runs: int) -> dict[str, float]:
    """Return nanoseconds per particle of a whole step, by package, mapfilter first."""
    count = belief.log_weight.size
    in_row = max(min(_MOST_STEPS, _MOST_MOVED // count), 1)
    rng, jitter = np.random.default_rng(1), np.array(JITTER)
    peer = NumpyModel(inputs, belief)
    wide = np.vstack([belief.state.astype(np.float64), np.zeros(count)])
    own = jitter.astype(np.float32)
    steps: dict[str, AnyStep | None] = {
        OWN: _in_a_row(lambda _: whole_step(inputs, belief, own, rng), in_row),
        NUMPY: _in_a_row(numpy_step(peer, jitter, rng), in_row),
        "particles": particles_step(peer, rng, in_row),
        "stonesoup": _in_a_row(stone_soup_step(peer, rng), in_row),
        "filterpy": _in_a_row(filterpy_step(peer, jitter, rng), in_row),
    }
    tasks = {name: partial(step, wide) for name, step in steps.items() if step is not None}
    took_s = median_seconds(tasks, runs, time.process_time)
    return {name: 1e9 * seconds / (in_row * count) for name, seconds in took_s.items()}


def _in_a_row(step: AnyStep | None, times: int) -> AnyStep | None:
    """Return a step that is taken several times from the same state; None for none."""
    if step is None:
        return None

    def several(state: Floats) -> None:
        for _ in range(times):
            step(state)

    return several


def memory_limit(rows: int, kept: int, count: int, runs: int) -> tuple[float, int]:
    """Return nanoseconds per particle that a step's memory traffic takes alone, and its bytes.

    Parameters
    ----------
    rows, kept : int
        Numbers, in single precision, of the state and of what particles keep besides.
    """
    bytes_each = 4 * (_ACCESSES_OF_STATE * rows + _ACCESSES_OF_KEPT * kept)
    source = np.ones((rows + kept) * count, dtype=np.float32)
    target = np.zeros_like(source)
    times = []
    for _ in range(runs + 1):
        began_s = time.process_time()
        for _ in range(max(10_000_000 // source.size, 1)):
            np.copyto(target, source)
        times.append((time.process_time() - began_s) / max(10_000_000 // source.size, 1))
    bytes_per_s = 2 * source.nbytes / max(median(times[1:]), 1e-9)
    return 1e9 * bytes_each / bytes_per_s, bytes_each


def _compared(inputs: StepInputs, belief: ParticleBelief, runs: int) -> PeerStep:
    count = belief.log_weight.size
    try:
        ns = compare(inputs, belief, runs)
    except ModuleNotFoundError as error:
        expected = "peers with all packages that they need, or none of them"
        hint = "installed without its dependencies"
        got = f"no module {error.name}"
        raise fail(MapfilterError, "bench filter --peers", expected, got, hint) from error
    rows, kept = belief.state.shape[0], belief.kept.shape[0]
    limit_ns, limit_bytes = memory_limit(rows, kept, count, runs)
    ratio = {name: took / ns[OWN] for name, took in ns.items()}
    return PeerStep(count, ns, ratio, limit_ns, limit_bytes)


def _installed(name: str) -> bool:
    return importlib.util.find_spec(name) is not None


def filterpy_step(model: NumpyModel, jitter: Floats, rng: np.random.Generator) -> Step | None:
    """Return a whole step in NumPy with the resampling of filterpy, or None without it."""
    if not _installed("filterpy"):
        return None
    from filterpy.monte_carlo import systematic_resample

    return numpy_step(model, jitter, rng, lambda weight, _: systematic_resample(weight))


def particles_step(model: NumpyModel, rng: np.random.Generator, steps: int) -> Step | None:
    """Return some steps by the package ``particles``, or None without it."""
    if not _installed("particles"):
        return None
    import particles
    from particles.core import FeynmanKac
    from particles.resampling import systematic

    class Walk(FeynmanKac):  # type: ignore[misc]
        first: Floats

        def M0(self, N: int) -> Floats:  # noqa: N802, N803
            return model.move(self.first[:N].T, rng).T

        def M(self, t: int, xp: Floats) -> Floats:  # noqa: ARG002, N802
            return model.move(xp.T, rng).T

        def logG(self, t: int, xp: Floats, x: Floats) -> Floats:  # noqa: ARG002, N802
            return model.log_likelihood(x.T)

    def step(state: Floats) -> Floats:
        walk = Walk(T=steps)
        walk.first = np.ascontiguousarray(state.T)
        run = particles.SMC(fk=walk, N=state.shape[1], resampling="systematic", ESSrmin=1.0)
        run.run()
        # It resamples before each step but the first.
        chosen: Floats = np.asarray(run.X)[systematic(run.W)]
        return chosen.T

    return step


def stone_soup_step(model: NumpyModel, rng: np.random.Generator) -> Step | None:
    """Return a whole step by Stone Soup, or None without it."""
    if not _installed("stonesoup"):
        return None
    from stonesoup.models.measurement import MeasurementModel
    from stonesoup.models.transition import TransitionModel
    from stonesoup.predictor.particle import ParticlePredictor
    from stonesoup.resampler.particle import SystematicResampler
    from stonesoup.types.array import StateVectors
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import ParticleState
    from stonesoup.updater.particle import ParticleUpdater

    class Walk(TransitionModel):  # type: ignore[misc]
        ndim_state = MAP + 1

        def function(self, state: Any, **_: Any) -> Any:
            return StateVectors(model.move(np.asarray(state.state_vector), rng))

        def rvs(self, *_: Any, **__: Any) -> Any:
            raise NotImplementedError

        def pdf(self, *_: Any, **__: Any) -> Any:
            raise NotImplementedError

    class ReportRow(MeasurementModel):  # type: ignore[misc]
        ndim_state = MAP + 1
        ndim_meas = 1
        mapping = (0,)

        def function(self, state: Any, **_: Any) -> Any:
            return state.state_vector[:1]

        def rvs(self, *_: Any, **__: Any) -> Any:
            raise NotImplementedError

        def pdf(self, *_: Any, **__: Any) -> Any:
            raise NotImplementedError

        def logpdf(self, _: Any, state: Any, **__: Any) -> Floats:
            return model.log_likelihood(np.asarray(state.state_vector))

    began = datetime(2000, 1, 1)
    later = began + timedelta(seconds=1)
    predictor = ParticlePredictor(Walk())
    updater = ParticleUpdater(measurement_model=ReportRow(), resampler=SystematicResampler())
    report = Detection(np.zeros((1, 1)), timestamp=later)

    def step(state: Floats) -> Floats:
        count = state.shape[1]
        known = ParticleState(
            StateVectors(state), weight=np.full(count, 1 / count), timestamp=began
        )
        predicted = predictor.predict(known, timestamp=later)
        found = updater.update(SingleHypothesis(predicted, report))
        return np.asarray(found.state_vector)

    return step
