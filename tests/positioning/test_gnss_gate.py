"""Fixes and pseudoranges beside a belief: what is used, what is rejected, and for how long."""

from dataclasses import replace
from math import inf, isnan, log, nan

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleBelief
from mapfilter.geodesy import project
from mapfilter.gnss.sky import GridFrame
from mapfilter.models.street_motion import EAST, NORTH, STATES
from mapfilter.positioning.epochs import Epoch, GnssFix, Pseudorange
from mapfilter.positioning.gnss.fixes import FixTerm, refutation, widened
from mapfilter.positioning.gnss.gate import GnssGate
from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.state import GnssState

CRS = "EPSG:32632"
EAST_M, NORTH_M = (float(one) for one in project(CRS, 9.3, 48.5))
ORIGIN_M = EAST_M - 500.0, NORTH_M - 400.0
AREA_M2 = 1e6
OPTIONS = GnssOptions(
    fix_memory_m=20.0, fix_memory_s=14.0, gate=8.0, search_gate=16.0, probation_s=5.0,
    outliers=0.1, height_m=300.0,
)  # fmt: skip
GATE = GnssGate(OPTIONS, CRS, ORIGIN_M, AREA_M2)
PLACE_M = 500.0, 400.0
"""The true place in the frame of the hypotheses."""


def belief_at(place_m=PLACE_M, sd_m=8.0, status=Status.TRACKING, count=400, seed=1):
    """A belief about a place, with weights that differ."""
    rng = np.random.default_rng(seed)
    state = np.zeros((STATES, count), dtype=np.float32)
    for row, middle in ((EAST, place_m[0]), (NORTH, place_m[1])):
        state[row] = middle + sd_m * rng.standard_normal(count)
    log_weight = np.log(rng.dirichlet(np.ones(count)))
    return ParticleBelief(
        state, log_weight, Bins.over((0.0, 0.0, 1000.0, 1000.0)),
        np.empty((0, count), dtype=np.float32), status=status,
    )  # fmt: skip


def fix_at(east_m=0.0, north_m=0.0, sd_m=6.0):
    return GnssFix(EAST_M + east_m, NORTH_M + north_m, sd_m**2, sd_m**2, 0.0)


def compared(belief, state=None, time_s=10.0, travelled_m=100.0, gate=GATE, **given):
    epoch = Epoch(time_s, (), **given)
    return gate.compare(belief, state or GnssState(), epoch, travelled_m, 0.0)


def sum_of(terms, belief):
    return sum(np.broadcast_to(one.log_likelihood(belief.state), belief.log_weight.shape)
               for one in terms)  # fmt: skip


@pytest.mark.parametrize(("gone_m", "times"), [(inf, 1.0), (40.0, 1.0), (5.0, 4.0), (0.0, 200.0)])
def test_a_fix_that_agrees_weighs_hypotheses_and_leaves_the_belief(gone_m, times):
    """Fixes in a row count as one over the distance for which their errors last."""
    belief, fix = belief_at(sd_m=4.0), fix_at(4.0, -3.0)
    state = GnssState(fix_used_at_m=100.0 - gone_m, rejected_since_s=3.0)
    found = compared(belief, state, gnss=fix)
    own = FixTerm(widened(fix, times), ORIGIN_M).log_likelihood(belief.state)
    total = np.log(np.exp(belief.log_weight) @ np.exp(own))
    np.testing.assert_allclose(sum_of(found.terms, belief), own - total, atol=1e-6)
    expected = refutation(widened(fix, times), total, AREA_M2) / times
    assert found.under_null == pytest.approx(expected)
    assert found.under_null < 0
    assert found.compared
    assert found.unused == ()
    after = found.state
    assert (after.fix_used_at_m, after.compared_at_m, after.compared_at_s) == (100.0, 100.0, 10.0)
    assert isnan(after.rejected_since_s)
    assert not after.rejecting
    assert after.was_used(10.0)
    assert not after.was_used(11.0)
    assert found.belief is belief


