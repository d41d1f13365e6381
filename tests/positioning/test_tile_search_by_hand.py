"""Which tiles a search begins in, in areas of a few tiles whose order is plain."""

from threading import RLock
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.positioning.bayes.area.tile_search import (
    SearchedTiles,
    _at_places,
    _gains_of_terms,
    _peak_m,
    points_everywhere,
    searched_tiles,
)

NONE = np.empty((2, 0), dtype=np.float32)
ERRORS = SimpleNamespace(total_db=3.0, device_db=4.0, fault_probability=0.02)
"""Five dB together; a fault costs 3.9 nats."""


def line_of(tiles, search_tiles, ranges=()):
    """Tiles of 10 x 10 pixels of 5 m side by side, and each cell's least and most level in them."""
    lattice = SimpleNamespace(resolution_m=5.0, rows=10, cols=10 * tiles)

    def range_of(cell):
        least_dbm, most_dbm = (np.array([row], dtype=float) for row in ranges[cell])
        return 0, 0, least_dbm, most_dbm

    def tile(number):
        return SimpleNamespace(row=np.array([3]), col=np.array([10 * number + 4]))

    held = SimpleNamespace(
        rows=1, cols=tiles, side=10, lock=RLock(), range_of=range_of, tile=tile
    )  # fmt: skip
    return SimpleNamespace(lattice=lattice, tiles=held, count=tiles, search_tiles=search_tiles)


def heard(*levels_dbm, serving=-1, terms=()):
    """Levels of the first cells."""
    levels = None
    if levels_dbm:
        levels = SimpleNamespace(cell=np.arange(len(levels_dbm)), level_dbm=np.array(levels_dbm))
    return SimpleNamespace(serving=serving, levels=levels, bounds=(), terms=terms)


class Steps:
    """A term with a value for each 50 m to the east, of a fix where it has a place."""

    def __init__(self, *nats):
        self._nats = np.array(nats)

    def log_likelihood(self, state):
        return self._nats[np.minimum((state[0] / 50.0).astype(int), self._nats.size - 1)]


class Fix(Steps):
    """The same with the place of a fix, in its first 50 m."""

    place_m = (10.0, 20.0)


def numbers_of(found):
    return (found.boxes_m[:, 0] / 50.0).tolist()


def same(dbm, tiles=3):
    return [dbm] * tiles


def test_levels_that_are_far_off_count_as_a_millionth_where_faults_are_impossible():
    """13.5 nats off are better than not received, whose cell is louder."""
    beside_db = 5.0 * (2 * 13.5) ** 0.5
    ranges = [
        ([-90.0 - beside_db, np.nan], [-80.0 - beside_db, np.nan]),
        ([-90.0, -90.0], [-60.0, -50.0]),
    ]
    area = line_of(2, 1, ranges)
    sure = SimpleNamespace(total_db=3.0, device_db=4.0, fault_probability=0.0)
    assert numbers_of(searched_tiles(area, heard(-80.0, -70.0), sure)) == [0.0]
    # With faults in two of a hundred cells both are alike, and the louder one is first.
    assert numbers_of(searched_tiles(area, heard(-80.0, -70.0), ERRORS)) == [1.0]


@pytest.mark.parametrize(("search_tiles", "first"), [(1, 1.0), (2, 0.0), (3, 0.0)])
def test_tiles_near_a_fix_are_first_where_they_are_at_most_half_of_the_search(search_tiles, first):
    """The nearest tile receives nothing of what is heard."""
    nothing = ([np.nan, *same(-90.0)], [np.nan, *same(-60.0)])
    area = line_of(4, search_tiles, [nothing, nothing])
    reading = heard(-70.0, -70.0, terms=(Fix(-4.4, -4.6, -4.7, -4.8),))
    found = numbers_of(searched_tiles(area, reading, ERRORS))
    assert found[0] == first
    assert len(found) == search_tiles


def test_tiles_near_a_fix_are_as_others_where_they_are_more_than_half_of_the_search():
    nothing = ([np.nan, np.nan, *same(-90.0)], [np.nan, np.nan, *same(-60.0)])
    area = line_of(5, 3, [nothing, nothing])
    reading = heard(-70.0, -70.0, terms=(Fix(-4.3, -4.4, -4.6, -4.7, -4.8),))
    assert numbers_of(searched_tiles(area, reading, ERRORS)) == [2.0, 3.0, 4.0]


@pytest.mark.parametrize(
    ("nats", "numbers"),
    [((-4.4, -4.4, -4.6), [0.0, 1.0]), ((-4.5, -4.4, -4.6), [1.0]), ((-4.4, -4.4, -4.4), None)],
)
def test_by_a_fix_alone_the_tiles_within_four_and_a_half_nats_are_searched(nats, numbers):
    """As many as a search has; of more, everywhere."""
    found = searched_tiles(line_of(3, 2), heard(terms=(Fix(*nats),)), ERRORS)
    assert (found if found is None else numbers_of(found)) == numbers


def test_gains_of_terms_are_added_up_and_only_fixes_are_near():
    area = line_of(3, 2)
    gain, near = _gains_of_terms(area, (Steps(-1.0, -2.0, -3.0), Fix(-9.0, -4.0, -0.5)))
    assert gain.tolist() == [-10.0, -6.0, -3.5]
    assert near.tolist() == [False, True, True]
    gain, near = _gains_of_terms(area, ())
    assert (gain.tolist(), near.tolist()) == ([0.0] * 3, [False] * 3)


