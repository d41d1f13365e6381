"""Beliefs without the last fixes in a Kalman-type filter, with numbers by hand."""

from dataclasses import replace
from math import exp, isnan, nan, pi

import numpy as np
import pytest

from mapfilter.filters.gaussian import Gaussian
from mapfilter.positioning.kalman.coast import Coast
from mapfilter.positioning.kalman.coasting import Coasting, Separation
from mapfilter.positioning.kalman.understated import Understated

STATED_M2 = np.diag([9.0, 4.0])


def coast(begun_s=0.0, variance_m2=(100.0, 25.0), cross_m2=0.0, place_m=(0.0, 0.0), times=1.0):
    covariance = np.diag([*variance_m2, 1e-2, 1e-3, 1e-6])
    covariance[0, 1] = covariance[1, 0] = cross_m2
    mean = np.array([*place_m, 0.0, 0.0, 0.0])
    one = Coast.of(begun_s, Gaussian(mean, covariance), times, np.zeros(2))
    return one._replace(place_m2=np.zeros((2, 2)))


HELD = Coasting(kept=(coast(10.0),), apart=Separation(0.5, coast(10.0)), is_held=True)
PREDICTED = Gaussian(np.array([7.0, 8.0, 0.1, 0.2, 0.3]), np.diag([16.0, 9.0, 1e-2, 1e-3, 1e-6]))


def compared(state, time_s, place_m, since_s=1.0):
    return state.compared(time_s, np.array(place_m), STATED_M2, PREDICTED, since_s)


def probability(off_m, right_m2, prior, age_s=60.0, aside_m2=None):
    """Of wrong fixes against right ones and wrong steps, by normal densities.

    They may have been led by 1 m/s along each axis, and 0.01 m/s per root second.
    """
    aside_m2 = aside_m2 or age_s**2 * (1 + 1e-4 * age_s)
    wrong_m2 = right_m2 + aside_m2 * np.eye(2)
    density = [
        exp(-0.5 * off_m @ np.linalg.inv(m2) @ off_m) / (2 * pi * np.linalg.det(m2) ** 0.5)
        for m2 in (wrong_m2, right_m2)
    ]
    odds = prior * density[0] / density[1]
    return float(odds / (1 + odds * (1 + 3e-3 / prior)))


def test_both_axes_and_their_covariance_count():
    one = coast(variance_m2=(100.0, 25.0), cross_m2=-30.0, times=2.0)
    off_m = np.array([30.0, 12.0])
    expected = probability(off_m, np.array([[118.0, -30.0], [-30.0, 33.0]]), 3e-3)
    assert 0.01 < expected < 0.45
    assert compared(Coasting(kept=(one,)), 60.0, off_m).apart.probability == pytest.approx(expected)
    # It is the place of the belief that they are off.
    moved = one._replace(mean=np.array([5.0, -6.0, 0, 0, 0, 0, 0]))
    found = compared(Coasting(kept=(moved,)), 60.0, off_m + np.array([5.0, -6.0])).apart
    assert found.probability == pytest.approx(expected)
    assert (found.coast.begun_s, found.coast.heard_s) == (moved.begun_s, 60.0)


@pytest.mark.parametrize(
    ("age_s", "is_compared"), [(54.9, False), (55.0, True), (150.0, True), (150.1, False)]
)
def test_at_which_age_a_belief_without_fixes_is_compared(age_s, is_compared):
    found = compared(Coasting(kept=(coast(100.0),)), 100.0 + age_s, [400.0, 0.0])
    assert (found.apart.probability > 0.4) is is_compared
    assert (len(found.kept) == 1) is (age_s <= 150.0)


def test_of_several_beliefs_the_one_that_contradicts_most_counts():
    near, far = coast(0.0, place_m=(190.0, 0.0)), coast(1.0, place_m=(160.0, 0.0))
    for kept in ((near, far), (far, near)):
        assert compared(Coasting(kept=kept), 60.0, [200.0, 0.0]).apart.coast.begun_s == far.begun_s
    # One that is held is the only one.
    held = replace(HELD, kept=(far,), apart=Separation(0.5, near))
    assert compared(held, 60.0, [200.0, 0.0]).apart.coast.begun_s == near.begun_s