@pytest.mark.parametrize(
    ("gone_m", "elapsed_s", "times"),
    [(90.0, 28.0, 1.0), (90.0, 14.0, 1.0), (90.0, 7.0, 2.0), (10.0, 1.0, 14.0), (2.0, 7.0, 10.0)],
)
def test_fixes_of_a_fast_vehicle_count_as_one_over_some_time(gone_m, elapsed_s, times):
    """At 10 m/s the way of 20 m is over after two fixes, whose errors last for longer."""
    belief, fix = belief_at(sd_m=4.0), fix_at(4.0, -3.0)
    state = GnssState(fix_used_at_m=100.0 - gone_m, fix_used_at_s=10.0 - elapsed_s)
    assert state.repeats(OPTIONS, 10.0, 100.0) == pytest.approx(times)
    found = compared(belief, state, gnss=fix)
    own = FixTerm(widened(fix, times), ORIGIN_M).log_likelihood(belief.state)
    total = np.log(np.exp(belief.log_weight) @ np.exp(own))
    np.testing.assert_allclose(sum_of(found.terms, belief), own - total, atol=1e-6)
    assert found.state.fix_used_at_s == 10.0


def test_a_repeated_fix_makes_a_wide_belief_as_precise_as_it_is():
    belief, fix = belief_at(count=20_000), fix_at(4.0, -3.0)
    found = compared(belief, GnssState(fix_used_at_m=99.9), gnss=fix)
    weight = np.exp(belief.log_weight + sum_of(found.terms, belief))
    weight /= weight.sum()
    for axis in (EAST, NORTH):
        place_m = belief.state[axis].astype(float)
        variance_m2 = weight @ (place_m - weight @ place_m) ** 2
        assert variance_m2 == pytest.approx(fix.var_east_m2, rel=0.05)


def off_by(nats, sd_m=6.0):
    """A fix whose log-likelihood, of hypotheses at one place, is so low."""
    return fix_at(sd_m * (2 * nats) ** 0.5, 0.0, sd_m)


@pytest.mark.parametrize(
    ("status", "limit"), [(Status.TRACKING, 9.0), (Status.LOST, 9.0), (Status.SEARCHING, 11.0)]
)
def test_a_fix_that_no_hypothesis_explains_is_rejected_for_a_while(status, limit):
    """Later than usual by the gate; while searching by a wider one."""
    gate = replace(GATE, options=replace(OPTIONS, search_gate=10.0))
    belief = belief_at(sd_m=0.0, status=status)
    good = compared(belief, gnss=off_by(limit - 0.1), gate=gate)
    assert good.unused == ()
    assert not good.state.rejecting
    bad = compared(belief, gnss=off_by(limit + 0.1), gate=gate)
    assert bad.unused == (("gnss", "", Reason.REJECTED_BY_EVIDENCE),)
    assert bad.compared
    assert bad.under_null == 0.0
    assert np.all(sum_of(bad.terms, belief) == 0.0)
    state = bad.state
    assert (state.rejected_since_s, state.probation_until_s) == (10.0, 15.0)
    assert state.rejecting
    assert not state.was_used(10.0)
    assert state.fix_used_at_m == -inf
    # Nothing is used before its end, whatever it says; a series goes on from its begin.
    later = compared(belief, state, time_s=14.9, gnss=fix_at(), gate=gate)
    assert later.unused == (("gnss", "", Reason.ON_PROBATION),)
    assert later.compared
    assert later.state.probation_until_s == 15.0
    again = compared(belief, state, time_s=15.0, gnss=off_by(limit + 0.1), gate=gate)
    assert (again.state.rejected_since_s, again.state.probation_until_s) == (10.0, 20.0)
    ended = compared(belief, state, time_s=15.0, gnss=fix_at(), gate=gate)
    assert not ended.state.rejecting
    assert ended.unused == ()


def test_a_rejected_fix_weighs_rivals_that_explain_it():
    """By no more than the gate; those that it contradicts, too, lose nothing."""
    fix = fix_at(100.0, 0.0)
    found = compared(belief_at(sd_m=0.0), gnss=fix)
    (term,) = found.rival_terms
    at_fix, near, far = (
        belief_at((PLACE_M[0] + x, PLACE_M[1]), 0.0, count=1).state for x in (100.0, 88.0, -100.0)
    )
    assert term.log_likelihood(at_fix) == pytest.approx(9.0)
    assert term.log_likelihood(near) == pytest.approx(7.0)
    assert term.log_likelihood(far) == 0.0
    # One that is used weighs all beliefs alike, one on probation none.
    assert compared(belief_at(), gnss=fix_at()).rival_terms == ()
    assert compared(belief_at(), found.state, time_s=12.0, gnss=fix).rival_terms == ()


