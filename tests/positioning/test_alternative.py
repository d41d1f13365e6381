"""A belief, its alternative and the null hypothesis: lost, replaced, confirmed, or neither."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import exp, log, nan

import numpy as np
import pytest

from mapfilter.filters.contract import Status
from mapfilter.filters.hypotheses import BeliefSummary
from mapfilter.models.level_errors import LevelReport
from mapfilter.positioning.bayes.rivals.alternative import (
    AlternativeHypothesis,
    AlternativeRules,
    NullHypothesis,
)
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.transitions import (
    TRANSITIONS,
    Outcome,
    doubted,
    judge,
    report,
    resolve_alternative,
)
from mapfilter.positioning.bayes.sources.evidence import RadioReading

RULES = AlternativeRules(
    start_log_odds=-3.0, search_threshold=4.0, lost_threshold=10.0, converge_log_odds=-5.0,
    converge_threshold=2.0,
)  # fmt: skip
CALM = -11.0
"""Log odds of a null hypothesis that is next to impossible."""
SEARCHING, CONVERGED = Status.SEARCHING, Status.CONVERGED
TRACKING, LOST, OUTSIDE = Status.TRACKING, Status.LOST, Status.OUTSIDE


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


def rival(lead, *, status=SEARCHING, mass=0.5, east_m=500.0, null=CALM):
    belief = Belief(status, lead, summary=at(east_m, mass))
    return AlternativeHypothesis(belief, 100.0, 0.0, null=NullHypothesis(null))


def after(main, other=None, *, before=None, null=CALM, travelled_m=200.0, at_edge=False):
    usual = SEARCHING if main.status is CONVERGED else main.status
    reported = usual if before is None else before
    null = NullHypothesis(null)
    return resolve_alternative(RULES, reported, main, null, other, travelled_m, at_edge=at_edge)


def test_a_belief_alone_keeps_its_status():
    for status in (SEARCHING, CONVERGED, TRACKING):
        now = after(Belief(status))
        assert (now.status, now.belief.status, now.taken_over) == (status, status, False)


@pytest.mark.parametrize(("log_odds", "status"), [(-5.0, CONVERGED), (-4.9, SEARCHING)])
def test_a_belief_converges_only_when_the_null_hypothesis_is_improbable(log_odds, status):
    now = after(Belief(CONVERGED), null=log_odds)
    assert now.status is now.belief.status is status
    assert now.null.log_odds == log_odds


@pytest.mark.parametrize(("lead", "status"), [(-3.0, CONVERGED), (-1.0, SEARCHING)])
def test_a_belief_converges_only_when_its_alternative_is_behind(lead, status):
    now = after(Belief(CONVERGED), rival(lead))
    assert now.status is status
    assert now.belief.status is status
    assert now.alternative is not None


@pytest.mark.parametrize(("lead", "status"), [(9.9, TRACKING), (10.0, LOST)])
def test_a_found_belief_is_lost_on_strong_evidence_only(lead, status):
    now = after(Belief(TRACKING), rival(lead))
    assert now.status is status
    # It is kept beside its alternative until that one has converged.
    assert now.belief.status is TRACKING
    assert now.alternative is not None


def test_a_found_belief_is_lost_while_the_null_hypothesis_is_more_probable():
    assert after(Belief(TRACKING), null=0.0).status is TRACKING
    lost = after(Belief(TRACKING), null=0.1)
    assert (lost.status, lost.belief.status, lost.taken_over) == (LOST, TRACKING, False)
    # It comes back when the null hypothesis is as improbable as it must be to converge.
    assert after(Belief(TRACKING), before=LOST, null=-4.9).status is LOST
    assert after(Belief(TRACKING), before=LOST, null=-5.0).status is TRACKING


def test_a_found_belief_at_the_edge_is_outside_where_the_null_hypothesis_is_more_probable():
    assert after(Belief(TRACKING), null=0.0, at_edge=True).status is TRACKING
    out = after(Belief(TRACKING), null=0.1, at_edge=True)
    assert (out.status, out.belief.status) == (OUTSIDE, TRACKING)
    # Once outside it stays there, wherever it believes itself, until that is improbable.
    for status in (TRACKING, SEARCHING):
        assert after(Belief(status), before=OUTSIDE, null=-4.9).status is OUTSIDE
        assert after(Belief(status), before=OUTSIDE, null=-5.0).status is status
    assert after(Belief(TRACKING), before=LOST, null=-4.9, at_edge=True).status is OUTSIDE
    back = after(Belief(CONVERGED), before=OUTSIDE, null=-5.0)
    assert (back.status, back.belief.status) == (CONVERGED, CONVERGED)
    assert after(Belief(CONVERGED), before=OUTSIDE, null=-4.9).status is OUTSIDE


@pytest.mark.parametrize("status", [SEARCHING, CONVERGED, TRACKING])
def test_a_belief_that_has_left_the_area_is_outside_however_probable(status):
    gone = resolve_alternative(
        RULES, SEARCHING, Belief(status), NullHypothesis(CALM), None, 200.0, at_edge=True, gone=True
    )
    assert (gone.status, gone.belief.status) == (OUTSIDE, status)
    # When it comes back it goes on as it was.
    back = after(gone.belief, before=OUTSIDE, at_edge=True)
    assert back.status is status


def test_a_search_is_outside_where_the_null_hypothesis_is_more_probable():
    assert after(Belief(SEARCHING), null=0.0).status is SEARCHING
    out = after(Belief(SEARCHING), null=0.1)
    assert (out.status, out.belief.status, out.null.log_odds) == (OUTSIDE, SEARCHING, 0.1)
    # One that had been found is lost: where it was is known.
    assert after(Belief(SEARCHING), before=LOST, null=0.1).status is LOST


@pytest.mark.parametrize("before", [CONVERGED, TRACKING])
def test_a_found_belief_that_splits_is_lost(before):
    now = after(Belief(SEARCHING), before=before)
    assert (now.status, now.belief.status) == (LOST, SEARCHING)


def test_a_lost_belief_that_catches_up_is_tracking_again():
    assert after(Belief(TRACKING), rival(1.0), before=LOST).status is TRACKING


def test_an_alternative_ahead_goes_on_with_a_search():
    now = after(Belief(SEARCHING), rival(5.0, null=-2.5), null=7.0)
    assert (now.status, now.taken_over, now.alternative) == (SEARCHING, True, None)
    assert now.belief.log_evidence == 5.0
    # Beside the alternative the null hypothesis is as probable as it was there.
    assert now.null.log_odds == -2.5


def test_an_alternative_that_has_converged_far_ahead_takes_over():
    lost = after(Belief(TRACKING), rival(12.0, status=CONVERGED, mass=0.99), before=LOST)
    assert (lost.status, lost.belief.status, lost.taken_over) == (TRACKING, TRACKING, True)
    found = after(Belief(SEARCHING), rival(12.0, status=CONVERGED, mass=0.99))
    assert (found.status, found.belief.status, found.taken_over) == (CONVERGED, CONVERGED, True)


@pytest.mark.parametrize("null", [-4.9, 0.0])
def test_an_alternative_that_the_null_hypothesis_rivals_does_not_win(null):
    now = after(Belief(TRACKING), rival(12.0, status=TRACKING, mass=0.99, null=null), before=LOST)
    assert (now.status, now.taken_over) == (LOST, False)


def test_a_suspect_alternative_takes_over_the_search_with_its_null_hypothesis():
    other = rival(12.0, status=TRACKING, mass=0.99, null=0.1)
    now = after(Belief(TRACKING), other, before=LOST, null=12.0)
    assert (now.status, now.taken_over, now.alternative) == (LOST, True, None)
    assert now.belief.status is SEARCHING
    assert np.isnan(now.belief.agreement_start_m)
    assert now.null.log_odds == 0.1


def test_lost_is_reported_until_a_belief_converges():
    assert after(Belief(SEARCHING), before=LOST).status is LOST
    assert after(Belief(SEARCHING), rival(0.0), before=LOST).status is LOST
    now = after(Belief(CONVERGED), before=LOST)
    assert (now.status, now.belief.status) == (TRACKING, TRACKING)
    assert after(Belief(CONVERGED), before=LOST, null=-4.0).status is LOST


PRIOR = log(1 / 19)


@pytest.mark.parametrize(("null", "reset"), [(8.0, PRIOR), (-2.0, PRIOR), (-9.0, -9.0)])
def test_both_at_one_place_confirm_the_belief(null, reset):
    now = after(Belief(TRACKING), rival(-1.0, mass=0.95, east_m=20.0), before=LOST, null=null)
    # Lost before, it needs no doubt to come back: the null hypothesis as at the start is one.
    assert now.status is (TRACKING if reset < -5 else LOST)
    assert (now.taken_over, now.alternative) == (False, None)
    assert now.null.log_odds == pytest.approx(reset)


@pytest.mark.parametrize(
    ("east_m", "north_m", "mass", "outcome"),
    [
        (30.0, 40.0, 0.9, Outcome.CONFIRMED),
        (-30.0, -40.0, 0.9, Outcome.CONFIRMED),
        (30.0, 40.0, 0.89, Outcome.UNDECIDED),
        (30.0, 41.0, 0.9, Outcome.UNDECIDED),
        (-31.0, 40.0, 0.9, Outcome.UNDECIDED),
        (0.0, -51.0, 0.9, Outcome.UNDECIDED),
    ],
)
def test_one_place_is_fifty_metres_to_all_sides(east_m, north_m, mass, outcome):
    own, place = at(0.0, 1.0), at(0.0, mass)
    own.mean[:2] = 400.0, 700.0
    place.mean[:2] = 400.0 + east_m, 700.0 + north_m
    other = AlternativeHypothesis(Belief(SEARCHING, 0.0, summary=place), 100.0, 0.0)
    assert judge(RULES, Belief(TRACKING, summary=own), other, 200.0) is outcome


@pytest.mark.parametrize(
    ("status", "null", "outcome"),
    [(CONVERGED, -5.0, Outcome.WON), (TRACKING, -5.0, Outcome.WON), (TRACKING, -4.9, Outcome.AHEAD),
     (SEARCHING, -9.0, Outcome.AHEAD), (SEARCHING, 0.0, Outcome.AHEAD),
     (SEARCHING, 0.1, Outcome.SUSPECT), (TRACKING, 0.1, Outcome.SUSPECT)],
)  # fmt: skip
def test_what_an_alternative_ahead_has_shown(status, null, outcome):
    other = rival(10.0, status=status, null=null)
    assert judge(RULES, Belief(TRACKING), other, 200.0) is outcome
    at_once = replace(RULES, takes_over_searching=True)
    suspect = Outcome.WON if outcome is Outcome.WON else Outcome.SUSPECT
    assert judge(at_once, Belief(TRACKING), other, 200.0) is suspect


@pytest.mark.parametrize(
    ("lead", "travelled_m", "outcome"),
    [(-24.9, 899.9, Outcome.UNDECIDED), (-25.0, 200.0, Outcome.ABANDONED),
     (0.0, 900.0, Outcome.ABANDONED)],
)  # fmt: skip
def test_when_an_alternative_is_given_up(lead, travelled_m, outcome):
    """It began at 100 m."""
    assert judge(RULES, Belief(TRACKING), rival(lead), travelled_m) is outcome


def test_the_distance_of_agreement_stays_unless_the_search_begins_anew():
    for lead, status, start_m in ((12.0, CONVERGED, 70.0), (5.0, SEARCHING, nan)):
        other = rival(lead, status=status, null=-6.0)
        other = replace(other, belief=replace(other.belief, agreement_start_m=70.0))
        now = after(Belief(SEARCHING), other)
        assert now.taken_over
        assert now.belief.agreement_start_m == pytest.approx(start_m, nan_ok=True)


@dataclass(frozen=True)
class Summed:
    """A belief that adds itself up when it is asked."""

    status: Status

    @cached_property
    def summary(self):
        return at(0.0, 1.0)


def test_a_belief_that_is_tracked_keeps_the_sums_it_had():
    found = Summed(CONVERGED)
    belief, status = report(CONVERGED, found, CONVERGED)
    assert (status, belief.status) == (TRACKING, TRACKING)
    assert belief.summary is found.summary
    for before, now in ((SEARCHING, CONVERGED), (TRACKING, TRACKING), (LOST, SEARCHING)):
        assert report(before, found, now) == (found, LOST if before is LOST else now)


@pytest.mark.parametrize(("lead", "travelled_m"), [(-30.0, 200.0), (0.0, 900.0)])
def test_an_alternative_is_abandoned(lead, travelled_m):
    now = after(Belief(TRACKING), rival(lead), null=-2.0, travelled_m=travelled_m)
    assert (now.status, now.taken_over, now.alternative) == (TRACKING, False, None)
    assert now.null.log_odds == pytest.approx(PRIOR)


def test_the_bayes_factor_of_satellites_counts():
    by_gnss = replace(rival(0.0), gnss_log_bayes_factor=11.0)
    assert after(Belief(TRACKING), by_gnss).status is LOST


def test_the_bayes_factor_is_the_lead_in_evidence_since_the_alternative_began():
    """The belief had lost 10 nats by then and 20 since; the alternative lost 15."""
    main, belief = Belief(TRACKING, -30.0), Belief(SEARCHING, -15.0)
    other = AlternativeHypothesis(belief, 100.0, -10.0)
    assert other.log_bayes_factor(main) == 5.0
    assert replace(other, gnss_log_bayes_factor=2.0).log_bayes_factor(main) == 7.0
    # Beside a belief that was improbable beforehand it leads by so much more.
    for log_prior in (-2.0, 3.0):
        beside = other.beside(log_prior)
        assert beside.log_bayes_factor(main) == 5.0 - log_prior
        assert (beside.start_m, beside.belief) == (100.0, belief)
    assert (other.hold, other.gnss_log_bayes_factor, other.sources) == (Hold(), 0.0, {})
    assert other.null == NullHypothesis()
    assert NullHypothesis().travelled_m == 0.0


TABLE = """
none, undecided  any        belief            its own    kept     kept
confirmed        any        belief            its own    reset    dropped
abandoned        any        belief            its own    reset    dropped
ahead            searching  other, SEARCHING  SEARCHING  other's  took over
ahead            found      belief            LOST       kept     kept
ahead, suspect   searching  other, SEARCHING  SEARCHING  other's  took over
ahead, suspect   found      other, SEARCHING  LOST       other's  took over
won              searching  other, CONVERGED  CONVERGED  other's  took over
won              found      other, TRACKING   TRACKING   other's  took over
"""
CASES = {
    "none, undecided": rival(0.0),
    "confirmed": rival(0.0, mass=0.95, east_m=20.0),
    "abandoned": rival(-30.0),
    "ahead": rival(11.0),
    "ahead, suspect": rival(11.0, null=2.0),
    "won": rival(11.0, status=CONVERGED),
}


def test_the_table_of_the_documentation_is_what_happens():
    lines = [line.split("  ") for line in TABLE.strip().splitlines()]
    seen = set()
    for line in lines:
        name, which, goes_on, told, null, alternative = (one.strip() for one in line if one.strip())
        for searching in (True, False) if which == "any" else (which == "searching",):
            main, other = Belief(SEARCHING if searching else TRACKING, 0.0), CASES[name]
            now = after(main, other, null=-6.0)
            took_over = goes_on != "belief"
            assert now.taken_over is took_over, line
            assert (now.alternative is None) is (alternative != "kept"), line
            status = main.status if goes_on == "belief" else Status[goes_on.split()[-1]]
            assert now.belief.status is status, line
            assert now.belief.summary is (other.belief if took_over else main).summary
            if told != "its own":
                # A search is OUTSIDE where the null hypothesis is the more probable one.
                beyond = told == "SEARCHING" and name == "ahead, suspect"
                assert now.status is (OUTSIDE if beyond else Status[told]), line
            expected = {"kept": -6.0, "reset": -6.0, "other's": other.null.log_odds}[null]
            assert now.null.log_odds == expected, line
            outcome = judge(RULES, main, other, 200.0)
            row = TRANSITIONS[outcome, searching]
            assert (row.null, row.keeps) == (null, alternative == "kept")
            seen.add((outcome, searching))
    assert seen == set(TRANSITIONS) == {(one, yes) for one in Outcome for yes in (True, False)}


@pytest.mark.parametrize(
    ("null", "lead", "expected"),
    [(-5.0, None, False), (-4.9, None, True), (-5.0, -2.0, False), (-5.0, -1.9, True),
     (-4.9, -9.0, True), (CALM, 3.0, True)],
)  # fmt: skip
def test_when_a_belief_is_doubted(null, lead, expected):
    other = None if lead is None else rival(lead)
    assert doubted(RULES, Belief(TRACKING), NullHypothesis(null), other) is expected


# The null hypothesis by hand

LEVELS = LevelReport(
    np.zeros(1, "i4"), np.zeros(1, "f4"), np.zeros(0, "i4"), np.zeros(0, "f4"), 0.0
)


def test_the_null_hypothesis_is_one_in_twenty_at_first():
    assert NullHypothesis().probability == pytest.approx(0.05)
    assert NullHypothesis(log(3.0)).probability == pytest.approx(0.75)


def odds_after(null, reading, other, gained, length_m=0.0):
    found = null.after(reading, other, gained, null.travelled_m + length_m)
    assert found.travelled_m == null.travelled_m + length_m
    return found.log_odds


@pytest.mark.parametrize("travelled_m", [0.0, 730.0])
def test_a_reading_adds_the_difference_of_its_log_likelihoods(travelled_m):
    null = NullHypothesis(-3.0, travelled_m)
    # Levels: -6 if no prediction is right, -9 under the belief.
    reading = RadioReading(levels=LEVELS)
    assert odds_after(null, reading, -6.0, -9.0) == pytest.approx(0.0)
    assert odds_after(null, reading, -6.0, -4.0) == pytest.approx(-5.0)
    # A serving cell is one of two; half a weight costs half of 0.7.
    served = RadioReading(2, 0.5)
    assert odds_after(null, served, 0.0, -0.1) == pytest.approx(-3.0 - 0.35 + 0.1)
    # One that the map does not have is the more probable the less the map holds.
    unknown = replace(served, serving=-1)
    assert odds_after(null, unknown, 0.0, 0.0) == pytest.approx(-3.0 + 0.25)
    # Without any its weight is nothing.
    none = replace(unknown, serving_weight=0.0)
    assert odds_after(null, none, 0.0, 0.0) == pytest.approx(-3.0)
    # Other terms are as given.
    timed = RadioReading(under_null=-3.0)
    assert odds_after(null, timed, 0.0, -3.0) == pytest.approx(-3.0)
    both = RadioReading(2, 0.5, LEVELS, under_null=-3.0)
    assert odds_after(null, both, -6.0, -12.0, 20.0) == pytest.approx(
        -3.0 + (-6.0 - 0.35 - 0.8 - 3.0) + 12.0
    )


@pytest.mark.parametrize("reading", [RadioReading(), RadioReading(levels=LEVELS, length_m=20.0)])
def test_the_map_counts_by_the_metres_between_readings_of_any_kind(reading):
    """Satellites alone, too, tell that one follows the ways."""
    null = NullHypothesis(-3.0, 55.0)
    # The map costs 0.04 a metre since the last reading, and 0.2 under the belief.
    now = null.after(reading, 0.0, -0.2, 75.0)
    assert now.log_odds == pytest.approx(-3.0 - 0.8 + 0.2)
    again = now.after(reading, 0.0, 0.0, 85.0)
    assert again.log_odds == pytest.approx(now.log_odds - 0.4)
    assert again.reset().travelled_m == 85.0


def test_the_log_odds_are_bounded_so_that_a_change_is_seen_in_time():
    reading = RadioReading(levels=LEVELS)
    low = NullHypothesis(-11.5).after(reading, -30.0, -4.0, 0.0)
    high = NullHypothesis(5.0).after(reading, -6.0, -400.0, 0.0)
    assert (low.log_odds, high.log_odds) == (-12.0, 12.0)
    # However long all was well, the same evidence turns it round.
    assert odds_after(low, reading, -6.0, -18.0) == 0.0
    assert odds_after(high, reading, -18.0, -6.0) == 0.0
    assert exp(-12.0) > 5e-6


@pytest.mark.parametrize(
    ("converge_log_odds", "searching", "least"),
    [(-12.0, True, -15.0), (-12.0, False, -12.0), (-5.0, True, -12.0), (-20.0, True, -23.0)],
)
def test_a_search_has_to_refute_it_by_three_nats_more_than_convergence_asks_for(
    converge_log_odds, searching, least
):
    rules = AlternativeRules(converge_log_odds=converge_log_odds)
    assert rules.least_log_odds(searching=searching) == least


def test_the_null_hypothesis_starts_again_unless_it_is_less_probable():
    assert NullHypothesis(4.0).reset().log_odds == pytest.approx(PRIOR)
    assert NullHypothesis(-8.0).reset().log_odds == -8.0
