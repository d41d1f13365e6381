"""Gaussian sums: their moments, and which parts are dropped or merged after an update."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm, rice

from mapfilter.filters.gaussian import EKF
from mapfilter.models.ranging import position_fix
from mapfilter.models.state import POSITION
from mapfilter.positioning.kalman.belief import FusionHistory, SumBelief
from mapfilter.positioning.kalman.models import compiled
from mapfilter.positioning.kalman.place import gaussian_radii_m, mixture_radii_m, share_within

COVARIANCE = np.array([[25.0, 6.0], [6.0, 16.0]])


def parts(*means, weights=None, covariances=None):
    count = len(means)
    weights = np.full(count, 1 / count) if weights is None else np.array(weights)
    covariances = np.tile(COVARIANCE, (count, 1, 1)) if covariances is None else covariances
    return SumBelief(weights, np.array(means, dtype=float), np.array(covariances),
                     10 + np.arange(count))  # fmt: skip


def updated(belief, place_m=(0.0, 0.0), sd_m=1e6):
    """A belief after a fix; one as wide as usual changes hardly anything."""
    model = compiled(position_fix(POSITION, np.eye(2) * sd_m**2))
    return belief.update(model, place_m, EKF)


def test_moments_are_those_of_the_mixture():
    belief = parts((0.0, 0.0), (30.0, -10.0), (5.0, 40.0), weights=(0.5, 0.3, 0.2))
    mean = 0.5 * belief.means[0] + 0.3 * belief.means[1] + 0.2 * belief.means[2]
    second = sum(
        w * (COVARIANCE + np.outer(m, m)) for w, m in zip(belief.weights, belief.means, strict=True)
    )
    np.testing.assert_allclose(belief.moments.mean, mean)
    np.testing.assert_allclose(belief.moments.covariance, second - np.outer(mean, mean))
    np.testing.assert_array_equal(belief.leading.mean, [0.0, 0.0])
    np.testing.assert_array_equal(parts((1.0, 2.0), (3.0, 4.0), weights=(0.1, 0.9)).leading.mean,
                                  [3.0, 4.0])  # fmt: skip


def test_linear_motion_moves_each_part():
    belief = parts((1.0, 2.0), (-4.0, 5.0))
    transition, noise = np.array([[1.0, 0.5], [0.0, 1.0]]), np.array([[2.0, 0.3], [0.3, 1.0]])
    found = belief.predict(transition, noise, [7.0, -1.0])
    for k in range(2):
        np.testing.assert_allclose(found.means[k], transition @ belief.means[k] + [7.0, -1.0])
        np.testing.assert_allclose(
            found.covariances[k], transition @ COVARIANCE @ transition.T + noise
        )
    np.testing.assert_array_equal(found.parts, belief.parts)


@pytest.mark.parametrize("place_m", [(3.0, 1.0), (60.0, -20.0)])
def test_parts_are_weighed_by_their_evidence(place_m):
    sd_m = 12.0
    belief = parts((0.0, 0.0), (30.0, -10.0), (5.0, 40.0), weights=(0.5, 0.3, 0.2))
    found, taken = updated(belief, place_m, sd_m)
    whole = COVARIANCE + sd_m**2 * np.eye(2)
    off = np.array(place_m) - belief.means
    nis = np.einsum("ci,ij,cj->c", off, np.linalg.inv(whole), off)
    evidence = np.exp(-0.5 * nis) / (2 * np.pi * np.sqrt(np.linalg.det(whole)))
    share = belief.weights * evidence / (belief.weights @ evidence)
    order = np.argsort(-share)
    order = order[share[order] > 1e-6]
    np.testing.assert_array_equal(found.parts, 10 + order)
    np.testing.assert_allclose(found.weights, share[order], rtol=1e-5)
    assert taken.used
    assert taken.nis == pytest.approx(share @ nis)
    assert taken.evidence == pytest.approx(np.log(belief.weights @ evidence))
    gain = COVARIANCE @ np.linalg.inv(whole)
    np.testing.assert_allclose(found.means, (belief.means + off @ gain.T)[order])
    np.testing.assert_allclose(found.covariances[0], COVARIANCE - gain @ COVARIANCE)


@pytest.mark.parametrize(("square", "count"), [(0.095, 1), (0.105, 2)])
def test_a_part_that_lies_on_a_heavier_one_is_merged_into_it(square, count):
    """Within a tenth of a squared deviation; the heavier one stays where it is."""
    away = np.linalg.cholesky(COVARIANCE) @ np.array([0.6, -0.8]) * square**0.5
    belief = parts((3.0, 4.0), np.array([3.0, 4.0]) + away, (200.0, 0.0), weights=(0.3, 0.2, 0.5))
    found, _ = updated(belief)
    assert found.weights.size == count + 1
    np.testing.assert_allclose(found.means[0], [200.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(found.means[1], [3.0, 4.0], atol=1e-3)
    assert found.weights[1] == pytest.approx(0.5 if count == 1 else 0.3, rel=1e-6)
    assert found.parts[:2].tolist() == [12, 10]
    assert found.weights.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(("log_volume", "count"), [(0.19, 1), (-0.19, 1), (0.21, 2), (-0.21, 2)])
def test_parts_of_other_volumes_stay(log_volume, count):
    wider = COVARIANCE * np.exp(log_volume / 2)
    belief = parts((3.0, 4.0), (3.0, 4.0), weights=(0.6, 0.4), covariances=[COVARIANCE, wider])
    found, _ = updated(belief)
    assert found.weights.size == count


@pytest.mark.parametrize(("weight", "count"), [(0.9e-6, 1), (1.1e-6, 2), (0.0, 1)])
def test_parts_without_weight_are_dropped(weight, count):
    belief = parts((0.0, 0.0), (300.0, 0.0), weights=(1 - weight, weight))
    found, _ = updated(belief)
    assert found.weights.size == count
    assert found.weights.sum() == pytest.approx(1.0)
    assert found.parts[0] == 10


def test_many_parts_that_lie_on_one_another_become_one():
    """In steps: one that is far from the heaviest is a heavier one of those beside it."""
    means = [(0.0, 0.0), (0.5, 0.0), (100.0, 0.0), (100.4, 0.0), (0.0, 0.3)]
    belief = parts(*means, weights=(0.3, 0.1, 0.25, 0.2, 0.15))
    found, _ = updated(belief)
    np.testing.assert_allclose(found.means, [(0.0, 0.0), (100.0, 0.0)], atol=1e-3)
    np.testing.assert_allclose(found.weights, [0.55, 0.45], rtol=1e-6)
    assert found.parts.tolist() == [10, 12]


def test_a_part_of_one_in_a_million_stays():
    """The reading is as near to either of them."""
    belief = parts((-300.0, 0.0), (300.0, 0.0), weights=(1 - 1e-6, 1e-6))
    found, _ = updated(belief)
    assert found.weights.tolist() == [1 - 1e-6, 1e-6]


def test_a_part_that_was_merged_takes_no_other_one():
    """The second, at 0.09 of the first, lies as near to the third, which is 0.36 from the first."""
    step = np.linalg.cholesky(COVARIANCE) @ np.array([0.3, 0.0])
    found, _ = updated(parts((0.0, 0.0), step, 2 * step, weights=(0.5, 0.3, 0.2)))
    np.testing.assert_allclose(found.weights, [0.8, 0.2], rtol=1e-6)
    assert found.parts.tolist() == [10, 12]


def test_a_start_around_a_place_has_equal_parts():
    places = {0: np.array([1.0, 2.0, 3.0, 4.0]), 1: np.array([5.0, 6.0, 7.0, 8.0])}
    found = SumBelief.around(np.array([9.0, 9.0]), COVARIANCE, places)
    np.testing.assert_allclose(found.weights, 0.25)
    np.testing.assert_array_equal(found.means, np.column_stack([places[0], places[1]]))
    np.testing.assert_array_equal(found.covariances, np.tile(COVARIANCE, (4, 1, 1)))
    assert found.parts.tolist() == [0, 1, 2, 3]
    some = SumBelief.around(np.array([9.0, 8.0]), COVARIANCE, {1: places[1]})
    np.testing.assert_array_equal(some.means, np.column_stack([np.full(4, 9.0), places[1]]))


def test_a_reading_that_no_part_can_take_changes_nothing():
    belief = parts((0.0, 0.0), (30.0, 0.0))
    found, taken = updated(belief, (np.nan, np.nan), 5.0)
    assert not taken.used or np.array_equal(found.weights, belief.weights)


def test_a_part_that_cannot_be_updated_loses_its_weight():
    belief = parts((0.0, 0.0), (np.nan, 0.0), (30.0, 0.0), weights=(0.2, 0.7, 0.1))
    found, taken = updated(belief)
    assert taken.used
    assert found.parts.tolist() == [10, 12]
    np.testing.assert_allclose(found.weights, [2 / 3, 1 / 3], rtol=1e-6)


def test_a_reading_that_only_parts_without_weight_explain_changes_nothing():
    """To all others it is less likely than any number tells."""
    belief = parts((0.0, 0.0), (1e5, 0.0), weights=(1.0, 0.0))
    found, taken = updated(belief, (1e5, 0.0), 5.0)
    assert found is belief
    assert not taken.used
    assert np.isnan(taken.nis)


def test_evidence_that_is_far_apart_overflows_nothing():
    found, taken = updated(parts((0.0, 0.0), (1e5, 0.0)), sd_m=5.0)
    np.testing.assert_allclose(found.means, [[0.0, 0.0]])
    assert np.isfinite(taken.evidence)
    still = parts((1.0, 2.0)).predict(np.eye(2), np.zeros((2, 2)))
    np.testing.assert_array_equal(still.means, [[1.0, 2.0]])


SHARES = np.array([0.50, 0.67, 0.95])


@pytest.mark.parametrize("angle_rad", [0.0, 0.6])
@pytest.mark.parametrize("short_m", [1e-4, 0.5, 4.0, 12.0, 20.0])
def test_radii_hold_their_shares_of_a_normal_belief(short_m, angle_rad):
    """By the distribution of a weighted sum of two squares, as draws from it have it."""
    turn = np.array([[np.cos(angle_rad), -np.sin(angle_rad)],
                     [np.sin(angle_rad), np.cos(angle_rad)]])  # fmt: skip
    covariance = turn @ np.diag([400.0, short_m**2]) @ turn.T
    radii_m, share = gaussian_radii_m(covariance, 25.0)
    drawn = np.random.default_rng(1).standard_normal((400_000, 2)) * [20.0, short_m]
    away_m = np.hypot(*drawn.T)
    assert [np.mean(away_m <= one) for one in radii_m] == pytest.approx(SHARES, abs=4e-3)
    assert share == pytest.approx(np.mean(away_m <= 25.0), abs=4e-3)
    assert share_within(covariance, 25.0) == share
    if short_m < 1.0:
        return
    for radius_m, held in zip((*radii_m, 25.0), (*SHARES, share), strict=True):
        # Along each direction it is normal: v = a cos² + b sin².
        beyond, _ = quad(lambda angle, r=radius_m: np.exp(
            -0.5 * r**2 / (400.0 * np.cos(angle) ** 2 + short_m**2 * np.sin(angle) ** 2)),
            0.0, np.pi / 2)  # fmt: skip
        assert 1 - beyond * 2 / np.pi == pytest.approx(held, abs=1e-7)


def test_radii_of_round_beliefs_and_of_lines():
    radii_m, share = gaussian_radii_m(100.0 * np.eye(2), 25.0)
    np.testing.assert_allclose(radii_m, 10.0 * np.sqrt(-2 * np.log(1 - SHARES)), rtol=1e-12)
    assert share == pytest.approx(1 - np.exp(-3.125))
    radii_m, share = gaussian_radii_m(np.diag([100.0, 1e-6]), 25.0)
    np.testing.assert_allclose(radii_m, 10.0 * norm.ppf(0.5 + SHARES / 2), rtol=1e-4)
    assert share == pytest.approx(2 * norm.cdf(2.5) - 1, abs=1e-4)


def test_a_place_that_is_known_exactly_counts_as_known_to_a_millimetre():
    radii_m, share = gaussian_radii_m(np.zeros((2, 2)), 1e-3)
    np.testing.assert_allclose(radii_m, 1e-3 * np.sqrt(-2 * np.log(1 - SHARES)))
    assert share == pytest.approx(1 - np.exp(-0.5))


def test_smoothed_parts_are_those_of_rauch_tung_and_striebel():
    """Each by itself, with the weights that they have at the end, and with the shifts."""
    transition, process = np.array([[1.0, 0.2], [0.0, 0.9]]), np.array([[3.0, 1.0], [1.0, 2.0]])
    shifts = [np.array([500.0, 9.0]), np.array([7.0, -3.0]), np.array([-4.0, 6.0])]
    belief, history = parts((0.0, 0.0), (40.0, 10.0), weights=(0.9, 0.1)), FusionHistory()
    history.add(belief, np.eye(2), np.zeros((2, 2)), shifts[0])
    for shift, place_m in zip(shifts[1:], ((44.0, 2.0), (38.0, 8.0)), strict=True):
        belief, _ = updated(belief.predict(transition, process, shift), place_m, 6.0)
        history.add(belief, transition, process, shift)
    last = history.beliefs[-1]
    assert last.parts.tolist() == [11, 10]
    of_part = {part: (last.means[k], last.covariances[k]) for k, part in enumerate(last.parts)}
    later = [of_part]
    for before, shift in zip(history.beliefs[1::-1], shifts[:0:-1], strict=True):
        smoothed = {}
        for part, (mean, covariance) in later[-1].items():
            k = int(np.flatnonzero(before.parts == part)[0])
            own, spread = before.means[k], before.covariances[k]
            predicted = transition @ spread @ transition.T + process
            gain = spread @ transition.T @ np.linalg.inv(predicted)
            off = mean - (transition @ own + shift)
            smoothed[part] = own + gain @ off, spread + gain @ (covariance - predicted) @ gain.T
        later.append(smoothed)
    found = history.smoothed()
    assert len(found) == 3
    for one, expected in zip(found, later[::-1], strict=True):
        means = np.array([expected[part][0] for part in last.parts])
        spreads = np.array([expected[part][1] for part in last.parts])
        whole = SumBelief(last.weights, means, spreads, last.parts).moments
        np.testing.assert_allclose(one.mean, whole.mean, rtol=1e-8)
        np.testing.assert_allclose(one.covariance, whole.covariance, rtol=1e-7)
    assert FusionHistory().smoothed() == []
    alone = FusionHistory()
    alone.add(belief, np.eye(2), np.zeros((2, 2)), shifts[0])
    (one,) = alone.smoothed()
    np.testing.assert_allclose(one.mean, belief.moments.mean)


def test_radii_are_those_of_the_mixture_about_its_mean():
    """They were those of one Gaussian with its moments: 2509, 3173 and 5215 m about this ring."""
    angle = np.arange(36) / 36 * 2 * np.pi
    means = 3000.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    ring = parts(*means, covariances=np.tile(np.diag([4e4, 4e4]), (36, 1, 1)))
    found_m = mixture_radii_m(ring, [0, 1])
    # The distance from the middle is Rician: of 3000 m, with 200 m about it.
    np.testing.assert_allclose(found_m, rice.ppf([0.50, 0.67, 0.95], 15, scale=200), rtol=1e-4)
    single = parts((5.0, 7.0))
    one_m, _ = gaussian_radii_m(COVARIANCE, 50.0)
    np.testing.assert_allclose(mixture_radii_m(single, [0, 1]), one_m, rtol=2e-5)


def test_moments_of_one_part_are_those_of_the_sum_to_the_bit():
    rng = np.random.default_rng(4)
    for size in (2, 5, 7):
        root = rng.normal(size=(size, size))
        mean, covariance = rng.normal(0.0, 1e6, size), root @ root.T
        mean[0] = covariance[0, 1] = covariance[1, 0] = -0.0
        one = SumBelief(np.ones(1), mean[None], covariance[None], np.zeros(1, dtype=np.int64))
        # A part of no weight does not count, and is no sum of one.
        two = SumBelief(np.array([1.0, 0.0]), np.array([mean] * 2), np.array([covariance] * 2), [0])
        for found, expected in (
            (one.moments.mean, two.moments.mean),
            (one.moments.covariance, two.moments.covariance),
        ):
            assert found.tobytes() == expected.tobytes()
