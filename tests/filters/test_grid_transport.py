"""Kernels that move mass on a lattice."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.filters.grid_transport import shifted, taps


@given(st.floats(-7, 7), st.floats(0, 6))
def test_mean_and_variance_are_kept(shift_px, sd_px):
    first, share = taps(shift_px, sd_px)
    place = first + np.arange(share.size)
    assert share.min() >= -1e-6
    assert share.sum() == pytest.approx(1, abs=1e-4)
    assert share @ place == pytest.approx(shift_px, abs=2e-3)
    beside = abs(shift_px - round(shift_px))
    least = beside * (1 - beside)
    variance = share @ (place - shift_px) ** 2
    assert variance == pytest.approx(max(sd_px**2, least), rel=0.01, abs=1e-4)


def test_many_small_steps_go_as_far_as_one_large_one():
    mass = np.zeros((1, 101), dtype=np.float32)
    mass[0, 10] = 1.0
    for _ in range(100):
        mass = shifted(mass, *taps(0.7, 0.01), axis=1)
    assert mass.sum() == pytest.approx(1, abs=1e-4)
    assert mass[0] @ np.arange(101) == pytest.approx(80, abs=0.01)