def test_what_is_hardly_probable_is_none():
    one = coast()
    for off_m in np.arange(20.0, 45.0, 0.5):
        expected = probability(np.array([off_m, 0.0]), np.diag([109.0, 29.0]), 3e-3)
        found = compared(Coasting(kept=(one,)), 60.0, [off_m, 0.0])
        assert found.apart.probability == pytest.approx(expected if expected >= 0.01 else 0.0)
        assert found.is_held is (expected >= 0.2)
        # Once it is held, it is compared until it agrees.
        held = compared(replace(found, is_held=True, apart=Separation(0.5, one)), 60.0, [0.0, 0.0])
        assert held.apart.probability == pytest.approx(
            probability(np.zeros(2), np.diag([109.0, 29.0]), 3e-3)
        )


@pytest.mark.parametrize(
    ("usual_s", "since_s", "is_gap"),
    [(1.0, 20.0, False), (1.0, 20.1, True), (10.0, 30.0, False), (10.0, 30.1, True)],
)
def test_what_a_gap_is(usual_s, since_s, is_gap):
    before = Coasting(usual_s=usual_s, times=4.0)
    found = compared(before, 200.0, [7.0, 9.0], since_s)
    assert found.usual_s == since_s
    if not is_gap:
        assert (found.kept, isnan(found.returned_s)) == ((), True)
        return
    (one,) = found.kept
    assert (one.begun_s, found.returned_s, one.times) == (200.0, 200.0, 4.0)
    assert one.from_m.tolist() == [7.0, 8.0]
    assert one.fix_m.tolist() == [7.0, 9.0]
    assert one.place_m2.tolist() == [[16.0, 0.0], [0.0, 9.0]]
    assert one.heading_rad2 == 1e-2


def test_the_time_between_fixes_is_kept_where_two_come_at_once():
    assert compared(Coasting(usual_s=3.0), 200.0, [0.0, 0.0], 0.0).usual_s == 3.0
    assert compared(Coasting(usual_s=3.0), 200.0, [0.0, 0.0], nan).usual_s == 3.0


@pytest.mark.parametrize(
    ("begun_s", "prior"), [(10.0, 3e-3 + 0.2 / np.e), (20.0, 3e-3 + 0.2 / np.e), (21.0, 3e-3)]
)
def test_fixes_that_came_back_are_doubted_by_beliefs_of_before(begun_s, prior):
    """Those that began later have used such fixes themselves."""
    off_m = np.array([25.0, 0.0])
    expected = probability(off_m, np.diag([109.0, 29.0]), prior, 110.0 - begun_s)
    before = Coasting(kept=(coast(begun_s),), returned_s=20.0, usual_s=1.0)
    # The age of one that began as they came back does not matter.
    found = compared(before, 110.0, off_m)
    assert found.apart.probability == pytest.approx(expected if expected >= 0.01 else 0.0)
    held = replace(before, apart=Separation(0.5, coast(begun_s)), is_held=True)
    # One that is not used may lie 60 m aside of the place; it changes no probability.
    again = held.again(110.0, off_m, STATED_M2)
    aside = probability(off_m, np.diag([109.0, 29.0]), prior, aside_m2=3600.0)
    assert again.is_met == (aside < 0.05)
    assert again.apart == held.apart
    assert held.again(110.0, np.zeros(2), STATED_M2).is_met
    assert not held.again(110.0, 9 * off_m, STATED_M2).is_met
    assert again.kept is held.kept


def test_only_one_that_is_held_is_compared_with_fixes_that_are_not_used():
    for state in (replace(HELD, is_held=False), replace(HELD, apart=Separation())):
        assert state.again(60.0, np.zeros(2), STATED_M2) is state


