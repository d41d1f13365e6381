"""Calibrated regions by their definition, and which reports are left out together."""

from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.positioning.fingerprints import regions
from mapfilter.positioning.fingerprints.cross_validation import folds_of, positions_of
from mapfilter.positioning.fingerprints.regions import LEVELS, Errors, Regions, calibrate, coverage


def conformal(ratios, share):
    """The smallest ratio within which so many of the errors, and one more, lie."""
    ordered = np.sort(ratios)
    number = int(np.ceil(share * (len(ordered) + 1) - 1e-9))
    return ordered[min(number, len(ordered)) - 1]


def errors(count, blocks, seed=1):
    rng = np.random.default_rng(seed)
    return Errors(
        rng.gamma(2.0, 5.0, count), rng.uniform(1, 9, count), rng.uniform(0, 1, count),
        np.arange(count) % blocks,
    )  # fmt: skip


@pytest.mark.parametrize(("count", "classes"), [(79, 1), (80, 2), (119, 2), (120, 3), (500, 3)])
def test_matches_of_each_class_have_conformal_quantiles_of_their_own(count, classes):
    """Two blocks are too few to raise the levels; a class has at least 40 errors."""
    given = errors(count, 2)
    found = calibrate(given)
    assert found.added_m == np.median(given.error_m)
    expected = np.quantile(given.mismatch, np.arange(1, classes) / classes) if classes > 1 else []
    np.testing.assert_allclose(found.edges, expected)
    ratio = given.error_m / (given.spread_m + found.added_m)
    which = np.searchsorted(found.edges, given.mismatch, side="right")
    assert found.factor.shape == (classes, 3)
    for one in range(classes):
        own = [conformal(ratio[which == one], level) for level in LEVELS]
        np.testing.assert_allclose(found.factor[one], own)


def test_a_class_of_few_errors_takes_the_quantiles_of_all():
    """Fewer than ten of 40, or than all there are."""
    ratio = np.arange(1.0, 101.0)
    which = np.where(np.arange(100) < 9, 0, 1)
    nominal = np.array([0.5, 0.9])
    found = regions._quantiles(ratio, which, 2, nominal)
    np.testing.assert_allclose(found[0], [conformal(ratio, one) for one in nominal])
    np.testing.assert_allclose(found[1], [conformal(ratio[9:], one) for one in nominal])
    ten = regions._quantiles(ratio, np.where(np.arange(100) < 10, 0, 1), 2, nominal)
    np.testing.assert_allclose(ten[0], [conformal(ratio[:10], one) for one in nominal])
    few = regions._quantiles(ratio[:5], np.zeros(5, dtype=int), 1, nominal)
    np.testing.assert_allclose(few[0], [3.0, 5.0])


def test_radii_are_the_factor_of_their_class_times_the_spread():
    made = Regions(2.0, np.array([0.3, 0.6]), np.arange(9.0).reshape(3, 3))
    found = made.radii_m(np.array([1.0, 3.0, 8.0, 8.0]), np.array([0.1, 0.3, 0.59, 0.7]))
    expected = [[0.0, 3.0, 6.0], [15.0, 20.0, 25.0], [30.0, 40.0, 50.0], [60.0, 70.0, 80.0]]
    np.testing.assert_allclose(found, expected)


def raised(ratio, block):
    """The least nominal shares whose quantiles of the other blocks hold as many as they should."""
    held = []
    for nominal in regions._NOMINAL:
        inside = 0
        for one in np.unique(block):
            inside += np.sum(ratio[block == one] <= conformal(ratio[block != one], nominal))
        held.append(inside / len(ratio))
    reached = np.maximum.accumulate(held)
    return [
        next((n for n, r in zip(regions._NOMINAL, reached, strict=True) if r >= level), 1.0)
        for level in LEVELS
    ]


@pytest.mark.parametrize("seed", range(4))
def test_levels_of_a_dozen_errors_are_raised_by_each_of_them(seed):
    given = errors(12, 4, seed)
    found = regions._raised(given.error_m, np.zeros(12, dtype=int), given.block, 1)
    np.testing.assert_allclose(found, raised(given.error_m, given.block))


def test_an_error_at_the_radius_is_within_it():
    """All are of 8 m."""
    assert coverage(Errors(np.full(6, 8.0), *np.zeros((2, 6)), np.arange(6) % 2)) == (1.0,) * 3


def test_levels_are_raised_until_left_out_blocks_are_covered():
    """By hand over all nominal shares; of fewer than three blocks they stay."""
    given = errors(300, 5, seed=3)
    given.error_m[given.block == 2] *= 2.5
    added_m = float(np.median(given.error_m))
    ratio = given.error_m / (given.spread_m + added_m)
    which = np.zeros(300, dtype=int)
    expected = raised(ratio, given.block)
    found = regions._raised(ratio, which, given.block, 1)
    np.testing.assert_allclose(found, expected)
    assert found[2] > 0.95
    np.testing.assert_array_equal(regions._raised(ratio, which, given.block % 2, 1), LEVELS)
    three = regions._raised(ratio, which, given.block % 3, 1)
    assert not np.array_equal(three, LEVELS)


def test_where_no_share_covers_left_out_blocks_all_errors_are_covered():
    """Errors of the third of three blocks are larger than all others'."""
    ratio, block = np.concatenate([np.ones(20), np.arange(2.0, 12.0)]), np.repeat([0, 1, 2], 10)
    found = regions._raised(ratio, np.zeros(30, dtype=int), block, 1)
    assert found[2] == 1.0
    assert found[0] == 0.3


