"""What clouds of a few points say, computed by hand."""

from math import log2

import numpy as np
import pytest

from mapfilter.filters.array_summary import summarise_arrays
from mapfilter.filters.hypotheses import NEAR_M, SHARES, Bins, empty_summary, flattened, summarise
from mapfilter.filters.resampling import copy_with_jitter, normalise, systematic

BINS = Bins(0.0, 0.0, 25.0, 40, 30)


def say(*points, bins=BINS):
    """BeliefSummary of (east, north, weight, more of the state...), by either way the same."""
    table = np.array([[east, north, *more] for east, north, _, *more in points]).T
    # Rows lie apart in memory as those of a filter: kernels are compiled anew for others.
    state, weight = np.ascontiguousarray(table, "f4"), np.array([p[2] for p in points], "f4")
    said = summarise(state, weight, bins)
    for one, other in zip(said, summarise_arrays(state, weight, bins), strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-5, atol=1e-4)
    return said


def ring(number, part):
    """Radius at a part of the ring of a number: rings are 30 to the root of a metre."""
    return ((number + part) / 30.0) ** 2


def test_bins_have_a_margin_of_one():
    assert Bins.over((100.0, 50.0, 200.0, 110.0)) == Bins(75.0, 25.0, 25.0, 6, 5)
    assert Bins.over((100.0, 50.0, 101.0, 50.0), 10.0) == Bins(90.0, 40.0, 10.0, 3, 3)
    assert Bins.over((0.0, 0.0, 26.0, 25.0)) == Bins(-25.0, -25.0, 25.0, 4, 3)
    assert (NEAR_M, SHARES) == (50.0, (0.50, 0.67, 0.95))


def test_two_places_and_how_far_shares_reach():
    said = say((500.0, 300.0, 0.6), (600.0, 300.0, 0.4))
    assert said.mean == pytest.approx([500.0, 300.0], abs=1e-4)
    np.testing.assert_allclose(said.covariance_m2, np.zeros((2, 2)), atol=1e-6)
    assert said.mass_50m == pytest.approx(0.6)
    # A hundred metres are 300 rings.
    expected = [ring(0, 0.5 / 0.6), ring(300, 0.07 / 0.4), ring(300, 0.35 / 0.4)]
    assert said.radii_m == pytest.approx(expected, rel=1e-5)
    # The middle of its bin.
    assert said.runners_up.tolist() == [[612.5, 312.5, pytest.approx(0.4)]]
    entropy = -0.6 * log2(0.6) - 0.4 * log2(0.4)
    assert said.entropy_bits == pytest.approx(entropy, rel=1e-5)
    assert said.effective_bins == pytest.approx(2**entropy, rel=1e-5)


def test_beyond_the_last_ring_all_is_in_it():
    said = say((500.0, 300.0, 0.6), (30_500.0, 300.0, 0.4))
    assert said.radii_m[1:] == pytest.approx([ring(4096, 0.175), ring(4096, 0.875)], rel=1e-5)


def test_the_leader_is_the_heaviest_neighbourhood_and_its_mean_that_of_50_m():
    """A bin of 0.3 alone loses to 0.15 with neighbours of 0.4 in all."""
    said = say(
        (112.0, 112.0, 0.3, 7.0),
        (512.0, 312.0, 0.15, 1.0),
        (490.0, 312.0, 0.2, 2.0),
        (512.0, 330.0, 0.2, 3.0),
        (537.0, 312.0, 0.05, 4.0),
        (565.0, 312.0, 0.1, 9.0),
    )
    weight = np.array([0.15, 0.2, 0.2, 0.05])
    east = np.array([512.0, 490.0, 512.0, 537.0])
    north, more = np.array([312.0, 312.0, 330.0, 312.0]), np.array([1.0, 2.0, 3.0, 4.0])
    total = weight.sum()
    centre = weight @ east / total, weight @ north / total
    assert said.mean == pytest.approx([*centre, weight @ more / total], rel=1e-5)
    off = np.array([east - centre[0], north - centre[1]])
    np.testing.assert_allclose(said.covariance_m2, off * weight @ off.T / total, rtol=1e-3)
    assert said.mass_50m == pytest.approx(total)
    assert said.runners_up.tolist() == [[112.5, 112.5, pytest.approx(0.3)]]


def test_fifty_metres_belong_to_a_place():
    said = say((512.0, 312.0, 0.9), (512.0, 312.0, 0.05), (530.0, 364.0, 0.05))
    # 55 m away: not.
    assert said.mass_50m == pytest.approx(0.95)
    mean = [512.5, 312.5]
    said = say((*mean, 1.0), (mean[0] + 30.0, mean[1] + 40.0, 0.0))
    assert said.mass_50m == pytest.approx(1.0)
    exact = say((*mean, 0.5), (mean[0] - 50.0, mean[1], 0.25), (mean[0] + 50.0, mean[1], 0.25))
    assert (exact.mean[0], exact.mass_50m) == (512.5, 1.0)
    assert exact.covariance_m2[0, 0] == pytest.approx(1250.0)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1, 1])
