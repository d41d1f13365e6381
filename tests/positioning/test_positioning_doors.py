"""What positioning assumes unless told otherwise, and where it stops taking input."""

from dataclasses import asdict, dataclass
from math import inf, nan, radians

import numpy as np
import pytest

from mapfilter.errors import ConfigError
from mapfilter.filters.contract import Status
from mapfilter.filters.hypotheses import BeliefSummary
from mapfilter.filters.particle import ParticleOptions
from mapfilter.models.fingerprint import LevelErrors, ServingWeights
from mapfilter.models.street_motion import MapWeights, MotionErrors
from mapfilter.positioning.bayes.alternative import (
    AlternativeHypothesis,
    AlternativeRules,
    EvidenceCusum,
    Verdict,
    judge,
    resolve_alternative,
)
from mapfilter.positioning.bayes.evidence import EvidenceOptions, RadioHistory, RadioReading
from mapfilter.positioning.bayes.options import BayesFilter, BayesOptions, GridFilter
from mapfilter.positioning.bayes.state import BayesTrack
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.gnss.options import GnssOptions, TimingOptions
from mapfilter.positioning.gnss.state import NO_GNSS_STATE, GnssState


def test_the_usual_options():
    assert asdict(GnssOptions()) == {
        "zenith_m": 2.0, "echo_m": 4.0, "echo_memory_m": 15.0, "fix_memory_m": 20.0,
        "spacing_m": 10.0, "pause_s": 10.0, "mask_deg": 5.0, "height_m": 100.0,
        "height_sd_m": 200.0, "slope": 0.3, "clock_sd_m": 3e5, "drift_sd_mps": 100.0,
        "outliers": 0.05, "gate": 8.0, "search_gate": 16.0, "probation_s": 5.0, "trust": 3.0,
        "trust_grows_s": 120.0, "dispute_s": 10.0,
    }  # fmt: skip
    assert asdict(TimingOptions()) == {
        "step_m": pytest.approx(553.46, abs=0.01), "advance_sd_m": 200.0,
        "advance_memory_m": 500.0, "difference_memory_m": 20.0, "difference_sd_m": 30.0,
        "clip_sd": 3.0, "height_m": 1.5,
    }  # fmt: skip
    assert asdict(AlternativeRules()) == {
        "doubt": 5.0,
        "doubt_of_cells": 2.5,
        "ahead": 4.0,
        "lost": 10.0,
        "lost_of_cells": 6.0,
        "confirmed_mass": 0.9,
        "abandon_threshold": -25.0,
        "abandon_after_m": 800.0,
        "converge_below": 2.5,
        "converge_behind": 2.0,
    }
    evidence = EvidenceOptions()
    assert (evidence.spacing_m, evidence.first_m, evidence.use_levels) == (5.0, 25.0, True)
    assert (evidence.serving, evidence.levels) == (ServingWeights(), LevelErrors())
    options = BayesOptions()
    assert (options.motion, options.map, options.evidence) == (
        MotionErrors(), MapWeights(), evidence,
    )  # fmt: skip
    assert (options.particles, options.challenge) == (ParticleOptions(), AlternativeRules())
    assert (options.satellites, options.timing) == (GnssOptions(), TimingOptions())
    assert (options.smooth, options.grid) == (False, False)
    reading = RadioReading()
    assert (reading.serving, reading.serving_weight, reading.levels, reading.bounds) == (
        -1, 0.0, None, (),
    )  # fmt: skip
    assert (reading.fix, reading.expected, reading.length_m, reading.also) == (None, 0.0, 0.0, ())
    assert np.isnan(reading.timing_advance)


def test_what_is_known_at_the_start():
    memory = RadioHistory.empty(3)
    np.testing.assert_array_equal(memory.level_dbm, [nan] * 3)
    np.testing.assert_array_equal(memory.heard_at_m, [-inf] * 3)
    zeros = (memory.travelled_m, memory.east_m, memory.north_m, memory.back_east_m,
             memory.back_north_m)  # fmt: skip
    assert zeros == (0.0,) * 5
    assert memory.used_at_m == -inf
    track = BayesTrack(memory)
    assert (track.belief, track.compass, track.status, track.doubt) == (
        None, True, Status.SEARCHING, EvidenceCusum(0.0, 0.8),
    )  # fmt: skip
    assert (track.challenger, track.wins, track.sky, track.timed_at_m) == (
        None, 0, NO_GNSS_STATE, (-inf, -inf),
    )  # fmt: skip
    assert np.isnan(track.heading_rad)
    assert track.leading is None
    assert (NO_GNSS_STATE.receiver, NO_GNSS_STATE.fix_at_m, NO_GNSS_STATE.heard_at_m) == (
        None,
        -inf,
        -inf,
    )
    assert (NO_GNSS_STATE.heard_at_s, NO_GNSS_STATE.until_s, NO_GNSS_STATE.rejects) == (
        -inf,
        -inf,
        False,
    )
    assert GnssState(since_s=3.0).rejects


