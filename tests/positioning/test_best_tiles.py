"""Which tiles a search begins in, against brute force over made ranges of levels."""

from math import log
from threading import RLock
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.lattice import Lattice
from mapfilter.models.fingerprint import BoundReading
from mapfilter.models.level_errors import LevelErrors, LevelReport
from mapfilter.positioning.bayes.area import tile_search
from mapfilter.positioning.bayes.area.tile_parts import LevelRange
from mapfilter.positioning.bayes.area.tile_search import SearchedTiles, places_of, searched_tiles
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.gnss.fixes import FixTerm

ROWS, COLS, SIDE, PIXEL_M = 6, 7, 10, 5.0
LATTICE = Lattice("EPSG:32635", 0.0, PIXEL_M * 57, PIXEL_M, 57, 64)
"""The last row and column of tiles are narrower."""
ERRORS = LevelErrors(slow_db=3.0, fast_db=0.0, white_db=4.0, device_db=2.0, fault_probability=0.02)
SD_DB, FAULT = (3.0**2 + 4.0**2 + 2.0**2) ** 0.5, log(0.02)
CELLS = 5
NONE = np.zeros(0, dtype=np.int32)


def made_area(seed, search_tiles=6):
    """Cells of which each is received in some rectangle of tiles, and not in all of them."""
    rng = np.random.default_rng(seed)
    ranges = []
    for _ in range(CELLS):
        rows, cols = rng.integers(2, ROWS + 1), rng.integers(2, COLS + 1)
        row, col = rng.integers(0, ROWS - rows + 1), rng.integers(0, COLS - cols + 1)
        most = rng.uniform(-100, -50, (rows, cols)).astype(np.float32)
        least = most - rng.uniform(0, 15, (rows, cols)).astype(np.float32)
        gap = rng.random((rows, cols)) < 0.2
        least[gap], most[gap] = np.nan, np.nan
        ranges.append(LevelRange(int(row), int(col), least, most))

    def tile(number):
        row, col = divmod(number, COLS)
        own = np.arange(SIDE * row, min(SIDE * (row + 1), LATTICE.rows), 3)
        return SimpleNamespace(row=own, col=np.full(own.size, SIDE * col + 1))

    tiles = SimpleNamespace(
        rows=ROWS, cols=COLS, side=SIDE, lock=RLock(), range_of=ranges.__getitem__, tile=tile
    )
    count = ROWS * COLS
    return SimpleNamespace(lattice=LATTICE, tiles=tiles, count=count, search_tiles=search_tiles)


def range_at(area, cell, number):
    found = area.tiles.range_of(cell)
    row, col = number // COLS - found.row, number % COLS - found.col
    rows, cols = found.most_dbm.shape
    if not (0 <= row < rows and 0 <= col < cols) or np.isnan(found.most_dbm[row, col]):
        return None
    return float(found.least_dbm[row, col]), float(found.most_dbm[row, col])


def box_m(number):
    row, col = divmod(number, COLS)
    south = PIXEL_M * (LATTICE.rows - min(SIDE * (row + 1), LATTICE.rows))
    east = PIXEL_M * min(SIDE * (col + 1), LATTICE.cols)
    return PIXEL_M * SIDE * col, south, east, PIXEL_M * (LATTICE.rows - SIDE * row)


def expected_tiles(area, reported, fix=None, *, placed=True):
    """Tiles by the definition: one after the other, one row of the report after the other."""
    scored, near_count = [], 0
    for number in range(area.count):
        score, received, strongest = 0.0, 0, -np.inf
        for cells, level_dbm in reported:
            best, there = FAULT, False
            for cell in cells:
                known = range_at(area, cell, number)
                if known is None:
                    continue
                there, strongest = True, max(strongest, known[1])
                beside = max(level_dbm - known[1], known[0] - level_dbm, 0.0)
                best = max(best, -0.5 * ((0.0 if np.isnan(beside) else beside) / SD_DB) ** 2)
            score, received = score + best, received + there
        near = False
        if fix is not None:
            (x, y), sd_m = fix
            west, south, east, north = box_m(number)
            off = np.hypot(x - np.clip(x, west, east), y - np.clip(y, south, north)) / sd_m
            score += -0.5 * min(off, 5.0) ** 2
            near = bool(off < 3) and placed
        near_count += near
        if near or (2 * received >= len(reported) and received > 0):
            scored.append((near, score, strongest, number))
    near_first = 2 * near_count <= area.search_tiles
    scored.sort(key=lambda one: (-one[0] if near_first else 0, -one[1], -one[2]))
    return sorted(number for *_, number in scored[: area.search_tiles])


def numbers_of(searched):
    """The tiles of a search, by their boxes; none for a search everywhere."""
    if searched is None:
        return []
    boxes = {box_m(number): number for number in range(ROWS * COLS)}
    return [boxes[tuple(one)] for one in searched.boxes_m.tolist()]


