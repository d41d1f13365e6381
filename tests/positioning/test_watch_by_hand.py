"""What is known of motion rows and reports after each epoch, by hand."""

from dataclasses import replace
from itertools import pairwise
from math import exp, isnan, nan, sqrt

import pytest

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.positioning.sensors.pace import Pace
from mapfilter.positioning.sensors.repeats import MotionRepeats
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.unmeasured import spread_m2, unmeasured_step
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.sensors.watching import watched


def epoch(time_s, *lengths_m, radio=()):
    motion = tuple(MotionStep(step_m, 0.01 * time_s) for step_m in lengths_m)
    return Epoch(time_s, motion, radio)


def after(*epochs, watch=None, unit_m=1.0):
    watch = watch or SensorWatch()
    for one in epochs:
        watch, _, _ = watched(watch, one, unit_m)
    return watch


def begun(**pace):
    """Return the watch after a row at 0 s."""
    return SensorWatch(Pace(motion_s=0.0, **pace), moving_s=0.0, known_s=0.0)


def test_intervals_are_means_and_so_are_their_deviations():
    watch = after(epoch(10.0, 1.0), epoch(12.0, 1.0))
    assert (watch.pace.rows, watch.pace.motion_s) == (2, 12.0)
    assert (watch.moving_s, watch.known_s) == (12.0, 12.0)
    assert (watch.pace.interval_s, watch.pace.irregular_s) == (2.0, 0.0)
    watch = after(epoch(13.0, 1.0), watch=watch)
    # The second interval counts as much as the first, the third a third.
    assert watch.pace.interval_s == pytest.approx(1.5)
    assert watch.pace.irregular_s == pytest.approx(0.25)
    watch = after(epoch(16.0, 1.0), watch=watch)
    assert watch.pace.interval_s == pytest.approx(2.0)
    assert watch.pace.irregular_s == pytest.approx(0.25 + (1.0 - 0.25) / 3)


def test_a_gap_counts_as_five_intervals_once_ten_rows_are_known():
    usual = begun(rows=11, interval_s=1.0)
    assert after(epoch(100.0, 1.0), watch=usual).pace.interval_s == pytest.approx(1 + 4 / 11)
    few = begun(rows=10, interval_s=1.0)
    assert after(epoch(100.0, 1.0), watch=few).pace.interval_s == pytest.approx(1 + 99 / 10)
    many = begun(rows=500, interval_s=1.0)
    assert after(epoch(2.0, 1.0), watch=many).pace.interval_s == pytest.approx(1 + 1 / 20)


def test_the_speed_is_learnt_by_time():
    usual = begun(rows=100, interval_s=2.0, speed_mps=1.0)
    watch = after(epoch(2.0, 3.0, -1.0), watch=usual)
    assert watch.pace.speed_mps == pytest.approx(1.0 + 0.05 * (4.0 - 2.0) / 2.0)
    assert watch.moved_m == 4.0
    # At rest it stays.
    assert after(epoch(2.0, 0.0), watch=usual).pace.speed_mps == 1.0


@pytest.mark.parametrize(("length_m", "moves"), [(0.19, False), (0.21, True)])
def test_less_than_a_decimetre_a_second_is_a_rest(length_m, moves):
    usual = begun(rows=29, interval_s=2.0)
    watch = after(epoch(2.0, length_m), watch=usual)
    assert (watch.rest is None) == moves
    assert watch.moving_s == (2.0 if moves else 0.0)
    assert watch.pace.rests != moves
    # After a pause without rows, three intervals of the usual length count.
    late = after(epoch(60.0, 0.61), watch=usual)
    assert late.rest is None
    assert after(epoch(60.0, 0.59), watch=usual).rest is not None


