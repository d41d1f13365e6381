"""What is known of motion rows and reports after each epoch, by hand."""

from dataclasses import replace
from math import exp, nan, sqrt

import pytest

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.bayes.sensors import SensorWatch, spread_m2, watched
from mapfilter.positioning.epochs import Epoch, ReportRow


def epoch(time_s, *lengths_m, radio=()):
    motion = tuple(MotionStep(step_m, 0.01 * time_s) for step_m in lengths_m)
    return Epoch(time_s, motion, radio)


def after(*epochs, watch=None, unit_m=1.0):
    watch = watch or SensorWatch()
    for one in epochs:
        watch, _, _ = watched(watch, one, unit_m)
    return watch


def test_intervals_are_means_and_so_are_their_deviations():
    watch = after(epoch(10.0, 1.0), epoch(12.0, 1.0))
    assert (watch.rows, watch.motion_s, watch.moving_s, watch.known_s) == (2, 12.0, 12.0, 12.0)
    assert (watch.interval_s, watch.irregular_s) == (2.0, 0.0)
    watch = after(epoch(13.0, 1.0), watch=watch)
    # The second interval counts as much as the first, the third a third.
    assert watch.interval_s == pytest.approx(1.5)
    assert watch.irregular_s == pytest.approx(0.25)
    watch = after(epoch(16.0, 1.0), watch=watch)
    assert watch.interval_s == pytest.approx(2.0)
    assert watch.irregular_s == pytest.approx(0.25 + (1.0 - 0.25) / 3)


def test_a_gap_counts_as_five_intervals_once_ten_rows_are_known():
    usual = SensorWatch(motion_s=0.0, rows=11, interval_s=1.0, moving_s=0.0, known_s=0.0)
    assert after(epoch(100.0, 1.0), watch=usual).interval_s == pytest.approx(1 + 4 / 11)
    few = replace(usual, rows=10)
    assert after(epoch(100.0, 1.0), watch=few).interval_s == pytest.approx(1 + 99 / 10)
    many = replace(usual, rows=500)
    assert after(epoch(2.0, 1.0), watch=many).interval_s == pytest.approx(1 + 1 / 20)


def test_the_speed_is_learnt_by_time():
    usual = SensorWatch(
        motion_s=0.0, rows=100, interval_s=2.0, moving_s=0.0, known_s=0.0, speed_mps=1.0
    )
    watch = after(epoch(2.0, 3.0, -1.0), watch=usual)
    assert watch.speed_mps == pytest.approx(1.0 + 0.05 * (4.0 - 2.0) / 2.0)
    assert watch.moved_m == 4.0
    # At rest it stays.
    assert after(epoch(2.0, 0.0), watch=usual).speed_mps == 1.0


@pytest.mark.parametrize(("length_m", "moves"), [(0.19, False), (0.21, True)])
def test_less_than_a_decimetre_a_second_is_a_rest(length_m, moves):
    usual = SensorWatch(motion_s=0.0, rows=29, interval_s=2.0, moving_s=0.0, known_s=0.0)
    watch = after(epoch(2.0, length_m), watch=usual)
    assert (watch.rest is None) == moves
    assert watch.moving_s == (2.0 if moves else 0.0)
    assert watch.rests != moves
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
    usual = SensorWatch(motion_s=0.0, rows=rows, interval_s=2.0, moving_s=0.0, known_s=0.0)
    usual = replace(usual, speed_mps=speed_mps, recent_mps=recent_mps)
    length_m = 2.0 * recent_mps
    watch, seen, _ = watched(usual, epoch(2.0, length_m), unit_m)
    assert (watch.rest is None) == moves
    # The way counts as it is measured, and a slow one is no rest that is reported.
    assert seen.motion[0].step_m == length_m
    assert watch.moved_m == length_m
    assert not watch.rests
    if watch.rest is not None:
        assert watch.rest.measured_m == pytest.approx(length_m * unit_m)


@pytest.mark.parametrize(("recent_mps", "speed_mps"), [(0.69, 1.4), (0.71, 1.3655)])
def test_the_speed_of_a_walker_who_is_far_slower_is_not_learnt(recent_mps, speed_mps):
    usual = SensorWatch(motion_s=0.0, rows=100, interval_s=2.0, moving_s=0.0, known_s=0.0)
    watch = after(epoch(2.0, 2 * recent_mps), watch=replace(usual, recent_mps=recent_mps))
    assert watch.speed_mps == pytest.approx(speed_mps)


