"""Time differences whose errors are larger than stated: paths beside the line of sight, clocks."""

from math import exp

import numpy as np
import pandas as pd
import pytest
from made_town import CRS, SOUTH_M, WEST_M, Town, slowed, walk_log

from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.loop import locate
from mapfilter.tracks.log import make_log

TOWN = Town.of(11)
FOUND = (Status.CONVERGED, Status.TRACKING)
SITES = ("A", "C", "D", "E")
"""Cells of four sites."""


def with_differences(log, seed, stated_m, true_m, *, late_m=0.0):
    """Add three differences each 8 s; their errors last for 20 m; C's clock may be late."""
    rng = np.random.default_rng(seed)
    truth = log.truth.iloc[::2]
    place_m = np.stack([truth["east_m"] - WEST_M, truth["north_m"] - SOUTH_M], axis=-1)
    away_m = np.sqrt(
        [np.sum((place_m - TOWN.cells_m["ABCDEF".index(cell)]) ** 2, axis=1) + 28.5**2
         for cell in SITES]
    )  # fmt: skip
    errors_m = np.empty_like(away_m)
    errors_m[:, 0] = rng.normal(0, true_m, len(SITES))
    kept = exp(-10 / 20)
    for k in range(1, away_m.shape[1]):
        new_m = rng.normal(0, true_m * (1 - kept**2) ** 0.5, len(SITES))
        errors_m[:, k] = kept * errors_m[:, k - 1] + new_m
    measured_m = away_m + errors_m
    measured_m[1] += late_m
    tables = [
        pd.DataFrame({"time_s": truth["time_s"], "cell": cell, "reference": "A",
                      "difference_m": measured_m[k] - measured_m[0],
                      "sigma_m": stated_m, "reference_sigma_m": stated_m})
        for k, cell in enumerate(SITES) if k
    ]  # fmt: skip
    tdoa = pd.concat(tables).sort_values("time_s", kind="stable", ignore_index=True)
    parts = {name: getattr(log, name) for name in ("motion", "radio", "truth")}
    return make_log(CRS, tdoa=tdoa, start_utc_s=1.7e9, **parts)


@pytest.fixture(scope="module")
def bayes():
    return BayesFilter().over_area(TOWN.area())


def score(bayes, log):
    found = locate(log, bayes, np.random.default_rng(0)).estimate
    truth = log.truth
    off_m = np.hypot(
        np.interp(found.time_s, truth["time_s"], truth["east_m"]) - found.east_m,
        np.interp(found.time_s, truth["time_s"], truth["north_m"]) - found.north_m,
    )
    claimed = np.isin(found.status, FOUND)
    outside = np.isin(found.status, (Status.LOST, Status.OUTSIDE))
    return claimed.mean(), outside.mean(), (claimed & (off_m > 50)).sum()


@pytest.fixture(scope="module")
def walks():
    return [slowed(walk_log(TOWN, seed)) for seed in range(4)]


@pytest.fixture(scope="module")
def alone(bayes, walks):
    """Share of the time claimed and lost, and claims more than 50 m off, by levels alone."""
    return np.mean([score(bayes, log) for log in walks], axis=0)


def test_errors_three_times_as_large_as_stated_take_no_claims(bayes, walks, alone):
    with_them = np.mean(
        [score(bayes, with_differences(log, seed, 15.0, 45.0)) for seed, log in enumerate(walks)],
        axis=0,
    )
    # Without the cases no walk was claimed, and nearly all of the time OUTSIDE.
    assert with_them[0] > alone[0] + 0.1
    assert with_them[1] < 0.3
    # Of some 150 claimed epochs of a walk.
    assert with_them[2] < 5


def test_right_errors_bring_claims_sooner(bayes, walks, alone):
    with_them = np.mean(
        [score(bayes, with_differences(log, seed, 15.0, 15.0)) for seed, log in enumerate(walks)],
        axis=0,
    )
    assert with_them[0] > alone[0] + 0.1
    assert (with_them[1], with_them[2]) == (0, 0)


@pytest.mark.parametrize("late_m", [100.0, 300.0])
def test_a_clock_that_is_off_takes_no_claims(bayes, walks, alone, late_m):
    """By a third of a microsecond, and by one; the other stations locate as well as before."""
    late = [
        with_differences(log, seed, 15.0, 15.0, late_m=late_m) for seed, log in enumerate(walks)
    ]
    with_them = np.mean([score(bayes, log) for log in late], axis=0)
    assert with_them[0] > alone[0] + 0.1
    assert with_them[1] < alone[1] + 0.05