@pytest.mark.parametrize(
    ("rows", "speed_mps", "unit_m", "recent_mps", "moves"),
    [
        (30, 1.4, 1.0, 0.41, False),
        (30, 1.4, 1.0, 0.43, True),
        (29, 1.4, 1.0, 0.41, True),
        (30, 2.6, 1.0, 0.41, True),
        # In feet: 0.3 of 4.6 feet a second.
        (30, 4.6, 0.3048, 1.37, False),
        (30, 4.6, 0.3048, 1.39, True),
        (30, 0.3, 1.0, 0.11, True),
    ],
)
def test_steps_far_shorter_than_a_walkers_before_may_be_missed_ones(
    rows, speed_mps, unit_m, recent_mps, moves
):
    usual = begun(rows=rows, interval_s=2.0, speed_mps=speed_mps, recent_mps=recent_mps)
    length_m = 2.0 * recent_mps
    watch, seen, _ = watched(usual, epoch(2.0, length_m), unit_m)
    assert (watch.rest is None) == moves
    # The way counts as it is measured, and a slow one is no rest that is reported.
    assert seen.motion[0].step_m == length_m
    assert watch.moved_m == length_m
    assert not watch.pace.rests
    if watch.rest is not None:
        assert watch.rest.measured_m == pytest.approx(length_m * unit_m)


@pytest.mark.parametrize(("recent_mps", "speed_mps"), [(0.69, 1.4), (0.71, 1.3655)])
def test_the_speed_of_a_walker_who_is_far_slower_is_not_learnt(recent_mps, speed_mps):
    usual = begun(rows=100, interval_s=2.0, recent_mps=recent_mps)
    watch = after(epoch(2.0, 2 * recent_mps), watch=usual)
    assert watch.pace.speed_mps == pytest.approx(speed_mps)


def test_the_recent_speed_is_the_mean_of_the_last_seconds_by_time():
    usual = begun(rows=100, interval_s=1.0)
    halves = after(epoch(0.5, 0.1), epoch(1.0, 0.1), watch=usual)
    assert halves.pace.recent_mps == pytest.approx(0.2 + 1.2 * exp(-1 / 2.5))
    assert after(epoch(1.0, 0.2), watch=usual).pace.recent_mps == pytest.approx(
        halves.pace.recent_mps
    )
    # Rows without a length say nothing of it.
    assert after(epoch(1.0, nan), epoch(1.5), watch=usual).pace.recent_mps == 1.4


def strolling(measured_m=59.5, **rest):
    """Return the watch of a stroll at a fifth of 1.5 m/s, since 0 s."""
    pace = Pace(100.0, 100.0, 100, 1.0, speed_mps=1.5, recent_mps=0.3)
    return SensorWatch(pace, 0.0, 100.0, Rest(0.0, pace_mps=1.5, measured_m=measured_m, **rest))


def test_a_stroll_of_60_m_that_levels_do_not_contradict_is_learnt():
    watch = after(epoch(101.0, 0.3), watch=strolling())
    assert (watch.moving_s, watch.rest.measured_m) == (0.0, pytest.approx(59.8))
    watch = after(epoch(102.0, 0.4), watch=watch)
    assert (watch.moving_s, watch.known_s, watch.rest) == (102.0, 102.0, None)
    assert watch.pace.speed_mps == pytest.approx((1.5 + 60.2 / 102.0) / 2)
    # In feet the same speeds are larger.
    feet = strolling()._replace(pace=replace(strolling().pace, speed_mps=4.5, recent_mps=0.9))
    watch = after(epoch(101.0, 2.0), watch=feet, unit_m=0.25)
    assert watch.pace.speed_mps == pytest.approx((4.5 + 60.0 / 0.25 / 101.0) / 2)


def test_the_speed_of_a_stroll_is_that_since_the_last_usual_step():
    watch = strolling()
    watch = after(epoch(102.0, 0.7), watch=watch._replace(rest=replace(watch.rest, since_s=40.0)))
    assert watch.pace.speed_mps == pytest.approx((1.5 + 60.2 / 62.0) / 2)


def test_steps_without_a_length_are_a_way_since_the_last_that_is_known():
    watch = begun(rows=10, interval_s=1.0)._replace(known_s=3.0, unmeasured_s=2.0)
    watch, seen, (why, _) = watched(watch, epoch(5.0, nan))
    assert why is Reason.NO_STEP
    assert (watch.known_s, watch.unmeasured_s) == (5.0, 4.0)
    *_, way = seen.motion
    assert way.step_m == pytest.approx(1.4 * 2.0)
    assert way.spread_m == pytest.approx(sqrt(spread_m2(1.4, 4.0) - spread_m2(1.4, 2.0)))


