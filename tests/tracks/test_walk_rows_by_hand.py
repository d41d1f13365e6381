"""Rows of a walk by hand: when they end, and their course over two steps."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.pdr.height import TREAD_M, Climb
from mapfilter.tracks.pdr.rows import climbed_rows, course_over_strides, row_events
from mapfilter.tracks.pdr.signals import RATE_HZ

SECOND = int(RATE_HZ)


def test_rows_are_the_start_the_steps_the_end_and_each_second_at_rest():
    time_s = 7.0 + np.arange(8 * SECOND + 1) / RATE_HZ
    index = np.array([SECOND, 2 * SECOND + SECOND // 2, 6 * SECOND])
    ended_s, length_m, at = row_events(time_s, index, np.array([0.7, 0.6, 0.8]))
    # Nothing is put into 1.5 s; a second at rest that would end with the next step is left out.
    np.testing.assert_allclose(ended_s - 7.0, [0, 1, 2.5, 3.5, 4.5, 5.5, 6, 7, 8], atol=1e-9)
    np.testing.assert_allclose(length_m, [0, 0.7, 0.6, 0, 0, 0, 0.8, 0, 0])
    np.testing.assert_array_equal(time_s[at], ended_s)


def test_a_second_at_rest_ends_a_fifth_of_one_before_the_next_step():
    time_s = np.arange(4 * SECOND + 1) / RATE_HZ
    for after in (SECOND // 5, SECOND // 5 + 1):
        index = np.array([SECOND // 2, SECOND // 2 + 2 * SECOND + after])
        ended_s, *_ = row_events(time_s, index, np.array([0.7, 0.7]))
        assert (2.5 in ended_s) == (after > SECOND // 5)


def test_a_steady_course_is_that_of_each_row():
    at = np.array([0, 20, 70, 120, 170, 220, 299])
    stepped = np.array([False, True, True, True, True, True, False])
    values, sway = course_over_strides(np.full(300, 0.3), at, stepped)
    np.testing.assert_allclose(values, 0.3, rtol=1e-12)
    assert sway == pytest.approx(0.0, abs=1e-12)


def test_a_course_that_grows_is_that_of_the_middle_of_each_step():
    at = np.array([0, 50, 150, 200, 300, 440, 480])
    values, _ = course_over_strides(0.001 * np.arange(500.0), at, at > 0)
    # At the ends over what there is, 0 to 75 and 420 to 499; a step lasts 1.5 s at most.
    middles = np.array([0, 37.5, 112.5, 175, 262.5, 402.5, 459.5])
    np.testing.assert_allclose(values, 0.001 * middles, rtol=0, atol=0.000_501)


def test_a_body_that_swings_from_step_to_step_keeps_its_course():
    sample = np.arange(500)
    # To the left with one step, to the right with the next.
    course = 0.5 + 0.1 * (-1.0) ** ((sample - 1) // 50)
    at = np.arange(0, 500, 50)
    stepped = at > 0
    values, _ = course_over_strides(course, at, stepped)
    # Over 101 samples about the middle of a step, one of which has no other beside it.
    np.testing.assert_allclose(values[2:-1], 0.5, atol=0.1 / 101 + 1e-12)
    # Without a step the course is that of the moment.
    resting, _ = course_over_strides(course, at, np.zeros(len(at), dtype=bool))
    np.testing.assert_array_equal(resting, course[at])


def test_the_noise_of_a_course_is_that_of_its_second_differences():
    """Of white noise these have six times its variance; the median is 0.6745 deviations."""
    at = np.arange(0, 1000, 50)
    course = 1e-6 * np.arange(1000.0) ** 2
    _, sway = course_over_strides(course, at, at >= 100)
    assert sway == pytest.approx(2e-6 * 50**2 / 0.674_49 / 6**0.5, rel=1e-3)
    # Of three steps one after the other, at least.
    _, sway = course_over_strides(course, at, at % 150 > 0)
    assert sway == 0.0


def test_steps_on_stairs_are_a_tread_at_most_and_those_in_a_lift_none():
    rows = pd.DataFrame(
        {"time_s": np.arange(8.0), "step_m": [0.7, 0.7, 0.2, 0.7, 0.7, 0.7, 0.7, 0.7]}
    )
    found = (Climb(1.0, 3.0, 0.5, "stairs"), Climb(5.0, 6.0, 3.0, "lift"))
    # In the standard atmosphere 1.2 hPa are 10 m at the sea; rows need not be in order.
    air = pd.DataFrame({"time_s": [7.0, 0.0, np.nan], "pressure_hpa": [1012.05, 1013.25, 990.0]})
    climbed = climbed_rows(rows, air, found)
    assert climbed["step_m"].tolist() == [0.7, TREAD_M, 0.2, TREAD_M, 0.7, 0, 0, 0.7]
    np.testing.assert_array_equal(climbed["climb"], [np.nan, 1, 1, 1, np.nan, 2, 2, np.nan])
    np.testing.assert_allclose(climbed["height_m"], 9.99 * np.arange(8) / 7, atol=0.01)
    assert "height_m" not in climbed_rows(rows, air[:0], found)
    assert rows["step_m"].tolist()[1] == 0.7
