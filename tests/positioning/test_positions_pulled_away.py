"""Positions that lead away slowly: a belief without them tells, by hand and in a made town."""

from copy import deepcopy
from dataclasses import replace
from functools import cache
from math import nan
from types import SimpleNamespace

import numpy as np
import pytest
from made_filters import (
    SEARCHING,
    STATE,
    TERM,
    TRACKING,
    Beliefs,
    Source,
    belief,
    gaining,
    rival,
    weighed,
)
from made_town import CRS, Town, walk_log

from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.certainty import Recovery
from mapfilter.positioning.bayes.doubted import positions_in_doubt
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.rivals.alternative import NullHypothesis
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.hold_rules import PullRules
from mapfilter.positioning.bayes.rivals.unaided import beside_alternative
from mapfilter.positioning.bayes.sources.evidence import EvidenceUpdate, FixedTerm, RadioReading
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch, GnssFix, Pseudorange
from mapfilter.positioning.estimate_columns import EstimateColumns
from mapfilter.positioning.gnss.fixes import agrees_with
from mapfilter.positioning.gnss.gate import GnssComparison, GnssGate, _neutral
from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.source import GnssSource
from mapfilter.positioning.gnss.state import GnssState
from mapfilter.positioning.loop import kinds_of, locate
from mapfilter.positioning.merging import epochs
from mapfilter.positioning.step_output import UnusedReading
from mapfilter.tracks.log import make_log


def alone(log_evidence, *, prior=-2.0, null=-6.0, start_m=0.0):
    """A belief without positions, 300 m away from the main one."""
    own = belief(TRACKING, log_evidence, east_m=800.0)
    return HeldOtherwise(own, Hold(), prior, start_m, NullHypothesis(null, 30.0), nan)


USED = SimpleNamespace(reason=Reason.USED)
RADIO = EvidenceUpdate(None, radio=RadioReading(serving=2), under_null=-0.5)
FIX = EvidenceUpdate(None, (TERM,), under_null=-1.5)


def beside(state, updates=(RADIO,), *, source=None, beliefs=None, **more):
    beliefs = beliefs or Beliefs(held_otherwise=gaining(-1.0))
    found, _ = weighed(beliefs, state, list(updates), source=source, **more)
    return found, beliefs.held_otherwise.readings


def test_it_is_weighed_by_all_but_positions():
    given = replace(STATE, unaided=(alone(-9.0),))
    found, (reading,) = beside(given)
    assert (reading.serving, reading.terms, reading.tracked) == (2, (), True)
    assert found.unaided[0].belief.log_evidence == -10.0
    assert found.unaided[0].null.log_odds == pytest.approx(-6.0 - 0.5 - 1.0 + 1.0)
    # 2 nats ahead and a prior of -2: even odds, elsewhere, from here on.
    assert found.unaided[0].ahead_m == 40.0
    assert (found.status, found.takeovers) == (TRACKING, 0)
    _, (reading,) = beside(given, measured=False)
    assert not reading.tracked
    # Positions alone say nothing of it, but what the way has cost is settled with the main belief.
    found, (reading,) = beside(given, (FIX,), source=Source(is_position=True))
    assert (reading.serving, reading.levels, reading.bounds) == (-1, None, ())
    (nothing,) = reading.terms
    assert nothing.log_likelihood(None).tolist() == [0.0]
    assert found.unaided[0].belief.log_evidence == -10.0
    assert beside(STATE)[0].unaided == ()


@pytest.mark.parametrize(
    ("log_evidence", "start_m", "left"),
    # The main belief is at -12 afterwards: 4 nats behind it is refuted, at -15 before its own loss.
    [(-14.9, 0.0, True), (-15.0, 0.0, False), (-14.0, -1159.9, True), (-14.0, -1160.0, False)],
)
def test_one_that_is_refuted_or_undecided_for_long_is_given_up(log_evidence, start_m, left):
    found, _ = beside(replace(STATE, unaided=(alone(log_evidence, start_m=start_m),)))
    assert bool(found.unaided) is left


