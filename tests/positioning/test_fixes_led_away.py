"""Fixes that dead reckoning contradicts in a Kalman-type filter: led away, jammed, reflected."""

from math import exp, isnan, nan

import numpy as np
import pytest

from mapfilter.angles import wrap_rad
from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.gaussian import Gaussian
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.kalman.coast import Coast
from mapfilter.positioning.kalman.coasting import Coasting, Separation
from mapfilter.positioning.kalman.filter import KalmanFilter, KalmanSmoother
from mapfilter.positioning.kalman.understated import Understated
from mapfilter.radio.cells import CellPlan

EAST, NORTH = 500_000.0, 4_600_000.0
CLAIMED = (Status.TRACKING, Status.CONVERGED)


def walk(seed, count):
    """Steps of a second along streets with corners by a compass, and where they lead."""
    rng = np.random.default_rng(seed)
    turns = np.where(np.arange(count) % 70 == 69, rng.choice([-1, 1], count), 0) * np.pi / 2
    heading = np.cumsum(turns)
    measured = heading + rng.normal(0, 0.03) + rng.normal(0, 0.08, count)
    steps = [MotionStep(1.4, float(wrap_rad(one))) for one in measured]
    return steps, np.cumsum(1.4 * np.exp(1j * heading)), rng


def usual(rng, count):
    """Errors of 2.5 m that are averages over half a minute, and white ones of 1.5 m."""
    return slow(rng, count, 2.5) + white(rng, count, 1.5)


def white(rng, count, sd_m):
    return rng.normal(0, sd_m, count) + 1j * rng.normal(0, sd_m, count)


def slow(rng, count, sd_m, width=50):
    noise = white(rng, count + width - 1, sd_m)
    return np.convolve(noise, np.ones(width) / np.sqrt(width), "valid")


def followed(steps, fixes, method="ekf"):
    """Errors are the caller's: places, 95 % radii, claims and the states."""
    tracker = KalmanFilter(method=method).over_sites(CellPlan("EPSG:32629", ()))
    state, rng, found = tracker.begin({"gnss", "motion"}), np.random.default_rng(0), []
    for k, (step, fix) in enumerate(zip(steps, fixes, strict=True)):
        given = None if isnan(fix.real) else GnssFix(EAST + fix.real, NORTH + fix.imag, 9.0, 9.0, 0)
        state, out = tracker.step(state, Epoch(float(k), (step,), gnss=given), rng)
        place = complex(out.fix.east_m - EAST, out.fix.north_m - NORTH)
        claimed = out.fix.status in CLAIMED
        # Fixes that are used while nothing is claimed because of them say why.
        doubted = out.fix.reason is Reason.ON_PROBATION
        assert not (doubted and claimed)
        found.append((place, out.fix.radii_m[2], claimed, state.fixes.coasting, doubted))
    places, radii_m, claimed, states, doubted = zip(*found, strict=True)
    return np.array(places), np.array(radii_m), np.array(claimed), states, np.array(doubted)


