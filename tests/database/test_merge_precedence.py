"""Which database a merged one follows where several cover a place: exactly within their areas."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from small_world import CRS, LATTICE, make_plan

from mapfilter.database.build import build
from mapfilter.database.measured import Deviations, MeasuredParts
from mapfilter.database.merge import _not_overridden, merge
from mapfilter.errors import InputError, OutputError
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.lattice import RouteLattice

WHOLE = Lattice(CRS, LATTICE.west_m, LATTICE.north_m, 5.0, 14, 17)
PLAN = make_plan(("A", "B"))


def everywhere(lattice, way_id, attribution=""):
    """Return points at all pixels, all of one way."""
    row, col = (axis.ravel().astype(np.int32) for axis in np.mgrid[: lattice.rows, : lattice.cols])
    count = row.size
    return RouteLattice(
        lattice, row, col, np.full(count, way_id), np.zeros(count, np.int16), ("path",),
        np.full(count, way_id, np.float32), np.zeros(count, bool), attribution,
    )  # fmt: skip


def built(folder, lattice, levels_dbm, way_id, plan=PLAN, attribution="", **options):
    """Build a database of all pixels, with one level of each cell; None where there is none."""
    folder.mkdir()
    shape = lattice.rows, lattice.cols
    values = ((c, np.full(shape, np.nan if v is None else v)) for c, v in levels_dbm.items())
    write_rasters(folder / "r.tif", lattice, values, tuple(levels_dbm))
    cells = CellPlan(CRS, tuple(plan[cell] for cell in levels_dbm))
    routes = everywhere(lattice, way_id, attribution)
    given = {"floor_dbm": -100.0, "tile_px": 4, **options}
    return build(open_rasters(folder / "r.tif"), cells, routes, folder / "db", **given)


def mask_of(database, cell_id):
    found = np.zeros((WHOLE.rows, WHOLE.cols), dtype=bool)
    row, col, _ = database.cell_points(cell_id, np.inf)
    found[row, col] = True
    return found


@pytest.mark.parametrize("window", [(3, 5, 6, 7), (0, 0, 5, 9), (9, 12, 5, 5), (4, 4, 1, 1)])
def test_a_later_database_overrides_all_of_its_area_and_nothing_beside_it(tmp_path, window):
    """Where it has no level of its cell, the earlier one's does not remain, to the last pixel."""
    old = built(tmp_path / "old", WHOLE, {"A": -70.0}, 7)
    new = built(tmp_path / "new", WHOLE.window(*window), {"A": None, "B": -60.0}, 9)
    row, col, rows, cols = window
    inside = np.zeros((WHOLE.rows, WHOLE.cols), dtype=bool)
    inside[row : row + rows, col : col + cols] = True
    merged = merge([old, new], tmp_path / "merged")
    np.testing.assert_array_equal(mask_of(merged, "A"), ~inside)
    np.testing.assert_array_equal(mask_of(merged, "B"), inside)
    points = merged.points()
    np.testing.assert_array_equal(points.way_id, np.where(inside, 9, 7).ravel())
    np.testing.assert_array_equal(points.distance_to_way_m, np.where(inside, 9, 7).ravel())
    # The other way round, the whole area is that of the later one; its plan knows no B.
    again = merge([new, old], tmp_path / "again")
    assert mask_of(again, "A").all()
    np.testing.assert_array_equal(mask_of(again, "B"), inside)
    assert set(again.points().way_id.tolist()) == {7}


def test_of_points_that_two_databases_have_there_is_one(tmp_path):
    west = built(tmp_path / "west", WHOLE.window(0, 0, 14, 9), {"A": -70.0}, 1)
    east = built(tmp_path / "east", WHOLE.window(2, 6, 12, 11), {"A": -80.0}, 2)
    merged = merge([west, east], tmp_path / "merged")
    assert merged.lattice == WHOLE
    row, col, level_dbm = merged.cell_points("A", np.inf)
    assert len(merged.points()) == row.size == 14 * 9 + 12 * 11 - 12 * 3
    later = (row >= 2) & (col >= 6)
    np.testing.assert_array_equal(level_dbm, np.where(later, np.float32(-80), np.float32(-70)))


