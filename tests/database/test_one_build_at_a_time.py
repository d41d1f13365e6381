"""Of two builds into one folder at once the first one finishes, and the second one is told."""

import fcntl
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from small_world import FLOOR_DBM, LATTICE, levels_of, make_plan, make_routes

from mapfilter._alone import writing_alone
from mapfilter.database.build import build, build_roads
from mapfilter.database.store import open_database
from mapfilter.errors import InputError, OutputError
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters

TOLD = (
    "expected a folder that nothing else writes at the same time, found one that another command "
    "is writing"
)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder, plan = tmp_path_factory.mktemp("rasters"), make_plan()
    losses = ((cell, np.float32(50) - level) for cell, level in levels_of(plan, seed=3))
    write_rasters(folder / "rxlev.tif", LATTICE, losses, plan.ids, quantity="loss")
    return {
        "rasters": open_rasters(folder / "rxlev.tif"),
        "plan": plan,
        "routes": make_routes(),
        "floor_dbm": FLOOR_DBM,
        "tile_px": 8,
    }


@pytest.mark.parametrize("resume", [False, True])
def test_the_second_build_is_told_and_the_first_one_finishes(inputs, tmp_path, resume):
    out, told = tmp_path / "out" / "database", []

    def second(done, total):
        if done == total // 2:
            with pytest.raises(OutputError) as caught:
                build(**inputs, out=out, resume=resume)
            told.append(str(caught.value))
        with pytest.raises(OutputError):
            build_roads(inputs["routes"], out)

    database = build(**inputs, out=out, pixels_a_task=0, progress=second)
    assert told == [f"{out}: {TOLD} (likely: wait until it ends, or choose another folder)"]
    assert [path.name for path in out.parent.iterdir()] == ["database"]
    build(**inputs, out=tmp_path / "alone")
    assert open_database(out, verify="full").generation == database.generation
    alone = open_database(tmp_path / "alone")
    assert database.manifest["parts"] == alone.manifest["parts"]


def test_builds_into_two_folders_of_one_parent_go_on_at_once(inputs, tmp_path):
    def second(_, __):
        build(**inputs, out=tmp_path / "two")

    build(**inputs, out=tmp_path / "one", progress=second)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "two"]


def test_a_build_that_fails_leaves_no_lock(inputs, tmp_path):
    with pytest.raises(InputError):
        build(**{**inputs, "floor_dbm": -1.0}, out=tmp_path / "out" / "database")
    assert list((tmp_path / "out").iterdir()) == []
    build_roads(inputs["routes"], tmp_path / "out" / "database")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["database"]


LOCKED = """
import sys, time
from pathlib import Path
from mapfilter._alone import writing_alone
with writing_alone(Path(sys.argv[1])):
    print("locked", flush=True)
    time.sleep(60)
"""


@pytest.mark.parametrize("resume", [False, True])
def test_a_killed_build_locks_nobody_out(inputs, tmp_path, resume):
    out = tmp_path / "database"
    command = [sys.executable, "-c", LOCKED, str(out)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout.readline() == "locked\n"
        with pytest.raises(OutputError, match=TOLD):
            build(**inputs, out=out, resume=resume)
        other.send_signal(signal.SIGKILL)
    assert (tmp_path / ".database.lock").exists()
    build(**inputs, out=out, resume=resume)
    assert [path.name for path in tmp_path.iterdir()] == ["database"]


def test_a_lock_that_was_removed_meanwhile_is_none(tmp_path, monkeypatch):
    """Between opening and locking the other one ends, and a third one begins."""
    result, flock, seen = tmp_path / "database", fcntl.flock, []

    def late(handle, how):
        if not seen:
            (tmp_path / ".database.lock").unlink()
            (tmp_path / ".database.lock").touch()
        seen.append(os.fstat(handle).st_ino)
        flock(handle, how)

    monkeypatch.setattr("mapfilter._alone.fcntl.flock", late)
    with writing_alone(result):
        assert seen[1] == (tmp_path / ".database.lock").stat().st_ino
        assert len(seen) == 2
    assert list(tmp_path.iterdir()) == []


def test_where_there_are_no_locks_results_are_written_without(tmp_path, monkeypatch):
    def unknown(_, __):
        raise OSError(38, "Function not implemented")

    monkeypatch.setattr("mapfilter._alone.fcntl.flock", unknown)
    with writing_alone(tmp_path / "database"), writing_alone(tmp_path / "database"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_link_and_its_target_are_one_result(tmp_path):
    (tmp_path / "database").mkdir()
    (tmp_path / "link").symlink_to("database")
    with writing_alone(tmp_path / "link"), pytest.raises(OutputError, match=TOLD):
        writing_alone(tmp_path / "database").__enter__()


def test_a_link_in_place_of_the_lock_is_not_followed(tmp_path):
    (tmp_path / ".database.lock").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OutputError, match="a place that can be written"):
        writing_alone(tmp_path / "database").__enter__()
    assert not (tmp_path / "elsewhere").exists()
