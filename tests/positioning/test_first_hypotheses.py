"""First hypotheses on and off the map, and one step over the streets, against the oracle."""

from math import exp, log, pi, sqrt

import numpy as np
import pytest
import scalar_oracle as oracle
from small_area import (
    BANDS,
    COLS,
    DISTANCE_M,
    HEIGHT_M,
    LEVEL_DBM,
    ON_WAY,
    OPTIONS,
    PIXEL_M,
    POINTS,
    ROWS,
    SITE,
    SOUTH_M,
    WEST_M,
    WIDTH_M,
    make_area,
)

from mapfilter.filters.contract import MotionStep
from mapfilter.filters.particle import ParticleFilter, ParticleOptions
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
)
from mapfilter.models.way_map import MapWeights
from mapfilter.positioning.bayes.beliefs.first_hypotheses import Start
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.grid import StreetGrid
from mapfilter.positioning.bayes.sources.radio import RadioSource
from mapfilter.positioning.epochs import Epoch, ReportRow

AREA = make_area()
ERRORS = MotionErrors(
    step_sd_m=1.2, typical_step_m=4.0, heading_sd_rad=0.25, white_share=0.64, heading_m=18.0,
    bias_sd_rad=0.3, bias_drift_rad_per_sqrt_m=0.02, scale_sd=0.1, stretch_sd=0.07, stretch_m=12.0,
    rate_rad_per_m=0.004, rate_share=0.3,
)  # fmt: skip
EXACT = MotionErrors(
    step_sd_m=0.0, heading_sd_rad=0.0, bias_drift_rad_per_sqrt_m=0.0, scale_drift_per_sqrt_m=0.0,
    disturbances_per_m=0.0, stretch_sd=0.0,
)  # fmt: skip
WEIGHTS = MapWeights(
    sd_m=6.0, weight_per_m=0.08, off_cost_per_m=0.06, leave_per_m=4e-3, return_per_m=0.03
)
MODEL = BayesModel(AREA, ERRORS, WEIGHTS, evidence=OPTIONS)
COUNT = 20_000
BAND = BANDS["B"]


def first_reading():
    heard = (
        ReportRow("serving", "B", None, None, -75.0, 0),
        ReportRow("neighbour", "D", None, None, -90, 0),
    )
    return RadioSource(AREA, OPTIONS).first(Epoch(0.0, radio=heard)).radio


def likelihoods():
    """Of the first reading at every pixel."""
    levels = [(BAND, -75.0), (BANDS["D"], -90.0)]
    report = {"serving": BAND, "levels": levels, "absent": [], "bounds": []}
    return np.exp([
        [oracle.report_log_likelihood(LEVEL_DBM, SITE, [((r, c), 0.0)], [report], OPTIONS, (20, 5))
         for c in range(COLS)] for r in range(ROWS)
    ])  # fmt: skip


def started(prior, seed=0, count=COUNT):
    cloud, log_weight = MODEL.start(prior, count, np.random.default_rng(seed))
    return cloud.state.astype(np.float64), log_weight


def pixels(state):
    found = [oracle.pixel_of(east, north, PIXEL_M, ROWS, COLS) for east, north in state[:2].T]
    return np.array(found)


def beyond(state):
    """Whether hypotheses lie outside the area."""
    east, north = state[:2]
    return (east < 0) | (east > WIDTH_M) | (north < 0) | (north > HEIGHT_M)


def test_most_first_hypotheses_lie_on_the_map_by_the_likelihood_of_their_point():
    state, log_weight = started(Start(first_reading()))
    on = state[OFF] == 0.0
    likelihood = likelihoods()[ON_WAY]
    assert on.sum() == 0.65 * COUNT
    total = np.log(np.exp(log_weight[on]).sum())
    assert total == pytest.approx(log(0.98 * 0.95 * likelihood.mean()), abs=1e-4)
    assert np.ptp(log_weight[on]) == 0.0
    row, col = pixels(state[:, on]).T
    copies = np.zeros((ROWS, COLS))
    np.add.at(copies, (row, col), 1.0)
    # Systematic draws of points in order are one copy off at most.
    expected = np.zeros((ROWS, COLS))
    expected[ON_WAY] = on.sum() * likelihood / likelihood.sum()
    assert np.abs(copies - expected).max() <= 1.01
    # Anywhere in the pixel: moments of a uniform number, within five standard errors.
    inside = state[:2, on] / PIXEL_M % 1.0
    assert np.all(np.abs(inside.mean(axis=1) - 0.5) < 5 * sqrt(1 / 12 / on.sum()))
    np.testing.assert_allclose(inside.var(axis=1), 1 / 12, rtol=0.03)


