"""The Rao-Blackwellised particle filter, particle by particle with dense matrices."""

from math import log, pi

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.filters import rao_blackwell as rb
from mapfilter.filters.rao_blackwell import SIR, SirOptions
from mapfilter.models.gaussian import stack
from mapfilter.models.ranging import position_fix, pseudoranges, range_differences, timing_advances
from mapfilter.models.state import StateLayout
from mapfilter.positioning.kalman.models import compiled

LAYOUT = StateLayout(5, 3, 0, clock=2)
SITES = np.array([[90.0, 0.0], [-20.0, 110.0], [-60.0, -70.0]])
AWAY = np.array([[300.0, 400.0, 900.0], [-500.0, 100.0, 800.0]])
MODEL = stack(
    [
        pseudoranges(LAYOUT, AWAY, [2.0, 3.0]),
        range_differences(LAYOUT, SITES, [2.0, 3.0, 4.0]),
        timing_advances(LAYOUT, SITES[:1], 5.0),
    ]
)
NOISE = np.diag([4.0, 9.0, 13.0, 20.0, 25.0])
NOISE[2, 3] = NOISE[3, 2] = 4.0
LOADING = np.zeros((5, 5))
LOADING[1, 1], LOADING[4, 4], LOADING[4, 1] = 1.5, -2.0, 0.5
SAMPLED, OTHERS = [0, 3], [1, 2, 4]
ROOT = np.random.default_rng(2).normal(0, 2, (5, 5))
WIDE = ROOT @ ROOT.T + 20.0 * np.eye(5)


def expected(state):
    place = np.array([state[3], state[0]])
    sky = np.sqrt(((AWAY - [*place, 0.0]) ** 2).sum(axis=1)) + state[2]
    reach = np.hypot(*(SITES - place).T)
    return np.concatenate([sky, reach[1:] - reach[0], reach[:1]])


SLOPE = np.zeros((5, 5))
SLOPE[:2, 2] = 1.0
"""Of what is not sampled: the clock."""


