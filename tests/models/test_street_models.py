"""Motion over streets against the scalar oracle: signs, moments, the map, and going back."""

from dataclasses import replace
from math import exp, log, pi, sqrt

import numpy as np
import pytest
import scalar_oracle as oracle

from mapfilter.models.street_ancestors import draw_ancestors
from mapfilter.models.street_motion import (
    BIAS,
    EAST,
    LOG_SCALE,
    NORTH,
    OFF,
    RATE,
    STATES,
    STRETCH,
    TURN,
    MotionErrors,
    move,
    moved_back,
)
from mapfilter.models.way_map import MapWeights, interpolate, map_log_likelihood, weigh_by_map

EXACT = MotionErrors(
    step_sd_m=0.0, heading_sd_rad=0.0, bias_drift_rad_per_sqrt_m=0.0, scale_drift_per_sqrt_m=0.0,
    disturbances_per_m=0.0, stretch_sd=0.0,
)  # fmt: skip
KEY = np.uint64(11)


def states(count, bias_rad=0.0, log_scale=0.0, seed=1):
    state = np.zeros((STATES, count), dtype=np.float32)
    state[:2] = np.random.default_rng(seed).uniform(100.0, 300.0, (2, count))
    state[BIAS], state[LOG_SCALE], state[OFF] = bias_rad, log_scale, 0.25
    return state


@pytest.mark.parametrize(
    ("heading_rad", "bias_rad", "toward"),
    [
        (0.0, 0.0, (10.0, 0.0)),
        (0.0, pi / 2, (0.0, 10.0)),
        (0.0, -pi / 2, (0.0, -10.0)),
        (pi / 2, pi / 6, (-5.0, 8.6602540)),
        (pi, pi / 6, (-8.6602540, -5.0)),
    ],
)
def test_a_positive_bias_turns_a_step_anticlockwise(heading_rad, bias_rad, toward):
    before = states(3, bias_rad)
    after = move(before, 10.0, heading_rad, EXACT, KEY)
    np.testing.assert_allclose(after[:2] - before[:2], np.outer(toward, np.ones(3)), atol=1e-4)
    np.testing.assert_array_equal(after[2:], before[2:])


def test_a_step_without_noise_is_that_of_the_oracle():
    rng = np.random.default_rng(2)
    before = states(60)
    before[BIAS], before[LOG_SCALE] = rng.uniform(-3, 3, 60), rng.normal(0, 0.3, 60)
    for step_m, heading_rad in ((7.0, 0.4), (7.0, -2.9), (-4.0, 1.1)):
        after = move(before, step_m, heading_rad, EXACT, KEY)
        for one, place in zip(before.T, after.T, strict=True):
            expected = oracle.moved(*(float(x) for x in one[:4]), step_m, heading_rad)
            assert place[:2] == pytest.approx(expected, abs=2e-4)


def test_going_back_undoes_the_steps_with_their_errors():
    """In complex numbers: each hypothesis turned and scaled the displacement by its own errors."""
    rng = np.random.default_rng(7)
    start = states(40)
    start[BIAS], start[TURN] = rng.uniform(-3, 3, 40), rng.uniform(-1, 1, 40)
    start[LOG_SCALE], start[STRETCH] = rng.normal(0, 0.2, 40), rng.normal(0, 0.2, 40)
    way = 60.0 - 25.0j
    errors = np.exp(start[LOG_SCALE] + start[STRETCH] + 1j * (start[BIAS] + start[TURN]))
    there = start.copy()
    there[EAST] += (way * errors).real
    there[NORTH] += (way * errors).imag
    given = there.copy()
    np.testing.assert_allclose(moved_back(there, way.real, way.imag), start, atol=1e-4)
    np.testing.assert_array_equal(there, given)


# Correlations of 1e5 draws are good to 1/sqrt(1e5); five standard errors are allowed.
COUNT, SPREAD = 100_000, 5 / 100_000**0.5


