"""Kernels of a graphics processor in numba's simulator, beside those of the processor.

Run by :mod:`test_device_kernels` in a process of its own, which sets NUMBA_ENABLE_CUDASIM: the
simulator has to be asked for before numba is loaded.
"""

from dataclasses import replace
from math import radians
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import strict_arrays
from numba import config
from small_area import HEIGHT_M, SOUTH_M, WEST_M, WIDTH_M, make_area

from mapfilter import _cuda
from mapfilter._device import PROCESSOR, Device
from mapfilter._kernels import draw_key
from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.filters.grid import GridFilter as BeliefGrid
from mapfilter.filters.resampling import copy_with_jitter, normalise, systematic
from mapfilter.models.fingerprint import BoundReading
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.street_motion import MotionErrors
from mapfilter.positioning.bayes.beliefs.device_step import DeviceStep
from mapfilter.positioning.bayes.beliefs.first_hypotheses import Start
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.grid import StreetGrid
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.bayes.sources.measured_model import MeasuredMapModel
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.gnss.fixes import FixTerm
from mapfilter.workflows.benchmarks import device as bench_device

assert config.ENABLE_CUDASIM
DEVICE = Device("gpu", np)
"""Kernels are simulated; the simulator takes NumPy's arrays."""
BLOCK, COUNT = 32, 70
"""Threads of a block, and hypotheses: more than one block, the last of which is not full."""
JITTER = np.array([0.5, 0.5, 0.005, 0.003, 0.0, 0.004, 0.004, 1e-4], np.float32)


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch):
    """The simulator starts all threads of a block, also those that have nothing to do."""
    monkeypatch.setattr(_cuda, "_THREADS", BLOCK)


def particles(rows=8, seed=3):
    """Particles in the area and around it, some off the map."""
    rng = np.random.default_rng(seed)
    state = np.zeros((rows, COUNT), dtype=np.float32)
    state[0] = rng.uniform(-15.0, WIDTH_M + 15.0, COUNT)
    state[1] = rng.uniform(-15.0, HEIGHT_M + 15.0, COUNT)
    state[2] = rng.uniform(-np.pi, np.pi, COUNT)
    state[3:7] = 0.05 * rng.standard_normal((4, COUNT))
    state[4] = rng.random(COUNT)
    state[7:] = 1e-3 * rng.standard_normal((rows - 7, COUNT))
    return state, np.log(rng.dirichlet(np.ones(COUNT)))


def report(limit_dbm=-95.0, offset_db=3.0, cells=(0, 2)):
    cell = np.array(cells, dtype=np.int32)
    level = np.array([-71.5, -88.25, -80.0, -90.0][: cell.size], dtype=np.float32)
    absent = np.setdiff1d(np.arange(4, dtype=np.int32), cell)
    limit_dbm = np.full(absent.size, limit_dbm, dtype=np.float32)
    return LevelReport(cell, level, absent, limit_dbm, offset_db)


@pytest.mark.parametrize("remember", [True, False])
def test_reports(remember):
    """Two reports one after the other: aged errors, a new cell, absent ones."""
    state, log_weight = particles()
    model = BayesModel(make_area(), remember=remember)
    step = DeviceStep(model, DEVICE)
    here = there = Cloud(state, np.empty((0, COUNT), np.float32))
    for reading in (
        RadioReading(0, 0.2, report(), length_m=0.0),
        RadioReading(1, 0.5, report(cells=(0, 1, 3)), length_m=12.0),
        RadioReading(-1, 0.0, report(cells=()), length_m=5.0),
        RadioReading(2, 0.5, None, length_m=5.0),
    ):
        expected, found = log_weight.copy(), log_weight.copy()
        here, _ = model.weigh(here, expected, reading)
        there, reason = step.weigh(there, found, reading)
        assert reason is Reason.USED
        assert np.ptp(expected - log_weight) > 0.05
        np.testing.assert_allclose(found, expected, rtol=0, atol=5e-5)
        np.testing.assert_allclose(there.kept, here.kept, rtol=1e-4, atol=2e-4)
        for name in ("covariance_db2", "other_dbm", "other_log_likelihood"):
            one, other = getattr(there.shared, name), getattr(here.shared, name)
            np.testing.assert_array_equal(one, other)