def test_every_misfit_is_told_at_once(tmp_path):
    """Each with the database that it is found in."""
    first = built(tmp_path / "first", WHOLE, {"A": -70.0, "B": -75.0}, 1)
    moved = CellPlan(CRS, tuple(replace(c, north_m=c.north_m + 1.0) for c in PLAN.cells))
    levels_dbm = {"B": -70.0, "A": -71.0}
    odd = {"plan": moved, "floor_dbm": -99.0, "margin_db": 4.5}
    other = built(tmp_path / "other", WHOLE, levels_dbm, 1, **odd)
    with pytest.raises(InputError) as caught:
        merge([first, other], tmp_path / "merged", without=["X", "A"])
    found = [(fault.where, fault.expected, fault.got) for fault in caught.value.faults]
    compared = f"{other.path}, compared with {first.path}"
    assert found == [
        (compared, "margin_db 6", "4.5"),
        (compared, "floor_dbm -100", "-99"),
        (f"{other.path}, cell 'B'", "one place", "another one in an earlier database"),
        (f"{other.path}, cell 'A'", "one place", "another one in an earlier database"),
        ("without", "a cell of the databases", "'X'"),
    ]
    with pytest.raises(InputError) as caught:
        merge([first], tmp_path / "merged", without=["A", "X", "B"])
    assert [fault.got for fault in caught.value.faults] == ["'X'"]
    assert not (tmp_path / "merged").exists()


def test_a_folder_with_other_files_is_kept(tmp_path):
    database = built(tmp_path / "one", WHOLE, {"A": -70.0}, 1)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("years of work")
    with pytest.raises(OutputError, match=r"thesis\.txt"):
        merge([database], tmp_path / "mine")
    assert (tmp_path / "mine" / "thesis.txt").read_text() == "years of work"


def test_every_licence_is_named_once(tmp_path):
    names = ("(c) OpenStreetMap", "", "(c) City", "(c) OpenStreetMap")
    databases = [
        built(tmp_path / str(n), WHOLE, {"A": -70.0}, n + 1, attribution=name)
        for n, name in enumerate(names)
    ]
    assert [database.attribution for database in databases] == list(names)
    merged = merge(databases, tmp_path / "merged")
    assert merged.attribution == "(c) OpenStreetMap; (c) City"


def test_parameters_of_a_merged_database_are_those_of_its_parts(tmp_path):
    options = {"margin_db": 3.5, "floor_dbm": -95.0, "tile_px": 5}
    one = built(tmp_path / "one", WHOLE.window(0, 0, 14, 9), {"A": -70.0}, 1, **options)
    two = built(tmp_path / "two", WHOLE.window(0, 9, 14, 8), {"A": -94.0, "B": -90.0}, 1, **options)
    merged = merge([one, two], tmp_path / "merged")
    assert merged.manifest["parameters"] == options
    assert (merged.margin_db, merged.floor_dbm) == (3.5, -95.0)
    # A point belongs to A only where A is alone: beside B it is 4 dB weaker.
    assert set(merged.cell_points("A")[1].tolist()) == set(range(9))
    assert merged.cell_points("A", 4.0)[0].size == 14 * 17


def test_deviations_are_kept_beside_later_databases_and_of_cells_that_these_lack():
    """To the last pixel: of A within two areas, of which the second has no B."""
    row, col = (axis.ravel().astype(np.int32) for axis in np.mgrid[: WHOLE.rows, : WHOLE.cols])
    cell = np.repeat(np.arange(2, dtype=np.int32), row.size)
    both = np.tile(row, 2), np.tile(col, 2)
    found = Deviations(("A", "B"), cell, *both, np.arange(cell.size, dtype=np.float32))
    later = [
        SimpleNamespace(lattice=WHOLE.window(*window), plan=make_plan(cells))
        for window, cells in (((3, 5, 6, 7), ("A", "B", "C")), ((0, 10, 14, 4), ("A",)))
    ]
    kept = _not_overridden(MeasuredParts(None, found), WHOLE, later).deviations
    masks = {}
    for number, name in enumerate(found.cell_ids):
        masks[name] = np.zeros((WHOLE.rows, WHOLE.cols), dtype=bool)
        own = kept.cell == number
        masks[name][kept.row[own], kept.col[own]] = True
    expected = np.ones((WHOLE.rows, WHOLE.cols), dtype=bool)
    expected[3:9, 5:12] = False
    np.testing.assert_array_equal(masks["B"], expected)
    expected[:, 10:14] = False
    np.testing.assert_array_equal(masks["A"], expected)
    assert len(_not_overridden(MeasuredParts(None, found), WHOLE, []).deviations) == len(found)