def test_one_that_fails_is_given_up_and_so_is_one_beside_a_search():
    failing = Beliefs(held_otherwise=gaining(-1.0, reason=Reason.UPDATE_FAILED))
    assert beside(replace(STATE, unaided=(alone(-9.0),)), beliefs=failing)[0].unaided == ()
    searching = replace(STATE, belief=belief(SEARCHING), unaided=(alone(-9.0),))
    assert beside(searching)[0].unaided == ()
    # One that is ahead, as positions and reports tear the main belief apart, is not.
    ahead = replace(searching, unaided=(replace(alone(-7.0), ahead_m=-7.0),))
    assert len(beside(ahead)[0].unaided) == 1


@pytest.mark.parametrize(
    ("log_evidence", "null", "wins"),
    # 8 nats and the prior of 2 before the main belief's -12, after it lost one itself.
    [(-1.0, -6.0, True), (-1.1, -6.0, False), (-1.0, -4.4, False)],
)
def test_one_that_is_far_ahead_takes_over_and_positions_are_distrusted(log_evidence, null, wins):
    rest = HeldOtherwise(belief(), Hold(1.0, 3.0), -2.0, 0.0)
    given = replace(STATE, unaided=(alone(log_evidence, null=null),), held=(rest,), takeovers=1)
    found, _ = beside(given)
    assert found.takeovers == 1 + wins
    assert (found.unaided == ()) is wins
    if wins:
        assert found.belief.log_evidence == log_evidence - 1.0
        assert (found.status, found.recovery, found.held) == (TRACKING, Recovery(), ())
        assert found.hold == given.hold
        assert found.alone_from_m == 0.0
        assert found.sources == {"one": "before distrusted at 9 s", "two": 2}


def state_of(**changes):
    own = GnssState(fix_used_at_m=10.0)
    given = {"belief": belief(), "status": TRACKING, "sources": {GnssSource.name: own}}
    return BayesState(**given | changes)


def test_it_begins_beside_a_tracked_belief_that_positions_lead():
    filters = BeliefFilters(model=None)
    assert filters.positions_lead(state_of())
    unused, rejecting = GnssState(), GnssState(fix_used_at_m=10.0, rejected_since_s=3.0)
    for changes in (
        {"status": Status.LOST}, {"belief": belief(SEARCHING)}, {"belief": None},
        {"unaided": (alone(-9.0),)}, {"sources": {GnssSource.name: unused}},
        {"sources": {GnssSource.name: rejecting}},
    ):  # fmt: skip
        assert not filters.positions_lead(state_of(**changes)), changes
    assert not replace(filters, pulls=PullRules(watched=False)).positions_lead(state_of())


@pytest.mark.parametrize(("log_odds", "ahead"), [(-0.9, True), (-1.1, False)])
def test_a_position_is_lost_while_it_is_likely_enough(log_odds, ahead):
    filters = BeliefFilters(model=None)
    one = replace(alone(-10.0 + 2.0 + log_odds), ahead_m=-7.0)
    state = state_of(unaided=(one,))
    assert filters.is_pulled(state) is filters.is_contested(state) is ahead
    assert state.rivals == (one,)
    assert not filters.is_pulled(state_of())


def scratch(log_evidence, *, status=TRACKING, east_m=520.0):
    own = belief(status, log_evidence, east_m=east_m)
    return HeldOtherwise(own, Hold(), -2.0, 0.0, NullHypothesis(-6.0, 30.0), from_scratch=True)


@pytest.mark.parametrize(
    ("one", "proven", "left"),
    # The main belief is at -12 afterwards, and each loses one, too: 4 nats behind from -15 on.
    [
        (scratch(-15.0), True, 0), (scratch(-14.9), False, 1), (scratch(-9.0), False, 1),
        (scratch(-15.0, east_m=560.0), False, 1), (scratch(-15.0, status=SEARCHING), False, 1),
        # 25 behind, wherever it is.
        (scratch(-36.0, status=SEARCHING, east_m=900.0), True, 0),
        (scratch(-35.9, status=SEARCHING, east_m=900.0), False, 1),
    ],
)  # fmt: skip
def test_a_belief_is_proven_by_one_from_a_report_alone(one, proven, left):
    beliefs = Beliefs(gaining(-2.0), held_otherwise=None)
    updates = [RADIO]
    asked = []

    def update(given, reading, _):
        asked.append(reading)
        gained = -1.0 if given.state[0, 0] != 500.0 else -2.0
        return replace(given, log_evidence=given.log_evidence + gained), USED

    beliefs.filter.update = update
    found, _ = weighed(beliefs, replace(STATE, unaided=(one,)), updates)
    assert (found.proven, len(found.unaided)) == (proven, left)
    # Its own null hypothesis, at -6 as the rules ask for -5, keeps nothing from converging.
    assert [reading.doubted for reading in asked] == [False, False]


