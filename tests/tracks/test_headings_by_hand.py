"""Senses of rotation of headings that positions tell, by hand."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.checks.headings import heading_fault


def fault_of(course, heading):
    """The fault of headings along steps of 3 m, each with a course of its own."""
    east_m, north_m = (np.cumsum(np.append(0.0, 3 * f(course))) for f in (np.cos, np.sin))
    time_s = np.arange(course.size + 1.0)
    places = pd.DataFrame({"time_s": time_s, "east_m": east_m, "north_m": north_m})
    steps = pd.DataFrame({"time_s": time_s[1:], "step_m": 3.0, "heading_rad": heading})
    fault = heading_fault(steps, places)
    return None if fault is None else str(fault)


@pytest.mark.parametrize("heading_rad", [0.3, -1.0, np.pi / 2 - 0.3])
def test_a_straight_way_tells_no_sense_of_rotation(heading_rad):
    assert fault_of(np.full(60, 0.3), np.full(60, heading_rad)) is None


@pytest.mark.parametrize(("apart", "is_told"), [(0.75, False), (0.65, True)])
def test_headings_run_clockwise_where_these_fit_better_by_three_tenths(apart, is_told):
    """Of courses a and -a in turn, headings the wrong way round fit with cos 2a as others."""
    course = np.tile([0.5, -0.5], 50) * np.arccos(apart)
    found = fault_of(course, np.pi / 2 - course)
    assert (found is not None and "run clockwise from north" in found) is is_told
    assert fault_of(course, course) is None
