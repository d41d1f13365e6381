"""Where one walks on a street: one message for one mistake."""

import pytest
from command_line import assert_refused, mapfilter, settings

EXPECTED = "expected 'centre', 'pavement', or a number in 0..50, found"


@pytest.mark.parametrize("value", ["sidewalk", 99, -1, "true", "nan"])
def test_a_place_on_the_street_that_is_none(value, tmp_path):
    refused = mapfilter("simulate", *settings(journeys__beside=value), "--out", tmp_path / "out")
    assert_refused(refused, f"setting journeys.beside: {EXPECTED}")
    assert refused.err.count("\n") == 1