def test_where_positions_have_found_a_belief_one_begins_with_a_report_alone():
    first = EvidenceUpdate(None, (TERM,))
    found, _ = weighed(Beliefs(asks=True), source=Source(at_first=first))
    (one,) = found.unaided
    assert one.from_scratch
    assert (one.belief.status, one.start_m, one.log_prior) == (SEARCHING, 40.0, -np.log(9999.0))
    # What happens from here on is compared.
    assert one.belief.log_evidence == found.belief.log_evidence
    assert weighed(Beliefs(asks=True), source=Source(is_position=True))[0].unaided == ()


@pytest.mark.parametrize(("positions", "proven"), [(False, True), (True, False)])
def test_a_belief_that_converges_without_positions_is_proven(positions, proven):
    searching = replace(STATE, belief=belief(SEARCHING), status=SEARCHING)
    converging = Beliefs(gaining(-2.0, status=Status.CONVERGED), positions=positions)
    assert weighed(converging, searching)[0].proven is proven
    assert weighed(Beliefs(positions=positions), searching)[0].proven is False


def test_a_belief_that_searches_again_has_to_be_proven_anew():
    proven = replace(STATE, proven=True)
    assert weighed(Beliefs(), proven)[0].proven
    assert not weighed(Beliefs(gaining(-2.0, status=SEARCHING)), proven)[0].proven
    # A search that has been proven stays so.
    searching = replace(proven, belief=belief(SEARCHING), status=SEARCHING)
    assert weighed(Beliefs(), searching)[0].proven


def test_beside_an_alternative_that_takes_over_one_from_scratch_goes_on():
    both = alone(-7.0), replace(scratch(-8.0), ahead_m=3.0)
    state = replace(STATE, unaided=both, alternative=rival(-3.0), proven=True)
    (left,) = beside_alternative(state, STATE.belief)
    # 2 nats ahead of the main belief at -10; the alternative began with it there, and is 7 ahead.
    assert left.from_scratch
    assert left.belief.log_evidence == -3.0 + (
        2.0 - state.alternative.log_bayes_factor(STATE.belief)
    )
    assert beside_alternative(replace(state, alternative=None), STATE.belief) == ()


@pytest.mark.parametrize(("apart_m", "agrees"), [(24.4, True), (24.6, False)])
def test_a_fix_agrees_where_95_percent_of_them_would_lie(apart_m, agrees):
    """Deviations of 10 m east and 7 m north, and of 1 m of the fix: 2.447 of them."""
    summary = SimpleNamespace(mean=np.array([200.0, 100.0]), covariance_m2=np.diag([99.0, 48.0]))
    fix = GnssFix(1000.0 + 200.0 + apart_m, 5000.0 + 100.0, 1.0, 1.0, 0.0)
    assert agrees_with(SimpleNamespace(summary=summary), fix, (1000.0, 5000.0)) is agrees
    unknown = replace(fix, cov_east_north_m2=nan)
    assert agrees_with(SimpleNamespace(summary=summary), unknown, (1000.0, 5000.0)) is agrees


def test_distrusted_readings_are_used_again_once_they_have_agreed_for_some_way():
    options, state = GnssOptions(trial_m=100.0), GnssState(distrusted=True)
    begins = state.on_trial(options, 30.0)
    assert (begins.distrusted, begins.agrees_from_m) == (True, 30.0)
    assert begins.on_trial(options, 129.9).agrees_from_m == 30.0
    assert begins.on_trial(options, 129.9).distrusted
    trusted = begins.on_trial(options, 130.0)
    assert not trusted.distrusted
    assert np.isnan(trusted.agrees_from_m)


def test_readings_on_trial_are_used_no_more_but_contradict_nothing():
    rejected = GnssState(distrusted=True, rejected_since_s=3.0)
    assert rejected.rejecting
    assert rejected.contradicting
    agrees = rejected.on_trial(GnssOptions(), 30.0)
    assert agrees.rejecting
    assert not agrees.contradicting


