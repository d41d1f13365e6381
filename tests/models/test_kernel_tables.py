"""Tables and elementary functions of the kernels, entry by entry, and the usual options."""

from dataclasses import asdict, replace
from itertools import product
from math import atan2, erfc, exp, log, pi, radians, sqrt

import numpy as np
import pytest
from scipy.stats import kstest

from mapfilter.models import fingerprint
from mapfilter.models.fingerprint import (
    BoundReading,
    RasterFrame,
    ServingWeights,
    bound_table,
    log_serving,
    serving_table,
)
from mapfilter.models.level_errors import LevelErrors
from mapfilter.models.street_ancestors import _most_likely, _squares, draw_ancestors
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
    remounted,
)
from mapfilter.models.terms import atan2_lanes, log_lanes
from mapfilter.models.way_map import MapWeights


def log_cdf(x):
    return log(0.5 * erfc(-x / sqrt(2)))


def test_the_usual_options():
    assert asdict(ServingWeights()) == {
        "hysteresis_db": 2.0,
        "fault_nats": 0.7,
        "sd_db": 9.0,
        "weight_per_m": 1 / 22,
    }
    assert asdict(LevelErrors()) == {
        "slow_db": 7.0,
        "slow_m": 200.0,
        "fast_db": 4.0,
        "fast_m": 20.0,
        "white_db": 3.3,
        "device_db": 5.0,
        "site_share": 0.6,
        "common_share": 0.2,
        "roughness": 1.0,
        "fault_probability": 0.06,
        "fault_m": 300.0,
        "absent_db": 3.0,
        "weight": 0.35,
        "tracking_share": 0.3,
    }
    assert asdict(MotionErrors()) == {
        "step_sd_m": 0.3,
        "typical_step_m": 1.4,
        "heading_sd_rad": radians(15),
        "white_share": 0.3,
        "heading_m": 28.0,
        "disturbances_per_m": 0.002,
        "disturbed_rad": radians(40),
        "remounts_per_m": 0.0,
        "bias_sd_rad": radians(10),
        "bias_drift_rad_per_sqrt_m": radians(0.3),
        "rate_rad_per_m": radians(0.15),
        "rate_share": 0.5,
        "scale_sd": 0.03,
        "scale_drift_per_sqrt_m": 0.0,
        "rescales_per_m": 0.0,
        "rescaled_sd": 0.06,
        "stretch_sd": 0.08,
        "stretch_m": 25.0,
        "corners_per_m": 0.0,
        "rounds_per_m": 5e-5,
        "bend_rad_per_sqrt_m": 0.03,
    }
    assert asdict(MapWeights()) == {
        "sd_m": 3.0,
        "weight_per_m": 1 / 12,
        "off_cost_per_m": 0.04,
        "leave_per_m": 0.001,
        "return_per_m": 0.01,
    }
    rows = EAST, NORTH, BIAS, LOG_SCALE, OFF, TURN, STRETCH, RATE, STATES
    assert rows == tuple(range(9))


def test_the_table_of_margins_goes_from_minus_64_to_64_db_in_quarters():
    weights = ServingWeights(hysteresis_db=1.0, sd_db=10.0)
    table = serving_table(weights)
    assert (table.shape, table.dtype) == ((513,), np.float32)
    for place, margin_db in ((0, -64.0), (1, -63.75), (256, 0.0), (300, 11.0), (512, 64.0)):
        assert table[place] == pytest.approx(log_cdf((margin_db + 1) / 10), rel=1e-6)
    assert log_serving(3.0, weights) == pytest.approx(log_cdf(0.4), rel=1e-12)


def test_the_table_of_bounds_goes_from_minus_8_to_8_deviations_in_32nds():
    table = bound_table()
    assert (table.shape, table.dtype) == ((513,), np.float32)
    for place, deviations in ((0, -8.0), (1, -8 + 1 / 32), (256, 0.0), (320, 2.0), (512, 8.0)):
        assert table[place] == pytest.approx(log_cdf(deviations), rel=1e-6, abs=1e-15)


