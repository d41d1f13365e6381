"""Copies of particles on a graphics processor, in numba's simulator; none ask for no device."""

from pathlib import Path

import numpy as np
from simulator import run_simulated

from mapfilter.filters import cuda_copies, resampling


def test_no_copies_ask_for_no_device():
    state, chosen = np.ones((3, 4), np.float32), np.empty(0, np.int32)
    given = state, chosen, np.ones(3, np.float32), np.uint64(1), np.empty((3, 0), np.float32)
    cuda_copies.copy_with_jitter(*given)
    resampling.copy_with_jitter(0, 0, *given)


def test_copies_in_the_simulator():
    run_simulated(Path(__file__).with_name("simulated_copies.py"))
