"""What becomes of hypotheses: carried on after a rest, turned at a jump, remounted, on a grid."""

from dataclasses import replace
from math import copysign, exp, inf, log, nan, pi
from types import SimpleNamespace

import numpy as np
import pytest
from small_area import make_area

from mapfilter.filters.contract import Status
from mapfilter.filters.grid import GridBelief
from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.street_motion import BIAS, NORTH, STATES, MotionErrors
from mapfilter.positioning.bayes.beliefs.belief_changes import carried_on, remounted, turned_at_jump
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules
from mapfilter.positioning.gnss.source import GnssSource
from mapfilter.positioning.gnss.state import GnssState
from mapfilter.positioning.sensors.rest import Rest

COUNT = 40_000
FILTERS = BeliefFilters(BayesModel(make_area(), MotionErrors(bias_sd_rad=0.05)))


def belief(status=Status.SEARCHING, *, bias_rad=0.0):
    state = np.zeros((STATES, COUNT), dtype=np.float32)
    state[BIAS] = bias_rad
    log_weight, kept = np.full(COUNT, -np.log(COUNT)), np.zeros((0, COUNT), dtype=np.float32)
    bins = Bins.over((0.0, 0.0, 90.0, 70.0))
    return ParticleBelief(state, log_weight, bins, kept, status=status)


def on_grid(count):
    """Mass in bins of headings, on and off the map."""
    on, off = (np.zeros((count, 2, 3), dtype=np.float32) for _ in range(2))
    on[0, 0, 0], on[1, 0, 0], on[0, 1, 2] = 0.3, 0.2, 0.1
    off[2, 0, 1] = 0.4
    return GridBelief(on, off, SimpleNamespace())


def with_rest(rest, *, compass=True, unit_m=1.0, travelled_m=100.0, **gnss):
    watch = SimpleNamespace(rest=rest, pace=SimpleNamespace(other_unit_m=unit_m))
    return SimpleNamespace(
        watch=watch,
        compass=compass,
        reckoning=SimpleNamespace(travelled_m=travelled_m),
        sources={GnssSource.name: GnssState(**gnss)},
    )


def carried(gone_s, *, left=1.0, pace_mps=1.5, measured_m=0.0):
    left_nats = log(left / (1 - left)) if 0 < left < 1 else copysign(inf, left - 0.5)
    rest = Rest(0.0, left_nats=left_nats, pace_mps=pace_mps, measured_m=measured_m)
    rng = np.random.default_rng(5)
    return carried_on(belief(), rest, gone_s, rng).state


@pytest.mark.parametrize(
    ("gone_s", "measured_m", "missed_mps"),
    [(40.0, 0.0, 1.5), (40.0, 20.0, 1.0), (200.0, 100.0, 1.0), (40.0, 60.0, 0.0),
     (40.0, 90.0, 0.0), (0.0, 0.0, 0.0), (0.5, 0.0, 1.5)],
)  # fmt: skip
def test_a_rest_that_was_a_way_spreads_hypotheses_over_it(gone_s, measured_m, missed_mps):
    """A way that forgets its direction after 60 s: 2 v² T (t - T (1 - exp(-t/T))), half an axis."""
    state = carried(gone_s, measured_m=measured_m)
    square_m2 = 2 * missed_mps**2 * 60.0 * (gone_s - 60.0 * (1 - exp(-gone_s / 60.0)))
    sd_m = (square_m2 / 2) ** 0.5
    for row in range(NORTH + 1):
        assert state[row].std() == pytest.approx(sd_m, rel=0.02)
        assert abs(state[row].mean()) <= 0.03 * sd_m
    assert abs(np.corrcoef(state[:2])[0, 1] if sd_m else 0.0) < 0.03
    assert not state[NORTH + 1 :].any()


@pytest.mark.parametrize("left", [0.0, 0.3])
def test_only_the_hypotheses_that_left_are_carried_on(left):
    state = carried(40.0, left=left)
    gone = state[0] != 0.0
    assert np.array_equal(gone, state[1] != 0.0)
    assert gone.mean() == pytest.approx(left, abs=0.01)


