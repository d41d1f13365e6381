"""Motion rows that repeat others: each number of what is known of them, by hand."""

from dataclasses import replace
from math import exp, log, nan, radians, sqrt

import pytest

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.sensors.repeats import MotionRepeats, without_repeats


def after(*rows, repeats=None, unit_m=1.0):
    """What is known after rows of (time, step, heading, turn)."""
    repeats = repeats or MotionRepeats()
    for time_s, *step in rows:
        repeats, _, _ = without_repeats(repeats, time_s, (MotionStep(*step),), unit_m)
    return repeats


FINE = 0.123456789


def test_rows_and_repetitions_are_counted_once_a_run_has_ended():
    known = after((0.0, 0.7, FINE), (1.0, 0.8, FINE), (2.0, 0.9, FINE))
    assert (known.rows, known.repeats, known.run) == (51.0, 49.0, 2)
    assert known.run_m == pytest.approx(0.8 + 0.9)
    assert known.nats == pytest.approx(2 * -log(49 / 51))
    known = after((3.0, 0.7, 2 * FINE), repeats=known)
    assert (known.rows, known.repeats) == (54.0, 51.0)
    assert (known.run, known.run_m, known.nats, known.fine) == (0, 0.0, 0.0, 2)
    assert known.last[:2] == (0.7, 2 * FINE)


def test_a_repetition_gains_by_how_rare_it_was_and_at_most_one():
    for repeats, rows, gain in ((50.0, 100.0, log(2)), (1.0, 100.0, 1.0), (100.0, 100.0, 0.0)):
        known = MotionRepeats(last=(1.0, FINE, nan), rows=rows, repeats=repeats)
        assert after((0.0, 2.0, FINE), repeats=known).nats == pytest.approx(gain)


def test_the_way_of_a_run_is_in_metres_and_counts_backward_steps():
    assert after((0.0, 1.0, FINE), (1.0, -3.0, FINE), unit_m=0.3).run_m == pytest.approx(0.9)


@pytest.mark.parametrize(
    ("turn_rad", "run"),
    [(nan, 1), (0.0, 1), (1e-9, 1), (1.1e-9, 0), (-9e-10, 1), (-1.1e-9, 0)],
)
def test_a_gyroscope_that_turns_ends_a_run(turn_rad, run):
    assert after((0.0, 1.0, FINE, 0.0), (1.0, 1.5, FINE, turn_rad)).run == run


@pytest.mark.parametrize(
    ("heading_rad", "fine"),
    [(FINE, 1), (radians(12.34), 0), (radians(12.345), 1), (0.123, 0), (0.1235, 1), (nan, 0),
     (0.0, 0), (-radians(7.0), 0),
     # What is left by rounding, in hundredths of a degree and thousandths of a radian.
     (radians(12.34 + 0.9e-6), 0), (radians(12.34 + 1.1e-6), 1), (0.123 + 0.9e-7, 0),
     (0.123 + 1.1e-7, 1)],
)  # fmt: skip
def test_headings_of_hundredths_and_thousandths_are_coarse(heading_rad, fine):
    assert after((0.0, 1.0, heading_rad)).fine == fine


def test_a_heading_stands_still_at_twelve_nats_of_thirty_fine_rows():
    known = MotionRepeats(rows=100.0, nats=12.0, fine=30)
    assert known.stands_still
    assert not replace(known, nats=11.9).stands_still
    assert not replace(known, fine=29).stands_still


def test_a_heading_that_never_was_another_stands_still_after_a_way():
    known = MotionRepeats(rows=53.0, run=100, run_m=300.0, fine=1)
    assert known.stands_still
    for change in ({"rows": 54.0}, {"run": 99}, {"run_m": 299.9}, {"fine": 0}):
        assert not replace(known, **change).stands_still
    coarse = replace(known, fine=0, run_m=1500.0)
    assert coarse.stands_still
    assert not replace(coarse, run_m=1499.0).stands_still


def test_eight_pairs_that_come_sooner_are_deliveries():
    known = MotionRepeats(pairs=8, within_s=0.79, between_s=1.0)
    assert known.come_twice
    assert not replace(known, pairs=7).come_twice
    assert not replace(known, within_s=0.8).come_twice
    assert replace(known, within_s=1.59, between_s=2.0).come_twice


