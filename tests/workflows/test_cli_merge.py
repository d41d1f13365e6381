"""Merging and exporting databases, and building them on a cluster, from the command line."""

import json
import shutil

import geopandas as gpd
import pytest
import rasterio
from command_line import assert_done, assert_refused, contents, mapfilter

from mapfilter.database.store import open_database


def test_a_database_without_a_cell(world, tmp_path):
    out = tmp_path / "new folder" / "db"
    given = ("merge", world.database, "--without-cell", "B", "--out", out, "--json")
    found = assert_done(mapfilter(*given)).json
    assert found["cells"] == 2
    assert open_database(out, verify="full").cell_ids == ("A", "C")
    assert (
        assert_done(mapfilter("info", out, "--json")).json["counts"]["points_off_rasters"] is None
    )
    again = tmp_path / "again"
    back = assert_done(mapfilter("merge", out, world.database, "--out", again, "--json")).json
    whole = open_database(world.database)
    assert back["points"] == len(whole.points())
    assert set(open_database(again).cell_ids) == set(whole.cell_ids)


def test_databases_that_cannot_be_merged(world, tmp_path):
    out = ("--out", tmp_path / "db")
    assert_refused(mapfilter("merge", tmp_path / "none", world.database, *out), "none")
    assert_refused(
        mapfilter("merge", world.database, "--without-cell=X", *out), "--without-cell, ", "'X'"
    )
    assert not (tmp_path / "db").exists()


@pytest.mark.parametrize("inside", ["", "merged"])
def test_no_database_is_merged_into_one_of_its_inputs(own_world, tmp_path, inside):
    before = contents(own_world.database)
    link = tmp_path / "link"
    link.symlink_to(own_world.database)
    for out in (own_world.database / inside, link / inside):
        refused = mapfilter("merge", own_world.database, "--without-cell", "B", "--out", out)
        assert_refused(refused, "--out: expected a folder outside", "which is an input")
    twice = mapfilter("merge", own_world.database, own_world.database, "--out", own_world.database)
    assert twice.err.count("which is an input") == 1
    assert contents(own_world.database) == before


def test_an_export_replaces_an_export_and_nothing_else(own_world, tmp_path):
    database = own_world.database
    for name in ("points.gpkg", "best.tif"):
        assert_done(mapfilter("export", database, "--to", tmp_path / name))
        first = (tmp_path / name).read_bytes()
        assert_done(mapfilter("export", database, "--to", tmp_path / name))
        assert (tmp_path / name).read_bytes() == first
    edited = gpd.read_file(tmp_path / "points.gpkg", layer="cells")
    edited["height_m"] += 1
    edited.to_file(tmp_path / "points.gpkg", layer="cells")
    gpd.GeoDataFrame(geometry=[], crs="EPSG:32635").to_file(tmp_path / "roads.gpkg")
    shutil.copy(own_world.rasters, tmp_path / "rxlev.tif")
    (tmp_path / "notes.tif").write_text("no raster")
    (tmp_path / "folder.gpkg").mkdir()
    before = contents(tmp_path)
    for name in ("points.gpkg", "roads.gpkg", "rxlev.tif", "notes.tif", "folder.gpkg"):
        refused = mapfilter("export", database, "--to", tmp_path / name)
        assert_refused(refused, f"{name}: expected nothing yet, or an older export")
    assert contents(tmp_path) == before
    inside = mapfilter("export", database, "--to", database / "points.gpkg")
    assert_refused(inside, "--to: expected a folder outside", "which is an input")


def test_best_server_as_geotiff(world, tmp_path):
    file = tmp_path / "best.tif"
    assert_done(mapfilter("export", world.database, "--to", file))
    with rasterio.open(file) as source:
        assert json.loads(source.tags()["CELLS"]) == ["A", "B", "C"]
        assert source.count == 3
    shown = assert_done(mapfilter("info", file, "--json")).json
    assert (shown["kind"], shown["bands"][0]) == ("best servers", "best_server")


def test_info_knows_a_geopackage(world, tmp_path):
    assert_done(mapfilter("export", world.database, "--to", tmp_path / "points.gpkg"))
    layers = assert_done(mapfilter("info", tmp_path / "points.gpkg", "--json")).json["layers"]
    shown = {one["layer"]: (one["geometry"], one["features"]) for one in layers}
    points = mapfilter("info", world.database, "--json").json["points"]
    assert shown == {"points": ("Point", points), "cells": ("Point", 3)}


def test_resume_of_nothing_is_a_build(own_world):
    before = contents(own_world.database)
    assert_done(mapfilter("build", "-c", own_world.toml, "--resume"))
    assert contents(own_world.database) == before


@pytest.mark.filterwarnings("default")
def test_a_cluster_gives_the_same_bytes(own_world):
    before = contents(own_world.database)
    assert_done(mapfilter("build", "-c", own_world.toml, "--cluster", "local:1"))
    assert contents(own_world.database) == before


def test_a_wrong_cluster(world):
    assert_refused(mapfilter("build", "-c", world.toml, "--cluster", "local:x"), "local:N")


def test_cells_that_differ_between_databases_are_noted(own_world, world, tmp_path):
    text = own_world.plan.read_text()
    lines = text.splitlines()
    at = lines[0].split(",").index("eirp_dbm")
    row = lines[1].split(",")
    before, row[at] = row[at], "33.25"
    own_world.plan.write_text("\n".join([lines[0], ",".join(row), *lines[2:]]) + "\n")
    assert_done(mapfilter("build", "-c", own_world.toml))
    given = "merge", world.database, own_world.database, "--out", tmp_path / "db"
    (note,) = assert_done(mapfilter(*given, "--json")).json["notes"]
    cell = row[lines[0].split(",").index("cell")]
    assert "1 cell differs from an earlier database, and the later entry is kept: " in note
    assert f"{cell} (eirp_dbm {float(before):g}, now 33.25)" in note
