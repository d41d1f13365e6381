"""Defaults of positioning, limits of its options, and thresholds of its decisions."""

from dataclasses import asdict, dataclass, replace
from math import inf, log, nan, radians

import numpy as np
import pytest
import small_area

from mapfilter.errors import ConfigError
from mapfilter.filters.contract import Status
from mapfilter.filters.hypotheses import BeliefSummary
from mapfilter.filters.particle import ParticleOptions
from mapfilter.models.fingerprint import ServingWeights
from mapfilter.models.level_errors import LevelErrors
from mapfilter.models.street_motion import MotionErrors
from mapfilter.models.way_map import MapWeights
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.bayes.rivals.alternative import (
    AlternativeHypothesis,
    AlternativeRules,
    NullHypothesis,
)
from mapfilter.positioning.bayes.rivals.transitions import (
    TRANSITIONS,
    Outcome,
    judge,
    report,
    resolve_alternative,
)
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.bayes.sources.evidence_options import EvidenceOptions
from mapfilter.positioning.bayes.sources.timing import TimingState
from mapfilter.positioning.bayes.state import BayesState, DeadReckoning
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.gnss.options import GnssOptions, TimingOptions
from mapfilter.positioning.gnss.state import GnssState


def test_the_usual_options():
    evidence = EvidenceOptions()
    assert (evidence.spacing_m, evidence.first_m, evidence.use_levels) == (5.0, 25.0, True)
    assert (evidence.serving, evidence.levels) == (ServingWeights(), LevelErrors())
    weights = evidence.full_list, evidence.bound_weight, evidence.beside_db, evidence.beside_m
    assert (*weights, evidence.serving_with_levels) == (6, 0.5, 6.0, 50.0, 1.0)
    bound = BayesFilter(bias_sd_deg=1.5).over_area(small_area.make_area())
    model = bound.model
    narrow = MotionErrors(bias_sd_rad=radians(1.5))
    assert (model.motion, model.weights, model.remember) == (narrow, MapWeights(), True)
    # The total of a level's error is rounded to tenths of a dB in the options.
    levels, usual = model.evidence.levels, LevelErrors()
    assert levels.total_db == pytest.approx(8.7)
    assert levels.total_db == pytest.approx(usual.total_db, abs=0.1)
    for name in ("slow_db", "fast_db", "white_db"):
        share = getattr(levels, name) / levels.total_db
        assert share == pytest.approx(getattr(usual, name) / usual.total_db)
    rest = {name: getattr(usual, name) for name in ("slow_db", "fast_db", "white_db")}
    assert replace(levels, **rest) == usual
    assert replace(model.evidence, levels=usual) == evidence
    particles = ParticleOptions(switch_mass=0.995, switch_hold_m=20.0)
    assert (bound.options, bound.rules) == (particles, AlternativeRules(claimed_from=0.998))
    # The step of timing advance is rounded to decimetres in the options.
    assert (bound.satellites, bound.timing) == (GnssOptions(), TimingOptions(step_m=553.5))
    assert (bound.smooth, bound.grid) == (False, False)
    reading = RadioReading()
    assert (reading.serving, reading.serving_weight, reading.levels, reading.bounds) == (
        -1, 0.0, None, (),
    )  # fmt: skip
    assert (reading.under_null, reading.length_m, reading.terms) == (0.0, 0.0, ())
    assert np.isnan(reading.timing_advance)


def test_the_state_before_the_first_epoch():
    assert DeadReckoning() == DeadReckoning(travelled_m=0.0, east_m=0.0, north_m=0.0)
    state = BayesState()
    assert (state.belief, state.compass, state.status) == (None, True, Status.SEARCHING)
    assert (state.null, state.reckoning) == (NullHypothesis(log(0.05 / 0.95)), DeadReckoning())
    assert (state.alternative, state.takeovers, state.sources) == (None, 0, {})
    assert np.isnan(state.heading_rad)
    assert TimingState()[:2] == (-inf, -inf)
    gnss = GnssState()
    assert (gnss.receiver, gnss.fix_used_at_m, gnss.compared_at_m) == (None, -inf, -inf)
    assert (gnss.compared_at_s, gnss.probation_until_s, gnss.rejecting) == (-inf, -inf, False)
    assert GnssState(rejected_since_s=3.0).rejecting


def test_each_source_of_evidence_begins_with_its_own_state():
    positioner = BayesFilter().over_area(small_area.make_area())
    assert [source.name for source in positioner.sources] == [
        "gnss",
        "timing",
        "first fix",
        "radio",
    ]
    begun = positioner.begin().sources
    assert isinstance(begun["gnss"], GnssState)
    assert (begun["timing"], begun["first fix"]) == (TimingState(), None)
    assert begun["radio"] is None


