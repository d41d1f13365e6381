"""The Rao-Blackwellised particle filter against Kalman filters and brute force."""

import numpy as np
import pytest
from fusion_world import MOVING_CLOCK_3D, log_likelihood

from mapfilter.errors import ConfigError, InputError
from mapfilter.filters import kalman
from mapfilter.filters import rao_blackwell as rb
from mapfilter.filters.gaussian import EKF, Gaussian
from mapfilter.filters.rao_blackwell import REGULARISED, SIR, SirOptions
from mapfilter.models.gaussian import stack
from mapfilter.models.motion import clock_motion, constant_velocity, random_walk, together
from mapfilter.models.ranging import position_fix, pseudoranges, range_differences
from mapfilter.models.signal_strength import levels
from mapfilter.models.state import MOVING_CLOCK, POSITION_CLOCK_3D, StateLayout
from mapfilter.positioning.kalman.models import compiled

AWAY = np.array(
    [[0.6, 0.0, 0.8], [-0.5, 0.6, 0.62], [0.1, -0.8, 0.59], [0.3, 0.4, 0.87], [-0.7, -0.3, 0.65]]
)
AWAY /= np.linalg.norm(AWAY, axis=1)[:, None]


class Linear:
    """Pseudoranges whose unit vectors do not turn: the exact linear case for both filters."""

    def __init__(self, layout, sigma=4.0):
        self.layout = layout
        self.model = pseudoranges(layout, AWAY * 2.2e7, sigma)
        self.compiled = compiled(self.model)


def apart(ours, exact):
    """Differences of mean and covariance, in units of the exact deviations."""
    scale = np.sqrt(np.diagonal(exact.covariance))
    covariance = (ours.covariance - exact.covariance) / np.outer(scale, scale)
    return (ours.mean - exact.mean) / scale, covariance


def agree(ours, exact, tolerance):
    """In units of the exact deviations."""
    mean, covariance = apart(ours, exact)
    assert np.abs(mean).max() < tolerance
    assert np.abs(covariance).max() < 2 * tolerance


@pytest.mark.parametrize("options", [SIR, REGULARISED, SirOptions(0.5)], ids=str)
def test_as_a_kalman_filter_where_all_is_linear(options):
    """Positions within a few hundred metres: satellites' ranges are linear there to 2 mm.

    A single run is off by 0.05 deviations in each coordinate (root mean square of twelve seeds), by
    chance alone; the mean of eight by 0.02, of which 0.06 are three.
    """
    runs = [linear_run(options, seed) for seed in range(1, 9)]
    found = [apart(ours, exact) for ours, exact, _ in runs]
    means, covariances = (np.array(values) for values in zip(*found, strict=True))
    assert np.abs(np.mean([gained for *_, gained in runs], axis=0)).max() < 0.1
    assert np.abs(means.mean(axis=0)).max() < 0.06
    assert np.abs(covariances.mean(axis=0)).max() < 0.12
    assert np.sqrt((means**2).mean()) < 0.08


def linear_run(options, seed):
    """The filter's moments after eight readings, the exact ones, and differences of evidence."""
    layout, rng = POSITION_CLOCK_3D, np.random.default_rng(seed)
    motion = together([random_walk(1.0, 6.0, dimensions=3), random_walk(1.0, 2.0, dimensions=1)])
    case = Linear(layout)
    mean, covariance = np.array([10.0, -20.0, 5.0, 80.0]), np.diag([400.0, 400.0, 400.0, 1e4])
    truth = mean + rng.standard_normal(4) * [20, 20, 20, 100]
    exact, gained = Gaussian(mean, covariance), []
    ours = rb.init(mean, covariance, [0, 1, 2], 100_000, rng)
    for _ in range(8):
        truth = motion.sample(truth, rng)
        reading = case.model.sample(truth, rng)
        exact = kalman.predict(exact, motion.transition, motion.noise)
        exact, told = kalman.update(exact, case.compiled, reading, EKF)
        ours = rb.predict(ours, motion.transition, motion.noise, rng)
        ours, news = rb.update(ours, case.compiled, reading, rng, options)
        gained.append(news.evidence - told.evidence)
    return ours.moments(), exact, gained


