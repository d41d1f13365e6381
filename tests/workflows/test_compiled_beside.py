"""Kernels that are compiled beside the first stages are those that a replay then calls."""

import subprocess
import sys
from functools import partial

from mapfilter.filters._rao_blackwell import weigh_kernel
from mapfilter.filters._updates import _compiled, kernel_of, run_lanes_kernel
from mapfilter.filters.gaussian import METHODS
from mapfilter.models.terms import measure_kernel
from mapfilter.workflows import kernels

# In a process of its own: in this one other tests have called the kernels already.
_CHECK = """
import numpy as np
from mapfilter.filters import hypotheses, particle, resampling
from mapfilter.filters.contract import MotionStep
from mapfilter.models import fingerprint, level_covariance, level_kernels, street_motion, way_map
from mapfilter.positioning import integrity, step_output
from mapfilter.positioning.bayes.area import area_map
from mapfilter.positioning.bayes.beliefs import model
from mapfilter.positioning.bayes.sources import evidence
from mapfilter.workflows import kernels

compiled = {
    f"{module.__name__}.{name}": found
    for module in (
        area_map, fingerprint, hypotheses, integrity, level_covariance, level_kernels, resampling,
        street_motion, way_map,
    )
    for name, found in vars(module).items()
    if hasattr(found, "signatures") and found.py_func.__module__ == module.__name__
}
called = lambda: {name: tuple(found.signatures) for name, found in compiled.items()}
for task in kernels._TASKS:
    task()
before = called()
made, cloud, log_weight = kernels._made()
rng = np.random.default_rng(0)
filter_ = particle.ParticleFilter(made, particle.ParticleOptions(500, 400, 300))
belief = filter_.init(model.Start(None, True, 10.0, 10.0, 2.0), rng)
none = np.zeros(1, np.int32)
levels = kernels.LevelReport(none, *(np.full(1, -60, "f4"), none, np.full(1, -100, "f4")), 1.0)
bound = fingerprint.BoundReading(none, -60.0, 1, 8.0, 1.0)
for _ in range(3):
    belief, _ = filter_.predict(belief, MotionStep(1.0, 0.3), rng)
    reading = evidence.RadioReading(0, 1.0, levels, (bound,), length_m=1.0, tracked=True)
    belief, _ = filter_.update(belief, reading, rng)
    belief.summary, made.area.matched_way(*belief.state[:2], belief.weight)
    tail = integrity.sample_tail(*belief.state[:2], belief.weight, belief.summary.mean, 0.0)
    step_output.protected_m(tail, belief.summary.radii_m)
    made.area.holds(*belief.state[:2], belief.weight), made.area.clear_of_edge(belief.state)
assert called() == before, set(called().items()) - set(before.items())
assert sum(map(len, before.values())) >= 22, before
"""


def test_a_filter_calls_what_was_compiled():
    done = subprocess.run([sys.executable, "-c", _CHECK], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]


def test_nothing_is_started_where_all_is_kept(monkeypatch):
    monkeypatch.setattr(kernels, "spare_processes", None)
    monkeypatch.setattr(kernels, "_is_kept", lambda _: True)
    with kernels.compiled_beside():
        pass


def test_kalman_filters_and_rao_blackwellised_particles_are_compiled():
    kernels.compile_gaussian()
    kept = (run_lanes_kernel, weigh_kernel, measure_kernel)
    before = [one.cache_info().misses for one in (*kept, _compiled)]
    for one in kept:
        assert one().signatures
    for method in METHODS.values():
        assert kernel_of(method).signatures
    assert [one.cache_info().misses for one in (*kept, _compiled)] == before


def test_all_kernels_are_compiled_by_one_call(monkeypatch):
    done = []
    for name in ("compile_motion", "compile_evidence", "compile_summaries", "compile_resampling"):
        assert getattr(kernels, name) in kernels._TASKS
    monkeypatch.setattr(kernels, "_TASKS", (lambda: done.append("replay"),))
    for name in ("gaussian", "mixtures", "bounds"):
        monkeypatch.setattr(kernels, f"compile_{name}", partial(done.append, name))
    kernels.compile_all()
    assert done == ["replay", "gaussian", "mixtures", "bounds"]


def test_a_kernel_is_kept_by_its_line():
    class Elsewhere:
        py_func = test_nothing_is_started_where_all_is_kept
        stats = kernels.all_inside.stats

    kernels.compile_motion()
    assert kernels._is_kept(kernels.all_inside)
    assert not kernels._is_kept(Elsewhere)
