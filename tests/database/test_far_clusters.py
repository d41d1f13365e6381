"""Points in two corners of an area: what lies between them is empty for every reader."""

import json

import numpy as np
import pytest
import rasterio
from small_world import CRS, make_plan

from mapfilter.database import export, parts
from mapfilter.database.export import export_cog
from mapfilter.database.parquet import WindowReader
from mapfilter.database.parts import Head, write_parts
from mapfilter.database.store import open_database
from mapfilter.database.tiles import TileRows, places_table, received_levels
from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.roads.lattice import RouteLattice

AREA = Lattice(CRS, 500_000.0, 4_000_000.0, 10.0, 60, 64)
IDS = ("Ä 1", "west", "east")
NORTH_WEST = [(row, col) for row in range(3) for col in range(4)]
SOUTH_EAST = [(row, col) for row in range(57, 60) for col in range(60, 64)]


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    """Each corner is a row group; "west" and "east" are received in their corner alone."""
    folder = tmp_path_factory.mktemp("clusters") / "db"
    folder.mkdir()
    plan = make_plan(IDS)

    def tiles():
        for number, places in enumerate((NORTH_WEST, SOUTH_EAST)):
            row, col = np.array(places, np.int32).T
            count = len(places)
            routes = RouteLattice(
                AREA, row, col, np.full(count, number), np.zeros(count, np.int16), ("path",),
                np.ones(count, np.float32), np.zeros(count, bool),
            )  # fmt: skip
            levels = np.full((3, count), np.nan)
            levels[0], levels[1 + number] = -80.0, -70.0 - np.arange(count)
            yield TileRows(places_table(routes, AREA), received_levels(levels, -100.0))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(parts, "ROWS_IN_MEMORY", 1)
        written = write_parts(folder, CRS, plan.ids, tiles(), 2)
    counts = {"points": written.received, "points_below_floor": 0, "points_off_rasters": 0}
    parameters = {"margin_db": 6.0, "floor_dbm": -100.0, "tile_px": 60}
    Head(AREA, plan, parameters, "", (), counts).write(folder, written.parts)
    return open_database(folder, verify="full")


def corner(rows, cols):
    """Return west, south, east and north of some rows and columns."""
    (top, bottom), (left, right) = rows, cols
    west, north = AREA.west_m + 10.0 * left + 1, AREA.north_m - 10.0 * top - 1
    return west, AREA.north_m - 10.0 * bottom - 9, AREA.west_m + 10.0 * right + 9, north


def test_a_part_of_the_area_has_the_cells_that_are_received_there(database):
    field = database.field(corner((0, 10), (0, 10)))
    assert field.cell_ids == ("Ä 1", "west")
    assert field.on_way.sum() == 12
    assert database.field(corner((50, 59), (50, 63))).cell_ids == ("Ä 1", "east")
    assert database.field().cell_ids == IDS


@pytest.mark.parametrize(("rows", "cols"), [((20, 30), (20, 30)), ((0, 9), (20, 30))])
def test_between_them_is_nothing(database, rows, cols):
    bounds_m = corner(rows, cols)
    with pytest.raises(InputError, match="points of the database, found none") as caught:
        database.field(bounds_m)
    (fault,) = caught.value.faults
    assert (fault.where, fault.hint) == (f"area {bounds_m}", "another area or CRS")


def test_an_area_beside_the_lattice_is_told_with_the_lattices_own(database):
    with pytest.raises(InputError) as caught:
        database.field((24.9, 60.1, 25.0, 60.2))
    (fault,) = caught.value.faults
    assert (fault.where, fault.got) == ("area", "(24.9, 60.1, 25.0, 60.2)")
    assert fault.expected == "an area within 500000, 3999400, 500640, 4000000"


def test_windows_without_a_group_are_no_rows_and_those_without_a_point_none(database):
    reader = WindowReader([database.points_part], ("row", "col", "way_class"), AREA)
    assert reader.read((20, 20, 9, 9)) == {}
    assert reader.read((2, 3, 1, 1))["row"].tolist() == [2]
    assert WindowReader([], ("row", "col"), AREA).read((0, 0, 60, 64)) == {}


def test_rasters_are_empty_between_them(database, tmp_path, monkeypatch):
    monkeypatch.setattr(export, "_TILE_PX", 10)
    export_cog(database, tmp_path / "best.tif")
    with rasterio.open(tmp_path / "best.tif") as source:
        server, tag = source.read(1), source.tags()["CELLS"]
    assert json.loads(tag) == list(IDS)
    # As people read it with gdalinfo.
    assert "Ä 1" in tag
    assert np.argwhere(np.isfinite(server)).tolist() == [list(p) for p in NORTH_WEST + SOUTH_EAST]
    assert server[0, 0] == 1
    assert server[59, 63] == 0
