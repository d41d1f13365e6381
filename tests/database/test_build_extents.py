"""Rasters that each cover the surroundings of their own cell, as planning tools export them."""

import dataclasses

import numpy as np
import pyarrow.parquet as pq
import pytest
from small_world import FLOOR_DBM, IDS, LATTICE, make_plan, make_routes, make_world

from mapfilter.database.build import build
from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.sampling import levels_at

# row, col, rows, cols of each cell's own raster: none covers the square's middle alone.
EXTENTS = ((0, 0, 20, 30), (0, 25, 40, 25), (18, 5, 22, 20))


def parts_of(database):
    return {
        path.relative_to(database.path).as_posix(): path.read_bytes()
        for path in sorted(database.path.rglob("*.parquet"))
    }


def cut(world):
    """Yield each cell's levels, NaN beyond its own raster."""
    for cell_id, (row, col, rows, cols), whole in zip(IDS, EXTENTS, world.levels_dbm, strict=True):
        values = np.full_like(whole, np.nan)
        values[row : row + rows, col : col + cols] = whole[row : row + rows, col : col + cols]
        yield cell_id, values


def test_only_what_reaches_a_tile_is_read_and_nothing_else_changes(tmp_path, monkeypatch):
    world = make_world(tmp_path)
    write_rasters(tmp_path / "whole.tif", LATTICE, cut(world), IDS)
    (tmp_path / "cells").mkdir()
    for number, ((cell_id, values), (row, col, rows, cols)) in enumerate(
        zip(cut(world), EXTENTS, strict=True)
    ):
        part = values[row : row + rows, col : col + cols]
        window = LATTICE.window(row, col, rows, cols)
        write_rasters(tmp_path / f"cells/{number}.tif", window, [(cell_id, part)], (cell_id,))
    options = {"floor_dbm": FLOOR_DBM, "tile_px": 8}
    one = open_rasters(tmp_path / "whole.tif")
    expected = build(one, make_plan(), make_routes(), tmp_path / "a", **options)
    asked = []

    def counted(places):
        asked.extend(len(one.cells) for one in places)
        return levels_at(places)

    monkeypatch.setattr("mapfilter.database.tiles.levels_at", counted)
    many = open_rasters(tmp_path / "cells")
    found = build(many, make_plan(), make_routes(), tmp_path / "b", **options)
    assert parts_of(found) == parts_of(expected)
    assert sorted(set(asked)) == [1, 2]


def test_a_tile_that_no_raster_reaches_has_points_and_no_levels(tmp_path):
    world = make_world(tmp_path)
    window = LATTICE.window(0, 0, 8, 8)
    ids = IDS[:1]
    write_rasters(tmp_path / "corner.tif", window, [(ids[0], world.levels_dbm[0, :8, :8])], ids)
    corner = open_rasters(tmp_path / "corner.tif")
    spread = dataclasses.replace(corner, lattice=LATTICE)
    database = build(
        spread, make_plan(ids), make_routes(), tmp_path / "db", floor_dbm=FLOOR_DBM, tile_px=8
    )
    row, col = (pq.read_table(database.path / "points.parquet")[name] for name in ("row", "col"))
    assert max(row.to_pylist()) < 8
    assert max(col.to_pylist()) < 8
    counts = database.manifest["counts"]
    assert counts["points_without_level"] > 0
    left_out = counts["points_below_floor"] + counts["points_without_level"]
    assert counts["points"] + left_out == len(make_routes())


def test_reaching_is_told_by_the_files_own_extent(tmp_path):
    lattices = [Lattice(LATTICE.crs, LATTICE.west_m + 500 * n, LATTICE.north_m, 5.0, 20, 20)
                for n in range(3)]  # fmt: skip
    (tmp_path / "cells").mkdir()
    for cell_id, lattice in zip(IDS, lattices, strict=True):
        values = [(cell_id, np.full((20, 20), -80.0))]
        write_rasters(tmp_path / f"cells/{cell_id}.tif", lattice, values, (cell_id,))
    rasters = open_rasters(tmp_path / "cells")
    assert rasters.reaching((0, 0, 20, 10)).cell_ids == ("S1.A",)
    assert [rasters.reaching((0, col, 20, 1)).cell_ids for col in range(30, 90)] == [()] * 60
    assert rasters.reaching((0, 0, 20, rasters.lattice.cols)) is rasters


@pytest.mark.parametrize("resampling", ["nearest", "bilinear"])
def test_windows_of_mixed_resolutions_say_what_the_whole_says(resampling, tmp_path):
    rng = np.random.default_rng(3)
    for number, (cell_id, side_m) in enumerate(zip(IDS, (5.0, 7.3, 20.0), strict=True)):
        west_m, north_m = LATTICE.west_m + 61.0 * number, LATTICE.north_m - 42.5 * number
        part = Lattice(LATTICE.crs, west_m, north_m, side_m, 9, 11)
        values = rng.uniform(-100, -60, (9, 11)).astype(np.float32)
        values[rng.random(values.shape) < 0.1] = np.nan
        write_rasters(tmp_path / f"{number}.tif", part, [(cell_id, values)], (cell_id,))
    rasters = open_rasters(tmp_path, resampling=resampling)
    whole = rasters.read()
    for row, col, rows, cols in rasters.lattice.tiles(7):
        expected = np.full((len(IDS), rows, cols), np.nan, np.float32)
        some = rasters.reaching((row, col, rows, cols))
        for cell_id in some.cell_ids:
            read = some.read((row, col, rows, cols), (cell_id,))
            expected[rasters.cell_ids.index(cell_id)] = read[0]
        np.testing.assert_array_equal(whole[:, row : row + rows, col : col + cols], expected)


def test_rasters_whose_metres_are_none_on_the_ground_are_refused(tmp_path):
    """Steps of dead reckoning would be a quarter too short on such a map, without a word."""
    mercator = dataclasses.replace(LATTICE, crs="EPSG:3857")
    levels = [(cell_id, np.full((40, 50), -70.0)) for cell_id in IDS]
    write_rasters(tmp_path / "a.tif", mercator, levels, IDS)
    routes = dataclasses.replace(make_routes(), lattice=mercator)
    with pytest.raises(InputError, match=r"EPSG:3857, of which 100 m are 79 m .*Web Mercator"):
        build(open_rasters(tmp_path / "a.tif"), make_plan(), routes, tmp_path / "db")
    assert not (tmp_path / "db").exists()


@pytest.mark.parametrize(
    ("move", "hint"),
    [
        (lambda c: {"east_m": c.east_m - 460_000.0}, "a CRS of another zone"),
        (lambda c: {"east_m": c.north_m, "north_m": c.east_m}, "east and north swapped"),
    ],
)
def test_a_plan_of_another_place_is_refused_as_by_the_command(tmp_path, move, hint):
    world = make_world(tmp_path)
    cells = tuple(dataclasses.replace(cell, **move(cell)) for cell in world.plan.cells)
    plan = dataclasses.replace(world.plan, cells=cells)
    with pytest.raises(
        InputError, match=rf"plan: expected cells within 50 km .*found 3 of 3.*{hint}"
    ):
        build(world.rasters, plan, world.routes, tmp_path / "db")
    assert not (tmp_path / "db").exists()
