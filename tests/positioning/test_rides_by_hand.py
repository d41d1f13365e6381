"""When a walker may be anywhere after a bus or a train, by hand."""

from dataclasses import replace
from math import inf

import pytest

from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.rides import rides_unheard, rode
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.gnss.source import GnssSource
from mapfilter.positioning.gnss.state import GnssState
from mapfilter.positioning.sensors.pace import Pace
from mapfilter.positioning.sensors.pauses import RowTimes
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.watch import SensorWatch

RIDE = Rest(100.0, pace_mps=1.4, carried_nats=9.0)
"""Since 100 s; by its levels one was carried on."""
BEFORE = SensorWatch(rest=RIDE, times=RowTimes(epoch_s=400.0, report_s=150.0))
AFTER = SensorWatch()


def state(watch=BEFORE, compared_at_s=-inf, **more):
    return BayesState(
        watch=watch, sources={GnssSource.name: GnssState(compared_at_s=compared_at_s)}, **more
    )


def test_a_ride_is_one_that_is_long_and_was_not_measured():
    assert RIDE.is_carried
    longest_s = next(s for s in range(1, 2000) if RIDE.was_ride(100.0 + s))
    assert rode(state(), AFTER, 100.0 + longest_s)
    assert not rode(state(), AFTER, 100.0 + longest_s - 1)
    # It goes on, or there was none.
    assert not rode(state(), AFTER._replace(rest=RIDE), 100.0 + longest_s)
    assert not rode(state(AFTER), AFTER, 100.0 + longest_s)


@pytest.mark.parametrize(
    ("rest", "compared_at_s", "unheard", "anywhere"),
    [
        # A position tells the place if it is of no earlier time than the ride's beginning,
        (RIDE, 99.9, False, True),
        (RIDE, 100.0, False, False),
        (RIDE, 120.0, False, False),
        # or than the last report before a silence; of both the earlier counts.
        (None, 149.9, True, True),
        (None, 150.0, True, False),
        (RIDE, 120.0, True, False),
        (RIDE, 99.9, True, True),
        (replace(RIDE, since_s=200.0), 149.9, True, True),
        (replace(RIDE, since_s=200.0), 150.0, True, False),
        (None, -inf, False, False),
    ],
)
def test_a_position_since_then_tells_the_place(rest, compared_at_s, unheard, anywhere):
    given = state(BEFORE._replace(rest=rest), compared_at_s)
    assert rode(given, AFTER._replace(rode_unheard=unheard), 5000.0) is anywhere


@pytest.mark.parametrize(
    ("compared_at_s", "speed_mps", "unit_m", "unheard"),
    [
        (99.0, 1.4, 1.0, True),
        (100.0, 1.4, 1.0, False),
        (-inf, 4.6, 1.0, False),
        (-inf, 4.6, 0.3048, True),
    ],
)
def test_who_hardly_steps_and_hears_nothing_may_have_left(
    compared_at_s, speed_mps, unit_m, unheard
):
    """As no one but a walker, in the unit of the steps."""
    times = RowTimes(epoch_s=160.0, report_s=100.0, interval_s=3.0, reports=20)
    watch = SensorWatch(Pace(rows=50, interval_s=1.0, speed_mps=speed_mps), times=times)
    given = state(watch, compared_at_s, hold=Hold(step_unit_m=unit_m))
    assert rides_unheard(given) is unheard
