"""Ways whose direction, or length, too, was not measured, by hand."""

from math import isnan, sqrt
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.positioning.sensors.unmeasured import (
    common_way_m2,
    headless_step,
    missed_step,
    spread_m2,
    unmeasured_step,
    way_spread_m2,
)


def square(speed, gone, lasts):
    """Mean square of a way whose direction is correlated by exp(-t / T): a double integral."""
    lags = (np.arange(4000) + 0.5) * gone / 4000
    return 2 * speed**2 * float(((gone - lags) * np.exp(-lags / lasts)).sum()) * gone / 4000


@pytest.mark.parametrize("gone", [10.0, 60.0, 84.0, 500.0])
def test_the_spread_is_that_of_a_direction_forgotten_by_and_by(gone):
    assert spread_m2(1.4, gone) == pytest.approx(square(1.4, gone, 60.0), rel=1e-5)
    assert way_spread_m2(gone) == pytest.approx(square(1.0, gone, 84.0), rel=1e-5)


def test_a_step_between_two_times_adds_to_the_spread():
    step = unmeasured_step(1.4, 30.0, 45.0)
    assert step.step_m == pytest.approx(21.0)
    assert step.spread_m**2 == pytest.approx(square(1.4, 45, 60) - square(1.4, 30, 60), rel=1e-4)
    assert step.turned_sd_rad == pytest.approx(sqrt(0.5))
    assert isnan(step.heading_rad)
    assert isnan(step.turn_rad)
    nothing = unmeasured_step(1.4, 30.0, 30.0)
    assert (nothing.step_m, nothing.spread_m, nothing.turned_sd_rad) == (0.0, 0.0, 0.0)
    # Nothing grows where time goes back.
    back = unmeasured_step(1.4, 30.0, 29.0)
    assert (back.spread_m, back.turned_sd_rad) == (0.0, 0.0)


@pytest.mark.parametrize("length_m", [5.0, -5.0])
def test_a_step_without_a_heading_adds_to_the_way_before(length_m):
    step = headless_step(length_m, 20.0)
    assert step.step_m == length_m
    assert step.spread_m**2 == pytest.approx(square(1, 25, 84) - square(1, 20, 84), rel=1e-4)
    assert isnan(step.heading_rad)
    assert isnan(step.turn_rad)
    assert step.turned_sd_rad == 0.0


@pytest.mark.parametrize(("since_m", "before_m"), [(10.0, 30.0), (100.0, 200.0)])
def test_ways_before_and_after_a_fix_go_much_the_same_way(since_m, before_m):
    both = square(1, since_m + before_m, 84) - square(1, since_m, 84) - square(1, before_m, 84)
    assert common_way_m2(since_m, before_m) == pytest.approx(both / 2, rel=1e-3)
    assert common_way_m2(before_m, since_m) == pytest.approx(both / 2, rel=1e-3)


def test_a_short_step_without_a_heading_adds_as_little():
    assert headless_step(0.05, 20.0).spread_m == pytest.approx(
        sqrt(way_spread_m2(20.05) - way_spread_m2(20.0))
    )
    assert headless_step(0.05, 0.0).spread_m == pytest.approx(0.05, rel=1e-3)


def test_the_step_of_a_rest_in_doubt_counts_by_its_probability():
    asked = []
    rest = SimpleNamespace(
        since_s=40.0, left_probability=0.25, missed_mps=lambda gone_s: asked.append(gone_s) or 1.2
    )
    step = missed_step(rest, 100.0)
    assert asked == [60.0]
    assert step.step_m == pytest.approx(0.25 * 72.0)
    assert step.spread_m == pytest.approx(sqrt(0.25 * square(1.2, 60.0, 60.0)), rel=1e-5)
    assert isnan(step.heading_rad)