def place_of(east_m, sd_m, *, count=400):
    """A belief about a place 500 m north, and a log of nothing else."""
    rng = np.random.default_rng(2)
    own = belief(TRACKING)
    place = rng.normal([[east_m], [500.0]], sd_m, (2, count)).astype(np.float32)
    rest = np.zeros((5, count), dtype=np.float32)
    weights = np.full(count, -np.log(count))
    kept = np.empty((0, count), dtype=np.float32)
    return replace(own, state=np.vstack([place, rest]), log_weight=weights, kept=kept)


def test_a_fix_that_the_gate_rejects_does_not_end_the_distrust():
    """It agrees by the width of the belief, none of whose hypotheses lie near it."""
    gate = GnssGate(GnssOptions(), CRS, (0.0, 0.0), 1e6)
    half = place_of(300.0, 5.0)
    apart = replace(half, state=half.state + np.where(np.arange(400) % 2, 0, 60)[None].astype("f4")
                    * np.array([1, 0, 0, 0, 0, 0, 0], dtype=np.float32)[:, None])  # fmt: skip
    trusted_soon = GnssState(distrusted=True, agrees_from_m=0.0)
    epoch = Epoch(9.0, (), gnss=GnssFix(330.0, 500.0, 1.0, 1.0, 0.0))
    found = gate.compare(apart, trusted_soon, epoch, 200.0, 5.0)
    assert [one[2] for one in found.unused] == [Reason.REJECTED_BY_EVIDENCE]
    assert found.state.distrusted
    assert np.isnan(found.state.agrees_from_m)


def test_a_fix_and_pseudoranges_together_leave_the_total_likelihood_as_it_is():
    one, rng = place_of(300.0, 5.0), np.random.default_rng(3)
    shared = rng.normal(0, 1, 400)
    terms = FixedTerm(shared), FixedTerm(np.array([-0.4])), FixedTerm(shared - 0.5)
    found = _neutral(GnssComparison(one, GnssState(), terms))
    assert found.terms[:2] == terms[:2]
    # What is common to all hypotheses goes with the pseudoranges, which are of this belief alone.
    total = sum(term.log_likelihood(one.state) for term in found.terms)
    assert np.log(np.mean(np.exp(total))) == pytest.approx(0.0, abs=1e-12)
    assert np.ptp(found.terms[2].value - terms[2].value) == pytest.approx(0.0, abs=1e-12)


def test_positions_in_doubt_are_told_once_each():
    epoch = Epoch(9.0, (), gnss=GnssFix(1.0, 2.0, 9.0, 9.0, 0.0),
                  pseudoranges=(Pseudorange("G01", 2e7, 1.0, (0, 0, 0)),))  # fmt: skip
    why = Reason.REJECTED_BY_EVIDENCE
    assert positions_in_doubt(epoch, []) == [
        UnusedReading(9.0, "gnss", "", why), UnusedReading(9.0, "pseudorange", "G01", why),
    ]  # fmt: skip
    told = [UnusedReading(9.0, "gnss", "", Reason.ON_PROBATION)]
    assert [one.kind for one in positions_in_doubt(epoch, told)] == ["pseudorange"]
    assert positions_in_doubt(Epoch(9.0), []) == []


def test_distrusted_positions_are_rejected_from_then_on():
    source = GnssSource(Town.of(1).area(), BayesFilter().over_area(Town.of(1).area()).satellites)
    found = source.distrusted(GnssState(fix_used_at_m=10.0), 30.0)
    assert (found.rejected_since_s, found.probation_until_s) == (30.0, 35.0)
    assert found.rejecting
    assert found.distrusted
    assert not found.was_used(30.0)


# In a made town: positions of 3 m at each step of 5 m, led away from the 80th on.
TOWN = Town.of(1)
FILTER = BayesFilter(claim_mass=0.95).over_area(TOWN.area())
TRUSTING = replace(FILTER, pulls=PullRules(watched=False))
WALKS = range(3)
LED_S = 80.0