@pytest.mark.parametrize("step_m", [1.4, 5.0, -3.0])
def test_the_moments_of_a_step_are_those_of_the_oracle(step_m):
    # Nothing but white noise; half of the variance of headings would be that of deviations.
    errors = replace(EXACT, step_sd_m=0.4, heading_sd_rad=0.35, white_share=0.5, heading_m=1e9)
    before = states(COUNT, 0.5, 0.2)
    before[:2] = 100.0
    gone = (move(before, step_m, -1.1, errors, KEY)[:2] - 100.0).astype(np.float64)
    mean, covariance = oracle.step_moments(0.5, 0.2, step_m, -1.1, errors)
    sd = np.sqrt(np.diag(covariance))
    assert np.all(np.abs(gone.mean(axis=1) - mean) < SPREAD * sd)
    # Of a variance the relative standard error is sqrt(2/N).
    np.testing.assert_allclose(
        np.cov(gone), covariance, rtol=0, atol=1.5 * SPREAD * np.outer(sd, sd).max()
    )


def test_bias_and_scale_walk_and_the_step_follows_them():
    errors = replace(EXACT, bias_drift_rad_per_sqrt_m=0.1, scale_drift_per_sqrt_m=0.05)
    before = states(COUNT, 0.3, -0.1)
    after = move(before, 9.0, 0.7, errors, KEY)
    walked = (after[[BIAS, LOG_SCALE]] - before[[BIAS, LOG_SCALE]]).astype(np.float64)
    assert np.all(np.abs(walked.mean(axis=1)) < SPREAD * np.array([0.3, 0.15]))
    # 0.1 and 0.05 per root of a metre over 9 m.
    np.testing.assert_allclose(walked.std(axis=1), [0.3, 0.15], rtol=SPREAD)
    assert abs(np.corrcoef(walked)[0, 1]) < SPREAD
    # The state that is kept is the one that the step was made with.
    for one, start in zip(after.T[:50], before.T[:50], strict=True):
        expected = oracle.moved(
            *(float(x) for x in start[:2]), float(one[BIAS]), float(one[LOG_SCALE]), 9.0, 0.7
        )
        assert one[:2] == pytest.approx(expected, abs=2e-4)


def test_a_bias_that_walks_past_half_a_turn_wraps():
    errors = replace(OU, bias_drift_rad_per_sqrt_m=0.2)
    after = move(states(2000, 3.1), 4.0, 0.0, errors, KEY)
    assert np.abs(after[BIAS]).max() <= pi + 1e-6
    # P(z > (π - 3.1) / 0.4) = 0.459; five standard errors of 2000 draws.
    assert (after[BIAS] < 0).mean() == pytest.approx(0.459, abs=0.056)


OU = replace(
    EXACT, heading_sd_rad=0.3, white_share=0.36, heading_m=20.0, stretch_sd=0.1, stretch_m=35.0
)


def deviating(errors, count=COUNT):
    """Hypotheses whose deviations are those of a start: stationary."""
    state, rng = states(count), np.random.default_rng(12)
    state[TURN] = oracle.deviation_of(errors) * rng.standard_normal(count)
    state[STRETCH] = errors.stretch_sd * rng.standard_normal(count)
    return state


@pytest.mark.parametrize("step_m", [0.7, 1.4, 30.0, -1.4])
def test_deviations_keep_their_variance_and_forget_by_the_metre(step_m):
    before, now = deviating(OU), deviating(OU)
    for number in range(10):
        now = move(now, step_m, 0.3, OU, np.uint64(number))
    gone_m = 10 * abs(step_m)
    for row, sd, length_m in ((TURN, 0.3 * 0.8, 20.0), (STRETCH, 0.1, 35.0)):
        then, here = before[row].astype(float), now[row].astype(float)
        assert abs(here.mean()) < SPREAD * sd
        assert here.std() == pytest.approx(sd, rel=SPREAD)
        assert np.corrcoef(then, here)[0, 1] == pytest.approx(exp(-gone_m / length_m), abs=SPREAD)
    assert abs(np.corrcoef(now[[TURN, STRETCH]].astype(float))[0, 1]) < SPREAD
    # The lasting errors are others: nothing was added to them.
    np.testing.assert_array_equal(now[[BIAS, LOG_SCALE]], before[[BIAS, LOG_SCALE]])