def test_each_half_minute_one_more_is_kept():
    seen_m = np.array([6.0, 5.0])
    found = Coasting().after_fix(100.0, seen_m, STATED_M2, PREDICTED)
    assert [one.begun_s for one in found.kept] == [100.0]
    assert found.kept[0].fix_m.tolist() == [6.0, 5.0]
    found = found.after_fix(129.9, seen_m, STATED_M2, PREDICTED)
    assert [one.begun_s for one in found.kept] == [100.0]
    found = found.after_fix(130.0, seen_m, STATED_M2, PREDICTED)
    assert [one.begun_s for one in found.kept] == [100.0, 130.0]
    found = found.after_fix(159.0, seen_m, STATED_M2, PREDICTED)
    assert [one.begun_s for one in found.kept] == [100.0, 130.0]


@pytest.mark.parametrize("is_held", [False, True])
def test_what_is_learnt_of_errors_is_not_used_while_fixes_may_lead_away(is_held):
    learnt = Understated(means=(5.0, 6.0), compared_s=90.0)
    before = Coasting(times=2.0, learnt=learnt, is_held=is_held)
    found = before.after_fix(100.0, np.zeros(2), STATED_M2, PREDICTED)
    assert found.times == (2.0 if is_held else 5.0)
    assert found.kept[0].times == found.times
    assert found.learnt is learnt


def test_the_way_of_fixes_is_looked_at_once_it_is_mostly_that_of_now():
    assert isnan(HELD.along(189.9, True, 1.4).agrees_s)
    found = HELD.along(190.0, True, 1.4)
    assert found.agrees_s == 190.0
    assert found.along(200.0, True, 1.4).agrees_s == 190.0
    assert isnan(found.along(200.0, False, 1.4).agrees_s)
    assert found.along(219.0, True, 2.5).is_held
    assert not found.along(220.0, True, 2.5).is_held
    assert found.along(220.0, True, 2.6).is_held
    for state in (replace(HELD, is_held=False), replace(HELD, apart=Separation())):
        assert state.along(190.0, True, 1.4) is state


def test_what_is_left_where_it_ends():
    state = replace(HELD, times=3.0, learnt=Understated(means=(5.0, 6.0)), returned_s=4.0,
                    usual_s=2.0, agrees_s=9.0)  # fmt: skip
    over = state.broken_off()
    assert (over.kept, over.apart, over.is_held) == ((), Separation(), False)
    assert isnan(over.agrees_s)
    assert (over.times, over.learnt, over.returned_s, over.usual_s) == (3.0, state.learnt, 4.0, 2.0)
    assert replace(state, is_held=False).begun_anew() == over
    # What the belief knew when it began is taken up again.
    regained = replace(state, apart=Separation(0.5, coast(times=1.5))).regained()
    assert (regained.times, regained.learnt, regained.kept) == (1.5, Understated(), ())
    assert replace(state, apart=Separation()).regained().times == 3.0


def test_when_a_belief_without_fixes_is_at_a_fix():
    """109 and 29 m2: six squared deviations are 25.6 m east, or 13.2 m north."""
    other_m = np.array([100.0, 100.0])
    for fix_m, is_near in (
        ((25.5, 0.0), True), ((25.7, 0.0), False), ((0.0, 13.1), True), ((0.0, 13.3), False),
    ):  # fmt: skip
        assert HELD.is_known(np.array(fix_m), STATED_M2, other_m) is is_near
    # Four times 138 m2: the other place is 23.5 m away at least.
    for east_m, is_known in ((23.4, False), (23.6, True), (-23.6, True)):
        assert HELD.is_known(np.zeros(2), STATED_M2, np.array([east_m, 0.0])) is is_known
    assert not Coasting().is_known(np.zeros(2), STATED_M2, other_m)


@pytest.mark.parametrize(
    ("shown", "is_held", "back"),
    [(0.049, True, True), (0.051, True, False), (0.049, False, False)],
)
def test_when_fixes_agree_again(shown, is_held, back):
    assert Coasting(apart=Separation(shown, coast()), is_held=is_held).is_back is back


