"""Tasks of a build: which tiles have any, how many tasks there are, and what is read again."""

from concurrent.futures import Executor
from dataclasses import replace

import numpy as np
import pytest
from small_world import CRS, FLOOR_DBM, LATTICE, contents, make_routes

from mapfilter._parallel import SerialExecutor
from mapfilter._resume import FinishedParts
from mapfilter.database import build_job
from mapfilter.database.build import build
from mapfilter.database.build_job import BuildJob
from mapfilter.database.tiles import tile_windows
from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.roads.lattice import RouteLattice


def job_of(world, routes, tile_px=8):
    return BuildJob.of(world.rasters, world.plan, routes, FLOOR_DBM, tile_px)


class Counted(Executor):
    """Runs tasks at once, and counts them."""

    def __init__(self):
        self.tasks = 0

    def submit(self, fn, /, *args, **kwargs):
        self.tasks += 1
        return SerialExecutor().submit(fn, *args, **kwargs)


WEST, _, _, NORTH = LATTICE.bounds_m


@pytest.mark.parametrize(
    "lattice",
    [
        LATTICE,
        Lattice(CRS, WEST + 25, NORTH - 10, 5.0, 30, 30),
        Lattice(CRS, WEST - 50, NORTH + 50, 5.0, 60, 70),
    ],
)
def test_tiles_are_those_that_hold_points(world, lattice):
    """Also where the roads cover another area than the rasters."""
    routes = make_routes(lattice)
    down = round((NORTH - lattice.north_m) / 5)
    right = round((lattice.west_m - WEST) / 5)
    held = set(zip((routes.row + down) // 8, (routes.col + right) // 8, strict=True))
    windows = job_of(world, routes).windows
    expected = [w for w in tile_windows(LATTICE, 8) if (w[0] // 8, w[1] // 8) in held]
    assert list(windows) == expected
    assert 0 < len(windows) < len(tile_windows(LATTICE, 8))


def test_roads_that_overlap_the_rasters_but_have_no_point_there(world):
    lattice = Lattice(CRS, WEST + 100, NORTH, 5.0, 40, 50)
    at = np.array([3, 9], np.int32), np.array([45, 46], np.int32)
    way = np.array([7, 7]), np.zeros(2, np.int16), ("path",)
    routes = RouteLattice(lattice, *at, *way, np.ones(2, np.float32), np.zeros(2, bool))
    with pytest.raises(InputError) as caught:
        job_of(world, routes)
    (fault,) = caught.value.faults
    assert (fault.where, fault.expected, fault.got, fault.hint) == (
        str(world.rasters.path), "points of the roads", "none", "files of different areas",
    )  # fmt: skip


@pytest.mark.parametrize("in_flight", [1, 4, 7])
def test_one_worker_gets_as_much_at_a_time_as_it_may(world, tmp_path, in_flight):
    """Four tasks are in flight for each worker: seven are those of one."""
    executor = Counted()
    options = {"tile_px": 8, "executor": executor, "in_flight": in_flight}
    build(world.rasters, world.plan, world.routes, tmp_path / "db", **options)
    assert executor.tasks == 1
    two = Counted()
    options |= {"executor": two, "in_flight": 8}
    build(world.rasters, world.plan, world.routes, tmp_path / "two", **options)
    assert two.tasks > 3


def interrupted(world, out):
    def stop(done, _):
        if done == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        again(world, out, progress=stop)


def again(world, out, **more):
    options = {"tile_px": 8, "pixels_a_task": 0, "in_flight": 1, **more}
    return build(world.rasters, world.plan, world.routes, out, **options)


def test_finished_tiles_are_not_read_again(world, tmp_path, monkeypatch):
    interrupted(world, tmp_path / "db")
    windows, read = job_of(world, world.routes).windows, []
    own = build_job.read_tiles

    def noted(tasks):
        read.extend(task.window for task in tasks)
        return own(tasks)

    monkeypatch.setattr(build_job, "read_tiles", noted)
    again(world, tmp_path / "db", resume=True)
    assert 0 < len(read) < len(windows)
    assert read == list(windows[-len(read) :])


def test_a_tile_that_vanishes_while_the_build_goes_on_is_made_again(world, tmp_path, monkeypatch):
    expected = contents(again(world, tmp_path / "whole").path)
    interrupted(world, tmp_path / "db")
    own, asked = FinishedParts.load, []

    def gone(self, number):
        asked.append(number)
        return None if asked.count(number) == 2 and number == 1 else own(self, number)

    monkeypatch.setattr(FinishedParts, "load", gone)
    assert contents(again(world, tmp_path / "db", resume=True).path) == expected
    assert asked.count(1) == 2


def test_points_beyond_the_rasters_are_counted(world, tmp_path):
    """Two of five lie on them, the others to the north, west and south-east."""
    lattice = Lattice(CRS, WEST - 50, NORTH + 50, 5.0, 60, 70)
    row, col = np.array([9, 20, 21, 22, 50], np.int32), np.array([30, 9, 30, 30, 60], np.int32)
    way = np.full(5, 7), np.zeros(5, np.int16), ("path",)
    routes = RouteLattice(lattice, row, col, *way, np.ones(5, np.float32), np.zeros(5, bool))
    built = build(world.rasters, world.plan, routes, tmp_path / "db", floor_dbm=-150.0)
    counts = built.manifest["counts"]
    assert (counts["points"], counts["points_off_rasters"]) == (2, 3)
    assert built.points().row.tolist() == [11, 12]
    assert job_of(world, routes).off_rasters(2) == 3
    # Of points that are laid tile by tile nobody knows how many there would be.
    by_tile = replace(job_of(world, routes), routes=object())
    assert by_tile.off_rasters(2) == 0
