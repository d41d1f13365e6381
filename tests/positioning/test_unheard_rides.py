"""A walker who hears nothing for long and hardly steps: a train underground, or a basement."""

from dataclasses import replace

import pytest
from made_watch import STEP, STILL, report, told

from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.sensors.pace import Pace
from mapfilter.positioning.sensors.pauses import RowTimes
from mapfilter.positioning.sensors.unheard import is_in_doubt, was_ride

HERE, THERE = report([-70.0, -80.0, -90.0]), report([-70.0] * 6, serving="F")[3:]
PACE = Pace(rows=50, interval_s=1.0, speed_mps=1.4)
TIMES = RowTimes(epoch_s=160.0, report_s=100.0, interval_s=3.0, reports=20)


def walk(seconds=60.0, every_s=3.0, start_s=0.0, cells=HERE):
    rows = [start_s + second for second in range(int(seconds))]
    return [Epoch(at_s, STEP, cells if at_s % every_s == 0 else ()) for at_s in rows]


def quiet(start_s, seconds, steps=0):
    """Return seconds without a report, of which the first are steps."""
    return [Epoch(start_s + k, STEP if k < steps else STILL) for k in range(int(seconds))]


@pytest.mark.parametrize(
    ("changes", "stepped_m", "doubt"),
    [
        ({}, 0.0, True),
        ({"epoch_s": 159.0}, 0.0, False),
        ({}, 41.9, True),
        ({}, 42.0, False),
        ({"interval_s": 12.0}, 0.0, True),
        ({"interval_s": 12.1}, 0.0, False),
        ({"reports": 9}, 0.0, False),
    ],
)
def test_after_a_minute_of_silence_and_few_steps_a_place_is_in_doubt(changes, stepped_m, doubt):
    assert is_in_doubt(PACE, TIMES._replace(**changes), stepped_m, 1.0) is doubt


@pytest.mark.parametrize(
    "pace", [replace(PACE, rows=29), replace(PACE, speed_mps=2.6), replace(PACE, speed_mps=1.0)]
)
def test_only_of_who_is_known_to_walk(pace):
    """At 1 m/s 30 m are half of a minute's way."""
    assert not is_in_doubt(pace, TIMES, 30.0, 1.0)
    assert is_in_doubt(PACE, TIMES, 30.0, 1.0)
    # In feet that speed is a walker's.
    feet = replace(PACE, speed_mps=4.6)
    assert not is_in_doubt(feet, TIMES, 30.0, 1.0)
    assert is_in_doubt(feet, TIMES, 30.0, 0.3048)


@pytest.mark.parametrize(
    ("time_s", "stepped_m", "before", "now", "ride"),
    [
        (190.0, 0.0, HERE, THERE, True),
        (189.0, 0.0, HERE, THERE, False),
        (190.0, 63.0, HERE, THERE, False),
        (190.0, 0.0, HERE, HERE, False),
        # The serving cell of one of them is a neighbour in the other.
        (190.0, 0.0, HERE, report([-90.0, -70.0], serving="B"), False),
        (190.0, 0.0, HERE[1:], (THERE[0], replace(HERE[1], role="serving")), False),
        # No serving cell is named.
        (190.0, 0.0, HERE[1:], HERE[1:], False),
        (190.0, 0.0, HERE, THERE[:2], False),
        # Serving cells alone: another one may serve at the same place.
        (190.0, 0.0, HERE[:1], THERE, False),
        (190.0, 0.0, HERE, THERE[2:], False),
    ],
)
def test_a_ride_ends_where_other_cells_are_heard(time_s, stepped_m, before, now, ride):
    assert was_ride(PACE, TIMES, time_s, stepped_m, (before, now), 1.0) is ride


def test_neighbours_without_a_name_are_compared_by_carrier_and_code():
    coded = [replace(row, arfcn=60, bsic=k) for k, row in enumerate(HERE)]
    nameless = [coded[0], *(replace(row, cell=None) for row in coded[1:])]
    other = replace(THERE[2], arfcn=60, bsic=1), THERE[0]
    assert not was_ride(PACE, TIMES, 190.0, 0.0, (tuple(nameless), other), 1.0)
    other = replace(THERE[2], arfcn=60, bsic=7), THERE[0]
    assert was_ride(PACE, TIMES, 190.0, 0.0, (tuple(nameless), other), 1.0)


CODED = tuple(replace(row, arfcn=60, bsic=k) for k, row in enumerate(HERE))
BARE = replace(THERE[1], cell=None)


@pytest.mark.parametrize(
    ("before", "now"),
    [
        # A neighbour without a name may be the cell that served, and is none that is known.
        (HERE, (THERE[0], BARE)),
        (HERE, (*THERE, BARE)),
        ((HERE[0], replace(HERE[1], cell=None)), THERE),
        # One cell, given twice.
        (HERE, (THERE[0], THERE[0])),
        ((HERE[0], replace(HERE[0], level_dbm=-75.0)), THERE),
        # Names cannot be compared with carriers and codes.
        (HERE, tuple(replace(row, cell=None, arfcn=60, bsic=k) for k, row in enumerate(THERE))),
        (HERE, (THERE[0], replace(THERE[1], cell=None, arfcn=60, bsic=0))),
    ],
)
def test_reports_that_cannot_be_compared_tell_no_ride(before, now):
    assert not was_ride(PACE, TIMES, 190.0, 0.0, (before, now), 1.0)


def test_a_row_by_code_is_compared_with_one_that_has_name_and_code():
    coded = tuple(replace(row, cell=None, arfcn=60, bsic=7 + k) for k, row in enumerate(THERE))
    assert was_ride(PACE, TIMES, 190.0, 0.0, (CODED, coded), 1.0)
    same = replace(coded[1], bsic=0)
    assert not was_ride(PACE, TIMES, 190.0, 0.0, (CODED, (coded[0], same)), 1.0)
    # One code in another place is another cell only where names tell it; in doubt it is the same.
    again = tuple(replace(row, arfcn=60, bsic=k) for k, row in enumerate(THERE))
    assert not was_ride(PACE, TIMES, 190.0, 0.0, (CODED, again), 1.0)


def test_the_watch_follows_the_silence_and_the_steps_in_it():
    watch, _ = told(walk())
    assert not watch.is_unheard(1.0)
    # The last report came at 57 s; 20 s of a station, and a train.
    watch, _ = told(quiet(60.0, 57, steps=20), watch)
    assert not watch.is_unheard(1.0)
    watch, _ = told(quiet(117.0, 1), watch)
    # Half a minute's walk is 42 m: 22 steps of 1.4 m are less.
    assert watch.is_unheard(1.0)
    assert watch.stepped_m == pytest.approx(22 * 1.4)
    train, _ = told(quiet(118.0, 60), watch)
    there, _ = told([Epoch(178.0, STEP, THERE)], train)
    assert there.rode_unheard
    assert not there.is_unheard(1.0)
    assert there.stepped_m == 0.0
    after, _ = told([Epoch(179.0, STEP)], there)
    assert not after.rode_unheard
    same, _ = told([Epoch(178.0, STEP, HERE)], train)
    assert not same.rode_unheard


def test_who_walks_on_without_reception_is_followed():
    watch, _ = told([*walk(), *quiet(60.0, 120, steps=120)])
    assert not watch.is_unheard(1.0)
    watch, _ = told([Epoch(180.0, STEP, THERE)], watch)
    assert not watch.rode_unheard