@pytest.mark.parametrize("gone_s", [0.0, 0.5, 61.0])
def test_who_is_found_to_be_carried_was_so_since_the_last_usual_step(gone_s):
    served = dict.fromkeys("ABCDE", 100.0)
    rest = Rest(101.0 - gone_s, pace_mps=1.5, carried_nats=5.9, served=served, measured_m=0.3)
    watch = strolling()._replace(moving_s=101.0 - gone_s, rest=rest)
    radio = (ReportRow("serving", "F", None, None, nan, 0),)
    watch, seen, (why, _) = watched(watch, epoch(101.0, 0.0, radio=radio))
    assert why is Reason.MOTION_STUCK
    assert watch.unmeasured_s == gone_s
    *_, way = seen.motion
    assert way.step_m == pytest.approx(max(1.5 * gone_s - 0.3, 0.0))
    # Carried on, it goes on from there.
    watch, seen, _ = watched(watch, epoch(103.0, 0.0))
    assert watch.unmeasured_s == gone_s + 2.0
    assert seen.motion[-1].step_m == pytest.approx(1.5 * 2.0)


def test_a_stroll_in_doubt_is_not_learnt():
    still = dict.fromkeys("ABCDE", (-700.0, 10))
    now = {cell: (-700.0 + 120.0 * (-1) ** k, 10) for k, cell in enumerate(still)}
    heard = {"block_s": 90.0, "began_s": 0.0, "first": still, "present": now, "is_doubtful": True}
    watch = after(epoch(101.0, 0.3), watch=strolling(60.0, **heard, still_nats=-9.0))
    assert watch.rest.is_doubtful
    assert (watch.moving_s, watch.pace.speed_mps) == (0.0, 1.5)


def test_what_the_counter_did_not_miss_is_no_unmeasured_way():
    """Of 1.5 m/s for 101 s a third is measured: the rest of the way is put in once."""
    watch = strolling(50.5, carried_nats=6.0)
    before = watch._replace(rest=replace(watch.rest, carried_nats=5.9, served={"A": 50.0}))
    before = before._replace(rest=replace(before.rest, served=dict.fromkeys("ABCDE", 100.0)))
    radio = (ReportRow("serving", "F", None, None, nan, 0),)
    watch, seen, (why, _) = watched(before, epoch(101.0, 0.0, radio=radio))
    assert why is Reason.MOTION_STUCK
    *_, way = seen.motion
    assert way.step_m == pytest.approx(1.5 * 101.0 - 50.5)
    assert way.spread_m == pytest.approx(sqrt(spread_m2(1.0, 101.0)))
    # From then on the counter is not believed, but for its turns.
    watch, seen, (why, _) = watched(watch, epoch(102.0, 0.3))
    turn, way = seen.motion
    assert (why, turn.step_m, turn.heading_rad) == (Reason.MOTION_STUCK, 0.0, 0.01 * 102.0)
    assert way.step_m == pytest.approx(1.5)
    assert watch.moved_m == pytest.approx(1.5)


def test_a_position_shows_a_stroll_but_no_counter_that_stands_still():
    watch = strolling(30.0).positioned(101.0)
    assert (watch.moving_s, watch.known_s, watch.rest) == (101.0, 101.0, None)
    assert strolling(0.5).positioned(101.0).moving_s == 101.0
    still = strolling(0.0)
    after = still.positioned(101.0)
    # But for the way to all sides, which a position ends.
    assert after == still._replace(undirected=still.undirected._replace(since_m=0.0))
    assert after.positioned(102.0) is after
    assert begun().positioned(101.0).moving_s == 0.0


def stepped(hz, step_m, stride_s, seconds, watch=None, from_s=0.0):
    """Follow a counter that is read so often; return the watches after each row."""
    watch, found, next_s = watch or SensorWatch(), [], from_s
    for row in range(1, round(seconds * hz) + 1):
        time_s, count = from_s + row / hz, 0
        while next_s <= time_s:
            next_s, count = next_s + stride_s, count + 1
        watch, _, _ = watched(watch, epoch(time_s, count * step_m))
        found.append(watch)
    return found


