"""What a fix does to the belief of a Kalman-type filter: numbers by hand."""

from dataclasses import replace
from math import exp, inf, isnan, nan, radians, sqrt

import numpy as np
import pytest

from mapfilter.filters.gaussian import EKF
from mapfilter.models.state import MOVING
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.gnss.wander import FixWander, FoundErrors, Way
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.disputed import FixRecord, Ruling
from mapfilter.positioning.kalman.fix_errors import FixErrors
from mapfilter.positioning.kalman.fixing import FixWeighing
from mapfilter.positioning.kalman.lasting import extended_layout
from mapfilter.positioning.kalman.models import KalmanOptions
from mapfilter.positioning.kalman.proof import Doubt
from mapfilter.positioning.kalman.reckoning import RECKONED

USUAL = FixErrors(record=FixRecord(agreed=40, agreed_from_s=-1.0), fixed_s=0.0)
"""Of a belief that forty fixes have agreed with, the last one at 0 s."""


def deciding(own, **options):
    """Return the weighing of fixes of which nothing lasts but what is given."""
    given = KalmanOptions(**{"fix_lasting_share": 0.0} | options)
    layout = extended_layout(own) if given.has_lasting_fixes else own
    return FixWeighing(given, own, layout, EKF, own.size)


def belief_of(own, variance_m2, *, size=None, mean=()):
    first = np.zeros(size or own.size)
    first[: len(mean)] = mean
    return SumBelief.start(first, variance_m2 * np.eye(first.size))


def weighed(how, belief, fix, time_s=1.0, errors=USUAL, **more):
    return how.weighed(belief, errors, fix, time_s, drift_deg_per_sqrt_m=0.6, **more)


def fix_of(east_m, north_m, variance_m2):
    return GnssFix(east_m, north_m, variance_m2, variance_m2)