def levels(cells, levels_dbm):
    return LevelReport(
        np.array(cells, dtype=np.int32),
        np.array(levels_dbm, dtype=np.float32),
        NONE,
        NONE.astype("f4"),
        0.0,
    )


@pytest.mark.parametrize("seed", range(6))
def test_reports_of_levels_are_searched_for_in_the_best_tiles(seed):
    """With a serving cell of its own, cells of two candidates, and bounds, which do not count."""
    area, rng = made_area(seed), np.random.default_rng(seed)
    levels_dbm = np.round(rng.uniform(-95, -60, 4))
    report = levels([0, 1], levels_dbm[:2])
    several = BoundReading(np.array([2, 3], dtype=np.int32), levels_dbm[2], 0, 8.0, 1.0)
    bound = BoundReading(np.array([4], dtype=np.int32), -70.0, -1, 8.0, 1.0)
    own = [([0], float(levels_dbm[0])), ([1], float(levels_dbm[1]))]
    two = ([2, 3], float(levels_dbm[2]))
    for reading, reported in (
        (RadioReading(0, 1.0, report), own),
        (RadioReading(-1, 0.0, report), own),
        (RadioReading(4, 1.0, report), [*own, ([4], np.nan)]),
        (RadioReading(0, 1.0, report, (several, bound)), [*own, two]),
        (RadioReading(4, 1.0, None, (several,)), [([4], np.nan), two]),
        (RadioReading(3, 1.0), [([3], np.nan)]),
        (RadioReading(0, 1.0, levels([1], levels_dbm[1:2])), [own[1], ([0], np.nan)]),
        (RadioReading(-1, 0.0, None, (several,)), [two]),
    ):
        found = searched_tiles(area, reading, ERRORS)
        assert numbers_of(found) == expected_tiles(area, reported)


def fix_term(place_m, sd_m):
    return FixTerm(GnssFix(*place_m, sd_m**2, sd_m**2, 0.0), (0.0, 0.0))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    ("place_m", "sd_m"),
    # Few tiles are near, more than half of a search, and more than it holds.
    [((152.0, 143.0), 4.0), ((152.0, 143.0), 20.0), ((152.0, 143.0), 45.0), ((-20.0, 300.0), 8.0)],
)
def test_tiles_near_a_fix_are_searched_whatever_is_received_there(seed, place_m, sd_m):
    area = made_area(seed)
    reading = RadioReading(0, 1.0, levels([0, 1], [-70.0, -85.0]), terms=(fix_term(place_m, sd_m),))
    reported = [([0], -70.0), ([1], -85.0)]
    found = searched_tiles(area, reading, ERRORS)
    assert numbers_of(found) == expected_tiles(area, reported, (place_m, sd_m))


class Narrow:
    """A term that is largest at a place, which it does not tell."""

    def __init__(self, place_m, sd_m):
        self._place_m, self._sd_m = place_m, sd_m

    def log_likelihood(self, state):
        off = np.hypot(state[0] - self._place_m[0], state[1] - self._place_m[1]) / self._sd_m
        return -0.5 * np.minimum(off, 5.0) ** 2


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("place_m", "sd_m"),
    [
        ((61.0, 243.0), 8.0),
        ((282.0, 38.0), 8.0),
        ((61.0, 243.0), 40.0),
        ((76.0, 260.0), 5.0),
        ((226.0, 111.0), 5.0),
    ],
)
def test_terms_without_a_place_are_compared_where_they_are_largest(seed, place_m, sd_m):
    """Nothing is searched for their sake alone."""
    area = made_area(seed)
    reading = RadioReading(0, 1.0, levels([0, 1], [-70.0, -85.0]), terms=(Narrow(place_m, sd_m),))
    reported = [([0], -70.0), ([1], -85.0)]
    found = searched_tiles(area, reading, ERRORS)
    assert numbers_of(found) == expected_tiles(area, reported, (place_m, sd_m), placed=False)
    assert searched_tiles(area, RadioReading(terms=reading.terms), ERRORS) is None


@pytest.mark.parametrize(("most", "kept"), [(3, [0, 1, 2]), (2, [0, 2]), (1, [0])])
def test_many_points_of_a_large_area_are_thinned(monkeypatch, most, kept):
    """Those at the first three pixels of the diagonal."""
    monkeypatch.setattr(tile_search, "_MOST_POINTS", most)
    area = made_area(1)
    area.tiles.every_point = lambda: np.array([0, 65, 130])
    found = tile_search.points_everywhere(area)
    middle = PIXEL_M * (np.array(kept) + 0.5)
    np.testing.assert_allclose(found, [middle, PIXEL_M * LATTICE.rows - middle])


