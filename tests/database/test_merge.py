"""Merged databases against one build of everything; best server and margin as raster."""

import json

import numpy as np
import pyarrow.parquet
import pytest
import rasterio
from small_world import (
    CRS,
    FLOOR_DBM,
    IDS,
    LATTICE,
    levels_of,
    make_database,
    make_plan,
    make_routes,
)

from mapfilter.database import parts
from mapfilter.database.build import build
from mapfilter.database.export import export_cog
from mapfilter.database.merge import merge
from mapfilter.database.store import info, open_database
from mapfilter.errors import InputError, OutputError, StoreError
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters


def some(world, folder, ids=IDS, window=(0, 0, 40, 50), levels_dbm=None, **more):
    """Build a database of some cells, in a window of the lattice."""
    folder.mkdir()
    row, col, rows, cols = window
    lattice = LATTICE.window(*window)
    levels_dbm = world.levels_dbm if levels_dbm is None else levels_dbm
    cut = levels_dbm[:, row : row + rows, col : col + cols]
    items = [(cell, cut[IDS.index(cell)]) for cell in ids]
    write_rasters(folder / "r.tif", lattice, iter(items), ids)
    plan = CellPlan(CRS, tuple(world.plan[cell] for cell in ids))
    options = {"floor_dbm": FLOOR_DBM, "tile_px": 16, **more}
    rasters = open_rasters(folder / "r.tif")
    return build(rasters, plan, make_routes(lattice), folder / "db", **options)


def data(folder):
    """All bytes but those of the manifest, which tells of the inputs."""
    files = (p for p in folder.rglob("*.parquet") if p.is_file())
    return {p.relative_to(folder): p.read_bytes() for p in files}


def same(a, b):
    assert data(a.path) == data(b.path)
    assert a.lattice == b.lattice
    assert a.plan == b.plan
    assert a.manifest["counts"]["points"] == b.manifest["counts"]["points"]


def test_cells_are_added(world, database, tmp_path):
    two = some(world, tmp_path / "two", IDS[:2])
    one = some(world, tmp_path / "one", IDS[2:])
    merged = merge([two, one], tmp_path / "all")
    same(merged, database)
    assert merged.manifest["counts"]["points_below_floor"] is None
    assert [entry["role"] for entry in merged.manifest["inputs"]] == ["database"] * 2
    same(open_database(merged.path, verify="full"), database)


@pytest.mark.parametrize("edge", [16, 23])
def test_areas_are_added_from_either_side(world, database, tmp_path, edge):
    west = some(world, tmp_path / "west", window=(0, 0, 40, edge))
    east = some(world, tmp_path / "east", window=(0, edge, 40, 50 - edge))
    assert west.lattice != database.lattice
    same(merge([west, east], tmp_path / "a"), database)
    same(merge([east, west], tmp_path / "b"), database)


def test_cells_are_replaced_and_removed(world, database, tmp_path):
    other_dbm = world.levels_dbm.copy()
    other_dbm[1] = next(levels_of(make_plan(IDS[1:2]), seed=9))[1]
    old = some(world, tmp_path / "old", levels_dbm=other_dbm)
    assert data(old.path) != data(database.path)
    new = some(world, tmp_path / "new", IDS[1:2])
    same(merge([old, new], tmp_path / "replaced"), database)
    without = merge([old], tmp_path / "without", without=[IDS[1]])
    same(without, some(world, tmp_path / "never", (IDS[0], IDS[2])))


def test_tiles_are_replaced_in_place(world, database, tmp_path):
    window = (8, 11, 20, 30)
    spoiled = world.levels_dbm.copy()
    spoiled[:, 8:28, 11:41] -= 12
    old = some(world, tmp_path / "old", levels_dbm=spoiled)
    new = some(world, tmp_path / "new", window=window)
    same(merge([old, new], old.path), database)
    assert sorted(path.name for path in old.path.parent.iterdir()) == ["db", "r.tif"]


def test_parts_in_many_row_groups_are_merged(world, database, tmp_path, monkeypatch):
    monkeypatch.setattr(parts, "_ROWS_IN_A_GROUP", 20)
    many = make_database(world, tmp_path)
    merged = merge([many], tmp_path / "again")
    same(merged, many)
    np.testing.assert_array_equal(merged.points().point, database.points().point)


def test_databases_that_do_not_fit(world, database, tmp_path):
    margin = some(world, tmp_path / "margin", margin_db=3)
    with pytest.raises(InputError, match="margin_db 6, found 3"):
        merge([database, margin], tmp_path / "out")
    with pytest.raises(InputError, match="'X'"):
        merge([database], tmp_path / "out", without=["X"])
    with pytest.raises(InputError, match="a cell that is left"):
        merge([database], tmp_path / "out", without=IDS)
    with pytest.raises(InputError, match="at least one"):
        merge([], tmp_path / "out")
    shifted = Lattice(CRS, 531_002.5, 4_556_000.0, 5.0, 40, 50)
    write_rasters(tmp_path / "s.tif", shifted, zip(IDS, world.levels_dbm, strict=True), IDS)
    other = build(
        open_rasters(tmp_path / "s.tif"), world.plan, make_routes(shifted), tmp_path / "db",
        floor_dbm=FLOOR_DBM,
    )  # fmt: skip
    with pytest.raises(InputError, match="pixels that align, found shifted by"):
        merge([database, other], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_where_no_level_is_left_nothing_is_written(world, tmp_path):
    """Of two cells the one that stays is below the floor everywhere."""
    quiet = world.levels_dbm.copy()
    quiet[0] = -120.0
    made = some(world, tmp_path / "one", IDS[:2], levels_dbm=quiet)
    with pytest.raises(InputError, match="a point with a level of a cell, found none"):
        merge([made], tmp_path / "out", without=[IDS[1]])
    assert not (tmp_path / "out").exists()


def test_a_damaged_part_is_told(world, tmp_path):
    database = make_database(world, tmp_path)
    (part,) = (one.file for one in database.level_parts[IDS[0]])
    content = bytearray(part.read_bytes())
    chunk = pyarrow.parquet.read_metadata(part).row_group(0).column(1)
    start = chunk.dictionary_page_offset or chunk.data_page_offset
    content[start + chunk.total_compressed_size - 5] ^= 1
    part.write_bytes(bytes(content))
    with pytest.raises(StoreError, match="damaged"):
        merge([database], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_best_server_and_margin_as_a_raster(database, tmp_path):
    file = tmp_path / "best.tif"
    export_cog(database, file)
    points = database.points()
    with rasterio.open(file) as source:
        assert source.descriptions == ("best_server", "best_level_dbm", "margin_db")
        assert json.loads(source.tags()["CELLS"]) == list(IDS)
        assert source.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"
        assert source.crs.to_string() == CRS
        assert tuple(source.bounds) == LATTICE.bounds_m
        values = source.read()
    there = np.zeros(values.shape[1:], bool)
    there[points.row, points.col] = True
    assert np.isnan(values[:, ~there]).all()
    for band, name in enumerate(("best_server", "best_level_dbm", "margin_db")):
        found = values[band, points.row, points.col]
        np.testing.assert_array_equal(found, getattr(points, name).astype(np.float32))
    before = file.read_bytes()
    export_cog(database, file)
    assert file.read_bytes() == before
    assert info(database)["points"] == there.sum()
    with pytest.raises(OutputError, match=r"\.tif"):
        export_cog(database, tmp_path / "best.png")
