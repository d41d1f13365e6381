"""What becomes of a belief and its challenger: lost, replaced, confirmed, or neither."""

from dataclasses import dataclass, field, replace
from math import nan

import numpy as np
import pytest

from mapfilter.filters.contract import Status
from mapfilter.filters.hypotheses import BeliefSummary
from mapfilter.positioning.bayes.alternative import (
    AlternativeHypothesis,
    AlternativeRules,
    EvidenceCusum,
    resolve_alternative,
)

RULES = AlternativeRules(ahead=4.0, lost=10.0, lost_of_cells=6.0)
SEARCHING, CONVERGED = Status.SEARCHING, Status.CONVERGED
TRACKING, LOST = Status.TRACKING, Status.LOST


def at(east_m, mass_50m):
    mean = np.array([east_m, 0.0, 0.0, 0.0, 0.0])
    return BeliefSummary(mean, np.eye(2), np.ones(3), mass_50m, np.empty((0, 3)), 0.0)


@dataclass(frozen=True)
class Belief:
    """As much of a belief as a decision looks at."""

    status: Status
    log_evidence: float = 0.0
    agreement_start_m: float = nan
    summary: BeliefSummary = field(default_factory=lambda: at(0.0, 1.0))


def rival(ahead, *, status=SEARCHING, mass=0.5, east_m=500.0, doubt=0.0):
    belief = Belief(status, ahead, summary=at(east_m, mass))
    return AlternativeHypothesis(belief, 100.0, 0.0, doubt=EvidenceCusum(doubt))


def after(main, challenger=None, *, before=None, doubt=0.0, cells_only=False, travelled_m=200.0):
    told = main.status if before is None else before
    return resolve_alternative(
        RULES, told, main, EvidenceCusum(doubt), challenger, travelled_m, cells_only=cells_only
    )


def test_a_belief_alone_says_how_it_stands():
    for status in (SEARCHING, CONVERGED, TRACKING):
        now = after(Belief(status))
        assert (now.status, now.belief.status, now.taken_over) == (status, status, False)


def test_a_belief_in_doubt_does_not_converge():
    assert after(Belief(CONVERGED), doubt=2.4).status is CONVERGED
    now = after(Belief(CONVERGED), doubt=2.6)
    assert now.status is SEARCHING
    assert now.belief.status is SEARCHING


@pytest.mark.parametrize(("ahead", "status"), [(-3.0, CONVERGED), (-1.0, SEARCHING)])
def test_a_belief_converges_only_when_its_challenger_is_behind(ahead, status):
    now = after(Belief(CONVERGED), rival(ahead))
    assert now.status is status
    assert now.belief.status is status
    assert now.challenger is not None


@pytest.mark.parametrize(
    ("ahead", "cells_only", "status"),
    [(9.0, False, TRACKING), (11.0, False, LOST), (5.0, True, TRACKING), (7.0, True, LOST)],
)
def test_a_found_belief_is_lost_on_strong_evidence_only(ahead, cells_only, status):
    now = after(Belief(TRACKING), rival(ahead), cells_only=cells_only)
    assert now.status is status
    # It is kept beside its challenger until that one has converged.
    assert now.belief.status is TRACKING
    assert now.challenger is not None


def test_a_lost_belief_that_catches_up_is_tracking_again():
    assert after(Belief(TRACKING), rival(1.0), before=LOST).status is TRACKING


def test_a_challenger_ahead_goes_on_with_a_search():
    now = after(Belief(SEARCHING), rival(5.0), doubt=7.0)
    assert (now.status, now.taken_over, now.challenger) == (SEARCHING, True, None)
    assert now.belief.log_evidence == 5.0
    assert now.doubt.sum == 0.0


def test_a_challenger_that_has_converged_far_ahead_wins():
    lost = after(Belief(TRACKING), rival(12.0, status=CONVERGED, mass=0.99), before=LOST)
    assert (lost.status, lost.belief.status, lost.taken_over) == (TRACKING, TRACKING, True)
    found = after(Belief(SEARCHING), rival(12.0, status=CONVERGED, mass=0.99))
    assert (found.status, found.belief.status, found.taken_over) == (CONVERGED, CONVERGED, True)


def test_a_challenger_in_doubt_of_itself_does_not_win():
    now = after(Belief(TRACKING), rival(12.0, status=TRACKING, mass=0.99, doubt=3.0), before=LOST)
    assert (now.status, now.taken_over) == (LOST, False)


def test_a_challenger_in_grave_doubt_of_itself_is_challenged_in_its_turn():
    other = rival(12.0, status=TRACKING, mass=0.99, doubt=6.0)
    now = after(Belief(TRACKING), other, before=LOST, doubt=30.0)
    assert (now.status, now.taken_over, now.challenger) == (LOST, True, None)
    assert now.belief.status is SEARCHING
    assert now.doubt.sum == 6.0


def test_one_who_is_lost_is_so_until_something_is_found():
    assert after(Belief(SEARCHING), before=LOST).status is LOST
    assert after(Belief(SEARCHING), rival(0.0), before=LOST).status is LOST
    now = after(Belief(CONVERGED), before=LOST)
    assert (now.status, now.belief.status) == (TRACKING, TRACKING)


def test_both_at_one_place_confirm_the_belief():
    now = after(Belief(TRACKING), rival(-1.0, mass=0.95, east_m=20.0), before=LOST, doubt=8.0)
    assert (now.status, now.taken_over, now.challenger) == (TRACKING, False, None)
    assert now.doubt.sum == 0.0


@pytest.mark.parametrize(("ahead", "travelled_m"), [(-30.0, 200.0), (0.0, 1000.0)])
def test_a_challenger_gives_up(ahead, travelled_m):
    now = after(Belief(TRACKING), rival(ahead), travelled_m=travelled_m)
    assert (now.status, now.taken_over, now.challenger) == (TRACKING, False, None)


def test_what_satellites_add_counts():
    by_sky = replace(rival(0.0), by_satellites=11.0)
    assert after(Belief(TRACKING), by_sky).status is LOST
