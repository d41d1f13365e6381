"""Building a database against the same computed point by point from the whole rasters."""

import errno
from dataclasses import replace

import duckdb
import geopandas
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_world import (
    CRS,
    FLOOR_DBM,
    IDS,
    LATTICE,
    contents,
    make_plan,
    make_routes,
)

from mapfilter._parallel import SerialExecutor, local_executor
from mapfilter.database import parts
from mapfilter.database.build import build
from mapfilter.database.build_job import BuildJob
from mapfilter.database.estimate import dry_run
from mapfilter.database.merge import merge
from mapfilter.database.store import info
from mapfilter.database.tiles import z_order
from mapfilter.errors import InputError, OutputError
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters


def test_points_are_those_that_hear_a_cell(world, database):
    at_points = world.levels_dbm[:, world.routes.row, world.routes.col]
    strength = np.where(np.isnan(at_points), -np.inf, at_points)
    heard = strength.max(axis=0) >= FLOOR_DBM
    assert 0 < (~heard).sum() < heard.sum()
    points = database.points()
    np.testing.assert_array_equal(points.point, world.routes.point[heard])
    np.testing.assert_array_equal(points.row, world.routes.row[heard])
    np.testing.assert_array_equal(points.way_id, world.routes.way_id[heard])
    np.testing.assert_array_equal(points.on_square, world.routes.on_square[heard])
    np.testing.assert_array_equal(points.distance_to_way_m, world.routes.distance_to_way_m[heard])
    names = np.array(points.way_class[1])[points.way_class[0]]
    expected = np.array(world.routes.class_names)[world.routes.way_class[heard]]
    np.testing.assert_array_equal(names, expected)
    np.testing.assert_array_equal(points.best_server, strength.argmax(axis=0)[heard])
    ordered = np.sort(strength, axis=0)[:, heard]
    np.testing.assert_array_equal(points.best_level_dbm, ordered[-1].astype(np.float32))
    margin = np.where(ordered[-2] >= FLOOR_DBM, ordered[-1] - ordered[-2], np.nan)
    assert 0 < np.isnan(margin).sum() < margin.size
    np.testing.assert_allclose(points.margin_db, margin, atol=1e-5)
    counts = database.manifest["counts"]
    assert counts["points"] == heard.sum() == len(points)
    known = ~np.isnan(at_points).all(axis=0)
    assert counts["points_below_floor"] == (known & ~heard).sum() > 0
    assert counts["points_without_level"] == (~known).sum()
    assert counts["points_off_rasters"] == 0


@pytest.mark.parametrize("margin_db", [None, 0.0, 2.4, 12.0, np.inf])
def test_points_of_a_cell_are_those_within_the_margin(world, database, margin_db):
    at_points = world.levels_dbm[:, world.routes.row, world.routes.col]
    best = np.nanmax(at_points, axis=0)
    margin = 6.0 if margin_db is None else margin_db
    for n, cell in enumerate(IDS):
        with np.errstate(invalid="ignore"):
            near = np.round(best - at_points[n], 2) <= margin
            expected = np.flatnonzero(near & (at_points[n] >= FLOOR_DBM))
        row, col, level = database.cell_points(cell, margin_db)
        np.testing.assert_array_equal(row, world.routes.row[expected])
        np.testing.assert_array_equal(col, world.routes.col[expected])
        np.testing.assert_array_equal(level, at_points[n, expected].astype(np.float32))


def test_points_of_a_cell_are_near_the_best_server_of_its_layer(world, tmp_path):
    """Built, and merged: with a cell of GSM beside two of one carrier of LTE."""
    kinds = ("LTE", 1300), ("GSM", 20), ("LTE", 1300)
    cells = tuple(
        replace(cell, technology=technology, arfcn=arfcn)
        for cell, (technology, arfcn) in zip(world.plan.cells, kinds, strict=True)
    )
    plan, layers = CellPlan(CRS, cells), ([0, 2], [1], [0, 2])
    options = {"floor_dbm": FLOOR_DBM, "tile_px": 16}
    built = build(world.rasters, plan, world.routes, tmp_path / "db", **options)
    at_points = world.levels_dbm[:, world.routes.row, world.routes.col]
    for n, cell in enumerate(IDS):
        best = np.fmax.reduce(at_points[layers[n]], axis=0)
        with np.errstate(invalid="ignore"):
            near = np.round(best - at_points[n], 2) <= 3.0
        expected = np.flatnonzero(near & (at_points[n] >= FLOOR_DBM))
        for database in (built, merge([built], tmp_path / f"merged-{n}")):
            row, col, _ = database.cell_points(cell, 3.0)
            np.testing.assert_array_equal(row, world.routes.row[expected])
            np.testing.assert_array_equal(col, world.routes.col[expected])


