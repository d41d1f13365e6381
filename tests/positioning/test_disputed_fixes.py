"""Fixes that contradict a Kalman-type filter: outliers, a belief that is wrong, dead odometers."""

from dataclasses import replace

import numpy as np
import pytest

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.models.state import MOVING
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.positioning.kalman.disputed import ComparedFix, FixRecord, Patience, Ruling
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.kalman.lasting import extended_layout, rescaled
from mapfilter.positioning.kalman.reckoning import RECKONED
from mapfilter.radio.cells import CellPlan

EAST, NORTH = 500_000.0, 4_600_000.0
WAITS = Patience(30.0, 120.0)


def fix_at(place, stated_m=5.0):
    return GnssFix(EAST + place.real, NORTH + place.imag, stated_m**2, stated_m**2, 0.0)


def errors(rng, count, sd_m=4.0):
    return rng.normal(0, sd_m, count) + 1j * rng.normal(0, sd_m, count)


def straight(rng, count, speed_mps=1.4, heading_rad=0.4):
    """Steps of a second by a compass, and where they lead."""
    measured = heading_rad + rng.normal(0, 0.1, count)
    way = speed_mps * np.arange(1, count + 1) * np.exp(1j * heading_rad)
    return [MotionStep(speed_mps, float(one)) for one in measured], way


def followed(fixes, steps=None, *, options=None):
    """Positions, 95 % radii, statuses, reasons of unused motion and the last state."""
    tracker = (options or KalmanFilter()).over_sites(CellPlan("EPSG:32629", ()))
    kinds = {"gnss"} if steps is None else {"gnss", "motion"}
    state, rng = tracker.begin(kinds), np.random.default_rng(0)
    found = []
    for k, fix in enumerate(fixes):
        step = () if steps is None else (steps[k],)
        state, out = tracker.step(state, Epoch(float(k), step, gnss=fix), rng)
        place = complex(out.fix.east_m - EAST, out.fix.north_m - NORTH)
        reasons = {one.reason for one in out.unused if one.kind == "motion"}
        found.append((place, out.fix.radii_m[2], out.fix.status, reasons))
    places, radii_m, statuses, reasons = zip(*found, strict=True)
    return np.array(places), np.array(radii_m), statuses, reasons, state


@pytest.mark.parametrize("method", ["ekf", "ukf"])
def test_a_burst_of_outliers_hardly_moves_what_steps_tell(method):
    """They were followed by some 40 m, and the position stayed LOST after them."""
    for seed in range(2):
        rng = np.random.default_rng(seed)
        steps, way = straight(rng, 300)
        seen = way + errors(rng, 300)
        seen[100:112] += 60.0 * np.exp(1j * seed)
        fixes = [fix_at(one) if k < 140 else None for k, one in enumerate(seen)]
        places, radii_m, statuses, _, _ = followed(
            fixes, steps, options=KalmanFilter(method=method)
        )
        off_m = np.abs(places - way)
        assert off_m[90:140].max() < 10.0
        assert Status.LOST in statuses[102:112]
        assert set(statuses[113:]) == {Status.TRACKING}
        assert (off_m <= radii_m)[113:].mean() > 0.9


def test_a_burst_that_ends_the_fixes_is_forgotten():
    rng = np.random.default_rng(5)
    steps, way = straight(rng, 300)
    seen = way + errors(rng, 300)
    seen[100:] += 80.0
    fixes = [fix_at(one) if k < 106 else None for k, one in enumerate(seen)]
    places, radii_m, statuses, _, _ = followed(fixes, steps)
    assert set(statuses[103:165]) == {Status.LOST}
    assert set(statuses[166:]) == {Status.TRACKING}
    assert (np.abs(places - way) <= radii_m)[166:].all()