def test_second_deliveries_are_dropped_and_other_rows_stay():
    known = MotionRepeats(last=(1.0, FINE, 0.0), pairs=8, within_s=0.1, between_s=1.0, time_s=4.0)
    again, other = MotionStep(1.0, FINE, 0.0), MotionStep(1.2, FINE, 0.1)
    found, kept, why = without_repeats(known, 4.1, (again, other))
    assert (kept, why) == ((other,), Reason.DELIVERED_TWICE)
    assert (found.pairs, found.was_equal, found.last) == (9, False, (1.2, FINE, 0.1))
    assert without_repeats(known, 4.1, (other,))[1:] == ((other,), Reason.USED)


def test_nothing_repeats_before_the_first_row_and_lengths_are_metres_unless_stated():
    known = MotionRepeats()
    assert (known.rows, known.repeats, known.run, known.nats) == (50.0, 49.0, 0, 0.0)
    assert (known.pairs, known.was_equal, known.still_m, known.fine) == (0, False, 0.0, 0)
    known = replace(known, last=(1.0, FINE, nan))
    assert without_repeats(known, 1.0, (MotionStep(2.5, FINE),))[0].run_m == 2.5


def test_a_short_way_without_direction_spreads_by_its_length():
    stuck = MotionRepeats(last=(0.5, FINE, nan), rows=60.0, nats=12.0, fine=30)
    _, (step,), _ = without_repeats(stuck, 1.0, (MotionStep(0.5, FINE),))
    assert step.spread_m == pytest.approx(0.5, rel=0.01)


def test_pairs_are_counted_with_their_intervals():
    rows = [(0.0, 1.0, 0.1), (0.2, 1.0, 0.1), (1.0, 1.0, 0.2), (1.3, 1.0, 0.2), (2.0, 1.0, 0.3)]
    assert after(*rows[:2]).pairs == 1
    known = after(*rows)
    # A row that is no repetition after one that was goes on with the pairs.
    assert (known.pairs, known.was_equal, known.time_s) == (2, False, 2.0)
    assert known.within_s == pytest.approx(0.3)
    assert known.between_s == pytest.approx(0.7)
    # Two rows that differ, or three that are equal, end them.
    assert after((3.0, 1.0, 0.4), repeats=known).pairs == 0
    assert after(*rows[:2], (0.4, 1.0, 0.1)).pairs == 0


def test_unknown_numbers_are_equal_to_each_other_and_to_no_known_one():
    first = (0.0, 1.0, nan, 0.3)
    assert after(first, (1.0, 1.0, nan, 0.3)).was_equal
    for other in ((1.0, 0.3, 0.3), (1.0, nan, nan), (1.1, nan, 0.3)):
        assert not after(first, (1.0, *other)).was_equal


def test_rows_at_rest_and_without_a_length_pass():
    known = after((0.0, 1.0, FINE), (1.0, 1.0, FINE))
    for step in (MotionStep(0.0, FINE), MotionStep(nan, FINE)):
        assert without_repeats(known, 2.0, (step,)) == (known, (step,), Reason.USED)


def test_a_way_without_direction_spreads_by_what_it_gains():
    def square(way_m):
        return 2 * 84.0 * (way_m - 84.0 * (1 - exp(-way_m / 84.0)))

    stuck = MotionRepeats(
        last=(2.0, FINE, nan), rows=60.0, nats=12.0, fine=30, still_m=10.0, was_equal=True
    )
    steps = (MotionStep(-2.0, FINE), MotionStep(0.0, FINE), MotionStep(3.0, FINE))
    known, kept, why = without_repeats(stuck, 1.0, steps)
    assert why is Reason.HEADING_STUCK
    assert known.still_m == 15.0
    assert [step.step_m for step in kept] == [-2.0, 0.0, 3.0]
    assert kept[1] is steps[1]
    expected = [sqrt(square(12.0) - square(10.0)), sqrt(square(15.0) - square(12.0))]
    assert [kept[0].spread_m, kept[2].spread_m] == pytest.approx(expected)
    # A run in which the heading stood still is none of the usual ones.
    found = after((2.0, 1.0, 0.7), repeats=replace(known, run=500))
    assert (found.rows, found.repeats) == (61.0, known.repeats)