def test_the_recent_speed_is_the_mean_of_the_last_seconds_by_time():
    usual = SensorWatch(motion_s=0.0, rows=100, interval_s=1.0, moving_s=0.0, known_s=0.0)
    halves = after(epoch(0.5, 0.1), epoch(1.0, 0.1), watch=usual)
    assert halves.recent_mps == pytest.approx(0.2 + 1.2 * exp(-1 / 2.5))
    assert after(epoch(1.0, 0.2), watch=usual).recent_mps == pytest.approx(halves.recent_mps)
    # Rows without a length say nothing of it.
    assert after(epoch(1.0, nan), epoch(1.5), watch=usual).recent_mps == 1.4


@pytest.mark.parametrize(
    ("rows", "rests", "irregular_s", "always"),
    [(10, True, 1.0, True), (9, True, 0.0, False), (10, False, 0.019, True),
     (10, False, 0.021, False)],
)  # fmt: skip
def test_rows_that_come_at_rest_too(rows, rests, irregular_s, always):
    watch = SensorWatch(rows=rows, rests=rests, interval_s=1.0, irregular_s=irregular_s)
    assert watch.reports_always == always


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
    watch = SensorWatch(
        motion_s=0.0, rows=10, rests=True, interval_s=interval_s, moving_s=0.0, known_s=0.0
    )
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


def test_the_spread_of_a_way_that_forgets_its_direction_within_a_minute():
    for time_s in (0.0, 1.0, 60.0, 600.0):
        expected = 2 * 1.5**2 * 60 * (time_s - 60 * (1 - exp(-time_s / 60)))
        assert spread_m2(1.5, time_s) == pytest.approx(expected)
    assert spread_m2(1.5, 1.0) == pytest.approx(1.5**2, rel=0.01)


def test_the_fastest_row_counts_its_time_or_the_usual_interval():
    usual = SensorWatch(motion_s=0.0, rows=2, interval_s=2.0, moving_s=0.0, known_s=0.0)
    for time_s, fastest_mps in ((4.0, 2.0), (2.0, 4.0), (0.5, 4.0)):
        assert after(epoch(time_s, 5.0, -3.0), watch=usual).fastest_mps == fastest_mps
    # The first two rows have no usual interval, and unknown lengths no speed.
    assert after(epoch(0.1, 8.0), watch=replace(usual, rows=1)).fastest_mps == 0.0
    assert after(epoch(4.0, 8.0, nan), watch=usual).fastest_mps == 2.0
    fast = replace(usual, fastest_mps=7.0)
    assert after(epoch(4.0, 8.0), watch=fast).fastest_mps == 7.0


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


def test_any_difference_makes_a_report_another():
    rows = report(-70.0, -80.0)
    others = [
        report(-70.0), report(-70.0, -81.0), report(-70.0, -80.0, timing_advance=3.0),
        (rows[0], replace(rows[1], cell="C")), (rows[0], replace(rows[1], role="serving")),
        (rows[0], replace(rows[1], arfcn=5)), (rows[0], replace(rows[1], bsic=5)),
        (rows[0], replace(rows[1], censored=1)), (rows[0], replace(rows[1], level_dbm=nan)),
    ]  # fmt: skip
    begun = SensorWatch(report=rows, repeated_nats=3.0, moved_m=5.0)
    for other in others:
        assert after(epoch(1.0, radio=other), watch=begun).repeated_nats == 0.0
    again = after(epoch(1.0, radio=tuple(replace(one) for one in rows)), watch=begun)
    assert again.repeated_nats == pytest.approx(3.0 + 2 * 0.12 * 5.0)


@pytest.mark.parametrize(("before", "stale"), [(6.7, False), (6.9, True)])
def test_eight_nats_make_a_radio_stale(before, stale):
    rows = report(-70.0)
    begun = SensorWatch(report=rows, repeated_nats=before, moved_m=10.0)
    watch, seen, (_, why) = watched(begun, epoch(1.0, radio=rows))
    assert (why is Reason.STALE_RADIO) == stale
    assert seen.radio == (() if stale else rows)
    # Without a report nothing is stale.
    _, seen, (_, why) = watched(replace(watch, repeated_nats=99.0), epoch(2.0))
    assert why is Reason.USED
