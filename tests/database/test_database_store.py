"""Opening databases: what is whole, what is refused, and what is exported."""

import json
import pickle
import shutil

import geopandas
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_world import CRS, FLOOR_DBM, IDS, LATTICE, change_manifest, make_plan

from mapfilter._json_files import sealed
from mapfilter.database.export import export_geopackage
from mapfilter.database.manifest import apart, levels_folders
from mapfilter.database.store import info, open_database, read_cells, write_cells
from mapfilter.errors import InputError, OutputError, StoreError


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
        shutil.rmtree(copy / levels_folders([cell])[cell], ignore_errors=True)
    assert database.cell_points(IDS[0])[0].size > 0


def test_cells_survive_the_table(tmp_path):
    plan = make_plan(mcc=262, bsic=12, arfcn=871, indoor=True, penetration_loss_db=15.5)
    write_cells(plan, tmp_path / "cells.parquet")
    assert read_cells(tmp_path / "cells.parquet", CRS) == plan


@given(st.text(min_size=1, max_size=128))
def test_no_cell_id_leads_out_of_the_folder(cell_id):
    folder = levels_folders([cell_id])[cell_id]
    head, name = folder.split("/")
    assert head == "levels"
    assert 0 < len(name) <= 255
    assert not set(name) & set("/\\.\0:*?")


def test_no_two_ids_share_a_folder():
    ids = ["a", "a.", "a%2E", "A b", "A+b", "é", "x" * 128, "ü" * 100, "ü" * 101]
    assert len(set(levels_folders(ids).values())) == len(ids)


def test_names_that_differ_in_case_only_are_kept_apart():
    folders = levels_folders(["s1a", "S1A", "S2"])
    assert folders["S2"] == "levels/S2"
    assert len({folder.lower() for folder in folders.values()}) == 3
    assert levels_folders(["S2", "S1A", "s1a"]) == folders
    assert apart({"a": "x", "b": "y"}) == {"a": "x", "b": "y"}


def test_a_missing_database(tmp_path):
    with pytest.raises(StoreError, match="mistyped"):
        open_database(tmp_path / "none")
    with pytest.raises(StoreError, match="not a database folder"):
        open_database(tmp_path)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "manifest.json").touch()
    with pytest.raises(StoreError, match=rf"the database is {tmp_path / 'out'}\)"):
        open_database(tmp_path)
    with pytest.raises(StoreError, match=rf"a part of the database {tmp_path / 'out'}\)"):
        open_database(tmp_path / "out" / "manifest.json")
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match="a file"):
        open_database(tmp_path / "file")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"version": 3}, "newer"),
        ({"version": 1}, "older mapfilter; make it again"),
        ({"version": 0}, "version 2, found 0 .likely: edited"),
        ({"version": None}, "version 2, found None .likely: edited"),
        ({"format": "something else"}, "format"),
        ({"parts": []}, "points.parquet"),
        ({"parts": [{"path": "../../x", "bytes": 1}]}, "within the folder"),
        ({"parts": 5}, "edited or damaged"),
        ({"lattice": {}}, "edited or damaged"),
        ({"parameters": {}}, "edited or damaged"),
        ({"cells": ["x"]}, "a cell listed, found 'S1.A'"),
        ({"cells": ["S1.B", "S1.A", "I 1"]}, "mixed up"),
        ({"crs": "EPSG:32630"}, "crs: expected the lattice's CRS"),
    ],
)
def test_manifests_that_are_refused(copy, changes, message):
    change_manifest(copy, **changes)
    with pytest.raises(StoreError, match=message):
        open_database(copy)


@pytest.mark.parametrize(
    "key", ["software", "crs", "attribution", "inputs", "counts", "parameters", "lattice", "parts"]
)
def test_a_manifest_that_lacks_a_field(copy, key):
    manifest = json.loads((copy / "manifest.json").read_text())
    del manifest[key]
    (copy / "manifest.json").write_text(json.dumps(sealed(manifest)))
    with pytest.raises(StoreError, match=f"{key}: expected a value, found none"):
        open_database(copy)


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (("parts", 2, "rows"), "x", "parts.2.rows: expected a valid integer, found 'x'"),
        (("parts", 2, "rows"), 1.5, "parts.2.rows: expected a valid integer, found 1.5"),
        (("parts", 2, "rows"), True, "parts.2.rows"),
        (("parts", 2, "rows"), 7, "part-0.parquet: expected 7 rows"),
        (("parts", 2, "bytes"), -1, "parts.2.bytes"),
        (("parts", 2, "sha256"), "abc", "parts.2.sha256"),
        (("parts", 2, "cell"), "ZZ", "expected a cell listed, found 'ZZ'"),
        (("parts", 2, "cell"), "I 1", "expected a part in levels/I%201 for cell 'I 1'"),
        (("parts", 2, "cell"), None, "expected the cell whose part it is, found none"),
        (("parts", 2, "path"), "points.parquet", "points.parquet once, found 2 times"),
        (("parts", 1, "path"), "/etc/passwd", "expected a path within the folder"),
        (("parameters", "margin_db"), float("nan"), "margin_db: expected a finite number"),
        (("parameters", "margin_db"), "6", "margin_db: expected a valid number"),
        (("lattice", "rows"), 0, "lattice.rows"),
        (("lattice", "crs"), "EPSG:4326", "expected"),
        (("counts", "points"), 1, "points.parquet: expected 1 rows"),
        (("inputs", 0, "role"), "other", "inputs.0.role"),
    ],
)
def test_a_manifest_with_a_wrong_value(copy, place, value, message):
    manifest = json.loads((copy / "manifest.json").read_text())
    within = manifest
    for key in place[:-1]:
        within = within[key]
    within[place[-1]] = value
    (copy / "manifest.json").write_text(json.dumps(sealed(manifest)))
    with pytest.raises(StoreError) as caught:
        open_database(copy)
    assert message in str(caught.value)


def test_wrong_values_are_told_together(copy):
    change_manifest(copy, software=3, counts={}, cells="A")
    with pytest.raises(StoreError, match=r"(?s)software.*cells.*counts\.points:"):
        open_database(copy)


def test_a_manifest_that_is_cut_off(copy):
    text = (copy / "manifest.json").read_text()
    (copy / "manifest.json").write_text(text[: len(text) // 2])
    with pytest.raises(StoreError, match="cut off"):
        open_database(copy)


def test_parts_missing_or_cut_off_are_all_named(copy):
    (copy / "points.parquet").unlink()
    part = copy / levels_folders([IDS[0]])[IDS[0]] / "part-0.parquet"
    part.write_bytes(part.read_bytes()[:-1])
    with pytest.raises(StoreError) as caught:
        open_database(copy)
    assert "points.parquet" in str(caught.value)
    assert "part-0.parquet" in str(caught.value)
    assert "cut off" in str(caught.value)


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