def test_on_a_grid_nothing_is_carried_on():
    mass, rest = on_grid(3), Rest(0.0, left_nats=inf, pace_mps=1.5)
    assert carried_on(mass, rest, 40.0, np.random.default_rng(1)) is mass


HOLDS = HoldRules(probability=0.2, around_probability=0.7)


@pytest.mark.parametrize(
    ("changed_deg", "share"),
    [(90.0, 0.2), (-90.0, 0.2), (149.9, 0.2), (150.1, 0.7), (-150.1, 0.7), (209.0, 0.7),
     (211.0, 0.2)],
)  # fmt: skip
def test_a_search_turns_the_phone_of_some_hypotheses_at_a_jump(changed_deg, share):
    changed_rad = np.radians(changed_deg)
    given = belief(bias_rad=3.0)
    found = turned_at_jump(given, HOLDS, changed_rad, np.random.default_rng(2))
    turned = found.state[BIAS] != given.state[BIAS]
    assert turned.mean() == pytest.approx(share, abs=0.01)
    # They walk straight on: what the heading changes by, the error takes back.
    expected = (3.0 - changed_rad + pi) % (2 * pi) - pi
    np.testing.assert_allclose(found.state[BIAS, turned], expected, atol=1e-6)
    assert (given.state[BIAS] == 3.0).all()
    mass = on_grid(3)
    assert turned_at_jump(mass, HOLDS, changed_rad, np.random.default_rng(2)) is mass


@pytest.mark.parametrize("length_m", [0.5, 20.0])
def test_a_tracked_phone_is_remounted_by_the_metre(length_m):
    motion = MotionErrors(remounts_per_m=0.04)
    given = belief(Status.TRACKING)
    found = remounted(given, motion, length_m, np.random.default_rng(3))
    # Some are drawn twice.
    share = 1 - exp(-(1 - exp(-0.04 * length_m)))
    assert np.mean(found.state[BIAS] != 0.0) == pytest.approx(share, rel=0.06)


@pytest.mark.parametrize(
    ("status", "length_m", "per_m"),
    [(Status.SEARCHING, 20.0, 0.04), (Status.CONVERGED, 20.0, 0.04), (Status.TRACKING, 0.0, 0.04),
     (Status.TRACKING, 20.0, 0.0), (Status.TRACKING, 1e-9, 0.04)],
)  # fmt: skip
def test_no_phone_is_remounted_otherwise(status, length_m, per_m):
    motion = MotionErrors(remounts_per_m=per_m)
    given, mass, rng = belief(status), on_grid(3), np.random.default_rng(3)
    assert remounted(given, motion, length_m, rng) is given
    assert remounted(mass, motion, 20.0, rng) is mass
    if length_m != 1e-9:
        # Nothing is drawn for it.
        assert rng.random() == np.random.default_rng(3).random()


def test_mass_on_a_grid_is_spread_over_all_headings():
    found = FILTERS.without_compass(on_grid(9), np.random.default_rng(4))
    assert found.on.shape == found.off.shape == (72, 2, 3)
    expected = np.zeros((2, 3))
    expected[0, 0], expected[1, 2] = 0.5 / 72, 0.1 / 72
    for at in (0, 35, 71):
        np.testing.assert_allclose(found.on[at], expected, rtol=1e-6)
        np.testing.assert_allclose(found.off[at, 0], [0.0, 0.4 / 72, 0.0], rtol=1e-6)
    assert found.on.sum() + found.off.sum() == pytest.approx(1.0)
    assert not found.model.compass
    assert found.model.circular


def test_a_grid_remembers_no_errors_and_uses_one_thread():
    filters = replace(FILTERS, grid=True)
    for compass in (True, False):
        one = filters.by_compass[compass]
        assert (one.model.compass, one.model.model.remember) == (compass, False)
        assert one.model.model.threads.count == 1
    # A bin is 0.04 rad; three deviations of 0.05 rad to both sides.
    assert filters.by_compass[True].model.bias_rad.size == 9


