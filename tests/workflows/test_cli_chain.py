"""The good way: predict, build, info, export, simulate and replay, one command after another."""

import json
import os
import subprocess
import sys
from pathlib import Path

import geopandas
import pytest
from command_line import assert_done, assert_refused, contents, mapfilter, settings

from mapfilter import cli
from mapfilter.positioning.estimate_store import read_estimate
from mapfilter.rasters.opening import open_rasters
from mapfilter.tracks.store import read_log

DEMO_KEYS = [
    "points", "cells", "track_m", "switched", "switch_distance_m", "error_at_switch_m",
    "error_mean_m", "error_67_m", "error_95_m", "candidate", "seconds", "outputs",
]  # fmt: skip
JOURNEYS = ["journey-0000-draw-000", "journey-0001-draw-000"]


def replay(world, out, *more):
    return mapfilter(
        "replay", "-c", world.toml, "--db", world.database, "--log", world.journeys / JOURNEYS[0],
        "--out", out, *settings(output__pictures="none"), *more,
    )  # fmt: skip


def test_predict_writes_rasters_ground_truth_and_plan(world, tmp_path):
    found = assert_done(mapfilter("predict", "-c", world.toml, "--out", tmp_path, "--json"))
    assert len(found.out.splitlines()) == 1
    assert found.json["cells"] == 3
    assert {path.name for path in tmp_path.iterdir()} == {
        "cells.csv", "rxlev.tif", "rxlev-ground-truth.tif",
    }  # fmt: skip
    rasters = open_rasters(found.json["rasters"])
    assert rasters.cell_ids == ("A", "B", "C")
    assert (rasters.lattice.rows, rasters.lattice.cols) == (
        found.json["rows"], found.json["cols"],
    )  # fmt: skip
    assert contents(tmp_path / "rxlev.tif") == contents(world.rasters)


def test_predict_takes_a_seed(world, tmp_path):
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        assert_done(
            mapfilter("predict", "-c", world.toml, "--out", tmp_path / name, "--seed", seed)
        )
    a, b, c = (contents(tmp_path / name) for name in "abc")
    assert list(a.values()) == list(b.values())
    assert a["a/rxlev.tif"] != c["c/rxlev.tif"]
    assert a["a/rxlev-ground-truth.tif"] != c["c/rxlev-ground-truth.tif"]


def test_build_gives_the_same_bytes_whatever_the_workers(world, tmp_path):
    small_tiles = settings(
        database__tile_px=32, rasters__path=world.rasters, database__path=tmp_path / "one"
    )
    for workers, name in ((1, "one"), (2, "two")):
        given = [*small_tiles, f"--set=database.path={tmp_path / name}"]
        found = mapfilter("build", "-c", world.toml, *given, "--workers", workers, "--json")
        assert_done(found)
        assert found.json["cells"] == 3
        assert found.json["points"] <= found.json["routable_points"]
    one, two = contents(tmp_path / "one"), contents(tmp_path / "two")
    assert list(one.values()) == list(two.values())
    assert len(one) == 6


def test_building_again_gives_the_same_bytes(own_world):
    before = contents(own_world.database)
    assert_done(mapfilter("build", "-c", own_world.toml))
    assert contents(own_world.database) == before


def test_dry_run_tells_what_the_build_gives_and_writes_nothing(own_world):
    before = contents(own_world.folder)
    told = assert_done(mapfilter("build", "-c", own_world.toml, "--dry-run", "--json")).json
    assert contents(own_world.folder) == before
    held = assert_done(mapfilter("info", own_world.database, "--json")).json
    left_out = ("points_below_floor", "points_without_level")
    assert told["points"] == held["points"] + sum(held["counts"][name] for name in left_out)
    assert told["levels"] == held["levels"]
    assert 0.5 < told["bytes"] / held["bytes"] < 2


def test_info_of_each_kind(world):
    database = assert_done(mapfilter("info", world.database, "--json")).json
    assert database["kind"] == "database"
    assert set(database["levels_per_cell"]) == {"A", "B", "C"}
    rasters = assert_done(mapfilter("info", world.rasters, "--json")).json
    assert (rasters["kind"], rasters["cell_ids"]) == ("rasters", ["A", "B", "C"])
    assert rasters["crs"] == database["crs"] == "EPSG:32635"
    log = assert_done(mapfilter("info", world.journeys / JOURNEYS[0], "--json")).json
    assert log["kind"] == "log"
    assert log["truth_length_m"] == pytest.approx(250, rel=0.03)
    logs = assert_done(mapfilter("info", world.journeys)).out
    assert "logs: 2" in logs
    assert JOURNEYS[1] in logs


