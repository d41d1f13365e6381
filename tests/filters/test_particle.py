"""The particle filter against a Kalman filter, where both are exact."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from mapfilter.errors import ConfigError
from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleFilter, ParticleOptions

PRIOR_SD, STEP_SD, FIX_SD = 20.0, 3.0, 8.0
PLAIN = ParticleOptions(
    max_particles=60_000,
    min_search_particles=60_000,
    min_particles=60_000,
    mass_exponent=1.0,
    jitter=(0.0, 0.0),
    searching_jitter=(0.0, 0.0),
    switch_hold_m=5.0,
)


@dataclass(frozen=True)
class LinearModel:
    """Normal prior, normal steps, normal fixes."""

    believable: bool = True

    @property
    def bins(self):
        return Bins.over((0.0, 0.0, 1000.0, 1000.0))

    def start(self, prior, most, rng):
        place = np.array(prior)[:, None] + PRIOR_SD * rng.standard_normal((2, most))
        cloud = Cloud(place.astype(np.float32), np.empty((0, most), "f4"))
        return cloud, np.full(most, -np.log(most))

    def move(self, state, log_weight, motion, key):
        noise = STEP_SD * np.random.default_rng(int(key)).standard_normal(state.shape)
        way = np.array([[np.cos(motion.heading_rad)], [np.sin(motion.heading_rad)]])
        return (state + motion.step_m * way + noise).astype(np.float32), log_weight

    def weigh(self, cloud, log_weight, reading):
        if reading is None:
            return cloud, Reason.NO_READING
        off = cloud.state - np.array(reading)[:, None]
        log_weight -= 0.5 * (off**2).sum(axis=0) / FIX_SD**2
        return cloud, Reason.USED

    def can_converge(self, summary, reading):  # noqa: ARG002
        return self.believable and np.isfinite(summary.mean).all()


def walk(count=12, seed=4):
    rng = np.random.default_rng(seed)
    headings = rng.uniform(-np.pi, np.pi, count)
    place, fixes = np.array([500.0, 500.0]), []
    for heading in headings:
        place = place + 10 * np.array([np.cos(heading), np.sin(heading)])
        fixes.append(tuple(place + FIX_SD * rng.standard_normal(2)))
    return [MotionStep(10.0, h) for h in headings], fixes


def kalman(motions, fixes, mean):
    """Mean and variance by hand: both axes are alike."""
    variance = PRIOR_SD**2
    for motion, fix in zip(motions, fixes, strict=True):
        way = np.array([np.cos(motion.heading_rad), np.sin(motion.heading_rad)])
        mean, variance = mean + motion.step_m * way, variance + STEP_SD**2
        gain = variance / (variance + FIX_SD**2)
        mean, variance = mean + gain * (np.array(fix) - mean), (1 - gain) * variance
        yield mean, variance


@pytest.mark.parametrize("mass_exponent", [1.0, 0.5])
def test_a_linear_case_agrees_with_the_kalman_filter(mass_exponent):
    motions, fixes = walk()
    filter_ = ParticleFilter(LinearModel(), replace(PLAIN, mass_exponent=mass_exponent))
    rng = np.random.default_rng(0)
    start = np.array([490.0, 515.0])
    belief = filter_.init(tuple(start), rng)
    exact = kalman(motions, fixes, start)
    for motion, fix, (mean, variance) in zip(motions, fixes, exact, strict=True):
        belief, _ = filter_.predict(belief, motion, rng)
        belief, info = filter_.update(belief, fix, rng)
        said = filter_.locate(belief)
        # About five standard errors at an effective 20 000 particles.
        assert np.hypot(said.east_m - mean[0], said.north_m - mean[1]) < 0.3
        np.testing.assert_allclose(np.diag(said.covariance_m2), variance, rtol=0.06)
        assert info.reason is Reason.USED


def test_the_number_follows_the_belief_and_the_switch_rule():
    options = replace(
        PLAIN,
        max_particles=8000,
        min_search_particles=4000,
        min_particles=200,
        particles_per_bin=60.0,
    )
    filter_, rng = ParticleFilter(LinearModel(), options), np.random.default_rng(1)
    belief = filter_.init((500.0, 500.0), rng)
    statuses, motions, fixes = [], *walk()
    for motion, fix in zip(motions, fixes, strict=True):
        belief, _ = filter_.predict(belief, motion, rng)
        belief, info = filter_.update(belief, fix, rng)
        statuses.append(info.status)
    assert statuses[0] is Status.SEARCHING
    assert statuses.count(Status.CONVERGED) == 1
    assert statuses[-1] is Status.TRACKING
    assert 200 <= belief.log_weight.size < 2000


def test_a_belief_that_is_not_credible_never_converges():
    filter_ = ParticleFilter(LinearModel(believable=False), PLAIN)
    rng = np.random.default_rng(1)
    belief = filter_.init((500.0, 500.0), rng)
    for motion, fix in zip(*walk(), strict=True):
        belief, _ = filter_.predict(belief, motion, rng)
        belief, info = filter_.update(belief, fix, rng)
        assert info.status is Status.SEARCHING


def test_options_are_checked_together():
    with pytest.raises(ConfigError) as told:
        ParticleOptions(
            max_particles=10,
            min_particles=20,
            mass_exponent=0.0,
            switch_mass=1.5,
            particles_per_bin=-1.0,
        )
    assert len(told.value.faults) == 4