def test_deviations_start_to_grow_from_nothing_as_a_random_walk_does():
    now = states(COUNT)
    for number in range(4):
        now = move(now, 1.5, 0.3, OU, np.uint64(number))
    for row, sd, length_m in ((TURN, 0.3 * 0.8, 20.0), (STRETCH, 0.1, 35.0)):
        expected = sd * sqrt(1 - exp(-2 * 6.0 / length_m))
        assert now[row].std(dtype=float) == pytest.approx(expected, rel=SPREAD)


def test_a_step_goes_by_the_deviations_after_it():
    errors = replace(OU, white_share=0.0)
    after = move(deviating(errors, 60), 9.0, 0.7, errors, KEY)
    before = deviating(errors, 60)
    for one, start in zip(after.T.astype(float), before.T.astype(float), strict=True):
        turned, longer = one[BIAS] + one[TURN], one[LOG_SCALE] + one[STRETCH]
        expected = oracle.moved(*start[:2], turned, longer, 9.0, 0.7)
        assert one[:2] == pytest.approx(expected, abs=3e-4)
    assert np.ptp(after[TURN]) > 0.5


@pytest.mark.parametrize(("white_share", "step_m"), [(0.0, 1.4), (0.4, 1.4), (0.4, 9.0)])
def test_the_mean_displacement_makes_up_for_white_noise_only(white_share, step_m):
    """Deviations shorten the mean of where hypotheses go; what they measured was no shorter."""
    errors = replace(OU, white_share=white_share, step_sd_m=0.2, stretch_sd=0.0)
    before = deviating(errors)
    gone = (move(before, step_m, -1.1, errors, KEY)[:2] - before[:2]).astype(float)
    white_var, lasting_var = white_share * 0.09, (1 - white_share) * 0.09
    mean_m = step_m * exp(white_var / 2) * exp(-lasting_var / 2)
    along = np.array([np.cos(-1.1), np.sin(-1.1)])
    error_m = np.sqrt(np.trace(np.cov(gone)) / COUNT)
    assert np.hypot(*(gone.mean(axis=1) - mean_m * along)) < 5 * error_m


def test_deviations_jump_now_and_then_to_any_value_within_tens_of_degrees():
    errors = replace(OU, disturbances_per_m=0.02, disturbed_rad=0.9, heading_sd_rad=1e-3)
    still = deviating(errors)
    after = move(still, 5.0, 0.0, errors, KEY)
    jumped = np.abs(after[TURN]) > 0.01
    share = 1 - exp(-0.02 * 5.0)
    # Nine in a thousand of the jumps lead to less than 0.01 rad; five standard errors.
    expected = share * (1 - 0.0089)
    assert jumped.mean() == pytest.approx(expected, abs=SPREAD * sqrt(share))
    found = after[TURN, jumped].astype(float)
    assert found.std() == pytest.approx(0.9, rel=SPREAD / sqrt(share))
    assert abs(found.mean()) < 0.9 * SPREAD / sqrt(share)
    # Steps of other lengths add up to the same share, and none leads to none.
    parts = still
    for number in range(10):
        parts = move(parts, 0.5, 0.0, errors, np.uint64(100 + number))
    spread = SPREAD * sqrt(share)
    assert (np.abs(parts[TURN]) > 0.01).mean() == pytest.approx(expected, abs=1.5 * spread)
    calm = move(still, 5.0, 0.0, replace(errors, disturbances_per_m=0.0), KEY)
    assert np.abs(calm[TURN]).max() < 0.01
    # Where to is drawn for itself.
    always = replace(errors, disturbances_per_m=1e9, step_sd_m=1.0, bias_drift_rad_per_sqrt_m=0.1)
    drawn = move(still, 5.0, 0.0, always, KEY)
    new = drawn[STRETCH] - exp(-5.0 / 35.0) * still[STRETCH]
    both = np.array([drawn[TURN], new, drawn[BIAS]], dtype=float)
    assert drawn[TURN].std(dtype=float) == pytest.approx(0.9, rel=SPREAD)
    assert np.abs(np.corrcoef(both) - np.eye(3)).max() < SPREAD
    # The rest of the state is the same with and without jumps.
    np.testing.assert_array_equal(calm[[BIAS, LOG_SCALE, STRETCH]],
                                  after[[BIAS, LOG_SCALE, STRETCH]])  # fmt: skip