def test_two_bins_about_a_leader_are_its_own(axis, side):
    leader = np.array([512.5, 312.5])
    for apart, count in ((2, 0), (3, 1)):
        other = leader.copy()
        other[axis] += side * 25.0 * apart
        said = say((*leader, 0.7), (*other, 0.3))
        assert len(said.runners_up) == count
        assert said.mass_50m == pytest.approx(1.0 if apart == 2 else 0.7)


def test_at_most_two_others_and_none_of_less_than_a_ten_thousandth():
    places = [(100.0, 100.0, 0.6), (300.0, 100.0, 0.2), (500.0, 100.0, 0.15), (700.0, 100.0, 0.05)]
    assert say(*places).runners_up[:, 2] == pytest.approx([0.2, 0.15])
    assert len(say((100.0, 100.0, 0.99985), (300.0, 100.0, 1.5e-4)).runners_up) == 1
    assert not len(say((100.0, 100.0, 0.99991), (300.0, 100.0, 0.9e-4)).runners_up)
    none = say((100.0, 100.0, 1.0)).runners_up
    assert none.shape == (0, 3)


def test_corners_count_where_they_are():
    """Neighbourhoods end at the edge of the area; what lies beyond counts in its last bins."""
    for east, north in ((0.0, 0.0), (999.0, 749.0), (-80.0, 400.0), (400.0, 900.0)):
        inner = min(max(east, 12.5), 987.5), min(max(north, 12.5), 737.5)
        said = say((*inner, 0.5), (east, north, 0.1), (500.0, 420.0, 0.4))
        assert said.runners_up[0, 2] == pytest.approx(0.4)
        bins = -0.6 * log2(0.6) - 0.4 * log2(0.4)
        assert said.entropy_bits == pytest.approx(bins, rel=1e-4)


def test_a_bin_of_no_weight_is_no_place():
    said = say((100.0, 100.0, 0.0), (500.0, 300.0, 1.0))
    assert said.mean == pytest.approx([500.0, 300.0], abs=1e-4)
    assert said.entropy_bits == pytest.approx(0.0, abs=1e-6)
    assert not len(said.runners_up)


def test_hypotheses_without_any_weight_lie_nowhere():
    said = say((100.0, 100.0, 0.0), (500.0, 300.0, 0.0))
    assert (said.mean.tolist(), said.mass_50m) == ([0.0, 0.0], 0.0)
    assert said.radii_m == pytest.approx([ring(4097, 1.0)] * 3)


def test_a_ring_that_ends_with_a_share_holds_it():
    """Half here, 17 % 100 m away, 28 % 200 m away, and the rest beyond."""
    weight = (0.5, 0.17, 0.28, 0.05)
    said = say(*((500.0 + 100.0 * n, 300.0, w) for n, w in enumerate(weight)))
    # The first ring ends with a half; rounding leaves the others to either side of theirs.
    assert said.radii_m[0] == pytest.approx(ring(0, 1.0))
    quarter = say((500.0, 300.0, 0.25), (500.0, 300.0, 0.375), (700.0, 300.0, 0.375))
    assert quarter.radii_m == pytest.approx(
        [ring(0, 0.8), ring(424, 0.045 / 0.375), ring(424, 0.325 / 0.375)], rel=1e-5
    )