def test_a_fifth_of_the_first_hypotheses_lie_anywhere_off_the_map():
    state, log_weight = started(Start(first_reading()))
    off = state[OFF] == 1.0
    assert off.sum() == 0.2 * COUNT
    assert np.array_equal(off, (state[OFF] != 0.0) & ~beyond(state))
    likelihood, tries = likelihoods(), 2 * off.sum()
    # The mean over the area is estimated by places drawn anywhere: five standard errors.
    found = np.exp(log_weight[off]).sum() / (0.98 * 0.05)
    assert abs(found - likelihood.mean()) < 5 * likelihood.std() / sqrt(tries)
    assert np.ptp(log_weight[off]) == 0.0
    row, col = pixels(state[:, off]).T
    share = np.zeros((ROWS, COLS))
    np.add.at(share, (row, col), 1 / off.sum())
    expected = likelihood / likelihood.sum()
    # Tries fall into a pixel by chance, and each counts by the pixel's likelihood.
    error = expected * sqrt(likelihood.size / tries) + np.sqrt(expected / off.sum()) + 1 / off.sum()
    assert np.all(np.abs(share - expected) < 5 * error)
    assert share[~ON_WAY].sum() > 0.5


def test_the_belief_of_the_filter_keeps_five_in_a_hundred_off_the_map():
    given = ParticleOptions(max_particles=COUNT, min_search_particles=COUNT, min_particles=1000)
    belief = ParticleFilter(MODEL, given).init(Start(None), np.random.default_rng(3))
    assert belief.state.shape == (STATES, COUNT)
    assert float(belief.weight @ belief.state[OFF]) == pytest.approx(0.05, abs=1e-5)


def test_without_a_reading_all_places_are_alike():
    state, log_weight = started(Start(None))
    on = state[OFF] == 0.0
    around = beyond(state)
    off = ~on & ~around
    assert np.exp(log_weight[on]).sum() == pytest.approx(0.98 * 0.95)
    assert np.exp(log_weight[off]).sum() == pytest.approx(0.98 * 0.05)
    assert np.exp(log_weight[around]).sum() == pytest.approx(0.02)
    row, col = pixels(state[:, on]).T
    copies = np.zeros((ROWS, COLS))
    np.add.at(copies, (row, col), 1)
    assert copies[~ON_WAY].sum() == 0
    assert np.abs(copies[ON_WAY] - on.sum() / len(POINTS)).max() <= 1.01
    size = np.array([WIDTH_M, HEIGHT_M])
    for some, side in ((off, size), (around, size + 600.0)):
        mean = state[:2, some].mean(axis=1)
        # Those around the area leave out its small middle: they vary a little more.
        assert np.all(np.abs(mean - size / 2) < 5.5 * side / sqrt(12 * some.sum()))


@pytest.mark.parametrize("known", [False, True])
def test_first_errors_of_heading_and_scale_are_those_of_the_options(known):
    place = (WEST_M + 40.0, SOUTH_M + 30.0, 6.0) if known else ()
    state, _ = started(Start(first_reading(), True, *place))
    # The deviation has 0.36 of the variance of headings.
    for row, sd in ((BIAS, 0.3), (LOG_SCALE, 0.1), (TURN, 0.15), (STRETCH, 0.07)):
        assert abs(state[row].mean()) < 5 * sd / sqrt(COUNT)
        assert state[row].std() == pytest.approx(sd, rel=5 / sqrt(2 * COUNT))
    # Three journeys in ten have a biased gyroscope.
    biased = state[RATE] != 0
    assert abs(biased.mean() - 0.3) < 5 * sqrt(0.21 / COUNT)
    assert state[RATE, biased].std() == pytest.approx(0.004, rel=5 / sqrt(0.6 * COUNT))
    assert abs(state[RATE].mean()) < 5 * 0.004 / sqrt(COUNT)
    rows = state[[BIAS, LOG_SCALE, TURN, STRETCH, RATE]]
    assert np.abs(np.corrcoef(rows) - np.eye(5)).max() < 5 / sqrt(COUNT)
    turned, _ = started(Start(first_reading(), False, *place))
    # Uniform over the circle: no mean direction, and a quarter of it in each quadrant.
    assert abs(np.exp(1j * turned[BIAS]).mean()) < 5 / sqrt(COUNT)
    share = np.histogram(turned[BIAS], bins=4, range=(-pi, pi))[0] / COUNT
    assert np.abs(share - 0.25).max() < 5 * sqrt(0.25 * 0.75 / COUNT)