def test_export_opens_in_geopandas(world, tmp_path):
    file = tmp_path / "new folder" / "world.gpkg"
    found = assert_done(mapfilter("export", world.database, "--to", file, "--json")).json
    points = geopandas.read_file(file, layer="points")
    assert (len(points), str(points.crs)) == (found["points"], "EPSG:32635")
    assert len(geopandas.read_file(file, layer="cells")) == found["cells"] == 3


def test_simulate_gives_the_same_bytes_for_a_seed(world, tmp_path):
    given = settings(rasters__path=world.rasters)
    for name, seed in (("a", 7), ("b", 7), ("c", 8)):
        into = ("--out", tmp_path / name, "--seed", seed, "--json")
        found = assert_done(mapfilter("simulate", "-c", world.toml, *given, *into)).json
        assert found["logs"] == 2
    a, b, c = (contents(tmp_path / name / "journeys") for name in "abc")
    assert a == b
    assert a != c
    log = read_log(tmp_path / "a" / "journeys" / JOURNEYS[0])
    assert log.truth_length_m > 0.97 * 250
    assert set(log.radio["cell"].dropna()) <= {"A", "B", "C"}


def test_ground_truth_of_another_prediction_is_refused(own_world):
    given = ["-c", own_world.toml, "--set=journeys.radio=ground_truth"]
    assert_done(mapfilter("simulate", *given))
    # The same prediction again, without ground truth: the older one still belongs to it.
    again = [*given, "--set=prediction.ground_truth.write=false"]
    assert_done(mapfilter("predict", *again))
    assert_done(mapfilter("simulate", *given))
    assert_done(mapfilter("predict", *again, "--seed", 5))
    before = contents(own_world.folder)
    assert_refused(
        mapfilter("simulate", *given),
        "rxlev-ground-truth.tif: expected ground truth of rxlev.tif",
        "prediction.ground_truth.write = true",
    )
    assert contents(own_world.folder) == before
    assert_done(mapfilter("simulate", *given, "--set=journeys.radio=as_predicted"))
    named = f"--set=rasters.ground_truth={own_world.out / 'rxlev-ground-truth.tif'}"
    assert_done(mapfilter("simulate", *given, named))


def test_replay_locates_and_gives_the_same_bytes(world, tmp_path):
    found = [assert_done(replay(world, tmp_path / name, "--json")) for name in "ab"]
    assert found[0].json["filter"] == "candidate"
    assert found[0].json["switched"] is True
    assert found[0].json["error_mean_m"] < 60
    keys = {"switch_distance_m", "error_at_switch_m", "error_67_m", "error_95_m", "filter_s", "out"}
    assert keys <= set(found[0].json)
    names = ["estimate.parquet", "estimate.gpx", "estimate.geojson", "figures.json"]
    assert [Path(path).name for path in found[0].json["outputs"]] == names
    a, b = (contents(tmp_path / name) for name in "ab")
    assert list(a.values()) == list(b.values())
    assert len(a) == len(names)
    estimate = read_estimate(tmp_path / "a" / "estimate.parquet")
    assert estimate.crs == "EPSG:32635"
    assert estimate.converged_at is not None


def test_replay_of_a_folder_of_logs_sums_up(world, tmp_path):
    given = settings(output__pictures="first")
    found = assert_done(mapfilter("replay", "-c", world.toml, "--out", tmp_path, *given, "--json"))
    assert found.json["logs"] == 2
    assert json.loads((tmp_path / "summary.json").read_text())["runs"] == 2
    assert {path.name for path in tmp_path.iterdir()} == {*JOURNEYS, "summary.json"}
    assert [len(list((tmp_path / name).glob("*.png"))) for name in JOURNEYS] == [3, 0]


def test_replay_without_some_readings(world, tmp_path):
    assert_done(replay(world, tmp_path / "all"))
    assert_done(replay(world, tmp_path / "less", "--without", "gnss, neighbours"))
    every, less = (
        json.loads((tmp_path / name / "figures.json").read_text()) for name in ("all", "less")
    )
    log = read_log(world.journeys / JOURNEYS[0])
    neighbours = int((log.radio["role"] == "neighbour").sum())
    assert every["unused"] == {"not_used_by_filter": neighbours}
    assert less["unused"] == {}
    # There are no fixes of which a note could tell.
    assert less["notes"][0] == f"neighbours: {neighbours} left out"
    assert less["error_mean_m"] == every["error_mean_m"]


