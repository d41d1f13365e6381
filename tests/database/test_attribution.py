"""The map's licence: from the roads into the database, and to all that shows or exports it."""

from dataclasses import replace

import pytest
import rasterio
from small_world import FLOOR_DBM, IDS, make_routes

from mapfilter.database.build import build, build_roads
from mapfilter.database.export import export_cog
from mapfilter.database.rewrite import routes_of
from mapfilter.database.sources import LatticeRoutes
from mapfilter.database.store import open_database

OSM = "© OpenStreetMap contributors"


@pytest.fixture(scope="module")
def database(world, tmp_path_factory):
    routes = replace(world.routes, attribution=OSM)
    out = tmp_path_factory.mktemp("built") / "db"
    return build(world.rasters, world.plan, routes, out, floor_dbm=FLOOR_DBM)


def test_that_of_the_roads_is_kept(world, database, tmp_path):
    assert database.attribution == open_database(database.path).attribution == OSM
    assert routes_of(database).attribution == OSM
    cut = LatticeRoutes(routes_of(database))
    assert build(world.rasters, world.plan, cut, tmp_path / "cut").attribution == OSM
    for number, routes in enumerate((cut.points, cut)):
        assert build_roads(routes, tmp_path / f"{number}").attribution == OSM


@pytest.mark.parametrize("given", ["© City of Porto", ""])
def test_one_that_is_given_counts_instead(world, tmp_path, given):
    routes = replace(make_routes(), attribution=OSM)
    built = build(world.rasters, world.plan, routes, tmp_path / "db", attribution=given)
    roads = build_roads(routes, tmp_path / "roads", attribution=given)
    assert (built.attribution, roads.attribution) == (given, given)


def test_pictures_and_rasters_carry_it(world, database, tmp_path):
    plain = build(world.rasters, world.plan, world.routes, tmp_path / "db", floor_dbm=FLOOR_DBM)
    for one, expected in ((database, OSM), (plain, None)):
        export_cog(one, tmp_path / "best.tif")
        with rasterio.open(tmp_path / "best.tif") as source:
            assert source.tags().get("TIFFTAG_COPYRIGHT") == expected
        assert (OSM in one._repr_html_()) == (expected is not None)


def test_notebooks_show_a_table(database):
    shown = database._repr_html_()
    points = len(database.points())
    rows = {
        "points": points, "cells": f"3: {', '.join(IDS)}", "margin": "6 dB", "floor": "-90 dBm",
        "map": OSM, "folder": database.path, "lattice": database.lattice,
    }  # fmt: skip
    for name, value in rows.items():
        assert f"<tr><th>{name}</th><td>{value}</td></tr>" in shown
    assert shown.startswith("<p><b>Radio-route database</b></p><table>")
    roads = database.without_cells()
    assert "<tr><th>cells</th><td>none</td></tr>" in roads._repr_html_()
    assert len(roads.points()) == points
    assert roads.measured() is None