@pytest.mark.parametrize(
    ("jump_m", "at", "waits_s"),
    [(400.0, 150, 120), (400.0, 100, 100), (40.0, 100, 30), (400.0, 25, 30)],
)
def test_fixes_that_go_on_elsewhere_are_right(jump_m, at, waits_s):
    """For half a minute it is LOST, then it begins anew; after a jump for as long as they agreed.

    So far steps do not lead astray at once: a spoofer puts positions there. It is claimed once
    steps have agreed on the way for a minute or so.
    """
    rng = np.random.default_rng(6)
    steps, way = straight(rng, 400)
    way[at:] += jump_m
    places, _, statuses, _, _ = followed([fix_at(one) for one in way + errors(rng, 400)], steps)
    off_m = np.abs(places - way)
    assert set(statuses[at + 2 : at + waits_s]) == {Status.LOST}
    assert off_m[at + waits_s + 2 :].max() < 15.0
    assert set(statuses[at + waits_s + 2 : at + waits_s + 40]) == {Status.UNCERTAIN}
    assert set(statuses[at + waits_s + 100 :]) == {Status.TRACKING}


@pytest.mark.parametrize(
    ("gone_m", "agreed_s", "waits_s"),
    [(0.0, 300.0, 120.0), (0.0, 80.0, 80.0), (0.0, 20.0, 30.0), (70.0, 300.0, 120.0),
     (73.0, 300.0, 30.0), (140.0, 300.0, 30.0)],
)  # fmt: skip
def test_what_wrong_headings_may_have_led_to_is_no_jump(gone_m, agreed_s, waits_s):
    """A car whose gyroscope misses a turn is off by twice the way between two fixes at most."""
    one, record = np.eye(2), FixRecord(agreed=60, agreed_from_s=1000.0 - agreed_s)
    for k in range(140):
        # 55.6 m are far for a deviation of 5 m, which counts as 7.5 m.
        off_m = np.array([200.0, 0.0])
        fix = ComparedFix(1000.0 + k, off_m, one, 25.0 * one, False, False, gone_m)
        record, found = record.at_fix(fix, WAITS)
        if found.ruling is Ruling.ANEW:
            break
    assert k == waits_s


def test_a_minute_of_positions_put_elsewhere_is_not_followed():
    """They were, after half a minute, and the true ones after them were outliers."""
    rng = np.random.default_rng(14)
    steps, way = straight(rng, 400)
    seen = way + errors(rng, 400)
    seen[150:210] += 300.0 + 150.0j
    places, _, statuses, _, _ = followed([fix_at(one) for one in seen], steps)
    assert np.abs(places - way).max() < 20.0
    assert Status.LOST not in statuses[:152] + statuses[212:]


def test_fixes_that_scatter_are_no_place_to_begin_anew():
    rng = np.random.default_rng(7)
    steps, way = straight(rng, 300)
    seen = way + errors(rng, 300)
    seen[100:200] += 120.0 * np.exp(2j * np.pi * rng.random(100))
    places, _, statuses, _, _ = followed([fix_at(one) for one in seen], steps)
    assert np.abs(places - way).max() < 20.0
    assert set(statuses[103:200]) == {Status.LOST}


def test_a_first_fix_that_is_an_outlier_is_not_insisted_on():
    """Until others agree the radius covers both places."""
    rng = np.random.default_rng(8)
    steps, way = straight(rng, 60)
    seen = way + errors(rng, 60)
    seen[0] += 150.0
    places, radii_m, _, _, _ = followed([fix_at(one) for one in seen], steps)
    off_m = np.abs(places - way)
    assert (off_m <= radii_m)[1:].all()
    assert radii_m[1] > 100.0
    assert off_m[5:].max() < 15.0


@pytest.mark.parametrize("speed_mps", [9.0, 15.0])
def test_an_odometer_that_reads_zero_while_fixes_go_on_is_dead(speed_mps):
    """On a straight road nothing turns."""
    rng = np.random.default_rng(9)
    way = speed_mps * np.arange(1, 301.0) + 0j
    headings = rng.normal(0, 0.02, 300).tolist()
    steps = [
        MotionStep(0.0 if 150 <= k < 200 else speed_mps, one) for k, one in enumerate(headings)
    ]
    seen = way + errors(rng, 300, 3.0)
    places, _, statuses, reasons, _ = followed([fix_at(one) for one in seen], steps)
    off_m = np.abs(places - way)
    claimed = np.array([one is Status.TRACKING for one in statuses])
    assert off_m[claimed & (np.arange(300) > 5)].max() < 50.0
    assert any(Reason.MOTION_STUCK in one for one in reasons[155:200])
    assert off_m[160:].max() < 25.0
    assert not any(Reason.MOTION_STUCK in one for one in [*reasons[:150], *reasons[205:]])


