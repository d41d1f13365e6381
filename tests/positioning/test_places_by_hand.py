"""Positions while steps are fewer than usual, on slanted ways: numbers by hand."""

from dataclasses import replace
from math import inf, nan

import pytest

from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.sensors.places import Place, Places

SLANTED, ORIGIN = complex(-0.6, 0.8), complex(3000.0, -7000.0)
"""A direction, three to four to five, and a place far from zero."""


def fix(along_m, variances_m2=(25.0, 25.0), aside_m=0.0):
    place = ORIGIN + (along_m + 1j * aside_m) * SLANTED
    return GnssFix(place.real, place.imag, *variances_m2)


def places(along_m, times_s=None, aside_m=None, step_m=0.0):
    found = Places()
    times_s = times_s or [3.0 * k for k in range(len(along_m))]
    aside_m = aside_m or [0.0] * len(along_m)
    for time_s, one, other in zip(times_s, along_m, aside_m, strict=True):
        found = found.after(time_s, fix(one, aside_m=other), step_m)
    return found


@pytest.mark.parametrize(
    ("variances_m2", "sd_m"),
    [
        # The mean of both, 5 m at least, and 10 m where none is stated.
        ((36.0, 92.0), 8.0), ((92.0, 36.0), 8.0), ((1.0, 47.0), 5.0), ((0.0, 0.0), 10.0),
        ((nan, 25.0), 10.0), ((inf, 25.0), 10.0), ((1e-9, 1e-9), 5.0),
    ],
)  # fmt: skip
def test_a_place_and_its_deviation(variances_m2, sd_m):
    found = Places((), 7.0).after(5.0, fix(10.0, variances_m2), 1.5)
    (place,) = found.rows
    assert place[:4] == (5.0, 8.5, pytest.approx(2994.0), pytest.approx(-6992.0))
    assert place.sd_m == pytest.approx(sd_m)
    assert found.way_m == 8.5


@pytest.mark.parametrize("gone_m", [0.0, 2.0])
def test_what_is_no_new_position_adds_its_steps_alone(gone_m):
    first = places([0.0])
    given = [
        (9.0, None),
        (9.0, GnssFix(nan, 1.0, 25.0, 25.0)),
        (9.0, GnssFix(1.0, inf, 25.0, 25.0)),
        # The same position again, and one after less than two seconds.
        (9.0, fix(0.0)),
        (1.9, fix(5.0)),
    ]
    for time_s, one in given:
        assert first.after(time_s, one, gone_m) == Places(first.rows, gone_m)
    for time_s, one in ((2.0, fix(5.0)), (9.0, replace(fix(0.0), north_m=-6999.0))):
        after = first.after(time_s, one, gone_m)
        assert (len(after.rows), after.rows[-1].way_m, after.way_m) == (2, gone_m, gone_m)


def test_positions_are_kept_for_a_minute():
    found = places([0.0, 10.0, 20.0], times_s=[0.0, 30.0, 60.0])
    assert [row.time_s for row in found.rows] == [0.0, 30.0, 60.0]
    found = places([0.0, 10.0, 20.0], times_s=[0.0, 30.0, 60.5])
    assert [row.time_s for row in found.rows] == [30.0, 60.5]


@pytest.mark.parametrize("side", [1.0, 1j, -1.0, -1j])
def test_any_of_them_may_be_left_to_any_side(side):
    """Four deviations of the distance of two of 5 m: 28.3 m."""
    for far_m, left in ((28.2, False), (28.4, True)):
        place = ORIGIN + side * far_m * SLANTED
        given = GnssFix(place.real, place.imag, 25.0, 25.0)
        assert places([0.0]).are_left_by(given) is left
        # Another one is near.
        assert places([0.0, 10.0 * complex(side).real]).are_left_by(given) is left
    assert not places([0.0, 10.0]).are_left_by(fix(5.0))


