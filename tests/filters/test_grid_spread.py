"""Ways to all sides on a grid: along the ways that there are, without a loss of mass."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapfilter.filters.contract import MotionStep
from mapfilter.filters.grid_transport import Spread, Waiting, spread_along, taps

ROWS, COLS, BINS = 4, 5, 2
MASS = st.floats(0.0, 1.0, width=32)
SHAPE = (BINS, ROWS, COLS)


def kernel(sd_px):
    """Share that goes from each pixel to each other one, by loops."""
    first, shares = taps(0.0, sd_px)
    moved = np.zeros((ROWS, COLS, ROWS, COLS))
    for row in range(ROWS):
        for col in range(COLS):
            for to_row in range(ROWS):
                for to_col in range(COLS):
                    down, right = to_row - row - first, to_col - col - first
                    if 0 <= down < shares.size and 0 <= right < shares.size:
                        moved[row, col, to_row, to_col] = shares[down] * shares[right]
    return moved


def by_hand(on, off, way):
    stayed = on * (1 - way.leave) + off * way.come_back
    away = on * way.leave + off * (1 - way.come_back)
    after_on, after_off = np.zeros(SHAPE), np.zeros(SHAPE)
    to = kernel(way.sd_px)
    for row in range(ROWS):
        for col in range(COLS):
            along, anywhere = to[row, col] * way.ways, to[row, col]
            after_on += stayed[:, row, col, None, None] * along / along.sum()
            after_off += away[:, row, col, None, None] * anywhere / anywhere.sum()
    return after_on * way.cost, after_off * way.cost


@given(
    arrays(np.float32, SHAPE, elements=MASS),
    arrays(np.float32, SHAPE, elements=MASS),
    arrays(np.float32, (ROWS, COLS), elements=st.floats(2**-10, 1.0, width=32)),
    st.sampled_from([0.3, 1.0, 2.5]),
)
def test_each_pixel_sends_its_mass_where_ways_are(on, off, ways, sd_px):
    way = Spread(sd_px, ways, 0.8, 0.1, 0.3)
    found = spread_along(on, off, way)
    for one, expected in zip(found, by_hand(on, off, way), strict=True):
        np.testing.assert_allclose(one, expected, rtol=1e-4, atol=1e-6)
    total = float(on.sum(dtype=np.float64) + off.sum(dtype=np.float64))
    after = sum(float(one.sum(dtype=np.float64)) for one in found)
    assert after == pytest.approx(0.8 * total, rel=1e-4, abs=1e-6)


def test_steps_are_summed_until_mass_is_moved():
    east, north = np.pi * 0, np.pi / 2
    steps = (
        MotionStep(3.0, east),
        MotionStep(4.0, north, sampling_sd_m=0.5),
        MotionStep(-2.0, np.nan, turned_sd_rad=0.3),
        MotionStep(6.0, np.nan, spread_m=1.0),
    )
    waiting = Waiting()
    for step in steps:
        waiting = waiting.after(step)
    assert waiting == pytest.approx((3.0, 4.0, 7.0, 0.25, 0.09, 8.0, 2.5))
