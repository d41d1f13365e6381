"""Builds that are cut short, go on, run on a cluster, and lay their points in the workers."""

import multiprocessing
import pickle
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event

import numpy as np
import pytest
import shapely
from counting import Counting
from killed_worker import KillsOneWorker
from small_world import CRS, FLOOR_DBM, IDS, LATTICE, contents, make_plan, make_routes

from mapfilter._cluster import cluster_executor
from mapfilter._parallel import local_executor
from mapfilter.database import store
from mapfilter.database.build import build
from mapfilter.database.estimate import dry_run
from mapfilter.database.sources import LayerRoutes
from mapfilter.database.store import info, open_database
from mapfilter.errors import InputError, MapfilterError
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.roads.route_points import RouteSource, route_lattice
from mapfilter.roads.ways import Buildings, Squares, Water, Ways

OPTIONS = {"floor_dbm": FLOOR_DBM, "tile_px": 8}
TILE_PIXELS = 8 * 8 * len(IDS)


@pytest.fixture(scope="module")
def whole(world, tmp_path_factory):
    out = tmp_path_factory.mktemp("whole") / "db"
    return contents(build(world.rasters, world.plan, world.routes, out, **OPTIONS).path)


def again(world, out, **more):
    # A tile a task, so that counting tasks counts tiles.
    given = {**OPTIONS, "pixels_a_task": 0, **more}
    return build(world.rasters, world.plan, world.routes, out, **given)


def interrupted(world, out, after):
    with pytest.raises(KeyboardInterrupt):
        again(world, out, executor=Counting(after), in_flight=1)


def test_a_build_goes_on_where_it_stopped_and_gives_the_same_bytes(world, whole, tmp_path):
    out = tmp_path / "db"
    everything = Counting()
    again(world, tmp_path / "other", executor=everything)
    assert everything.tasks > 6
    interrupted(world, out, 4)
    assert not out.exists()
    rest = Counting()
    assert contents(again(world, out, executor=rest, resume=True).path) == whole
    assert rest.tasks == everything.tasks - 4
    assert sorted(p.name for p in tmp_path.iterdir()) == ["db", "other"]


def test_without_resume_a_build_starts_anew(world, whole, tmp_path):
    interrupted(world, tmp_path / "db", 4)
    everything, anew = Counting(), Counting()
    again(world, tmp_path / "other", executor=everything)
    assert contents(again(world, tmp_path / "db", executor=anew).path) == whole
    assert anew.tasks == everything.tasks


def test_tiles_of_other_inputs_are_not_used_and_go_with_the_finished_build(world, tmp_path):
    out = tmp_path / "db"
    interrupted(world, out, 4)
    other = build(
        world.rasters, world.plan, world.routes, out, tile_px=8, floor_dbm=-95, resume=True
    )
    assert other.floor_dbm == -95
    assert not list(tmp_path.glob(".db.tiles-*"))


def test_damaged_tiles_are_made_again(world, whole, tmp_path):
    out = tmp_path / "db"
    interrupted(world, out, 4)
    (tiles,) = tmp_path.glob(".db.tiles-*")
    cut, changed, *_ = sorted(tiles.iterdir())
    cut.write_bytes(cut.read_bytes()[:50])
    changed.write_bytes(changed.read_bytes()[:-1] + b"x")
    assert contents(again(world, out, resume=True).path) == whole
    assert not tiles.exists()


def test_wrong_inputs_leave_no_tiles(world, tmp_path):
    with pytest.raises(InputError, match="floor too high"):
        build(world.rasters, world.plan, world.routes, tmp_path / "db", floor_dbm=0)
    assert list(tmp_path.iterdir()) == []


def test_who_stops_does_not_wait_for_the_checksum_of_the_rasters(world, tmp_path, monkeypatch):
    released, done = Event(), []

    def slow(_):
        done.append(released.wait(20))
        return "0" * 64

    def damaged(*_):
        raise InputError(())

    monkeypatch.setattr(RxLevRasters, "sha256", slow)
    monkeypatch.setattr("mapfilter.rasters.sampling.read_on", damaged)
    with pytest.raises(InputError):
        again(world, tmp_path / "db")
    assert done == []
    released.set()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.filterwarnings("default")
def test_a_dask_worker_killed_in_mid_build_loses_nothing(world, whole, tmp_path):
    with cluster_executor("local:2") as (executor, workers):
        assert workers == 2
        deadly = KillsOneWorker(executor, tmp_path / "died")
        out = tmp_path / "db"
        database = again(world, out, executor=deadly, pixels_a_task=2 * TILE_PIXELS, in_flight=4)
        deadly.deaths[0].result()
    assert (tmp_path / "died").exists()
    assert contents(database.path) == whole


@pytest.mark.parametrize("address", ["local:0", "local:many", "tcp://127.0.0.1:9", "nonsense://"])
@pytest.mark.filterwarnings("default")
def test_a_cluster_that_is_not_there(address, monkeypatch):
    monkeypatch.setattr("mapfilter._cluster._CONNECT_S", 0.5)
    with pytest.raises(MapfilterError, match="cluster"), cluster_executor(address):
        pass


def test_many_tiles_a_task_give_the_same_bytes(world, whole, tmp_path):
    one, several, many = Counting(), Counting(), {"pixels_a_task": 3 * TILE_PIXELS}
    again(world, tmp_path / "one", executor=one)
    again(world, tmp_path / "several", executor=several, **many)
    assert several.tasks <= one.tasks / 2
    assert contents(tmp_path / "several") == whole
    with local_executor(2) as executor:
        built = again(world, tmp_path / "db", executor=executor, writers=2, **many)
    assert contents(built.path) == whole


