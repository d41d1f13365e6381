"""Copies of particles on a graphics processor: none ask for no device."""

import numpy as np

from mapfilter.filters import cuda_copies, resampling


def test_no_copies_ask_for_no_device():
    state, chosen = np.ones((3, 4), np.float32), np.empty(0, np.int32)
    given = state, chosen, np.ones(3, np.float32), np.uint64(1), np.empty((3, 0), np.float32)
    cuda_copies.copy_with_jitter(*given)
    resampling.copy_with_jitter(0, 0, *given)