@pytest.mark.parametrize("hz", [1.0, 2.0, 2.5, 3.0, 3.4, 5.0, 10.0, 20.0])
@pytest.mark.parametrize("stride_s", [0.55, 0.7])
def test_a_speed_is_the_same_however_often_the_counter_is_read(hz, stride_s):
    usual = stepped(hz, 0.7, stride_s, 120.0)[-1]
    assert usual.pace.speed_mps == pytest.approx(0.7 / stride_s, rel=0.08)
    assert usual.pace.other_unit_m == 1.0
    # Half as fast is no pace of a counter that misses most steps; a tenth is.
    half = stepped(hz, 0.7, 2 * stride_s, 120.0, usual, 120.0)
    steps = [one for before, one in pairwise(half) if one.pace.stepped_s > before.pace.stepped_s]
    assert not any(one.rest is not None and one.rest.measured_m > 0 for one in steps)
    tenth = stepped(hz, 0.07, stride_s, 60.0, usual, 120.0)
    assert tenth[-1].rest.measured_m == pytest.approx(0.07 * 55 / stride_s, rel=0.15)
    assert tenth[-1].rest.pace_mps == pytest.approx(0.7 / stride_s, rel=0.15)


@pytest.mark.parametrize("hz", [1.0, 10.0])
def test_steps_in_feet_are_a_walkers_however_often_the_counter_is_read(hz):
    watch = stepped(hz, 0.7 / 0.3048, 0.55, 60.0)[-1]
    assert watch.pace.other_unit_m == 0.3048


@pytest.mark.parametrize(
    ("rows", "rests", "irregular_s", "always"),
    [(10, True, 1.0, True), (9, True, 0.0, False), (10, False, 0.019, True),
     (10, False, 0.021, False)],
)  # fmt: skip
def test_rows_that_come_at_rest_too(rows, rests, irregular_s, always):
    pace = Pace(rows=rows, rests=rests, interval_s=1.0, irregular_s=irregular_s)
    assert pace.reports_always == always


@pytest.mark.parametrize(
    ("interval_s", "gone_s", "why"),
    [
        (1.0, 5.0, Reason.USED),
        (1.0, 5.1, Reason.MOTION_MISSING),
        (2.0, 6.0, Reason.USED),
        (2.0, 6.1, Reason.MOTION_MISSING),
    ],
)
def test_rows_are_missing_after_five_seconds_and_three_intervals(interval_s, gone_s, why):
    watch = begun(rows=10, rests=True, interval_s=interval_s)
    watch, seen, (found, _) = watched(watch, epoch(gone_s))
    assert found is why
    assert bool(seen.motion) == (why is not Reason.USED)
    if why is Reason.USED:
        assert (watch.known_s, watch.unmeasured_s) == (0.0, 0.0)
        return
    assert (watch.known_s, watch.unmeasured_s) == (gone_s, gone_s)
    assert watch.moved_m == pytest.approx(1.4 * gone_s)
    (step,) = seen.motion
    assert step.spread_m == pytest.approx(sqrt(spread_m2(1.4, gone_s)))


def test_rows_are_missing_by_the_time_since_the_last_one_where_they_come_at_rest_too():
    pace = Pace(1000.0, 1000.0, 10, 1.0, rests=True)
    watch = SensorWatch(pace, moving_s=1000.0, known_s=1000.0)
    for time_s, why in ((1005.0, Reason.USED), (1005.1, Reason.MOTION_MISSING)):
        assert watched(watch, epoch(time_s))[2][0] is why
    never = watch._replace(pace=replace(pace, rests=False, irregular_s=1.0))
    assert watched(never, epoch(1100.0))[2][0] is Reason.USED


def test_nothing_is_known_before_the_first_row():
    watch = SensorWatch()
    assert (watch.unmeasured_s, watch.moved_m, watch.repeated_nats) == (0.0, 0.0, 0.0)
    assert (watch.rest, watch.report) == (None, ())
    before, seen, why = watched(watch, epoch(3.0))
    # From there on levels and positions tell whether it rests.
    assert (before.moving_s, before.known_s, before.rest.since_s) == (3.0, 3.0, 3.0)
    assert (before.unmeasured_s, before.moved_m, before.times.epoch_s) == (0.0, 0.0, 3.0)
    assert (seen, why) == (epoch(3.0), (Reason.USED, Reason.USED))
    unmeasured, seen, why = watched(SensorWatch(has_motion=False), epoch(3.0))
    assert why == (Reason.MOTION_MISSING, Reason.USED)
    later, seen, why = watched(unmeasured, epoch(5.0))
    assert why == (Reason.MOTION_MISSING, Reason.USED)
    assert seen.motion == (unmeasured_step(1.4, 0.0, 2.0),)
    assert later.unmeasured_s == 2.0
    # The first row may be one of a rest.
    rests = after(epoch(3.0, 0.0), watch=watch)
    assert (rests.moving_s, rests.known_s, rests.rest.since_s) == (3.0, 3.0, 3.0)