def test_the_lasting_scale_becomes_another_one_now_and_then():
    errors = replace(EXACT, rescales_per_m=0.02, rescaled_sd=0.06)
    before = states(COUNT, 0.0, -0.3)
    after = move(before, 5.0, 0.0, errors, KEY)
    anew = after[LOG_SCALE] != np.float32(-0.3)
    share = 1 - exp(-0.02 * 5.0)
    assert anew.mean() == pytest.approx(share, abs=SPREAD * sqrt(share))
    # Around none, not around the one before; the step is as long as it says.
    found = after[LOG_SCALE, anew].astype(float)
    assert found.std() == pytest.approx(0.06, rel=SPREAD / sqrt(share))
    assert abs(found.mean()) < 0.06 * SPREAD / sqrt(share)
    gone_m = (after[EAST] - before[EAST]).astype(float)
    np.testing.assert_allclose(gone_m, 5.0 * np.exp(after[LOG_SCALE]), rtol=1e-4)
    # All else is drawn as without.
    noisy = replace(OU, scale_drift_per_sqrt_m=0.05, disturbances_per_m=0.02)
    calm = move(before, 5.0, 0.0, noisy, KEY)
    often = move(before, 5.0, 0.0, replace(noisy, rescales_per_m=0.02), KEY)
    rest = [BIAS, TURN, STRETCH]
    np.testing.assert_array_equal(calm[rest], often[rest])
    same = calm[LOG_SCALE] == often[LOG_SCALE]
    assert same.mean() == pytest.approx(1 - share, abs=SPREAD * sqrt(share))
    # Jumps of headings are drawn by themselves.
    jumped = np.abs(often[TURN] - exp(-0.25) * before[TURN]) > 1.0
    assert abs(np.corrcoef(jumped, ~same)[0, 1]) < SPREAD


def test_after_a_jump_the_deviation_comes_back_over_the_metres():
    errors = replace(OU, heading_sd_rad=0.0)
    state = states(3)
    state[TURN] = [0.8, -0.8, 0.2]
    for _ in range(6):
        state = move(state, 5.0, 0.0, errors, KEY)
    np.testing.assert_allclose(state[TURN], exp(-30 / 20) * np.array([0.8, -0.8, 0.2]), rtol=1e-5)


def test_the_variance_of_a_heading_is_shared_by_white_noise_and_deviation():
    for white_share in (0.0, 0.3, 1.0):
        errors = MotionErrors(heading_sd_rad=0.2, white_share=white_share)
        assert errors.white_rad == pytest.approx(oracle.white_of(errors), abs=1e-15)
        assert errors.turn_sd_rad == pytest.approx(oracle.deviation_of(errors), abs=1e-15)
        assert np.hypot(errors.white_rad, errors.turn_sd_rad) == pytest.approx(0.2)


def test_further_rows_of_the_state_stay():
    before = np.vstack([deviating(OU, 5), np.arange(10.0, dtype="f4").reshape(2, 5)])
    after = move(before, 3.0, 0.2, OU, KEY)
    np.testing.assert_array_equal(after[8:], before[8:])
    np.testing.assert_array_equal(after[OFF], before[OFF])
    np.testing.assert_array_equal(after[:8], move(before[:8], 3.0, 0.2, OU, KEY))


@pytest.mark.parametrize("step_m", [4.0, -4.0])
def test_the_lasting_error_of_a_biased_gyroscope_grows_by_the_metre(step_m):
    before = states(4, bias_rad=0.2)
    before[RATE] = [0.0, 0.01, -0.02, 0.03]
    now = before
    for _ in range(5):
        now = move(now, step_m, 0.3, EXACT, KEY)
    # Walking backwards takes as long.
    np.testing.assert_allclose(now[BIAS], 0.2 + 20.0 * before[RATE], rtol=1e-5)
    np.testing.assert_array_equal(now[RATE], before[RATE])
    # Each step goes by the error at its end: a polygon.
    for one, start in zip(now.T.astype(float), before.T.astype(float), strict=True):
        angles = 0.3 + 0.2 + start[RATE] * 4.0 * np.arange(1, 6)
        expected = start[:2] + step_m * np.array([np.cos(angles).sum(), np.sin(angles).sum()])
        assert one[:2] == pytest.approx(expected, abs=1e-3)