def test_fixes_that_wander_at_rest_are_no_motion():
    rng = np.random.default_rng(10)
    wander = np.zeros(400, dtype=complex)
    for k in range(1, 400):
        wander[k] = 0.98 * wander[k - 1] + complex(*rng.normal(0, 1.5, 2))
    way = np.concatenate([8.0 * np.arange(1.0, 101.0), np.full(300, 800.0)]) + 0j
    steps = [MotionStep(8.0 if k < 100 else 0.0, 0.0) for k in range(400)]
    places, _, _, reasons, _ = followed([fix_at(one) for one in way + wander], steps)
    assert not any(Reason.MOTION_STUCK in one for one in reasons)
    assert np.abs(places - way).max() < np.abs(wander).max()


def test_fixes_that_state_too_little_are_believed_less():
    """White errors of 12 m, stated as 3 m."""
    held, plain, widest = [], [], []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        steps, way = straight(rng, 300)
        fixes = [fix_at(one, 3.0) for one in way + errors(rng, 300, 12.0)]
        places, radii_m, _, _, state = followed(fixes, steps)
        assert state.fixes.understated > 3.0
        held.append((np.abs(places - way) <= radii_m)[60:].mean())
        exact = [fix_at(one, 12.0) for one in way + errors(rng, 300, 12.0)]
        plain.append(followed(exact, steps)[4].fixes.understated)
        widest.append(np.median(radii_m[60:]))
    assert np.mean(held) > 0.9
    assert max(widest) < 40.0
    # Right ones are, too, by chance and a little.
    assert np.mean(plain) < 1.3


def test_without_dead_reckoning_outliers_do_not_throw_the_velocity():
    rng = np.random.default_rng(11)
    way = 15.0 * np.arange(1, 201.0) + 0j
    seen = way + errors(rng, 200, 3.0)
    seen[[80, 120, 121]] += 200.0j
    places, _, statuses, _, _ = followed([fix_at(one) for one in seen])
    assert np.abs(places - way)[5:].max() < 25.0
    assert Status.LOST not in statuses[:120]
    moved = way + np.where(np.arange(200) >= 100, 900.0j, 0.0)
    places, _, statuses, _, _ = followed([fix_at(one) for one in moved + errors(rng, 200, 3.0)])
    assert np.abs(places - moved)[110:].max() < 20.0
    assert Status.LOST in statuses[100:106]


def test_what_fixes_mean_by_hand():
    one = np.eye(2)

    def given(record, off_m, time_s=0.0, *, rests=False):
        place = np.array([off_m, 0.0])
        fix = ComparedFix(time_s, place, 4.0 * one, 12.0 * one, rests, False, 0.0)
        return record.at_fix(fix, WAITS)

    record, found = given(FixRecord(), 8.0)
    assert (found.ruling, found.squared, found.larger) == (Ruling.AGREES, 2.0, 1.0)
    assert (record.agreed, record.excess, record.understated) == (1, 1.05, 1.0)
    assert given(FixRecord(agreed=2), 15.0)[1].ruling is Ruling.EITHER
    record, found = given(FixRecord(agreed=3), 30.0)
    assert found.ruling is Ruling.OUTLIER
    # 900 / (4 + 12 f) = 13.8
    assert found.larger == pytest.approx((900 / 13.8 - 4) / 12)
    assert (len(record.rows), record.is_lost, record.agreed) == (1, False, 3)
    for time_s in range(10, 30, 10):
        record, found = given(record, 30.0, time_s)
        assert found.ruling is Ruling.OUTLIER
    assert record.is_lost
    # It lasted for longer than a burst does.
    assert record.at_time(1e9).is_lost
    rows = tuple(one._replace(time_s=10.0 + k) for k, one in enumerate(record.rows))
    short = replace(record, rows=rows, agreed=30)
    assert short.at_time(72.0).is_lost
    assert not short.at_time(72.1).is_lost
    assert replace(short, agreed=29).at_time(1e9).is_lost
    # The next one that contradicts the belief goes on with them.
    assert given(short.at_time(80.0), 30.0, 80.0)[1].ruling is Ruling.ANEW
    assert given(short.at_time(73.0), 31.0, 68.0)[0].is_lost
    # As often as the rest of it: five that lasted for half a minute.
    record, found = given(given(record, 30.0, 25.0)[0], 31.0, 31.0)
    assert (found.ruling, record.agreed, record.rows) == (Ruling.ANEW, 0, ())
    doubted = FixRecord(excess=4.0, agreed=3)
    assert given(doubted, 26.0)[1].ruling is Ruling.AGREES
    assert given(doubted, 27.0)[1].ruling is Ruling.OUTLIER