@pytest.mark.parametrize("noise", ["piecewise", "continuous"])
def test_velocity_clock_and_drift_without_particles_are_exact_too(noise):
    layout, rng = MOVING_CLOCK_3D, np.random.default_rng(2)
    motion = together([constant_velocity(1.0, 3.0, 3, noise), clock_motion(1.0)])
    case = Linear(layout, 15.0)
    mean = np.array([0.0, 10.0, 0.0, -5.0, 0.0, 0.0, 50.0, 1.0])
    covariance = np.diag([100.0, 9.0, 100.0, 9.0, 100.0, 9.0, 1e4, 1.0])
    truth = mean + rng.standard_normal(8) * np.sqrt(np.diagonal(covariance))
    exact = Gaussian(mean, covariance)
    ours = rb.init(mean, covariance, [0, 2, 4], 200_000, rng)
    for step in range(8):
        truth = motion.sample(truth, rng)
        reading = case.model.sample(truth, rng)
        if step == 4:
            reading[:] = np.nan
        if step == 5:
            reading[[0, 3]] = np.nan
        exact = kalman.predict(exact, motion.transition, motion.noise)
        exact, _ = kalman.update(exact, case.compiled, reading, EKF)
        ours = rb.predict(ours, motion.transition, motion.noise, rng)
        ours, _ = rb.update(ours, case.compiled, reading, rng)
    agree(ours.moments(), exact, 0.08)


def test_the_moved_belief_is_the_exact_one():
    """Without readings nothing but sampling noise parts it from the Kalman filter."""
    rng = np.random.default_rng(3)
    motion = together([constant_velocity(2.0, 1.0, 2), clock_motion(2.0, cross_term="textbook")])
    root = rng.standard_normal((6, 6))
    exact = Gaussian(np.arange(6.0), root @ root.T)
    ours = rb.init(exact.mean, exact.covariance, [0, 2], 200_000, rng)
    agree(ours.moments(), exact, 0.02)
    for _ in range(3):
        exact = kalman.predict(exact, motion.transition, motion.noise)
        ours = rb.predict(ours, motion.transition, motion.noise, rng)
    agree(ours.moments(), exact, 0.02)
    assert not ours.covariance[[0, 2]].any()


def test_levels_and_one_satellite_against_a_grid():
    """Every place on a fine grid, the clock integrated out by hand."""
    layout = StateLayout(3, 0, 1, clock=2)
    sites = [[0.0, 0.0, 30.0], [900.0, 100.0, 30.0], [300.0, 800.0, 30.0]]
    heard = levels(layout, sites, 6.0, loss_at_km_db=120.0, exponent=3.5, eirp_dbm=50.0)
    seen = pseudoranges(layout, AWAY[:2] * 2.2e7, 10.0)
    apart = range_differences(layout, sites, [30.0, 40.0, 50.0])
    both = stack([seen, heard, apart])
    truth = np.array([420.0, 260.0, 35.0])
    reading = both.sample(truth, np.random.default_rng(4))
    mean, covariance = np.array([300.0, 300.0, 0.0]), np.diag([200.0**2, 150.0**2, 50.0**2])
    axis_e, axis_n = np.arange(-600.0, 1200.0, 15.0), np.arange(-450.0, 1050.0, 15.0)
    east, north = np.meshgrid(axis_e, axis_n, indexing="ij")
    bias = np.linspace(-250.0, 250.0, 76)
    log_density = np.full((*east.shape, bias.size), -np.inf)
    for k, value in enumerate(bias):
        state = np.stack([east, north, np.full(east.shape, value)], axis=-1)
        prior = -0.5 * np.sum((state - mean) ** 2 / np.diagonal(covariance), axis=-1)
        log_density[..., k] = prior + log_likelihood(both, state, reading)
    density = np.exp(log_density - log_density.max())
    density /= density.sum()
    told = np.array(
        [
            (density.sum(axis=2) * east).sum(),
            (density.sum(axis=2) * north).sum(),
            (density.sum(axis=(0, 1)) * bias).sum(),
        ]
    )
    rng = np.random.default_rng(5)
    belief = rb.init(mean, covariance, [0, 1], 200_000, rng)
    after, news = rb.update(belief, compiled(both), reading, rng, SirOptions(0.0))
    found = after.moments()
    deviation = np.sqrt(np.diagonal(found.covariance))
    assert np.abs((found.mean - told) / deviation).max() < 0.05
    total = log_density.max() + np.log(np.exp(log_density - log_density.max()).sum())
    cell = 15.0 * 15.0 * (bias[1] - bias[0])
    volume = np.log(cell) - 0.5 * np.linalg.slogdet(2 * np.pi * covariance)[1]
    assert news.evidence == pytest.approx(total + volume, abs=0.05)


