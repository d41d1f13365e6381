"""Time differences whose errors are larger than stated: paths beside the line of sight, clocks."""

from math import exp

import numpy as np
import pandas as pd
import pytest
from made_town import CRS, SOUTH_M, WEST_M, Town, slowed, walk_log

from mapfilter.filters.contract import Status
from mapfilter.models.ranging import range_differences
from mapfilter.models.state import StateLayout
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.timing import TimingState
from mapfilter.positioning.bayes.timing_errors import FACTORS, DifferenceErrors, DifferenceTerm
from mapfilter.positioning.loop import locate
from mapfilter.serving.state_file import decode, encode
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


class Cloud:
    """A belief of a few places."""

    def __init__(self, places_m, weight):
        self.state = np.zeros((8, len(places_m)), dtype=np.float32)
        self.state[:2] = np.array(places_m).T
        self.weight = np.array(weight, dtype=np.float32)


LAYOUT = StateLayout(2, 0, 1, height_m=1.5)
STATIONS_M = [[0.0, 0.0, 30.0], [500.0, 0.0, 30.0], [0.0, 500.0, 30.0]]


NAMES, NONE = ("A", "B", "C"), DifferenceErrors()
SAYS_NOTHING, COST = 1e4, 0.6
"""Deviation of a station at fault, and the cost of a reading of one."""


def term(off_m, weight=1.0, errors=NONE):
    sigma_m = np.array([10.0, 6.0, 14.0])
    model = range_differences(LAYOUT, STATIONS_M, sigma_m)
    here = model.mean(np.array([[100.0, 200.0]]))[0]
    return DifferenceTerm(model, here + np.array(off_m), NAMES, sigma_m, weight, 3.0, errors)


def cases(errors=NONE):
    """Probability of each factor with no fault and with one, in the order of loops."""
    faults = [dict(errors.faults).get(name, 0.2) for name in NAMES]
    for at_fault in (None, 0, 1, 2):
        odds = np.prod([q if k == at_fault else 1 - q for k, q in enumerate(faults)])
        for factor, share in zip(FACTORS, errors.shares, strict=True):
            yield at_fault, factor, odds * share


def by_hand(off_m, at_fault, factor):
    """Density of two differences that share a reference, beside that of stated errors."""
    sigma_m = factor * np.array([10.0, 6.0, 14.0])
    if at_fault is not None:
        sigma_m[at_fault] = SAYS_NOTHING
    noise = np.diag(sigma_m[1:] ** 2) + sigma_m[0] ** 2
    square = np.array(off_m) @ np.linalg.inv(noise) @ np.array(off_m)
    cost = 0.0 if at_fault is None else COST
    return exp(-0.5 * min(square, 18.0) - cost) / factor**2


@pytest.mark.parametrize("off_m", [(3.0, -4.0), (60.0, 10.0), (900.0, -900.0)])
def test_what_a_difference_says_is_a_mixture_over_its_errors(off_m):
    here = Cloud([(100.0, 200.0)], [1.0]).state
    for errors in (NONE, DifferenceErrors((0.05, 0.05, 0.6, 0.1, 0.1, 0.1), (("C", 0.7),))):
        mixed = sum(p * by_hand(off_m, k, f) for k, f, p in cases(errors))
        null = sum(p * by_hand((0.0, 0.0), k, f) for k, f, p in cases(errors))
        for weight in (1.0, 0.3):
            one = term(off_m, weight, errors)
            found = one.log_likelihood(here)
            np.testing.assert_allclose(found, weight * np.log(mixed), rtol=2e-3)
            expected = weight * (np.log(null) - 0.75 * 2)
            assert one.under_null == pytest.approx(expected, rel=2e-3)