def test_a_fix_alone_is_searched_for_where_it_is_narrow_enough():
    area = made_area(1)
    for sd_m, some in ((4.0, True), (20.0, False)):
        terms = (fix_term((152.0, 143.0), sd_m),)
        found = searched_tiles(area, RadioReading(terms=terms), ERRORS)
        assert (found is not None) == some
    (one,) = numbers_of(searched_tiles(
        area, RadioReading(terms=(fix_term((177.0, 177.0), 1.0),)), ERRORS
    ))  # fmt: skip
    west, south, east, north = box_m(one)
    assert west < 177.0 < east
    assert south < 177.0 < north


def test_points_and_boxes_are_those_of_the_tiles():
    area = made_area(2)
    found = searched_tiles(area, RadioReading(2, 1.0), ERRORS)
    chosen = numbers_of(found)
    tiles = [area.tiles.tile(number) for number in chosen]
    row, col = (np.concatenate([getattr(one, axis) for one in tiles]) for axis in ("row", "col"))
    places = {
        (PIXEL_M * (c + 0.5), PIXEL_M * (LATTICE.rows - r - 0.5))
        for r, c in zip(row.tolist(), col.tolist(), strict=True)
    }
    assert set(zip(*found.points.tolist(), strict=True)) == places
    assert found.points.dtype == np.float32
    # Row by row from the north, and from the west in each row.
    order = np.lexsort((found.points[0], -found.points[1]))
    np.testing.assert_array_equal(order, np.arange(row.size))


def test_small_areas_and_nothing_to_search_by():
    area = made_area(3, search_tiles=ROWS * COLS)
    assert searched_tiles(area, RadioReading(2, 1.0), ERRORS) is None
    area = made_area(3, search_tiles=ROWS * COLS - 1)
    assert searched_tiles(area, RadioReading(2, 1.0), ERRORS) is not None
    assert searched_tiles(area, None, ERRORS) is None
    assert searched_tiles(area, RadioReading(), ERRORS) is None


def test_places_of_pixels_are_in_row_major_order():
    found = places_of(SimpleNamespace(lattice=LATTICE), np.array([3, 0, 3]), np.array([1, 9, 0]))
    middle_m = PIXEL_M * (LATTICE.rows - 0.5)
    expected = [[47.5, 2.5, 7.5], [middle_m, middle_m - 15.0, middle_m - 15.0]]
    np.testing.assert_allclose(found, expected)


def test_places_beyond_an_area_lie_beside_tiles_at_its_edge():
    """In belts of the stated width, by their sizes; corners belong to none of them."""
    boxes_m = np.array([
        [0.0, 400.0, 100.0, 500.0], [900.0, 0.0, 1000.0, 100.0], [300.0, 300.0, 400.0, 400.0],
        [200.0, 700.0, 400.0, 800.0],
    ])  # fmt: skip
    searched = SearchedTiles(np.empty((2, 0), dtype=np.float32), boxes_m)
    x, y = searched.around((1000.0, 800.0), 50.0, 6000, np.random.default_rng(1))
    assert x.size == 6000
    west = (x <= 0) & (x >= -50) & (y >= 400) & (y <= 500)
    east = (x >= 1000) & (x <= 1050) & (y >= 0) & (y <= 100)
    south = (x >= 900) & (x <= 1000) & (y >= -50) & (y <= 0)
    north = (x >= 200) & (x <= 400) & (y >= 800) & (y <= 850)
    assert (west | east | south | north).all()
    for some, share in ((west, 0.2), (east, 0.2), (south, 0.2), (north, 0.4)):
        assert some.mean() == pytest.approx(share, abs=5 * (share * (1 - share) / 6000) ** 0.5)
    for axis, low, high in ((x[west], -50.0, 0.0), (x[east], 1000.0, 1050.0),
                            (y[south], -50.0, 0.0), (y[north], 800.0, 850.0)):  # fmt: skip
        assert (axis.min(), axis.max()) == pytest.approx((low, high), abs=0.5)
    assert x[north].std() == pytest.approx(200 / 12**0.5, rel=0.05)
    assert y[north].std() == pytest.approx(50 / 12**0.5, rel=0.05)


@pytest.mark.parametrize("drawn", [0.0, 0.25, 0.999999, 1.0])
def test_numbers_lead_to_places_in_the_tiles_in_turn(drawn):
    """A first number that leads across the tiles by their sizes, and a second to the north."""
    boxes_m = np.array([[0.0, 0.0, 10.0, 10.0], [20.0, 5.0, 50.0, 15.0]])
    searched = SearchedTiles(np.empty((2, 0), dtype=np.float32), boxes_m)
    found = searched.anywhere(np.array([[drawn, 0.3]]))[:, 0]
    along = 40.0 * drawn
    expected = (along, 3.0) if along < 10 else (20.0 + along - 10.0, 8.0)
    np.testing.assert_allclose(found, expected, rtol=1e-5)
