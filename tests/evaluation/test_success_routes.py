"""Success across routes, and over the cells of a grid."""

from math import isnan, nan

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.evaluation.success import (
    independent_runs,
    wilson_interval,
    wilson_interval_of_routes,
)
from mapfilter.evaluation.success_cells import COORDINATES, axes_of, success_cells


def test_one_run_a_route_is_almost_the_plain_interval():
    good = np.array([1] * 30 + [0] * 10)
    low, high = wilson_interval_of_routes(good, np.ones(40))
    # The scatter is divided by one route less than there are.
    assert (low, high) == pytest.approx(wilson_interval(30, 40), abs=0.01)


def test_routes_that_are_all_alike_are_as_good_as_their_runs():
    assert wilson_interval_of_routes([3] * 10, [4] * 10) == pytest.approx(wilson_interval(30, 40))


def test_routes_that_fail_or_succeed_as_a_whole_count_once():
    by_hand = wilson_interval_of_routes([10] * 15 + [0] * 5, [10] * 20)
    assert by_hand == pytest.approx(wilson_interval(15, 20), abs=0.02)


def test_ends_and_a_single_route():
    assert wilson_interval_of_routes([10] * 5, [10] * 5) == wilson_interval(5, 5)
    assert wilson_interval_of_routes([0] * 5, [10] * 5) == wilson_interval(0, 5)
    assert all(isnan(end) for end in wilson_interval_of_routes([7], [10]))


def test_routes_tell_as_much_as_one_run_at_least_and_all_runs_at_most():
    """Two routes of ten runs: the mean's variance is 2 * 2 d² / 20² where they are d off it."""
    for good, independent in (([10, 0], 1.0), ([9, 1], 0.25 / 0.16), ([6, 4], 20.0)):
        assert independent_runs(good, [10, 10], 0.25) == pytest.approx(independent)
    assert independent_runs([10, 0], [10, 10], 0.1) == 1.0


@given(st.lists(st.tuples(st.integers(0, 10), st.just(10)), min_size=2, max_size=60))
def test_never_narrower_than_of_independent_runs(routes):
    good, of = np.array(routes).T
    low, high = wilson_interval_of_routes(good, of)
    least, most = wilson_interval(int(good.sum()), int(of.sum()))
    assert low <= least + 1e-9
    assert high >= most - 1e-9


def test_it_holds_the_share_over_all_routes_as_often_as_it_says():
    """Routes differ widely; 95 % intervals hold their mean in 93 to 97 % of 2000 cases."""
    rng = np.random.default_rng(1)
    held = plain = 0
    for _ in range(2000):
        good = rng.binomial(10, rng.beta(1.2, 0.8, size=40))
        low, high = wilson_interval_of_routes(good, np.full(40, 10))
        held += low <= 0.6 <= high
        low, high = wilson_interval(int(good.sum()), 400)
        plain += low <= 0.6 <= high
    assert 0.93 <= held / 2000 <= 0.97
    assert plain / 2000 < 0.8


def runs_of(sigma_deg, *outcomes):
    place = dict.fromkeys(COORDINATES, 0.0) | {"filter": "candidate", "reading": "set"}
    place |= {"database": "a", "radio": "as_predicted", "sigma_orient_deg": sigma_deg}
    place |= {"prediction_error_db": nan}
    names = ("route", "switched", "success", "error_mean_m", "switch_distance_m")
    rows = [place | dict(zip(names, outcome, strict=True)) for outcome in outcomes]
    radii = {"epochs": 10, "claimed_epochs": 0, "held_95_epochs": nan, "radius_95_median_m": nan}
    return pd.DataFrame(rows).assign(error_67_m=5.0, error_95_m=9.0, **radii)


def test_cells_by_hand():
    table = pd.concat(
        [
            runs_of(3.0, (0, True, True, 10.0, 100.0), (0, True, False, 90.0, 300.0)),
            runs_of(0.0, (0, True, True, 4.0, 100.0)),
            runs_of(3.0, (1, True, True, 20.0, 200.0), (1, False, False, nan, nan)),
        ]
    )
    first, second = success_cells(table)
    assert (first.sigma_orient_deg, first.runs, first.routes) == (3.0, 4, 2)
    assert (first.success, first.switched, first.wrong) == (0.5, 0.75, 0.25)
    assert (first.low, first.high) == wilson_interval(2, 4)
    assert first.error_mean_m == 15.0
    assert first.switch_distance_m == 200.0
    assert (second.sigma_orient_deg, second.runs, second.success) == (0.0, 1, 1.0)
    assert isnan(second.routes_low)
    assert (first.claimed, second.claimed) == (0.0, 0.0)
    assert isnan(first.coverage_95)
    assert isnan(first.radius_95_median_m)


