"""Rivals of a belief, and the null hypothesis beside it, by hand."""

from dataclasses import replace
from math import nan
from types import SimpleNamespace

import numpy as np
import pytest
from made_filters import (
    RULES,
    SEARCHING,
    STATE,
    TERM,
    TRACKING,
    UPDATES,
    Beliefs,
    Source,
    belief,
    gaining,
)

from mapfilter.filters.contract import Reason, Status
from mapfilter.models.level_errors import LevelReport
from mapfilter.positioning.bayes.rivals.alternative import NullHypothesis
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.rivals import Rivals, challenged, for_belief
from mapfilter.positioning.bayes.sources.evidence import EvidenceUpdate, RadioReading

STRICT = replace(RULES, converge_log_odds=-20.0)
"""A search has to refute the null hypothesis by so much."""


@pytest.mark.parametrize(
    ("status", "least"), [(SEARCHING, -23.0), (TRACKING, -12.0), (Status.CONVERGED, -12.0)]
)
def test_beside_a_search_the_null_hypothesis_may_become_less_probable(status, least):
    before = belief(status)
    after = replace(before, log_evidence=before.log_evidence + 90.0)
    found = challenged(STRICT, NullHypothesis(-10.0, 40.0), RadioReading(), before, after)
    assert found.log_odds == least


NOTHING = np.zeros(0, dtype=np.int32)
LEVELS = LevelReport(
    NOTHING, NOTHING.astype("f4"), NOTHING, NOTHING.astype("f4"), 0.0
)  # fmt: skip


def test_the_null_hypothesis_gains_what_the_belief_loses_by_metres_and_readings():
    """0.1 nats a metre; -1.5 of terms, and what levels have without a prediction."""
    before, shared = belief(), SimpleNamespace(other_log_likelihood=-4.0)
    after = replace(before, log_evidence=-13.0, travelled_m=50.0, shared=shared)
    null = NullHypothesis(-2.0, 40.0)
    plain, heard = RadioReading(under_null=-1.5), RadioReading(levels=LEVELS, under_null=-1.5)
    for reading, other in ((plain, 0.0), (heard, -4.0)):
        found = challenged(RULES, null, reading, before, after)
        assert found.log_odds == pytest.approx(-2.0 - 1.5 + other + 3.0 - 1.0)
        assert found.travelled_m == 50.0
    bare = challenged(RULES, null, heard, before, replace(after, shared=None))
    assert bare.log_odds == pytest.approx(-2.0 - 1.5 + 3.0 - 1.0)


@pytest.mark.parametrize("measured", [True, False])
@pytest.mark.parametrize("status", [TRACKING, SEARCHING])
def test_a_reading_is_tracked_where_the_belief_and_its_motion_are(measured, status):
    found = for_belief(RadioReading(serving=2), belief(status), measured=measured)
    assert found == RadioReading(serving=2, tracked=measured and status is TRACKING)


def unaided(log_evidence, *, name=0.0, scratch=False, status=TRACKING, east_m=800.0):
    """A belief without positions; where it began is its name."""
    own = belief(status, log_evidence, east_m=east_m)
    null = NullHypothesis(-6.0, 30.0)
    return HeldOtherwise(own, Hold(), -9.0, name, null, nan, from_scratch=scratch)


def after_a_report(*rivals, gained=-2.0, main=None, proven=False, reason=Reason.USED):
    """The state after a report that the main belief has been weighed by."""
    beliefs = Beliefs(held_otherwise=gaining(gained, reason=reason), filter=gaining(gained))
    given = replace(STATE, unaided=rivals, proven=proven, belief=main or STATE.belief)
    rules = Rivals(beliefs, (Source(),))
    return rules.unaided(given, UPDATES, 9.0, measured=True), beliefs


def test_beliefs_without_positions_that_are_open_go_on_each_by_its_filter():
    followed, scratch = unaided(-10.0, name=1.0), unaided(-20.0, name=2.0, scratch=True)
    found, beliefs = after_a_report(followed, scratch)
    assert [one.start_m for one in found.unaided] == [1.0, 2.0]
    assert [one.belief.log_evidence for one in found.unaided] == [-12.0, -22.0]
    assert len(beliefs.held_otherwise.readings) == len(beliefs.filter.readings) == 1
    assert not found.proven
    # One that began as the belief is given up at -8 nats, one from scratch at -25.
    found, _ = after_a_report(unaided(-40.0, name=1.0), scratch)
    assert [one.start_m for one in found.unaided] == [2.0]


@pytest.mark.parametrize(
    ("one", "proven", "left"),
    [
        # Behind at the same place; elsewhere it is not known yet; far behind wherever it is.
        (unaided(-22.0, scratch=True, east_m=510.0), True, 0),
        (unaided(-22.0, scratch=True), False, 1),
        (unaided(-22.0, scratch=True, east_m=510.0, status=SEARCHING), False, 1),
        (unaided(-10.0, scratch=True, east_m=510.0), False, 1),
        (unaided(-34.0, scratch=True, status=SEARCHING), True, 0),
    ],
)
def test_what_proves_a_belief_that_positions_have_found(one, proven, left):
    found, _ = after_a_report(one)
    assert (found.proven, len(found.unaided)) == (proven, left)
    # What was proven stays so.
    assert after_a_report(one, proven=True)[0].proven


def test_one_from_scratch_that_has_been_tried_for_long_proves_it_too():
    old = replace(unaided(-12.0, scratch=True), start_m=40.0 - 1200.0)
    found, _ = after_a_report(old)
    assert (found.proven, found.unaided) == (True, ())
    followed = replace(unaided(-12.0), start_m=40.0 - 1200.0)
    found, _ = after_a_report(followed)
    assert (found.proven, found.unaided) == (False, ())


def test_beside_a_search_only_one_from_scratch_or_one_ahead_goes_on():
    searching = belief(SEARCHING)
    rivals = unaided(-10.0, name=1.0), unaided(-12.0, name=2.0, scratch=True)
    found, _ = after_a_report(*rivals, main=searching)
    assert [one.start_m for one in found.unaided] == [2.0]
    ahead = replace(unaided(-1.0, name=3.0), ahead_m=-100.0, log_prior=-2.0)
    found, _ = after_a_report(ahead, main=searching)
    assert [one.start_m for one in found.unaided] == [3.0]


def test_one_that_explains_nothing_is_given_up_and_one_without_a_reading_stays():
    given = unaided(-10.0, name=1.0)
    assert after_a_report(given, reason=Reason.UPDATE_FAILED)[0].unaided == ()
    (stays,) = after_a_report(given, reason=Reason.NO_READING)[0].unaided
    assert stays.belief is given.belief


def test_one_that_has_converged_is_tracked():
    (one,) = after_a_report(unaided(-10.0, status=Status.CONVERGED))[0].unaided
    assert one.belief.status is TRACKING


def test_without_rivals_a_state_stays():
    rivals = Rivals(Beliefs(), (Source(),))
    assert rivals.unaided(STATE, UPDATES, 9.0, measured=True) is STATE
    assert rivals.turned(STATE, RadioReading(terms=(TERM,)), 9.0, measured=True) is STATE
    grid = replace(STATE, belief=SimpleNamespace(), unaided=(unaided(-10.0),))
    assert rivals.unaided(grid, [EvidenceUpdate(None)], 9.0, measured=True) is grid
