"""Pauses of a recording, after which the first row tells of one interval alone."""

from dataclasses import replace
from math import isnan, nan, sqrt

import pytest

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.sensors.pace import Going, Pace
from mapfilter.positioning.sensors.pauses import RowTimes, longest_s, unrecorded_s
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.unmeasured import spread_m2
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.sensors.watching import watched

HEARD = (ReportRow("serving", "A", None, None, -70.0, False),)
ALWAYS = Pace(100.0, 100.0, 100, 1.0, rests=True, speed_mps=1.4, recent_mps=1.4, fastest_mps=2.0)
STEPS_ONLY = Pace(100.0, 100.0, 200, 0.5, 0.2, speed_mps=1.4, recent_mps=1.4, fastest_mps=3.0)
EVERY_2_S = RowTimes(100.0, 100.0, 2.0, 50)
STEP, NONE = Going(1.4, True, True), Going(0.0, False, False)


def test_times_of_rows():
    times = RowTimes()
    assert times.silent_s(50.0) == 0.0
    for time_s in (0.0, 4.0, 6.0):
        times = times.read(time_s, has_report=True)
    assert (times.epoch_s, times.report_s, times.interval_s, times.reports) == (6.0, 6.0, 3.0, 3)
    times = times.read(7.0, has_report=False)
    assert (times.epoch_s, times.report_s, times.interval_s, times.reports) == (7.0, 6.0, 3.0, 3)


def test_a_pause_soon_after_the_start_leaves_the_next_one_noticeable():
    times = RowTimes()
    for time_s in (0.0, 2.0, 4.0, 304.0, *(306.0 + 2.0 * k for k in range(8))):
        times = times.read(time_s, has_report=True)
    assert times.interval_s < 3.5
    assert times.silent_s(380.0) == 60.0


def test_reports_that_come_rarely_are_no_pauses():
    """Also where the first two came together."""
    times = RowTimes()
    for time_s in (0.0, 0.01, *(30.0 * k for k in range(1, 30))):
        assert times.silent_s(time_s) == 0.0
        times = times.read(time_s, has_report=True)
    assert times.interval_s > 25.0


def test_a_pause_changes_the_usual_interval_by_a_bounded_share():
    times = EVERY_2_S.read(100_000.0, has_report=True)
    assert times.interval_s == pytest.approx(2.0 + (10.0 - 2.0) / 20)
    assert times.read(100_000.0, has_report=True).interval_s == times.interval_s


@pytest.mark.parametrize(
    ("interval_s", "reports", "silent_s", "paused"),
    [
        (2.0, 50, 10.0, False),
        (2.0, 50, 10.5, True),
        (7.0, 50, 20.0, False),
        (7.0, 50, 22.0, True),
        (2.0, 9, 60.0, False),
        (2.0, 10, 60.0, True),
    ],
)
def test_a_recording_is_silent_beyond_ten_seconds_and_three_intervals(
    interval_s, reports, silent_s, paused
):
    times = RowTimes(100.0, 99.0, interval_s, reports)
    assert times.silent_s(100.0 + silent_s) == (silent_s if paused else 0.0)


def test_a_step_after_rows_that_come_always_tells_of_one_interval():
    never = RowTimes()
    assert unrecorded_s(ALWAYS, never, 130.0, STEP, 100.0, rested=False) == 29.0
    # No longer than five seconds are usual.
    assert unrecorded_s(ALWAYS, never, 105.0, STEP, 100.0, rested=False) == 0.0
    # Motion rows alone are missing: that is told at the epochs between.
    assert unrecorded_s(ALWAYS, never, 130.0, NONE, 100.0, rested=False) == 0.0


@pytest.mark.parametrize(("gone_m", "missing"), [(2.0, True), (2.1, False), (42.0, False)])
def test_a_row_longer_than_any_before_covers_the_pause(gone_m, missing):
    going = Going(gone_m, True, True)
    found_s = unrecorded_s(ALWAYS, RowTimes(), 130.0, going, 100.0, rested=False)
    assert found_s == (29.0 if missing else 0.0)


def test_a_row_that_is_as_far_as_the_usual_speed_covers_the_pause():
    drive = Pace(100.0, 100.0, 100, 1.0, rests=True, speed_mps=5.0, fastest_mps=40.0)
    for gone_m, missing_s in ((40.0, 0.0), (2.0, 9.0)):
        going = Going(gone_m, True, True)
        assert unrecorded_s(drive, RowTimes(), 110.0, going, 100.0, rested=False) == missing_s