def test_when_satellites_are_listened_to_again():
    heard, options = GnssState(heard_at_m=100.0, heard_at_s=50.0), GnssOptions()
    assert not heard.due(options, 59.9, 109.9)
    assert heard.due(options, 59.9, 110.0)
    assert heard.due(options, 60.0, 100.0)
    assert NO_GNSS_STATE.due(options, 0.0, 0.0)


def test_wide_errors_get_more_particles():
    def numbers(bias_sd_deg, scale_sd):
        motion = MotionErrors(bias_sd_rad=radians(bias_sd_deg), scale_sd=scale_sd)
        found = BayesOptions(motion=motion, particles=ParticleOptions(1000, 600, 10))._particles
        return found.max_particles, found.min_search_particles, found.min_particles

    assert numbers(1.5, 0.015) == (1000, 600, 10)
    assert numbers(0.0, 0.0) == (1000, 600, 10)
    # Four times in one of the two are twice as many, and both together four times.
    assert numbers(6.0 + 1e-9, 0.015) == (2000, 1200, 10)
    assert numbers(6.0 + 1e-9, 0.06) == (4000, 2400, 10)
    assert numbers(40.0, 0.5) == (5000, 3000, 10)


def test_the_names_of_filters():
    assert CandidateFilter().name == "candidate"
    assert CandidateFilter().margin_db is None
    assert (BayesOptions().name, BayesFilter().name) == ("bayes", "bayes")
    assert (BayesOptions(grid=True).name, GridFilter().name) == ("grid", "grid")
    timing = TimingOptions(step_m=553.5)
    assert BayesFilter().options == BayesOptions(timing=timing)
    assert GridFilter().options == BayesOptions(timing=timing, grid=True)


POSITIVE = ("zenith_m", "echo_memory_m", "fix_memory_m", "clock_sd_m", "trust_grows_s")
NUMBERS = tuple(asdict(GnssOptions()))


@pytest.mark.parametrize("name", NUMBERS)
def test_options_of_satellites_are_finite_and_not_negative(name):
    for value in (nan, inf, -1e-9 if name != "height_m" else 10_001.0):
        with pytest.raises(ConfigError, match=f"satellites, {name}: expected a finite number"):
            GnssOptions(**{name: value})
    if name in POSITIVE:
        with pytest.raises(ConfigError, match=f"satellites, {name}: expected a number above 0"):
            GnssOptions(**{name: 0.0})
    else:
        assert getattr(GnssOptions(**{name: 0.0}), name) == 0.0
    assert getattr(GnssOptions(**{name: 0.5}), name) == 0.5


def test_borders_of_angles_shares_and_heights():
    assert GnssOptions(height_m=-10_000.0).height_m == -10_000.0
    assert GnssOptions(mask_deg=89.9).mask_deg == 89.9
    with pytest.raises(ConfigError, match="mask_deg"):
        GnssOptions(mask_deg=90.0)
    with pytest.raises(ConfigError, match="outliers"):
        GnssOptions(outliers=1.0)
    with pytest.raises(ConfigError) as told:
        GnssOptions(gate=-1.0, zenith_m=0.0, mask_deg=95.0)
    assert len(told.value.faults) == 3


@pytest.mark.parametrize("name", tuple(asdict(TimingOptions())))
def test_options_of_timing_are_above_0(name):
    for value in (0.0, -1.0, inf, nan):
        with pytest.raises(ConfigError, match=f"timing, {name}: expected a number above 0"):
            TimingOptions(**{name: value})
    assert getattr(TimingOptions(**{name: 0.5}), name) == 0.5


def test_doubt_by_hand():
    calm = EvidenceCusum()
    # 1.5 · 0.8 · (-2) - (-2) = -0.4: none.
    after = calm.after(-2.0, -2.0, 300.0)
    share = 1 - np.exp(-1.0)
    assert after.sum == 0.0
    assert after.usual == pytest.approx(0.8 + share * 0.2)
    worse = calm.after(-2.0, -5.0, 300.0)
    assert worse.sum == pytest.approx(5.0 - 2.4)
    # In doubt nothing is learnt.
    assert worse.usual == 0.8
    again = worse.after(-2.0, -1.0, 10.0)
    assert again.sum == pytest.approx(2.6 - 1.4)
    assert calm.after(-2.0, 5.0, 300.0).usual == pytest.approx(0.8 + share * (0.5 - 0.8))
    assert EvidenceCusum(usual=9.0).after(-2.0, -5.0, 300.0).usual == pytest.approx(
        9 + share * (2.0 - 9)
    )
    assert calm.after(0.0, -50.0, 10.0) is calm
    assert EvidenceCusum(3.0, 1.1).none() == EvidenceCusum(0.0, 1.1)


@dataclass(frozen=True)
class Belief:
    """As much of a belief as a decision looks at."""

    status: Status
    log_evidence: float
    summary: BeliefSummary
    agreement_start_m: float = 7.0


