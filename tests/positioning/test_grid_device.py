"""The grid filter with its mass on a device: the estimates are those of the processor."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
import strict_arrays
from cross_world import CRS, EAST, NORTH, make_database, walk_log
from small_area import make_area

from mapfilter import _device
from mapfilter._device import PROCESSOR, Device, on_host
from mapfilter.errors import ConfigError
from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.grid import GridBelief
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.beliefs.device_step import DeviceStep
from mapfilter.positioning.bayes.options import GridFilter
from mapfilter.positioning.loop import locate
from mapfilter.positioning.merging import epochs
from mapfilter.tracks.log import make_log

DEVICE = Device("gpu", strict_arrays)
"""NumPy's arrays that are not converted unless asked for, as CuPy's are not."""


@pytest.fixture(scope="module")
def grid(tmp_path_factory):
    return GridFilter().over_area(open_area(make_database(tmp_path_factory.mktemp("device"))))


@pytest.fixture(autouse=True)
def _likelihoods_without_kernels(monkeypatch):
    """Kernels need a device or the simulator; here the processor takes their place."""

    def weigh(step, cloud, log_weight, reading):
        host = np.zeros(log_weight.size)
        here = Cloud(on_host(cloud.state), on_host(cloud.kept), cloud.shared)
        weighed, reason = step.model.weigh(here, host, reading)
        log_weight += step.device.placed(host)
        return weighed, reason

    monkeypatch.setattr(DeviceStep, "weigh", weigh)


def without_compass(log):
    turn = np.diff(log.motion["heading_rad"].to_numpy(), prepend=np.nan)
    turn = (turn + np.pi) % (2 * np.pi) - np.pi
    return replace(log, motion=log.motion.assign(heading_rad=np.nan, turn_rad=turn))


def with_fixes(log):
    fixes = log.truth[["time_s", "east_m", "north_m"]].assign(var_east_m2=90.0, var_north_m2=90.0)
    return replace(log, gnss=make_log(CRS, gnss=fixes.iloc[::7]).gnss)


LOGS = {
    "compass": lambda: walk_log(((EAST, 60.0), (NORTH, 40.0))),
    "no compass": lambda: without_compass(walk_log(((EAST, 12.0), (NORTH, 10.0)))),
    "fixes": lambda: with_fixes(walk_log(((EAST, 20.0), (NORTH, 15.0)))),
}


@pytest.mark.parametrize("log", LOGS)
def test_estimates_on_a_device_are_those_of_the_processor(grid, log):
    log = LOGS[log]()
    here, there = (
        locate(log, positioner, np.random.default_rng(0)).estimate
        for positioner in (grid, replace(grid, device=DEVICE))
    )
    assert np.isfinite(here.east_m).sum() >= 10
    for name in ("east_m", "north_m"):
        np.testing.assert_allclose(getattr(there, name), getattr(here, name), rtol=0, atol=1e-3)
    np.testing.assert_allclose(there.radii_m, here.radii_m, rtol=1e-3, atol=1e-2)
    np.testing.assert_allclose(there.mass_50m, here.mass_50m, atol=1e-4)
    assert there.status == here.status
    assert there.unused == here.unused


def test_mass_stays_on_the_device_from_step_to_step(grid):
    positioner, rng = replace(grid, device=DEVICE), np.random.default_rng(0)
    track = positioner.begin()
    for epoch in epochs(walk_log(((EAST, 5.0),))):
        track, _ = positioner.step(track, epoch, rng)
    belief = track.belief
    assert isinstance(belief.on, strict_arrays.Array)
    assert isinstance(belief.off, strict_arrays.Array)


def no_device():
    raise RuntimeError("cudaErrorNoDevice")


def test_a_stored_belief_can_be_read_where_there_is_no_device(grid, monkeypatch):
    positioner, rng = replace(grid, device=DEVICE), np.random.default_rng(0)
    track = positioner.begin()
    *before, last = epochs(walk_log(((EAST, 5.0),)))
    for epoch in before:
        track, _ = positioner.step(track, epoch, rng)
    stored = pickle.dumps(track.belief)
    monkeypatch.setattr(_device, "_opened", no_device)
    again = pickle.loads(stored)
    assert isinstance(again.on, np.ndarray)
    np.testing.assert_array_equal(again.on, strict_arrays.asnumpy(track.belief.on))
    assert isinstance(again.moved.on, np.ndarray)
    np.testing.assert_allclose(again.summary.mean, track.belief.summary.mean, atol=1e-3)
    # The filter goes on from it as from the other, on its device or on the processor.
    brought = again.placed(DEVICE)
    assert isinstance(brought.on, strict_arrays.Array)
    assert brought.placed(DEVICE) is brought
    expected = positioner.step(track, last, rng)[0].belief
    for other, arrays in ((positioner, strict_arrays.Array), (grid, np.ndarray)):
        found = other.step(replace(track, belief=again), last, rng)[0].belief
        assert isinstance(found.on, arrays)
        np.testing.assert_allclose(found.summary.mean, expected.summary.mean, atol=1e-3)


def test_likelihoods_that_were_computed_are_not_stored(grid, monkeypatch):
    positioner, rng = replace(grid, device=DEVICE), np.random.default_rng(0)
    track = positioner.begin()
    for epoch in epochs(walk_log(((EAST, 5.0),))):
        track, _ = positioner.step(track, epoch, rng)
    model = track.belief.model
    monkeypatch.setattr(_device, "_opened", lambda: strict_arrays)
    step = model._on_device
    assert step._log_map.shape == model._log_map.shape
    for kept in (model, step):
        assert "_log_map" in vars(kept)
        again = pickle.loads(pickle.dumps(kept))
        assert set(vars(again)) == set(kept.__dataclass_fields__)
        assert again.device == DEVICE


def test_positions_for_scores_bring_back_no_more_than_summaries(grid, monkeypatch):
    def brought(_):
        raise AssertionError("all pixels were brought back")

    monkeypatch.setattr(GridBelief, "_cloud", property(brought))
    positioner = replace(grid, device=DEVICE).for_scores()
    found = locate(walk_log(((EAST, 25.0),)), positioner, np.random.default_rng(0))
    assert np.isfinite(found.estimate.east_m).all()


def test_the_processor_is_the_default():
    positioner = GridFilter().over_area(make_area())
    assert positioner.device is positioner.beliefs.device is PROCESSOR
    assert pickle.loads(pickle.dumps(positioner)).device is PROCESSOR


def test_a_device_that_is_missing_is_named():
    with pytest.raises(ConfigError, match=r"^filter\.grid\.device: expected a graphics processor"):
        GridFilter(device="gpu").over_area(make_area())
    with pytest.raises(ConfigError, match=r"GridFilter, device: expected 'cpu' or 'gpu'"):
        GridFilter(device="cuda")