@pytest.mark.parametrize(
    ("speed_mps", "after_s", "gone_m", "missing_s"),
    [
        # Of ten seconds a row covers five, and no more than five may lack; so it is at 0.8 m/s.
        (5.0, 10.0, 25.0, 0.0), (5.0, 10.0, 24.9, 9.0), (0.8, 7.0, 1.6, 0.0), (0.8, 7.0, 1.5, 6.0),
        # Who has stood so far covers nothing.
        (0.0, 7.0, 1.5, 6.0),
    ],
)  # fmt: skip
def test_what_a_row_covers_of_a_pause(speed_mps, after_s, gone_m, missing_s):
    pace = Pace(100.0, 100.0, 100, 1.0, rests=True, speed_mps=speed_mps, fastest_mps=40.0)
    going = Going(gone_m, True, True)
    assert unrecorded_s(pace, RowTimes(), 100.0 + after_s, going, 100.0, rested=False) == missing_s


def test_whoever_rests_before_and_after_a_pause_has_rested():
    rest = Going(0.0, True, False)
    assert unrecorded_s(ALWAYS, EVERY_2_S, 500.0, rest, 100.0, rested=True) == 0.0
    assert unrecorded_s(ALWAYS, EVERY_2_S, 500.0, rest, 100.0, rested=False) == 399.0
    assert unrecorded_s(ALWAYS, EVERY_2_S, 500.0, STEP, 100.0, rested=True) == 399.0


@pytest.mark.parametrize(
    ("at_rest_s", "speed_mps", "longest"),
    [(3.0, 1.4, 5.0), (10.0, 1.4, 15.0), (10.0, 2.5, 15.0), (10.0, 2.6, 5.0), (40.0, 1.4, 30.0)],
)
def test_rows_of_a_walker_may_come_less_often_at_rest(at_rest_s, speed_mps, longest):
    """The next one is missing after one and a half intervals, and after 30 s in any case."""
    pace = replace(ALWAYS, at_rest_s=at_rest_s, speed_mps=speed_mps)
    assert longest_s(pace) == longest
    assert longest_s(replace(pace, interval_s=20.0)) == 60.0


def test_a_walker_whose_rows_are_rarer_at_rest_stays_where_the_rest_is():
    """The first rest shows how often they come. Rows that end are missing all the same."""
    watch, found = SensorWatch(), {}
    rows = [(float(k), 1.4) for k in range(60)] + [(68.0 + 10 * k, 0.0) for k in range(4)]
    rows += [(100.0 + k, 1.4) for k in range(60)] + [(168.0 + 10 * k, 0.0) for k in range(4)]
    rows += [(208.0 + k, 1.4) for k in range(60)]
    steps = dict(rows)
    for time_s in sorted({*steps, *(3.0 * k for k in range(100))}):
        row = (MotionStep(steps[time_s], 0.0),) if time_s in steps else ()
        watch, _, (why, _) = watched(watch, Epoch(time_s, row, HEARD if time_s % 3 == 0 else ()))
        found[time_s] = why
    missing_s = [time_s for time_s, why in found.items() if why is Reason.MOTION_MISSING]
    assert missing_s[:2] == [66.0, 75.0]
    assert [time_s for time_s in missing_s if time_s > 90.0] == [285.0, 288.0, 291.0, 294.0, 297.0]


def test_a_pedometer_pauses_only_where_reports_do():
    """It has no rows at rest, but a modem goes on."""
    heard = EVERY_2_S._replace(epoch_s=158.0)
    assert unrecorded_s(STEPS_ONLY, heard, 160.0, STEP, 100.0, rested=True) == 0.0
    assert unrecorded_s(STEPS_ONLY, EVERY_2_S, 160.0, STEP, 100.0, rested=True) == 59.5
    assert unrecorded_s(STEPS_ONLY, EVERY_2_S, 160.0, NONE, 100.0, rested=False) == 60.0


