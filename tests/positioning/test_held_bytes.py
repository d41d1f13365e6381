"""What is held of an area's tiles takes the bytes of its arrays, and of no others."""

import numpy as np
import pytest

from mapfilter.database.cell_levels import CellLevels, NearestPoints
from mapfilter.positioning.bayes import area_tiles
from mapfilter.positioning.bayes.bounded_cache import BoundedCache


def test_bytes_of_levels_and_arrays():
    cell = CellLevels(np.zeros(10, np.int32), np.zeros(10, np.float32))
    assert area_tiles._cell_bytes(cell) == 80
    assert area_tiles._array_bytes(np.zeros((4, 5), np.uint8)) == 20
    assert area_tiles._array_bytes(None) == 0


def test_bytes_of_a_tile_are_those_of_all_its_arrays():
    points = NearestPoints(
        (0, 0, 2, 3), np.zeros((2, 3), np.int32), np.zeros(5, np.int64), np.zeros(5, np.int64),
        np.zeros(5, np.float32), np.zeros(5, np.float32), np.zeros((2, 3), np.float32),
    )  # fmt: skip
    tile = area_tiles.Tile(points, np.zeros(4, np.int64), np.zeros(4, np.int64), (0, 1, 0, 1))
    assert area_tiles._tile_bytes(tile) == 24 + 40 + 40 + 20 + 20 + 24 + 32 + 32


def test_bytes_of_what_reaches_a_tile():
    parts = np.zeros(3, np.int64), np.zeros(1, np.int64)
    found = area_tiles._Reaching(np.zeros(2, np.int64), np.zeros(2), np.zeros(2, np.bool_), parts)
    assert area_tiles._reaching_bytes(found) == 16 + 16 + 2 + 24 + 8


def test_what_was_asked_for_longest_ago_is_given_up():
    """Each entry takes 300 bytes besides its value."""
    cache, made = BoundedCache(3 * 400), []

    def get(key, size=100):
        return cache.get(key, lambda: made.append(key) or key.upper(), lambda _: size)

    assert [get(key) for key in "abc"] == ["A", "B", "C"]
    assert cache.bytes == 1200
    get("a")
    get("d")
    assert (made, cache.bytes) == ([*"abcd"], 1200)
    get("a")
    get("b")
    assert made == [*"abcdb"]
    # One that is larger than all of it is held alone.
    get("e", 5000)
    assert cache.bytes == 5300
    get("e")
    assert made == [*"abcdbe"]
    assert get("f") == "F"
    assert cache.bytes == 400


@pytest.mark.parametrize("count", [0, 1, 7])
def test_without_room_the_last_value_is_held_all_the_same(count):
    cache = BoundedCache(0)
    for key in range(count):
        cache.get(key, lambda: 1, lambda _: 10)
    assert cache.bytes == (310 if count else 0)
