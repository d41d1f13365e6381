"""Resampled copies on a graphics processor, a thread for each copy."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import cuda

from mapfilter import _cuda
from mapfilter._kernels import hashed, normals

_ZERO = np.float32(0.0)


def copy_with_jitter(state: Any, chosen: Any, jitter: Any, key: np.uint64, copies: Any) -> None:
    """Fill noisy copies (R, M), as :func:`mapfilter.filters.resampling.copy_with_jitter` does."""
    _cuda.start(_copy_with_jitter, chosen.size, state, chosen, jitter, key, copies)


@cuda.jit
def _copy_with_jitter(state, chosen, jitter, key, copies):  # type: ignore[no-untyped-def]
    j = cuda.grid(1)
    if j >= chosen.size:
        return
    i, rows = chosen[j], state.shape[0]
    for r in range(0, rows, 2):
        a, b = _ZERO, _ZERO
        if r < jitter.size:
            index = (np.uint64(r) << np.uint64(40)) + np.uint64(j)
            # In the simulator the hash is a whole number of Python.
            a, b = normals(np.uint64(hashed(key, index)))
        copies[r, j] = state[r, i] + (jitter[r] * a if r < jitter.size else _ZERO)
        if r + 1 < rows:
            sd = jitter[r + 1] if r + 1 < jitter.size else _ZERO
            copies[r + 1, j] = state[r + 1, i] + sd * b