def test_the_way_of_a_pause_is_put_before_the_step_after_it():
    watch = SensorWatch(ALWAYS, moving_s=100.0, known_s=100.0, times=EVERY_2_S)
    step = MotionStep(1.4, 0.3)
    watch, seen, (why, _) = watched(watch, Epoch(161.0, (step,), HEARD))
    assert why is Reason.MOTION_MISSING
    way, kept = seen.motion
    assert kept is step
    assert way.step_m == pytest.approx(60 * 1.4)
    assert way.spread_m == pytest.approx(sqrt(spread_m2(1.4, 60.0)))
    assert isnan(way.heading_rad)
    assert way.turned_sd_rad == pytest.approx(sqrt(2.0))
    assert (watch.moving_s, watch.known_s, watch.unmeasured_s, watch.rest) == (161, 161, 0.0, None)
    assert watch.times.epoch_s == 161.0
    watch, seen, (why, _) = watched(watch, Epoch(162.0, (step,)))
    assert (why, seen.motion) == (Reason.USED, (step,))


def test_what_is_in_the_belief_already_is_not_added_again():
    """Epochs with reports alone have told of the first 40 s, and the step tells of the last."""
    told = SensorWatch(ALWAYS, 100.0, 140.0, Rest(100.0), 40.0, times=EVERY_2_S)
    _, seen, _ = watched(told._replace(times=RowTimes()), Epoch(145.0, (MotionStep(1.4, 0.3),)))
    way, _ = seen.motion
    assert way.step_m == pytest.approx(4 * 1.4)
    assert way.spread_m**2 == pytest.approx(spread_m2(1.4, 44.0) - spread_m2(1.4, 40.0))


def test_a_report_alone_after_a_pause_leaves_the_direction_open():
    watch = SensorWatch(STEPS_ONLY, 100.0, 100.0, times=EVERY_2_S)
    watch, seen, (why, _) = watched(watch, Epoch(130.0, (), HEARD))
    assert (why, watch.unmeasured_s) == (Reason.MOTION_MISSING, 30.0)
    (way,) = seen.motion
    assert way.step_m == pytest.approx(30 * 1.4)
    # It then goes on from there.
    watch, seen, (why, _) = watched(watch, Epoch(132.0, (), HEARD))
    assert (why, seen.motion) == (Reason.USED, ())


def test_who_is_carried_on_after_a_pause_goes_on_from_its_end():
    """No step follows the pause, and levels show after 70 s that the phone is carried."""
    watch = SensorWatch(STEPS_ONLY, 100.0, 100.0, times=EVERY_2_S)
    watch, _, _ = watched(watch, Epoch(400.0, (), HEARD))
    watch, _, _ = watched(watch, Epoch(402.0, (), HEARD))
    assert watch.rest.since_s == 400.0
    rest = replace(watch.rest, carried_nats=6.0)
    carried = watch._replace(rest=rest, times=RowTimes())
    watch, seen, (why, _) = watched(carried, Epoch(470.0, (), HEARD))
    assert why is Reason.MOTION_MISSING
    (way,) = seen.motion
    assert way.step_m == pytest.approx(70 * 1.4)
    assert way.spread_m**2 == pytest.approx(spread_m2(1.4, 370.0) - spread_m2(1.4, 300.0))
    assert way.turned_sd_rad == pytest.approx(sqrt(2 * 70 / 60))
    assert (watch.known_s, watch.unmeasured_s) == (470.0, 370.0)


@pytest.mark.parametrize(("turn_rad", "sd_rad"), [(nan, sqrt(2 / 60)), (0.1, 0.0)])
def test_a_turn_that_was_measured_is_known(turn_rad, sd_rad):
    """Of a row without a length, of a vehicle."""
    watch = SensorWatch(ALWAYS, moving_s=100.0, known_s=100.0)
    _, seen, (why, _) = watched(watch, Epoch(101.0, (MotionStep(nan, nan, turn_rad),)))
    assert why is Reason.NO_STEP
    assert seen.motion[-1].turned_sd_rad == pytest.approx(sd_rad)


def test_of_a_pause_that_is_filled_up_the_rest_is_added():
    """Rows are missing for 20.5 s, of which 20 are in the belief, and the last tells of 0.1 s."""
    pace = replace(ALWAYS, interval_s=0.1)
    watch = SensorWatch(pace, 100.0, 120.0, unmeasured_s=20.0, moved_m=4.0)
    watch, seen, (why, _) = watched(watch, Epoch(120.5, (MotionStep(0.14, 0.0),)))
    missed, step = seen.motion
    assert (why, step.step_m) == (Reason.MOTION_MISSING, 0.14)
    assert missed.step_m == pytest.approx(1.4 * 0.4)
    # Both are of the way since the last report.
    assert watch.moved_m == pytest.approx(4.0 + 0.14 + 1.4 * 0.4)
