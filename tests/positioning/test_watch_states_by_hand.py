"""What is known of the sensors after positions, by hand."""

from dataclasses import replace

import pytest
from made_watch import STEP, told
from made_watch import STILL as STILL_ROW

from mapfilter.filters.contract import Reason
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.sensors.pace import Pace
from mapfilter.positioning.sensors.places import Place, Places
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.undirected import UndirectedWay
from mapfilter.positioning.sensors.watch import SensorWatch

WALKS = SensorWatch(pace=Pace(rows=50, interval_s=1.0, speed_mps=1.4), moving_s=40.0, known_s=41.0)
STILL = Rest(40.0, pace_mps=1.4)
STROLL = replace(STILL, measured_m=12.0)
SEEN = Places((Place(3.0, 0.0, 1.0, 2.0, 5.0),))


@pytest.mark.parametrize(
    ("changes", "astray"),
    [
        ({}, True),
        # Before any row, once steps are fewer than usual, and beside positions of that time.
        ({"pace": Pace()}, False),
        ({"rest": STILL}, False),
        ({"places": SEEN}, False),
    ],
)
def test_a_position_that_contradicts_usual_steps_is_astray(changes, astray):
    watch = WALKS._replace(**changes)
    after = watch.contradicted()
    assert after == watch._replace(are_astray=astray)
    assert (after is watch) is not astray
    # Again it is the same.
    assert after.contradicted() is after
    already = watch._replace(are_astray=True)
    assert already.contradicted() is already


@pytest.mark.parametrize(("rest", "remains"), [(None, None), (STILL, STILL), (STROLL, None)])
def test_what_a_position_that_is_used_leaves(rest, remains):
    way = UndirectedWay(rows=True, since_m=7.0, gone_m=7.0, is_unmeasured=True)
    watch = WALKS._replace(rest=rest, are_astray=True, undirected=way, unmeasured_s=3.0)
    assert watch.is_unmeasured
    after = watch.positioned(50.0)
    assert (after.rest, after.are_astray, after.is_unmeasured) == (remains, False, False)
    assert after.undirected.since_m == 0.0
    # A stroll before it is measured by now.
    shown = rest is STROLL
    known = (50.0, 50.0, 0.0) if shown else (40.0, 41.0, 3.0)
    assert (after.moving_s, after.known_s, after.unmeasured_s) == known


def test_a_position_that_changes_nothing_leaves_the_watch():
    watch = WALKS._replace(undirected=UndirectedWay(since_m=0.0))
    assert watch.positioned(50.0) is watch


def test_who_is_carried_on_without_steps_has_no_positions_of_before():
    watch = WALKS._replace(rest=STILL, places=SEEN)
    after = watch.carried()
    assert after.rest.is_carried
    assert (after.places, after.moving_s) == (Places(), 40.0)
    assert WALKS._replace(places=SEEN).carried() == WALKS._replace(places=SEEN)


def test_a_way_that_was_measured_ends_a_rest():
    after = WALKS._replace(rest=STILL, unmeasured_s=9.0, moved_m=4.0).after_way(70.0)
    assert (after.moving_s, after.known_s, after.rest, after.unmeasured_s) == (70.0, 70.0, None, 0)
    assert after.moved_m == 4.0


def test_whoever_rests_before_and_after_a_pause_has_rested():
    """As with the ignition off; whoever moved before it may have gone on."""
    seconds = [Epoch(float(k), STEP) for k in range(60)]
    rested = [Epoch(60.0 + k, STILL_ROW) for k in range(20)]
    for before, after_s, why in (
        (seconds + rested, 400.0, Reason.USED),
        (seconds, 400.0, Reason.MOTION_MISSING),
        (seconds, 61.0, Reason.USED),
    ):
        _, found = told([*before, Epoch(after_s, STILL_ROW)])
        assert found[-1][1] is why
        assert {reason for _, reason, _ in found[:-1]} == {Reason.USED}


@pytest.mark.parametrize(
    ("nats", "clear", "certain"),
    [(-19.5, True, True), (-19.4, True, False), (-10.5, True, False), (-10.4, False, False)],
)
def test_levels_show_a_rest_clearly_and_for_certain(nats, clear, certain):
    rest = replace(STILL, left_nats=nats)
    assert (rest.is_clear, rest.is_certain) == (clear, certain)
    # Not of one who is carried on.
    assert not rest.carried().is_clear
    assert not rest.carried().is_certain