@pytest.mark.parametrize("loaded", [False, True])
@pytest.mark.parametrize("absent", [[], [1], [0, 2], [3, 4]])
def test_an_update_is_that_of_each_particle_s_own_kalman_filter(loaded, absent):
    # More than are weighed at once.
    start = rb.init(np.zeros(5), WIDE, SAMPLED, 300, np.random.default_rng(1))
    weights = np.random.default_rng(3).dirichlet(np.ones(300))
    start = rb.MixedBelief(start.state, np.log(weights), start.covariance, start.sampled)
    reading = expected(np.array([5.0, 1.0, -3.0, 4.0, 2.0]))
    reading[absent] = np.nan
    after, news = rb.update(
        start,
        compiled(MODEL),
        reading,
        np.random.default_rng(4),
        SirOptions(0.0),
        LOADING if loaded else None,
    )
    there = np.isfinite(reading)
    slope = (SLOPE + LOADING if loaded else SLOPE)[there]
    extra = (LOADING if loaded else np.zeros((5, 5)))[there]
    spread = slope @ start.covariance @ slope.T + NOISE[np.ix_(there, there)]
    gain = start.covariance @ slope.T @ np.linalg.inv(spread)
    np.testing.assert_allclose(
        after.covariance, start.covariance - gain @ slope @ start.covariance, atol=1e-9
    )
    squares = np.empty(300)
    for i, state in enumerate(start.state.T):
        residual = reading[there] - expected(state)[there] - extra @ state
        squares[i] = residual @ np.linalg.solve(spread, residual)
        np.testing.assert_allclose(after.state[:, i], state + gain @ residual, atol=1e-8)
    np.testing.assert_array_equal(after.state[SAMPLED], start.state[SAMPLED])
    constant = there.sum() * log(2 * pi) + np.linalg.slogdet(spread)[1]
    joint = weights * np.exp(-0.5 * (squares - squares.min()))
    evidence = log(joint.sum()) - 0.5 * (squares.min() + constant)
    assert news.evidence == pytest.approx(evidence, abs=1e-4)
    assert news.nis == pytest.approx(squares.min(), rel=1e-9)
    np.testing.assert_allclose(after.weights(), joint / joint.sum(), rtol=1e-4, atol=1e-9)
    mean = after.state @ after.weights()
    np.testing.assert_allclose(after.mean(), mean, rtol=1e-5, atol=1e-5)
    moments, off = after.moments(), after.state - mean[:, None]
    np.testing.assert_allclose(moments.mean, mean, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(
        moments.covariance, off * after.weights() @ off.T + after.covariance, rtol=1e-4, atol=1e-4
    )


def test_what_is_drawn_corrects_the_rest():
    """``G`` from the conditional distribution, by dense matrices."""
    start = rb.init(np.arange(5.0), WIDE, [3, 0, 3], 40_000, np.random.default_rng(5))
    assert start.sampled.tolist() == SAMPLED
    np.testing.assert_allclose(start.log_weight, -log(40_000))
    s, o = np.ix_(SAMPLED, SAMPLED), np.ix_(OTHERS, SAMPLED)
    slope = WIDE[o] @ np.linalg.inv(WIDE[s])
    left = np.zeros((5, 5))
    left[np.ix_(OTHERS, OTHERS)] = WIDE[np.ix_(OTHERS, OTHERS)] - slope @ WIDE[o].T
    np.testing.assert_allclose(start.covariance, left, atol=1e-9)
    off = start.state - np.arange(5.0)[:, None]
    np.testing.assert_allclose(off[OTHERS], slope @ off[SAMPLED], atol=1e-6)
    np.testing.assert_allclose(np.cov(off[SAMPLED]), WIDE[s], atol=0.05 * WIDE[s].max())
    # A step, with noise of two directions only.
    phi = np.eye(5) + np.diag([0.5, 0.0, 0.3, 0.0], 1)
    process = np.outer(np.ones(5), np.ones(5)) + np.diag([0.0, 0.0, 0.0, 4.0, 0.0])
    after = rb.predict(start, phi, process, np.random.default_rng(6))
    whole = phi @ left @ phi.T + process
    slope = whole[o] @ np.linalg.inv(whole[s])
    np.testing.assert_allclose(
        after.covariance[np.ix_(OTHERS, OTHERS)],
        whole[np.ix_(OTHERS, OTHERS)] - slope @ whole[o].T,
        atol=1e-9,
    )
    np.testing.assert_array_equal(after.covariance[SAMPLED], 0.0)
    gone = after.state - phi @ start.state
    np.testing.assert_allclose(gone[OTHERS], slope @ gone[SAMPLED], atol=1e-5)
    np.testing.assert_allclose(np.cov(gone[SAMPLED]), whole[s], atol=0.05 * whole[s].max())
    np.testing.assert_array_equal(after.log_weight, start.log_weight)


def test_no_two_particles_are_moved_alike():
    count = 3000
    start = rb.init(np.zeros(3), np.eye(3), [0, 1, 2], count, np.random.default_rng(7))
    assert np.unique(start.state).size > 0.999 * start.state.size
    for shift in (1, 255, 256, 257, 512):
        both = np.vstack([start.state[:, shift:], start.state[:, :-shift]])
        assert np.abs(np.corrcoef(both) - np.eye(6)).max() < 5 / (count - shift) ** 0.5


def test_what_is_known_is_not_moved():
    known = np.diag([0.0, 4.0])
    start = rb.init([3.0, 5.0], known, [0], 50, np.random.default_rng(8))
    np.testing.assert_array_equal(start.state, np.tile([[3.0], [5.0]], 50))
    np.testing.assert_array_equal(start.covariance, known)
    # The second sampled component says what the first one says.
    twin = rb.init([0.0, 0.0], np.ones((2, 2)), [0, 1], 50, np.random.default_rng(9))
    np.testing.assert_allclose(twin.state[0], twin.state[1], atol=1e-6)
    assert twin.state[0].std() > 0.5


def untouched(rng):
    return rng.bit_generator.state == np.random.default_rng(1).bit_generator.state


def test_when_particles_are_drawn_anew():
    layout = StateLayout(2, 0, 1)
    fix = compiled(position_fix(layout, np.eye(2)))
    alike = rb.MixedBelief(
        np.zeros((2, 4)), np.full(4, -log(4)), np.zeros((2, 2)), np.array([0, 1])
    )
    rng = np.random.default_rng(1)
    # Four of four are effective, and none fewer.
    after, _ = rb.update(alike, fix, [1.0, 0.0], rng, SIR)
    assert untouched(rng)
    np.testing.assert_array_equal(after.state, alike.state)
    apart = rb.MixedBelief(
        np.array([[0.0, 0, 0, 9], [0.0] * 4]), alike.log_weight, alike.covariance, alike.sampled
    )
    kept, _ = rb.update(apart, fix, [0.0, 0.0], rng, SirOptions(0.7))
    assert untouched(rng)
    assert kept.weights()[3] < 1e-6
    # Three of four are.
    drawn, _ = rb.update(apart, fix, [0.0, 0.0], rng, SirOptions(0.8))
    assert not untouched(rng)
    np.testing.assert_array_equal(drawn.state, 0.0)
    np.testing.assert_allclose(drawn.log_weight, -log(4))


def test_copies_part_by_the_best_kernel_for_normal_beliefs():
    layout, count = StateLayout(3, 0, 1), 20_000
    fix = compiled(position_fix(layout, 1e-4 * np.eye(2)))
    # Two heaps of which one survives, whose width is none.
    state = np.zeros((3, count))
    state[0, : count // 2], state[2] = 1000.0, 7.0
    belief = rb.MixedBelief(state, np.full(count, -log(count)), np.zeros((3, 3)), np.array([0, 1]))
    wide, _ = rb.update(belief, fix, [0.0, 0.0], np.random.default_rng(2), SirOptions(1.0, 0.5))
    np.testing.assert_allclose(wide.state, np.tile([[0.0], [0.0], [7.0]], count), atol=1e-12)
    # A cloud of its own width: (4 / (N (d + 2)))^(1 / (d + 4)) of it.
    cloud = np.random.default_rng(3).normal(0, 2, (3, count))
    belief = rb.MixedBelief(cloud, belief.log_weight, belief.covariance, belief.sampled)
    wide = compiled(position_fix(layout, 1e3 * np.eye(2)))
    parted, _ = rb.update(belief, wide, [0.0, 0.0], np.random.default_rng(2), SirOptions(1.0, 0.8))
    plain, _ = rb.update(belief, wide, [0.0, 0.0], np.random.default_rng(2), SIR)
    off = parted.state - plain.state
    expected_sd = 2 * 0.8 * (4 / (count * 4)) ** (1 / 6)
    np.testing.assert_allclose(off[:2].std(axis=1), expected_sd, rtol=0.04)
    np.testing.assert_array_equal(off[2], 0.0)


def test_noise_that_is_none_and_states_that_do_not_fit_are_told():
    layout = StateLayout(2, 0, 1)
    fix = compiled(position_fix(layout, np.eye(2)))
    rng = np.random.default_rng(1)
    start = rb.init(np.zeros(2), np.eye(2), [0, 1], 5, rng)
    bad = type(fix)(fix.measure, fix.slots, fix.uses, fix.rows, fix.patterns, -np.eye(2))
    with pytest.raises(InputError, match="measurement, noise: expected a positive definite"):
        rb.update(start, bad, [0.0, 0.0], rng)
    for transition, process in ((np.eye(3), np.eye(2)), (np.eye(2), np.eye(3))):
        with pytest.raises(InputError, match="motion: expected two matrices 2 x 2"):
            rb.predict(start, transition, process, rng)
    with pytest.raises(InputError, match="loading: expected shape"):
        rb.update(start, fix, [0.0, 0.0], rng, SIR, np.zeros((2, 3)))
    part = rb.init(np.zeros(2), np.eye(2), [0], 5, rng)
    with pytest.raises(InputError, match=r"sampled: .*not .1."):
        rb.update(part, fix, [0.0, 0.0], rng)