def walk(seed, away_per_m):
    log, rng = walk_log(TOWN, seed, 1500.0), np.random.default_rng((seed, 9))
    truth, toward = log.truth, rng.uniform(0, 2 * np.pi)
    away_m = np.clip((truth["time_s"] - LED_S) * 5 * away_per_m, 0, 250)
    places = {
        name: truth[name] + away_m * part + rng.normal(0, 3, len(truth))
        for name, part in (("east_m", np.cos(toward)), ("north_m", np.sin(toward)))
    }
    sure = {"var_east_m2": 9.0, "var_north_m2": 9.0, "cov_east_north_m2": 0.0}
    fixes = truth[["time_s"]].assign(**places, **sure)
    return make_log(CRS, motion=log.motion, radio=log.radio, gnss=fixes, truth=truth)


@cache
def begun(seed, trusting):
    """The state, the generator and the outputs up to where positions are led away, if they are."""
    log, filter_ = walk(seed, 0.0), TRUSTING if trusting else FILTER
    state, rng, columns = filter_.begin(kinds_of(log)), np.random.default_rng(5), EstimateColumns()
    for epoch in epochs(log):
        if epoch.time_s <= LED_S:
            state, output = filter_.step(state, epoch, rng)
            columns.add(output)
    return state, rng, columns


@cache
def located(seed, away_per_m, *, trusting=False):
    """Return the estimate, its errors, and which of its positions are claimed."""
    log, filter_ = walk(seed, away_per_m), TRUSTING if trusting else FILTER
    state, *changing = begun(seed, trusting)
    rng, columns = deepcopy(changing)
    for epoch in epochs(log):
        if epoch.time_s > LED_S:
            state, output = filter_.step(state, epoch, rng)
            columns.add(output)
    found = columns.estimate(CRS, filter_.name)
    error_m = np.hypot(
        found.east_m - log.truth["east_m"].to_numpy(),
        found.north_m - log.truth["north_m"].to_numpy(),
    )
    claimed = np.array([one in (Status.TRACKING, Status.CONVERGED) for one in found.status])
    return found, error_m, claimed


@pytest.mark.parametrize("away_per_m", [0.1, 0.2])
def test_positions_that_lead_away_are_hardly_ever_followed(away_per_m):
    wrong, right, rejecting = {True: 0, False: 0}, 0, 0
    for seed in WALKS:
        for trusting in (True, False):
            found, error_m, claimed = located(seed, away_per_m, trusting=trusting)
            wrong[trusting] += int((claimed & (error_m > 50)).sum())
        rejecting += Reason.REJECTED_BY_EVIDENCE in {one.reason for one in found.unused}
        # Where positions are more than 50 m off.
        led = np.arange(len(error_m)) > LED_S + 10 / away_per_m
        right += int((claimed & (error_m <= 50) & led).sum())
    # Where they are believed less than they ask for none may be rejected.
    assert rejecting >= 2
    # 200 and 120 of the 300 positions of a walk lead more than 50 m away.
    assert wrong[True] > 0.7 * led.sum() * len(WALKS)
    assert wrong[False] < 0.4 * wrong[True]
    # It has been found without them since.
    assert right > 30


def test_of_walks_with_good_positions_not_a_bit_changes():
    for seed in WALKS:
        (one, _, claimed), (other, _, _) = (located(seed, 0.0, trusting=k) for k in (False, True))
        assert claimed.mean() > 0.9
        for name in ("east_m", "north_m", "radii_m"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert list(one.status) == list(other.status)


def test_a_lost_position_is_told_with_the_fix_in_doubt():
    """While the belief without positions is ahead, and no row of motion is blamed."""
    found, _, _ = located(0, 0.1)
    lost = {t for t, s in zip(found.time_s, found.status, strict=True) if s is Status.LOST}
    assert lost
    told = {one.time_s for one in found.unused
            if one.kind == "gnss" and one.reason is Reason.REJECTED_BY_EVIDENCE}  # fmt: skip
    assert lost <= told
    assert not [one for one in found.unused if one.reason is Reason.PHONE_TURNED]


def test_good_positions_are_claimed_though_reports_have_ended():
    """The way costs the main belief as much as the one without positions."""
    for seed in (0, 1):
        log = walk(seed, 0.0)
        log = replace(log, radio=log.radio[log.radio["time_s"] < 120])
        found = locate(log, FILTER, np.random.default_rng(5)).estimate
        assert set(found.status[120:]) == {Status.TRACKING}
