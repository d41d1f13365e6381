"""Particle filter and smoother against sums over all paths of problems that are small enough."""

from dataclasses import dataclass

import numpy as np
import pytest
import scalar_oracle as oracle

from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.hypotheses import Bins, flattened
from mapfilter.filters.kalman import smooth
from mapfilter.filters.particle import ParticleFilter, ParticleOptions

PRIOR = np.array([0.5, 0.3, 0.2])
CHANGE = np.array([[0.7, 0.2, 0.1], [0.1, 0.6, 0.3], [0.25, 0.05, 0.7]])
STAY = np.eye(3)
MAP = np.array([0.9, 0.4, 0.6])
"""What a step costs at its end, as the map does."""
LIKELIHOOD = {"a": np.array([0.8, 0.3, 0.1]), "b": np.array([0.05, 0.5, 0.6])}
READINGS = "abbaab"
EAST_M = np.array([100.0, 400.0, 700.0])
STEP = MotionStep(10.0, 0.0)


@dataclass(frozen=True)
class Chain:
    """Three places 300 m apart, between which hypotheses jump."""

    change: np.ndarray
    believable: bool = False

    @property
    def bins(self):
        return Bins.over((0.0, 0.0, 800.0, 100.0))

    def start(self, prior, most, rng):  # noqa: ARG002
        # In blocks: systematic draws of places in turns would not be independent of the place.
        place = 3 * np.arange(most) // most
        state = np.stack([EAST_M[place], np.full(most, 50.0)]).astype(np.float32)
        return Cloud(state, np.empty((0, most), "f4")), np.log(prior[place])

    def move(self, state, log_weight, motion, key):  # noqa: ARG002
        chance = np.random.default_rng(int(key)).random(state.shape[1])
        upto = np.cumsum(self.change, axis=1)[self.place(state)]
        place = np.minimum((chance[:, None] > upto).sum(axis=1), 2)
        moved = np.stack([EAST_M[place], state[1]]).astype(np.float32)
        return moved, log_weight + np.log(MAP[place])

    def weigh(self, cloud, log_weight, reading):
        if reading not in LIKELIHOOD:
            return cloud, Reason.NO_READING
        log_weight += np.log(LIKELIHOOD[reading][self.place(cloud.state)])
        return cloud, Reason.USED

    def can_converge(self, summary, reading):  # noqa: ARG002
        return self.believable

    @staticmethod
    def place(state):
        return ((state[0] - 100.0) / 300.0).round().astype(int)


def exact(change, readings=READINGS):
    return [(change, MAP * LIKELIHOOD[reading]) for reading in readings]


def options(count, **given):
    still = {"jitter": (0.0, 0.0), "searching_jitter": (0.0, 0.0)}
    return ParticleOptions(
        max_particles=count, min_search_particles=count, min_particles=count, **still, **given
    )


def shares(belief):
    """Mass at each place."""
    return np.bincount(Chain.place(belief.state), weights=belief.weight, minlength=3)


def test_the_recursion_is_the_sum_over_all_paths():
    for change in (CHANGE, STAY):
        _, log_evidence = oracle.forward(PRIOR, exact(change))
        assert log_evidence == pytest.approx(oracle.path_sum(PRIOR, exact(change)), rel=1e-12)


def test_the_log_evidence_adds_up_what_every_reading_had():
    """Nothing is drawn: all three places are followed to the end."""
    filter_, rng = ParticleFilter(Chain(STAY), options(300, resample_below=1e-6)), rng_of(0)
    belief = filter_.init(PRIOR, rng)
    for k, reading in enumerate(READINGS, start=1):
        belief, _ = filter_.predict(belief, STEP, rng)
        belief, _ = filter_.update(belief, reading, rng)
        beliefs, log_evidence = oracle.forward(PRIOR, exact(STAY, READINGS[:k]))
        assert belief.log_evidence == pytest.approx(log_evidence, abs=1e-5)
        np.testing.assert_allclose(shares(belief), beliefs[-1], atol=1e-5)
    assert belief.travelled_m == 60.0


def rng_of(seed):
    return np.random.default_rng(seed)


@pytest.mark.parametrize(("mass_exponent", "believable"), [(1.0, False), (0.5, False), (0.5, True)])
def test_log_evidence_and_belief_are_those_of_the_sum_on_average(mass_exponent, believable):
    """The mean over runs lies within four standard errors of it, known from the runs."""
    steps, runs, count = exact(CHANGE), 60, 1500
    beliefs, log_evidence = oracle.forward(PRIOR, steps)
    model = Chain(CHANGE, believable)
    given = options(
        count,
        mass_exponent=mass_exponent,
        resample_below=0.9,
        switch_mass=0.3,
        switch_hold_m=15.0,
        split_mass=0.0,
    )
    filter_, ratio, found = ParticleFilter(model, given), [], []
    for seed in range(runs):
        rng = rng_of(seed)
        belief = filter_.init(PRIOR, rng)
        for reading in READINGS:
            belief, _ = filter_.predict(belief, STEP, rng)
            belief, _ = filter_.update(belief, reading, rng)
        ratio.append(np.exp(belief.log_evidence - log_evidence))
        found.append(shares(belief))
    assert belief.status is (Status.TRACKING if believable else Status.SEARCHING)
    for sample, expected in ((np.array(ratio), 1.0), (np.array(found), beliefs[-1])):
        error = sample.std(axis=0) / runs**0.5
        assert np.all(np.abs(sample.mean(axis=0) - expected) < 4 * error)
    # So the intervals are narrow enough to tell.
    assert np.std(ratio) / runs**0.5 < 0.01


