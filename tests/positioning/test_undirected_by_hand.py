"""Positions and ranges beside steps without a direction, by hand."""

from math import isnan, nan

import pytest

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.epochs import Epoch, GnssFix, Pseudorange
from mapfilter.positioning.sensors.undirected import UndirectedWay

STEP = MotionStep(3.0, nan)
PLACE = (2.6e7, 0.0, 0.0)
RANGED = {"pseudoranges": (Pseudorange("G07", nan, 5.0, PLACE),
                           Pseudorange("G08", 2.2e7, 5.0, PLACE))}  # fmt: skip
"""One without a number, and one that has it."""
UNRANGED = {"pseudoranges": (Pseudorange("G07", nan, 5.0, PLACE),)}
FIXED = {"gnss": GnssFix(0.0, 0.0, 100.0, 100.0)}
FAR = UndirectedWay(rows=True, since_m=500.0, gone_m=500.0)
"""Of one who has gone far since the last position, and never had a direction."""
NEAR = FAR._replace(since_m=6.0, seen_m=6.0)


def of_way(given, *, by_ways, **measured):
    """Lengths of the steps, what waits, the epoch that is left, and what is unused."""
    epoch = Epoch(9.0, (STEP,), **measured)
    after, left, unused = given.spread(epoch, by_ways=by_ways)
    found = [(one.kind, one.what, one.reason) for one in unused]
    return [one.step_m for one in left.motion], after, left, found


@pytest.mark.parametrize(
    ("measured", "lengths", "waiting_m"),
    [({}, [0.0], 3.0), (UNRANGED, [0.0], 3.0), (RANGED, [3.0], 0.0), (FIXED, [3.0], 0.0)],
)
def test_at_a_position_no_step_waits_for_a_leg(measured, lengths, waiting_m):
    found, after, left, unused = of_way(FAR, by_ways=True, **measured)
    assert (found, after.waiting_m, unused) == (lengths, waiting_m, [])
    assert (after.since_m, after.gone_m) == (503.0, 503.0)
    assert left.pseudoranges == measured.get("pseudoranges", ())


@pytest.mark.parametrize(("since_m", "waits"), [(199.9, False), (200.0, True)])
def test_near_the_last_position_each_step_is_a_leg(since_m, waits):
    found, after, _, _ = of_way(FAR._replace(since_m=since_m), by_ways=True)
    assert (found, after.waiting_m) == (([0.0], 3.0) if waits else ([3.0], 0.0))


def test_what_waits_makes_a_leg_of_eight_metres():
    way, lengths = FAR, []
    for _ in range(6):
        found, way, _, _ = of_way(way, by_ways=True)
        lengths += found
    assert lengths == [0.0, 0.0, 9.0, 0.0, 0.0, 9.0]
    # What is left over goes with a position.
    _, way, _, _ = of_way(way, by_ways=True)
    epoch = Epoch(9.0, (), **FIXED)
    after, left, _ = way.spread(epoch, by_ways=True)
    assert [one.step_m for one in left.motion] == [3.0]
    assert after.waiting_m == 0.0


@pytest.mark.parametrize(
    ("measured", "names"),
    [
        (RANGED, [("pseudorange", "G07"), ("pseudorange", "G08")]),
        (FIXED, [("gnss", "")]),
        (FIXED | RANGED, [("gnss", ""), ("pseudorange", "G07"), ("pseudorange", "G08")]),
        (UNRANGED, []),
        ({}, []),
    ],
)
def test_positions_too_near_to_the_last_one_are_left_out(measured, names):
    _, after, left, unused = of_way(NEAR, by_ways=False, **measured)
    assert unused == [(*name, Reason.NOT_MOVED_ENOUGH) for name in names]
    if names:
        assert (left.gnss, left.pseudoranges) == (None, ())
    # The way since the last one that was reported counts from here.
    assert after.seen_m == (0.0 if names else 9.0)
    assert after.since_m == 9.0
    # After a way that was not measured it is used.
    unmeasured = NEAR._replace(is_unmeasured=True)
    assert of_way(unmeasured, by_ways=False, **measured)[3] == []


@pytest.mark.parametrize(
    ("since_m", "seen_m", "is_left"),
    [(22.0, 0.0, False), (21.9, 0.0, True), (14.0, 10.0, True), (14.0, 10.1, False)],
)
def test_how_near_is_too_near(since_m, seen_m, is_left):
    """25 m of fixes of 10 m; or if the next one would come after more than 30 m."""
    given = FAR._replace(since_m=since_m, seen_m=seen_m)
    assert bool(of_way(given, by_ways=False, **FIXED)[3]) is is_left


@pytest.mark.parametrize(
    ("variance_m2", "apart_m"), [(16.0, 10.0), (100.0, 25.0), (1e4, 25.0), (nan, 25.0), (0.0, 25.0)]
)
def test_the_way_between_positions_is_two_and_a_half_of_their_deviations(variance_m2, apart_m):
    fix = GnssFix(0.0, 0.0, variance_m2, variance_m2)
    for off_m, is_left in ((-0.1, True), (0.0, False)):
        given = FAR._replace(since_m=apart_m - 3.0 + off_m)
        assert bool(of_way(given, by_ways=False, gnss=fix)[3]) is is_left


def test_before_any_row_nothing_is_known():
    way = UndirectedWay()
    assert way[:2] == (False, False)
    assert isnan(way.since_m)
    assert isnan(way.heading_rad)
    assert (way.seen_m, way.gone_m, way.is_unmeasured, way.waiting_m) == (0.0, 0.0, False, 0.0)
    assert not way.is_blind


def test_a_row_with_a_direction_ends_the_way_without_one():
    given = FAR._replace(waiting_m=2.0, seen_m=4.0, is_unmeasured=True)
    after, left, unused = given.spread(Epoch(9.0, (MotionStep(3.0, 0.4),)))
    assert after == UndirectedWay(rows=True, directed=True, since_m=0.0, heading_rad=0.4)
    assert unused == []
    # What waits is part of it.
    assert [(one.step_m, one.heading_rad) for one in left.motion] == [(5.0, 0.4)]


@pytest.mark.parametrize(
    ("given", "step", "waits"),
    [
        (FAR, STEP, True),
        # Who had a direction goes on in it for ten metres.
        (FAR._replace(directed=True, gone_m=0.0), STEP, False),
        # A first turn is none, and a row that is spread already is no leg.
        (UndirectedWay(since_m=500.0), MotionStep(3.0, nan, 0.2), False),
        (FAR, MotionStep(3.0, nan, spread_m=2.0), False),
    ],
)
def test_what_makes_a_leg_along_the_ways(given, step, waits):
    after, left, _ = given.spread(Epoch(9.0, (step,)), by_ways=True)
    assert after.waiting_m == (3.0 if waits else 0.0)
    assert left.motion[0].step_m == (0.0 if waits else 3.0)


@pytest.mark.parametrize(("since_m", "is_left"), [(0.7, True), (0.75, False)])
def test_precise_positions_may_be_near_each_other(since_m, is_left):
    fix = GnssFix(0.0, 0.0, 0.16, 0.34)
    given = FAR._replace(since_m=since_m, seen_m=0.0)
    _, _, unused = given.spread(Epoch(9.0, (MotionStep(0.5, nan),), gnss=fix))
    assert bool(unused) is is_left