def test_a_whole_step_gives_the_estimate_of_the_processor():
    state, log_weight = particles()
    model = BayesModel(make_area())
    step, motion = DeviceStep(model, DEVICE), MotionStep(1.4, radians(37.0))
    reading = RadioReading(0, 0.2, report(cells=(0, 1, 3)), length_m=5.0)
    memory, _ = model.weigh(Cloud(state, np.empty((0, COUNT), np.float32)), log_weight, reading)
    results = []
    for mover, weigh in ((model.move, model.weigh), (step.move, step.weigh)):
        moved, weighed = mover(state, log_weight, motion, np.uint64(9))
        cloud = memory._replace(state=moved, kept=memory.kept.copy())
        cloud, _ = weigh(cloud, weighed, reading)
        results.append((cloud, weighed))
    (here, expected), (there, found) = results
    means = []
    for cloud, log_of in ((here, expected), (there, found)):
        weight = np.exp(log_of - log_of.max())
        means.append((cloud.state[:2] * weight).sum(axis=1) / weight.sum())
    np.testing.assert_allclose(means[1], means[0], rtol=0, atol=1e-3)
    copies, kept = step.resample(there, found, JITTER, np.random.default_rng(2))
    rng, weight = np.random.default_rng(2), np.empty(COUNT, np.float32)
    normalise(expected, weight)
    chosen = np.empty(COUNT, np.int32)
    systematic(weight, rng.random(), chosen)
    same = np.empty_like(state)
    copy_with_jitter(0, COUNT, here.state, chosen, JITTER, draw_key(rng), same)
    np.testing.assert_allclose(copies, same, rtol=1e-5, atol=1e-4)
    np.testing.assert_allclose(kept, here.kept[:, chosen], rtol=1e-4, atol=5e-4)


def test_more_levels_than_slots_are_left_out():
    state, log_weight = particles()
    area = make_area()
    model = BayesModel(replace(area, sites={}))
    step = DeviceStep(model, DEVICE)
    reading = RadioReading(3, 0.4, report(cells=(0, 1, 2, 3)), length_m=2.0)
    expected, found = log_weight.copy(), log_weight.copy()
    nothing = Cloud(state, np.empty((0, COUNT), np.float32))
    model.weigh(nothing, expected, reading)
    step.weigh(nothing, found, reading)
    np.testing.assert_allclose(found, expected, rtol=0, atol=5e-5)


def test_a_serving_cell_of_little_weight_and_hypotheses_on_the_edge():
    state, log_weight = particles()
    model = BayesModel(make_area())
    east_m, north_m = model.area.size_m
    state[:2, :4] = [[0.0, east_m, 30.0, 30.0], [30.0, 30.0, 0.0, north_m]]
    step, nothing = DeviceStep(model, DEVICE), Cloud(state, np.empty((0, COUNT), np.float32))
    reading = RadioReading(1, 0.4)
    expected, found = log_weight.copy(), log_weight.copy()
    model.weigh(nothing, expected, reading)
    _, reason = step.weigh(nothing, found, reading)
    assert reason is Reason.USED
    assert np.ptp(expected - log_weight) > 0.1
    np.testing.assert_allclose(found, expected, rtol=0, atol=5e-5)


def test_bounds_and_ambiguous_levels():
    state, log_weight = particles()
    model = BayesModel(make_area())
    step, nothing = DeviceStep(model, DEVICE), Cloud(state, np.empty((0, COUNT), np.float32))
    for censored in (-1, 0, 1):
        bounds = (
            BoundReading(np.array([1, 2], np.int32), -84.0, censored, 8.0, 0.4),
            BoundReading(np.array([3], np.int32), -110.0, censored, 8.0, 0.7),
        )
        reading = RadioReading(-1, 0.0, None, bounds)
        expected, found = log_weight.copy(), log_weight.copy()
        model.weigh(nothing, expected, reading)
        _, reason = step.weigh(nothing, found, reading)
        assert reason is Reason.USED
        assert np.ptp(expected - log_weight) > 0.5
        np.testing.assert_allclose(found, expected, rtol=0, atol=2e-5)


