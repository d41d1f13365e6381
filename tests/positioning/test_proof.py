"""Positions after a belief has begun anew: not claimed before fixes and steps agree on it."""

import numpy as np
import pytest

from mapfilter.angles import wrap_rad
from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.gnss.wander import WanderFix
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.kalman.proof import Doubt, usual_mps, way_agrees
from mapfilter.radio.cells import CellPlan

EAST, NORTH, LASTS_S = 500_000.0, 4_600_000.0, 30.0
CLAIMED = (Status.TRACKING, Status.CONVERGED)


def rows_of(way, fixes, every_s=5.0, sd_m=5.0):
    places = (fixes + EAST + 1j * NORTH).tolist()
    return tuple(
        WanderFix(every_s * k, was.real, was.imag, 0, one.real, one.imag, sd_m)
        for k, (was, one) in enumerate(zip(way.tolist(), places, strict=True))
    )


def streets(rng, count, mps, every_s):
    """A way with corners, as complex numbers."""
    turns = np.where(rng.random(count) < 0.1, rng.choice([-1, 1], count), 0) * np.pi / 2
    return np.cumsum(mps * every_s * np.exp(1j * np.cumsum(turns)))


def agrees(way, fixes, **options):
    return way_agrees(rows_of(way, fixes, **options), 1.0, LASTS_S)


