"""Arrays as the page reads them."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapfilter.viewing.arrays import PLACE_M, packed, places, starts, unpacked
from mapfilter.viewing.recorded import belief_of
from mapfilter.viewing.trace import Frame

LEVELS = st.floats(-150.0, -25.0) | st.just(float("nan"))


@given(arrays(np.float64, st.integers(0, 20), elements=LEVELS))
def test_values_come_back_to_half_a_step(values):
    found = unpacked(
        json.loads(json.dumps(packed(values, "u1", scale=0.5, offset=-150.0, none=255)))
    )
    assert np.array_equal(np.isnan(found), np.isnan(values))
    assert np.all(np.abs(found - values)[~np.isnan(values)] <= 0.25 + 1e-9)


@given(arrays(np.float64, st.integers(0, 20), elements=st.floats(allow_nan=True)))
def test_what_is_out_of_range_lies_at_its_ends_and_is_never_taken_for_none(values):
    found = unpacked(packed(values, "u1", none=255))
    finite = np.isfinite(values)
    assert np.all(np.isnan(found[~finite]))
    assert np.array_equal(found[finite], np.clip(np.rint(values[finite]), 0, 254))


@given(arrays(np.float64, st.integers(0, 20), elements=st.floats(-1e6, 1e6)))
def test_places_are_right_to_half_a_decimetre(values):
    assert np.all(np.abs(unpacked(places(values)) - values) <= PLACE_M / 2 + 1e-6)


def test_shapes_and_starts():
    grid = np.arange(6).reshape(2, 3)
    assert np.array_equal(unpacked(packed(grid, "i2")), grid)
    assert unpacked(starts([2, 0, 3])).tolist() == [0, 2, 2, 5]
    assert unpacked(starts([])).tolist() == [0]


@pytest.mark.parametrize(
    ("damage", "told"), [({"t": "O"}, "type"), ({"b": "!"}, "base64"), ({"s": [5]}, "reshape")]
)
def test_damaged_arrays_are_refused(damage, told):
    with pytest.raises(ValueError, match=told):
        unpacked({**packed([1, 2], "u1"), **damage})


WHOLE = ("u1", "i1", "u2", "i2", "u4", "i4")


@given(st.sampled_from(WHOLE), st.lists(st.integers(-(2**63), 2**63 - 1), min_size=1, max_size=4))
def test_whole_numbers_come_back_or_are_refused(code, values):
    given_, ends = np.array(values, np.int64), np.iinfo(code)
    if min(values) >= ends.min and max(values) <= ends.max:
        assert unpacked(packed(given_, code)).tolist() == values
    else:
        with pytest.raises(ValueError, match="does not fit"):
            packed(given_, code)


@pytest.mark.parametrize("code", WHOLE)
def test_the_ends_of_a_type_fit_and_what_follows_does_not(code):
    low, high = int(np.iinfo(code).min), int(np.iinfo(code).max)
    assert unpacked(packed(np.array([low, high]), code)).tolist() == [low, high]
    for beyond in (low - 1, high + 1):
        with pytest.raises(ValueError, match="does not fit"):
            packed(np.array([0, beyond]), code)


def test_squares_of_a_belief_far_from_the_corner_stay_where_they_are():
    col, row = (np.array(at, np.int32) for at in ([40_000, 7], [9, -50_000]))
    frame = Frame(0, 1.0, col, row, np.array([255, 9], np.uint8), 0.5)
    trace = SimpleNamespace(frames=SimpleNamespace(kept={0: frame}))
    found = belief_of(trace, 1, SimpleNamespace(west_m=0.0, south_m=0.0))
    assert unpacked(found["col"]).tolist() == [40_000, 7]
    assert unpacked(found["row"]).tolist() == [9, -50_000]