@pytest.mark.parametrize("method", ["ekf", "ukf"])
@pytest.mark.parametrize("mps", [1.0, 2.0])
def test_fixes_that_are_led_away_are_held_back_until_they_return(mps, method):
    """They were followed, claimed for .4 of the time, and the true ones were outliers for long."""
    lasts_s = round(240 / mps)
    steps, way, rng = walk(int(mps), 260 + lasts_s)
    led = slice(200, 200 + lasts_s)
    fixes = way + usual(rng, len(way))
    fixes[led] += mps * np.arange(lasts_s) * np.exp(1.1j)
    places, radii_m, claimed, states, doubted = followed(steps, fixes, method)
    off_m = np.abs(places - way)
    assert claimed[:200].all()
    assert (claimed & (off_m > 50))[led].mean() < 0.1
    assert (off_m <= radii_m)[led][-lasts_s // 2 :].mean() > 0.9
    assert not claimed[200 + lasts_s // 2 : 200 + lasts_s].any()
    assert doubted[led].any()
    assert not doubted[:200].any()
    # They agree again with where steps have led since before.
    back = slice(200 + lasts_s + 10, None)
    assert claimed[back].all()
    assert off_m[back].max() < 15.0
    assert not states[-1].is_held


def test_smoothed_positions_have_not_followed_fixes_that_were_led_away():
    """The belief that takes over has no past with them."""
    steps, way, rng = walk(1, 500)
    fixes = way + usual(rng, len(way))
    fixes[200:440] += np.arange(240) * np.exp(1.1j)
    tracker = KalmanFilter().over_sites(CellPlan("EPSG:32629", ()))
    state, history = tracker.begin({"gnss", "motion"}), KalmanSmoother()
    for k, (step, fix) in enumerate(zip(steps, fixes, strict=True)):
        given = GnssFix(EAST + fix.real, NORTH + fix.imag, 9.0, 9.0, 0)
        before = state
        state, _ = tracker.step(state, Epoch(float(k), (step,), gnss=given), rng)
        history.add(before, state)
    later = np.array([one.mean[:2] for one in history.history.smoothed()]) - [EAST, NORTH]
    off_m = np.abs(later @ [1, 1j] - way)
    assert np.isfinite(off_m).all()
    assert off_m[:200].max() < 15.0
    assert off_m[450:].max() < 15.0


def test_fixes_that_come_back_beside_the_place_are_taken_for_both():
    """After a minute without any: 40 m aside within 6 m, they said."""
    steps, way, rng = walk(3, 420)
    fixes = way + usual(rng, len(way))
    fixes[200:260] = nan
    fixes[260:320] += 40.0 * np.exp(2j)
    places, radii_m, *_ = followed(steps, fixes)
    off_m = np.abs(places - way)
    assert (off_m <= radii_m)[261:320].mean() > 0.9
    assert off_m[330:].max() < 15.0
    assert np.median(radii_m[340:]) < 10.0


def test_right_fixes_after_a_gap_are_soon_believed():
    steps, way, rng = walk(4, 420)
    fixes = way + usual(rng, len(way))
    fixes[200:260] = nan
    places, radii_m, claimed, *_ = followed(steps, fixes)
    assert claimed.all()
    assert np.abs(places - way)[262:].max() < 15.0
    assert np.median(radii_m[262:]) < 10.0


def test_errors_between_houses_are_larger_than_stated():
    """Errors of 20 m along each axis, stated as 3 m: the radius was 10 m, and held .2."""
    held, before = [], []
    for seed in (5, 6, 7):
        steps, way, rng = walk(seed, 600)
        fixes = way + usual(rng, len(way))
        fixes[200:] += slow(rng, 400, 20.0, 60)
        places, radii_m, _, states, _ = followed(steps, fixes)
        held.append((np.abs(places - way) <= radii_m)[300:].mean())
        before.append(max(one.times for one in states[:200]))
        assert max(one.times for one in states[300:]) > 8.0
    assert np.mean(held) > 0.5
    assert min(before) == 1.0


def test_good_fixes_are_as_precise_as_they_were():
    for seed in (8, 9):
        steps, way, rng = walk(seed, 500)
        _, radii_m, claimed, states, _ = followed(steps, way + usual(rng, 500))
        assert claimed.all()
        assert not any(one.is_held for one in states)
        assert np.mean([one.times > 1 for one in states]) < 0.1
        assert np.median(radii_m[100:]) < 6.5


def coast(begun_s=0.0, place_m=(0.0, 0.0), sd_m=10.0, times=1.0):
    mean, covariance = np.array([*place_m, 0.0, 0.0, 0.0]), np.diag([sd_m**2, sd_m**2, 0, 0, 0])
    one = Coast.of(begun_s, Gaussian(mean, covariance), times, np.zeros(2))
    return one._replace(place_m2=np.zeros((2, 2)))


def compared(state, time_s, east_m, since_s=1.0, predicted_sd_m=10.0):
    predicted = Gaussian(np.zeros(5), np.diag([*[predicted_sd_m**2] * 2, 1e-2, 1e-3, 1e-6]))
    place_m = np.array([east_m, 0.0])
    return state.compared(time_s, place_m, 9.0 * np.eye(2), predicted, since_s)


def odds(off_m, sd_m, prior, fix_m2=9.0, aside_m2=3600.0):
    """Odds of wrong fixes by hand."""
    right, wrong = sd_m**2 + fix_m2, sd_m**2 + fix_m2 + aside_m2
    return prior * right / wrong * exp(off_m**2 / 2 * (1 / right - 1 / wrong))


def test_the_probability_that_fixes_are_wrong_by_hand():
    """Steps that are wrong have as much.

    For a minute they may have been led by 1 m/s along each axis, and 0.01 m/s per root second.
    """
    given = odds(40.0, 10.0, 3e-3, aside_m2=60.0**2 * (1 + 1e-4 * 60))
    found = compared(Coasting(kept=(coast(),)), 60.0, 40.0)
    assert found.apart.probability == pytest.approx(given / (1 + 2 * given))
    assert found.is_held == (found.apart.probability >= 0.2)
    far = compared(Coasting(kept=(coast(),)), 60.0, 400.0)
    assert far.apart.probability == pytest.approx(0.5)
    assert far.is_held
    near = compared(Coasting(kept=(coast(),)), 60.0, 5.0)
    assert near.apart == Separation()
    # One that is too young shows nothing, and one that is too old is dropped.
    assert compared(Coasting(kept=(coast(),)), 50.0, 400.0).apart == Separation()
    assert compared(Coasting(kept=(coast(),)), 151.0, 400.0) == Coasting(usual_s=1.0)


def test_fixes_after_a_gap_are_more_often_wrong():
    found = compared(Coasting(usual_s=1.0), 100.0, 40.0, since_s=30.0)
    given = odds(40.0, 10.0, 0.203)
    assert found.returned_s == 100.0
    assert found.apart.probability == pytest.approx(given / (1 + given * (1 + 3e-3 / 0.203)))
    # That fades, and fixes that are always so far apart have no gap.
    later = compared(found, 190.0, 40.0)
    # Both lie as far aside, so their mean counts, whose error has half of the variance.
    given = odds(40.0, 10.0, 3e-3 + 0.2 / np.e, fix_m2=4.5)
    share = 3e-3 / (3e-3 + 0.2 / np.e)
    assert later.apart.probability == pytest.approx(given / (1 + given * (1 + share)))
    assert compared(Coasting(usual_s=12.0), 100.0, 40.0, since_s=30.0).apart == Separation()
    assert compared(Coasting(), 100.0, 40.0, since_s=nan).apart == Separation()


def test_a_held_belief_ends_as_fixes_agree_with_it_or_with_steps():
    held = compared(Coasting(kept=(coast(),)), 60.0, 100.0)
    assert held.is_held
    assert not held.is_back
    back = held.again(61.0, np.array([3.0, 0.0]), 9.0 * np.eye(2))
    assert back.is_back
    # Until one of the two has given way, the fix has not made the one that it contradicts right.
    assert back.apart == held.apart
    assert back.is_known(np.array([3.0, 0.0]), 9.0 * np.eye(2), np.array([100.0, 0.0]))
    assert not back.is_known(np.array([3.0, 0.0]), 9.0 * np.eye(2), np.array([20.0, 0.0]))
    assert not back.is_known(np.array([60.0, 0.0]), 9.0 * np.eye(2), np.array([300.0, 0.0]))
    assert back.begun_anew() is back
    assert not back.regained().is_held
    for mps, needs_s in ((1.4, 30.0), (10.0, 300.0)):
        agrees = held.along(100.0, True, mps).along(180.0, True, mps)
        assert agrees.along(179.0 + needs_s, True, mps).is_held
        assert not agrees.along(180.0 + needs_s, True, mps).is_held
        assert agrees.along(190.0, False, mps).along(180.0 + needs_s, True, mps).is_held
    assert held.along(200.0, None, 1.4) is held
    assert compared(held, 600.0, 100.0).is_held
    assert not compared(held, 601.0, 100.0).is_held


def test_a_belief_without_fixes_goes_where_steps_lead():
    motion = np.eye(5), np.diag([4.0, 4.0, 0, 0, 0]), np.array([1.0, 2.0, 0, 0, 0])
    state = Coasting(kept=(coast(),), apart=Separation(0.5, coast()), is_held=True)
    state = state.moved(motion, np.zeros(5))
    for one in (state.kept[0], state.apart.coast):
        np.testing.assert_array_equal(one.mean[:5], [1, 2, 0, 0, 0])
        np.testing.assert_array_equal(np.diag(one.covariance)[:5], [104, 104, 0, 0, 0])
    assert Coasting().moved(motion, np.zeros(5)) == Coasting()


def test_a_belief_whose_heading_is_hardly_known_contradicts_nothing():
    """It is bent, and no normal one."""

    def off_by(sd_rad):
        one = coast()
        covariance = one.covariance.copy()
        covariance[2, 2] = sd_rad**2
        return one._replace(covariance=covariance)

    assert compared(Coasting(kept=(off_by(0.14),)), 60.0, 400.0).is_held
    assert not compared(Coasting(kept=(off_by(0.16),)), 60.0, 400.0).is_held
    for sd_rad, stays in ((0.49, True), (0.51, False)):
        held = Coasting(apart=Separation(0.5, off_by(sd_rad)), is_held=True)
        assert compared(held, 60.0, 400.0).is_held == stays


def test_a_belief_without_fixes_keeps_headings_of_its_own():
    """Where those of the other have jumped by a right angle, and steps are taken for longer."""
    one, about = coast(), np.array([9.0, 9.0, np.pi / 2, 0.25, 0.0])
    motion = np.eye(5), np.diag([4.0, 1.0, 0, 0, 0]), np.zeros(5)
    # North by ten metres of eight: by its heading they lead east.
    motion[0][:2, 2:] = [[-10.0, 0.0, 0.0], [0.0, 8.0, 0.0]]
    motion[2][:2] = [10.0 * np.pi / 2, 8.0]
    moved = one.moved(motion, about)
    np.testing.assert_allclose(moved.mean, [8.0, *[0] * 6], atol=1e-9)
    np.testing.assert_allclose(np.diag(moved.covariance)[:2], [100 + 0.64, 100 + 2.56])
    same = one._replace(mean=np.append(about, [0.3, 0.4])).moved(motion, about)
    np.testing.assert_allclose(same.mean[5:], [0.3, 0.4])
    np.testing.assert_allclose(same.mean[:5], motion[0] @ about + motion[2])


def test_nothing_far_from_a_likely_place_is_claimed():
    apart = Separation(0.3, coast(place_m=(100.0, 0.0)))
    assert apart.leaves_too_little(np.zeros(2))
    assert not apart.leaves_too_little(np.array([60.0, 0.0]))
    assert not Separation(0.1, coast(place_m=(100.0, 0.0))).leaves_too_little(np.zeros(2))
    assert not Separation().leaves_too_little(np.zeros(2))


def test_how_much_fixes_understate_by_hand():
    """Half a minute of fixes that have moved by 25 m more than steps, and of ones that have not."""
    state, stated_m2 = Understated(), 9.0 * np.eye(2)
    assert state.times == 1.0
    for k in range(1, 7):
        off_m = 25.0 if k <= 3 else 0.0
        one = coast(30.0 * k - 30.0, sd_m=5.0)
        state = state.at_fix(30.0 * k, np.array([off_m, 0.0]), stated_m2, [one])
        assert sum(state.shares) == pytest.approx(1.0)
        # Not by the first, which may be of a jump of headings.
        assert (state.times > 12.0) == (2 <= k <= 4)
    assert state.times < 3.0
    assert state.at_fix(181.0, np.array([99.0, 0.0]), stated_m2, [coast(150.0)]) is state
    assert state.at_fix(220.0, np.array([99.0, 0.0]), stated_m2, [coast(160.0)]) is state
