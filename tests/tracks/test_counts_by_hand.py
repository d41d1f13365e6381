"""Steps of counters by hand: what counts they are, batches that come late, and long rows."""

import numpy as np
import pytest

from mapfilter.tracks.pdr.batches import parted, spread
from mapfilter.tracks.pdr.step_counts import are_own_counts, counted_steps

NAN = np.nan


@pytest.mark.parametrize(
    ("time_s", "counted", "expected", "batches"),
    [
        # Four steps or more, and more than three a second since the row before.
        (range(4), [0, 1, 0, 4], [0, 1, 2, 2], 1),
        (range(4), [0, 1, 0, 3], [0, 1, 0, 3], 0),
        ([0, 0.5, 1], [0, 0, 3.9], [0, 0, 3.9], 0),
        ([0, 2, 4], [0, 0, 6], [0, 0, 6], 0),
        ([0, 2, 4], [0, 0, 6.4], [0, 3.2, 3.2], 1),
        # After rows without a step, which are known.
        (range(4), [0, 0, 1, 8], [0, 0, 1, 8], 0),
        (range(4), [0, 0, NAN, 8], [0, 0, NAN, 8], 0),
        (range(2), [8, 0], [8, 0], 0),
        (range(2), [0, 8], [0, 8], 1),
        # Over the time since the last step, else since the first row.
        (range(6), [0, 2, 0, 0, 0, 8], [0, 2, 2, 2, 2, 2], 1),
        (range(5), [0, 0, 0, 0, 8], [0, 2, 2, 2, 2], 1),
        (range(7), [0, 0, 4, 0, 0, 0, 12], [0, 2, 2, 3, 3, 3, 3], 2),
        # After a rest over the last seconds, one for each step.
        (range(10), [0, 0, 0, 0, 0, 0, 0, 0, 0, 6], [0, 0, 0, 0, 1, 1, 1, 1, 1, 1], 1),
        ([0, 1, 2, 3, 4.5, 5.5], [0, 0, 0, 0, 0, 5], [0, 0.5, 1, 1, 1.5, 1], 1),
    ],
)
def test_batches_are_spread_over_the_rows_before(time_s, counted, expected, batches):
    given = np.array(counted, dtype=float)
    found, number = spread(np.array(time_s, dtype=float), given)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert number == batches
    np.testing.assert_array_equal(given, counted)


@pytest.mark.parametrize(
    ("time_s", "counted", "known_s", "times", "steps"),
    [
        ([0, 1, 4], [0, 2, 6], range(5), [0, 1, 2, 3, 4], [0, 2, 2, 2, 2]),
        # Longer than 2.5 s, into the fewest parts of a second at most.
        ([0, 2.5], [0, 3], [0.5, 1.5, 2.5], [0, 2.5], [0, 3]),
        ([0, 2.6], [0, 3], [0.8, 1.7, 2.6], [0, 2.6 / 3, 5.2 / 3, 2.6], [0, 1, 1, 1]),
        # With a direction in each, up to its end.
        ([0, 3], [0, 3], [1, 2, 3], [0, 1, 2, 3], [0, 1, 1, 1]),
        ([0, 3], [0, 3], [0, 1, 2], [0, 3], [0, 3]),
        ([0, 3], [0, 3], [0.5, 1.5], [0, 3], [0, 3]),
        # Not where no steps are, or nobody knows.
        ([0, 3, 6], [0, 0, NAN], range(7), [0, 3, 6], [0, 0, NAN]),
        # After a rest, of the last seconds.
        ([0, 10], [0, 4], range(11), [0, 6, 7, 8, 9, 10], [0, 0, 1, 1, 1, 1]),
        ([0, 10], [0, 2], range(11), [0, 8, 9, 10], [0, 0, 1, 1]),
        ([0, 10], [0, 1], range(11), [0, 10], [0, 1]),
    ],
)
def test_long_rows_are_parted_into_seconds(time_s, counted, known_s, times, steps):
    found = parted(*(np.array(one, dtype=float) for one in (time_s, counted, known_s)))
    np.testing.assert_allclose(found[0], times, atol=1e-12)
    np.testing.assert_allclose(found[1], steps, atol=1e-12)


@pytest.mark.parametrize(
    ("every_s", "count", "are_own"),
    [
        # They fall, and are at most five a second, or of a row that is shorter.
        (1.0, [0, 5, 4, 5, 4, 5], True),
        (1.0, [0, 1, 2, 2, 3, 4], False),
        (0.2, [0, 5, 4, 5, 4, 5], True),
        (2.0, [1, 5, 10, 4, 10], True),
        (1.0, [1, 2, 3, 4, 5, 6, 5], False),
        # In the mean, where they fall half as often as they rise.
        (1.0, [0, 0, 6, 7, 0, 0], True),
        (1.0, [0, 0, 6, 7, 8, 0], False),
        (1.0, [0, 10, 0, 10, 5], True),
        (1.0, [0, 10, 0, 10, 5.1], False),
        # Each is that of a walk, though they mostly rise.
        (1.0, [0, 1, 2, 3, 4, 5, 4], True),
    ],
)
def test_counts_of_each_row_fall(every_s, count, are_own):
    time_s = every_s * np.arange(len(count))
    assert are_own_counts(time_s, np.array(count, dtype=float)) == are_own


@pytest.mark.parametrize(
    ("time_s", "count", "steps"),
    [
        # Falls of up to 20 are of rows out of order, larger ones of a start.
        (range(5), [100, 120, 100, 121, 123], [0, 20, 0, 1, 2]),
        (range(5), [100, 121, 99, 101, 103], [0, 21, NAN, 2, 2]),
        # Five a second, or 50 in a row that came late.
        (range(3), [0, 50, 101], [0, 50, NAN]),
        ([0, 12, 24], [0, 60, 121], [0, 60, NAN]),
        # After 30 s without a row more than 20 are of an unknown way.
        ([0, 30, 60], [0, 30, 33], [0, 30, 3]),
        ([0, 31, 62], [0, 20, 41], [0, 20, NAN]),
        # Of one time a counter's last row.
        ([0, 0, 1, 1, 2], [5, 7, 9, 10, 12], [0, 3, 2]),
    ],
)
def test_a_counter_by_the_differences_of_its_rows(time_s, count, steps):
    time_s = np.array(time_s, dtype=float)
    times, found, how = counted_steps(time_s, np.array(count, dtype=float))
    np.testing.assert_array_equal(times, np.unique(time_s))
    np.testing.assert_array_equal(found, steps)
    assert how == "by a counter"


def test_counts_of_each_row_add_up_at_one_time():
    time_s = np.array([0.0, 0, 1, 2, 2, 2, 3])
    _, found, how = counted_steps(time_s, np.array([1.0, 2, 0, 1, 0, 2, 1]))
    assert found.tolist() == [3, 0, 3, 1]
    assert how == "counted in each row"
