"""Pictures that another process draws are those that this one draws, to the byte."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from mapfilter._parallel import SerialExecutor, begun
from mapfilter.cli.options import undrawn
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.positioned_track import Snapshot
from mapfilter.report.ground import BaseMap
from mapfilter.workflows.outputs import drawer, track_pictures
from mapfilter.workflows.outputs.track_pictures import (
    TrackPictures,
    begin_belief,
    begin_pictures,
    drawn_beside,
    with_error_picture,
)


def _shown():
    truth = Truth(*(np.arange(3.0) for _ in range(3)))
    estimate = TrackEstimate.of_fixes("candidate", "EPSG:32635", ())
    base = BaseMap((0.0, 0.0, 100.0, 100.0), points_m=np.array([[10.0, 20.0], [15.0, 20.0]]))
    return TrackPictures(estimate, truth, base)


def _pngs():
    shown, errors_m = _shown(), np.array([40.0, 60.0])
    with drawn_beside() as drawers:
        handed = with_error_picture(begin_pictures(shown, drawers), shown, drawers, errors_m)
        started = multiprocessing.active_children()
        return {name: png() for name, png in handed.items()}, len(started)


def test_another_process_draws_the_same_bytes(monkeypatch):
    monkeypatch.setattr(track_pictures, "_DRAWING_LIBRARY", "sys")
    here, started = _pngs()
    assert started == 0
    assert list(here) == ["track.png", "error.png"]
    assert all(png.startswith(b"\x89PNG") for png in here.values())
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(track_pictures, "_DRAWING_LIBRARY", "not imported")
    beside, started = _pngs()
    assert started == 1
    assert beside == here


def test_without_a_map_there_is_a_track_where_there_is_a_position():
    shown = replace(_shown(), base=None)
    assert shown.names == ("track.png", "error.png")
    nowhere = replace(shown, truth=None, fixes_m=np.empty((0, 2)))
    assert nowhere.names == ()
    assert replace(nowhere, fixes_m=np.ones((1, 2))).names == ("track.png",)


def _killed(parent):
    if os.getpid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
    return b""


def test_what_a_killed_process_would_have_drawn_is_drawn_here(monkeypatch):
    here, _ = _pngs()
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(track_pictures, "_DRAWING_LIBRARY", "not imported")
    shown, errors_m = _shown(), np.array([40.0, 60.0])
    with drawn_beside() as drawers:
        begun(drawers, partial(_killed, os.getpid()))
        handed = with_error_picture(begin_pictures(shown, drawers), shown, drawers, errors_m)
        assert {name: png() for name, png in handed.items()} == here


def _stopped(children):
    with drawn_beside():
        children += multiprocessing.active_children()
        raise KeyboardInterrupt


def test_a_stopped_replay_leaves_no_process(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(track_pictures, "_DRAWING_LIBRARY", "not imported")
    with pytest.raises(KeyboardInterrupt):
        _stopped(children := [])
    (child,) = children
    # Two more threads wait for it: the one that reaps it tells the others its code a moment later,
    # until then it counts as alive.
    until_s = time.monotonic() + 120.0
    while child.is_alive() and time.monotonic() < until_s:
        time.sleep(0.01)
    assert not child.is_alive()


def test_the_process_that_draws_keeps_freed_memory(monkeypatch):
    done = []
    monkeypatch.setattr(drawer, "keep_freed_memory", lambda: done.append("kept"))
    monkeypatch.setattr(track_pictures, "get_ready_to_draw", lambda: done.append("ready"))
    drawer._call(*drawer._READY)
    assert done == ["kept", "ready"]


def test_what_locates_imports_neither_what_draws_nor_what_reads_maps_and_rasters():
    """Else the process that draws would save nothing; asked of a process of its own."""
    code = (
        "import sys, mapfilter.workflows.replay as _\n"
        "print(*{'matplotlib', 'rasterio', 'pyogrio', 'scipy.sparse', 'shapely', 'geopandas', "
        "'numba'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout.split()) == (0, ["numba"]), done.stderr


def test_a_replay_of_a_track_log_imports_no_readers_of_recordings_and_no_page():
    """They are a sixth of the modules of its own; asked of a process of its own."""
    others = {"mapfilter.tracks.joining.combine", "mapfilter.tracks.readers.formats"}
    others |= {"mapfilter.viewing.bundle", "mapfilter.survey.measured_map"}
    # They locate single reports, which is done when the track is located.
    others |= {"mapfilter.positioning.fingerprints." + name for name in ("locating", "sources")}
    code = (
        "import sys, mapfilter.config.load, mapfilter.workflows.replay, "
        "mapfilter.workflows.replays.text\n"
        f"print(*{others!r} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout.split()) == (0, []), done.stderr


class Noting(SerialExecutor):
    def __init__(self):
        self.drawn = []

    def submit(self, fn, /, *args, **kwargs):
        self.drawn.append(fn)
        return super().submit(fn, *args, **kwargs)


def test_what_was_handed_out_while_the_log_was_located_is_not_drawn_again():
    shown, noting = _shown(), Noting()
    assert list(begin_pictures(shown, noting)) == ["track.png"]
    assert len(noting.drawn) == 1
    before = {"track.png": lambda: b"already"}
    assert begin_pictures(shown, noting, before) == before
    assert len(noting.drawn) == 1


@pytest.mark.parametrize(
    ("has_evidence", "name"), [(True, "belief.png"), (False, "candidates.png")]
)
def test_the_picture_of_the_belief_comes_first_of_all(has_evidence, name):
    shown, noting = _shown(), Noting()
    places = np.array([10.0, 15.0]), np.array([20.0, 20.0]), np.array([0.5, 0.5])
    snapshot = Snapshot(1.0, 5.0, *places, 12.0, 20.0, Status.SEARCHING)
    belief = begin_belief((snapshot,), has_evidence, shown.truth, shown.base, noting)
    assert [png()[:4] for png in belief.values()] == [b"\x89PNG"]
    assert list(begin_pictures(shown, noting, belief)) == [name, "track.png"]
    assert len(noting.drawn) == 2
    assert begin_belief((), has_evidence, shown.truth, shown.base, noting) == {}


@pytest.mark.parametrize("pictures", ["all", "none"])
def test_a_replay_starts_what_draws_before_its_imports(pictures):
    """Both take about as long; asked of a process of its own."""
    code = (
        "import sys\nfrom mapfilter.workflows.outputs import drawer\n"
        "def begin():\n    sys.exit(40 + ('pandas' in sys.modules or 'numba' in sys.modules))\n"
        "drawer.drawer_process = begin\n"
        "from mapfilter.cli import main\n"
        f"sys.argv = ['mapfilter', 'replay', '--db', 'none', '--set', 'output.pictures={pictures}']"
        "\nmain()"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    expected = {"all": 40, "none": 2}[pictures]
    assert run.returncode == expected, run.stderr


@pytest.mark.parametrize(
    ("text", "settings", "expected"),
    [
        ('[output]\npictures = "none"\n', [], True),
        ('[output]\npictures = "none"\n', ["output.pictures=first"], False),
        ('[output]\npictures = "first"\n', ["output.pictures='none'"], True),
        ('[output]\ndir = "none"\n', ["output.dir=pictures-none"], False),
        ("output = 3\n", [], False),
        ("no TOML", [], False),
        (None, [], False),
    ],
)
def test_pictures_that_file_or_settings_forbid_start_nothing(text, settings, expected, tmp_path):
    file = tmp_path / "given.toml"
    if text is not None:
        file.write_text(text, encoding="utf-8")
    assert undrawn(file, settings) is expected
