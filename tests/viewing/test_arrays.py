"""Arrays as the page reads them."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapfilter.viewing.arrays import PLACE_M, packed, places, starts, unpacked

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
