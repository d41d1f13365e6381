"""What of a database is read for tiles of an area, and what is told of damage."""

import pickle
import shutil
from dataclasses import replace

import numpy as np
import pytest
from made_town import CRS, FLOOR_DBM, NAMES, Town
from tiled_town import every_level, every_pixel, write_database

from mapfilter.database import parts
from mapfilter.database.cell_levels import PointReader, part_extents
from mapfilter.database.parts import Head, write_parts
from mapfilter.database.store import open_database
from mapfilter.database.tiles import TileRows, places_table, received_levels
from mapfilter.errors import StoreError
from mapfilter.lattice import Lattice
from mapfilter.positioning.bayes.area import opened_area
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.area.tiled_area import TiledArea
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.radio.cells import CellPlan
from mapfilter.roads.lattice import RouteLattice


@pytest.fixture(scope="module")
def town():
    # A steep decay: no cell is received everywhere.
    return Town.of(3, slope=60.0)


@pytest.fixture(scope="module")
def folder(town, tmp_path_factory):
    return write_database(tmp_path_factory.mktemp("town") / "database", town)


@pytest.fixture(scope="module")
def database(folder):
    return open_database(folder)


@pytest.fixture(scope="module")
def whole(database):
    return AreaMap.of_field(database.field(), database.plan, database.floor_dbm)