def test_a_fix_at_the_gate_is_used():
    """6 m off with a variance of 2 m² it is 9 nats less than at its place."""
    fix = replace(fix_at(6.0), var_east_m2=2.0, var_north_m2=2.0)
    assert compared(belief_at(sd_m=0.0, count=1), gnss=fix).unused == ()


@pytest.mark.parametrize(
    ("given", "used"),
    [
        ((36.0, 9.0, 0.0), (36.0, 9.0, 0.0)),
        ((36.0, 9.0, 10.0), (36.0, 9.0, 10.0)),
        ((16.0, 25.0, -12.0), (16.0, 25.0, -12.0)),
        # Errors of less than a metre, and errors that lie on a line, are none that fixes have.
        ((0.01, 0.5, 0.0), (1.0, 1.0, 0.0)),
        ((36.0, 9.0, 18.0), (36.0, 9.0, 0.99 * 18.0)),
        ((36.0, 9.0, -50.0), (36.0, 9.0, -0.99 * 18.0)),
        ((36.0, 9.0, nan), (36.0, 9.0, 0.0)),
        ((nan, nan, nan), (100.0, 100.0, 0.0)),
        ((36.0, nan, 5.0), (100.0, 100.0, 0.0)),
    ],
)
def test_the_likelihood_of_a_fix_is_normal_about_its_place_and_clipped(given, used):
    fix = GnssFix(EAST_M + 7.0, NORTH_M - 4.0, *given)
    term = FixTerm(fix, ORIGIN_M)
    middle = PLACE_M[0] + 7.0, PLACE_M[1] - 4.0
    assert term.place_m == pytest.approx(middle)
    east_m2, north_m2, cross_m2 = used
    law = multivariate_normal(middle, [[east_m2, cross_m2], [cross_m2, north_m2]])
    spread = np.random.default_rng(2).standard_normal((2, 60)) * [[east_m2**0.5], [north_m2**0.5]]
    state = np.zeros((STATES, 60), dtype=np.float32)
    state[EAST], state[NORTH] = np.array(middle)[:, None] + 2.0 * spread
    places = state[[EAST, NORTH]].T.astype(float)
    # Five standard deviations are the most that it is off.
    expected = np.maximum(law.logpdf(places) - law.logpdf(middle), -12.5)
    assert (expected > -12.0).any()
    np.testing.assert_allclose(term.log_likelihood(state), expected, rtol=2e-3, atol=2e-3)
    state[EAST] += 1000.0
    np.testing.assert_array_equal(term.log_likelihood(state), np.full(60, -12.5))


def test_a_fix_is_widened_by_its_variance():
    fix = GnssFix(3.0, 4.0, 36.0, 9.0, -5.0)
    assert widened(fix, 2.0) == GnssFix(3.0, 4.0, 72.0, 18.0, -10.0)
    known = {"var_east_m2": nan}, {"var_north_m2": inf}, {"var_east_m2": 0.0}, {"var_north_m2": 0.0}
    for missing in (replace(fix, **changes) for changes in known):
        assert widened(missing, 3.0) == GnssFix(3.0, 4.0, 300.0, 300.0, 0.0)


def test_before_the_first_comparison_one_is_due_and_nothing_was_met():
    state = GnssState()
    assert (state.compared_at_m, state.compared_at_s, state.fix_used_at_m) == (-inf, -inf, -inf)
    assert state.due(OPTIONS, 0.0, 0.0)
    assert not state.met
    assert state.used_at_m == -inf


def test_a_probation_ends_at_its_time():
    belief = belief_at()
    for until_s, is_used in ((10.0, True), (10.1, False)):
        found = compared(belief, GnssState(probation_until_s=until_s), gnss=fix_at(3.0))
        assert (found.unused == ()) == is_used
        assert bool(np.ptp(sum_of(found.terms, belief)) > 0.1) == is_used
        assert found.state.was_used(10.0) == is_used


def test_a_fix_weighs_a_belief_whatever_its_weights_sum_to():
    belief = belief_at()
    found, again = (
        compared(replace(belief, log_weight=belief.log_weight - by), gnss=fix_at(3.0))
        for by in (0.0, 40.0)
    )
    np.testing.assert_allclose(sum_of(found.terms, belief), sum_of(again.terms, belief), atol=1e-9)
    assert found.under_null == pytest.approx(again.under_null)