def test_terms_of_other_sources_and_none():
    state, log_weight = particles()
    step, nothing = DeviceStep(BayesModel(make_area()), DEVICE), np.empty((0, COUNT), np.float32)
    term = FixTerm(GnssFix(WEST_M + 40.0, SOUTH_M + 30.0), (WEST_M, SOUTH_M))
    found = log_weight.copy()
    _, reason = step.weigh(Cloud(state, nothing), found, RadioReading(terms=(term,)))
    assert reason is Reason.USED
    np.testing.assert_allclose(found, log_weight + term.log_likelihood(state), atol=1e-12)
    same = log_weight.copy()
    _, reason = step.weigh(Cloud(state, nothing), same, RadioReading())
    assert reason is Reason.NO_READING
    np.testing.assert_array_equal(same, log_weight)


def test_a_grid_on_a_device_computes_the_likelihood_there(monkeypatch):
    """Kernels are handed what the arrays of the stand-in hold; nothing else is converted."""
    real = _cuda.start

    def started(kernel, count, *given):
        real(kernel, count, *(getattr(one, "held", one) for one in given))

    monkeypatch.setattr(_cuda, "start", started)
    model = BayesModel(make_area(), MotionErrors(bias_sd_rad=0.02), remember=False)
    tracks = []
    for device in (PROCESSOR, Device("gpu", strict_arrays)):
        grid = StreetGrid(model, device=device)
        filter_, rng = BeliefGrid(grid, device=device), np.random.default_rng(0)
        belief, track = filter_.init(Start(RadioReading(0, 0.2, report())), rng), []
        for k in range(3):
            belief, _ = filter_.predict(belief, MotionStep(7.0, 0.9 * k), rng)
            reading = RadioReading(1, 0.3, report(cells=(0, 1, k + 1)[: 2 + k]), length_m=7.0)
            belief, info = filter_.update(belief, reading, rng)
            assert info.reason is Reason.USED
            summary = belief.summary
            track.append([*summary.mean[:2], *summary.radii_m, belief.log_evidence])
        tracks.append(track)
    np.testing.assert_allclose(tracks[1], tracks[0], rtol=0, atol=1e-3)


def test_a_small_bench_of_a_device(monkeypatch):
    monkeypatch.setattr(bench_device, "_PER_RUN", 1)
    truth = pd.DataFrame({"east_m": [WEST_M + 45.0], "north_m": [SOUTH_M + 30.0]})
    log = SimpleNamespace(truth=truth)
    found = bench_device.measured(BayesModel(make_area()), log, DEVICE, COUNT, 1)
    assert found.particles == COUNT
    assert min(found.cpu_ns, found.gpu_ns) > 0
    assert found.speedup == found.cpu_ns / found.gpu_ns
    assert found.difference_m < 1e-3


def test_serving_cells_of_a_measured_map_are_looked_up_by_the_processor():
    state, log_weight = particles()
    area = make_area()

    class Statistics:
        def log_serving(self, serving, pixel):
            return (-0.1 * (serving + 1) * pixel).astype(np.float32)

    model = MeasuredMapModel(area, serving_model=Statistics())
    step, nothing = DeviceStep(model, DEVICE), Cloud(state, np.empty((0, COUNT), np.float32))
    expected, found = log_weight.copy(), log_weight.copy()
    reading = RadioReading(1, 0.5, report(), length_m=2.0)
    model.weigh(nothing, expected, reading)
    step.weigh(nothing, found, reading)
    assert np.ptp(expected - log_weight) > 2
    np.testing.assert_allclose(found, expected, rtol=0, atol=5e-5)