def belief(status, evidence=0.0, east_m=0.0, mass=1.0):
    mean = np.array([east_m, 0.0, 0.0, 0.0, 0.0])
    said = BeliefSummary(mean, np.eye(2), np.ones(3), mass, np.empty((0, 3)), 0.0)
    return Belief(status, evidence, said)


S, C, T, L = Status.SEARCHING, Status.CONVERGED, Status.TRACKING, Status.LOST


def verdict(main, ahead, *, status=S, east_m=500.0, mass=0.5, gone_m=0.0, doubt=0.0, cells=False):
    other = AlternativeHypothesis(
        belief(status, ahead, east_m, mass), 100.0, 0.0, doubt=EvidenceCusum(doubt)
    )
    return judge(AlternativeRules(), belief(main), other, 100.0 + gone_m, cells_only=cells)


def test_verdicts_on_their_borders():
    assert verdict(T, 0.0) is Verdict.OPEN
    assert verdict(T, 0.0, east_m=50.0, mass=0.9) is Verdict.CONFIRMED
    assert verdict(T, 0.0, east_m=50.1, mass=0.9) is Verdict.OPEN
    assert verdict(T, 0.0, east_m=50.0, mass=0.89) is Verdict.OPEN
    assert (verdict(S, 4.0), verdict(S, 3.9)) == (Verdict.AHEAD, Verdict.OPEN)
    assert (verdict(T, 10.0), verdict(T, 9.9)) == (Verdict.AHEAD, Verdict.OPEN)
    assert (verdict(T, 6.0, cells=True), verdict(T, 5.9, cells=True)) == (
        Verdict.AHEAD, Verdict.OPEN,
    )  # fmt: skip
    assert verdict(S, 5.0, cells=True) is Verdict.AHEAD
    assert verdict(T, 10.0, status=C) is verdict(T, 10.0, status=T) is Verdict.WON
    assert verdict(T, 10.0, status=C, doubt=2.5) is Verdict.WON
    assert verdict(T, 10.0, status=C, doubt=2.6) is Verdict.AHEAD
    assert (verdict(T, -25.0), verdict(T, -24.9)) == (Verdict.GAVE_UP, Verdict.OPEN)
    assert (verdict(T, 0.0, gone_m=800.0), verdict(T, 0.0, gone_m=799.0)) == (
        Verdict.GAVE_UP, Verdict.OPEN,
    )  # fmt: skip


def settled(main, ahead, doubt=0.0, own=0.0, cells=False, before=None):
    other = AlternativeHypothesis(
        belief(S, ahead, 500.0, 0.5), 100.0, 0.0, doubt=EvidenceCusum(own, 1.2)
    )
    return resolve_alternative(
        AlternativeRules(),
        before or main,
        belief(main),
        EvidenceCusum(doubt, 0.9),
        other,
        200.0,
        cells_only=cells,
    )


def test_settlements_on_their_borders():
    # No belief converges in doubt, nor beside a challenger that is hardly behind.
    alone = resolve_alternative(
        AlternativeRules(), S, belief(C), EvidenceCusum(2.5), None, 0.0, cells_only=False
    )
    assert (alone.status, alone.challenger, alone.taken_over) == (C, None, False)
    assert settled(C, -2.0).status is C
    assert settled(C, -1.9).status is S
    assert settled(T, 12.0, own=4.9).taken_over is False
    over = settled(T, 12.0, doubt=9.0, own=5.0)
    assert (over.taken_over, over.status, over.doubt) == (True, L, EvidenceCusum(5.0, 1.2))
    assert np.isnan(over.belief.agreement_start_m)
    assert settled(T, 12.0, own=2.5, cells=True).taken_over is True
    assert settled(T, 12.0, own=2.4, cells=True).taken_over is False
    search = settled(S, 5.0, doubt=9.0, own=1.0)
    assert (search.taken_over, search.status, search.doubt) == (True, S, EvidenceCusum(0.0, 0.9))
    assert search.belief.status is S
    kept = settled(T, 12.0, doubt=9.0, own=1.0)
    assert (kept.status, kept.doubt, kept.challenger.doubt.sum) == (L, EvidenceCusum(9.0, 0.9), 1.0)
    other = AlternativeHypothesis(belief(S, 3.0), 0.0, against=-4.0, by_satellites=0.5)
    assert other.ahead(belief(T, 2.0)) == 3.0 - (2.0 + 4.0) + 0.5
    assert np.isnan(other.began_s)
    assert other.sky is NO_GNSS_STATE


def test_whom_to_go_by():
    main, rival = belief(T), AlternativeHypothesis(belief(S), 0.0, 0.0)
    memory = RadioHistory.empty(0)
    assert BayesTrack(memory, main, status=T, challenger=rival).leading is main
    assert BayesTrack(memory, main, status=L, challenger=rival).leading is rival.belief
    assert BayesTrack(memory, main, status=L).leading is main
