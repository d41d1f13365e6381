"""What time differences say of a place and of their own errors, with numbers by hand."""

from dataclasses import replace
from math import exp

import numpy as np
import pytest

from mapfilter.models.ranging import range_differences
from mapfilter.models.state import StateLayout
from mapfilter.positioning.bayes.sources.timing import TimingState
from mapfilter.positioning.bayes.sources.timing_errors import (
    FACTORS,
    DifferenceErrors,
    DifferenceTerm,
)
from mapfilter.serving.state_file import decode, encode


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


@pytest.mark.parametrize("off_m", [(3.0, -4.0), (60.0, 10.0), (900.0, -900.0), (9e3, 9e3)])
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


def test_each_hypothesis_has_its_own_mixture_however_far_cases_are_apart():
    """A density of stated errors is nothing beside that of 32 times as large ones."""
    one = replace(term((450.0, -450.0)), clip_sd=30.0)
    state = Cloud([(100.0, 200.0), (400.0, 450.0)], [0.5, 0.5]).state
    found = one.log_likelihood(state)
    alone = [one.log_likelihood(state[:, [k]])[0] for k in range(2)]
    assert found.tolist() == pytest.approx(alone)
    assert -12.0 < found[0] < -6.0


def test_cases_below_one_in_ten_thousand_are_left_out():
    for share, kept in ((3e-4, True), (1.9e-4, False)):
        known = DifferenceErrors((0.3, 0.25, 0.2, 0.12, 0.13 - share, share))
        cases_of = {(case.at_fault, case.factor) for case in term((0.0, 0.0), errors=known).cases}
        # Of 0.8³ without a fault.
        assert ((None, 32.0) in cases_of) is kept


def test_no_fault_is_certain():
    found = term((0.0, 0.0), errors=DifferenceErrors(faults=(("A", 1.0),))).cases
    (sure,) = [case for case in found if (case.at_fault, case.factor) == (0, 1.0)]
    assert sure.probability == pytest.approx(0.999 * 0.8**2 * 0.3)


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


@pytest.mark.parametrize("factor", [1.0, 4.0, 16.0, 32.0])
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


def test_many_differences_that_fit_nothing_tell_no_less():
    """Densities of 120 of them are far below what a number can be."""
    angle = np.linspace(0.0, 6.0, 121)
    stations_m = np.column_stack([900 * np.cos(angle), 900 * np.sin(angle), np.full(121, 30.0)])
    names, sigma_m = tuple(f"S{k}" for k in range(121)), np.full(121, 10.0)
    model = range_differences(LAYOUT, stations_m.tolist(), sigma_m)
    off_m = np.where(np.arange(120) % 2, 1e6, -1e6)
    reading_m = model.mean(np.array([[100.0, 200.0]]))[0] + off_m
    one = DifferenceTerm(model, reading_m, names, sigma_m, 1.0, 3.0, NONE)
    found = NONE.after([one], Cloud([(100.0, 200.0)], [1.0]))
    # All of them count as 3 deviations off: stated errors are the most probable.
    assert found.shares[0] > 0.9
    assert sum(found.shares) == pytest.approx(1.0)


def test_stations_that_were_all_at_fault_leave_some_cases():
    """No case with but one of them at fault is as probable as one in ten thousand."""
    known = DifferenceErrors(faults=tuple((name, 0.999) for name in NAMES))
    one = term((3.0, -4.0), errors=known)
    # The likely factors, and each station alone.
    assert {(case.at_fault, case.factor) for case in one.cases} == {
        (station, factor) for station in range(3) for factor in (1.0, 2.0, 4.0, 8.0)
    }
    assert np.isfinite(one.log_likelihood(Cloud([(100.0, 200.0)], [1.0]).state)).all()
    assert np.isfinite(one.under_null)