def test_fixes_on_a_line_while_one_stands():
    def ruled(speed_mps, *, rests, every_s=1.5, count=5):
        record, found = FixRecord(agreed=9), None
        for k in range(count):
            off_m = np.array([40.0 + speed_mps * every_s * k, 0.0])
            given = ComparedFix(every_s * k, off_m, np.eye(2), np.eye(2), rests, False, 0.0)
            record, found = record.at_fix(given, WAITS)
        return found.ruling

    assert ruled(4.0, rests=True) is Ruling.CARRIED
    assert ruled(4.0, rests=False) is Ruling.OUTLIER
    assert ruled(2.0, rests=True) is Ruling.OUTLIER
    assert ruled(4.0, rests=True, every_s=1.0) is Ruling.OUTLIER
    assert ruled(4.0, rests=True, count=4, every_s=2.0) is Ruling.OUTLIER
    assert ruled(0.0, rests=True, every_s=8.0) is Ruling.ANEW


@pytest.mark.parametrize("layout", [RECKONED, MOVING])
@pytest.mark.parametrize(("before_m", "now_m"), [(3.0, 5.0), (5.0, 3.0), (4.0, 4.0)])
def test_what_lasts_follows_what_fixes_state(layout, before_m, now_m):
    """Smaller errors shrink, larger ones have more that is new; the position stays as it is."""
    size = extended_layout(layout).size
    where, of = [layout.east, layout.north], [layout.size, layout.size + 1]
    transition, noise, shift = rescaled(layout, size, before_m, now_m)
    covariance = np.eye(size) * 7.0
    for east, place in zip(where, of, strict=True):
        covariance[east, place] = covariance[place, east] = 7.0
        covariance[place, place] = 7.0 + before_m**2
    after = transition @ covariance @ transition.T + noise
    np.testing.assert_allclose(
        after[: layout.size, : layout.size], covariance[: layout.size, : layout.size]
    )
    for east, place in zip(where, of, strict=True):
        lasting_m2 = after[place, place] + after[east, east] - 2 * after[east, place]
        assert lasting_m2 == pytest.approx(now_m**2)
    assert not shift.any()


def test_a_belief_begins_anew_at_a_fix_with_its_errors():
    """The position is off by what lasts and by white noise, the place that fixes are of by this."""
    options = KalmanFilter(fix_lasting_share=0.5)
    steps = [MotionStep(1.0, 0.0)] * 40
    far = [fix_at(complex(k + 1.0, 300.0 * (k >= 5))) for k in range(40)]
    *_, state = followed(far[:36], steps[:36], options=options)
    covariance = state.belief.moments.covariance
    assert state.fixes.record.agreed == 0
    assert covariance[0, 0] == pytest.approx(25.0)
    assert covariance[0, 5] == covariance[5, 5] == pytest.approx(12.5)
    assert state.belief.moments.mean[[0, 5]] == pytest.approx(EAST + 36.0)


def test_an_outlier_is_told():
    tracker = KalmanFilter().over_sites(CellPlan("EPSG:32629", ()))
    rng, told = np.random.default_rng(0), []
    steps, way = straight(rng, 30)
    state = tracker.begin({"gnss", "motion"})
    for k, step in enumerate(steps):
        place = way[k] + (90.0 if k == 20 else 0.0)
        state, out = tracker.step(state, Epoch(float(k), (step,), gnss=fix_at(place)), rng)
        told.append((out.fix.reason, [one.reason for one in out.unused if one.kind == "gnss"]))
    rejected = Reason.REJECTED_BY_EVIDENCE
    assert told[20] == (rejected, [rejected])
    assert {reason for reason, _ in told[:20] + told[21:]} == {Reason.USED}
    assert not any(unused for _, unused in told[:20] + told[21:])