@pytest.mark.parametrize(
    ("shown", "north_m", "too_little"),
    [(0.2, 51.0, True), (0.19, 51.0, False), (0.2, 50.0, False)],
)
def test_what_leaves_too_little(shown, north_m, too_little):
    assert Separation(shown, coast()).leaves_too_little(np.array([0.0, north_m])) is too_little


def test_the_way_beside_that_of_motion():
    """From (10, 20), where a fix was at (12, 19), to (40, 20): 30 m, while fixes went 25 m."""
    one = coast()._replace(
        mean=np.array([40.0, 20.0, 0, 0, 0]), from_m=np.array([10.0, 20.0]),
        fix_m=np.array([12.0, 19.0]), place_m2=np.diag([36.0, 30.0]),
    )  # fmt: skip
    off_m, moved_m2 = one.beside(np.array([37.0, 22.0]))
    assert off_m.tolist() == [-5.0, 3.0]
    # What motion adds is no less than nothing.
    np.testing.assert_allclose(moved_m2, np.diag([64.0, 0.0]), atol=1e-9)


def test_times_of_variances_are_learnt_by_bayes_rule():
    one = coast(100.0, variance_m2=(8.0, 5.0))._replace(fix_m=np.array([2.0, -1.0]))
    before = Understated((0.5, 0.3, 0.2, 0.0, 0.0, 0.0, 0.0), 60.0, (1.0, 3.0))
    found = before.at_fix(130.0, np.array([22.0, 3.0]), STATED_M2, [coast(131.0), one])
    times = np.array([1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0])
    first = np.array([0.9, 0.04, 0.02, 0.015, 0.01, 0.01, 0.005])
    larger = 0.8 + 0.4 * (times - 1)
    east_m2, north_m2 = 8.0 + 9.0 * larger, 5.0 + 4.0 * larger
    density = np.exp(-200.0 / east_m2 - 8.0 / north_m2) / np.sqrt(east_m2 * north_m2)
    shares = (0.9 * np.array(before.shares) + 0.1 * first) * density
    shares /= shares.sum()
    np.testing.assert_allclose(found.shares, shares)
    assert found.compared_s == 130.0
    assert found.means == (3.0, pytest.approx(float(shares @ times)))
    assert found.times == 3.0


@pytest.mark.parametrize(
    ("after_s", "age_s", "is_compared"),
    [(29.0, 35.0, True), (28.9, 35.0, False), (40.0, 29.0, True), (40.0, 28.9, False),
     (40.0, 50.0, True), (40.0, 50.1, False)],
)  # fmt: skip
def test_when_errors_are_compared(after_s, age_s, is_compared):
    before = Understated(compared_s=200.0)
    time_s = 200.0 + after_s
    found = before.at_fix(time_s, np.zeros(2), STATED_M2, [coast(time_s - age_s)])
    assert (found is not before) is is_compared


@pytest.mark.parametrize(("means", "times"), [((1.5, 9.0), 1.5), ((9.0, 1.4), 1.0)])
def test_times_that_are_hardly_more_are_none(means, times):
    assert Understated(means=means).times == times


@pytest.mark.parametrize(("sd_rad", "is_compared"), [(0.14, True), (0.16, False)])
@pytest.mark.parametrize("kind", ["usual", "held", "of before a gap"])
def test_a_bent_belief_is_compared_only_where_it_is_held_or_of_before_a_gap(
    sd_rad, is_compared, kind
):
    one = coast(10.0)
    one.covariance[2, 2] = sd_rad**2
    before = Coasting(kept=(one,), usual_s=1.0)
    if kind == "held":
        before = replace(before, apart=Separation(0.5, one), is_held=True)
    if kind == "of before a gap":
        before = replace(before, returned_s=10.0)
    found = compared(before, 100.0, [400.0, 0.0])
    assert (found.apart.coast is one) is (is_compared or kind != "usual")
