"""Reports of a fold that are located by the others, of ways whose errors are known."""

import numpy as np
import pytest
from made_fingerprints import reports_at

from mapfilter.errors import InputError
from mapfilter.positioning.fingerprints import cross_validation
from mapfilter.positioning.fingerprints.cross_validation import (
    cross_validate,
    drawn_errors,
    folds_of,
    left_out,
    positions_of,
    validation_of,
)
from mapfilter.positioning.fingerprints.options import Neighbours
from mapfilter.positioning.fingerprints.regions import Errors
from mapfilter.positioning.fingerprints.reports import make_reports

NEAREST, COUNT = Neighbours(k=1), 60
ALONG_M = np.arange(float(COUNT))
LEVEL_DBM = np.stack([-40.0 - ALONG_M, -100.0 + ALONG_M, -60.0 - 0.3 * ALONG_M], axis=1)
OFF_M = 3.0 + 0.01 * ALONG_M
"""How far the second way lies to the east of the first, on which the same is received."""


def way(east_m, log):
    places = np.column_stack([east_m + 0.0 * ALONG_M, ALONG_M])
    return places, LEVEL_DBM + 0.1 * log, np.full(COUNT, log)


def database():
    parts = zip(way(0.0, 0), way(OFF_M, 1), strict=True)
    places, level_dbm, block = (np.concatenate(two) for two in parts)
    return reports_at(places, level_dbm, names=("a", "b", "c"), block=block)


LOGS = np.repeat([0, 1], COUNT)


def test_each_log_is_located_by_the_other():
    done = []
    tried = np.array([2, 5, 61, 70, 119])
    one, two = left_out(database(), NEAREST, LOGS, tried, lambda *given: done.append(given))
    assert (one.fold, two.fold) == (0, 1)
    np.testing.assert_allclose(one.off_m, [[3.02, 0.0], [3.05, 0.0]])
    np.testing.assert_allclose(two.off_m, [[-3.01, 0.0], [-3.1, 0.0], [-3.59, 0.0]])
    np.testing.assert_allclose(one.reports.places, [[0.0, 2.0], [0.0, 5.0]])
    assert done == [(1, 2), (2, 2)]


def test_a_fold_without_reports_to_be_located_is_none():
    only = list(left_out(database(), NEAREST, LOGS, np.array([3])))
    assert [one.fold for one in only] == [0]
    assert list(left_out(database(), NEAREST, np.zeros(120, dtype=int), np.arange(120))) == []


def test_a_fold_whose_others_locate_nothing_is_none(monkeypatch):
    made = cross_validation.locator

    def locator(method, rest):
        if rest.block[0] == 1:
            raise InputError("nothing")
        return made(method, rest)

    monkeypatch.setattr(cross_validation, "locator", locator)
    assert [one.fold for one in left_out(database(), NEAREST, LOGS, np.arange(120))] == [1]


def test_errors_of_cross_validation_are_of_evenly_taken_reports():
    """Of 120 the first, the 30th, 60th, 90th and the last."""
    found = cross_validate(database(), NEAREST, LOGS, most=5)
    np.testing.assert_allclose(found.error_m, [3.0, 3.29, 3.59, 3.29, 3.59])
    assert found.block.tolist() == [0, 0, 0, 1, 1]
    every = list(left_out(database(), NEAREST, LOGS, np.array([0, 29, 59, 89, 119])))
    positions = np.concatenate([one.positions for one in every])
    np.testing.assert_array_equal(found.spread_m, positions[:, 2])
    np.testing.assert_array_equal(found.mismatch, positions[:, 3])
    assert np.any(found.spread_m != found.mismatch)
    assert len(cross_validate(database(), NEAREST, LOGS)) == 120
    assert len(cross_validate(database(), NEAREST, np.zeros(120, dtype=int))) == 0


def test_two_thousand_reports_are_enough(monkeypatch):
    asked = []
    monkeypatch.setattr(cross_validation, "left_out", lambda *given: asked.append(given[3]) or ())
    cross_validate(at(np.zeros((3000, 2))), NEAREST, np.zeros(3000, dtype=int))
    (tried,) = asked
    assert (len(tried), tried[0], tried[-1]) == (2000, 0, 2999)


