"""A belief and its alternative: lost, replaced, confirmed, or neither."""

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

RULES = AlternativeRules(search_threshold=4.0, lost_threshold=10.0, lost_threshold_cells=6.0)
SEARCHING, CONVERGED = Status.SEARCHING, Status.CONVERGED
TRACKING, LOST = Status.TRACKING, Status.LOST


def at(east_m, mass_50m):
    mean = np.array([east_m, 0.0, 0.0, 0.0, 0.0])
    return BeliefSummary(mean, np.eye(2), np.ones(3), mass_50m, np.empty((0, 3)), 0.0)


@dataclass(frozen=True)
class Belief:
    """The part of a belief that decisions depend on."""

    status: Status
    log_evidence: float = 0.0
    agreement_start_m: float = nan
    summary: BeliefSummary = field(default_factory=lambda: at(0.0, 1.0))


def rival(lead, *, status=SEARCHING, mass=0.5, east_m=500.0, cusum=0.0):
    belief = Belief(status, lead, summary=at(east_m, mass))
    return AlternativeHypothesis(belief, 100.0, 0.0, cusum=EvidenceCusum(cusum))


def after(main, other=None, *, before=None, cusum=0.0, cells_only=False, travelled_m=200.0):
    usual = SEARCHING if main.status is CONVERGED else main.status
    reported = usual if before is None else before
    return resolve_alternative(
        RULES, reported, main, EvidenceCusum(cusum), other, travelled_m, cells_only=cells_only
    )


def test_a_belief_alone_keeps_its_status():
    for status in (SEARCHING, CONVERGED, TRACKING):
        now = after(Belief(status))
        assert (now.status, now.belief.status, now.taken_over) == (status, status, False)


def test_a_belief_with_a_large_cusum_does_not_converge():
    assert after(Belief(CONVERGED), cusum=2.4).status is CONVERGED
    now = after(Belief(CONVERGED), cusum=2.6)
    assert now.status is SEARCHING
    assert now.belief.status is SEARCHING


@pytest.mark.parametrize(("lead", "status"), [(-3.0, CONVERGED), (-1.0, SEARCHING)])
def test_a_belief_converges_only_when_its_alternative_is_behind(lead, status):
    now = after(Belief(CONVERGED), rival(lead))
    assert now.status is status
    assert now.belief.status is status
    assert now.alternative is not None


@pytest.mark.parametrize(
    ("lead", "cells_only", "status"),
    [(9.0, False, TRACKING), (11.0, False, LOST), (5.0, True, TRACKING), (7.0, True, LOST)],
)
def test_a_found_belief_is_lost_on_strong_evidence_only(lead, cells_only, status):
    now = after(Belief(TRACKING), rival(lead), cells_only=cells_only)
    assert now.status is status
    # It is kept beside its alternative until that one has converged.
    assert now.belief.status is TRACKING
    assert now.alternative is not None


def test_a_lost_belief_that_catches_up_is_tracking_again():
    assert after(Belief(TRACKING), rival(1.0), before=LOST).status is TRACKING


def test_an_alternative_ahead_goes_on_with_a_search():
    now = after(Belief(SEARCHING), rival(5.0), cusum=7.0)
    assert (now.status, now.taken_over, now.alternative) == (SEARCHING, True, None)
    assert now.belief.log_evidence == 5.0
    assert now.cusum.sum == 0.0


def test_an_alternative_that_has_converged_far_ahead_takes_over():
    lost = after(Belief(TRACKING), rival(12.0, status=CONVERGED, mass=0.99), before=LOST)
    assert (lost.status, lost.belief.status, lost.taken_over) == (TRACKING, TRACKING, True)
    found = after(Belief(SEARCHING), rival(12.0, status=CONVERGED, mass=0.99))
    assert (found.status, found.belief.status, found.taken_over) == (CONVERGED, CONVERGED, True)


def test_an_alternative_with_a_cusum_of_its_own_does_not_win():
    now = after(Belief(TRACKING), rival(12.0, status=TRACKING, mass=0.99, cusum=3.0), before=LOST)
    assert (now.status, now.taken_over) == (LOST, False)


def test_a_suspect_alternative_takes_over_the_search_with_its_cusum():
    other = rival(12.0, status=TRACKING, mass=0.99, cusum=6.0)
    now = after(Belief(TRACKING), other, before=LOST, cusum=30.0)
    assert (now.status, now.taken_over, now.alternative) == (LOST, True, None)
    assert now.belief.status is SEARCHING
    assert now.cusum.sum == 6.0


def test_lost_is_reported_until_a_belief_converges():
    assert after(Belief(SEARCHING), before=LOST).status is LOST
    assert after(Belief(SEARCHING), rival(0.0), before=LOST).status is LOST
    now = after(Belief(CONVERGED), before=LOST)
    assert (now.status, now.belief.status) == (TRACKING, TRACKING)


def test_both_at_one_place_confirm_the_belief():
    now = after(Belief(TRACKING), rival(-1.0, mass=0.95, east_m=20.0), before=LOST, cusum=8.0)
    assert (now.status, now.taken_over, now.alternative) == (TRACKING, False, None)
    assert now.cusum.sum == 0.0


@pytest.mark.parametrize(("lead", "travelled_m"), [(-30.0, 200.0), (0.0, 1000.0)])
def test_an_alternative_is_abandoned(lead, travelled_m):
    now = after(Belief(TRACKING), rival(lead), travelled_m=travelled_m)
    assert (now.status, now.taken_over, now.alternative) == (TRACKING, False, None)


def test_the_bayes_factor_of_satellites_counts():
    by_gnss = replace(rival(0.0), gnss_log_bayes_factor=11.0)
    assert after(Belief(TRACKING), by_gnss).status is LOST
