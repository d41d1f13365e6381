"""What is compared with other packages is the same model: peers agree with mapfilter."""

import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, MapfilterError
from mapfilter.filters.resampling import systematic
from mapfilter.models.level_memory import LevelMemory
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.tracks.store import read_log
from mapfilter.workflows.bench import run_bench
from mapfilter.workflows.benchmarks import filter as bench_filter
from mapfilter.workflows.benchmarks import peers as bench_peers_module
from mapfilter.workflows.benchmarks.numpy_reference import (
    MAP,
    NumpyModel,
    numpy_step,
    systematic_indices,
)
from mapfilter.workflows.benchmarks.peers import (
    PACKAGES,
    bench_peers,
    compare,
    filterpy_step,
    memory_limit,
    particles_step,
    stone_soup_step,
)

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))
import kalman_peers

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
    peer = NumpyModel(inputs, belief)
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
    peer = NumpyModel(inputs, belief)
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
    peer = NumpyModel(inputs, belief)
    state = np.vstack([belief.state.astype(np.float64), np.zeros(20_000)])
    rng = np.random.default_rng(4)
    jitter = np.array([0.5, 0.5, 0.005, 0.003, 0.0, 0.004, 0.004, 1e-4])
    own = bench_filter.whole_step(inputs, belief, jitter.astype(np.float32), rng)
    width = LevelMemory.empty(model.evidence.levels, model.area.site_of).width
    assert [one.shape for one in own] == [(STATES, 20_000), (width, 20_000)]
    others = [
        numpy_step(peer, jitter, rng),
        stone_soup_step(peer, rng),
        filterpy_step(peer, jitter, rng),
    ]
    for step in others:
        if step is not None:
            found = step(state)
            assert found.shape[0] in (MAP + 1, MAP + 1 + width)
            assert found[:2].mean(axis=1) == pytest.approx(own[0][:2].mean(axis=1), abs=1.5)
    several = particles_step(peer, rng, 3)
    if several is not None:
        assert several(state).shape == (MAP + 1, 20_000)


@pytest.mark.filterwarnings("default")
def test_packages_are_compared_with_the_step(world):
    model, log = world
    found = compare(*bench_filter.step_inputs(model, log, 500), runs=1)
    assert {"mapfilter", "numpy"} <= set(found)
    assert min(found.values()) > 0


@pytest.mark.parametrize(("count", "steps"), [(500, 10), (400_000, 5)])
@pytest.mark.filterwarnings("default")
def test_times_are_those_of_one_step_of_several(world, monkeypatch, count, steps):
    model, log = world
    monkeypatch.setattr(bench_peers_module, "median_seconds", one_second_each)
    monkeypatch.setattr(bench_peers_module, "_in_a_row", lambda step, _: step)
    found = compare(*bench_filter.step_inputs(model, log, count), runs=1)
    assert list(found.values()) == pytest.approx([1e9 / (steps * count)] * len(found))


def one_second_each(tasks, *_):
    return dict.fromkeys(tasks, 1.0)


def test_steps_in_a_row_are_as_many_as_are_counted():
    taken = []
    bench_peers_module._in_a_row(taken.append, 4)("state")
    assert taken == ["state"] * 4
    assert bench_peers_module._in_a_row(None, 4) is None


def made_particles(done):
    """Return a stand-in for the package: its loop over moves, weights and resampling."""

    def chosen(weight):
        done.append("choice")
        return np.zeros(weight.size, dtype=int)

    class Smc:
        def __init__(self, fk, N, **_):  # noqa: N803
            self.fk, self.count = fk, N

        def run(self):
            for t in range(self.fk.T):
                # Nothing is resampled before the first step.
                before = None if t == 0 else self.X[chosen(self.W)]
                self.X = self.fk.M0(self.count) if t == 0 else self.fk.M(t, before)
                self.W = self.fk.logG(t, before, self.X)

    class Kac:
        def __init__(self, T):  # noqa: N803
            self.T = T

    package, core, resampling = (ModuleType(f"particles{end}") for end in ("", ".core", ".re"))
    package.SMC, core.FeynmanKac, resampling.systematic = Smc, Kac, chosen
    return {"particles": package, "particles.core": core, "particles.resampling": resampling}


def test_particles_moves_weighs_and_resamples_as_often_as_it_is_counted(monkeypatch):
    done = []

    class Model:
        def move(self, state, _):
            done.append("move")
            return state

        def log_likelihood(self, state):
            done.append("weigh")
            return state[0]

    for name, module in made_particles(done).items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(bench_peers_module, "_installed", lambda _: True)
    several = particles_step(Model(), np.random.default_rng(1), 3)
    assert several(np.zeros((MAP + 1, 30))).shape == (MAP + 1, 30)
    assert done == ["move", "weigh", "choice"] * 3


@pytest.mark.filterwarnings("default")
def test_one_run_has_all_peers_their_ratios_and_the_limit():
    found = bench_peers(runs=1, particles=(400, 600), settings=SMALL)
    assert (found.runs, [one.particles for one in found.steps]) == (1, [400, 600])
    for one in found.steps:
        assert one.ns.keys() == one.ratio.keys()
        # A package is measured or named as one that is not installed.
        assert {*one.ns, *found.not_installed} == {"mapfilter", "numpy", *PACKAGES}
        assert one.ratio["mapfilter"] == 1.0
        for name, ratio in one.ratio.items():
            assert ratio == pytest.approx(one.ns[name] / one.ns["mapfilter"])
        assert one.limit_ns > 0
        assert one.limit_bytes % 16 == 0


def test_the_limit_counts_what_is_kept_of_each_particle():
    assert memory_limit(8, 31, 1000, 1)[1] == 4 * 4 * 39
    assert memory_limit(8, 0, 1000, 1)[1] == 4 * 4 * 8


def test_copies_by_numpy_are_those_of_the_filter():
    weight = np.random.default_rng(2).random(300)
    weight /= weight.sum()
    chosen = np.empty(300, dtype=np.int32)
    systematic(weight.astype(np.float32), np.random.default_rng(5).random(), chosen)
    found = systematic_indices(weight, np.random.default_rng(5))
    assert np.mean(found == chosen) > 0.99


def test_peers_are_those_of_the_filter_only():
    with pytest.raises(ConfigError, match="bench --peers: expected the stage filter, found build"):
        run_bench("build", peers=True)


def test_filterpys_ekf_is_the_same_filter():
    rates, off = kalman_peers.compare(trials=20, runs=1)
    assert min(rates.values()) > 0
    assert off < 1e-6


def test_a_peer_without_what_it_needs_is_named(monkeypatch):
    def lacking(*_):
        raise ModuleNotFoundError("No module named 'ordered_set'", name="ordered_set")

    monkeypatch.setattr("mapfilter.workflows.benchmarks.peers.stone_soup_step", lacking)
    with pytest.raises(MapfilterError, match="no module ordered_set"):
        bench_peers(runs=1, particles=(400,), settings=SMALL)
