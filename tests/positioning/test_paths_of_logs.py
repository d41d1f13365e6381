"""What is given to ``mf.read_log`` for a path, and why there is nothing at one."""

import io

import pandas as pd
import pytest

import mapfilter as mf

MOTION = pd.DataFrame({"time_s": [0.0, 1.0], "step_m": [1.0, 1.0], "heading_rad": [0.0, 0.0]})


@pytest.mark.parametrize("name", ["paths", "truth"])
@pytest.mark.parametrize(
    ("given", "message"),
    [
        (MOTION, r"found DataFrame \(likely: a table; mf.make_log\(crs, motion=…\) makes a log of"),
        (
            io.StringIO("time,step_m\n0,1\n"),
            r"found StringIO \(likely: an open file; give its path",
        ),
        (io.BytesIO(b"time,step_m\n0,1\n"), r"found BytesIO \(likely: an open file; give its path"),
        ({"walk.csv": 1.0}, r"found dict$"),
    ],
)
def test_what_is_gone_over_for_something_else_is_no_path(tmp_path, name, given, message):
    (tmp_path / "walk.csv").write_text("time,step_m\n0,1\n")
    paths = {"paths": tmp_path / "walk.csv"} | {name: given}
    with pytest.raises(mf.MapfilterError, match=rf"^read_log, {name}: .*, {message}"):
        mf.read_log(**paths)


def test_a_folder_of_logs_names_them(tmp_path):
    log = mf.make_log("EPSG:32635", motion=MOTION)
    for name in ("b", "a"):
        mf.write_log(log, tmp_path / "walks" / name)
    with pytest.raises(mf.MapfilterError) as caught:
        mf.read_log(tmp_path / "walks")
    assert str(caught.value) == (
        f"{tmp_path / 'walks'}: expected recordings in the folder, found track logs (likely: name "
        "one of them: a, b)"
    )


@pytest.mark.parametrize(
    ("path", "hint"),
    [
        ("~/walk", "~ is not expanded; give os.path.expanduser of it"),
        ("walks/*", "a pattern, which is not expanded; give the paths, such as those of glob.glob"),
        ("walk-?", "a pattern, which is not expanded; give the paths, such as those of glob.glob"),
        ("https://example.org/walk", "an address; download the file and give its path"),
    ],
)
@pytest.mark.parametrize(
    "opened", [mf.read_log, mf.open_database, lambda path: mf.open_rasters(f"{path}.tif")]
)
def test_what_only_a_shell_or_a_browser_expands(tmp_path, monkeypatch, opened, path, hint):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(mf.MapfilterError) as caught:
        opened(path)
    assert caught.value.faults[0].hint == hint


@pytest.mark.parametrize("path", ["walk.cvs", "C:/walk"])
@pytest.mark.parametrize("opened", [mf.read_log, mf.open_database])
def test_other_paths_are_mistyped(tmp_path, monkeypatch, opened, path):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(mf.MapfilterError) as caught:
        opened(path)
    assert caught.value.faults[0].hint == "a mistyped path"
