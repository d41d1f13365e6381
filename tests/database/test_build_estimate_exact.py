"""Estimates that are exact, as nothing is left to chance: few tiles, or tiles that are alike."""

import numpy as np
import pytest
from small_world import CRS, FLOOR_DBM, make_plan, make_world

from mapfilter.database import estimate
from mapfilter.database.build import build
from mapfilter.database.estimate import dry_run, peak_memory_bytes
from mapfilter.database.store import info
from mapfilter.lattice import Lattice
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.lattice import RouteLattice


@pytest.mark.parametrize("tile_px", [11, 16, 64])
def test_of_few_tiles_all_are_made(tmp_path, monkeypatch, tile_px):
    world = make_world(tmp_path)
    options = {"floor_dbm": FLOOR_DBM, "tile_px": tile_px}
    database = build(world.rasters, world.plan, world.routes, tmp_path / "db", **options)
    monkeypatch.setattr(estimate, "peak_memory_bytes", lambda: 1_000_000)
    found, told = dry_run(world.rasters, world.plan, world.routes, **options), info(database)
    assert found.points == len(world.routes)
    assert found.levels == told["levels"]
    assert found.bytes == pytest.approx(told["bytes"], rel=0.01)
    each = (found.memory_bytes - 1_000_000) / found.levels
    # Point, row, column, level and what it is below the best: 24 bytes, and copies of them.
    assert 24 <= each <= 24 * 8
    assert 0 < found.seconds < 30


def test_of_many_tiles_that_are_alike_any_sixteen_tell_all(tmp_path):
    lattice = Lattice(CRS, 531_000.0, 4_556_000.0, 5.0, 48, 48)
    plan = make_plan()
    level = np.tile(np.linspace(-80, -60, 8)[:, None] + np.arange(8) / 10, (6, 6))
    items = ((cell_id, level - 5 * n) for n, cell_id in enumerate(plan.ids))
    write_rasters(tmp_path / "r.tif", lattice, items, plan.ids)
    row, col = (axis.ravel().astype(np.int32) for axis in np.mgrid[:48, :48])
    count = row.size
    routes = RouteLattice(
        lattice, row, col, np.full(count, 7), np.zeros(count, np.int16), ("residential",),
        np.ones(count, np.float32), np.zeros(count, bool),
    )  # fmt: skip
    rasters = open_rasters(tmp_path / "r.tif")
    options = {"floor_dbm": -89.5, "tile_px": 8}
    found = dry_run(rasters, plan, routes, **options)
    told = info(build(rasters, plan, routes, tmp_path / "db", **options))
    assert found.points == count
    assert found.levels == told["levels"]
    # Drawn tiles lie beside none of their neighbours, so their numbers compress less well.
    assert found.bytes == pytest.approx(told["bytes"], rel=0.2)


def test_the_memory_of_this_process_is_told_in_bytes():
    held = np.ones(30_000_000)
    before = peak_memory_bytes()
    assert held.nbytes < before < 200 * held.nbytes
