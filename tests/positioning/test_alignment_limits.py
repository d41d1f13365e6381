"""From which way on two fixes tell the direction of headings by turns: limits by hand."""

from math import cos, hypot, nan, pi, radians, sin, sqrt

import pytest

from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.kalman.alignment import Alignment, Direction

FIRST = (1000.0, -2000.0)


def after_a_way(gone_m, towards_rad=0.0, *, way_m=300.0):
    """Return turns that began at a fix and have led so far from it."""
    east_m, north_m = gone_m * cos(towards_rad), gone_m * sin(towards_rad)
    return Alignment(0.5, east_m=east_m, north_m=north_m, way_m=way_m, first=FIRST)


def at_fix(given, off_m, towards_rad=0.0, sd_m=1.0):
    east_m, north_m = off_m * cos(towards_rad), off_m * sin(towards_rad)
    return given.at_fix(FIRST[0] + east_m, FIRST[1] + north_m, sd_m)


@pytest.mark.parametrize(
    ("gone_m", "sd_m", "tells"),
    # 30 m, or eight deviations of a fix.
    [(29.9, 1.0, False), (30.1, 1.0, True), (39.9, 5.0, False), (40.1, 5.0, True)],
)
def test_fixes_tell_a_direction_from_some_way_on(gone_m, sd_m, tells):
    for towards_rad in (0.0, 2.0, -pi / 2):
        given = after_a_way(gone_m, towards_rad)
        after, found = at_fix(given, gone_m, towards_rad + 0.3, sd_m)
        assert (found is not None) is tells
        if tells:
            assert found.turned_rad == pytest.approx(0.3)
            assert found.sd_rad == pytest.approx(hypot(sqrt(2) * sd_m / gone_m, radians(3.0)))
            assert after == Alignment(0.5, known=True)
        else:
            assert after is given


@pytest.mark.parametrize(
    ("off_m", "tells"), [(29.9, False), (30.1, True), (49.9, True), (50.1, False)]
)
def test_a_way_is_a_quarter_longer_or_shorter_at_most(off_m, tells):
    after, found = at_fix(after_a_way(40.0, 1.0), off_m, 1.0)
    assert (found is not None) is tells
    assert after.known is tells
    if not tells:
        place = FIRST[0] + off_m * cos(1.0), FIRST[1] + off_m * sin(1.0)
        assert after == Alignment(0.5, first=place)


@pytest.mark.parametrize(("way_m", "tells"), [(499.9, True), (500.0, False)])
def test_after_a_long_way_another_fix_is_the_first(way_m, tells):
    after, found = at_fix(after_a_way(40.0, way_m=way_m), 40.0)
    assert (found is not None) is tells
    assert after.first == (None if tells else (1040.0, -2000.0))


def test_a_direction_is_the_lesser_angle():
    found = at_fix(after_a_way(40.0, 3.0), 40.0, -3.0)[1]
    assert isinstance(found, Direction)
    assert found.turned_rad == pytest.approx(2 * pi - 6.0)


def test_where_turns_have_led():
    """Each step goes on by the heading after its turn; back is back, and its way is as long."""
    given = Alignment(0.5, east_m=1.0, north_m=2.0, way_m=3.0, first=FIRST)
    after, step = given.headed(MotionStep(10.0, nan, 0.2))
    assert step.heading_rad != step.heading_rad
    assert (after.heading_rad, after.way_m, after.first) == (0.7, 13.0, FIRST)
    assert after.east_m == pytest.approx(1.0 + 10 * cos(0.7))
    assert after.north_m == pytest.approx(2.0 + 10 * sin(0.7))
    back, _ = after.headed(MotionStep(-10.0, nan, 0.0))
    assert (back.east_m, back.north_m) == pytest.approx((1.0, 2.0))
    assert back.way_m == 23.0
    # The place after a turn of unknown length is unknown; its heading is not.
    lost, _ = given.headed(MotionStep(nan, nan, 0.2))
    assert (lost.first, lost.heading_rad, lost.way_m) == (None, 0.7, 3.0)


@pytest.mark.parametrize("known", [True, False])
def test_a_turn_that_is_not_measured(known):
    given = Alignment(0.5, known=known, open_rad2=radians(24.0) ** 2, way_m=9.0, first=FIRST)
    still = MotionStep(0.0, nan, nan)
    assert given.headed(still) == (given, still)
    # 18 and 24 degrees are 30 together.
    for turned_deg, stays in ((17.9, known), (18.1, False)):
        step = MotionStep(5.0, nan, nan, 5.0, turned_sd_rad=radians(turned_deg))
        after, same = given.headed(step)
        assert same is step
        expected_rad2 = radians(24.0) ** 2 + radians(turned_deg) ** 2
        assert after.known is stays
        assert after.open_rad2 == pytest.approx(expected_rad2 if stays else 0.0)
        assert after.first == (FIRST if stays else None)
        assert after.heading_rad == 0.5
    assert given.headed(MotionStep(5.0, nan, nan))[0] == Alignment(0.5)
    unknown = Alignment(way_m=9.0)
    assert unknown.headed(MotionStep(5.0, nan, nan))[0] is unknown


def test_a_known_direction_is_not_found_again():
    known = Alignment(0.5, known=True)
    assert at_fix(known, 40.0) == (known, None)
    unturned = Alignment(east_m=40.0, way_m=40.0, first=FIRST)
    assert at_fix(unturned, 40.0) == (unturned, None)
