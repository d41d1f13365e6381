"""The scripts in benchmarks/ compare the same models: peers agree with mapfilter."""

import sys
from pathlib import Path

import numpy as np
import pytest

from mapfilter.database.store import open_database
from mapfilter.models.level_memory import LevelMemory
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.tracks.store import read_log
from mapfilter.workflows import bench_filter

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))
import kalman_peers
from bayes_peers import MAP, NumpyModel, compare, numpy_step, particles_step, stone_soup_step

SMALL = (
    "area.bbox=24.9420,60.1660,24.9495,60.1697", "area.resolution_m=10", "journeys.length_m=400",
)  # fmt: skip


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    database, folders = bench_filter.make_world(tmp_path_factory.mktemp("bench"), SMALL)
    model = BayesFilter().over(open_database(database)).model
    return model, read_log(folders[0])


def test_numpy_weighs_like_the_filter(world):
    model, log = world
    inputs, belief = bench_filter.step_inputs(model, log, 4000)
    peer = NumpyModel(inputs)
    log_weight = np.zeros(4000)
    cloud, _ = model.weigh(belief.cloud, log_weight, peer.reading)
    state = np.vstack([belief.state.astype(np.float64), np.zeros(4000)])
    found, kept = peer.weigh(state)
    assert (kept.shape, np.ptp(log_weight) > 3) == (cloud.kept.shape, True)
    # Single precision puts a particle at a pixel's very edge into the next one, and at the edge of
    # a step of the table of absences into the next step.
    assert np.mean(np.abs(found - log_weight) < 2e-3) > 0.995
    assert np.mean(np.abs(kept - cloud.kept) < 5e-3) > 0.995


def test_numpy_moves_like_the_filter(world):
    model, log = world
    inputs, belief = bench_filter.step_inputs(model, log, 40_000)
    peer = NumpyModel(inputs)
    moved, weighed = model.move(belief.state, np.zeros(40_000), peer.motion, np.uint64(7))
    state = np.vstack([belief.state.astype(np.float64), np.zeros(40_000)])
    other = peer.move(state, np.random.default_rng(3))
    for row in range(MAP):
        spread = max(float(moved[row].std()), 1e-4)
        assert other[row].mean() == pytest.approx(moved[row].mean(), abs=0.02 * spread + 1e-4)
        assert other[row].std() == pytest.approx(moved[row].std(), rel=0.02, abs=1e-4)
    assert other[MAP].mean() == pytest.approx(weighed.mean(), rel=0.02)


@pytest.mark.filterwarnings("default")
def test_all_that_take_the_step_agree(world):
    model, log = world
    inputs, belief = bench_filter.step_inputs(model, log, 20_000)
    peer = NumpyModel(inputs)
    state = np.vstack([belief.state.astype(np.float64), np.zeros(20_000)])
    rng = np.random.default_rng(4)
    jitter = np.array([0.5, 0.5, 0.005, 0.003, 0.0, 0.004, 0.004, 1e-4])
    own = bench_filter.whole_step(inputs, belief, jitter.astype(np.float32), rng)
    width = LevelMemory.empty(model.evidence.levels, model.area.site_of).width
    assert own.shape == (STATES + width, 20_000)
    others = [numpy_step(peer, jitter, rng), stone_soup_step(peer, rng)]
    for step in others:
        if step is not None:
            found = step(state)
            assert found.shape[0] in (MAP + 1, MAP + 1 + width)
            assert found[:2].mean(axis=1) == pytest.approx(own[:2].mean(axis=1), abs=1.5)
    several = particles_step(peer, rng, 3)
    if several is not None:
        assert several(state).shape == (MAP + 1, 20_000)


@pytest.mark.filterwarnings("default")
def test_packages_are_compared_with_the_step(world):
    model, log = world
    found = compare(*bench_filter.step_inputs(model, log, 500), runs=1)
    assert {"mapfilter", "numpy"} <= set(found)
    assert min(found.values()) > 0


def test_filterpys_ekf_is_the_same_filter():
    rates, off = kalman_peers.compare(trials=20, runs=1)
    assert min(rates.values()) > 0
    assert off < 1e-6
