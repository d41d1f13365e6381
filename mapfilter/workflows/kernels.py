"""Compile the kernels of a replay in other processes, where this machine has not done so yet.

Numba keeps compiled kernels on disk, for each version of their source and each processor. What is
not compiled here is compiled when it is first called: only the time of a first run depends on this.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._kernels import draw_key
from mapfilter._parallel import begun, spare_processes
from mapfilter._types import Floats, Floats32
from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import MotionStep
from mapfilter.filters.hypotheses import flattened, summarise
from mapfilter.filters.resampling import copy_with_jitter, normalise, systematic
from mapfilter.lattice import Lattice
from mapfilter.models.fingerprint import BoundReading, weigh_by_bound
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.street_motion import OFF, STATES
from mapfilter.models.way_map import all_inside, weight_inside
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.beliefs.legs import Lead
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.fingerprints.likelihood_kernel import add_reading
from mapfilter.positioning.integrity import sample_tail
from mapfilter.positioning.step_output import protected_m

WORKERS = 2
"""Processes that compile beside this one."""
_PARTICLES, _PIXELS, _PIXEL_M = 64, 4, 5.0


@contextmanager
def compiled_beside() -> Iterator[None]:
    """Compile what the Bayes filter needs, in two processes, while the block runs.

    At its end all is compiled, here where a process failed. Nothing is done where it is already, or
    on a single processor.
    """
    if not to_compile():
        yield
        return
    with spare_processes(WORKERS) as workers:
        tasks = begin_kernels(workers)
        yield
        for one in tasks:
            one()


def to_compile() -> bool:
    """Return whether kernels are not compiled yet, and there are processors to do it beside."""
    return (os.cpu_count() or 1) >= WORKERS and not all(map(_is_kept, _LAST))


def begin_kernels(workers: Executor) -> list[Callable[[], None]]:
    """Hand out the compilation of what the Bayes filter needs; call what is returned at the end."""
    return [begun(workers, task) for task in _TASKS]


def compile_evidence() -> None:
    """Compile the weighing by reports."""
    model, cloud, log_weight = _made()
    one, none = np.full(1, -60, dtype=np.float32), np.zeros(1, dtype=np.int32)
    levels = LevelReport(none, one, none, one - 40, 1.0)
    plain = RadioReading(0, 1.0, levels)
    # What is kept of a first report decays until the second.
    cloud, _ = model.weigh(cloud, log_weight, plain)
    bounds = (BoundReading(none, -60.0, 1, 8.0, 1.0),)
    model.weigh(cloud, log_weight, RadioReading(0, 1.0, levels, bounds, tracked=True))


def compile_motion() -> None:
    """Compile steps, and the weighing by the map."""
    model, cloud, log_weight = _made()
    model.move(cloud.state, log_weight, MotionStep(1.0, 0.0), draw_key(np.random.default_rng(0)))
    east_m, north_m = cloud.state[:2]
    weight_inside(east_m, north_m, log_weight.astype(np.float32), *model.area.size_m)
    model.area.clear_of_edge(cloud.state)


def compile_summaries() -> None:
    """Compile the summary of a belief, and how it goes on by dead reckoning."""
    model, cloud, _ = _made()
    weight = np.full(_PARTICLES, 1 / _PARTICLES, dtype=np.float32)
    Lead.of(cloud.state, weight, np.zeros(STATES))
    summarise(cloud.state, weight, model.bins)
    flattened(cloud.state, weight, model.bins, 0.5)


def compile_resampling() -> None:
    """Compile resampling, the protection level, and the way that a belief lies on."""
    model, cloud, log_weight = _made()
    weight, chosen = np.empty(_PARTICLES, dtype=np.float32), np.empty(_PARTICLES, dtype=np.int32)
    normalise(log_weight, weight)
    model.area.matched_way(cloud.state[0], cloud.state[1], weight)
    tail = sample_tail(cloud.state[0], cloud.state[1], weight, np.zeros(STATES), 0.0)
    protected_m(tail, np.zeros(3))
    chosen[:] = np.arange(_PARTICLES)
    jitter, copies = np.ones(STATES, dtype=np.float32), np.empty_like(cloud.state)
    key = draw_key(np.random.default_rng(0))
    copy_with_jitter(0, _PARTICLES, cloud.state, chosen, jitter, key, copies)
    systematic(weight, 0.5, chosen)


def compile_reports() -> None:
    """Compile the location of single reports, which a replay does beside the filter."""
    one, number, reading = np.ones(1), np.zeros(1, dtype=np.int64), (-60.0, 0.0, 0.0)
    add_reading(number, one, one, one, one, reading, np.zeros(1), np.zeros((4, 1)))


def compile_gaussian() -> None:
    """Compile Kalman-type filters, and the weighing of Rao-Blackwellised particles."""
    # A replay by another filter does without these modules.
    from mapfilter.filters._rao_blackwell import weigh_kernel
    from mapfilter.filters._updates import kernel_of, run_lanes_kernel
    from mapfilter.filters.gaussian import METHODS
    from mapfilter.models.terms import measure_kernel
    from mapfilter.positioning.gaussian_tail import GaussianTail
    from mapfilter.positioning.kalman.place import gaussian_radii_m

    for kernel in (measure_kernel, run_lanes_kernel, weigh_kernel):
        kernel()
    for method in METHODS.values():
        kernel_of(method)
    radii_m, _ = gaussian_radii_m(np.eye(2), 1.0)
    protected_m(GaussianTail(np.ones(1), np.zeros((1, 2)), np.eye(2)[None]), radii_m)


def compile_mixtures() -> None:
    """Compile Gaussian sums, and the backward simulation of smoothing."""
    from mapfilter.filters.gaussian_sum import run_mixture_kernel
    from mapfilter.models.street_ancestors import draw_ancestors

    run_mixture_kernel()
    _, cloud, log_weight = _made()
    state, weight = cloud.state[: OFF + 1].copy(), log_weight.astype(np.float32)
    key = draw_key(np.random.default_rng(0))
    draw_ancestors(state, state, weight, (1.0, 0.0), (1.0, 1.0, 1.0), -10.0, key)


def compile_bounds() -> None:
    """Compile what ``bound`` computes of a map, by one of a few streets."""
    from mapfilter.database.store import open_database
    from mapfilter.evaluation.first_fix import FirstFixOptions
    from mapfilter.evaluation.map_bound import bound
    from mapfilter.workflows.bench import build_made, made_rasters

    with tempfile.TemporaryDirectory(prefix="mapfilter-kernels-") as name:
        rasters, _ = made_rasters(Path(name) / "rasters.tif", 2, 10 * _PIXELS)
        build_made(rasters.path, 20 * _PIXELS)
        bound(open_database(Path(name) / "peak"), options=FirstFixOptions(journeys=1))


def compile_all() -> None:
    """Compile what the usual commands need, so that no first run has to: for an image, say.

    These are the Bayes map filter on a map that is held whole and its smoothing, Kalman-type
    filters, Gaussian sums, weighing by Rao-Blackwellised particles, and ``bound``. What large areas
    need besides is compiled when it is first called.

    ``python -m mapfilter.workflows.kernels`` does this; it takes more than a minute, and some
    seconds where all is compiled already. With ``--replay`` it compiles those of the Bayes map
    filter alone, in two processes.
    """
    for task in (*_TASKS, compile_gaussian, compile_mixtures, compile_bounds):
        task()


# The longest first; what each compiles last shows that it has ended.
_TASKS = (compile_motion, compile_evidence, compile_summaries, compile_resampling, compile_reports)
_LAST: tuple[Any, ...] = (all_inside, weigh_by_bound, flattened, systematic, add_reading)


def _is_kept(kernel: Any) -> bool:
    """Return whether a kernel's present source lies compiled on this machine."""
    code, version = kernel.py_func.__code__, f"py{sys.version_info[0]}{sys.version_info[1]}"
    name = f"*.{code.co_name}-{code.co_firstlineno}.{version}*.nbi"
    return any(Path(kernel.stats.cache_path).glob(name))


