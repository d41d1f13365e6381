"""Databases of roads alone: all points, no cells, and what cannot be done with them."""

import numpy as np
import pyogrio
import pytest
from small_world import CRS, LATTICE, make_routes

from mapfilter.database.build import build_roads
from mapfilter.database.export import export_cog, export_geopackage
from mapfilter.database.merge import merge
from mapfilter.database.sources import LatticeRoutes
from mapfilter.database.store import info, open_database
from mapfilter.errors import InputError, OutputError
from mapfilter.positioning.bayes.area.opened_area import open_area


@pytest.fixture(scope="module")
def roads(tmp_path_factory):
    return build_roads(make_routes(), tmp_path_factory.mktemp("roads") / "database", tile_px=16)


def test_it_holds_every_point_of_the_roads_and_no_cell(roads):
    routes, points = make_routes(), open_database(roads.path, verify="full").points()
    assert np.array_equal(points.point, routes.point)
    assert np.array_equal(points.distance_to_way_m, routes.distance_to_way_m)
    assert np.array_equal(points.way_id, routes.way_id)
    assert np.all(points.best_server == -1)
    assert np.all(np.isnan(points.margin_db))
    assert (roads.cell_ids, len(roads.plan), roads.lattice) == ((), 0, LATTICE)
    assert not roads.level_parts
    described = info(roads)
    assert (described["points"], described["levels"]) == (len(routes), 0)
    assert described["levels_per_cell"] == {}


def test_tiles_do_not_show(roads, tmp_path):
    whole = build_roads(LatticeRoutes(make_routes()), tmp_path / "whole", tile_px=4096)
    ours, theirs = roads.points(), whole.points()
    assert all(
        np.array_equal(getattr(ours, name), getattr(theirs, name), equal_nan=True)
        for name in ("point", "way_id", "distance_to_way_m", "on_square", "margin_db")
    )


def test_the_filters_map_of_it_has_ways_alone(roads):
    area = open_area(roads)
    assert (area.cell_ids, area.level_dbm.shape[-1]) == ((), 2)
    assert np.array_equal(area.on_way, make_routes().mask())
    assert area.distance_m[area.on_way].min() == 0


def test_an_older_database_is_replaced_and_nothing_else(tmp_path):
    build_roads(make_routes(), tmp_path / "database")
    again = build_roads(make_routes(), tmp_path / "database")
    assert again.manifest["counts"]["points"] == len(make_routes())
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("years of work")
    with pytest.raises(OutputError):
        build_roads(make_routes(), tmp_path / "mine")
    assert (tmp_path / "mine" / "thesis.txt").read_text() == "years of work"


def test_points_are_exported_and_best_servers_refused(roads, tmp_path):
    export_geopackage(roads, tmp_path / "roads.gpkg")
    assert [name for name, _ in pyogrio.list_layers(tmp_path / "roads.gpkg")] == ["points"]
    table = pyogrio.read_dataframe(tmp_path / "roads.gpkg")
    assert len(table) == len(make_routes())
    assert table.crs == CRS
    with pytest.raises(InputError, match="roads alone"):
        export_cog(roads, tmp_path / "roads.tif")
    assert not (tmp_path / "roads.tif").exists()


def test_merging_it_is_refused(roads, tmp_path):
    with pytest.raises(InputError, match="a database with cells"):
        merge([roads, roads], tmp_path / "merged")
    assert not (tmp_path / "merged").exists()