def test_a_build_has_the_layers_of_its_whole_plan(world):
    """A cell that lacks its carrier is of the only one at its frequency."""
    frequency = {"frequency_mhz": 806.0, "technology": "LTE"}
    carriers = zip(world.plan.cells, (None, 6300, 6300), strict=True)
    cells = tuple(replace(cell, arfcn=arfcn, **frequency) for cell, arfcn in carriers)
    job = BuildJob.of(world.rasters, CellPlan(CRS, cells), world.routes, FLOOR_DBM, 16)
    assert job.layers == (0, 0, 0)
    other = (*cells[:2], replace(cells[2], arfcn=6350))
    job = BuildJob.of(world.rasters, CellPlan(CRS, other), world.routes, FLOOR_DBM, 16)
    assert job.layers == (0, 1, 2)


def test_every_point_belongs_to_its_best_server_and_to_no_other_at_margin_0(database):
    found = (database.cell_points(cell, 0.0)[:2] for cell in IDS)
    sets = [set(zip(row.tolist(), col.tolist(), strict=True)) for row, col in found]
    assert sum(len(points) for points in sets) >= len(database.points())
    assert len(set.union(*sets)) == len(database.points())


def test_same_bytes_whatever_the_workers(world, database, tmp_path):
    options = {"floor_dbm": FLOOR_DBM, "tile_px": 16}
    expected = contents(database.path)
    with local_executor(2) as executor:
        again = build(
            world.rasters, world.plan, world.routes, tmp_path / "two", executor=executor, **options
        )
    assert contents(again.path) == expected


def test_small_parts_hold_the_same_rows(world, database, tmp_path, monkeypatch):
    monkeypatch.setattr(parts, "ROWS_IN_MEMORY", 60)
    split = build(
        world.rasters, world.plan, world.routes, tmp_path / "db", floor_dbm=FLOOR_DBM, tile_px=16
    )
    assert len(split.manifest["parts"]) > len(database.manifest["parts"])
    for cell in IDS:
        for a, b in zip(split.cell_points(cell), database.cell_points(cell), strict=True):
            np.testing.assert_array_equal(a, b)
    for name in ("point", "best_server", "best_level_dbm"):
        a, b = getattr(split.points(), name), getattr(database.points(), name)
        np.testing.assert_array_equal(a, b)
    assert info(split)["levels_per_cell"] == info(database)["levels_per_cell"]


def test_parts_written_beside_the_tiles_have_the_same_bytes(world, tmp_path, monkeypatch):
    monkeypatch.setattr(parts, "ROWS_IN_MEMORY", 60)
    inputs = world.rasters, world.plan, world.routes
    options = {"floor_dbm": FLOOR_DBM, "tile_px": 8}
    found = [
        contents(build(*inputs, tmp_path / f"{writers}", writers=writers, **options).path)
        for writers in (1, 3)
    ]
    assert sum("part-" in name.name for name in found[0]) > 2 * len(IDS)
    assert found[0] == found[1]