@pytest.mark.parametrize("cols", [3, 40])
def test_bins_of_an_oblong_area_and_of_a_corner_elsewhere(cols):
    rows = 43 - cols
    bins = Bins(-1000.0, 2000.0, 10.0, cols, rows)
    for col, row in ((0, 0), (cols - 1, rows - 1), (0, rows - 1), (cols - 1, 0), (1, 2)):
        east, north = -1000.0 + 10.0 * col, 2000.0 + 10.0 * row
        other = (
            -1000.0 + 10.0 * ((col + cols // 2) % cols),
            2000.0 + 10.0 * ((row + rows // 2) % rows),
        )
        # The lower edges of a bin are its own.
        said = say((east + 0.01, north + 9.9, 0.25), (east, north, 0.35), (*other, 0.4), bins=bins)
        entropy = -0.6 * log2(0.6) - 0.4 * log2(0.4)
        assert said.entropy_bits == pytest.approx(entropy, rel=1e-5)
        middle = pytest.approx([other[0] + 5.0, other[1] + 5.0, 0.4])
        assert said.runners_up.tolist() == [middle]


def test_nothing_is_unknown():
    said = empty_summary(3)
    assert (said.mean.shape, said.covariance_m2.shape, said.radii_m.shape) == ((3,), (2, 2), (3,))
    for found in (said.mean, said.covariance_m2, said.radii_m, said.entropy_bits):
        assert np.isnan(found).all()
    assert said.runners_up.shape == (0, 3)


def test_flattened_weights_over_rows_and_columns():
    bins = Bins(0.0, 0.0, 10.0, 3, 2)
    place = np.array([[5.0, 15.0, 5.0, -9.0, 99.0, 29.0], [5.0, 5.0, 15.0, 1.0, 99.0, 12.0]], "f4")
    weight = np.array([0.1, 0.2, 0.3, 0.1, 0.2, 0.1], "f4")
    # The fourth lies in the first's bin, the fifth in the last's.
    mass = np.array([0.2, 0.2, 0.3, 0.2, 0.3, 0.3])
    expected = weight * mass**-0.5
    found = flattened(place, weight, bins, 0.5)
    np.testing.assert_allclose(found, expected / expected.sum(), rtol=1e-5)


@pytest.mark.parametrize("count", [1, 7, 8, 9, 16, 29])
def test_weights_of_any_number_sum_to_one(count):
    log_weight = np.random.default_rng(count).normal(-50.0, 2.0, count)
    expected = np.exp(log_weight)
    total = expected.sum()
    expected /= total
    weight, given = np.empty(count, "f4"), log_weight.copy()
    log_total, effective = normalise(given, weight)
    np.testing.assert_allclose(weight, expected, rtol=1e-5)
    np.testing.assert_allclose(given, np.log(expected), atol=1e-5)
    assert log_total == pytest.approx(np.log(total), abs=1e-5)
    assert effective == pytest.approx(1 / (expected**2).sum(), rel=1e-5)


def chosen(weight, offset, count):
    found = np.empty(count, dtype=np.int32)
    systematic(np.array(weight, "f4"), offset, found)
    return found.tolist()


def test_points_on_the_border_of_two_particles_are_the_second_one_s():
    assert chosen([0.5, 0.5], 0.0, 2) == [0, 1]
    assert chosen([0.25, 0.25, 0.5], 0.5, 2) == [1, 2]
    assert chosen([1.0], 0.9, 3) == [0, 0, 0]
    assert chosen([0.0, 0.5, 0.0, 0.5], 0.25, 4) == [1, 1, 3, 3]
    # Rounding may leave less than one in all.
    assert chosen([0.5, 0.25], 0.99, 4) == [0, 0, 1, 1]


def test_more_jitter_than_rows_counts_not():
    state = np.array([[1.0, 2.0], [10.0, 20.0], [7.0, 7.0]], "f4")
    picked = np.zeros(20_000, dtype=np.int32)
    copies = np.empty((3, picked.size), "f4")
    jitter = np.array([2.0, 0.5, 1.0, 300.0, 300.0], "f4")
    copy_with_jitter(0, picked.size, state, picked, jitter, np.uint64(5), copies)
    np.testing.assert_allclose(copies.std(axis=1), [2.0, 0.5, 1.0], rtol=0.04)
    # One of a pair without noise stays as it is, the other one is moved.
    for quiet in (0, 1):
        sd = np.array([1.0, 1.0, 0.0], "f4")
        sd[quiet] = 0.0
        copy_with_jitter(0, picked.size, state, picked, sd, np.uint64(5), copies)
        np.testing.assert_array_equal(copies[[quiet, 2]], state[[quiet, 2]][:, picked])
        assert copies[1 - quiet].std() == pytest.approx(1.0, rel=0.04)


def test_rows_of_a_copy_are_moved_by_numbers_of_their_own():
    state, picked = np.zeros((6, 1), "f4"), np.zeros(5000, dtype=np.int32)
    copies = np.empty((6, 5000), "f4")
    copy_with_jitter(0, picked.size, state, picked, np.ones(6, "f4"), np.uint64(8), copies)
    beside = np.vstack([copies[:, :-1], copies[:, 1:]])
    assert np.abs(np.corrcoef(beside) - np.eye(12)).max() < 5 / 5000**0.5


@pytest.mark.parametrize("seed", range(6))
def test_runners_up_lead_once_the_places_before_them_are_taken_away(seed):
    """Neighbourhoods that are summed anew about a leader alone are those of all bins."""
    rng = np.random.default_rng(seed)
    points = np.array([1000.0, 750.0])[:, None] * rng.random((2, 400))
    points[:, :250] = points[:, :5].repeat(50, axis=1) + 60 * rng.standard_normal((2, 250))
    weight = (rng.random(400) ** 3).astype("f4")
    weight /= weight.sum()
    said = summarise(points.astype("f4"), weight, BINS)
    col, row = (np.clip((x.astype("f4") / 25).astype(int), 0, n - 1)
                for x, n in zip(points, (40, 30), strict=True))  # fmt: skip
    mass = np.zeros((32, 42), dtype="f4")
    np.add.at(mass, (row + 1, col + 1), weight)
    leaders, touched = [], mass[1:-1, 1:-1] > 0
    for _ in range(3):
        near = sum(mass[r : r + 30, c : c + 40].astype(float) for r in range(3) for c in range(3))
        near[~touched] = 0.0
        best_row, best_col = np.unravel_index(near.argmax(), near.shape)
        leaders.append((best_row, best_col, near.max()))
        mass[max(best_row - 1, 0) : best_row + 4, max(best_col - 1, 0) : best_col + 4] = 0
    expected = [
        [25 * c + 12.5, 25 * r + 12.5, pytest.approx(m, rel=1e-5)] for r, c, m in leaders[1:]
    ]
    assert said.runners_up.tolist() == expected
    arrays = summarise_arrays(points.astype("f4"), weight, BINS)
    assert arrays.runners_up.tolist() == expected
