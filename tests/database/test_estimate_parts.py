"""What an estimate is made of: which tiles are drawn, time, memory, and the size of parts."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from small_world import FLOOR_DBM

from mapfilter.database import estimate
from mapfilter.database.estimate import drawn_tiles, dry_run, peak_memory_bytes


def run(world, tile_px=8, **options):
    given = {"floor_dbm": FLOOR_DBM, "tile_px": tile_px, **options}
    return dry_run(world.rasters, world.plan, world.routes, **given)


@pytest.mark.parametrize("count", [1, 2, 15, 16])
def test_up_to_sixteen_tiles_stand_for_themselves(count):
    drawn, scale = drawn_tiles(np.random.default_rng(count).uniform(0, 9, count))
    assert drawn.tolist() == list(range(count))
    assert scale.tolist() == [1.0] * count


def test_of_more_tiles_sixteen_are_drawn_at_equal_steps_of_their_weight():
    """Of 32 alike every second one, each for two; of the heavy and the light by what they hold."""
    drawn, scale = drawn_tiles(np.full(32, 5.0))
    assert drawn.tolist() == list(range(0, 32, 2))
    np.testing.assert_allclose(scale, 2.0)
    # The first holds as much as 16 others together: it is drawn eight times, half a tile each.
    weight = np.array([1600.0, *[100.0] * 16])
    drawn, scale = drawn_tiles(weight)
    assert drawn.tolist().count(0) == 8
    assert len(drawn) == 16
    assert scale @ weight[drawn] == pytest.approx(weight.sum(), rel=0.01)


def test_tiles_without_weight_are_drawn_with_a_hundredth_of_the_mean():
    """Way or no way: what a drawn one of them holds counts for many, and is not left out."""
    weight = np.array([0.0] * 3200 + [3300.0] * 100)
    drawn, scale = drawn_tiles(weight)
    # 100 of 3300 hold all: the mean is 100, and 1 of it each for 3300 tiles is 1 % of the whole.
    assert (drawn >= 3200).all()
    np.testing.assert_allclose(scale, 333_300 / 3301 / 16)
    drawn, scale = drawn_tiles(np.array([1.0] * 10 + [0.0] * 1000))
    # There the mean is below one point, of which a hundredth is taken: 10.1 beside 10.
    assert (drawn < 10).sum() == 8
    np.testing.assert_allclose(scale[drawn >= 10], 20.1 / 0.01 / 16)
    drawn, scale = drawn_tiles(np.zeros(64))
    assert drawn.tolist() == list(range(1, 64, 4))
    np.testing.assert_allclose(scale, 4.0)


def test_tiles_are_read_once_more_than_they_are_drawn(world, monkeypatch):
    """The first one twice: what is opened and compiled for it is no part of a tile's time."""
    read, own = [], estimate.read_tile
    monkeypatch.setattr(estimate, "read_tile", lambda task: read.append(task.window) or own(task))
    few = run(world, tile_px=16)
    assert read[0] == read[1]
    assert len(set(read)) == len(read) - 1 <= 16
    read.clear()
    many = run(world, tile_px=5)
    assert len(read) == 17
    assert read[0] == read[1]
    assert many.points == few.points == len(world.routes)


def test_time_is_that_of_the_drawn_tiles_and_of_writing_them_for_all(world, monkeypatch):
    ticks = iter(range(10_000))
    monkeypatch.setattr(estimate, "time", SimpleNamespace(perf_counter=lambda: float(next(ticks))))
    read = []
    own = estimate.read_tile
    monkeypatch.setattr(estimate, "read_tile", lambda task: read.append(task) or own(task))
    # One second for each tile, and one for writing the rows of all.
    found = run(world, tile_px=16)
    assert found.seconds == len(read) - 1 + 1
    tiles = {(row // 5, col // 5) for row, col in np.argwhere(world.routes.mask())}
    found = run(world, tile_px=5)
    # Of many tiles 16 are timed: each of the others takes as long, and has as much to write.
    assert 0.7 * len(tiles) < found.seconds < 1.3 * (len(tiles) + len(tiles) / 16)
    assert found.seconds > 17


def test_memory_is_that_of_this_process_and_of_the_rows_that_wait(world, monkeypatch):
    monkeypatch.setattr(estimate, "peak_memory_bytes", lambda: 1_000_000)
    found = run(world, tile_px=16)
    each = (found.memory_bytes - 1_000_000) / found.levels
    # Two numbers of 8, and four of 4 bytes; and less than once more while they are joined.
    assert 24 <= each <= 48
    most, own = [], estimate._sample
    monkeypatch.setattr(estimate, "_sample", lambda *of: most.append(own(*of)) or most[-1])
    monkeypatch.setattr(estimate, "ROWS_IN_MEMORY", 70)
    few = run(world, tile_px=16)
    # They are written as soon as 70 wait: then those of one more tile are there at most.
    rows = 70 + max(tile.levels for tile in most)
    assert rows < found.levels
    assert few.memory_bytes == 1_000_000 + round(rows * each)


def test_where_nothing_is_received_nothing_is_written(world):
    found = run(world, floor_dbm=0.0)
    assert (found.levels, found.points) == (0, len(world.routes))
    assert 0 < found.bytes < run(world).bytes


STATUS = "Name:\tpython\nVmPeak:\t  900000 kB\nVmHWM:\t    2000 kB\nVmRSS:\t    1000 kB\n"


def test_the_peak_is_that_of_the_memory_that_is_held(monkeypatch):
    monkeypatch.setattr(Path, "read_text", lambda *_, **__: STATUS)
    assert peak_memory_bytes() == 2000 * 1024


@pytest.mark.parametrize("platform", ["linux", "darwin"])
def test_where_the_system_tells_it_otherwise(monkeypatch, platform):
    """Kibibytes, but bytes under macOS; a usual figure where nothing is known."""
    usage = SimpleNamespace(ru_maxrss=3000)
    module = SimpleNamespace(RUSAGE_SELF=0, getrusage=lambda _: usage)
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setitem(sys.modules, "resource", module)
    unknown = iter(["", OSError("no such file")])

    def read_text(*_, **__):
        text = next(unknown)
        if isinstance(text, OSError):
            raise text
        return text

    monkeypatch.setattr(Path, "read_text", read_text)
    for _ in range(2):
        assert peak_memory_bytes() == 3000 * (1 if platform == "darwin" else 1024)
    monkeypatch.setattr(Path, "read_text", lambda *_, **__: "")
    monkeypatch.setitem(sys.modules, "resource", None)
    assert 100e6 < peak_memory_bytes() < 500e6
