"""What is held of an area's tiles takes the bytes of its arrays, and of no others."""

import numpy as np
import pytest

from mapfilter.database.cell_levels import CellLevels, NearestPoints
from mapfilter.positioning.bayes.area.bounded_cache import BoundedCache
from mapfilter.positioning.bayes.area.tile_parts import Reaching, Tile


def test_bytes_of_levels():
    assert CellLevels(np.zeros(10, np.int32), np.zeros(10, np.float32)).nbytes == 80


def test_bytes_of_a_tile_are_those_of_all_its_arrays():
    points = NearestPoints(
        (0, 0, 2, 3), np.zeros((2, 3), np.int32), np.zeros(5, np.int64), np.zeros(5, np.int64),
        np.zeros(5, np.float32), np.zeros(5, np.float32), np.zeros((2, 3), np.float32),
    )  # fmt: skip
    tile = Tile(points, np.zeros(4, np.int64), np.zeros(4, np.int64), (0, 1, 0, 1))
    assert tile.nbytes == 24 + 40 + 40 + 20 + 20 + 24 + 32 + 32


def test_bytes_of_what_reaches_a_tile():
    parts = np.zeros(3, np.int64), np.zeros(1, np.int64)
    found = Reaching(np.zeros(2, np.int64), np.zeros(2), np.zeros(2, np.bool_), parts)
    assert found.nbytes == 16 + 16 + 2 + 24 + 8


def test_what_was_asked_for_longest_ago_is_given_up():
    """Each entry takes 300 bytes besides its value."""
    cache, made = BoundedCache(3 * 400), []

    def get(key, size=100):
        return cache.get(key, lambda: made.append(key) or np.full(size, ord(key), np.uint8))

    assert [get(key)[0] for key in "abc"] == [ord("a"), ord("b"), ord("c")]
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
    assert get("f")[0] == ord("f")
    assert cache.bytes == 400


def test_that_there_is_nothing_is_held_too():
    cache, made = BoundedCache(1000), []
    assert [cache.get("a", lambda: made.append("a")) for _ in range(2)] == [None, None]
    assert (made, cache.bytes) == (["a"], 300)


@pytest.mark.parametrize("count", [0, 1, 7])
def test_without_room_the_last_value_is_held_all_the_same(count):
    cache = BoundedCache(0)
    for key in range(count):
        cache.get(key, lambda: np.zeros(10, np.uint8))
    assert cache.bytes == (310 if count else 0)
