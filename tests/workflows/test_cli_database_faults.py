"""Damaged databases and outputs that cannot be written; nothing is lost and none half-written."""

import errno
import json
import resource
import shutil
import subprocess
import sys

import pytest
from command_line import assert_done, assert_refused, contents, mapfilter, settings

from mapfilter._json_files import sealed

KILLED_WHILE_WRITING = """
import os, signal, sys
import mapfilter.database.parts as assemble
def killed(plan, path):
    path.write_bytes(b"PAR1 half of")
    print(*sorted(p.name for p in path.parent.iterdir()), flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
assemble.write_cells = killed
sys.argv = ["mapfilter", *sys.argv[1:]]
from mapfilter.cli import main
main()
"""


def commands_on(world):
    """Every command that opens a database."""
    log = ["--log", world.journeys, "--out", world.folder / "replayed"]
    yield ["info", world.database]
    yield ["export", world.database, "--to", world.folder / "x.gpkg"]
    yield ["replay", "--db", world.database, *log]


def assert_all_refuse(world, *told):
    before = contents(world.folder)
    for command in commands_on(world):
        assert_refused(mapfilter(*command), *told)
    assert contents(world.folder) == before


@pytest.fixture
def manifest(own_world):
    """Change the manifest of the world's database."""
    file = own_world.database / "manifest.json"

    def change(**values):
        file.write_text(json.dumps(sealed({**json.loads(file.read_text()), **values})))

    return change


@pytest.mark.parametrize(
    ("version", "why"),
    [(1, "older"), (3, "newer"), (99, "newer"), ("2", "edited"), (None, "edited")],
)
def test_another_version(version, why, own_world, manifest):
    manifest(version=version)
    assert_all_refuse(own_world, f"manifest.json: expected version 2, found {version}", why)


def test_another_format(own_world, manifest):
    manifest(format="something else")
    assert_all_refuse(own_world, "manifest.json: expected format", "found something else")


@pytest.mark.parametrize(
    "values",
    [{"parts": 3}, {"lattice": {}}, {"cells": ["A"]}, {"parts": []}, {"software": None}],
)
def test_a_manifest_that_was_edited(values, own_world, manifest):
    manifest(**values)
    assert_all_refuse(own_world, "manifest.json")


@pytest.mark.parametrize("part", ["points.parquet", "cells.parquet", "levels/B/part-0.parquet"])
def test_a_part_removed_cut_off_or_changed(part, own_world):
    file = own_world.database / part
    whole = file.read_bytes()
    middle = len(whole) // 2
    file.write_bytes(whole[:middle])
    assert_all_refuse(own_world, part, f"found {middle} bytes (likely: cut off or overwritten)")
    file.write_bytes(whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :])
    assert_all_refuse(own_world, part, "SHA-256", "changed after it was written")
    file.unlink()
    assert_all_refuse(own_world, part, "found no such file")


def test_every_damaged_part_is_told(own_world):
    for part in ("points.parquet", "levels/A/part-0.parquet"):
        (own_world.database / part).unlink()
    assert_all_refuse(own_world, "points.parquet", "levels/A/part-0.parquet")


@pytest.mark.parametrize("size", [0, 40, None])
def test_manifest_missing_empty_or_cut_off(size, own_world):
    file = own_world.database / "manifest.json"
    text = file.read_bytes()
    file.unlink()
    if size is not None:
        file.write_bytes(text[:size])
    assert_all_refuse(own_world, "manifest.json")


def test_no_database_at_all(own_world):
    own_world.database.rename(own_world.folder / "moved")
    assert_all_refuse(own_world, "database: expected a database")
    own_world.database.mkdir()
    assert_all_refuse(own_world, "database: expected manifest.json")
    own_world.database.rmdir()
    own_world.database.write_text("a file")
    assert_all_refuse(own_world, "database: expected")