@pytest.mark.parametrize("writers", [1, 3])
def test_a_part_that_cannot_be_written_ends_the_build(world, tmp_path, monkeypatch, writers):
    monkeypatch.setattr(parts, "ROWS_IN_MEMORY", 60)
    write, begun = parts.write_columns, []

    def full(table, file, rows):
        begun.append(file)
        if len(begun) == 4:
            raise OSError(errno.ENOSPC, "No space left on device", str(file))
        write(table, file, rows)

    monkeypatch.setattr(parts, "write_columns", full)
    with pytest.raises(OutputError, match="No space left"):
        build(
            world.rasters, world.plan, world.routes, tmp_path / "db",
            floor_dbm=FLOOR_DBM, tile_px=8, writers=writers,
        )  # fmt: skip
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("tile_px", [7, 64])
def test_tiles_do_not_change_what_is_found(world, database, tmp_path, tile_px):
    other = build(
        world.rasters, world.plan, world.routes, tmp_path / "db",
        floor_dbm=FLOOR_DBM, tile_px=tile_px,
    )  # fmt: skip
    for name in ("point", "best_server", "margin_db", "distance_to_way_m"):
        a, b = getattr(other.points(), name), getattr(database.points(), name)
        np.testing.assert_array_equal(a, b)


def test_progress_counts_tiles(world, tmp_path):
    seen = []
    build(
        world.rasters, world.plan, world.routes, tmp_path / "db", tile_px=16,
        progress=lambda done, total: seen.append((done, total)),
    )  # fmt: skip
    assert seen == [(i, len(seen)) for i in range(1, len(seen) + 1)]
    assert len(seen) > 2


def test_geopandas_and_duckdb_open_the_parts(database):
    frame = geopandas.read_parquet(database.path / "points.parquet")
    assert frame.crs == CRS
    east, north = LATTICE.east_north(frame["row"].to_numpy(), frame["col"].to_numpy())
    np.testing.assert_array_equal(frame.geometry.x, east)
    np.testing.assert_array_equal(frame.geometry.y, north)
    # Stored along the curve, not row by row.
    assert (np.diff(z_order(frame["row"], frame["col"]).astype(np.int64)) > 0).all()
    with duckdb.connect() as connection:
        query = "select cell, count(*) from read_parquet($1) group by cell"
        pattern = str(database.path / "levels" / "*" / "*.parquet")
        counts = dict(connection.execute(query, [pattern]).fetchall())
    expected = info(database)["levels_per_cell"]
    assert counts == {cell: count for cell, count in expected.items() if count}


def test_losses_are_taken_from_the_eirp(world, database, tmp_path):
    loss = ((c.id, c.eirp_dbm - v) for c, v in zip(world.plan.cells, world.levels_dbm, strict=True))
    write_rasters(tmp_path / "loss.tif", LATTICE, loss, world.plan.ids, quantity="loss")
    built = build(
        open_rasters(tmp_path / "loss.tif"), world.plan, world.routes, tmp_path / "db",
        floor_dbm=FLOOR_DBM, tile_px=16,
    )  # fmt: skip
    for a, b in zip(built.cell_points(IDS[0]), database.cell_points(IDS[0]), strict=True):
        np.testing.assert_array_equal(a, b)


def test_roads_may_be_smaller_or_larger_than_the_rasters(world, database, tmp_path):
    west, south, east, north = LATTICE.bounds_m
    small = Lattice(CRS, west + 25, north - 10, 5.0, 30, 40)
    built = build(
        world.rasters, world.plan, make_routes(small), tmp_path / "small", floor_dbm=FLOOR_DBM
    )
    inside = np.isin(database.points().point, built.points().point)
    np.testing.assert_array_equal(database.points().point[inside], built.points().point)
    assert 0 < len(built.points()) < len(database.points())
    large = Lattice.covering(CRS, (west - 50, south - 50, east + 50, north + 50), 5.0)
    built = build(
        world.rasters, world.plan, make_routes(large), tmp_path / "large", floor_dbm=FLOOR_DBM
    )
    np.testing.assert_array_equal(built.points().point, database.points().point)
    assert built.manifest["counts"]["points_off_rasters"] == len(make_routes(large)) - len(
        world.routes
    )


@pytest.mark.parametrize(
    ("lattice", "message"),
    [
        (Lattice(CRS, 531_002.5, 4_556_000.0, 5.0, 40, 50), "half-pixel"),
        (Lattice(CRS, 531_000.0, 4_556_000.0, 2.5, 80, 100), "one resolution"),
    ],
)
def test_rasters_that_do_not_align_with_the_roads(world, tmp_path, lattice, message):
    with pytest.raises(InputError, match=message):
        build(world.rasters, world.plan, make_routes(lattice), tmp_path / "db")
    assert not (tmp_path / "db").exists()