def test_motion_and_readings_of_nothing_leave_the_log_evidence():
    filter_, rng = ParticleFilter(Chain(STAY), options(30)), rng_of(0)
    belief = filter_.init(PRIOR, rng)
    assert belief.log_evidence == 0.0
    weighed, _ = filter_.update(belief, "a", rng)
    assert weighed.log_evidence == pytest.approx(np.log(PRIOR @ LIKELIHOOD["a"]), abs=1e-6)
    moved, _ = filter_.predict(weighed, STEP, rng)
    assert moved.log_evidence == weighed.log_evidence
    back, _ = filter_.predict(moved, MotionStep(-4.0, 0.0), rng)
    assert back.travelled_m == 14.0
    same, info = filter_.update(weighed, "nothing", rng)
    assert same is weighed
    assert info.reason is Reason.NO_READING


def test_resampling_by_flattened_weights_keeps_the_mass_of_places():
    """More copies where little mass is, and each of them with less of it."""
    model, count = Chain(STAY), 3000
    filter_ = ParticleFilter(model, options(count, mass_exponent=0.5, resample_below=0.999))
    prior, rng = np.array([0.9, 0.0999, 0.0001]), rng_of(1)
    before = filter_.init(prior, rng)
    after, _ = filter_.update(before, "a", rng)
    expected = prior * LIKELIHOOD["a"] / (prior @ LIKELIHOOD["a"])
    # A systematic draw is one copy off at most.
    copies = np.bincount(model.place(after.state), minlength=3)
    root = np.sqrt(expected) / np.sqrt(expected).sum()
    assert np.abs(copies - count * root).max() <= 1.0
    np.testing.assert_allclose(shares(after), expected, rtol=0.1)


def test_flattened_weights_are_roots_of_the_mass_of_bins():
    state = np.array([[10.0, 12.0, 60.0, 61.0, 130.0], [5.0] * 5], dtype=np.float32)
    weight = np.array([0.5, 0.14, 0.2, 0.05, 0.11], dtype=np.float32)
    bins = Bins.over((0.0, 0.0, 200.0, 25.0))
    mass = np.array([0.64, 0.64, 0.25, 0.25, 0.11])
    for power in (0.5, 0.25):
        expected = mass**power * weight / mass
        found = flattened(state, weight, bins, power)
        np.testing.assert_allclose(found, expected / expected.sum(), rtol=1e-5)


def linear_problem(seed, count=6):
    """Transitions, processes and readings of a state of two numbers, each step another."""
    rng = rng_of(seed)
    transitions = np.eye(2) + 0.4 * rng.standard_normal((count - 1, 2, 2))
    roots = rng.standard_normal((count - 1, 2, 2))
    processes = roots @ np.swapaxes(roots, 1, 2) + 0.3 * np.eye(2)
    return transitions, processes, rng.normal(0, 3, (count, 2))


def test_smoothing_is_conditioning_all_states_on_all_readings():
    transitions, processes, _ = linear_problem(3)
    mean, covariance, noise = np.array([1.0, -2.0]), np.diag([4.0, 9.0]), np.diag([2.0, 0.5])
    trials = [linear_problem(seed)[2] for seed in (3, 4)]
    filtered, expected = [], []
    for readings in trials:
        last = [
            oracle.joint_gaussian(
                mean, covariance, transitions, processes, readings[: k + 1], noise
            )
            for k in range(len(readings))
        ]
        filtered.append([(means[-1], spreads[-1]) for means, spreads in last])
        expected.append(last[-1])
    means = np.array([[one for one, _ in track] for track in filtered])
    covariances = np.array([[one for _, one in track] for track in filtered])
    found = smooth(transitions, processes, means, covariances)
    np.testing.assert_allclose(found.means, [one for one, _ in expected], rtol=1e-9)
    np.testing.assert_allclose(found.covariances, [one for _, one in expected], rtol=1e-9)
    constant = smooth(transitions[0], processes[0], means[:, :2], covariances[:, :2])
    np.testing.assert_array_equal(
        constant.means,
        smooth(transitions[:1], processes[:1], means[:, :2], covariances[:, :2]).means,
    )
