"""Noisy copies by the kernel of a graphics processor, in numba's simulator.

Run by :mod:`test_device_kernels` in a process of its own.
"""

import numpy as np
import pytest
from numba import config

from mapfilter import _cuda
from mapfilter.filters import cuda_copies
from mapfilter.filters.resampling import copy_with_jitter

assert config.ENABLE_CUDASIM
BLOCK, COUNT = 32, 70
"""Threads of a block, and hypotheses: more than one block, the last of which is not full."""
KEY = np.uint64(2**63 + 5)


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch):
    """The simulator starts all threads of a block, also those that have nothing to do."""
    monkeypatch.setattr(_cuda, "_THREADS", BLOCK)


def particles(rows):
    rng = np.random.default_rng(rows)
    state = rng.normal(0.0, 300.0, (rows, COUNT)).astype(np.float32)
    return state, np.sort(rng.integers(COUNT, size=COUNT)).astype(np.int32)


def copied(state, chosen, jitter):
    copies = np.full((state.shape[0], chosen.size), np.nan, np.float32)
    cuda_copies.copy_with_jitter(state, chosen, np.float32(jitter), KEY, copies)
    return copies


@pytest.mark.parametrize("rows", [1, 2, 5, 8])
@pytest.mark.parametrize("noisy", [0, 1, 2, 3, 8])
def test_copies_are_those_of_the_processor(rows, noisy):
    """Whatever the number of rows, and of those with noise: numbers are drawn in pairs."""
    (state, chosen), jitter = particles(rows), np.arange(1, 1 + min(noisy, rows)) / 4
    expected = np.full_like(state, np.nan)
    copy_with_jitter(0, COUNT, state, chosen, np.float32(jitter), KEY, expected)
    found = copied(state, chosen, jitter)
    np.testing.assert_allclose(found, expected, rtol=2e-6, atol=1e-5)
    np.testing.assert_array_equal(found[jitter.size :], state[jitter.size :, chosen])


def test_each_copy_has_noise_of_its_own_of_the_size_that_is_asked_for():
    state, chosen = np.zeros((4, 1), np.float32), np.zeros(3000, np.int32)
    sd = np.float32([0.5, 2.0, 0.0, 8.0])
    noise = copied(state, chosen, sd)
    assert np.unique(noise[sd > 0]).size == noise[sd > 0].size
    np.testing.assert_allclose(noise.std(axis=1), sd, rtol=0.06)
    assert np.all(np.abs(noise.mean(axis=1)) <= 0.08 * sd)