def test_readings_tell_the_errors_by_all_places_of_a_belief():
    """By Bayes' rule, with the mean of the likelihood over the belief."""
    belief = Cloud([(100.0, 200.0), (400.0, 450.0)], [0.75, 0.25])
    off_m, known = (40.0, -30.0), DifferenceErrors(faults=(("Z", 0.4), ("B", 0.3)))
    first = term(off_m, 0.5, known)
    there = first.reading_m - first.model.mean(np.array([[400.0, 450.0]]))[0]
    shares, faults, total = dict.fromkeys(FACTORS, 0.0), dict.fromkeys(range(3), 0.0), 0.0
    for k, f, p in cases(known):
        odds = p * (0.75 * by_hand(off_m, k, f) + 0.25 * by_hand(there, k, f)) ** 0.5
        total += odds
        shares[f] += odds
        if k is not None:
            faults[k] += odds
    found = known.after([first], belief)
    expected = [
        0.99 * shares[f] / total + 0.01 * p for f, p in zip(FACTORS, NONE.shares, strict=True)
    ]
    np.testing.assert_allclose(found.shares, expected, rtol=3e-3, atol=1e-4)
    assert sum(found.shares) == pytest.approx(1.0)
    for k, name in enumerate(NAMES):
        expected = 0.99 * faults[k] / total + 0.01 * 0.2
        assert found.fault_of(name) == pytest.approx(expected, rel=3e-3, abs=1e-4)
    # Of other stations nothing was learnt.
    assert (found.fault_of("Z"), found.fault_of("Y")) == (0.4, 0.2)


def test_readings_with_two_references_tell_as_much_as_one_after_the_other():
    belief, off_m = Cloud([(100.0, 200.0), (400.0, 450.0)], [0.75, 0.25]), (40.0, -30.0)
    at_once = NONE.after([term(off_m), term(off_m)], belief)
    first = NONE.after([term(off_m)], belief)
    assert at_once == first.after([term(off_m, errors=first)], belief)
    assert at_once != first


FIVE = [*STATIONS_M, [500.0, 500.0, 30.0], [-300.0, 200.0, 30.0]]


def learnt(factor, late_m, rng):
    """What thirty readings of five stations tell; that of C comes late."""
    names, sigma_m, known = tuple("ABCDE"), np.full(5, 10.0), NONE
    model = range_differences(LAYOUT, FIVE, sigma_m)
    here, belief = model.mean(np.array([[100.0, 200.0]]))[0], Cloud([(100.0, 200.0)], [1.0])
    for _ in range(30):
        own = rng.normal(0, 10.0 * factor, 5)
        own[2] += late_m
        reading_m = here + own[1:] - own[0]
        known = known.after(
            [DifferenceTerm(model, reading_m, names, sigma_m, 1.0, 3.0, known)], belief
        )
    return known


@pytest.mark.parametrize("factor", [1.0, 4.0, 16.0])
def test_after_some_readings_the_factor_is_known(factor):
    known = learnt(factor, 0.0, np.random.default_rng(3))
    shares = dict(zip(FACTORS, known.shares, strict=True))
    assert max(shares, key=shares.get) == factor
    assert shares[factor] > 0.6
    # It may become another one.
    assert min(known.shares) > 1e-5
    assert max(odds for _, odds in known.faults) < 0.25


@pytest.mark.parametrize("late_m", [-300.0, 120.0])
def test_after_some_readings_a_late_station_is_known(late_m):
    known = learnt(1.0, late_m, np.random.default_rng(4))
    assert known.fault_of("C") > 0.9
    assert max(known.fault_of(name) for name in "ABDE") < 0.1
    shares = dict(zip(FACTORS, known.shares, strict=True))
    assert max(shares, key=shares.get) == 1.0


def test_places_beyond_all_errors_change_nothing_for_good():
    far = Cloud([(1e7, 1e7)], [1.0])
    found = NONE.after([term((0.0, 0.0))], far)
    assert np.all(np.isfinite(found.shares))
    assert sum(found.shares) == pytest.approx(1.0)


def test_a_session_keeps_what_is_known_of_the_errors():
    known = TimingState(3.0, 4.0, DifferenceErrors((0.1, 0.2, 0.3, 0.2, 0.1, 0.1), (("C", 0.7),)))
    assert decode(encode({"timing": known}), "here")["timing"] == known
