"""Gaussian sums by hand: which components are dropped, which fail, and what is left of them."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.filters.gaussian import CKF, EKF
from mapfilter.filters.gaussian_sum import Mixture, run_mixtures, split
from mapfilter.models.ranging import position_fix
from mapfilter.models.state import StateLayout
from mapfilter.positioning.kalman.models import compiled

FIX = compiled(position_fix(StateLayout(2, 0, 1), np.diag([1.0, 4.0])))
OWN = np.diag([3.0, 5.0])
STILL = np.eye(2), np.zeros((2, 2))


def followed(weights, means, readings, **more):
    first = Mixture(np.array(weights), np.array(means, dtype=float), OWN)
    given = np.array(readings, dtype=float)[None]
    return run_mixtures(FIX, *STILL, EKF, first, np.zeros(2), given, **more)


def moments(weights, means):
    """Mean and covariance of a mixture of alike components."""
    share, means = np.array(weights) / sum(weights), np.array(means)
    centre = share @ means
    return centre, OWN + (means - centre).T @ np.diag(share) @ (means - centre)


PLACES = [[0.0, 0.0], [8.0, -4.0], [-16.0, 2.0], [64.0, 32.0], [-9.0, 70.0]]
NONE = [np.nan, np.nan]


@pytest.mark.parametrize(
    ("weights", "least", "left", "dropped"),
    [
        # Exactly the least weight is enough.
        ([0.5, 0.25, 0.125, 0.125], 0.125, 4, False),
        ([0.5, 0.25, 0.125, 0.125], 0.126, 2, True),
        # They are given up once at most three quarters are left.
        ([0.5, 0.25, 0.1875, 0.0625], 0.1, 3, True),
        ([0.5, 0.25, 0.125, 0.0625, 0.0625], 0.1, 3, True),
        ([0.25, 0.25, 0.25, 0.1875, 0.0625], 0.1, 4, False),
        ([0.5, 0.25, 0.25], 0.6, 0, False),
        ([0.5, 0.5], 0.5, 2, False),
    ],
)
def test_components_of_little_weight_are_dropped_in_lots(weights, least, left, dropped):
    places = PLACES[: len(weights)]
    found = followed(weights, places, [NONE, NONE], least_weight=least)
    kept = [(w, p) for w, p in zip(weights, places, strict=True) if w >= least or not dropped]
    assert found.counts[0, 0] == left
    assert found.counts[0, 1] == (len(kept) if dropped else left)
    for k, (shares, at) in enumerate(((weights, places), zip(*kept, strict=True))):
        mean, covariance = moments(shares, at)
        np.testing.assert_allclose(found.means[0, k], mean, atol=1e-12)
        np.testing.assert_allclose(found.covariances[0, k], covariance, atol=1e-9)
    np.testing.assert_allclose(found.evidence, 0.0, atol=1e-15)


def density(reading, mean):
    covariance = OWN + np.diag([1.0, 4.0])
    off = np.array(reading) - mean
    return np.exp(-0.5 * off @ np.linalg.solve(covariance, off)) / (
        2 * np.pi * np.sqrt(np.linalg.det(covariance))
    )


def test_a_component_that_fails_has_no_weight():
    """Its square is beyond what a number can hold."""
    reading = [2.0, 1.0]
    found = followed([0.5, 0.25, 0.25], [[0.0, 0.0], [1e200, 0.0], [4.0, 2.0]], [reading, NONE])
    share = np.array([0.5 * density(reading, [0, 0]), 0.25 * density(reading, [4, 2])])
    assert found.evidence[0, 0] == pytest.approx(np.log(share.sum()))
    share /= share.sum()
    gain = np.diag(OWN) / np.diag(OWN + np.diag([1.0, 4.0]))
    after = np.array([gain * reading, np.array([4, 2]) + gain * (np.array(reading) - [4, 2])])
    np.testing.assert_allclose(found.means[0], np.tile(share @ after, (2, 1)), rtol=1e-9)
    assert found.counts.tolist() == [[2, 2]]


def test_where_all_components_fail_the_mixture_stays():
    found = followed([0.75, 0.25], [[1e200, 0.0], [1e200, 8.0]], [[0.0, 0.0]])
    assert np.isnan(found.evidence[0, 0])
    np.testing.assert_allclose(found.means[0, 0], [1e200, 2.0])
    assert found.counts.tolist() == [[2]]


def test_components_without_weight_stay_without():
    """The reading lies at one that has none."""
    found = followed([1.0, 0.0], [[0.0, 0.0], [30.0, 0.0]], [[30.0, 0.0]])
    assert found.evidence[0, 0] == pytest.approx(np.log(density([30.0, 0.0], [0, 0])))
    assert found.means[0, 0, 0] == pytest.approx(30.0 * 3 / 4)


def test_each_trial_has_a_first_mean_of_its_own():
    first = Mixture(np.array([0.75, 0.25]), np.array([[0.0, 0.0], [4.0, 8.0]]), OWN)
    readings = np.full((2, 1, 2), np.nan)
    starts = np.array([[10.0, 20.0], [-5.0, 1.0]])
    for method in (EKF, CKF):
        found = run_mixtures(FIX, *STILL, method, first, starts, readings)
        np.testing.assert_allclose(found.means[:, 0], starts + np.array([1.0, 2.0]))
    np.testing.assert_array_equal(first.weights, [0.75, 0.25])
    alike = run_mixtures(FIX, *STILL, EKF, first, [1.0, 1.0], readings)
    np.testing.assert_allclose(alike.means[:, 0], [[2.0, 3.0]] * 2)
    assert (found.evidence.shape, found.counts.shape) == ((2, 1), (2, 1))
    assert found.covariances.shape == (2, 1, 2, 2)


@pytest.mark.parametrize(
    ("count", "reach", "out"),
    [(2, 2.5, np.sqrt(0.19)), (2, 0.3, 0.3), (3, 2.5, 2.5), (4, 1.2, 1.2)],
)
def test_parts_lie_evenly_and_keep_the_moments(count, reach, out):
    """Two parts lie where each keeps nine tenths of the deviation."""
    cut = split([1.0, -2.0], np.diag([4.0, 9.0]), {1: count}, reach)
    places = np.linspace(-out, out, count)
    np.testing.assert_allclose(cut.means, np.column_stack([np.ones(count), -2 + 3 * places]))
    np.testing.assert_allclose(cut.weights, cut.weights[::-1])
    assert cut.weights.sum() == pytest.approx(1.0)
    assert cut.weights @ places**2 + cut.covariance[1, 1] / 9 == pytest.approx(1.0)
    assert (cut.covariance[0, 0], cut.covariance[0, 1]) == (4.0, 0.0)
    if count > 2:
        # The deviation of a part is the spacing, or nine tenths.
        narrow = min(2 * out / (count - 1), 0.9)
        assert cut.covariance[1, 1] == pytest.approx(9 * narrow**2, rel=1e-6)
    else:
        assert cut.weights.tolist() == [0.5, 0.5]
        assert cut.covariance[1, 1] == pytest.approx(9 * (1 - out**2))


def test_what_cannot_be_split_is_told_together():
    correlated = np.array([[4.0, 1.0, 0.0], [1.0, 9.0, 0.0], [0.0, 0.0, 1.0]])
    with pytest.raises(InputError) as caught:
        split(np.zeros(3), correlated, {0: 2, 1: 1, 2: 0, 3: 2, -1: 2})
    assert [fault.where for fault in caught.value.faults] == [
        "covariance, row 0",
        "covariance, row 1",
        *["parts"] * 3,
    ]
    cut = split(np.zeros(3), correlated, {2: 3})
    np.testing.assert_array_equal(cut.covariance[:2, :2], correlated[:2, :2])
    with pytest.raises(InputError, match="covariance"):
        split(np.zeros(2), -np.eye(2), {0: 2})