def test_without_readings_nothing_was_compared():
    found = compared(belief_at())
    assert not found.compared
    assert (found.terms, found.unused, found.under_null) == ((), (), 0.0)
    empty = replace(belief_at(), state=np.zeros((STATES, 0), "f4"), log_weight=np.zeros(0))
    assert not compared(empty, gnss=fix_at()).compared


def test_when_satellites_were_met_used_and_are_due():
    new = GnssState()
    assert not new.met
    assert new.used_at_m == -inf
    assert replace(new, compared_at_m=0.0).met
    compared_ = replace(new, compared_at_m=50.0, compared_at_s=20.0)
    options = GnssOptions(spacing_m=10.0, pause_s=7.0)
    for time_s, travelled_m, due in (
        (26.9, 59.9, False), (20.0, 60.0, True), (27.0, 50.0, True), (20.0, 50.0, False),
    ):  # fmt: skip
        assert compared_.due(options, time_s, travelled_m) is due
    used = compared(belief_at(), pseudoranges=ranges()).state
    assert used.used_at_m == 100.0
    assert replace(used, fix_used_at_m=130.0).used_at_m == 130.0
    assert replace(new, receiver=used.receiver).met


DIRECTIONS = [(10.0, 70.0), (80.0, 30.0), (150.0, 45.0), (230.0, 25.0), (300.0, 55.0), (30.0, 20.0)]
"""Azimuth and elevation of satellites, degrees."""


def ranges(clock_m=2000.0, errors=(1.0, -2.0, 0.5, 1.5, -1.0, 0.3), count=6, off_m=(0.0, 0.0)):
    """Pseudoranges of a receiver at the true place, or beside it, and at the assumed height."""
    frame = GridFrame(CRS, EAST_M, NORTH_M, 300.0).local
    azimuth, elevation = np.radians(DIRECTIONS[:count]).T
    unit = np.stack([np.cos(elevation) * np.sin(azimuth), np.cos(elevation) * np.cos(azimuth),
                     np.sin(elevation)], axis=1)  # fmt: skip
    local = 2.1e7 * unit
    away_m = np.linalg.norm(local - np.array([*off_m, 0.0]), axis=1)
    places = local @ frame.axes + frame.origin_m
    return tuple(
        Pseudorange(
            f"G{k:02d}", float(away_m[k] + clock_m + errors[k]), 3.0, tuple(map(float, one))
        )
        for k, one in enumerate(places)
    )


def weighted_mean(belief, gain):
    weight = np.exp(belief.log_weight + gain)
    return belief.state[:2] @ (weight / weight.sum())


@pytest.mark.parametrize("status", [Status.TRACKING, Status.SEARCHING])
@pytest.mark.parametrize("fresh", [True, False])
def test_satellites_that_agree_lead_to_their_place(status, fresh):
    """At first with an unknown clock, then with the one that is known, 30 m on."""
    belief = belief_at((PLACE_M[0] + 6, PLACE_M[1] - 5), 10.0, status, count=3000)
    found = compared(belief, pseudoranges=ranges())
    if not fresh:
        moved = replace(found.belief, status=status)
        found = compared(moved, found.state, 20.0, 130.0, pseudoranges=ranges())
    gain = sum_of(found.terms, found.belief)
    assert found.unused == ()
    assert found.compared
    away_m = [
        np.hypot(*(weighted_mean(belief, one) - np.array(PLACE_M))) for one in (0.0 * gain, gain)
    ]
    assert away_m[0] > 6.5
    # What the first readings have said is not said again by the same satellites 30 m on.
    assert away_m[1] < (4.5 if fresh else 6.5)
    # One reading in ten tells nothing: no hypothesis loses more than that.
    assert gain.min() >= log(0.1) - 1e-9
    assert gain.min() < log(0.1) + 0.3
    assert np.exp(belief.log_weight) @ np.exp(gain) == pytest.approx(1.0)
    receiver = found.state.receiver
    assert receiver.used_at_m == (100.0 if fresh else 130.0)
    assert receiver.mean[0] == pytest.approx(2000.0, abs=60.0)
    assert found.belief.state.shape[0] == STATES + 3 + 6
    np.testing.assert_array_equal(found.belief.state[:STATES], belief.state)
    assert np.sqrt(receiver.covariance[0, 0]) < 200.0


