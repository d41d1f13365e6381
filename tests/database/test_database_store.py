"""Opening databases: what is whole, what is refused, and what is exported."""

import json
import pickle
import shutil

import geopandas
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_world import CRS, FLOOR_DBM, IDS, LATTICE, make_database, make_plan, make_world

from mapfilter.database.store import (
    export_geopackage,
    info,
    levels_folder,
    open_database,
    read_cells,
    write_cells,
)
from mapfilter.errors import InputError, OutputError, StoreError


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    return make_world(tmp_path_factory.mktemp("rasters"))


@pytest.fixture(scope="module")
def database(world, tmp_path_factory):
    return make_database(world, tmp_path_factory.mktemp("built"))


@pytest.fixture
def copy(database, tmp_path):
    shutil.copytree(database.path, tmp_path / "db")
    return tmp_path / "db"


def change_manifest(folder, **changes):
    manifest = json.loads((folder / "manifest.json").read_text())
    (folder / "manifest.json").write_text(json.dumps({**manifest, **changes}))


def test_what_was_built_is_what_is_opened(database, world):
    again = open_database(database.path, verify="full")
    assert again.lattice == LATTICE
    assert again.plan == world.plan
    assert again.cell_ids == IDS
    assert (again.margin_db, again.floor_dbm) == (6.0, FLOOR_DBM)
    np.testing.assert_array_equal(again.points().point, database.points().point)


def test_one_cell_is_read_without_the_rest(copy):
    database = open_database(copy)
    (copy / "points.parquet").unlink()
    for cell in IDS[1:]:
        shutil.rmtree(copy / levels_folder(cell), ignore_errors=True)
    assert database.cell_points(IDS[0])[0].size > 0


def test_cells_survive_the_table(tmp_path):
    plan = make_plan(mcc=262, bsic=12, arfcn=871, indoor=True, penetration_loss_db=15.5)
    write_cells(plan, tmp_path / "cells.parquet")
    assert read_cells(tmp_path / "cells.parquet", CRS) == plan


@given(st.text(min_size=1, max_size=128))
def test_no_cell_id_leads_out_of_the_folder(cell_id):
    folder = levels_folder(cell_id)
    head, name = folder.split("/")
    assert head == "levels"
    assert 0 < len(name) <= 255
    assert not set(name) & set("/\\.\0:*?")


def test_no_two_ids_share_a_folder():
    ids = ["a", "a.", "a%2E", "A b", "A+b", "é", "x" * 128, "ü" * 100, "ü" * 101]
    assert len({levels_folder(i) for i in ids}) == len(ids)


def test_a_missing_database(tmp_path):
    with pytest.raises(StoreError, match="mistyped"):
        open_database(tmp_path / "none")
    with pytest.raises(StoreError, match="not a database folder"):
        open_database(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match="a file"):
        open_database(tmp_path / "file")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"version": 2}, "newer"),
        ({"format": "something else"}, "format"),
        ({"parts": []}, "points.parquet"),
        ({"parts": [{"path": "../../x", "bytes": 1}]}, "within the folder"),
        ({"parts": 5}, "edited or damaged"),
        ({"lattice": {}}, "edited or damaged"),
        ({"parameters": {}}, "edited or damaged"),
        ({"cells": ["x"]}, "mixed up"),
    ],
)
def test_manifests_that_are_refused(copy, changes, message):
    change_manifest(copy, **changes)
    with pytest.raises(StoreError, match=message):
        open_database(copy)


def test_a_manifest_that_is_cut_off(copy):
    text = (copy / "manifest.json").read_text()
    (copy / "manifest.json").write_text(text[: len(text) // 2])
    with pytest.raises(StoreError, match="cut off"):
        open_database(copy)


def test_parts_missing_or_cut_off_are_all_named(copy):
    (copy / "points.parquet").unlink()
    part = copy / levels_folder(IDS[0]) / "part-0.parquet"
    part.write_bytes(part.read_bytes()[:-1])
    with pytest.raises(StoreError) as caught:
        open_database(copy)
    assert "points.parquet" in str(caught.value)
    assert "part-0.parquet" in str(caught.value)
    assert "cut off" in str(caught.value)


def test_a_changed_byte_is_found_by_the_full_check(copy):
    part = copy / levels_folder(IDS[1]) / "part-0.parquet"
    content = bytearray(part.read_bytes())
    content[len(content) // 2] ^= 1
    part.write_bytes(bytes(content))
    open_database(copy)
    with pytest.raises(StoreError, match="SHA-256"):
        open_database(copy, verify="full")


def test_unknown_cells_and_odd_margins(database):
    with pytest.raises(InputError, match="'nobody'"):
        database.cell_points("nobody")
    for margin_db in (-1.0, np.nan):
        with pytest.raises(InputError, match="margin_db"):
            database.cell_points(IDS[0], margin_db)


def test_info_adds_up(database):
    told = info(database)
    assert json.loads(json.dumps(told)) == told
    assert told["points"] == len(database.points())
    assert told["levels"] == sum(database.cell_points(c, np.inf)[0].size for c in IDS)
    size = sum(p.stat().st_size for p in database.path.rglob("*.parquet"))
    assert told["bytes"] == size


def test_databases_travel_to_other_processes(database):
    database.points()
    sent = pickle.dumps(database)
    assert len(sent) < 20_000
    again = pickle.loads(sent)
    np.testing.assert_array_equal(again.points().point, database.points().point)


def test_geopackage(database, tmp_path):
    target = tmp_path / "out" / "db.gpkg"
    export_geopackage(database, target, cells=(IDS[0],))
    points = geopandas.read_file(target, layer="points")
    assert points.crs == CRS
    np.testing.assert_array_equal(points["point"], database.points().point)
    cells = geopandas.read_file(target, layer="cells")
    assert cells["id"].tolist() == list(IDS)
    one = geopandas.read_file(target, layer=f"cell {IDS[0]}")
    np.testing.assert_array_equal(one["row"], database.cell_points(IDS[0])[0])
    first = target.read_bytes()
    export_geopackage(database, target, cells=(IDS[0],))
    assert target.read_bytes() == first
    with pytest.raises(OutputError, match="gpkg"):
        export_geopackage(database, tmp_path / "db.shp")