def marked():
    """A table that says which of its entries was read; what lies beside it is absurd."""
    whole = np.full(1600, 1e6, dtype=np.float32)
    whole[500:1013] = np.arange(513)
    return whole[500:1013]


MARGINS_DB = (-200.0, -64.2, -64.0, -63.8, -0.25, -0.12, 0.0, 0.12, 0.13, 10.0, 63.7, 64.0, 200.0)
PLACES = (0, 0, 0, 1, 255, 256, 256, 256, 257, 296, 511, 512, 512)


def test_a_margin_is_looked_up_at_the_nearest_quarter():
    level = np.zeros((len(MARGINS_DB), 5), dtype=np.float32)
    level[:, 1] = MARGINS_DB
    level[:, 3], level[:, 4] = np.maximum(MARGINS_DB, 0.0), np.minimum(MARGINS_DB, 0.0)
    # The second best is worth its name where there are three cells: the other two are at 0.
    level[:, 4] = np.where(np.array(MARGINS_DB) > 0, 0.0, level[:, 4])
    found, pixel = np.zeros(len(MARGINS_DB)), np.arange(len(MARGINS_DB), dtype=np.int32)
    sound = np.full(len(MARGINS_DB), -80.0, dtype=np.float32)
    given = fingerprint.ServingBands(5, 1, 3, 4), marked(), 1.0, sound, -0.7
    fingerprint.weigh_by_serving(0, pixel.size, pixel, level.ravel(), *given, found)
    np.testing.assert_array_equal(found, PLACES)


def test_a_bound_is_looked_up_at_the_nearest_thirty_second():
    deviations = np.array([-20.0, -8.1, -8.0, -0.02, -0.01, 0.0, 0.01, 0.02, 1.0, 8.0, 20.0])
    table = np.log1p(np.arange(513, dtype=np.float32))
    places = np.clip(np.round(32 * deviations) + 256, 0, 512)
    for censored, seen in ((-1, deviations), (1, -deviations)):
        level = (-3.0 * seen).astype(np.float32)
        found, pixel = np.zeros(seen.size), np.arange(seen.size, dtype=np.int32)
        bound = BoundReading(np.zeros(1, dtype=np.int32), 0.0, censored, 3.0, 1.0)
        fingerprint.weigh_by_bound(pixel, level, 1, bound, table, found)
        np.testing.assert_allclose(np.exp(found), places + 1, rtol=1e-5)


def test_a_bound_is_weighed_at_its_own_hypotheses_only():
    """Of a block of 256 and 44 more; what lies beside them in memory belongs to others."""
    level, pixel = np.zeros(2, dtype=np.float32), np.zeros(600, dtype=np.int32)
    found, table = np.full(600, 7.0), np.zeros(513, dtype=np.float32)
    bound = BoundReading(np.array([0, 1], dtype=np.int32), 9.0, 0, 3.0, 0.5)
    fingerprint.weigh_by_bound(pixel[:300], level, 2, bound, table, found[:300])
    # Three deviations away, at half the weight.
    np.testing.assert_allclose(found[:300], 7.0 - 0.5 * 4.5, rtol=1e-5)
    np.testing.assert_array_equal(found[300:], 7.0)


def test_corners_of_a_raster_have_their_own_pixels():
    places = np.array(
        [[0.5, 29.5], [49.5, 29.5], [0.5, 0.5], [49.5, 0.5], [-99, 99], [99, -99], [10.5, 19.5]]
    )
    state = np.zeros((5, 7), dtype=np.float32)
    state[:2] = places.T + np.array([[200.0], [-70.0]])
    pixel = fingerprint.pixels(state, RasterFrame(200.0, -40.0, 0.1, 3, 5))
    assert pixel.tolist() == [0, 4, 10, 14, 0, 14, 6]


def test_logarithms_over_all_magnitudes():
    value = np.concatenate(
        [
            np.logspace(-300, 300, 5001),
            np.linspace(0.4, 3.0, 5001),
            [1.0, 2.0, sqrt(0.5), sqrt(2.0)],
            np.nextafter(1.0, [0.0, 2.0]),
        ]
    )
    out, work = np.empty_like(value), np.empty_like(value)
    log_lanes(value, out, work)
    np.testing.assert_allclose(out, [log(x) for x in value], rtol=4e-16, atol=2e-16)