def test_who_begins_anew_again_and_again_is_lost():
    """Steps a twentieth of the way: no belief that they move agrees with the fixes for long."""
    rng = np.random.default_rng(12)
    steps, way = straight(rng, 300)
    seen = 20 * way + errors(rng, 300, 3.0)
    fixes = [fix_at(one) if k < 120 else None for k, one in enumerate(seen)]
    *_, statuses, _, _ = followed(fixes, steps)
    assert set(statuses[20:]) == {Status.LOST}


def test_a_belief_is_settled_after_ten_fixes_that_agree():
    one, record = np.eye(2), FixRecord(begun=2)
    for k in range(10):
        assert record.is_lost
        fix = ComparedFix(float(k), np.zeros(2), one, one, False, False, 0.0)
        record, _ = record.at_fix(fix, WAITS)
    assert (record.begun, record.is_lost) == (0, False)


@pytest.mark.parametrize("every_s", [61, 90, 300])
def test_fixes_far_apart_show_a_way_that_no_step_counted(every_s):
    rng = np.random.default_rng(13)
    count = 700 + 4 * every_s
    steps, way = straight(rng, count)
    way[400:] += 800.0j
    seen = way + errors(rng, count)
    fixes = [fix_at(p) if k < 300 or k % every_s == 0 else None for k, p in enumerate(seen)]
    places, radii_m, statuses, _, _ = followed(fixes, steps)
    off_m, seen_s = np.abs(places - way), 400 + every_s
    # The first of them may be an outlier as well: the radius covers both places.
    assert (off_m <= radii_m)[seen_s : seen_s + every_s].all()
    assert off_m[seen_s + 3 * every_s :].max() < 80.0
    assert Status.LOST not in statuses


@pytest.mark.parametrize("fault", ["no turns", "half as fast"])
def test_fixes_of_a_winding_drive_are_not_rejected_for_ever(fault):
    """Beside steps that are wrong they lie on no line, but on a smooth way."""
    rng = np.random.default_rng(14)
    heading = np.cumsum(np.where(np.arange(700) % 15 < 3, 0.5, 0.0) * np.resize([1, 1, -1], 700))
    way = np.cumsum(10.0 * np.exp(1j * heading))
    turned = 0.0 if fault == "no turns" else 1.0
    speed_mps = 5.0 if fault == "half as fast" else 10.0
    measured = np.where(
        np.arange(700) < 200, heading, heading[200] + turned * (heading - heading[200])
    )
    steps = [
        MotionStep(10.0 if k < 200 else speed_mps, float(np.angle(np.exp(1j * one))))
        for k, one in enumerate(measured + rng.normal(0, 0.05, 700))
    ]
    fixes = [fix_at(one) for one in way + errors(rng, 700)]
    places, _, statuses, _, _ = followed(fixes, steps)
    off_m = np.abs(places - way)[200:]
    claimed = np.array([one is Status.TRACKING for one in statuses])[200:]
    assert np.median(off_m) < 120.0
    assert off_m[claimed].max() < 60.0


def test_fixes_of_two_kinds_in_turn():
    """Stated as 3 and 30 m, as they are: the coarse ones do not widen what lasts at once."""
    held, radii = [], []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        steps, way = straight(rng, 300)
        sd_m = np.where(np.arange(300) % 2 == 0, 3.0, 30.0)
        noise = errors(rng, 300, 1.0) * sd_m
        fixes = [fix_at(p, s) for p, s in zip(way + noise, sd_m.tolist(), strict=True)]
        places, radii_m, _, _, _ = followed(fixes, steps)
        held.append((np.abs(places - way) <= radii_m)[60:].mean())
        radii.append(np.median(radii_m[60:]))
    assert np.mean(held) > 0.95
    assert max(radii) < 8.0


