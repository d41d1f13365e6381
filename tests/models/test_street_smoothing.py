"""Going back along a track: ancestors are drawn by the probabilities of the formula."""

import numpy as np
import pytest

from mapfilter.models.street_ancestors import _drawn, _Near, draw_ancestors

PLACE, BIAS, SCALE = 4.0, 0.01, 0.0004


def probabilities(later, earlier, log_weight, moved_m, log_jump):
    """Godsill et al. (2004), eq. 6, for every pair, in plain NumPy."""
    angle, stretch = earlier[2], np.exp(earlier[3])
    east = earlier[0] + stretch * (moved_m[0] * np.cos(angle) - moved_m[1] * np.sin(angle))
    north = earlier[1] + stretch * (moved_m[0] * np.sin(angle) + moved_m[1] * np.cos(angle))
    away2 = (later[0][:, None] - east) ** 2 + (later[1][:, None] - north) ** 2
    turned = np.angle(np.exp(1j * (later[2][:, None] - earlier[2])))
    scaled = later[3][:, None] - earlier[3]
    fit = -0.5 * (away2 / PLACE + turned**2 / BIAS + scaled**2 / SCALE)
    chance = np.exp(np.maximum(fit, log_jump) + log_weight - log_weight.max())
    return chance / chance.sum(axis=1, keepdims=True)


def world(rng, count, width_m):
    state = np.zeros((5, count), dtype=np.float32)
    state[0], state[1] = rng.uniform(0, width_m, (2, count))
    state[2], state[3] = rng.normal(0, 0.05, count), rng.normal(0, 0.01, count)
    return state


@pytest.mark.parametrize("width_m", [15.0, 400.0])
@pytest.mark.parametrize("log_jump", [-6.0, -20.0])
def test_ancestors_are_drawn_by_their_probability(width_m, log_jump):
    rng = np.random.default_rng(3)
    earlier = world(rng, 60, width_m)
    log_weight = rng.normal(0, 1, 60).astype(np.float32)
    few = np.array(earlier[:, :3])
    few[0] += 5.0
    few[0, 2] = -900.0
    draws = 20_000
    later = np.repeat(few, draws, axis=1)
    variances, key = (PLACE, BIAS, SCALE), np.uint64(9)
    chosen = draw_ancestors(later, earlier, log_weight, (5.0, 1.0), variances, log_jump, key)
    expected = probabilities(few, earlier, log_weight, (5.0, 1.0), log_jump)
    for one in range(3):
        counted = np.bincount(chosen[one * draws : (one + 1) * draws], minlength=60) / draws
        spread = np.sqrt(expected[one] * (1 - expected[one]) / draws)
        assert np.all(np.abs(counted - expected[one]) <= 5 * spread + 1e-6)


@pytest.mark.parametrize(("width_m", "log_jump"), [(15.0, -3.0), (15.0, -6.0), (40.0, -20.0)])
def test_many_ancestors_are_drawn_by_their_probability(width_m, log_jump):
    count, draws = 3000, 20_000
    rng = np.random.default_rng(8)
    earlier = world(rng, count, width_m)
    log_weight = rng.normal(0, 1, count).astype(np.float32)
    few = np.array(earlier[:, :3])
    few[0] += 5.0
    # One that hardly anything leads to, and one beside all others.
    few[2, 1] += 1.0
    few[0, 2] += width_m
    later = np.repeat(few, draws, axis=1)
    variances, key = (PLACE, BIAS, SCALE), np.uint64(4)
    chosen = draw_ancestors(later, earlier, log_weight, (5.0, 1.0), variances, log_jump, key)
    expected = probabilities(few, earlier, log_weight, (5.0, 1.0), log_jump)
    for one in range(3):
        counted = np.bincount(chosen[one * draws : (one + 1) * draws], minlength=count) / draws
        for order in (*np.argsort(earlier[:4]), np.argsort(log_weight), np.argsort(expected[one])):
            apart = np.abs(np.cumsum(counted[order]) - np.cumsum(expected[one][order])).max()
            # Kolmogorov and Smirnov: exceeded by chance in one of 8 000.
            assert apart < 2.2 / np.sqrt(draws)


def test_the_same_key_draws_the_same():
    rng = np.random.default_rng(1)
    earlier, later = world(rng, 500, 100.0), world(rng, 50, 100.0)
    found = []
    for key in (5, 5, 6):
        weight = np.zeros(500, dtype=np.float32)
        motion = ((1.0, 1.0), (4.0, 1.0, 1.0))
        chosen = draw_ancestors(later, earlier, weight, *motion, -20.0, np.uint64(key))
        found.append(chosen.tolist())
    assert found[0] == found[1] != found[2]


@pytest.mark.parametrize(
    ("near", "start", "masses"),
    [
        # Two rows of two squares, and the first of each row; two squares of one row.
        ((0, 2, 0, 1, 0, 3, 2), [0, 1, 1, 2, 2], [0.5, 0.0, 0.0, 1.0, 0.0, 0.0]),
        ((0, 1, 0, 2, 0, 3, 2), [0, 1, 2], [0.5, 1.0, 0.0]),
    ],
)
def test_a_number_at_the_mass_of_a_square_draws_from_the_next_one(near, start, masses):
    """Each of two squares has a hypothesis of half the mass."""
    squares = _Near(*near, np.array(start, dtype=np.int32), np.ones(6), np.array(masses))
    before = np.array([0.0, 0.5, 1.0])
    for goal, drawn in ((0.25, 0), (0.5, 1), (0.75, 1)):
        assert _drawn(squares, before, goal) == (drawn, 1.0)