def test_angles_all_around():
    turn = np.concatenate([np.linspace(-pi, pi, 7201), np.arctan2([0.4142, 0.41422], 1.0)])
    left, ahead = 7.0 * np.sin(turn), 7.0 * np.cos(turn)
    out = np.empty_like(turn)
    atan2_lanes(left, ahead, out)
    np.testing.assert_allclose(out, [*map(atan2, left, ahead)], rtol=4e-16, atol=2e-16)
    # Backwards is half a turn to the left; where a direction is none it is 0.
    out = np.empty(5)
    atan2_lanes(np.array([0.0, 0, 0, 2, -2]), np.array([-3.0, 0, 5, 0, 0]), out)
    np.testing.assert_array_equal(out, [pi, 0.0, 0.0, pi / 2, -pi / 2])


STILL = MotionErrors(
    step_sd_m=0.0, heading_sd_rad=0.0, bias_drift_rad_per_sqrt_m=0.0, stretch_sd=0.0,
    disturbances_per_m=0.0,
)  # fmt: skip


def test_no_two_numbers_of_a_step_are_drawn_alike():
    count, key = 4000, np.uint64(77)
    state = np.zeros((STATES, count), dtype=np.float32)

    def moved(**given):
        return move(state, 1.4, 0.0, replace(STILL, typical_step_m=1.4, **given), key)

    along = moved(step_sd_m=1.0)[EAST] - 1.4
    across = moved(heading_sd_rad=1.0, white_share=1.0)[NORTH] / 1.4
    walk = moved(bias_drift_rad_per_sqrt_m=0.5, scale_drift_per_sqrt_m=1.0)
    deviation = moved(heading_sd_rad=1.0, white_share=0.0, heading_m=1e-3, stretch_sd=1.0,
                      stretch_m=1e-3)  # fmt: skip
    jumped = moved(disturbances_per_m=0.3, disturbed_rad=1.0)[TURN] != 0
    drawn = [along, across, walk[BIAS] / (0.5 * sqrt(1.4)), walk[LOG_SCALE] / sqrt(1.4)]
    drawn = np.array([*drawn, deviation[TURN], deviation[STRETCH]])
    np.testing.assert_allclose(drawn.std(axis=1), 1.0, rtol=5 / sqrt(2 * count))
    assert np.unique(np.round(drawn, 5)).size > 0.96 * drawn.size
    # Whether there is a jump is drawn by itself, too.
    drawn = np.vstack([drawn, jumped])
    # Neither beside each other, nor of one hypothesis and another one.
    for shift in range(1, 4):
        both = np.vstack([drawn[:, shift:], drawn[:, :-shift]])
        off = np.corrcoef(both) - np.eye(14)
        assert np.abs(off).max() < 5 / sqrt(count)
    spread = np.vstack([drawn[:, : count // 2], drawn[:, : 2 * (count // 2) : 2]])
    assert np.abs(np.corrcoef(spread) - np.eye(14)).max() < 0.5


def test_a_phone_that_is_turned_points_the_other_way_round_or_anywhere():
    """So many are, by the metre; all others keep their lasting error, and all the rest."""
    count, errors = 40_000, MotionErrors(remounts_per_m=0.3)
    state = np.full((8, count), 0.25, dtype=np.float32)
    after = remounted(state, 1.4, errors, np.random.default_rng(3))
    bias = after[BIAS].astype(float)
    turned = bias != np.float32(0.25)
    # Drawn with replacement: some are turned twice.
    share = 1 - np.exp(-(1 - np.exp(-0.42)))
    assert turned.mean() == pytest.approx(share, abs=5 * np.sqrt(0.25 / count))
    around = np.isclose(bias, 0.25 - np.pi)
    assert around[turned].mean() == pytest.approx(0.5, abs=5 * np.sqrt(0.25 / turned.sum()))
    assert kstest(bias[turned & ~around], "uniform", (-np.pi, 2 * np.pi)).pvalue > 1e-3
    others = np.delete(np.arange(8), BIAS)
    np.testing.assert_array_equal(after[others], state[others])
    never = remounted(state, 1.4, replace(errors, remounts_per_m=0.0), np.random.default_rng(3))
    assert never is state


def test_a_step_of_nothing_changes_nothing():
    state = np.array([[1.0, 2.0, 0.3, 0.1, 0.4, -0.2, 0.05, 0.01, 9.0]], dtype=np.float32).T
    np.testing.assert_array_equal(move(state, 0.0, 1.0, MotionErrors(), np.uint64(1)), state)


def test_squares_cover_places_with_at_most_400_a_side():
    east, north = np.array([3.0, 103.0, 5.0], "f4"), np.array([20.0, 70.0, 30.0], "f4")
    assert _squares(east, north, 10.0)[:3] == ((3.0, 70.0), 10.0, (6, 11))
    assert _squares(east, north, 0.01)[:3] == ((3.0, 70.0), 0.25, (201, 401))
    assert _squares(north, east, 0.01)[:3] == ((20.0, 103.0), 0.25, (401, 201))


def test_places_are_sorted_by_their_square():
    east, north = np.array([25.0, 0.0, 5.0, 30.0, 9.0], "f4"), np.array([0, 20, 11, 20, 1], "f4")
    corner_m, side_m, shape, start, order = _squares(east, north, 10.0)
    assert (corner_m, side_m, shape) == ((0.0, 20.0), 10.0, (3, 4))
    # Square 0 holds two, 3 the one on the eastern edge, 4 and 10 those farther south.
    assert start.tolist() == [0, 2, 2, 2, 3, 4, 4, 4, 4, 4, 4, 5, 5]
    assert order.tolist() == [1, 2, 3, 4, 0]


def test_no_place_in_a_square_is_likelier_than_its_bound():
    bounds = _most_likely(4, -0.2).reshape(9, 9)
    # Two squares are nearest to each other at a corner of both.
    corners = list(product((0, 1), repeat=2))
    for (row, col), bound in np.ndenumerate(bounds):
        apart = [
            (row - 4 + a - c) ** 2 + (col - 4 + b - d) ** 2
            for (a, b), (c, d) in product(corners, corners)
        ]
        assert bound == pytest.approx(exp(-0.2 * min(apart)))


def drawn(later, earlier, log_weight, key=5, log_jump=-6.0):
    variances = (4.0, 0.01, 0.01)
    moved_m = (0.0, 0.0)
    return draw_ancestors(later, earlier, log_weight, moved_m, variances, log_jump, np.uint64(key))


def test_an_ancestor_three_deviations_away_is_seen_in_a_wide_cloud():
    # A cloud of 3 km has squares of 7.5 m, of which the reach of 6.9 m needs one beside.
    earlier = np.zeros((5, 4), dtype=np.float32)
    earlier[0] = [1506.0, 0.0, 2.0, 3000.0]
    for side_m in (-6.0, 6.0):
        later = np.zeros((5, 20_000), dtype=np.float32)
        later[0] = 1506.0 + side_m
        share = (drawn(later, earlier, np.zeros(4, dtype=np.float32)) == 0).mean()
        near, jump = exp(-36 / 8), exp(-6.0)
        # Five standard errors.
        assert share == pytest.approx(near / (near + 3 * jump), abs=0.018)


def test_ancestors_at_one_place_are_told_apart_by_their_weights():
    later, earlier = np.zeros((5, 20_000), dtype=np.float32), np.zeros((5, 3), dtype=np.float32)
    weight = np.log(np.array([0.2, 0.5, 0.3])).astype(np.float32)
    share = np.bincount(drawn(later, earlier, weight), minlength=3) / 20_000
    np.testing.assert_allclose(share, [0.2, 0.5, 0.3], atol=0.018)
    # Far from all of them, too.
    later[0] = 1e5
    share = np.bincount(drawn(later, earlier, weight), minlength=3) / 20_000
    np.testing.assert_allclose(share, [0.2, 0.5, 0.3], atol=0.018)