def test_the_nominal_shares_hold_the_levels_themselves():
    shares = regions._NOMINAL
    assert np.isin(LEVELS, shares).all()
    assert (shares[0], shares[-1]) == (0.3, 1.0)
    assert np.diff(shares).max() < 0.0101
    assert np.all(np.diff(shares) > 0)
    # Hundredths, and thousandths from 0.98 on.
    shares = np.unique(shares.round(9))
    coarse, fine = shares[shares < 0.9801], shares[shares > 0.9799]
    np.testing.assert_allclose(coarse, np.arange(30, 99) / 100)
    np.testing.assert_allclose(fine, np.arange(980, 1001) / 1000)


def test_positions_without_any_error_have_radii_of_a_millimetre_at_least():
    none = np.zeros(6)
    found = calibrate(Errors(none, none, none, np.arange(6) % 2))
    assert found.added_m == 1e-3
    np.testing.assert_array_equal(found.factor, np.zeros((1, 3)))


def test_two_blocks_are_enough_for_a_coverage():
    """Each by the other's errors: ten of 1 to 10 m, and ten of a little more than twice as much."""
    short, long = np.arange(1.0, 11.0), 2.1 * np.arange(1.0, 11.0)
    block = np.repeat([4, 7], 10)
    given = Errors(np.concatenate([short, long]), np.zeros(20), np.zeros(20), block)
    held = [
        np.mean(
            [
                np.mean(own <= conformal(other, level))
                for own, other in ((short, long), (long, short))
            ]
        )
        for level in LEVELS
    ]
    assert coverage(given) == pytest.approx(tuple(held))
    one = given.where(block == 4)
    assert len(coverage(one)) == 3
    assert all(np.isnan(share) for share in coverage(one))


def test_some_errors_keep_their_columns():
    given = errors(20, 4)
    kept = given.mismatch > 0.5
    found = given.where(kept)
    assert len(found) == kept.sum()
    for name in ("error_m", "spread_m", "mismatch", "block"):
        np.testing.assert_array_equal(getattr(found, name), getattr(given, name)[kept])


def reports(block, places):
    return SimpleNamespace(block=np.array(block), places=np.array(places, dtype=float))


def test_logs_are_folds_and_more_than_ten_share_them():
    fold, by = folds_of(reports(np.repeat([3, 5, 9], 2), np.zeros((6, 2))))
    assert (fold.tolist(), by) == ([0, 0, 1, 1, 2, 2], "logs")
    fold, _ = folds_of(reports(np.arange(13), np.zeros((13, 2))))
    assert fold.tolist() == [*range(10), 0, 1, 2]
    # Of one log, and of none that is known, squares are left out.
    for block in ([4] * 6, [-1, -1, -1, 2, 2, 2]):
        assert folds_of(reports(block, np.arange(12.0).reshape(6, 2)))[1].startswith("squares")


@pytest.mark.parametrize(("spacing_m", "side_m"), [(5.0, 10.0), (0.1, 1.0), (40.0, 80.0)])
def test_squares_are_twice_as_wide_as_the_usual_spacing(spacing_m, side_m):
    """Places of one square are of one fold; neighbouring squares mostly are not."""
    row, col = np.mgrid[:30, :30]
    places = spacing_m * np.column_stack([col.ravel(), row.ravel()]) + spacing_m / 4
    fold, by = folds_of(reports([0] * 900, places))
    assert by == f"squares of {side_m:.3g} m"
    square = np.floor(places / side_m).astype(int)
    by_square = {}
    for one, where in zip(fold.tolist(), map(tuple, square.tolist()), strict=True):
        assert by_square.setdefault(where, one) == one
    assert set(fold.tolist()) <= set(range(10))
    beside = [
        by_square[x, y] == by_square[x + 1, y] for x, y in by_square if (x + 1, y) in by_square
    ]
    if len(by_square) > 50:
        assert len(set(fold.tolist())) == 10
        assert np.mean(beside) < 0.3
    # Equal places count once; a single one has squares of a metre.
    twice, _ = folds_of(reports([0] * 1800, np.vstack([places, places])))
    np.testing.assert_array_equal(twice[:900], fold)
    assert folds_of(reports([0] * 4, np.ones((4, 2))))[1] == "squares of 1 m"


def test_positions_are_those_of_reports_with_a_reading():
    """With serving cell, timing advance, and bounds where there are any."""
    asked = []

    def by(received):
        asked.append(received)
        return (1.0 * len(asked), 2.0, 3.0, 4.0)

    given = SimpleNamespace(
        serving=np.array([7, 8, 9]), timing_advance=np.array([1.0, np.nan, 3.0]),
        censored=np.array([0, 1, 0, 0], dtype=np.int8), first=np.array([0, 2, 2, 4]),
        readings=lambda one: ([np.array([1, 2]), np.array([]), np.array([3, 4])][one],
                              [np.array([-1.0, -2.0]), np.array([]), np.array([-3.0, -4.0])][one]),
    )  # fmt: skip
    positions, located = positions_of(by, given, [2, 1, 0])
    assert located.tolist() == [True, False, True]
    np.testing.assert_array_equal(positions, [[1.0, 2.0, 3.0, 4.0], [2.0, 2.0, 3.0, 4.0]])
    last, first = asked
    assert list(last)[2:] == [9, 3.0, None]
    assert (list(first)[2:4], list(first)[4].tolist()) == ([7, 1.0], [0, 1])
    assert (first[0].tolist(), first[1].tolist()) == ([1, 2], [-1.0, -2.0])
    nothing, none = positions_of(by, given, [])
    assert nothing.shape == (0, 4)
    assert none.size == 0