def test_demo_prints_the_documented_keys_on_the_last_line(tmp_path):
    small = settings(
        area__bbox="24.9420,60.1660,24.9495,60.1697", journeys__length_m=250,
        output__pictures="none", filter__update_length_m=10,
    )  # fmt: skip
    found = assert_done(mapfilter("demo", "--out", tmp_path, *small, "--json"))
    assert len(found.out.splitlines()) == 1
    assert list(found.json) == DEMO_KEYS
    assert list(found.json["candidate"]) == DEMO_KEYS[3:9]
    assert list(found.json["seconds"]) == ["predict", "build", "simulate", "replay"]
    assert found.json["cells"] == 13
    assert all(Path(path).exists() for path in found.json["outputs"])


def test_without_json_a_line_for_each_figure(world):
    out = assert_done(mapfilter("info", world.rasters)).out
    assert "cells: 3" in out.splitlines()
    assert "{" not in out


def test_relative_paths_are_those_of_the_file_and_in_set_of_the_working_folder(
    own_world, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    file = Path("world") / "world.toml"
    assert assert_done(mapfilter("build", "-c", file, "--json")).json["database"] == str(
        own_world.database
    )
    own_world.plan.rename(tmp_path / "moved.csv")
    given = settings(cells__plan="moved.csv", database__path="2024")
    found = assert_done(mapfilter("build", "-c", file, *given, "--json")).json
    assert found["database"] == str(tmp_path / "2024")
    assert assert_done(mapfilter("info", "2024", "--json")).json["points"] == found["points"]


def test_paths_beyond_ascii(own_world, tmp_path):
    odd = tmp_path / 'Zürich 😀 "a"'
    own_world.database.rename(odd)
    given = ["--db", odd, "--log", own_world.journeys, "--out", tmp_path / "ö"]
    assert_done(mapfilter("replay", *given, *settings(output__pictures="none")))


@pytest.mark.parametrize("command", [[], ["replay"]])
def test_help_is_quick_to_import(command):
    code = (
        "import sys; from mapfilter.cli import main\n"
        "try: main()\n"
        "except SystemExit as end: code = end.code\n"
        "heavy = {'geopandas', 'pandas', 'rasterio', 'matplotlib', 'numba', 'pyrosm', 'scipy'}\n"
        "print(code, sorted(heavy & set(sys.modules)))"
    )
    environment = {**os.environ, "COLUMNS": "100"}
    done = subprocess.run(
        [sys.executable, "-c", code, *command, "--help"],
        capture_output=True, text=True, check=True, env=environment,
    )  # fmt: skip
    *text, last = done.stdout.splitlines()
    assert last == "0 []"
    if not command:
        for name in ("demo", "predict", "build", "export", "info", "simulate", "replay"):
            assert any(line.strip().startswith(f"{name} ") for line in text), name


def test_a_process_beside_a_command_imports_no_command():
    """It imports the main module again, which is this one."""
    code = "import sys, mapfilter.__main__; print(*{'typer', 'mapfilter.cli'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_a_check_imports_neither_scipy_before_it_is_used_nor_what_learns(world):
    """Both take as long as the check of a small area; asked of a process of its own."""
    given = ["check", "-c", str(world.toml)]
    code = (
        "import sys, mapfilter.config.load, mapfilter.workflows.check; from mapfilter import cli\n"
        "heavy = {'scipy.ndimage', 'scipy.spatial', 'scipy.optimize'} & set(sys.modules)\n"
        "try: cli.main()\n"
        "except SystemExit as end: code = end.code\n"
        "print(code, sorted(heavy | {'mapfilter.learning'} & set(sys.modules)))"
    )
    command = [sys.executable, "-c", code, *given]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "0 []"


def test_only_the_options_of_the_command_that_is_run_are_looked_at(monkeypatch):
    looked_at = []
    monkeypatch.setattr(cli, "get_command", lambda app: looked_at.append(app) or (lambda: 0))
    monkeypatch.setattr(cli, "_command_line", cli._command_line.__wrapped__)
    for name in ("info", "infos"):
        assert mapfilter(name).code == 0
    one, every = (app.registered_commands for app in looked_at)
    assert [command.callback.__name__ for command in one] == ["info"]
    assert len(every) > 10


def test_version_and_no_command():
    assert assert_done(mapfilter("--version")).out.startswith("mapfilter 0")
    assert "Usage" in mapfilter().out + mapfilter().err


def test_blas_has_one_thread_unless_another_number_is_given(monkeypatch):
    name = "OPENBLAS_NUM_THREADS"
    monkeypatch.delenv(name, raising=False)
    assert_done(mapfilter("--version"))
    assert os.environ[name] == "1"
    monkeypatch.setenv(name, "3")
    assert_done(mapfilter("--version"))
    assert os.environ[name] == "3"