def test_a_fix_far_from_a_rest_in_doubt_covers_both_places():
    """Steps are no longer counted, and levels change: LOST, until a fix comes 140 m away."""
    lost = 0
    for seed in (2, 3):
        rng, level_db = np.random.default_rng(seed), np.zeros(4)
        tracker = KalmanFilter().over_sites(CellPlan("EPSG:32629", ()))
        steps, way = straight(rng, 420)
        steps[150:] = [replace(one, step_m=0.0) for one in steps[150:]]
        state = tracker.begin({"gnss", "motion", "serving", "neighbour"})
        found = []
        for k, step in enumerate(steps):
            # Shadows of 7 dB that last for 60 m.
            level_db = 0.977 * level_db + rng.normal(0, 1.5, 4)
            heard = tuple(
                ReportRow("neighbour" if i else "serving", f"c{i}", None, None, level, 0)
                for i, level in enumerate(level_db + rng.normal(0, 3, 4) - 80.0)
            )
            fix = fix_at(way[k] + errors(rng, 1)[0]) if k < 100 or k == 250 else None
            state, out = tracker.step(state, Epoch(float(k), (step,), radio=heard, gnss=fix), rng)
            off_m = abs(complex(out.fix.east_m - EAST, out.fix.north_m - NORTH) - way[k])
            found.append((off_m, out.fix.radii_m[2], out.fix.status))
        lost += found[249][2] is Status.LOST
        assert all(off_m <= radius_m for off_m, radius_m, _ in found[250:255])
    assert lost >= 1


@pytest.mark.parametrize(("speed_mps", "every_s"), [(1.0, 1), (2.0, 1), (9.0, 10)])
def test_a_ride_without_steps_is_followed(speed_mps, every_s):
    """An escalator, a lift, a tram: fixes go on, and steps stand still."""
    rng = np.random.default_rng(16)
    speeds = np.full(700, 1.4)
    speeds[200:300], speeds[300:340] = speed_mps, 0.0
    way = np.cumsum(speeds * np.exp(0.4j))
    steps = [
        MotionStep(0.0 if 200 <= k < 340 else 1.4, 0.4 + one)
        for k, one in enumerate(rng.normal(0, 0.1, 700).tolist())
    ]
    seen = way + errors(rng, 700)
    fixes = [fix_at(one) if k % every_s == 0 else None for k, one in enumerate(seen)]
    places, _, statuses, _, _ = followed(fixes, steps)
    off_m = np.abs(places - way)
    assert np.median(off_m[260:340]) < 25.0
    assert off_m[350:].max() < 40.0
    assert sum(one is Status.LOST for one in statuses) <= 40


def turning(rng, count, bias_degps, speed_mps=10.0):
    """Turns of a second by a gyroscope with a bias, and where the way leads."""
    turn = np.where(np.arange(count) % 40 == 20, np.pi / 2, 0.0) * rng.choice([-1, 1], count)
    way = np.cumsum(speed_mps * np.exp(1j * (0.4 + np.cumsum(turn) - turn / 2)))
    seen = turn + np.radians(bias_degps) + rng.normal(0, np.radians(0.3), count)
    return [MotionStep(speed_mps, np.nan, float(one)) for one in seen], way


@pytest.mark.parametrize("bias_degps", [2.0, -2.0])
def test_turns_that_lead_astray_are_believed_less(bias_degps):
    """They led away again each time, and the position stayed LOST, some 40 m off."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        steps, way = turning(rng, 600, bias_degps)
        seen = way + errors(rng, 600)
        fixes = [fix_at(one) if k % 5 == 0 else None for k, one in enumerate(seen)]
        places, radii_m, statuses, _, state = followed(fixes, steps)
        off_m = np.abs(places - way)[300:]
        assert np.median(off_m) < 8.0
        assert statuses[300:].count(Status.LOST) < 30
        assert (off_m <= radii_m[300:]).mean() > 0.9
        rate_degps = np.degrees(state.belief.moments.mean[4])
        assert rate_degps == pytest.approx(-bias_degps, abs=0.3)


def test_turns_that_lead_right_are_believed_as_before():
    """Bursts of outliers open none of their errors."""
    rng = np.random.default_rng(8)
    steps, way = turning(rng, 300, 0.0)
    seen = way + errors(rng, 300)
    seen[100:112] += 60.0
    _, _, _, _, state = followed([fix_at(one) for one in seen], steps)
    assert np.degrees(state.belief.moments.covariance[4, 4] ** 0.5) < 0.06
