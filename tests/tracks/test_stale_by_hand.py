"""Readings of a phone that a program repeats without measuring again, by their limits."""

import numpy as np
import pytest

from mapfilter.tracks.readers.recorded.stale import repeated_readings

METRE_DEG = 90 / 1e7
"""A metre north: a quarter of a meridian has ten million."""


def repeated(lasts_s, goes_m, states=(0, 0, 0)):
    """Rows that are equally far apart in time and on the way north."""
    share = np.linspace(0.0, 1.0, len(states))
    lat_deg = 50.0 + goes_m * METRE_DEG * share
    found = repeated_readings(
        np.array(states), 7.0 + lasts_s * share, lat_deg, np.full(len(states), 8.0)
    )
    return found.tolist()


@pytest.mark.parametrize(
    ("lasts_s", "goes_m", "found"),
    [(30.0, 500.0, False), (30.5, 500.0, True), (500.0, 49.0, False), (500.0, 51.0, True)],
)
def test_a_reading_is_repeated_after_more_than_thirty_seconds_and_fifty_metres(
    lasts_s, goes_m, found
):
    assert repeated(lasts_s, goes_m) == [False, found, found]


def test_runs_of_equal_readings_count_by_themselves():
    # Of 100 s and 200 m each; two rows are no run.
    states = (5, 5, 5, 2, 2, 5, 5, 5, 5)
    found = repeated(400.0, 800.0, states)
    assert found == [False, True, True, False, False, False, True, True, True]
    assert repeated(400.0, 800.0, (5, 5, 2, 2)) == [False] * 4
    assert repeated(0.0, 0.0, ()) == []


def test_unknown_times_and_positions_repeat_nothing():
    state, lat_deg = np.zeros(3, dtype=int), 50.0 + 500 * METRE_DEG * np.arange(3)
    time_s, lon_deg, unknown = np.array([0.0, 50.0, 100.0]), np.full(3, 8.0), np.full(3, np.nan)
    for given, found in (
        ((time_s, lat_deg, lon_deg), True),
        ((unknown, lat_deg, lon_deg), False),
        ((time_s, unknown, lon_deg), False),
        ((time_s, lat_deg, unknown), False),
        # What is known of two rows is enough.
        ((np.array([0.0, np.nan, 100.0]), lat_deg, lon_deg), True),
        ((time_s, np.where(np.arange(3) == 1, np.nan, lat_deg), lon_deg), True),
    ):
        assert repeated_readings(state, *given).tolist() == [False, found, found]