def test_when_satellites_are_compared_again():
    compared, options = GnssState(compared_at_m=100.0, compared_at_s=50.0), GnssOptions()
    assert not compared.due(options, 59.9, 109.9)
    assert compared.due(options, 59.9, 110.0)
    assert compared.due(options, 60.0, 100.0)
    assert GnssState().due(options, 0.0, 0.0)


def test_options_reach_their_models():
    given = BayesFilter(
        level_error_db=12.0, level_correlation_m=90.0, device_error_db=1.5, fault_probability=0.2,
        level_weight=0.8, heading_sd_deg=20.0, bias_sd_deg=4.0, drift_deg_per_sqrt_m=0.1,
        scale=0.07, step_sd_m=0.2, map_sd_m=6.0, levels=False, min_particles=700,
    )  # fmt: skip
    bound = given.over_area(small_area.make_area())
    errors, motion = bound.model.evidence.levels, bound.model.motion
    assert errors.total_db == pytest.approx(12.0)
    assert errors.slow_db / errors.fast_db == pytest.approx(7 / 4)
    assert errors.white_db / errors.fast_db == pytest.approx(3.3 / 4)
    assert (errors.slow_m, errors.fast_m) == (90.0, 9.0)
    rest = errors.device_db, errors.fault_probability, errors.weight
    assert rest == (1.5, 0.2, 0.8)
    assert motion == MotionErrors(
        step_sd_m=0.2, heading_sd_rad=radians(20), bias_sd_rad=radians(4),
        disturbances_per_m=motion.disturbances_per_m,
        bias_drift_rad_per_sqrt_m=radians(0.1), scale_sd=0.07,
    )  # fmt: skip
    # Disturbances are in proportion to the stated errors: 0.002 a metre at 15°.
    assert motion.disturbances_per_m == pytest.approx(0.002 * 20 / 15)
    assert bound.model.weights == MapWeights(sd_m=6.0)
    assert (bound.model.evidence.use_levels, bound.options.min_particles) == (False, 700)


def test_the_names_of_filters():
    assert CandidateFilter().name == "candidate"
    assert CandidateFilter().margin_db is None
    area = small_area.make_area()
    assert BayesFilter().name == BayesFilter().over_area(area).name == "bayes"
    assert GridFilter().name == GridFilter().over_area(area).name == "grid"
    assert replace(GridFilter().over_area(area), grid=False) == BayesFilter().over_area(area)


@pytest.mark.parametrize(
    ("given", "fault"),
    [
        ({"antenna_height_m": 10_001.0}, "antenna_height_m: expected a number in -10000..10000"),
        ({"min_particles": 200, "max_particles": 150}, "expected min_particles <= max_particles"),
    ],
)
def test_limits_are_those_of_the_parts(given, fault):
    with pytest.raises(ConfigError, match=fault):
        BayesFilter(**given)


POSITIVE = (
    "zenith_m", "echo_memory_m", "echo_memory_s", "fix_memory_m", "clock_sd_m", "trust_grows_s",
)  # fmt: skip
NUMBERS = tuple(asdict(GnssOptions()))


@pytest.mark.parametrize("name", NUMBERS)
def test_gnss_options_are_finite_and_not_negative(name):
    for value in (nan, inf, -1e-9 if name != "height_m" else 10_001.0):
        with pytest.raises(ConfigError, match=f"GnssOptions, {name}: expected a"):
            GnssOptions(**{name: value})
    if name in POSITIVE:
        with pytest.raises(ConfigError, match=f"GnssOptions, {name}: expected a number > 0"):
            GnssOptions(**{name: 0.0})
    else:
        assert getattr(GnssOptions(**{name: 0.0}), name) == 0.0
    assert getattr(GnssOptions(**{name: 0.5}), name) == 0.5


def test_limits_of_angles_shares_and_heights():
    assert GnssOptions(height_m=-10_000.0).height_m == -10_000.0
    assert GnssOptions(mask_deg=89.9).mask_deg == 89.9
    with pytest.raises(ConfigError, match="mask_deg"):
        GnssOptions(mask_deg=90.0)
    with pytest.raises(ConfigError, match="outliers"):
        GnssOptions(outliers=1.0)
    with pytest.raises(ConfigError) as caught:
        GnssOptions(gate=-1.0, zenith_m=0.0, mask_deg=95.0)
    assert len(caught.value.faults) == 3


@pytest.mark.parametrize("name", tuple(asdict(TimingOptions())))
def test_timing_options_are_above_0(name):
    for value in (0.0, -1.0, inf, nan):
        with pytest.raises(ConfigError, match=f"TimingOptions, {name}: expected a number > 0"):
            TimingOptions(**{name: value})
    assert getattr(TimingOptions(**{name: 0.5}), name) == 0.5


@dataclass(frozen=True)
class Belief:
    """The part of a belief that decisions depend on."""

    status: Status
    log_evidence: float
    summary: BeliefSummary
    agreement_start_m: float = 7.0