class Threads(ThreadPoolExecutor):
    """Counts tasks."""

    tasks = 0

    def submit(self, fn, /, *args, **kwargs):
        self.tasks += 1
        return super().submit(fn, *args, **kwargs)


def test_tasks_become_small_at_the_end_and_no_smaller_than_workers_need(world, whole, tmp_path):
    every = Counting()
    again(world, tmp_path / "one", executor=every)
    left, groups = every.tasks, 0
    while left:
        left, groups = left - -(-left // 2), groups + 1
    with Threads(2) as executor:
        again(world, tmp_path / "db", executor=executor, in_flight=8, pixels_a_task=10**9)
    assert contents(tmp_path / "db") == whole
    assert executor.tasks == groups < every.tasks


def test_a_database_that_was_just_written_is_not_read_again(world, tmp_path, monkeypatch):
    monkeypatch.setattr(store, "_check_parts", lambda *_: pytest.fail("parts were read"))
    built = again(world, tmp_path / "db")
    monkeypatch.undo()
    found = open_database(tmp_path / "db", verify="full")
    assert found.generation == built.generation
    assert found.manifest == built.manifest


def test_who_is_ready_lays_the_first_tile_at_once():
    """The kernel takes a quarter of a second to load; asked of a process of its own."""
    code = (
        "from mapfilter.database.tiles import get_ready_to_read as ready\n"
        "from mapfilter.roads.index import _burn\n"
        "assert not _burn.signatures\nready()\nassert len(_burn.signatures) == 1\n"
        "from small_world import make_routes\n"
        "make_routes()\nassert len(_burn.signatures) == 1"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120,
        cwd=Path(__file__).parent,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr


def test_a_build_that_goes_on_makes_tasks_of_what_is_missing(world, whole, tmp_path):
    interrupted(world, tmp_path / "db", 4)
    rest = Counting()
    built = again(world, tmp_path / "db", executor=rest, pixels_a_task=10**9, resume=True)
    assert rest.tasks == 1
    assert contents(built.path) == whole


def keep_building(rasters, out, ready):
    """Build one database after another, each with another margin."""
    plan, routes, opened = make_plan(), make_routes(), open_rasters(rasters)
    ready.set()
    for margin_db in range(1, 1000):
        build(opened, plan, routes, out, margin_db=margin_db, **OPTIONS)


def test_a_build_killed_at_any_moment_leaves_the_old_or_the_new_database(
    world, whole, tmp_path, kill_count
):
    out, rng = tmp_path / "db", np.random.default_rng(5)
    again(world, out)
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["mapfilter.database.build", "small_world"])
    for _ in range(kill_count):
        ready = context.Event()
        process = context.Process(target=keep_building, args=(world.rasters.path, out, ready))
        process.start()
        assert ready.wait(60)
        time.sleep(rng.uniform(0, 0.5))
        process.kill()
        process.join()
        found = open_database(out, verify="full")
        assert len(found.points()) == info(found)["points"] > 0
    assert contents(again(world, out, resume=True).path) == whole


def layers():
    west, _, _, north = LATTICE.bounds_m
    lines = [
        shapely.LineString(np.add([(5, -20), (200, -20), (200, -180)], (west, north))),
        shapely.LineString(np.add([(-30, -150), (90, -150), (90, -40)], (west, north))),
        shapely.LineString(np.add([(258, 0), (258, -200)], (west, north))),
    ]
    ways = Ways(
        CRS, np.array([77, 12, 99]), np.array([0, 1, 0], np.int16), ("residential", "footway"),
        np.array(lines), np.zeros(3, bool), np.zeros(3, np.int8),
    )  # fmt: skip
    place = shapely.box(west + 20, north - 190, west + 40, north - 170)
    house = shapely.box(west + 80, north - 30, west + 100, north - 10)
    buildings = Buildings(CRS, np.array([house]), np.array([9.0]), 1, 0, 0)
    return ways, Squares(CRS, np.array([5]), np.array([place])), buildings


@pytest.mark.parametrize("tile_px", [7, 16])
def test_points_laid_by_the_workers_are_those_of_the_whole_lattice(world, tmp_path, tile_px):
    ways, squares, buildings = layers()
    options = {"floor_dbm": FLOOR_DBM, "tile_px": tile_px}
    laid = route_lattice(ways, squares, buildings, LATTICE)
    tiled = LayerRoutes(RouteSource.of(ways, squares, buildings), LATTICE)
    for name, routes in (("laid", laid), ("tiled", tiled)):
        build(world.rasters, world.plan, routes, tmp_path / name, **options)
    assert contents(tmp_path / "laid") == contents(tmp_path / "tiled")
    estimate = dry_run(world.rasters, world.plan, tiled, **options)
    assert estimate.points == pytest.approx(len(laid), rel=0.3)


def test_layers_that_were_sent_lay_the_same_points():
    ways, squares, buildings = layers()
    west, _, _, north = LATTICE.bounds_m
    water = Water(CRS, np.array([shapely.box(west + 120, north - 60, west + 180, north)]))
    source = RouteSource.of(ways, squares, buildings, water=water)
    routes = LayerRoutes(source, LATTICE)
    count = 0
    for window in LATTICE.tiles(16):
        part = routes.part(LATTICE.window(*window))
        laid, sent = part(), pickle.loads(pickle.dumps(part))()
        count += len(laid)
        assert sent.lattice == laid.lattice
        assert sent.class_names == laid.class_names
        for name in ("row", "col", "way_id", "way_class", "distance_to_way_m", "on_square"):
            found, expected = getattr(sent, name), getattr(laid, name)
            assert found.dtype == expected.dtype
            np.testing.assert_array_equal(found, expected)
    assert count > 100
    whole = pickle.loads(pickle.dumps(routes))
    assert whole.digest() == routes.digest()
