"""When beliefs may wait for a leg: the rule, by hand."""

from dataclasses import replace
from math import nan
from types import SimpleNamespace

import pytest
from made_filters import belief

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.positioning.bayes.sources.usable import UsableEpoch
from mapfilter.positioning.bayes.state import BayesState, Reported
from mapfilter.positioning.bayes.waiting import report_alone, waits
from mapfilter.positioning.epochs import Difference, Epoch, GnssFix, Pseudorange, ReportRow
from mapfilter.positioning.sensors.rest import Rest

TRACKED = BayesState(status=Status.TRACKING, belief=belief(), sources={"radio": 40.0})
HEARD = ReportRow("serving", "a", None, None, -70.0, 0)
RADIO = SimpleNamespace(name="radio", due=lambda used_m, travelled_m: travelled_m - used_m >= 5)
REST = Rest(0.0, pace_mps=1.4)
DOUBTFUL = replace(REST, is_doubtful=True)
LATE = replace(REST, since_s=-40.0)


def rule(state=TRACKED, after=None, motion=Reason.USED, *, ahead=False, by_map=False, **measured):
    """The rule for an epoch with a step, with the sensors after it."""
    epoch = Epoch(1.0, (MotionStep(1.4, 0.3),), **measured)
    usable = UsableEpoch(state.watch._replace(**after or {}), epoch, motion, Reason.USED, [])
    beliefs = SimpleNamespace(
        map_may_start=by_map,
        is_contested=lambda _: ahead,
        left_share=lambda _, watch: 0.01 if watch.rest is LATE else 0.0,
    )
    return waits(beliefs, RADIO, state, usable)


def rested(rest):
    return replace(TRACKED, watch=TRACKED.watch._replace(rest=rest))


@pytest.mark.parametrize(
    ("before", "after"), [(None, {}), (None, {"rest": REST}), (REST, {"rest": REST})]
)
def test_who_walks_or_rests_waits_until_a_report_is_due(before, after):
    assert rule(rested(before), after)(1e6)
    found = rule(rested(before), after, radio=(HEARD,))
    assert (found(44.0), found(45.0)) == (True, False)


def test_rows_without_a_number_measure_nothing():
    unranged = Pseudorange("G01", nan, nan, (nan, nan, nan))
    assert rule(pseudoranges=(unranged,), tdoa=(Difference("a", "b", nan),))(1e6)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (None, {"rest": DOUBTFUL}),
        # One may have left unnoticed by now, or levels have shown the rest only now.
        (REST, {"rest": LATE}),
        (LATE, {"rest": REST}),
        (None, {"rode_unheard": True}),
        (None, {"rest": REST, "rode_unheard": True}),
        # Who goes on after a rest may have been carried.
        (REST, {"rest": None}),
    ],
)
def test_who_may_be_elsewhere_does_not_wait(before, after):
    assert rule(rested(before), after) is None


@pytest.mark.parametrize(
    "measured",
    [
        {"gnss": GnssFix(500_300.0, 4_500_300.0)},
        {"radio": (replace(HEARD, timing_advance=1.0),)},
        {"pseudoranges": (Pseudorange("G01", 2e7, 5.0, (2e7, 0.0, 0.0)),)},
        {"tdoa": (Difference("a", "b", 40.0),)},
    ],
)
def test_what_is_compared_with_beliefs_does_not_wait(measured):
    assert rule(**measured) is None


@pytest.mark.parametrize(
    "more",
    [
        {"motion": Reason.MOTION_STUCK}, {"ahead": True}, {"by_map": True},
        {"state": replace(TRACKED, contested=True)}, {"state": replace(TRACKED, belief=None)},
        {"state": replace(TRACKED, status=Status.CONVERGED)},
        # What was reported is of another belief: nobody has judged this one.
        {"state": TRACKED.with_output(Reported(belief(), Status.TRACKING, 0.0, None))},
    ],
)  # fmt: skip
def test_a_belief_in_doubt_does_not_wait(more):
    assert rule(**more) is None


def test_what_is_not_certain_enough_waits_too():
    assert rule(replace(TRACKED, status=Status.UNCERTAIN))(1e6)


def test_a_belief_that_was_reported_waits():
    reported = Reported(TRACKED.belief, Status.TRACKING, 0.0, None)
    assert rule(TRACKED.with_output(reported))(1e6)


def test_while_beliefs_wait_the_report_alone_is_asked_for_why_it_is_not_used():
    source = SimpleNamespace(name="radio", read=lambda used, _, epoch, __: (used, epoch.time_s))
    assert report_alone(source, TRACKED, Epoch(7.0, radio=(HEARD,))) == [(40.0, 7.0)]


@pytest.mark.parametrize(
    "rows",
    [
        {"gnss": GnssFix(500_300.0, 4_500_300.0)},
        {"pseudoranges": (Pseudorange("G01", nan, nan, (nan, nan, nan)),)},
        {"tdoa": (Difference("a", "b", nan),)},
    ],
)
def test_rows_of_other_kinds_are_told_by_their_own_sources(rows):
    assert report_alone(SimpleNamespace(), TRACKED, Epoch(7.0, **rows)) is None