def cells_at(*places):
    """One cell for each place of a grid."""
    one = runs_of(3.0, (0, True, True, 10.0, 100.0))
    return success_cells(pd.concat([one.assign(**place) for place in places]))


def test_a_varied_option_stands_for_its_own_column_but_for_headings():
    cells = cells_at(
        {"bias_sd_deg": 1.0, "errors.bias_sd_deg": 1.0, "scale": 1.0},
        {"bias_sd_deg": 2.0, "errors.bias_sd_deg": 2.0, "scale": 1.0},
    )
    assert axes_of(cells) == ["errors.bias_sd_deg"]
    cells = cells_at(
        {"sigma_orient_deg": 3.0, "errors.sigma_orient_deg": 5.0},
        {"sigma_orient_deg": 6.0, "errors.sigma_orient_deg": 7.0},
    )
    assert axes_of(cells) == ["sigma_orient_deg", "errors.sigma_orient_deg"]
    assert axes_of(cells[:1]) == axes_of([]) == []


def test_what_all_cells_of_a_reading_have_in_common_is_left_out():
    cells = cells_at(
        {"reading": "a", "scale": 1.0, "bias_sd_deg": 1.0},
        {"reading": "a", "scale": 1.0, "bias_sd_deg": 2.0},
        {"reading": "b", "scale": 2.0, "bias_sd_deg": 1.0},
    )
    assert axes_of(cells) == ["reading", "bias_sd_deg", "scale"]
    assert axes_of(cells, by_reading=True) == ["reading", "bias_sd_deg"]


def test_coverage_by_hand():
    """Of three routes: eight runs claimed something with a radius, and one nothing."""
    held, claimed = [9, 10, 8, 0, 10, 10, 10, 3], [10, 10, 10, 10, 10, 10, 20, 4]
    routes, radius_m = [0, 0, 0, 1, 1, 1, 2, 2], [20.0, 30.0, 25.0, 40.0, 10.0, 12.0, 50.0, 60.0]
    outcomes = [(route, True, False, nan, 100.0) for route in [*routes, 2]]
    table = runs_of(3.0, *outcomes).assign(
        epochs=40,
        claimed_epochs=[*claimed, 0],
        held_95_epochs=[*held, nan],
        radius_95_median_m=[*radius_m, nan],
    )
    (cell,) = success_cells(table)
    assert cell.coverage_95 == sum(held) / sum(claimed) == 60 / 84
    assert cell.claimed == 84 / (9 * 40)
    assert cell.radius_95_median_m == 27.5, "between 25 and 30 m, the middle of eight runs"
    # Epochs of a run are alike: the interval is far wider than that of 84 epochs.
    low, high = wilson_interval(60, 84)
    assert cell.coverage_95_high - cell.coverage_95_low > 2 * (high - low)
    assert 0.3 < cell.coverage_95_low < 0.714 < cell.coverage_95_high < 0.95
    by_route = wilson_interval_of_routes([27, 20, 13], [30, 30, 24])
    assert (cell.coverage_95_routes_low, cell.coverage_95_routes_high) == by_route


def test_an_interval_over_runs_holds_the_coverage_as_often_as_it_says():
    """Runs hold widely varying shares; 95 % intervals hold their mean in 92 to 98 % of 600."""
    rng = np.random.default_rng(5)
    inside = 0
    for _ in range(600):
        held = rng.binomial(50, rng.beta(6.0, 1.0, size=30))
        outcomes = [(route, True, True, 5.0, 100.0) for route in range(30)]
        table = runs_of(3.0, *outcomes).assign(claimed_epochs=50, held_95_epochs=held)
        (cell,) = success_cells(table)
        inside += cell.coverage_95_low <= 6 / 7 <= cell.coverage_95_high
    assert 0.92 <= inside / 600 <= 0.98