def changed(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 4
    path.write_bytes(bytes(data))


@pytest.mark.parametrize("part", ["points.parquet", "levels/A/part-0.parquet"])
def test_damage_is_told_when_a_tile_is_read(folder, tmp_path, part):
    shutil.copytree(folder, tmp_path / "copy")
    tiled = TiledArea.of_database(open_database(tmp_path / "copy"), side=40)
    changed(tmp_path / "copy" / part)
    with pytest.raises(StoreError, match=part.split("/")[-1]):
        every_level(tiled)


def test_a_database_that_was_replaced_is_told(folder, tmp_path):
    shutil.copytree(folder, tmp_path / "copy")
    tiled = TiledArea.of_database(open_database(tmp_path / "copy"), side=40)
    tiled.looked_up(np.zeros(1, dtype=np.int32), np.zeros(1, dtype=np.int32))
    shutil.rmtree(tmp_path / "copy")
    write_database(tmp_path / "copy", Town.of(4, slope=60.0))
    with pytest.raises(StoreError, match="it was replaced while in use; open it again"):
        every_level(tiled)


def test_levels_of_many_cells_are_looked_up_in_blocks(database, whole, monkeypatch):
    tiled = TiledArea.of_database(database, side=40)
    pixel = every_pixel(tiled)
    band = pixel % len(whole.cell_ids)
    most, look = [], TiledArea.looked_up

    def watched(self, pixel, cell, **options):
        most.append(pixel.size * cell.size)
        return look(self, pixel, cell, **options)

    monkeypatch.setattr(TiledArea, "looked_up", watched)
    assert np.array_equal(tiled.levels_at(pixel, band), whole.levels_at(pixel, band))
    assert max(most) < 2000


def test_large_areas_are_held_by_tiles(database, monkeypatch):
    values = database.lattice.rows * database.lattice.cols * (len(NAMES) + 2)
    assert isinstance(open_area(database), AreaMap)
    monkeypatch.setattr(opened_area, "WHOLE_VALUES", values)
    assert isinstance(open_area(database), AreaMap)
    monkeypatch.setattr(opened_area, "WHOLE_VALUES", values - 1)
    assert isinstance(open_area(database), TiledArea)
    assert isinstance(BayesFilter().over(database).area, TiledArea)
    # The exact filter needs every pixel, and a database of roads alone every street.
    assert isinstance(GridFilter().over(database).area, AreaMap)
    assert isinstance(open_area(database.without_cells()), AreaMap)


def test_a_large_database_whose_cells_are_received_nowhere_is_held_whole(database, monkeypatch):
    """As one of roads alone; its cells are known, and have no levels."""
    quiet = replace(database)
    quiet.__dict__["level_parts"] = {}
    assert quiet.cell_ids
    monkeypatch.setattr(opened_area, "WHOLE_VALUES", 1)
    area = open_area(quiet)
    assert isinstance(area, AreaMap)
    assert area.cell_ids == ()
    assert area.known_ids == set(NAMES)


def test_extents_of_parts_hold_their_points(database):
    extents = part_extents(database, database.cell_ids)
    for band, cell in enumerate(database.cell_ids):
        row, col, level_dbm = database.cell_points(cell, np.inf)
        own = extents.band == band
        assert own.sum() == len(database.level_parts[cell]) == 1
        assert extents.box[own].tolist() == [[row.min(), row.max(), col.min(), col.max()]]
        assert extents.most_dbm[own] == level_dbm.max()


def _parts_read(tiled):
    return {key[1] for key in tiled.tiles.held._entries if key[0] == "part"}


def test_of_cells_in_several_parts_those_near_a_tile_are_read(town, tmp_path, monkeypatch):
    """As large databases are: all values are those of the whole, and a tile reads few parts."""
    monkeypatch.setattr(parts, "ROWS_IN_MEMORY", 1)
    database = open_database(write_database(tmp_path / "database", town))
    counts = [len(some) for some in database.level_parts.values()]
    assert min(counts) > 1
    assert max(counts) > 3
    whole = AreaMap.of_field(database.field(), database.plan, database.floor_dbm)
    tiled = TiledArea.of_database(database, side=30)
    bands = np.arange(len(whole.cell_ids), dtype=np.int32)
    corner = np.array([0, 1, tiled.lattice.cols], dtype=np.int32)
    flat = whole.level_dbm.reshape(whole.on_way.size, -1)
    assert np.array_equal(tiled.looked_up(corner, bands)[0], flat[corner][:, :-2])
    assert 0 < len(_parts_read(tiled)) < 0.5 * sum(counts)
    assert np.array_equal(every_level(tiled)[0], flat)
    ranges = [tiled.tiles.range_of(band) for band in bands.tolist()]
    most = [np.nanmax(one.most_dbm) for one in ranges]
    least = [np.nanmin(one.least_dbm) for one in ranges]
    heard = [database.cell_points(cell, np.inf)[2] for cell in whole.cell_ids]
    assert most == [some.max() for some in heard]
    assert least == [some.min() for some in heard]


def test_an_area_of_more_pixels_than_32_bits_count_is_refused(database):
    lattice = replace(database.lattice, rows=50_000, cols=50_000)
    with pytest.raises(StoreError, match="less than 2147483648 pixels"):
        TiledArea.of_database(replace(database, lattice=lattice))


def test_cells_are_read_only_where_they_may_be_strong(database, whole):
    """At some places above a level, and none is missed; a limit that none reaches reads none."""
    tiled = TiledArea.of_database(database, side=20)
    bands = np.arange(len(whole.cell_ids), dtype=np.int32)
    flat = whole.level_dbm.reshape(whole.on_way.size, -1)[:, :-2]
    pixel = np.random.default_rng(4).integers(whole.on_way.size, size=500).astype(np.int32)
    limits_dbm = (0.0, -60.0, -80.0, FLOOR_DBM, FLOOR_DBM - 20)
    for limit_dbm in limits_dbm:
        share = tiled.shares_above(pixel, bands, np.full(bands.size, limit_dbm, dtype=np.float32))
        assert np.array_equal(share, (flat[pixel] > limit_dbm).mean(axis=0))
        assert limit_dbm < 0 or not _parts_read(tiled)
    some = bands[[0, 3, 5]]
    share = tiled.shares_above(pixel, some, np.full(some.size, -80.0, dtype=np.float32))
    assert np.array_equal(share, (flat[pixel][:, some] > -80.0).mean(axis=0))


def test_layers_count_in_the_size_of_an_area(database, monkeypatch):
    cells = tuple(
        replace(cell, technology="LTE", arfcn=k) for k, cell in enumerate(database.plan.cells)
    )
    given = replace(database, plan=CellPlan(CRS, cells))
    values = given.lattice.rows * given.lattice.cols * 3 * len(cells)
    monkeypatch.setattr(opened_area, "WHOLE_VALUES", values)
    found = open_area(given)
    assert isinstance(found, AreaMap)
    assert found.level_dbm.size == values
    monkeypatch.setattr(opened_area, "WHOLE_VALUES", values - 1)
    assert isinstance(open_area(given), TiledArea)


def test_tiles_have_the_two_strongest_of_each_layer(database):
    """Of two carriers of LTE and GSM: all levels and all roughness are those of the whole."""
    kinds = ("LTE", 1300), ("LTE", 1300), ("LTE", 1300), ("GSM", 20), ("LTE", 3050), ("LTE", 3050)
    cells = tuple(
        replace(cell, technology=technology, arfcn=arfcn)
        for cell, (technology, arfcn) in zip(database.plan.cells, kinds, strict=True)
    )
    given = replace(database, plan=CellPlan(CRS, cells))
    whole = AreaMap.of_field(given.field(), given.plan, given.floor_dbm)
    tiled = TiledArea.of_database(given, side=30)
    assert tiled.layers == whole.layers == (0, 0, 0, 1, 2, 2)
    assert tiled.bands == whole.bands == 12
    assert [tiled.strongest(band) for band in range(6)] == [6, 6, 6, 8, 10, 10]
    level_dbm, rough_db = tiled.looked_up(every_pixel(whole), np.arange(12, dtype=np.int32))
    assert np.array_equal(level_dbm, whole.level_dbm.reshape(-1, 12))
    heard = level_dbm.max(axis=0) > tiled.tiles.quiet_dbm
    assert heard.tolist() == [True] * 9 + [False] + [True] * 2
    assert np.array_equal(rough_db, whole.flat_rough_db.reshape(-1, 12))
    again = pickle.loads(pickle.dumps(tiled.tiles))
    assert again.layers == tiled.layers


def test_the_nearest_point_may_be_far_beyond_the_window(tmp_path, town):
    """One point in a corner: of a window in the opposite one it is the nearest, too."""
    lattice = Lattice(CRS, 0.0, 2000.0, 5.0, 400, 400)
    one = np.zeros(1)
    part = RouteLattice(
        lattice, one.astype("i4"), one.astype("i4"), one.astype("i8") + 9, one.astype("i2"),
        ("path",), one.astype("f4"), one > 0,
    )  # fmt: skip
    level = received_levels(np.full((len(NAMES), 1), -70.0), FLOOR_DBM)
    (tmp_path / "far").mkdir()
    plan = town.plan()
    tiles = [TileRows(places_table(part, lattice), level)]
    written = write_parts(tmp_path / "far", CRS, plan.ids, tiles, 1)
    counts = {"points": 1, "points_below_floor": 0, "points_off_rasters": 0}
    parameters = {"margin_db": 6.0, "floor_dbm": FLOOR_DBM, "tile_px": 60}
    Head(lattice, plan, parameters, "", (), counts).write(tmp_path / "far", written.parts)
    database = open_database(tmp_path / "far")
    found = PointReader(database).nearest((380, 390, 20, 10))
    assert found.point.tolist() == [0]
    assert found.way_id.tolist() == [9]
    whole = AreaMap.of_field(database.field(), plan, FLOOR_DBM)
    assert np.array_equal(found.edge_m, whole.distance_m[380:, 390:])
    assert found.edge_m.max() > 5 * np.hypot(399, 399) - 20


def test_a_database_without_points_has_no_nearest(database, monkeypatch):
    reader = PointReader(database)
    monkeypatch.setattr(reader._reader, "read", lambda _: {})
    with pytest.raises(StoreError, match="expected points of the database, found none"):
        reader.nearest((0, 0, 20, 20))