def test_errors_of_drawn_reports_are_of_ten_blocks_in_turn():
    parts = database()
    first, second = parts.some(LOGS == 0), parts.some(LOGS == 1)
    found = drawn_errors(first, NEAREST, second)
    np.testing.assert_allclose(found.error_m, OFF_M)
    assert found.block.tolist() == list(range(10)) * 6
    (own,) = left_out(parts, NEAREST, LOGS, np.arange(60, 120))
    np.testing.assert_array_equal(found.spread_m, own.positions[:, 2])
    np.testing.assert_array_equal(found.mismatch, own.positions[:, 3])


def at(places, block=None):
    count = len(places)
    return make_reports("EPSG:32635", [], [], [], count=count, places=places, block=block)


def test_two_logs_are_folds_and_more_than_ten_share_them():
    places = np.zeros((12, 2))
    fold, blocks = folds_of(at(places, np.arange(12) + 5))
    assert (fold.tolist(), blocks) == ([*range(10), 0, 1], "logs")
    fold, blocks = folds_of(at(places[:3], [4, 9, 4]))
    assert (fold.tolist(), blocks) == ([0, 1, 0], "logs")
    # Reports of no log belong to none.
    assert folds_of(at(places[:3], [-1, 9, 4]))[1] == "squares of 1 m"


@pytest.mark.parametrize(
    ("places", "side"), [([[0.0, 0.0], [0.0, 4.0]], "8"), ([[0.0, 0.0], [0.1, 0.0]], "1"),
                         ([[0.0, 0.0], [0.0, 0.0]], "1"), ([[0, 0], [3, 0], [6, 0], [20, 0]], "6")],
)  # fmt: skip
def test_squares_are_twice_as_wide_as_places_are_apart(places, side):
    assert folds_of(at(np.array(places, dtype=float)))[1] == f"squares of {side} m"


def test_squares_are_in_folds_without_a_pattern_and_always_in_the_same():
    """Places on a lattice of 4 m: squares of 8 m from whole multiples of that hold four each."""
    east, north = np.meshgrid(4.0 * np.arange(40), 4.0 * np.arange(-20, 20), indexing="ij")
    fold, _ = folds_of(at(np.column_stack([east.ravel(), north.ravel()])))
    squares = fold.reshape(20, 2, 20, 2)
    assert np.ptp(squares, axis=(1, 3)).max() == 0
    of_square = squares[:, 0, :, 0]
    counts = np.bincount(of_square.ravel(), minlength=10)
    assert counts.min() > 20
    for axis in (0, 1):
        assert np.mean(np.diff(of_square, axis=axis) == 0) < 0.2
    # Figures that were measured with them can be measured again.
    assert of_square[:3, 9:13].tolist() == [[4, 0, 3, 6], [1, 3, 4, 7], [4, 6, 3, 8]]


def test_what_a_method_is_given_of_a_report():
    """A report without readings has no position."""
    given = make_reports(
        "EPSG:32635", [0, 0, 2, 3], list("abab"), [-60.0, -70.0, -80.0, -90.0], count=4,
        serving=["b", "", "", "a"], timing_advance=[4.0, np.nan, np.nan, 7.0],
        censored=[0, 0, -1, 0],
    )  # fmt: skip
    asked = []

    def by(received):
        asked.append(received)
        return received.cell[0], 2.0, 3.0, 4.0

    found, located = positions_of(by, given, [3, 2, 1, 0])
    assert located.tolist() == [True, True, False, True]
    assert found.tolist() == [[1.0, 2.0, 3.0, 4.0], [0.0, 2.0, 3.0, 4.0], [0.0, 2.0, 3.0, 4.0]]
    assert [(one.cell.tolist(), one.level_dbm.tolist(), one.serving) for one in asked] == [
        ([1], [-90.0], 0), ([0], [-80.0], -1), ([0, 1], [-60.0, -70.0], 1),
    ]  # fmt: skip
    assert [one.timing_advance for one in asked][::2] == [7.0, 4.0]
    assert [one.censored if one.censored is None else one.censored.tolist() for one in asked] == [
        None, [-1], None,
    ]  # fmt: skip
    none, _ = positions_of(by, given, [1])
    assert none.shape == (0, 4)


def test_the_figures_of_errors():
    error_m = np.array([1.0, 2.0, 3.0, 10.0])
    errors = Errors(error_m, np.ones(4), np.zeros(4), np.array([0, 0, 4, 4]))
    found = validation_of(NEAREST, errors, "squares of 8 m")
    assert (found.blocks, found.folds, found.reports) == ("squares of 8 m", 2, 4)
    assert (found.error_mean_m, found.error_median_m) == (4.0, 2.5)
    assert found.error_95_m == pytest.approx(3.0 + 0.85 * 7.0)