def test_a_first_receiver_is_at_the_stated_height():
    """Where that is known, neither it nor its rate of change is found anew."""
    sure = replace(OPTIONS, height_sd_m=0.0, drift_sd_mps=0.0)
    found = compared(belief_at(), pseudoranges=ranges(), gate=replace(GATE, options=sure))
    np.testing.assert_allclose(found.state.receiver.mean[1:3], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.belief.state[STATES + 1 : STATES + 3], 0.0, atol=1e-6)


def test_no_share_of_faulty_readings_leaves_likelihoods_as_they_are():
    gate = replace(GATE, options=replace(OPTIONS, outliers=0.0))
    belief = belief_at(sd_m=30.0)
    plain, mixed = (
        sum_of(compared(belief, pseudoranges=ranges(), gate=one).terms, belief)
        for one in (gate, GATE)
    )
    np.testing.assert_allclose(mixed, np.log(0.9 * np.exp(plain) + 0.1), atol=1e-9)
    assert plain.min() < -6


@pytest.fixture(scope="module")
def known():
    """A belief whose receiver is known."""
    found = compared(belief_at(), pseudoranges=ranges())
    return found.belief, found.state


def test_a_satellite_that_is_far_off_is_left_out_alone(known):
    errors = np.array([1.0, -2.0, 0.5, 1.5, -1.0, 0.3])
    errors[3] += 900.0
    belief, state = known
    found = compared(belief, state, 11.0, 101.0, pseudoranges=ranges(errors=errors))
    assert found.unused == (("pseudorange", "G03", Reason.REJECTED_BY_EVIDENCE),)
    assert not found.state.rejecting
    assert found.state.receiver.used_at_m == 101.0
    errors[[1, 4]] -= 700.0
    half = compared(belief, state, 11.0, 101.0, pseudoranges=ranges(errors=errors))
    assert [name for _, name, _ in half.unused] == [f"G{k:02d}" for k in range(6)]
    assert half.state.rejecting
    assert half.state.probation_until_s == 16.0
    assert half.state.receiver.used_at_m == 100.0
    # Of three one, of two satellites none is left out alone.
    three = compared(
        belief, state, 11.0, 101.0, pseudoranges=ranges(errors=(1.0, 900.0, 0.5), count=3)
    )
    assert [name for _, name, _ in three.unused] == ["G01"]
    two = compared(belief, state, 11.0, 101.0, pseudoranges=ranges(errors=(900.0, 0.0), count=2))
    assert len(two.unused) == 2


@pytest.mark.parametrize(
    ("status", "used"), [(Status.TRACKING, False), (Status.LOST, False), (Status.SEARCHING, True)]
)
def test_a_tracked_belief_is_compared_as_a_whole(status, used):
    """One hypothesis in a hundred lies where the satellites say: that is enough for a search."""
    belief = belief_at(status=status)
    belief = replace(belief, log_weight=np.full(400, -np.log(400.0)))
    belief.state[EAST, :4] += 300.0
    found = compared(belief, pseudoranges=ranges(off_m=(300.0, 0.0)))
    assert (found.unused == ()) is used
    if used:
        assert weighted_mean(belief, sum_of(found.terms, belief))[0] > PLACE_M[0] + 200.0


@pytest.mark.parametrize("off_m", [0.0, 150.0])
def test_particles_far_apart_do_not_hide_that_a_belief_is_elsewhere(off_m):
    """Their distance widens what hypotheses are weighed by, not what the belief is compared by."""
    epoch = Epoch(10.0, (), pseudoranges=ranges(off_m=(off_m, 0.0)))
    found = GATE.compare(belief_at(), GnssState(), epoch, 100.0, 100.0)
    assert (found.unused == ()) is (off_m == 0.0)


def clock_of(found):
    rows = found.belief.state[STATES].astype(float)
    return found.state.receiver.mean[0] + float(found.belief.weight @ rows)


