"""Databases of one point: the fewest that are a database, however it is made."""

import numpy as np
import pytest
from small_world import CRS, IDS, LATTICE, make_plan, make_world

from mapfilter.database.build import build, build_roads
from mapfilter.database.export import export_cog, export_geopackage
from mapfilter.database.merge import merge
from mapfilter.database.rewrite import levels_of, rewrite, routes_of
from mapfilter.database.store import info, open_database
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.lattice import RouteLattice

ROW, COL = 17, 23


def one_point():
    at = np.array([ROW], np.int32), np.array([COL], np.int32)
    way = np.array([7]), np.zeros(1, np.int16), ("path",)
    return RouteLattice(LATTICE, *at, *way, np.ones(1, np.float32), np.zeros(1, bool))


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    folder = tmp_path_factory.mktemp("one")
    world = make_world(folder)
    return build(world.rasters, world.plan, one_point(), folder / "db", floor_dbm=-150.0)


def assert_one(database, levels):
    points = open_database(database.path, verify="full").points()
    assert (points.row.tolist(), points.col.tolist()) == ([ROW], [COL])
    assert points.point.tolist() == [ROW * LATTICE.cols + COL]
    found = info(database)
    assert (found["points"], found["levels"]) == (1, levels)
    assert (found["rows"], found["cols"], found["resolution_m"]) == (40, 50, 5.0)
    assert (found["crs"], tuple(found["bounds_m"])) == (CRS, LATTICE.bounds_m)


def test_built_merged_and_written_anew(database, tmp_path):
    assert_one(database, 3)
    assert_one(merge([database], tmp_path / "merged"), 3)
    again = rewrite(
        database, tmp_path / "again", database.plan, routes_of(database), levels_of(database)
    )
    assert_one(again, 3)
    field = again.field()
    assert field.cell_ids == IDS
    assert len(np.unique(field.level_dbm.reshape(-1, 3), axis=0)) == 1


def test_of_roads_alone(tmp_path):
    roads = build_roads(one_point(), tmp_path / "roads")
    assert_one(roads, 0)
    assert np.isnan(roads.points().best_level_dbm).all()


def test_of_one_cell_alone(tmp_path):
    """It has no second level, so the margin is unknown, and it is the best server."""
    values = np.full((40, 50), -70.0)
    write_rasters(tmp_path / "r.tif", LATTICE, [(IDS[0], values)], IDS[:1])
    rasters = open_rasters(tmp_path / "r.tif")
    one = build(rasters, make_plan(IDS[:1]), one_point(), tmp_path / "db")
    assert_one(one, 1)
    points = one.points()
    assert (points.best_server.tolist(), points.best_level_dbm.tolist()) == ([0], [-70.0])
    assert np.isnan(points.margin_db).all()


def test_exported(database, tmp_path):
    export_geopackage(database, tmp_path / "one.gpkg", cells=IDS)
    export_cog(database, tmp_path / "one.tif")
    assert (tmp_path / "one.tif").stat().st_size > 0
