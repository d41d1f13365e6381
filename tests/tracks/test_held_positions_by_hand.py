"""Positions that are repeated, of before the journey, or after a long pause: each limit."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.readers.recorded.held_positions import own_positions

METRE_DEG = 90 / 1e7
"""A metre north: a quarter of a meridian has ten million."""


def rows_of(north_m, time_s):
    lat_deg = 50.123_456_7 + METRE_DEG * np.asarray(north_m, dtype=float)
    return pd.DataFrame(
        {"time_s": time_s, "lat_deg": lat_deg, "lon_deg": 8.765_432_1, "accuracy_m": 5.0}
    )


def kept(north_m, every_s=0.2):
    """Return the rows that stay, by their number, and the notes."""
    time_s = every_s * np.arange(len(north_m))
    found, notes = own_positions(rows_of(north_m, time_s))
    assert found.index.tolist() == list(range(len(found)))
    return np.round(found["time_s"].to_numpy() / every_s).astype(int).tolist(), notes


def runs(*lengths):
    return np.repeat(10.0 * np.arange(len(lengths)), lengths)


def test_of_positions_at_a_steady_pace_the_first_of_each_is_measured():
    numbers, notes = kept(runs(*[5] * 20))
    assert numbers == list(range(0, 100, 5))
    assert notes == (
        "positions: 80 rows repeat those of a receiver that measures every 1 s, left out",
    )
    # The first and the last run may be cut off.
    assert kept(runs(1, *[5] * 19, 2))[0] == [0, *range(1, 97, 5)]
    # Every other row, and fewer than twenty positions, or as many but one.
    assert kept(runs(*[2] * 20))[0] == list(range(0, 40, 2))
    for count, repeated in ((20, True), (19, False)):
        assert (len(kept(runs(*[5] * count))[0]) == count) is repeated


@pytest.mark.parametrize(("every_s", "repeated"), [(0.5, True), (0.99, True), (1.01, False)])
def test_a_receiver_measures_every_five_seconds_or_more_often(every_s, repeated):
    numbers, notes = kept(runs(*[5] * 20), every_s)
    assert (len(numbers), len(notes)) == ((20, 1) if repeated else (100, 0))


@pytest.mark.parametrize(
    ("others", "repeated"),
    [
        # Within a quarter of the usual run, or a row.
        ([7, 9] * 8, True),
        ([8] * 16, True),
        # Four of five runs, of the 20 between the first and the last.
        ([12] * 4 + [8] * 14, True),
        ([12] * 5 + [8] * 13, False),
        ([11] * 4 + [8] * 14, True),
        ([11] * 5 + [8] * 13, False),
        ([10] * 9 + [8] * 9, True),
    ],
)
def test_most_runs_are_about_as_long_as_the_usual_one(others, repeated):
    lengths = [8, *others, *[8] * (20 - len(others)), 8]
    numbers, _ = kept(runs(*lengths))
    assert (len(numbers) == len(lengths)) is repeated
    assert repeated or len(numbers) == sum(lengths)


def test_of_a_rest_as_many_stay_as_the_receiver_measured():
    """Three times the usual run or more; a shorter one is a position that came late."""
    lengths = [4] * 10 + [12] + [4] * 10 + [11] + [4] * 5
    numbers, _ = kept(runs(*lengths))
    begins = np.cumsum([0, *lengths[:-1]])
    assert numbers == sorted([*begins.tolist(), begins[10] + 4, begins[10] + 8])
    # Half of the runs are as the usual one.
    for rests, repeated in ((6, True), (7, False)):
        lengths = [4, *[1] * 4, *[12] * rests, *[4] * (16 - rests), 4]
        assert (len(kept(runs(*lengths))[0]) < sum(lengths)) is repeated


def journey(*first_m, count=200, every_s=1.0):
    """First rows so far behind the journey's begin, which goes on at 10 m a row."""
    north_m = np.concatenate([-np.array(first_m, dtype=float), 10.0 * np.arange(count)])
    return north_m, every_s * np.arange(len(north_m))


@pytest.mark.parametrize(
    ("first_m", "every_s", "left_out"),
    [
        # Two kilometres and more, faster than 350 m/s.
        ([2010], 1.0, 1),
        ([1990], 1.0, 0),
        ([3600], 10.0, 1),
        ([3400], 10.0, 0),
        # Up to three rows; of those between none goes on.
        ([9000, 9000, 9000], 1.0, 3),
        ([9000, 9000, 9000, 9000], 1.0, 0),
        ([9000, 18_000], 1.0, 2),
        ([0, 9000], 1.0, 2),
    ],
)
def test_a_last_position_of_before_is_left_out(first_m, every_s, left_out):
    north_m, time_s = journey(*first_m, count=100, every_s=every_s)
    rows, notes = own_positions(rows_of(north_m, time_s))
    assert len(rows) == len(north_m) - left_out
    assert rows["time_s"].iloc[0] == every_s * left_out
    if left_out:
        told = f"first {left_out} rows lie" if left_out > 1 else "first row lies"
        far_km = first_m[-1] / 1000
        assert notes == (
            f"positions: the {told} {far_km:.1f} km from the next one, left out (likely: the last "
            "position of before)",
        )
    else:
        assert notes == ()


def test_of_many_rows_two_in_a_hundred_may_be_of_before():
    for count, first, left_out in ((396, 8, 8), (391, 8, 0), (12, 1, 1), (10, 1, 0)):
        north_m, time_s = journey(*[9000] * first, count=count - first + (count == 396) * 4)
        rows, _ = own_positions(rows_of(north_m, time_s))
        assert len(rows) == len(north_m) - left_out


def test_a_later_jump_is_another_matter():
    """Within the ten rows after the first ones there is none."""
    for jump, left_out in ((4, 0), (12, 0), (13, 1), (14, 1)):
        north_m, time_s = journey(9000, count=100)
        north_m[jump + 1 :] += 9000
        rows, _ = own_positions(rows_of(north_m, time_s))
        assert len(rows) == 101 - left_out, jump


@pytest.mark.parametrize(("pause_s", "told"), [(21_600.0, False), (21_601.0, True)])
def test_a_pause_of_more_than_six_hours_parts_journeys(pause_s, told):
    time_s = np.arange(60.0)
    time_s[30:] += pause_s - 1
    _, notes = own_positions(rows_of(10.0 * np.arange(60), time_s))
    assert [note.startswith("positions pause for 6.0 h") for note in notes] == [True] * told
    assert own_positions(rows_of([0.0], [0.0]))[1] == ()
