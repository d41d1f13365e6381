"""Ground truth and errors as arrays of a user: lists, other orders, and numbers that are none."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.evaluation.consistency import coverage
from mapfilter.evaluation.truth import Truth


def test_lists_and_whole_numbers_will_do():
    truth = Truth([0, 10], [0, 100], [5, 5])
    assert truth == Truth(np.array([0.0, 10.0]), np.array([0.0, 100.0]), np.array([5.0, 5.0]))
    assert truth.at([5])[0].tolist() == [50.0]
    assert truth.distance_at(5.0) == 50.0


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        (
            ([1.0, 0.0], [0, 1], [0, 1]),
            "time_s: expected seconds in ascending order, found a step back",
        ),
        (([0.0, np.nan], [0, 1], [0, 1]), "time_s: expected finite seconds, found nan"),
        (([0.0, 1.0], [0, 1, 2], [0, 1]), r"east_m: expected 2 positions, found shape \(3,\)"),
        (
            (np.eye(2), np.eye(2), np.eye(2)),
            r"time_s: expected one dimension, found shape \(2, 2\)",
        ),
        (([0.0, 1.0], ["a", "b"], [0, 1]), "east_m: expected numbers, found list"),
        ((None, [0, 1], [0, 1]), "time_s: expected numbers, found None"),
    ],
)
def test_what_is_no_way_through_time_is_refused(columns, expected):
    with pytest.raises(InputError, match=rf"ground truth, {expected}"):
        Truth(*columns)


@pytest.mark.parametrize("share", [95, -0.1, np.nan])
def test_a_share_lies_between_0_and_1(share):
    with pytest.raises(InputError, match=r"coverage, share: expected a number in 0\.\.1"):
        coverage([1.0, 2.0], [2.0, 2.0], share)


def test_errors_and_radii_are_as_many():
    with pytest.raises(InputError, match=r"coverage, radii_m: expected shape \(3,\), found \(2,\)"):
        coverage([1.0, 2.0, 3.0], [2.0, 2.0], 0.95)
    assert coverage([1.0, 3.0], 2.0, 0.95).inside == 1