def test_a_slanted_way_goes_on_beyond_the_steps():
    """28.3 m are the errors of both ends; steps of a metre explain one of three."""
    assert places([7.0 * k for k in range(5)]).carried is None
    assert places([7.1 * k for k in range(5)]).carried == (0.0, pytest.approx(7.1 / 3))
    assert places([8.0 * k for k in range(5)], step_m=1.0).carried is None
    assert places([8.1 * k for k in range(5)], step_m=1.0).carried == (0.0, pytest.approx(2.7))
    # Four intervals and eight seconds at least.
    assert places([20.0 * k for k in range(4)]).carried is None
    quick = [2.0 * k for k in range(4)]
    assert places([20.0 * k for k in range(5)], [*quick, 8.0]).carried == (0.0, pytest.approx(10.0))
    hasty = Places(tuple(Place(1.9 * k, 0.0, 20.0 * k, 0.0, 5.0) for k in range(5)))
    assert hasty.carried is None


def test_the_latest_way_is_told():
    found = places([0.0, 0.5, 0.0, 10.0, 20.0, 30.0, 40.0])
    assert found.carried == (6.0, pytest.approx(40.0 / 12))


@pytest.mark.parametrize(
    ("along_m", "goes_on"),
    [
        # Half of the way in one interval, and more than that.
        ([0.0, 10.0, 50.0, 75.0, 100.0], True),
        ([0.0, 10.0, 20.0, 70.0, 100.0], True),
        ([0.0, 10.0, 20.0, 71.0, 100.0], False),
        # The middles of both halves are 30 m apart, and 29.
        ([0.0, 49.0, 60.0, 49.0, 50.0, 100.0], True),
        ([0.0, 49.0, 61.0, 49.0, 50.0, 100.0], False),
        # Of seven the fourth is of neither half: these are 65 / 3 m apart.
        ([0.0, 50.0, 95.0, 100.0, 60.0, 50.0, 100.0], False),
    ],
)
def test_a_way_is_no_jump_and_no_wandering(along_m, goes_on):
    assert (places(along_m).carried is not None) is goes_on


def test_middles_may_lie_apart_across_the_way():
    """By 29.7 m along it; with a bow of 5 m to each side by 30.4 m."""
    along_m = [0.0, 49.0, 62.0, 49.0, 51.0, 100.0]
    assert places(along_m).carried is None
    assert places(along_m, aside_m=[0.0, -5.0, -5.0, 5.0, 5.0, 0.0]).carried is not None


@pytest.mark.parametrize(("last_s", "stands"), [(39.9, False), (40.0, True)])
def test_who_stands_is_near_for_40_s(last_s, stands):
    """From the last position back, to the latest one that shows it."""
    found = places([0.0, 3.0, -3.0, 5.0], times_s=[0.0, 2.0, 20.0, 2.0 + last_s])
    standing = found.standing
    if stands:
        assert standing == Places(found.rows[1:], found.way_m)
    else:
        # The first of them is older than 40 s.
        assert standing == found


def test_errors_of_more_than_40_m_need_a_way_of_a_metre_a_second_to_show():
    """Of 9 and 6 m: 4 * sqrt(117) = 43.3 m, and as many seconds."""
    for last_s, stands in ((43.2, False), (43.3, True)):
        found = Places().after(0.0, fix(0.0, (81.0, 81.0)), 0.0)
        found = found.after(last_s, fix(1.0, (36.0, 36.0)), 0.0)
        assert (found.standing is not None) is stands


def test_who_was_farther_away_does_not_stand():
    far = places([29.0, 0.0, 1.0, 0.0], times_s=[0.0, 3.0, 30.0, 42.0])
    assert far.standing is None
    near = places([28.0, 0.0, 1.0, 0.0], times_s=[0.0, 3.0, 30.0, 42.0])
    assert near.standing == near
    assert places([0.0]).standing is None
    assert Places().standing is None


def test_limits_count_as_reached():
    """6 and 8 m: 40 m are four of their deviations, and 40 s stand."""
    one, other = Place(0.0, 0.0, 0.0, 0.0, 6.0), Place(40.0, 0.0, 39.0, 0.0, 8.0)
    assert Places((one, other)).standing == Places((one, other))
    assert Places((one, other._replace(east_m=40.0))).standing is None
    assert Places((one,)).are_left_by(GnssFix(40.0, 0.0, 64.0, 64.0))
    # The middles of the halves are 30 of 100 m apart.
    along_m = [0.0, 40.0, 40.0, 40.0, 40.0, 50.0, 50.0, 100.0]
    rows = tuple(Place(2.0 * k, 0.0, east_m, 0.0, 5.0) for k, east_m in enumerate(along_m))
    assert Places(rows).carried == (0.0, 100 / 14)