def test_more_that_adds_to_a_reading_is_estimated():
    """A level with an unknown offset: as a Kalman filter with the offset in its state."""
    layout, rng = StateLayout(4, 0, 1, clock=3), np.random.default_rng(6)
    fix = position_fix(layout, np.diag([4.0, 9.0]))
    loading = np.array([[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, -2.0, 1.0]])
    covariance = np.diag([25.0, 25.0, 16.0, 1.0])
    belief = rb.init(np.zeros(4), covariance, [0, 1], 300_000, rng)
    reading = np.array([7.0, -2.0])
    after, _ = rb.update(belief, compiled(fix), reading, rng, SirOptions(0.0), loading)
    slope = np.eye(2, 4) + loading
    spread = slope @ covariance @ slope.T + fix.covariance()
    gain = covariance @ slope.T @ np.linalg.inv(spread)
    agree(after.moments(), Gaussian(gain @ reading, covariance - gain @ slope @ covariance), 0.03)


def test_equal_keys_give_equal_particles_and_nothing_is_changed_in_place():
    case = Linear(POSITION_CLOCK_3D)
    reading = case.model.mean([5.0, 5.0, 5.0, 5.0])
    first = rb.init(np.zeros(4), np.eye(4) * 100, [0, 1, 2], 1000, np.random.default_rng(1))
    before = first.state.copy(), first.log_weight.copy(), first.covariance.copy()
    found = []
    for _ in range(2):
        rng = np.random.default_rng(7)
        moved = rb.predict(first, np.eye(4), np.eye(4), rng)
        found.append(rb.update(moved, case.compiled, reading, rng)[0])
    np.testing.assert_array_equal(found[0].state, found[1].state)
    for value, own in zip(before, (first.state, first.log_weight, first.covariance), strict=True):
        np.testing.assert_array_equal(value, own)


def test_an_empty_reading_changes_nothing_and_a_mad_one_is_told():
    case, rng = Linear(POSITION_CLOCK_3D), np.random.default_rng(8)
    belief = rb.init(np.zeros(4), np.eye(4), [0, 1, 2], 500, rng)
    after, news = rb.update(belief, case.compiled, np.full(5, np.nan), rng)
    assert after is belief
    assert news.evidence == 0
    after, news = rb.update(belief, case.compiled, np.arange(5) * 1e200, rng)
    assert after is belief
    assert not news.used


def test_regularising_keeps_the_spread():
    """The kernel widens a belief by its square only."""
    case, rng = Linear(POSITION_CLOCK_3D), np.random.default_rng(9)
    belief = rb.init(np.zeros(4), np.eye(4) * 100, [0, 1, 2], 20_000, rng)
    reading = case.model.mean(np.zeros(4))
    parted, _ = rb.update(belief, case.compiled, reading, rng, SirOptions(1.0, 0.5))
    copied, _ = rb.update(belief, case.compiled, reading, rng, SIR)
    assert np.unique(parted.state[0]).size == 20_000
    assert np.unique(copied.state[0]).size < 16_000
    ratio = np.diagonal(parted.moments().covariance) / np.diagonal(copied.moments().covariance)
    np.testing.assert_allclose(ratio, 1.0, atol=0.06)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda rng: rb.init(np.zeros(4), np.eye(4), [4], 10, rng), "sampled"),
        (lambda rng: rb.init(np.zeros(4), np.eye(4), [], 10, rng), "sampled"),
        (lambda rng: rb.init(np.zeros(4), np.eye(4), [0], 1, rng), "particles"),
        (lambda rng: rb.init(np.zeros(4), -np.eye(4), [0], 10, rng), "covariance"),
        (lambda rng: rb.predict(START, np.eye(3), np.eye(4), rng), "motion"),
        (lambda rng: rb.update(START, LINEAR, np.zeros(3), rng), "reading"),
        (lambda rng: rb.update(START, LINEAR, np.full(5, np.inf), rng), "infinity"),
        (lambda rng: rb.update(START, LINEAR, [1.0, -np.inf, 0.0, np.nan, 2.0], rng), "infinity"),
        (lambda rng: rb.update(PART, LINEAR, np.zeros(5), rng), "sampled"),
        (lambda rng: rb.update(START, LINEAR, np.zeros(5), rng, SIR, np.zeros((2, 2))), "loading"),
        (
            lambda rng: rb.update(
                START, compiled(pseudoranges(MOVING_CLOCK, AWAY, 1.0)), np.zeros(5), rng
            ),
            "a state of 4",
        ),
    ],
)
def test_what_does_not_fit_is_told(call, told):
    with pytest.raises(InputError, match=told):
        call(np.random.default_rng(1))


def test_options_out_of_range_are_refused():
    with pytest.raises(ConfigError, match="resample_below"):
        SirOptions(2.0)
    with pytest.raises(ConfigError, match="regularise"):
        SirOptions(1.0, np.nan)


LINEAR = Linear(POSITION_CLOCK_3D).compiled
START = rb.init(np.zeros(4), np.eye(4), [0, 1, 2], 10, np.random.default_rng(1))
PART = rb.init(np.zeros(4), np.eye(4), [0, 1], 10, np.random.default_rng(1))