def test_a_step_ends_what_was_not_measured():
    watch = begun(rows=10, interval_s=1.0)._replace(unmeasured_s=9.0, rest=Rest(0.0))
    watch = after(epoch(1.0, 1.0), watch=watch)
    assert (watch.unmeasured_s, watch.rest, watch.known_s) == (0.0, None, 1.0)


def test_a_heading_that_stands_still_is_replaced_by_a_way_to_all_sides():
    stuck = MotionRepeats(last=(1.0, 0.02, nan), rows=60.0, nats=12.0, fine=30)
    watch, seen, (why, _) = watched(begun(rows=1)._replace(repeats=stuck), epoch(2.0, 1.1))
    assert why is Reason.HEADING_STUCK
    (step,) = seen.motion
    assert step.step_m == 1.1
    assert isnan(step.heading_rad)
    assert step.spread_m == pytest.approx(1.1, rel=0.01)
    assert watch.repeats.still_m == 1.1
    usual = epoch(2.0, 1.1)
    assert watched(begun(rows=1), usual)[1] is usual


def test_the_spread_of_a_way_that_forgets_its_direction_within_a_minute():
    for time_s in (0.0, 1.0, 60.0, 600.0):
        expected = 2 * 1.5**2 * 60 * (time_s - 60 * (1 - exp(-time_s / 60)))
        assert spread_m2(1.5, time_s) == pytest.approx(expected)
    assert spread_m2(1.5, 1.0) == pytest.approx(1.5**2, rel=0.01)


def test_the_fastest_row_counts_its_time_or_the_usual_interval():
    usual = begun(rows=2, interval_s=2.0)
    for time_s, fastest_mps in ((4.0, 2.0), (2.0, 4.0), (0.5, 4.0)):
        assert after(epoch(time_s, 5.0, -3.0), watch=usual).pace.fastest_mps == fastest_mps
    # The first two rows have no usual interval, and unknown lengths no speed.
    assert after(epoch(0.1, 8.0), watch=begun(rows=1, interval_s=2.0)).pace.fastest_mps == 0.0
    assert after(epoch(4.0, 8.0, nan), watch=usual).pace.fastest_mps == 2.0
    fast = begun(rows=2, interval_s=2.0, fastest_mps=7.0)
    assert after(epoch(4.0, 8.0), watch=fast).pace.fastest_mps == 7.0


def report(*levels_dbm, **more):
    return tuple(
        ReportRow("neighbour", cell, None, None, level, 0, **more)
        for cell, level in zip("ABCDE", levels_dbm, strict=False)
    )


@pytest.mark.parametrize(
    ("levels", "way_m", "nats"),
    [(1, 10.0, 1.2), (1, 100.0, 1.9), (2, 5.0, 1.2), (2, 100.0, 1.9), (3, 5.0, 1.8),
     (3, 100.0, 2.7), (5, 5.0, 1.8), (5, 100.0, 2.7)],
)  # fmt: skip
def test_a_repeated_report_gains_by_levels_and_metres(levels, way_m, nats):
    rows = report(*[-70.0 - k for k in range(levels)])
    watch = after(epoch(0.0, 1.0, radio=rows), epoch(10.0, way_m, radio=rows))
    assert watch.repeated_nats == pytest.approx(nats)
    assert watch.moved_m == 0.0
    feet = after(epoch(0.0, 1.0, radio=rows), epoch(10.0, way_m, radio=rows), unit_m=0.25)
    assert feet.repeated_nats == pytest.approx(min(0.25 * 0.12 * min(levels, 3) * way_m, nats))


