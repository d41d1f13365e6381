"""Rows of steps of one time by hand: batches, cut seconds, counters, and the notes on them."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.readers.recorded.batched_rows import (
    _are_steps,
    times_of_batches,
    times_of_cut_seconds,
    without_batches,
)


def batches(times, counts):
    return np.repeat(np.array(times, dtype=float), counts)


@pytest.mark.parametrize(
    ("times", "counts", "expected"),
    [
        # Each over the time since the batch before; the first one as usual, by the median.
        ([0, 4, 8], [4, 4, 4], [-3, -2, -1, 0, 1, 2, 3, 4, 5, 6, 7, 8]),
        ([0, 4, 8], [2, 8, 4], [-0.75, 0, *np.arange(0.5, 4.1, 0.5), 5, 6, 7, 8]),
        # A step takes a second at most.
        ([0, 4, 8], [4, 2, 8], [-3, -2, -1, 0, 3, 4, *np.arange(4.5, 8.1, 0.5)]),
        # Five a second at least in one of ten.
        ([0, 2, 4], [10, 10, 10], [*np.arange(-1.8, 4.1, 0.2)]),
    ],
)
def test_batches_over_the_time_before(times, counts, expected):
    assert times_of_batches(batches(times, counts)).tolist() == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("times", "counts"),
    [
        # Two batches, less than three rows in each, less than 2 s, or faster steps.
        ([0, 4], [4, 4]),
        ([0, 4, 8, 12], [3, 3, 2, 3]),
        ([0, 1.9, 3.8], [4, 4, 4]),
        ([0, 2, 4], [11, 11, 11]),
    ],
)
def test_what_are_no_batches(times, counts):
    time_s = batches(times, counts)
    assert times_of_batches(time_s) is time_s


def cut(counts, **more):
    """Return the times of seconds of so many rows, of which those after the first equal it."""
    time_s = np.repeat(np.arange(float(len(counts))), counts)
    equal = np.diff(time_s, prepend=-1.0) == 0
    found = times_of_cut_seconds(time_s, equal, **more)
    return None if found is time_s else found.tolist()


ONCE_TWICE = [1, 2] * 6
SPREAD = [at + part for at in range(0, 12, 2) for part in (0, 1, 1.5)]


def test_cut_seconds_are_spread():
    assert cut(ONCE_TWICE) == SPREAD
    # Of three rows of which one or two are equal, by thirds.
    thirds = [at + x for at in (0, 2, 4) for x in (0, 1, 4 / 3, 5 / 3)]
    assert cut([1, 3] * 3) == pytest.approx(thirds)
    # A part that was delivered twice begins and ends once: five changes are more.
    assert cut([1, 2] * 3) == [at + x for at in (0, 2, 4) for x in (0, 1, 1.5)]
    assert cut([1, 2, 1, 2, 1]) is None
    assert cut([2] * 12) is None
    assert cut([1] * 12) is None
    # And in five of a hundred seconds.
    assert cut([1] * 94 + [2, 1] * 3) is not None
    assert cut([1] * 120 + [2, 1] * 3) is None
    # More than five in one second are no steps.
    assert cut([1, 5] * 6) is not None
    assert cut([1, 6] * 6) is None


def test_cut_seconds_of_rows_that_are_alike():
    """Equal rows say less there: half of a second's rows count, and one change of a hundred."""
    assert cut(ONCE_TWICE, alike=True) == SPREAD
    assert cut([1, 3] * 6, alike=True) is None
    assert cut([1] * 120 + [2, 1] * 3, alike=True) is not None
    assert cut([1] * 700 + [2, 1] * 3, alike=True) is None
    # As long as steps, and as many, two in nine of ten seconds count.
    assert cut([2] * 12, alike=True, walked=True) == np.arange(0, 12, 0.5).tolist()
    assert cut([2] * 9 + [1], alike=True, walked=True) is not None
    assert cut([2] * 8 + [1] * 2, alike=True, walked=True) is None


def test_stamps_with_fractions_were_not_cut():
    time_s = np.repeat(np.arange(12.0), ONCE_TWICE) + 0.25
    equal = np.diff(time_s, prepend=-1.0) == 0
    assert times_of_cut_seconds(time_s, equal) is time_s
    whole = np.floor(time_s)
    assert times_of_cut_seconds(whole, np.zeros_like(equal)) is whole


@pytest.mark.parametrize(
    ("length_m", "per_s", "are"),
    [
        *((0.3, 2, True), (1.1, 2, True), (0.29, 2, False), (1.11, 2, False)),
        *((0.7, 1, False), (0.7, 3, False)),
    ],
)
def test_rows_that_are_steps(length_m, per_s, are):
    time_s = np.repeat(np.arange(10.0), per_s)
    assert _are_steps(pd.DataFrame({"time_s": time_s, "step_m": length_m})) == are


def test_rates_of_steps():
    """15 and 25 rows in ten seconds are a walker's, 14 and 26 are not."""
    for count, are in ((15, True), (25, True), (14, False), (26, False)):
        time_s = np.sort(np.resize(np.arange(10.0), count))
        assert _are_steps(pd.DataFrame({"time_s": time_s, "step_m": 0.7})) == are


def test_batches_of_a_log():
    rows = pd.DataFrame({"time_s": batches([0, 4, 8], [4, 4, 4]), "count": 1.0})
    found, note = without_batches("steps", rows, repeated=False)
    assert found["time_s"].tolist() == list(range(-3, 9))
    # Rows that all count one step are those of a counter.
    assert found["count"].tolist() == list(range(1, 13))
    assert note == (
        "steps: 12 rows came in 3 batches of 4 or so, 4 s apart: spread over the time since the "
        "batch before"
    )
    # More than half of the rows repeat one, as in a file with a row for each cell.
    assert without_batches("steps", rows, repeated=True) == (rows, "")
    motion = pd.DataFrame({"time_s": rows["time_s"], "step_m": np.arange(12) // 2 + 1.0})
    found, note = without_batches("motion", motion, repeated=True)
    assert found["step_m"].tolist() == motion["step_m"].tolist()
    assert note.startswith("motion: 12 rows came in 3 batches")


def test_cut_seconds_of_a_log():
    time_s = np.repeat(np.arange(12.0), ONCE_TWICE)
    rows = pd.DataFrame({"time_s": time_s, "count": 1.0})
    found, note = without_batches("steps", rows, repeated=False)
    assert found["time_s"].tolist() == SPREAD
    assert found["count"].tolist() == list(range(1, 19))
    assert note == (
        "steps: 6 rows equal another one of the same second, as stamps are whole seconds: kept, "
        "and spread over it"
    )
    assert without_batches("steps", rows, repeated=True)[0] is rows
    # Of a counter the last row of a second has all its steps.
    counter = rows.assign(count=np.arange(18.0))
    assert without_batches("steps", counter, repeated=False)[0] is counter
    apart = rows[np.diff(time_s, prepend=-1.0) > 0]
    assert without_batches("steps", apart, repeated=False) == (apart, "")