def test_a_fix_that_agrees_counts_by_its_variance():
    """4 m² and 12 m²: a quarter of the way; 6 m off are 36 / 16 deviations squared, of two."""
    found = weighed(deciding(RECKONED), belief_of(RECKONED, 4.0), fix_of(6.0, -2.0, 12.0))
    moments = found.belief.moments
    np.testing.assert_allclose(moments.mean, [1.5, -0.5, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(moments.covariance, np.diag([3.0, 3.0, 4.0, 4.0, 4.0]), atol=1e-12)
    assert (found.ruling, found.used, found.drifted) == (Ruling.AGREES, True, False)
    assert found.nis == pytest.approx((36 + 4) / 16 / 2)
    assert (found.errors.lasting_m, found.errors.fixed_s) == (0.0, 1.0)
    transition, noise, shift = found.motion
    np.testing.assert_array_equal(transition, np.eye(5))
    assert not noise.any()
    assert not shift.any()


def test_a_fix_without_an_error_has_the_assumed_one():
    how = deciding(RECKONED, fix_sd_m=6.0)
    found = weighed(how, belief_of(RECKONED, 4.0), GnssFix(10.0, 0.0, nan, nan))
    assert found.belief.moments.mean[0] == pytest.approx(10 * 4 / (4 + 36))


@pytest.mark.parametrize(("excess", "times"), [(1.4, 1.0), (2.0, 2.0)])
def test_fixes_that_were_less_precise_than_stated_count_for_less(excess, times):
    errors = USUAL._replace(record=replace(USUAL.record, excess=excess))
    found = weighed(
        deciding(RECKONED), belief_of(RECKONED, 4.0), fix_of(6.0, 0.0, 12.0), 1.0, errors
    )
    assert found.belief.moments.mean[0] == pytest.approx(6 * 4 / (4 + 12 * times))


def test_what_lasts_of_a_fix_is_in_the_place_and_what_is_white_in_the_update():
    """Half of 32 m² lasts: q is off from p by 16 m², and the fix from q by as much."""
    how = deciding(RECKONED, fix_lasting_share=0.5)
    errors = USUAL._replace(lasting_m=2.0, fixed_s=nan)
    both = np.vstack([np.eye(5), np.eye(5)[:2]])
    given = both @ np.diag([8.0, 8.0, 1.0, 1.0, 1.0]) @ both.T
    given[5:, 5:] += 4.0 * np.eye(2)
    belief = replace(belief_of(RECKONED, 1.0, size=7), covariances=given[None])
    found = weighed(how, belief, fix_of(10.0, 0.0, 32.0), 5.0, errors)
    assert found.errors.lasting_m == pytest.approx(4.0)
    # The variance of q is 8 + 16, of the fix 16 more, and that of p 8 of them.
    moments = found.belief.moments
    np.testing.assert_allclose(moments.mean[[0, 5]], [10 * 8 / 40, 10 * 24 / 40])
    np.testing.assert_allclose(
        moments.covariance[np.ix_([0, 5], [0, 5])],
        np.array([[8.0, 8.0], [8.0, 24.0]]) - np.outer([8, 24], [8, 24]) / 40,
    )
    assert found.motion[1][5, 5] == found.motion[1][6, 6] == pytest.approx(16.0 - 4.0)


@pytest.mark.parametrize(
    ("before_m", "fixed_s", "lasting_m"),
    [
        # From 9 to 16 m² over half a minute, by the time since the last fix.
        (3.0, 0.0, sqrt(9 + (1 - exp(-1.0)) * 7)),
        (3.0, nan, 4.0),
        (4.0, 0.0, 4.0),
        (5.0, 0.0, 4.0),
    ],
)
def test_errors_that_last_grow_with_time_and_shrink_at_once(before_m, fixed_s, lasting_m):
    how = deciding(RECKONED, fix_lasting_share=0.5, fix_lasting_s=30.0)
    errors = USUAL._replace(lasting_m=before_m, fixed_s=fixed_s)
    belief = belief_of(RECKONED, 4.0, size=7)
    found = weighed(how, belief, fix_of(1.0, 0.0, 32.0), 15.0, errors)
    assert found.errors.lasting_m == pytest.approx(lasting_m)


def test_what_has_shown_to_last_counts_where_it_is_more():
    """Of 8 m² stated twice as much is white, and twice as much lasts."""
    how = deciding(RECKONED, fix_lasting_share=0.1)
    errors = USUAL._replace(lasting_m=1.0, fixed_s=nan)
    errors = errors._replace(wander=FixWander(now=FoundErrors(2.0, 2.0)))
    found = weighed(how, belief_of(RECKONED, 4.0, size=7), fix_of(1.0, 0.0, 8.0), 1.0, errors)
    assert found.errors.lasting_m == pytest.approx(4.0)
    # Of all that fixes are off by, which is 32 m², a tenth lasts.
    errors = errors._replace(wander=FixWander(now=FoundErrors(3.8, 0.2)))
    found = weighed(how, belief_of(RECKONED, 4.0, size=7), fix_of(1.0, 0.0, 8.0), 1.0, errors)
    assert found.errors.lasting_m == pytest.approx(sqrt(0.1 * 32.0))


def test_what_a_belief_lags_behind_is_added_along_both_axes():
    found = weighed(
        deciding(RECKONED), belief_of(RECKONED, 1.0), fix_of(10.0, -4.0, 9.0), astray_m2=8.0
    )
    np.testing.assert_allclose(found.belief.moments.mean[:2], [5.0, -2.0])
    np.testing.assert_allclose(np.diag(found.motion[1]), [8.0, 8.0, 0.0, 0.0, 0.0])
    assert np.count_nonzero(found.motion[1]) == 2
    # Of what lasts, too: the place that fixes are of goes along.
    how = deciding(RECKONED, fix_lasting_m=1e-6)
    found = weighed(how, belief_of(RECKONED, 1.0, size=7), fix_of(0.0, 0.0, 9.0), astray_m2=8.0,
                    errors=USUAL._replace(lasting_m=1e-6))  # fmt: skip
    lag = found.motion[1]
    for axis in (0, 1):
        pair = [axis, 5 + axis]
        np.testing.assert_allclose(lag[np.ix_(pair, pair)], 8.0)
    assert np.count_nonzero(lag > 1.0) == 8


def test_an_outlier_leaves_what_steps_tell():
    belief = belief_of(RECKONED, 1.0)
    found = weighed(deciding(RECKONED), belief, fix_of(40.0, 0.0, 25.0))
    assert found.ruling is Ruling.OUTLIER
    assert found.belief is belief
    assert isnan(found.nis)
    assert not found.used
    assert found.errors.fixed_s == 1.0
    assert len(found.errors.record.rows) == 1
    assert found.errors.wander == FixWander()


def test_without_steps_an_outlier_is_at_the_limit():
    """40 m off: 1600 / 13.8 m² in all, of which 1 is the belief's."""
    errors = USUAL._replace(fixed_s=nan)
    found = weighed(deciding(MOVING), belief_of(MOVING, 1.0), fix_of(40.0, 0.0, 25.0), 1.0, errors)
    assert (found.ruling, found.used) == (Ruling.OUTLIER, True)
    assert isnan(found.nis)
    moments = found.belief.moments
    np.testing.assert_allclose(moments.mean, [40 * 13.8 / 1600, 0.0, 0.0, 0.0])
    left = 1 - 13.8 / 1600
    np.testing.assert_allclose(np.diag(moments.covariance), [left, 1.0, left, 1.0])


@pytest.mark.parametrize(("time_s", "ruling"), [(20.0, Ruling.OUTLIER), (20.1, Ruling.EITHER)])
def test_after_20_s_without_fixes_either_may_be_right(time_s, ruling):
    given = deciding(RECKONED), belief_of(RECKONED, 1.0), fix_of(40.0, 0.0, 25.0)
    assert weighed(*given, time_s).ruling is ruling
    assert weighed(*given, 1.0, is_doubted=True).ruling is Ruling.EITHER


def contradicted(off_m, own=RECKONED, **options):
    """Return what the last of fixes of 25 m² leads to, one a second, until a belief gives way."""
    how, errors = deciding(own, **options), USUAL
    belief = belief_of(own, 1.0, size=how.layout.size)
    for second in range(1, 40):
        found = weighed(how, belief, fix_of(off_m, 7.0, 25.0), float(second), errors)
        if found.ruling is not Ruling.OUTLIER:
            return found, second
        errors = found.errors
    return found, inf


@pytest.mark.parametrize(("off_m", "drifted"), [(200.0, False), (30.0, True)])
def test_a_belief_that_is_wrong_begins_anew_at_the_fix(off_m, drifted):
    """After half a minute, and in doubt until it is proven. From 37 m on, that is a jump."""
    found, second = contradicted(off_m)
    assert (found.ruling, second, found.drifted) == (Ruling.ANEW, 31, drifted)
    moments = found.belief.moments
    np.testing.assert_allclose(moments.mean, [off_m, 7.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(moments.covariance, np.diag([25.0, 25.0, 1.0, 1.0, 1.0]))
    assert (found.used, found.errors.doubt) == (True, Doubt.UNTIL_PROVEN)
    assert isnan(found.nis)
    assert found.errors.fixed_s == 31.0


def test_without_steps_it_begins_anew_with_an_unknown_velocity():
    how = deciding(MOVING, speed_sd_mps=3.0)
    belief = belief_of(MOVING, 1.0, mean=(0.0, 5.0, 0.0, -4.0))
    found = weighed(how, belief, fix_of(100.0, 0.0, 16.0), 1.0, FixErrors(fixed_s=nan))
    assert (found.ruling, found.errors.doubt) == (Ruling.EITHER, Doubt.NONE)
    moments = found.belief.moments
    np.testing.assert_allclose(moments.mean, [50.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(moments.covariance, np.diag([50.0**2 + 16.0, 9.0, 16.0, 9.0]))


def test_what_lasts_is_beside_a_place_that_it_begins_anew_at():
    """70 % of 16 m² last: the place that fixes are of has the rest, and the position has both."""
    how = deciding(RECKONED, fix_lasting_share=0.7)
    wander = FixWander(rows=(), now=FoundErrors(1.0, 0.3))
    found = weighed(how, belief_of(RECKONED, 1.0, size=7), fix_of(0.0, 600.0, 16.0), 1.0,
                    FixErrors(lasting_m=1.0, wander=wander))  # fmt: skip
    assert found.ruling is Ruling.EITHER
    assert found.errors.lasting_m == pytest.approx(sqrt(0.7 * 16))
    # What was learnt of errors beside a belief that was wrong is dropped.
    assert found.errors.wander == FixWander()
    moments = found.belief.moments
    np.testing.assert_allclose(moments.mean[[0, 1, 5, 6]], [0.0, 300.0, 0.0, 300.0])
    white = np.diag([0.3 * 16, 300.0**2 + 0.3 * 16])
    places = np.block([[white + 0.7 * 16 * np.eye(2), white], [white, white]])
    np.testing.assert_allclose(moments.covariance[np.ix_([0, 1, 5, 6], [0, 1, 5, 6])], places)
    np.testing.assert_allclose(moments.covariance[2:5, 2:5], np.eye(3))


def driven(off_m, speed_mps, *, elapsed_s=5.0, **options):
    """Return what a fix means to a belief that goes east, 5 s after the last one.

    1 m² of place, and 2 (m/s)² of each velocity.
    """
    how = deciding(MOVING, **options)
    belief = belief_of(MOVING, 1.0, size=how.layout.size, mean=(0.0, speed_mps))
    belief.covariances[:, [1, 3], [1, 3]] = 2.0
    given = fix_of(0.0, off_m, 25.0)
    return weighed(how, belief, given, elapsed_s, USUAL._replace(lasting_m=1e-6))


@pytest.mark.parametrize(
    ("speed_mps", "root"),
    # Half of the way of 6 m/s, of which 4 (m/s)² are in its variances; and 4 m/s^1.5 at most.
    [(sqrt(32.0), 0.5 * 6 * sqrt(3 / 5)), (40.0, 4.0)],
)
def test_who_brakes_and_turns_may_be_where_a_velocity_does_not_lead(speed_mps, root):
    place_m2 = root**2 * 5**3 / 3
    least_m, most_m = sqrt(13.8 * 26), sqrt(13.8 * (26 + place_m2))
    for off_m in (least_m + 0.1, most_m - 0.1):
        found = driven(off_m, speed_mps)
        assert (found.ruling, found.used) == (Ruling.AGREES, True)
        assert found.nis == pytest.approx(off_m**2 / (26 + place_m2) / 2)
        prior = np.array(
            [[1 + place_m2, root**2 * 5**2 / 2], [root**2 * 5**2 / 2, 2 + root**2 * 5]]
        )
        moments, gain = found.belief.moments, prior[0] / (prior[0, 0] + 25)
        # North and its rate by the fix; east and its rate by the noise alone.
        np.testing.assert_allclose(moments.mean[2:], gain * off_m)
        np.testing.assert_allclose(
            moments.covariance[2:, 2:], prior - np.outer(gain, gain) * (prior[0, 0] + 25)
        )
        np.testing.assert_allclose(moments.mean[:2], [0.0, speed_mps])
        np.testing.assert_allclose(found.motion[1][:2, :2], prior - np.diag([1.0, 2.0]))
        np.testing.assert_array_equal(found.motion[0], np.eye(4))
    for off_m in (least_m - 0.1, most_m + 0.1):
        found = driven(off_m, speed_mps)
        assert not found.motion[1].any()
        assert (found.ruling is Ruling.AGREES) is (off_m < least_m)


def test_the_place_that_fixes_are_of_brakes_and_turns_along():
    root = 0.5 * 6 * sqrt(3 / 5)
    found = driven(30.0, sqrt(32.0), fix_lasting_m=1e-6)
    noise = found.motion[1]
    for own, of_fixes in ((0, 4), (2, 5)):
        row = noise[of_fixes, [own, own + 1, of_fixes]]
        np.testing.assert_allclose(row, root**2 * np.array([125 / 3, 12.5, 125 / 3]))
    assert noise[4, 5] == 0.0


def test_steps_tell_how_one_brakes_and_turns():
    how = deciding(RECKONED)
    found = weighed(how, belief_of(RECKONED, 1.0), fix_of(25.0, 0.0, 25.0), 5.0)
    assert found.ruling is Ruling.OUTLIER
    # At the time of the last fix one is where it was.
    assert driven(25.0, sqrt(32.0), elapsed_s=0.0).ruling is Ruling.OUTLIER


def test_how_fixes_wander_is_followed_beside_steps_alone():
    mean, way = (0.0, 0.0, 0.0, 0.0, 0.02), Way(3.0, 4.0, 1)
    errors, belief = USUAL._replace(way=way), belief_of(RECKONED, 1e-12, mean=mean)
    given = fix_of(1.0, 2.0, 25.0)
    found = weighed(deciding(RECKONED), belief, given, 1.0, errors)
    rate, drift = 0.02, radians(0.6)
    assert found.errors.wander == FixWander().at_fix(1.0, way, (1.0, 2.0), 25.0, rate, drift)
    assert found.errors.fixed_way == way
    # At rest for more than 10 s what was followed is broken off, for less it stays.
    known = errors._replace(wander=found.errors.wander)
    for since_s, rows in ((85.0, 1), (95.0, 1), (89.0, 0)):
        at_s = 99.5 if since_s == 89.0 else 95.0
        rested = weighed(deciding(RECKONED), belief, given, at_s, known, rests_since_s=since_s)
        assert len(rested.errors.wander.rows) == rows
    alone = weighed(deciding(MOVING), belief_of(MOVING, 1.0), given, 1.0, errors)
    assert alone.errors.wander == FixWander()


def test_of_a_belief_in_parts_each_has_its_own_prediction():
    how = deciding(RECKONED)
    belief = SumBelief.start(np.zeros(5), np.diag([900.0, 900.0, 1.0, 1.0, 1.0]), {0: 3})
    found = weighed(how, belief, fix_of(500.0, 0.0, 25.0))
    assert (found.ruling, found.used) == (Ruling.AGREES, True)
    assert found.nis > 13.8
    assert found.errors.record == USUAL.record