def test_a_repeated_report_without_levels_ends_the_sum():
    rows = (ReportRow("serving", "A", None, None, nan, 0),)
    heard = SensorWatch(report=rows, repeated_nats=3.0, moved_m=5.0)
    assert after(epoch(1.0, radio=rows), watch=heard).repeated_nats == 0.0


def test_any_difference_makes_a_report_another():
    rows = report(-70.0, -80.0)
    others = [
        report(-70.0), report(-70.0, -81.0), report(-70.0, -80.0, timing_advance=3.0),
        (rows[0], replace(rows[1], cell="C")), (rows[0], replace(rows[1], role="serving")),
        (rows[0], replace(rows[1], arfcn=5)), (rows[0], replace(rows[1], bsic=5)),
        (rows[0], replace(rows[1], censored=1)), (rows[0], replace(rows[1], level_dbm=nan)),
    ]  # fmt: skip
    heard = SensorWatch(report=rows, repeated_nats=3.0, moved_m=5.0)
    for other in others:
        assert after(epoch(1.0, radio=other), watch=heard).repeated_nats == 0.0
    again = after(epoch(1.0, radio=tuple(replace(one) for one in rows)), watch=heard)
    assert again.repeated_nats == pytest.approx(3.0 + 2 * 0.12 * 5.0)


@pytest.mark.parametrize(("before", "stale"), [(6.7, False), (6.8, True), (6.9, True)])
def test_eight_nats_make_a_radio_stale(before, stale):
    rows = report(-70.0)
    heard = SensorWatch(report=rows, repeated_nats=before, moved_m=10.0)
    watch, seen, (_, why) = watched(heard, epoch(1.0, radio=rows))
    assert (why is Reason.STALE_RADIO) == stale
    assert seen.radio == (() if stale else rows)
    # Without a report nothing is stale.
    _, seen, (_, why) = watched(watch._replace(repeated_nats=99.0), epoch(2.0))
    assert why is Reason.USED


def placed(watch, *times_s, mps=10.0, step_m=0.0, begin_s=0.0):
    """Follow a phone that positions show on its way to the east, whatever its counter does."""
    for time_s in times_s:
        fix = GnssFix(mps * (time_s - begin_s), 0.0)
        row = Epoch(time_s, (MotionStep(step_m, 0.01 * time_s),), gnss=fix)
        watch, seen, (why, _) = watched(watch, row)
    return watch, seen, why


def test_positions_that_go_on_show_where_the_ride_began():
    """Four intervals and eight seconds; the counter misses most of it."""
    usual = begun(rows=100, interval_s=1.0, speed_mps=1.4)
    watch, _, why = placed(usual, 2.0, 4.0, 6.0, 8.0, step_m=0.1)
    assert (why, watch.moving_s, watch.rest.is_carried) == (Reason.USED, 0.0, False)
    assert watch.rest.measured_m == pytest.approx(0.4)
    watch, seen, why = placed(watch, 10.0, step_m=0.1)
    # Before the first of them the way is measured.
    assert (why, watch.moving_s, watch.rest.since_s) == (Reason.MOTION_STUCK, 2.0, 2.0)
    assert (watch.rest.carried_mps, watch.rest.measured_m) == (pytest.approx(10.0), 0.0)
    assert (watch.known_s, watch.unmeasured_s) == (10.0, 8.0)
    assert seen.motion[-1].step_m == pytest.approx(80.0)
    assert len(watch.places.rows) == 5


def test_a_ride_that_levels_have_shown_has_its_speed_from_positions():
    usual = begun(rows=100, interval_s=1.0, speed_mps=1.4)
    carried = usual._replace(rest=Rest(0.0, carried_nats=6.0, pace_mps=1.4))
    watch, seen, _ = placed(carried, 2.0, 4.0, 6.0, 8.0, 10.0)
    # Since the last usual step; the speed of the last two seconds alone is new.
    assert (watch.moving_s, watch.rest.since_s) == (0.0, 0.0)
    assert watch.rest.carried_mps == pytest.approx(10.0)
    assert (watch.known_s, watch.unmeasured_s) == (10.0, 10.0)
    assert seen.motion[-1].step_m == pytest.approx(20.0)


def test_no_report_is_one_after_a_ride():
    assert not after(epoch(3.0), epoch(4.0, 1.0)).rode_unheard