def test_a_build_killed_while_it_writes_leaves_the_old_database(own_world):
    before = contents(own_world.database)
    killed = subprocess.run(
        [sys.executable, "-c", KILLED_WHILE_WRITING, "build", "-c", str(own_world.toml),
         "--set=database.margin_db=1"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert killed.returncode == -9
    assert killed.stdout.split() == ["cells.parquet", "levels", "points.parquet"]
    left = [path.name for path in own_world.out.iterdir() if path.name.startswith(".database.p")]
    assert len(left) == 1
    assert contents(own_world.database) == before
    assert assert_done(mapfilter("info", own_world.database, "--json")).json["parameters"][
        "margin_db"
    ] == pytest.approx(6)
    assert_done(mapfilter("build", "-c", own_world.toml, "--set=database.margin_db=1"))
    assert not list(own_world.out.glob(".*"))
    assert contents(own_world.database) != before


def test_a_killed_first_build_leaves_nothing_that_looks_like_a_database(own_world):
    target = own_world.out / "other"
    subprocess.run(
        [sys.executable, "-c", KILLED_WHILE_WRITING, "build", "-c", str(own_world.toml),
         f"--set=database.path={target}"],
        capture_output=True, check=False,
    )  # fmt: skip
    assert not target.exists()
    assert_refused(mapfilter("info", target), "nothing there")


@pytest.mark.parametrize("command", ["predict", "build", "simulate", "replay", "demo"])
def test_a_file_in_the_way_of_the_output_folder(command, own_world):
    wall = own_world.folder / "wall"
    wall.write_text("keep me")
    before = contents(own_world.folder)
    given = [] if command == "demo" else ["-c", own_world.toml]
    if command == "replay":
        given += settings(
            rasters__path=own_world.rasters,
            rasters__ground_truth=own_world.out / "rxlev-ground-truth.tif",
            database__path=own_world.database,
            track__path=own_world.journeys,
        )
    if command in ("build", "simulate"):
        given += settings(rasters__path=own_world.rasters)
    refused = mapfilter(command, *given, "--out", wall / "deep")
    assert_refused(refused, "wall", "expected a place that can be written, found Not a directory")
    assert contents(own_world.folder) == before


def test_a_file_in_the_way_of_the_database_or_the_journeys(own_world):
    wall = own_world.folder / "wall"
    wall.write_text("keep me")
    before = contents(own_world.folder)
    for command, key in (("build", "database"), ("simulate", "track")):
        given = settings(**{f"{key}__path": wall})
        refused = mapfilter(command, "-c", own_world.toml, *given)
        assert_refused(refused, "wall: expected a folder, or nothing yet, found a file")
    assert contents(own_world.folder) == before


def test_a_folder_in_the_way_of_a_file(own_world):
    for name in ("rxlev.tif", "cells.csv"):
        folder = own_world.folder / name.replace(".", "-of-") / name
        (folder / "inner").mkdir(parents=True)
        given = ["--out", folder.parent]
        assert_refused(mapfilter("predict", "-c", own_world.toml, *given), name)
        assert (folder / "inner").is_dir()
    folder = own_world.folder / "x.gpkg"
    (folder / "inner").mkdir(parents=True)
    assert_refused(mapfilter("export", own_world.database, "--to", folder), "x.gpkg")
    assert (folder / "inner").is_dir()


@pytest.mark.parametrize(("command", "key"), [("build", "database"), ("simulate", "track")])
def test_a_folder_of_other_files_is_not_replaced(command, key, own_world):
    mine = own_world.folder / "mine"
    mine.mkdir()
    (mine / "thesis.tex").write_text("years of work")
    before = contents(own_world.folder)
    given = settings(**{f"{key}__path": mine})
    refused = mapfilter(command, "-c", own_world.toml, *given)
    assert_refused(refused, "mine: expected a", "other files", "mistyped path")
    assert contents(own_world.folder) == before


def test_a_database_path_that_also_holds_the_inputs(own_world):
    before = contents(own_world.folder)
    shutil.copytree(own_world.database, own_world.out, dirs_exist_ok=True)
    shutil.rmtree(own_world.database)
    before = contents(own_world.folder)
    refused = mapfilter("build", "-c", own_world.toml, *settings(database__path=own_world.out))
    assert_refused(refused, "out: expected a mapfilter radio-route database, or nothing yet")
    assert contents(own_world.folder) == before


def test_a_file_beside_the_tables_of_a_simulated_log(own_world):
    notes = next(own_world.journeys.iterdir()) / "notes.txt"
    notes.write_text("mine")
    before = contents(own_world.folder)
    assert_refused(mapfilter("simulate", "-c", own_world.toml), "other files (notes.txt)")
    assert contents(own_world.folder) == before


def test_a_log_made_by_hand_among_simulated_ones(own_world):
    folder = own_world.journeys / "my-walk"
    folder.mkdir()
    (folder / "log.json").write_text('{"crs": "EPSG:32635"}')
    assert_refused(mapfilter("simulate", "-c", own_world.toml), "my-walk", "other files (log.json)")
    assert folder.is_dir()


@pytest.mark.parametrize("name", ["x.gpk", "x", "x.png", "x.GPKG.zip"])
def test_export_to_another_kind_of_file(name, world, tmp_path):
    refused = mapfilter("export", world.database, "--to", tmp_path / name)
    assert_refused(refused, f"{name}: expected a name that ends in .gpkg or .tif, found")
    assert not contents(tmp_path)


def test_rasters_under_another_name(own_world, tmp_path):
    given = settings(rasters__path=tmp_path / "rxlev.png")
    refused = mapfilter("predict", "-c", own_world.toml, *given)
    assert_refused(refused, "rxlev.png: expected a name that ends in .tif, found .png")
    assert not (tmp_path / "rxlev.png").exists()


@pytest.mark.parametrize("command", ["predict", "build", "simulate"])
def test_a_full_disk(command, own_world, monkeypatch):
    def full(_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    before = contents(own_world.folder)
    refused = mapfilter(command, "-c", own_world.toml)
    told = "expected a place that can be written, found No space left on device"
    assert_refused(refused, str(own_world.out), told)
    assert ".partial" not in refused.err
    assert contents(own_world.folder) == before


def test_an_export_is_named_by_its_whole_path(world, tmp_path, monkeypatch):
    """As other commands name what they write."""
    monkeypatch.chdir(tmp_path)
    done = mapfilter("export", world.database, "--to", "a.gpkg", "--json")
    assert done.json["file"] == str(tmp_path / "a.gpkg")


@pytest.mark.parametrize("command", ["predict", "build", "simulate", "replay", "export"])
@pytest.mark.parametrize("limit_bytes", [500, 8_000, 50_000])
def test_a_limit_on_the_size_of_files(command, limit_bytes, own_world):
    """Every writer runs into it somewhere; none shows a traceback or leaves half a file."""
    given = ["-c", own_world.toml]
    if command == "export":
        given = [own_world.database, "--to", own_world.folder / "x.gpkg"]
    before = contents(own_world.database, own_world.journeys)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit_bytes, hard))
    try:
        outcome = mapfilter(command, *given)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    if outcome.code:
        assert_refused(outcome, "written")
        assert not list(own_world.folder.rglob("*.partial-*"))
        assert contents(own_world.database, own_world.journeys) == before
    else:
        assert (command, limit_bytes) == ("simulate", 8_000) or limit_bytes == 50_000


def test_interrupting_a_build_leaves_everything_as_it_was(own_world, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("mapfilter.database.parts.write_cells", interrupted)
    before = contents(own_world.folder)
    outcome = mapfilter("build", "-c", own_world.toml)
    assert (outcome.code, outcome.out) == (130, "")
    assert "Traceback" not in outcome.err
    (tiles,) = own_world.out.glob(".database.tiles-*")
    shutil.rmtree(tiles)
    assert contents(own_world.folder) == before