def test_a_known_start_lies_about_its_place_and_is_weighed_by_the_report():
    prior = Start(first_reading(), True, WEST_M + 45.0, SOUTH_M + 30.0, 6.0)
    state, log_weight = started(prior)
    for row, middle in ((EAST, 45.0), (NORTH, 30.0)):
        assert abs(state[row].mean() - middle) < 5 * 6.0 / sqrt(COUNT)
        assert state[row].std() == pytest.approx(6.0, rel=5 / sqrt(2 * COUNT))
    np.testing.assert_allclose(state[OFF], 0.05, rtol=1e-6)
    table = np.log(likelihoods())
    for i, (row, col) in enumerate(pixels(state[:, :500])):
        assert log_weight[i] + log(COUNT) == pytest.approx(table[row, col], rel=1e-4, abs=1e-4)


def test_a_step_moves_by_the_bias_and_weighs_by_the_map_where_it_ends():
    model, rng, count = BayesModel(AREA, EXACT, WEIGHTS), np.random.default_rng(4), 200
    state = np.zeros((STATES, count), dtype=np.float32)
    state[EAST], state[NORTH] = (
        rng.uniform(5, WIDTH_M - 5, count),
        rng.uniform(5, HEIGHT_M - 5, count),
    )
    state[BIAS], state[LOG_SCALE] = rng.uniform(-3, 3, count), rng.normal(0, 0.2, count)
    state[OFF] = rng.random(count)
    before, given = state.copy(), rng.normal(0, 1, count)
    moved, weighed = model.move(state, given, MotionStep(8.0, 0.6), np.uint64(1))
    np.testing.assert_array_equal(state, before)
    log_map = np.array(
        [[oracle.map_log_likelihood(float(d), 6.0) for d in row] for row in DISTANCE_M]
    )
    for i, one in enumerate(before.T.astype(np.float64)):
        place = oracle.moved(*one[:4], 8.0, 0.6)
        # Beyond the area nobody knows the ways, and a metre costs 0.03.
        inside = 0 <= place[0] <= WIDTH_M and 0 <= place[1] <= HEIGHT_M
        here = oracle.bilinear(log_map, *place, PIXEL_M) if inside else -0.03 / 0.08
        gained, off = oracle.map_step(here, one[4], 8.0, WEIGHTS)
        assert moved[:2, i] == pytest.approx(place, abs=1e-3)
        assert weighed[i] - given[i] == pytest.approx(gained, abs=2e-4)
        assert moved[OFF, i] == pytest.approx(off, abs=1e-4)


def test_a_turn_that_was_not_measured_leaves_headings_open():
    """On the grid by as much as of hypotheses; around the circle, where it is wide."""
    state = np.zeros((STATES, COUNT), dtype=np.float32)
    state[EAST], state[NORTH], state[BIAS] = 45.0, 35.0, 0.4
    for sd_rad in (0.5, 2.0):
        motion = MotionStep(8.0, np.nan, turned_sd_rad=sd_rad)
        moved, _ = MODEL.move(state, np.zeros(COUNT), motion, np.uint64(5))
        assert np.abs(moved[BIAS]).max() <= np.pi + 1e-6
        # Of a normal angle with that deviation about the heading.
        mean = np.exp(1j * moved[BIAS].astype(np.float64)).mean()
        assert abs(mean - np.exp(0.4j - sd_rad**2 / 2)) < 5 / sqrt(COUNT)
    grid = StreetGrid(MODEL, compass=False)
    width_rad = 2 * np.pi / grid.bias_rad.size
    still = grid.transport(0.0, 0.0, 4.0, 32.0)
    way = grid.transport(0.0, 0.0, 4.0, 32.0, 0.5**2)
    assert way.turned_bins == pytest.approx(np.hypot(still.turned_bins, 0.5 / width_rad))