class Hill:
    """A narrow term whose places are noted."""

    def __init__(self, place_m, sd_m):
        self._place_m, self._sd_m, self.asked = place_m, sd_m, []

    def log_likelihood(self, state):
        self.asked.append(state[:2].copy())
        return -((state[0] - self._place_m[0]) ** 2 + (state[1] - self._place_m[1]) ** 2) / (
            2 * self._sd_m**2
        )


def test_terms_are_compared_at_sixteen_places_of_a_tile_and_where_they_are_largest():
    hill = Hill((60.0, 33.0), 2.0)
    gain, near = _gains_of_terms(line_of(2, 1), (hill,))
    along = [6.25, 18.75, 31.25, 43.75]
    first = {(x + west, y) for west in (0.0, 50.0) for x in along for y in along}
    assert set(zip(*hill.asked[0].tolist(), strict=True)) == first
    # Ever closer about the best: to both sides by the spacing of 12.5 m and quarters of it.
    widths = [float(np.ptp(one[0])) for one in hill.asked[1:5]]
    np.testing.assert_allclose(widths, [25.0, 6.25, 1.5625, 0.390625], rtol=1e-4)
    assert [one.shape[1] for one in hill.asked] == [32, 81, 81, 81, 81, 34]
    # The tile that does not hold it has it at the nearest place: 10 m, or 5 deviations, off.
    assert gain == pytest.approx([-12.5, 0.0], abs=0.1)
    assert not near.any()


def test_the_peak_is_found_from_the_best_of_some_places():
    hill = Hill((17.3, 41.7), 3.0)
    x_m, y_m = np.array([0.0, 20.0, 40.0]), np.array([0.0, 40.0, 40.0])
    assert _peak_m(hill, x_m, y_m, 8.0) == pytest.approx((17.3, 41.7), abs=0.02)
    # Nine places along each axis, both ends among them.
    east_m = np.unique(hill.asked[1][0])
    np.testing.assert_allclose(east_m, 12.0 + 2.0 * np.arange(9))
    np.testing.assert_allclose(np.unique(hill.asked[1][1]), 32.0 + 2.0 * np.arange(9))


def test_of_places_that_are_alike_the_south_western_one_is_taken():
    flat = SimpleNamespace(log_likelihood=lambda _: np.array([-2.5]))
    found = _peak_m(flat, np.array([20.0, 50.0]), np.array([40.0, 10.0]), 8.0)
    assert found == (20.0 - 8.0 - 2.0 - 0.5 - 0.125, 40.0 - 10.625)


def test_a_term_with_one_value_has_it_everywhere():
    one = SimpleNamespace(log_likelihood=lambda _: np.array([-2.5]))
    assert _at_places(one, np.arange(3.0), np.zeros(3)).tolist() == [-2.5] * 3
    seen = []
    other = SimpleNamespace(log_likelihood=lambda state: seen.append(state.copy()) or state[0])
    assert _at_places(other, np.array([1.0, 2.0]), np.array([5.0, 6.0])).tolist() == [1.0, 2.0]
    assert seen[0][:2].tolist() == [[1.0, 2.0], [5.0, 6.0]]
    assert not seen[0][2:].any()


def test_an_area_of_as_many_tiles_as_a_search_is_read_tile_by_tile():
    area = line_of(2, 2)
    assert points_everywhere(area).tolist() == [[22.5, 72.5], [32.5, 32.5]]
    assert searched_tiles(area, heard(-70.0), ERRORS) is None


@pytest.mark.parametrize(("count", "kept"), [(1_000_000, 1_000_000), (1_000_001, 500_001)])
def test_at_most_a_million_points_are_weighed_where_nothing_is_known(count, kept):
    area = line_of(2, 1)
    area.tiles.every_point = lambda: np.arange(count)
    assert points_everywhere(area).shape == (2, kept)


def belts(*boxes_m):
    return SearchedTiles(NONE, np.array(boxes_m, dtype=float))


@pytest.mark.parametrize(
    ("box_m", "belt_m"),
    [
        ((0.0, 40.0, 20.0, 60.0), (-30.0, 40.0, 0.0, 60.0)),
        ((80.0, 40.0, 100.0, 60.0), (100.0, 40.0, 130.0, 60.0)),
        ((40.0, 0.0, 60.0, 20.0), (40.0, -30.0, 60.0, 0.0)),
        ((40.0, 180.0, 60.0, 200.0), (40.0, 200.0, 60.0, 230.0)),
    ],
)
def test_places_beyond_the_area_are_those_anywhere_in_the_belt_beside_a_tile(box_m, belt_m):
    found = belts(box_m).around((100.0, 200.0), 30.0, 7, np.random.default_rng(5))
    expected = belts(belt_m).anywhere(np.random.default_rng(5).random((7, 2)))
    np.testing.assert_array_equal(found, expected)
    inside = [(0.5, 40.0, 20.0, 60.0), (80.0, 40.0, 99.5, 60.0), (40.0, 0.5, 60.0, 20.0),
              (40.0, 180.0, 60.0, 199.5)]  # fmt: skip
    none = belts(*inside).around((100.0, 200.0), 30.0, 7, np.random.default_rng(5))
    assert (none.shape, none.dtype) == ((2, 0), np.float32)


def test_half_of_the_cells_of_a_report_are_enough():
    """Tiles with one of two, and of one; none with one of three."""
    nan = np.nan
    first = ([-90.0, -90.0, nan], [-60.0, -60.0, nan])
    second = ([-90.0, nan, nan], [-60.0, nan, nan])
    area = line_of(3, 2, [first, second, second])
    assert numbers_of(searched_tiles(area, heard(-70.0, -70.0), ERRORS)) == [0.0, 1.0]
    assert numbers_of(searched_tiles(area, heard(-70.0, -70.0, -70.0), ERRORS)) == [0.0]