@pytest.mark.parametrize("mps", [1.4, 10.0])
def test_a_way_agrees_turned_by_any_angle_but_not_drawn_out(mps):
    """Ten draws; of fixes of 4 m beside two minutes and a half of the way."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        way = streets(rng, 30, mps, 5.0)
        fixes = way * np.exp(1j * rng.uniform(0, 6)) + rng.normal(0, 4, (30, 2)) @ [1, 1j]
        assert agrees(way, fixes)
        assert agrees(way, 1.03 * fixes)
        assert agrees(way, (1.5 if mps < 3 else 1.15) * fixes) is False
        assert agrees(way, (0.6 if mps < 3 else 0.87) * fixes) is False
        # Led away by 1 m/s, not along a way that is straight.
        led = fixes + 5j * np.arange(30) * (1 if mps < 3 else 3)
        assert agrees(way, led) is False or np.abs(way[-1]) > 0.9 * 145 * mps


@pytest.mark.parametrize("every_s", [0.5, 5.0])
def test_the_usual_speed_is_that_of_the_whole_way(every_s):
    """There and back; of less than a second as of one."""
    way = 3.0 * every_s * np.array([0, 1, 2, 2 + 1j, 2, 1])
    assert usual_mps(rows_of(way, 0 * way, every_s)) == pytest.approx(3.0)
    assert usual_mps(rows_of(way[:2], 0 * way[:2], every_s)) == pytest.approx(min(3 * every_s, 3))
    assert usual_mps(rows_of(way[:1], 0 * way[:1])) == 0.0


def test_fixes_that_lie_elsewhere_do_not_agree():
    rng = np.random.default_rng(4)
    way = streets(rng, 20, 1.4, 5.0)
    scattered = way + rng.normal(0, 16, (20, 2)) @ [1, 1j]
    assert agrees(way, scattered) is False
    # As precise as they are.
    assert agrees(way, scattered, sd_m=16.0) is None
    assert way_agrees(rows_of(way, scattered), 9.0, LASTS_S) is None


def test_a_short_way_tells_nothing():
    way = 7.0 * np.arange(20)
    assert way_agrees((), 1.0, LASTS_S) is None
    assert agrees(way[:1], 0j + way[:1]) is None
    known = [agrees(way[:count], 0j + way[:count]) for count in range(2, 21)]
    assert known.index(True) == known.count(None)
    assert 6 <= known.count(None) <= 14
    # Wheels tell lengths better than steps.
    driven = [agrees(8 * way[:count], 0j + 8 * way[:count]) for count in range(2, 21)]
    assert driven.count(None) < known.count(None)


@pytest.mark.parametrize(("mps", "every_s"), [(1.4, 30.0), (15.0, 5.0), (0.0, 5.0), (0.0, 30.0)])
def test_exact_fixes_do_not_contradict_however_few_or_near(mps, every_s):
    """Three of them half a minute apart did, and all those where one stands."""
    way = 0j + mps * every_s * np.arange(12)
    known = [agrees(way[:count], way[:count], every_s=every_s) for count in range(1, 13)]
    assert False not in known
    assert (True in known) == (mps > 0)


@pytest.mark.parametrize(
    ("doubt", "agree", "after"),
    [
        (Doubt.NONE, False, Doubt.NONE),
        (Doubt.IF_CONTRADICTED, None, Doubt.IF_CONTRADICTED),
        (Doubt.IF_CONTRADICTED, True, Doubt.NONE),
        (Doubt.IF_CONTRADICTED, False, Doubt.UNTIL_PROVEN),
        (Doubt.UNTIL_PROVEN, None, Doubt.UNTIL_PROVEN),
        (Doubt.UNTIL_PROVEN, False, Doubt.UNTIL_PROVEN),
        (Doubt.UNTIL_PROVEN, True, Doubt.NONE),
    ],
)
def test_doubt_is_taken_by_a_way_that_agrees(doubt, agree, after):
    assert doubt.after(agree) is after


def located(steps, seen, sd_m=5.0):
    """Positions and statuses with a fix each second, and whether a phone was taken for turned."""
    tracker = KalmanFilter().over_sites(CellPlan("EPSG:32629", ()))
    state, rng = tracker.begin({"gnss", "motion"}), np.random.default_rng(0)
    places, statuses, turned = [], [], False
    for k, (step, one) in enumerate(zip(steps, seen.tolist(), strict=True)):
        fix = GnssFix(EAST + one.real, NORTH + one.imag, sd_m**2, sd_m**2, 0.0)
        state, out = tracker.step(state, Epoch(float(k), (step,), gnss=fix), rng)
        places.append(complex(out.fix.east_m - EAST, out.fix.north_m - NORTH))
        statuses.append(out.fix.status)
        turned |= any(one.reason is Reason.PHONE_TURNED for one in out.unused)
    return np.array(places), statuses, turned


def walk(seed, count=800):
    """A walk in streets, and what steps and a compass say of it."""
    rng = np.random.default_rng(seed)
    way = streets(np.random.default_rng(seed + 50), count // 8, 1.4, 8.0)
    way = np.interp(np.arange(count), 8 * np.arange(1, count // 8 + 1), way)
    gone = np.diff(way, prepend=0)
    headings = wrap_rad(np.angle(gone) + rng.normal(0, 0.1, count))
    steps = [MotionStep(*one) for one in zip(np.abs(gone), headings, strict=True)]
    return rng, way, steps


@pytest.mark.parametrize("ahead", [1.0, -1.0])
def test_a_place_that_positions_were_led_to_is_not_claimed(ahead):
    """By 1 m/s along the way for two minutes: it was claimed 60 to 120 m off, within 8 m."""
    told = 0
    for seed in range(1, 5):
        rng, way, steps = walk(seed)
        along = (way[301] - way[299]) / abs(way[301] - way[299])
        led = ahead * along * np.clip(np.arange(800) - 300, 0, 120) * (np.arange(800) < 420)
        seen = way + led + rng.normal(0, 3, (800, 2)) @ [1, 1j]
        places, statuses, turned = located(steps, seen, 3.0)
        far = np.abs(places - way) > 50.0
        assert far[300:420].any()
        assert set(statuses[700:]) == {Status.TRACKING}
        # After a corner it may look like a phone that is turned.
        if not turned:
            told += 1
            assert not any(one in CLAIMED for one, off in zip(statuses, far, strict=True) if off)
            assert Status.LOST in statuses[330:420]
            assert Status.UNCERTAIN in statuses[330:600]
    assert told >= 3


def test_a_belief_that_was_wrong_is_claimed_again_once_steps_agree():
    """Headings of two minutes are none: then the belief begins anew, and is right."""
    for seed in range(2):
        rng, way, steps = walk(seed)
        wild = rng.uniform(-3, 3, 120)
        steps[300:420] = [MotionStep(1.4, float(one)) for one in wild]
        places, statuses, _ = located(steps, way + rng.normal(0, 3, (800, 2)) @ [1, 1j], 3.0)
        assert set(statuses[330:420]) & {Status.LOST, Status.UNCERTAIN}
        assert set(statuses[600:]) == {Status.TRACKING}
        assert np.abs(places - way)[600:].max() < 15.0


def test_who_begins_anew_and_stands_is_claimed_after_two_minutes():
    """Fixes that stay beside one who rests have agreed for long enough."""
    rng, way, steps = walk(2)
    way[420:] = way[420]
    steps[420:] = [MotionStep(0.0, one.heading_rad) for one in steps[420:]]
    seen = way + rng.normal(0, 3, (800, 2)) @ [1, 1j]
    seen[350:] += 300.0
    _, statuses, _ = located(steps, seen, 3.0)
    begun = statuses.index(Status.UNCERTAIN)
    again = next(k for k in range(begun, 800) if statuses[k] is Status.TRACKING)
    assert 60 <= again - begun <= 130
