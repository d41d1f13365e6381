"""Databases written anew: points and levels as they were, and with other ones."""

from dataclasses import replace

import numpy as np
import pytest
from small_world import FLOOR_DBM, IDS, LATTICE

from mapfilter.database.manifest import InputFile
from mapfilter.database.rewrite import levels_of, rewrite, routes_of
from mapfilter.database.store import open_database
from mapfilter.errors import InputError, OutputError
from mapfilter.radio.cells import CellPlan


def assert_points_are_those_of(found, expected):
    for name in ("point", "row", "col", "way_id", "on_square", "distance_to_way_m",
                 "best_server", "best_level_dbm", "margin_db"):  # fmt: skip
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
    names = [[one.way_class[1][n] for n in one.way_class[0]] for one in (found, expected)]
    assert names[0] == names[1]


def assert_levels_are(database, cell_ids, level_dbm):
    """Levels (cells, points) of the cells at the database's points, NaN where there is none."""
    points = database.points()
    for cell_id, own in zip(cell_ids, level_dbm, strict=True):
        row, col, found_dbm = database.cell_points(cell_id, np.inf)
        at = np.searchsorted(points.point, row.astype(np.int64) * LATTICE.cols + col)
        expected = np.full(len(points), np.nan)
        expected[at] = found_dbm
        np.testing.assert_allclose(expected, own, atol=1e-5)


def test_the_levels_of_all_cells_at_all_points(database):
    found = levels_of(database)
    assert found.shape == (3, len(database.points()))
    assert found.dtype == np.float32
    assert 0 < np.isnan(found).mean() < 1
    assert_levels_are(database, IDS, found)
    points = database.points()
    best = np.nanmax(found, axis=0)
    np.testing.assert_array_equal(best, points.best_level_dbm)


def test_the_points_are_the_lattice_that_they_were_built_from(database):
    routes, points = routes_of(database), database.points()
    assert routes.lattice == LATTICE
    for name in ("row", "col", "way_id", "distance_to_way_m", "on_square"):
        np.testing.assert_array_equal(getattr(routes, name), getattr(points, name))
    codes, names = points.way_class
    assert [routes.class_names[n] for n in routes.way_class] == [names[n] for n in codes]


def rewritten(database, out, **changes):
    given = {
        "plan": database.plan, "routes": routes_of(database), "level_dbm": levels_of(database),
    } | changes  # fmt: skip
    return rewrite(database, out, **given)


def test_a_database_that_is_written_anew_is_the_same(database, tmp_path):
    """In tiles of 16 pixels, of which some hold no point."""
    found = rewritten(database, tmp_path / "again")
    assert_points_are_those_of(found.points(), database.points())
    assert_levels_are(found, IDS, levels_of(database))
    assert open_database(tmp_path / "again", verify="full").generation == found.generation
    for name in ("margin_db", "floor_dbm", "lattice", "attribution", "cell_ids"):
        assert getattr(found, name) == getattr(database, name)
    assert found.manifest["parameters"] == database.manifest["parameters"]
    assert found.manifest["counts"] == {
        "points": len(database.points()), "points_below_floor": 0, "points_off_rasters": None,
        "points_without_level": 0,
    }  # fmt: skip
    assert found.measured() is None


def test_its_inputs_are_the_old_one_and_what_is_given(database, tmp_path):
    extra = InputFile("database", "journeys", "ab" * 32)
    found = rewritten(database, tmp_path / "again", inputs=(extra,))
    assert [(one["role"], one["name"], one["sha256"]) for one in found.manifest["inputs"]] == [
        ("database", database.path.name, database.generation), ("database", "journeys", "ab" * 32),
    ]  # fmt: skip


def test_other_levels_and_fewer_cells(database, tmp_path):
    """Those below the floor are left out, and points that then receive nothing."""
    cells = (database.plan.cells[2], database.plan.cells[0])
    plan = CellPlan(database.plan.crs, cells)
    count = len(database.points())
    level_dbm = np.full((2, count), -70.0, dtype=np.float32)
    level_dbm[0, ::2] = FLOOR_DBM - 0.5
    level_dbm[1, 1::2] = np.nan
    level_dbm[1] -= np.arange(count, dtype=np.float32) / 100
    level_dbm[:, 5:9] = np.nan
    level_dbm[:, 10:13] = FLOOR_DBM - 1
    found = rewritten(database, tmp_path / "other", plan=plan, level_dbm=level_dbm)
    kept = np.delete(np.arange(count), np.arange(5, 9))
    assert count > 13
    kept = kept[
        np.nanmax(np.where(level_dbm >= FLOOR_DBM, level_dbm, -np.inf), axis=0)[kept] > -np.inf
    ]
    np.testing.assert_array_equal(found.points().point, database.points().point[kept])
    assert found.manifest["counts"]["points"] == kept.size
    assert found.manifest["counts"]["points_without_level"] == 4
    assert found.manifest["counts"]["points_below_floor"] == count - kept.size - 4
    assert found.cell_ids == tuple(cell.id for cell in cells)
    expected = np.where(level_dbm >= FLOOR_DBM, level_dbm, np.nan)[:, kept]
    assert_levels_are(found, found.cell_ids, expected)


def test_further_points(database, tmp_path):
    """Beside the old ones, with a level of their own."""
    routes, points = routes_of(database), database.points()
    free = np.setdiff1d(np.arange(LATTICE.rows * LATTICE.cols), points.point)[::37]
    number = np.concatenate([points.point, free])
    order = np.argsort(number)
    more = replace(
        routes,
        row=(number // LATTICE.cols).astype(np.int32)[order],
        col=(number % LATTICE.cols).astype(np.int32)[order],
        way_id=np.concatenate([routes.way_id, 900 + np.arange(free.size)])[order],
        way_class=np.concatenate([routes.way_class, np.zeros(free.size, np.int16)])[order],
        distance_to_way_m=np.concatenate([routes.distance_to_way_m, np.ones(free.size, "f4")])[
            order
        ],
        on_square=np.concatenate([routes.on_square, np.zeros(free.size, bool)])[order],
    )
    extra = -60.0 - np.arange(3 * free.size, dtype=np.float32).reshape(3, -1) / 50
    level_dbm = np.concatenate([levels_of(database), extra], axis=1)[:, order]
    found = rewritten(database, tmp_path / "more", routes=more, level_dbm=level_dbm)
    np.testing.assert_array_equal(found.points().point, number[order])
    np.testing.assert_array_equal(found.points().way_id, more.way_id)
    assert_levels_are(found, IDS, level_dbm)


def test_what_cannot_be_written(database, tmp_path):
    quiet = np.full((3, len(database.points())), FLOOR_DBM - 1, dtype=np.float32)
    with pytest.raises(InputError, match="a level above the floor, found none"):
        rewritten(database, tmp_path / "quiet", level_dbm=quiet)
    assert not (tmp_path / "quiet").exists()
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "mine.txt").write_text("mine")
    with pytest.raises(OutputError):
        rewritten(database, tmp_path / "other")
    assert (tmp_path / "other" / "mine.txt").read_text() == "mine"