def belief(status, evidence=0.0, east_m=0.0, mass=1.0):
    mean = np.array([east_m, 0.0, 0.0, 0.0, 0.0])
    said = BeliefSummary(mean, np.eye(2), np.ones(3), mass, np.empty((0, 3)), 0.0)
    return Belief(status, evidence, said)


S, C, T, L = Status.SEARCHING, Status.CONVERGED, Status.TRACKING, Status.LOST


def outcome(main, lead, *, status=S, east_m=500.0, mass=0.5, gone_m=0.0, null=-12.0):
    other = AlternativeHypothesis(
        belief(status, lead, east_m, mass), 100.0, 0.0, null=NullHypothesis(null)
    )
    return judge(AlternativeRules(), belief(main), other, 100.0 + gone_m)


def test_outcomes_at_their_thresholds():
    assert outcome(T, 0.0) is Outcome.UNDECIDED
    assert outcome(T, 0.0, east_m=50.0, mass=0.9) is Outcome.CONFIRMED
    assert outcome(T, 0.0, east_m=50.1, mass=0.9) is Outcome.UNDECIDED
    assert outcome(T, 0.0, east_m=50.0, mass=0.89) is Outcome.UNDECIDED
    assert (outcome(S, 4.0), outcome(S, 3.9)) == (Outcome.AHEAD, Outcome.UNDECIDED)
    assert (outcome(T, 8.0), outcome(T, 7.9)) == (Outcome.AHEAD, Outcome.UNDECIDED)
    assert outcome(T, 8.0, status=C) is outcome(T, 8.0, status=T) is Outcome.WON
    assert outcome(T, 8.0, status=C, null=-12.0) is Outcome.WON
    assert outcome(T, 8.0, status=C, null=-11.9) is Outcome.AHEAD
    assert outcome(T, 8.0, status=C, null=0.0) is Outcome.AHEAD
    assert outcome(T, 8.0, status=C, null=0.1) is Outcome.SUSPECT
    assert outcome(T, 8.0, status=S, null=0.1) is Outcome.SUSPECT
    assert (outcome(T, -25.0), outcome(T, -24.9)) == (Outcome.ABANDONED, Outcome.UNDECIDED)
    assert (outcome(T, 0.0, gone_m=800.0), outcome(T, 0.0, gone_m=799.0)) == (
        Outcome.ABANDONED, Outcome.UNDECIDED,
    )  # fmt: skip


def resolved(main, lead, null=-12.0, own=-12.0, before=None):
    other = AlternativeHypothesis(belief(S, lead, 500.0, 0.5), 100.0, 0.0, null=NullHypothesis(own))
    reported = before or (S if main is C else main)
    rules = AlternativeRules()
    null = NullHypothesis(null)
    return resolve_alternative(rules, reported, belief(main), null, other, 200.0, at_edge=False)


def test_resolutions_at_their_thresholds():
    # No belief converges beside a null hypothesis, nor with an alternative close behind.
    alone = resolve_alternative(
        AlternativeRules(), S, belief(C), NullHypothesis(-12.0), None, 0.0, at_edge=True
    )
    assert (alone.status, alone.alternative, alone.taken_over) == (C, None, False)
    assert resolved(C, -2.0).status is C
    assert resolved(C, -1.9).status is S
    assert resolved(T, 12.0, own=0.0).taken_over is False
    over = resolved(T, 12.0, null=9.0, own=0.1)
    assert (over.taken_over, over.status, over.null) == (True, L, NullHypothesis(0.1))
    assert np.isnan(over.belief.agreement_start_m)
    search = resolved(S, 5.0, null=9.0, own=-1.0)
    assert (search.taken_over, search.status, search.null) == (True, S, NullHypothesis(-1.0))
    assert search.belief.status is S
    kept = resolved(T, 12.0, null=9.0, own=-1.0)
    assert (kept.status, kept.null, kept.alternative.null) == (
        L,
        NullHypothesis(9.0),
        NullHypothesis(-1.0),
    )
    other = AlternativeHypothesis(
        belief(S, 3.0), 0.0, main_log_evidence=-4.0, gnss_log_bayes_factor=0.5
    )
    assert other.log_bayes_factor(belief(T, 2.0)) == 3.0 - (2.0 + 4.0) + 0.5
    assert np.isnan(other.start_s)
    assert (other.sources, other.null) == ({}, NullHypothesis())


def test_every_outcome_has_a_transition():
    assert set(TRANSITIONS) == {(one, searching) for one in Outcome for searching in (True, False)}
    for (_, _), row in TRANSITIONS.items():
        # An alternative that takes over is not kept beside itself.
        assert row.takes_over is None or not row.keeps


def test_converged_lasts_for_one_epoch_and_lost_until_convergence():
    for before in Status:
        for found in (S, T, L):
            _, status = report(before, belief(found), found)
            # One that was found and searches is lost.
            assert status is (L if found is S and before in (C, T, L) else found)
        now, status = report(before, belief(C), C)
        assert now.status is status is (T if before in (C, L) else C)
