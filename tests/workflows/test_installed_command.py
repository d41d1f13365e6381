"""The installed command and the pipelines' runner, as their users start them."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import contents

from mapfilter.workflows.build import run_build
from mapfilter.workflows.pipeline import run_pipeline
from mapfilter.workflows.predict import run_predict


@pytest.fixture
def command():
    file = Path(sys.executable).parent / "mapfilter"
    if not file.exists():
        pytest.skip("the command is not installed beside this Python")

    def run(*args):
        return subprocess.run(
            [file, *map(str, args)], capture_output=True, text=True, check=False, timeout=120
        )

    return run


def test_a_fault_is_one_line_on_stderr_and_exit_code_2(command, tmp_path):
    done = command("info", tmp_path / "none", "--json")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        f"mapfilter: error: {tmp_path / 'none'}: expected a database, raster file or log, "
        "found nothing there\n"
    )


def test_cut_off_rasters_say_nothing_but_the_fault(command, world, tmp_path):
    file = tmp_path / "rxlev.tif"
    file.write_bytes(world.rasters.read_bytes()[:5000])
    done = command("info", file)
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == 1
    assert "the file is cut off" in done.stderr


def test_a_build_prints_nothing_but_its_json(command, own_world):
    done = command("build", "-c", own_world.toml, "--json")
    assert (done.returncode, done.stderr) == (0, "")
    (line,) = done.stdout.splitlines()
    assert list(json.loads(line)) == [
        "points",
        "cells",
        "routable_points",
        "database",
        "seconds",
        "notes",
        "pictures",
    ]


def test_a_pipeline_runs_its_stages(own_world, tmp_path, capsys):
    stages = {"predict": run_predict, "build": run_build}
    out = tmp_path / "out"
    assert run_pipeline(stages, own_world.toml, ["--out", str(out), "--json"]) == 0
    told = capsys.readouterr()
    found = json.loads(told.out.splitlines()[-1])
    assert list(found) == ["predict", "build"]
    assert found["build"]["cells"] == 3
    assert contents(out / "database") == contents(own_world.database)


def test_a_pipeline_prints_as_replay_does(own_world, tmp_path, capsys):
    figures = {
        "seconds_by_status": {"SEARCHING": 352944.0, "TRACKING": 117648.0},
        "unused": {"no_step": 2},
        "notes": ["a note", "a note"],
    }
    stages = {"replay": lambda _: figures}
    assert run_pipeline(stages, own_world.toml, ["--out", str(tmp_path)]) == 0
    told = capsys.readouterr()
    lines = told.out.splitlines()
    assert "    SEARCHING: 352944 (75 %)" in lines
    assert "    no_step: 2 (the length of the step is unknown)" in lines
    assert "notes" not in told.out
    assert told.err == "mapfilter: note: a note\n"


def test_a_pipeline_refuses_as_the_commands_do(own_world, capsys):
    before = contents(own_world.folder)
    wrong = ["--set", "database.margin=1", "--json"]
    assert run_pipeline({"build": run_build}, own_world.toml, wrong) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err == (
        "mapfilter: error: setting database.margin: expected a known key, found 'margin' "
        "(likely: 'margin_db')\n"
    )
    assert contents(own_world.folder) == before