def _made() -> tuple[BayesModel, Cloud, Floats]:
    """Return a made area with one cell, and hypotheses at its corner."""
    lattice = Lattice("EPSG:32635", 0.0, _PIXELS * _PIXEL_M, _PIXEL_M, _PIXELS, _PIXELS)
    flat: Floats32 = np.zeros((_PIXELS, _PIXELS), dtype=np.float32)
    level = np.full((_PIXELS, _PIXELS, 3), -60.0, dtype=np.float32)
    way = np.ones((_PIXELS, _PIXELS), dtype=np.int64)
    area = AreaMap(
        lattice, ("A",), frozenset({"A"}), level, flat, way, way > 0, {}, -110.0,
        {"A": (0.0, 0.0, 20.0)},
    )  # fmt: skip
    state = np.ones((STATES, _PARTICLES), dtype=np.float32)
    log_weight = np.full(_PARTICLES, -np.log(_PARTICLES))
    return BayesModel(area), Cloud(state, np.empty((0, _PARTICLES), dtype=np.float32)), log_weight


def main() -> None:
    """Compile kernels as the command line says."""
    parser = argparse.ArgumentParser(description="Compile kernels ahead of their first use.")
    parser.add_argument("--replay", action="store_true", help="of the Bayes map filter alone")
    if not parser.parse_args().replay:
        compile_all()
        return
    with compiled_beside():
        pass
    if not all(map(_is_kept, _LAST)):
        for task in _TASKS:
            task()


if __name__ == "__main__":
    main()
