"""Protection levels of replays: on the crossing of streets, of Kalman-type filters, live."""

import dataclasses

import numpy as np
import pytest
from cross_world import walk_log

from mapfilter.errors import ConfigError
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.integrity import sample_tail
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.place import belief_tail
from mapfilter.positioning.loop import locate
from mapfilter.positioning.merging import epochs
from mapfilter.positioning.step_output import Fix, StepOutput

FEW = BayesFilter(max_particles=4000, min_search_particles=2000, min_particles=500)


@pytest.fixture(scope="module")
def log():
    return walk_log()


def found(log, database, options=FEW, **more) -> TrackEstimate:
    return locate(log, options.over(database), np.random.default_rng(1), **more).estimate


def test_levels_are_beyond_the_radii_and_change_nothing_else(log, database):
    usual, rare = found(log, database), found(log, database, risk=1e-5)
    known = np.isfinite(usual.radii_m[:, 2])
    assert known.any()
    assert (usual.radius_99_m[known] >= usual.radii_m[known, 2]).all()
    assert (usual.protection_m[known] >= usual.radius_99_m[known] - 1e-6).all()
    assert (rare.protection_m[known] >= usual.protection_m[known]).all()
    # There is none while the null hypothesis is more probable than the risk.
    finite = np.isfinite(rare.protection_m)
    assert finite.any()
    assert (rare.protection_m[finite] > usual.protection_m[finite]).all()
    assert np.isnan(usual.protection_m[~known]).all()
    for name in ("east_m", "north_m", "radii_m", "radius_99_m", "mass_50m"):
        assert np.array_equal(getattr(usual, name), getattr(rare, name), equal_nan=True), name


def test_live_steps_give_the_levels_of_a_replay_and_of_any_risk(log, database):
    filter_, rng = FEW.over(database), np.random.default_rng(1)
    filter_.warm_up(epochs(log))
    state, outputs = filter_.begin(), []
    for epoch in epochs(log):
        state, output = filter_.step(state, epoch, rng)
        outputs.append(output)
    replayed, rare = found(log, database), found(log, database, risk=1e-6)
    levels = [output.fix.protection_m for output in outputs]
    assert np.array_equal(levels, replayed.protection_m, equal_nan=True)
    tails = [output.tail for output in outputs]
    assert tails[-1] is not None
    assert tails[-1].protection_m(1e-6) == rare.protection_m[-1]


def test_the_level_is_that_of_the_filters_hypotheses(log, database):
    """By the contract's hypotheses, in the CRS of the database, at the last epoch."""
    filter_, rng = FEW.over(database), np.random.default_rng(1)
    filter_.warm_up(epochs(log))
    state = filter_.begin()
    for epoch in epochs(log):
        state, output = filter_.step(state, epoch, rng)
    held = filter_.hypotheses(state)
    at = output.fix.east_m, output.fix.north_m
    east, north = (
        (np.asarray(axis) - origin).astype(np.float32)
        for axis, origin in zip((held.east_m, held.north_m), at, strict=True)
    )
    tail = sample_tail(east, north, np.asarray(held.weight, np.float32), (0.0, 0.0), 0.0)
    assert output.fix.protection_m == pytest.approx(tail.protection_m(1e-3), rel=0.02)


@pytest.mark.parametrize("risk", [0.0, 1.0, -1.0])
def test_a_risk_that_is_none_is_refused_before_anything_is_done(log, database, risk):
    with pytest.raises(ConfigError, match=r"risk.*between 0 and 1"):
        found(log, database, risk=risk)


def test_candidates_have_no_levels(log, database):
    estimate = found(log, database, CandidateFilter())
    assert np.isnan(estimate.protection_m).all()
    assert np.isnan(estimate.radius_99_m).all()


def test_smoothed_positions_keep_no_level_of_other_positions(log, database):
    estimate = found(log, database, dataclasses.replace(FEW, smooth=True))
    assert np.isnan(estimate.protection_m).all()


def test_the_tail_of_a_gaussian_sum_is_that_of_draws_from_it():
    rng = np.random.default_rng(2)
    means = rng.normal(size=(5, 4)) * 40.0
    roots = rng.normal(size=(5, 4, 4)) * 6.0
    covariances = roots @ roots.transpose(0, 2, 1) + np.eye(4)
    weights = rng.dirichlet(np.ones(5))
    belief = SumBelief(weights, means, covariances, np.arange(5))
    part = rng.choice(5, 400_000, p=weights)
    root = np.linalg.cholesky(covariances)[part]
    noise = np.einsum("nij,nj->ni", root, rng.normal(size=(part.size, 4)))
    drawn = (means[part] + noise)[:, [1, 3]]
    away = np.hypot(*(drawn - (weights @ means)[[1, 3]]).T)
    tail = belief_tail(belief, [1, 3])
    for share in (0.5, 0.95, 0.999):
        assert tail.radius_m(share) == pytest.approx(np.quantile(away, share), rel=0.02)
    assert tail.protection_m(1e-3) == pytest.approx(tail.radius_m(0.999), rel=1e-3)


def test_an_output_without_a_tail_stays_as_it_is():
    output = StepOutput(Fix.nowhere(1.0, Status.SEARCHING, Reason.NO_READING))
    assert output.protected(None) is output
    assert np.isnan(output.fix.protection_m)