def test_a_clock_that_jumps_is_found_anew_and_known_from_then_on(known):
    belief, state = known
    found = compared(belief, state, 11.0, 101.0, pseudoranges=ranges(clock_m=52_000.0))
    assert found.unused == ()
    assert clock_of(found) == pytest.approx(52_000.0, abs=60.0)
    # So it is with errors of twice the stated deviation.
    usual = ranges(clock_m=52_000.0, errors=(6.0, -6.0, 6.0, -6.0, 6.0, -6.0))
    assert compared(belief, state, 11.0, 101.0, pseudoranges=usual).unused == ()
    # Larger ones, which a clock that is known allows, are too large for one that jumped as well.
    for clock_m, used in ((2000.0, True), (52_000.0, False)):
        large = ranges(clock_m=clock_m, errors=(8.0, -8.0, 8.0, -8.0, 8.0, -8.0))
        assert (compared(belief, state, 11.0, 101.0, pseudoranges=large).unused == ()) is used
    # Another jump is found from there; without one the clock stays.
    for clock_m in (52_000.0, -300_000.0):
        later = compared(
            found.belief, found.state, 12.0, 131.0, pseudoranges=ranges(clock_m=clock_m)
        )
        assert later.unused == ()
        assert clock_of(later) == pytest.approx(clock_m, abs=60.0)
    # Far from the clock one satellite is explained by a jump, near it by the place alone.
    (one, *_) = ranges(clock_m=52_000.0, off_m=(0.0, -45.0))
    gains = []
    for before in (found, replace_clock(found, 10_000.0)):
        later = compared(before.belief, before.state, 12.0, 201.0, pseudoranges=(one,))
        gains.append(np.ptp(sum_of(later.terms, later.belief)))
    assert gains[0] > 3 * gains[1]


def replace_clock(found, off_m):
    """The same with a receiver whose clock is off."""
    receiver = found.state.receiver
    mean = receiver.mean.copy()
    mean[0] -= off_m
    state = replace(found.state, receiver=replace(receiver, mean=mean))
    return found._replace(state=state)


def test_satellites_of_another_place_are_rejected_and_then_on_probation(known):
    belief, state = known
    elsewhere = ranges(off_m=(700.0, -500.0))
    found = compared(belief, state, 11.0, 101.0, pseudoranges=elsewhere)
    assert {why for *_, why in found.unused} == {Reason.REJECTED_BY_EVIDENCE}
    assert len(found.unused) == 6
    assert np.all(sum_of(found.terms, belief) == 0.0)
    later = compared(found.belief, found.state, 15.9, 105.0, pseudoranges=ranges())
    assert {why for *_, why in later.unused} == {Reason.ON_PROBATION}
    assert later.state.receiver.used_at_m == 100.0
    assert (later.state.rejected_since_s, later.state.probation_until_s) == (11.0, 16.0)
    after = compared(later.belief, later.state, 16.0, 106.0, pseudoranges=ranges())
    assert after.unused == ()
    assert not after.state.rejecting
    # A fix that is rejected takes the satellites of its epoch with it.
    both = compared(belief, state, 11.0, 101.0, gnss=fix_at(800.0), pseudoranges=ranges())
    assert ("gnss", "", Reason.REJECTED_BY_EVIDENCE) in both.unused
    assert sum(why is Reason.ON_PROBATION for *_, why in both.unused) == 6
    assert both.under_null == 0.0
    # And the other way around: one that agrees is not used, either.
    both = compared(belief, state, 11.0, 101.0, gnss=fix_at(), pseudoranges=elsewhere)
    assert ("gnss", "", Reason.ON_PROBATION) in both.unused
    assert sum(why is Reason.REJECTED_BY_EVIDENCE for *_, why in both.unused) == 6
    assert (both.state.fix_used_at_m, both.state.excess) == (-inf, 1.0)
    assert np.all(sum_of(both.terms, belief) == 0.0)


def test_a_belief_that_is_no_cloud_leaves_pseudoranges():
    class Other:
        def __init__(self):
            self.log_weight, self.status = np.zeros(3), Status.TRACKING

    found = compared(Other(), pseudoranges=ranges(count=2))
    assert [one[1:] for one in found.unused] == [
        ("G00", Reason.NOT_USED_BY_FILTER), ("G01", Reason.NOT_USED_BY_FILTER),
    ]  # fmt: skip
    assert not found.compared


def test_satellites_that_cannot_be_used_are_told_and_nothing_is_compared():
    low = tuple(replace(one, place_m=(nan, nan, nan)) for one in ranges(count=2))
    found = compared(belief_at(), pseudoranges=low)
    assert {why for *_, why in found.unused} == {Reason.UNKNOWN_SATELLITE}
    assert not found.compared
    assert found.state.receiver is None
