"""Differences of two filters over the same runs."""

from itertools import product
from math import isnan, nan, sqrt

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.evaluation.paired import paired_cells, paired_interval, paired_interval_of_routes
from mapfilter.evaluation.success_cells import COORDINATES

KINDS = st.tuples(st.integers(0, 40), st.integers(0, 40), st.integers(0, 40))


@given(KINDS)
def test_an_exchange_of_the_two_mirrors_the_interval(kinds):
    gained, lost, alike = kinds
    runs = gained + lost + alike
    low, high = paired_interval(gained, lost, runs)
    mirrored_low, mirrored_high = paired_interval(lost, gained, runs)
    assert (low, high) == pytest.approx((-mirrored_high, -mirrored_low))
    assert -1 <= low <= high <= 1
    if runs:
        # One run more of each kind draws the middle towards 0, never past it.
        assert abs((low + high) / 2) <= abs(gained - lost) / runs + 1e-12 or high == 1 or low == -1


def test_it_is_the_textbook_interval_of_many_runs():
    gained, lost, runs = 3000, 2000, 20_000
    difference = (gained - lost) / runs
    spread = 1.96 * sqrt(((gained + lost) / runs - difference**2) / runs)
    found = paired_interval(gained, lost, runs)
    assert found == pytest.approx((difference - spread, difference + spread), abs=2e-4)


def test_ends():
    assert paired_interval(0, 0, 0) == (-1.0, 1.0)
    low, high = paired_interval(0, 0, 10)
    assert (low, high) == pytest.approx((-high, high))
    assert high > 0.1
    assert all(isnan(end) for end in paired_interval_of_routes([1], [0], [10]))
    # Where no run differs each route counts once, not each run.
    assert paired_interval_of_routes([0] * 5, [0] * 5, [50] * 5) == paired_interval(0, 0, 5)
    # Where each route has one run, that is all there is.
    by_routes = paired_interval_of_routes([1, 0, 0, 1], [0, 1, 0, 0], [1] * 4)
    assert by_routes == paired_interval(2, 1, 4)


@pytest.mark.parametrize(("routes", "draws"), [(40, 5), (12, 10), (100, 1)])
def test_both_intervals_hold_as_often_as_they_say(routes, draws):
    """Routes differ, and so does what one filter gains on them: 95 % in 92.5 to 99 % of cases."""
    rng = np.random.default_rng(7)

    def chances(count):
        other = rng.beta(2, 1, count)
        return np.clip(other + rng.normal(0.08, 0.12, count), 0, 1), other

    own, other = chances(2_000_000)
    true_of_all = np.mean(own - other)
    these, every, cases = 0, 0, 1500
    for _ in range(cases):
        own, other = chances(routes)
        luck = rng.random((routes, draws))
        # Both filters see the same walk: mostly the same luck.
        shared = np.where(rng.random(luck.shape) < 0.7, luck, rng.random(luck.shape))
        here, there = luck < own[:, None], shared < other[:, None]
        gained, lost = (here & ~there).sum(axis=1), (there & ~here).sum(axis=1)
        low, high = paired_interval(gained.sum(), lost.sum(), luck.size)
        these += low <= np.mean(own - other) <= high
        low, high = paired_interval_of_routes(gained, lost, [draws] * routes)
        every += low <= true_of_all <= high
    assert 0.925 < these / cases < 0.99
    assert 0.925 < every / cases < 0.99


def table(figures):
    """Rows as of a sweep's table: reading, noise, route, draw, then what the run gave."""
    place = dict.fromkeys(COORDINATES, 0.0) | {"database": "d", "radio": "r"}
    return pd.DataFrame(
        [
            place
            | {"filter": name, "reading": name, "sigma_orient_deg": noise, "update_length_m": nan}
            | {"route": route, "draw": draw, "switched": switched, "success": success}
            | {"error_mean_m": error_m, "switch_distance_m": way_m}
            for name, noise, route, draw, switched, success, error_m, way_m in figures
        ]
    )


def test_cells_are_what_counting_by_hand_gives():
    rng = np.random.default_rng(3)
    runs = {}
    for name, noise, route, draw in product("abc", (3.0, 9.0), range(6), range(4)):
        switched = rng.random() < 0.8
        success = bool(switched and rng.random() < 0.8)
        error_m, way_m = rng.uniform(1, 20), rng.uniform(100, 900)
        runs[name, noise, route, draw] = switched, success, error_m, way_m if switched else nan
    shuffled = list(runs.items())
    rng.shuffle(shuffled)
    found = paired_cells(table([(*at, *figures) for at, figures in shuffled]), "b")
    assert {(one.reading, one.place["sigma_orient_deg"]) for one in found} == set(
        product("ac", (3.0, 9.0))
    )
    for one in found:
        noise = one.place["sigma_orient_deg"]
        pairs = [
            (runs[one.reading, noise, *at], runs["b", noise, *at])
            for at in product(range(6), range(4))
        ]
        assert (one.runs, one.routes, one.baseline) == (24, 6, "b")
        assert one.only_reading == sum(own[1] and not other[1] for own, other in pairs)
        assert one.only_baseline == sum(other[1] and not own[1] for own, other in pairs)
        assert one.success == pytest.approx((one.only_reading - one.only_baseline) / 24)
        assert one.success_low <= one.success <= one.success_high
        assert one.success_routes_low <= one.success <= one.success_routes_high
        wrong = [(own[0] and not own[1]) - (other[0] and not other[1]) for own, other in pairs]
        assert one.wrong == pytest.approx(np.mean(wrong))
        assert one.wrong_low <= one.wrong <= one.wrong_high
        both = [(own, other) for own, other in pairs if own[1] and other[1]]
        assert one.both == len(both)
        assert one.error_m == pytest.approx(np.mean([own[2] - other[2] for own, other in both]))
        assert one.error_low_m < one.error_m < one.error_high_m
        less_m = np.mean([own[3] - other[3] for own, other in both])
        assert one.distance_m == pytest.approx(less_m)
        assert one.distance_low_m < one.distance_m < one.distance_high_m


def test_a_gain_that_each_filter_alone_hides_is_seen_in_pairs():
    """Shares of 0.50 and 0.58 of 100 runs overlap; of the same runs 8 were gained, none lost."""
    figures = [
        (name, 0.0, route, 0, right, right, 1.0, 100.0)
        for name, least in (("old", 50), ("new", 42))
        for route in range(100)
        for right in [route >= least]
    ]
    (one,) = paired_cells(table(figures), "old")
    assert (one.success, one.only_reading, one.only_baseline) == (0.08, 8, 0)
    assert one.success_routes_low > 0
    assert (one.error_m, one.error_low_m, one.error_high_m) == (0.0, 0.0, 0.0)


def test_filters_without_a_run_in_common_and_none_right_with_both():
    one = table([("a", 0.0, 0, 0, True, True, 1.0, 100.0), ("b", 0.0, 1, 0, True, True, 1.0, 9.0)])
    (cell,) = paired_cells(one, "b")
    assert (cell.runs, cell.both, cell.success_low, cell.success_high) == (0, 0, -1.0, 1.0)
    assert isnan(cell.success)
    assert isnan(cell.error_m)
    assert paired_cells(one[:1], "a") == ()