def test_a_lasting_error_that_grows_past_half_a_turn_wraps():
    before = states(2, bias_rad=3.0)
    before[RATE] = [0.05, -0.05]
    now = move(before, 10.0, 0.0, EXACT, KEY)
    np.testing.assert_allclose(now[BIAS], [3.5 - 2 * pi, 2.5], rtol=1e-5)


def test_the_likelihood_of_the_map_is_that_of_the_oracle():
    distance_m = np.linspace(0.0, 120.0, 41, dtype=np.float32)
    for sd_m in (2.0, 4.0, 8.0):
        expected = [oracle.map_log_likelihood(float(d), sd_m) for d in distance_m]
        np.testing.assert_allclose(map_log_likelihood(distance_m, sd_m), expected, rtol=1e-6)


def test_a_raster_is_read_between_the_middles_of_its_pixels():
    rng = np.random.default_rng(4)
    raster, side_m = rng.normal(0, 5, (5, 7)).astype(np.float32), 8.0
    state = np.zeros((STATES, 300), dtype=np.float32)
    state[EAST], state[NORTH] = rng.uniform(-10, 66, 300), rng.uniform(-10, 50, 300)
    found = interpolate(*state[:2], raster, side_m / 2, 4.5 * side_m, 1 / side_m)
    expected = [oracle.bilinear(raster, float(x), float(y), side_m) for x, y in state[:2].T]
    np.testing.assert_allclose(found, expected, atol=2e-5)


@pytest.mark.parametrize("length_m", [1.4, 30.0, 400.0])
def test_being_off_the_map_is_a_hidden_mode_that_is_summed_out(length_m):
    weights = MapWeights(weight_per_m=0.1, off_cost_per_m=0.05, leave_per_m=4e-3, return_per_m=0.02)
    rng = np.random.default_rng(5)
    log_map = -rng.uniform(0.0, 5.0, 80).astype(np.float32)
    off = np.concatenate([[0.0, 1.0], rng.random(78)]).astype(np.float32)
    after, log_weight = off.copy(), np.full(80, -3.0)
    weigh_by_map(log_map, after, weights.over(length_m), log_weight)
    for i in range(80):
        gained, expected = oracle.map_step(float(log_map[i]), float(off[i]), length_m, weights)
        assert log_weight[i] == pytest.approx(-3.0 + gained, abs=1e-4)
        assert after[i] == pytest.approx(expected, abs=2e-6)


def test_ancestors_with_large_biases_are_reached_by_the_oracle():
    """Headings at half a turn, steps a third too long: signs and wrapping matter."""
    rng = np.random.default_rng(6)
    count, draws, moved_m, variances = 12, 30_000, (-14.0, 9.0), (60.0, 0.6, 0.1)
    earlier = states(count, seed=7)
    earlier[:2] = 200.0 + rng.normal(0, 6, (2, count))
    earlier[BIAS] = (pi + rng.normal(0, 0.5, count) + pi) % (2 * pi) - pi
    earlier[LOG_SCALE] = log(1.3) + rng.normal(0, 0.2, count)
    log_weight = rng.normal(0, 0.7, count).astype(np.float32)
    aim = oracle.moved(200.0, 200.0, pi, log(1.3), *_polar(moved_m))
    later = np.array([*aim, -3.1, log(1.25), 0.0], dtype=np.float32)
    many = np.repeat(later[:, None], draws, axis=1)
    chosen = draw_ancestors(many, earlier, log_weight, moved_m, variances, -12.0, KEY)
    expected = oracle.ancestor_probabilities(later, earlier, log_weight, moved_m, variances, -12.0)
    counted = np.bincount(chosen, minlength=count) / draws
    # Five standard errors.
    assert np.all(np.abs(counted - expected) <= 5 * np.sqrt(expected * (1 - expected) / draws))
    assert expected.max() < 0.5


def _polar(moved_m):
    return float(np.hypot(*moved_m)), float(np.arctan2(moved_m[1], moved_m[0]))
