"""The switch rule, case by case: statuses and distances worked out by hand."""

from math import inf, isnan, nan

import pytest

from mapfilter.filters.contract import Status
from mapfilter.filters.switch_rule import switched

SEARCHING, CONVERGED, TRACKING, LOST = (
    Status.SEARCHING,
    Status.CONVERGED,
    Status.TRACKING,
    Status.LOST,
)


def after(status, travelled_m, since_m, *, agrees=True, splits=False):
    return switched(status, travelled_m, since_m, agrees=agrees, splits=splits, hold_m=14.0)


@pytest.mark.parametrize(
    ("status", "travelled_m", "since_m", "expected"),
    [
        (SEARCHING, 100.0, nan, (SEARCHING, 100.0)),
        (SEARCHING, 113.9, 100.0, (SEARCHING, 100.0)),
        (SEARCHING, 114.0, 100.0, (CONVERGED, 100.0)),
        (CONVERGED, 120.0, 100.0, (TRACKING, 100.0)),
        (TRACKING, 130.0, 100.0, (TRACKING, 100.0)),
        (LOST, 130.0, 100.0, (LOST, 100.0)),
    ],
)
def test_the_rule_has_to_hold_for_a_distance(status, travelled_m, since_m, expected):
    assert after(status, travelled_m, since_m) == expected


def test_disagreement_forgets_the_distance_of_a_search_alone():
    status, since_m = after(SEARCHING, 120.0, 100.0, agrees=False)
    assert status is SEARCHING
    assert isnan(since_m)
    assert after(CONVERGED, 120.0, 100.0, agrees=False) == (TRACKING, 100.0)


@pytest.mark.parametrize("status", [SEARCHING, CONVERGED, TRACKING, LOST])
def test_a_belief_that_splits_is_searched_for_again(status):
    found, since_m = after(status, 120.0, 100.0, splits=True)
    assert found is SEARCHING
    assert isnan(since_m)


def test_a_split_does_not_interrupt_a_search_that_has_not_converged():
    assert after(SEARCHING, 110.0, 100.0, splits=True) == (SEARCHING, 100.0)


@pytest.mark.parametrize("travelled_m", [nan, -inf])
def test_an_unknown_distance_is_no_convergence(travelled_m):
    assert after(SEARCHING, travelled_m, nan)[0] is SEARCHING
    assert after(SEARCHING, travelled_m, 100.0)[0] is SEARCHING