def ahead(ahead_m, odds=0.0):
    """A belief in which the phone was turned, ahead of the main one since some distance."""
    return SimpleNamespace(ahead_m=ahead_m, log_odds=lambda _: odds, is_elsewhere=lambda _: True)


def test_when_another_way_of_holding_the_phone_is_ahead():
    reckoning = SimpleNamespace(travelled_m=100.0)
    for held, expected in (((), False), ((ahead(93.0),), True), ((ahead(93.1),), False),
                           ((ahead(50.0, -1.0),), False)):  # fmt: skip
        state = SimpleNamespace(held=held, belief=belief(), reckoning=reckoning, found_alone=())
        assert FILTERS.is_contested(state) is expected
    state.held, state.belief = (ahead(50.0),), on_grid(3)
    assert not FILTERS.is_contested(state)


def test_in_which_other_unit_steps_may_be():
    unit = {"unit_m": 0.3048}
    assert FILTERS.other_unit_m(with_rest(None, **unit)) == 0.3048
    unwatched = replace(FILTERS, holds=HoldRules(watched=False))
    assert unwatched.other_unit_m(with_rest(None, **unit)) == 1.0
    # Without a compass, or once satellites were there, steps are not a walker's by all means.
    assert FILTERS.other_unit_m(with_rest(None, compass=False, **unit)) == 1.0
    assert FILTERS.other_unit_m(with_rest(None, compared_at_m=3.0, **unit)) == 1.0


@pytest.mark.parametrize(
    ("doubtful", "used_at_m", "expected"),
    [(True, -inf, True), (False, -inf, False), (True, 99.9, True), (True, 100.0, False),
     (None, nan, False)],
)  # fmt: skip
def test_whether_a_walker_may_have_left_during_a_rest(doubtful, used_at_m, expected):
    rest = None if doubtful is None else SimpleNamespace(is_doubtful=doubtful)
    state = with_rest(rest, fix_used_at_m=used_at_m)
    assert FILTERS.may_have_left(state) is expected
    assert not replace(FILTERS, holds=HoldRules(watched=False)).may_have_left(state)


@pytest.mark.parametrize(
    ("ended", "is_ride", "rode_unheard", "compared_at_s", "expected"),
    [
        (True, True, False, -inf, True),
        (True, True, False, 39.0, True),
        # A position was compared during the ride.
        (True, True, False, 40.0, False),
        (True, False, False, -inf, False),
        # It goes on.
        (False, True, False, -inf, False),
        (False, False, True, -inf, True),
        (False, False, True, 30.0, False),
        (False, False, True, 29.0, True),
    ],
)
def test_after_a_ride_a_walker_may_be_anywhere(
    ended, is_ride, rode_unheard, compared_at_s, expected
):
    rest = SimpleNamespace(since_s=40.0, was_ride=lambda time_s: is_ride and time_s == 100.0)
    state = with_rest(rest, compared_at_s=compared_at_s)
    state.watch.times = SimpleNamespace(report_s=30.0)
    watch = SimpleNamespace(rest=None if ended else rest, rode_unheard=rode_unheard)
    assert FILTERS.may_be_anywhere(state, watch, 100.0) is expected
    unwatched = replace(FILTERS, holds=HoldRules(watched=False))
    assert not unwatched.may_be_anywhere(state, watch, 100.0)
    state.watch.rest = None
    assert FILTERS.may_be_anywhere(state, watch, 100.0) is (expected and rode_unheard)


@pytest.mark.parametrize(
    ("unit_m", "compared_at_s", "expected"),
    [(1.0, -inf, True), (1.0, 29.0, True), (1.0, 30.0, False), (0.3, -inf, False)],
)
def test_a_place_is_in_doubt_while_nothing_is_heard(unit_m, compared_at_s, expected):
    state = with_rest(None, compared_at_s=compared_at_s)
    state.hold = SimpleNamespace(step_unit_m=unit_m)
    state.watch.times = SimpleNamespace(report_s=30.0)
    state.watch.is_unheard = lambda unit: unit == 1.0
    assert FILTERS.is_unheard(state) is expected
    assert not replace(FILTERS, holds=HoldRules(watched=False)).is_unheard(state)