@pytest.mark.parametrize(("step_m", "heading_rad"), [(4.0, 0.0), (4.0, 2.2), (12.0, -1.0)])
def test_the_grid_moves_mass_as_the_oracle_moves_hypotheses(step_m, heading_rad):
    """Over three typical steps the noise adds up; the scale's error is one of the whole way."""
    grid, steps = StreetGrid(MODEL, bin_rad=0.15), step_m / ERRORS.typical_step_m
    way = grid.transport(step_m * np.cos(heading_rad), step_m * np.sin(heading_rad), step_m, 0.0)
    assert grid.bias_rad.tolist() == pytest.approx(list(np.arange(-6, 7) * 0.15))
    for b, bias_rad in enumerate(grid.bias_rad):
        mean, covariance = oracle.step_moments(bias_rad, 0.0, 4.0, heading_rad, ERRORS)
        ahead = mean / np.hypot(*mean)
        # Deviations count as they do over a long way: twice their variance and their length.
        longer = (0.1 * step_m) ** 2 + 2 * 12.0 * step_m * 0.07**2
        turned = 2 * 18.0 * step_m * 0.15**2
        covariance = steps * covariance + longer * np.outer(ahead, ahead)
        covariance = covariance + turned * (np.eye(2) - np.outer(ahead, ahead))
        found = PIXEL_M * way.right_px[b], -PIXEL_M * way.down_px[b]
        assert found == pytest.approx(tuple(steps * mean), abs=1e-6)
        sd_m = PIXEL_M * way.sd_right_px[b], PIXEL_M * way.sd_down_px[b]
        assert sd_m == pytest.approx(tuple(np.sqrt(np.diag(covariance))), rel=1e-6)
    assert way.turned_bins == pytest.approx(0.02 * sqrt(step_m) / 0.15)
    for row, col in ((0, 0), (2, 5), (6, 8)):
        distance_m = float(DISTANCE_M[row, col])
        on = exp(0.08 * step_m * oracle.map_log_likelihood(distance_m, 6.0))
        assert way.on[row, col] == pytest.approx(on, rel=1e-5)
    rates = way.off, way.leave, way.come_back
    expected = exp(-0.06 * step_m), 1 - exp(-4e-3 * step_m), 1 - exp(-0.03 * step_m)
    assert rates == pytest.approx(expected)


@pytest.mark.parametrize("known", [False, True])
def test_first_hypotheses_keep_what_the_first_report_says_of_errors(known):
    """Those drawn by it, and those weighed by it: the mean errors at their own pixel."""
    place = (WEST_M + 40.0, SOUTH_M + 30.0, 12.0) if known else ()
    cloud, _ = MODEL.start(Start(first_reading(), True, *place), 400, np.random.default_rng(7))
    memory, errors = cloud.shared, OPTIONS.levels
    assert cloud.kept.shape == (memory.width, 400)
    white_db2 = errors.white_db**2 + 2 * 25.0 * (1 - exp(-5.0 / 40.0))
    for one, (row, col) in zip(cloud.kept.T, pixels(cloud.state), strict=True):
        here = LEVEL_DBM[row, col]
        heard = [(BAND, 0.0, -75.0 - here[BAND], white_db2),
                 (BANDS["D"], 0.0, -90.0 - here[BANDS["D"]], white_db2)]  # fmt: skip
        for band in range(4):
            # C was in no report; it stands beside D.
            if band not in memory.slot_of:
                continue
            slot = memory.slot_of[band]
            found = one[[slot, memory.slots + slot, 2 * memory.slots]].sum()
            mean, _ = oracle.level_forecast(errors, SITE, heard, band, 0.0)
            assert found == pytest.approx(mean, abs=5e-3)


@pytest.mark.parametrize("known", [False, True])
def test_the_grid_starts_with_the_prior_times_the_likelihood(known):
    place = (WEST_M + 45.0, SOUTH_M + 30.0, 12.0) if known else ()
    on, off = StreetGrid(MODEL, bin_rad=0.15).start(Start(first_reading(), True, *place))
    prior = np.exp(-0.5 * (np.arange(-6, 7) * 0.15 / 0.3) ** 2)[:, None, None]
    everywhere = np.full((ROWS, COLS), 1 / (ROWS * COLS))
    where, here = ON_WAY / ON_WAY.sum(), likelihoods()
    if known:
        col, row = np.meshgrid(np.arange(COLS), np.arange(ROWS))
        apart = (10.0 * (col + 0.5) - 45.0) ** 2 + (10.0 * (ROWS - row - 0.5) - 30.0) ** 2
        where, here = everywhere, here * np.exp(-apart / (2 * 12.0**2))
    expected = np.stack([0.95 * prior * where * here, 0.05 * prior * everywhere * here])
    np.testing.assert_allclose(np.stack([on, off]), expected / expected.sum(), rtol=1e-3, atol=1e-9)
