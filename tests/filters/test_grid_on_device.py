"""The grid filter with its mass on a device: as on the processor, and nothing is converted."""

import pickle
from dataclasses import dataclass, replace

import numpy as np
import pytest
import strict_arrays

from mapfilter._device import PROCESSOR, Device, on_host
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.filters.grid import GridBelief, GridFilter
from mapfilter.filters.grid_transport import Transport, Waiting
from mapfilter.filters.hypotheses import Bins

DEVICE = Device("gpu", strict_arrays)
"""NumPy's arrays that are not converted unless asked for, as CuPy's are not."""
MASS = np.random.default_rng(3).dirichlet(np.ones(40)).reshape(2, 4, 5).astype(np.float32)
MAP = np.random.default_rng(4).uniform(0.2, 1.0, (4, 5)).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Area:
    """Four rows of five pixels of 10 m, two headings; readings prefer the east."""

    device: Device = PROCESSOR

    bins = Bins.over((0.0, 0.0, 50.0, 40.0))
    circular = True
    bias_rad = np.array([-0.2, 0.3])

    def placed(self, device):
        return self if device is self.device else Area(device)

    def start(self, prior):  # noqa: ARG002
        return 0.8 * MASS, 0.2 * MASS

    def states(self, row, col, bias_rad, off):
        state = self.device.arrays.zeros((4, row.size), dtype=np.float32)
        state[0], state[1] = col * 10.0 + 5.0, row * 10.0 + 5.0
        state[2], state[3] = bias_rad, off
        return state

    def transport(self, east_m, north_m, *_):
        right, down = (np.array([way, 0.7 * way]) / 10.0 for way in (east_m, north_m))
        some = np.full(2, 0.4)
        return Transport(right, down, some, some, 0.3, self.device.placed(MAP), 0.6, 0.1, 0.2)

    def weigh(self, cloud, log_weight, reading):
        if reading is None:
            return cloud, Reason.NO_READING
        log_weight += cloud.state[0] * (0.02 * reading) - cloud.state[3]
        return cloud._replace(shared=reading), Reason.USED

    def can_converge(self, *_):
        return True


def followed(device, count=3, prepare=lambda belief: belief):
    filter_, rng = GridFilter(Area(device), device=device), np.random.default_rng(0)
    belief = prepare(filter_.init(None, rng))
    for k in range(count):
        belief, _ = filter_.predict(belief, MotionStep(6.0, 0.8 * k), rng)
        belief, info = filter_.update(belief, 1.0 + k, rng)
        assert info.reason is Reason.USED
        belief = prepare(belief)
    return belief


def assert_alike(found, expected):
    for name in ("on", "off"):
        one, other = on_host(getattr(found, name)), on_host(getattr(expected, name))
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-9)
        assert one.dtype == np.float32
    assert found.log_evidence == pytest.approx(expected.log_evidence, abs=1e-5)
    np.testing.assert_allclose(found.summary.mean, expected.summary.mean, rtol=1e-5)
    np.testing.assert_allclose(found.state, expected.state, rtol=1e-6)
    np.testing.assert_allclose(found.weight, expected.weight, rtol=1e-5)
    assert (found.count, found.shared, found.status) == (
        expected.count, expected.shared, expected.status)  # fmt: skip


def test_mass_stays_on_the_device_and_is_that_of_the_processor():
    here, there = followed(PROCESSOR), followed(DEVICE)
    assert isinstance(there.on, strict_arrays.Array)
    assert isinstance(there.off, strict_arrays.Array)
    assert isinstance(there.state, np.ndarray)
    assert_alike(there, here)
    assert on_host(here.on + here.off).sum() == pytest.approx(1.0, abs=1e-6)
    assert here.count == 40


def test_stored_mass_goes_on_wherever_it_is_read():
    """What is read lies on the processor; the next update places it on the filter's device."""

    def stored(belief):
        again = pickle.loads(pickle.dumps(replace(belief, model=Forgotten())))
        assert isinstance(again.on, np.ndarray)
        assert isinstance(again.off, np.ndarray)
        assert set(vars(again)) == set(GridBelief.__dataclass_fields__)
        return replace(again, model=belief.model.placed(PROCESSOR))

    expected = followed(PROCESSOR)
    for device in (PROCESSOR, DEVICE):
        assert_alike(followed(device, prepare=stored), expected)


class Forgotten:
    """A model whose arrays are left behind."""

    def placed(self, device):
        assert device is PROCESSOR
        return


def test_what_is_stored_has_the_model_of_the_processor():
    kept = followed(DEVICE, 1).__getstate__()
    assert kept["model"].device is PROCESSOR
    assert isinstance(kept["on"], np.ndarray)


def test_a_belief_is_placed_where_any_part_of_it_lies_elsewhere():
    there = followed(DEVICE, 1)
    assert there.placed(DEVICE) is there
    here = replace(
        there, on=on_host(there.on), off=on_host(there.off), model=there.model.placed(PROCESSOR)
    )
    assert here.placed(PROCESSOR) is here
    for part in ("on", "off", "model"):
        mixed = replace(there, **{part: getattr(here, part)})
        again = mixed.placed(DEVICE)
        assert again is not mixed
        assert isinstance(again.on, strict_arrays.Array)
        assert isinstance(again.off, strict_arrays.Array)
        assert again.model.device is DEVICE
        assert_alike(again, there)


def test_mass_that_lies_elsewhere_than_the_model_is_moved_with_it():
    there = followed(DEVICE, 1)
    ahead, _ = GridFilter(there.model, device=DEVICE).predict(
        there, MotionStep(6.0, 0.5), np.random.default_rng(0)
    )
    elsewhere = replace(ahead, on=on_host(ahead.on), off=on_host(ahead.off))
    found = elsewhere.moved
    assert isinstance(found.on, strict_arrays.Array)
    np.testing.assert_array_equal(on_host(found.on), on_host(ahead.moved.on))
    np.testing.assert_array_equal(on_host(found.off), on_host(ahead.moved.off))
    assert found.waiting == Waiting()


@pytest.mark.parametrize("device", [PROCESSOR, DEVICE])
def test_pixels_above_a_mass_or_a_share_of_the_highest(device):
    belief = GridFilter(Area(device), device=device).init(None, np.random.default_rng(0))
    ordered = np.sort(MASS.ravel())
    for least, of_highest in ((float(ordered[24:26].mean()), False), (0.5, True), (0.0, False)):
        at, mass, state = belief.above(least, of_highest=of_highest)
        limit = least * (ordered[-1] if of_highest else 1.0)
        bias, row, col = np.nonzero(limit < MASS)
        np.testing.assert_array_equal([on_host(one) for one in at], [bias, row, col])
        np.testing.assert_allclose(on_host(mass), MASS[bias, row, col], rtol=1e-6)
        places = [10.0 * col + 5, 10.0 * row + 5, np.array([-0.2, 0.3])[bias], 0.2 + 0.0 * col]
        np.testing.assert_allclose(on_host(state), places, rtol=1e-5)