@pytest.mark.parametrize(
    ("crs", "west", "message"), [(CRS, 600_000.0, "overlap"), ("EPSG:32630", 531_000.0, "one CRS")]
)
def test_rasters_of_another_place(world, tmp_path, crs, west, message):
    lattice = Lattice(crs, west, 4_556_000.0, 5.0, 40, 50)
    plan = make_plan().to_crs(crs)
    items = ((cell_id, values) for cell_id, values in zip(IDS, world.levels_dbm, strict=True))
    write_rasters(tmp_path / "far.tif", lattice, items, IDS)
    with pytest.raises(InputError, match=message):
        build(open_rasters(tmp_path / "far.tif"), plan, world.routes, tmp_path / "db")


def test_cells_of_rasters_and_plan_must_be_the_same(world, tmp_path):
    with pytest.raises(InputError, match=r"'I 1'.*\n.*no band for 'other'"):
        build(world.rasters, make_plan(("S1.A", "S1.B", "other")), world.routes, tmp_path / "db")


def test_parameters_are_checked_together(world, tmp_path):
    with pytest.raises(InputError, match=r"margin_db.*\n.*floor_dbm.*sign.*\n.*tile_px"):
        build(
            world.rasters, world.plan, world.routes, tmp_path / "db",
            margin_db=np.nan, floor_dbm=104, tile_px=0,
        )  # fmt: skip


def test_nothing_heard_leaves_nothing_behind(world, tmp_path):
    with pytest.raises(InputError, match="floor too high"):
        build(world.rasters, world.plan, world.routes, tmp_path / "db", floor_dbm=0)
    assert list(tmp_path.iterdir()) == []


def test_output_that_cannot_be_written(world, tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OutputError):
        build(world.rasters, world.plan, world.routes, tmp_path / "file")
    assert (tmp_path / "file").read_text() == "in the way"


class DiesAtThirdTile(SerialExecutor):
    """Stands for a process that is killed in the middle of a build."""

    def __init__(self):
        self.tiles = 0

    def submit(self, fn, /, *args, **kwargs):
        self.tiles += 1
        if self.tiles == 3:
            raise KeyboardInterrupt
        return super().submit(fn, *args, **kwargs)


def test_the_old_database_survives_a_build_that_dies(world, tmp_path):
    out = tmp_path / "db"
    build(world.rasters, world.plan, world.routes, out, margin_db=3)
    before = contents(out)
    with pytest.raises(KeyboardInterrupt):
        build(
            world.rasters,
            world.plan,
            world.routes,
            out,
            tile_px=8,
            executor=DiesAtThirdTile(),
            pixels_a_task=0,
            in_flight=1,
        )
    assert contents(out) == before
    tiles, left = sorted(p.name for p in tmp_path.iterdir())
    assert tiles.startswith(".db.tiles-")
    assert left == "db"


def test_cut_off_rasters_are_named(world, tmp_path):
    whole = world.rasters.path.read_bytes()
    cut = tmp_path / "cut.tif"
    cut.write_bytes(whole)
    rasters = open_rasters(cut)
    cut.write_bytes(whole[: len(whole) // 3])
    with pytest.raises(InputError, match=r"cut\.tif"):
        build(rasters, world.plan, world.routes, tmp_path / "db")
    assert not (tmp_path / "db").exists()


def test_dry_run_is_near_the_truth_and_writes_nothing(world, database, tmp_path):
    estimate = dry_run(world.rasters, world.plan, world.routes, floor_dbm=FLOOR_DBM, tile_px=64)
    assert estimate.points == len(world.routes)
    assert estimate.levels == info(database)["levels"]
    assert 0.7 < estimate.bytes / info(database)["bytes"] < 1.3
    assert estimate.memory_bytes > 0
    assert estimate.seconds > 0
    assert list(tmp_path.iterdir()) == []


@given(st.integers(0, 2**20), st.integers(0, 2**20))
def test_z_order_interleaves_bits(row, col):
    expected = sum(
        ((row >> bit & 1) << (2 * bit + 1)) | ((col >> bit & 1) << (2 * bit)) for bit in range(21)
    )
    assert z_order(np.array([row]), np.array([col])).tolist() == [expected]
