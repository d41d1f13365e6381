"""Tiles of a build in groups: by the pixels that they read of all cells."""

from types import SimpleNamespace

import numpy as np

from mapfilter.database.build_job import BuildJob
from mapfilter.database.tiles import grouped, tile_windows
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters

WHOLE = Lattice("EPSG:32632", 400_000.0, 5_600_000.0, 5.0, 64, 64)
TILE_PX = 8
QUARTERS = [(row, col, 32, 32) for row in (0, 32) for col in (0, 32)]
EVERYWHERE = (0, 0, 64, 64)


def tasks_of(folder, windows, tile_px=TILE_PX):
    """Return the tasks of an area with roads everywhere, and a cell for each window."""
    folder.mkdir()
    cells = []
    for number, window in enumerate(windows):
        cell, part = f"C{number}", WHOLE.window(*window)
        level = np.full((part.rows, part.cols), -80.0)
        write_rasters(folder / f"{cell}.tif", part, [(cell, level)], [cell])
        place = (WHOLE.west_m, WHOLE.north_m)
        cells.append(Cell(cell, "S", *place, 30.0, None, 50.0, 1800.0, antenna="omni"))
    routes = SimpleNamespace(lattice=WHOLE, part=lambda _: None)
    plan, windows = CellPlan(WHOLE.crs, tuple(cells)), tuple(tile_windows(WHOLE, tile_px))
    layers = tuple(10 * number for number in range(len(cells)))
    job = BuildJob(open_rasters(folder), plan, routes, -110.0, windows, layers)
    return [job.task(number) for number in range(len(windows))]


def sizes(tasks, max_pixels):
    return [len(group) for group in grouped(tasks, max_pixels)]


def test_groups_hold_all_tiles_in_order(tmp_path):
    tasks = tasks_of(tmp_path / "area", [EVERYWHERE])
    groups = list(grouped(tasks, 10 * TILE_PX**2))
    assert [task for group in groups for task in group] == tasks
    assert [len(group) for group in groups] == [10] * 6 + [4]


def test_cells_elsewhere_do_not_make_groups_smaller(tmp_path):
    """A tile within a quarter of the area is reached by one cell of four."""
    apart = tasks_of(tmp_path / "apart", QUARTERS)
    inside = [task for task in apart if not {24, 32} & set(task.window[:2])]
    assert {task.pixels for task in inside} == {TILE_PX**2}
    # The layers of its cells are those of the whole plan.
    assert {(task.numbers, task.layers) for task in inside} == {
        ((number,), (10 * number,)) for number in range(4)
    }


def test_a_town_gets_groups_of_its_own(tmp_path):
    """Eight cells more at a corner: 9 of 64 tiles read nine times as much, by mean 2.1 times."""
    tile, most = TILE_PX**2, 10 * TILE_PX**2
    tasks = tasks_of(tmp_path / "town", [EVERYWHERE, *[(0, 0, 16, 16)] * 8])
    town = [task for task in tasks if len(task.numbers) == 9]
    assert len(town) == 9
    assert {task.pixels for task in tasks} == {tile, 9 * tile}
    groups = list(grouped(tasks, most))
    held = [sum(task.pixels for task in group) for group in groups]
    assert max(held) <= most
    # No group could have held the first tile of the next one, too.
    for pixels, after in zip(held, groups[1:], strict=False):
        assert pixels + after[0].pixels > most
    assert max(map(len, groups)) == 10


def test_a_tile_at_the_edge_counts_its_own_pixels(tmp_path):
    tasks = tasks_of(tmp_path / "edge", [EVERYWHERE], tile_px=48)
    assert sorted(task.pixels for task in tasks) == [16 * 16, 16 * 48, 16 * 48, 48 * 48]


def test_groups_hold_a_tile_at_least_and_not_too_many(tmp_path):
    tasks = tasks_of(tmp_path / "one", [EVERYWHERE])
    assert sizes(tasks, 0) == sizes(tasks, 1) == [1] * 64
    assert sizes([*tasks, *tasks], 10**9) == [64, 64]
    assert sizes([], 10) == []


def test_tiles_that_no_cell_reaches_count_as_one_cell(tmp_path):
    tasks = tasks_of(tmp_path / "corners", [(0, 0, 8, 8), (56, 56, 8, 8)])
    assert {task.numbers for task in tasks} == {(0,), (), (1,)}
    assert sizes(tasks, 10 * TILE_PX**2) == [10] * 6 + [4]


def test_groups_are_made_when_they_are_due(tmp_path):
    tasks = iter(tasks_of(tmp_path / "due", [EVERYWHERE]))
    assert len(next(grouped(tasks, 3 * TILE_PX**2))) == 3
    assert sum(1 for _ in tasks) == 64 - 4


def test_the_last_groups_are_small_so_that_workers_end_together(tmp_path):
    tasks = tasks_of(tmp_path / "area", [EVERYWHERE])
    groups = list(grouped(tasks, 10 * TILE_PX**2, total=len(tasks), shares=4))
    assert [task for group in groups for task in group] == tasks
    assert [len(group) for group in groups] == [10, 10, 10, 9, 7, 5, 4, 3, 2, 1, 1, 1, 1]


def test_of_one_worker_the_last_groups_are_as_large_as_all(tmp_path):
    tasks = tasks_of(tmp_path / "area", [EVERYWHERE])
    for options in ({}, {"total": 64}, {"total": 64, "shares": 1}):
        assert [len(group) for group in grouped(tasks, 10**9, **options)] == [64]
    halves = [len(group) for group in grouped(tasks, 10**9, total=64, shares=2)]
    assert halves == [32, 16, 8, 4, 2, 1, 1]
