"""Compiled kernels where neither package nor home can be written."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

import pytest

from mapfilter import _kernel_cache
from mapfilter._kernel_cache import keep_kernels
from mapfilter.errors import OutputError

NAME = "NUMBA_CACHE_DIR"
NO_PLACE = """
import sys, tempfile
from pathlib import Path

def refused(real, place):
    def call(*given, **named):
        if "mapfilter-kernels-" in str(place(*given, **named)):
            return real(*given, **named)
        raise PermissionError(13, "Permission denied")
    return call

Path.mkdir = refused(Path.mkdir, lambda path, **named: path)
tempfile.TemporaryFile = refused(tempfile.TemporaryFile, lambda dir, **named: dir)
if "numba" in sys.argv:
    import numba
"""


@pytest.fixture
def no_place(tmp_path, monkeypatch):
    """Let the usual places be a file, so that nothing can be written in them."""
    (tmp_path / "file").touch()
    places = [tmp_path / "file", tmp_path / "file" / "numba"]
    monkeypatch.setattr(_kernel_cache, "_usual_places", lambda: iter(places))
    monkeypatch.setenv(NAME, "")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    removed = []
    calls = SimpleNamespace(register=lambda *call: removed.append(call))
    monkeypatch.setattr(_kernel_cache, "atexit", calls)
    keep_kernels.cache_clear()
    yield removed
    keep_kernels.cache_clear()


def test_kernels_get_a_folder_of_the_process(tmp_path, no_place, monkeypatch):
    numba = pytest.importorskip("numba")
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    keep_kernels()
    folder = Path(os.environ[NAME])
    assert folder.parent == tmp_path
    assert folder.stat().st_mode & 0o077 == 0
    assert str(folder) == numba.config.CACHE_DIR
    ((remove, *given),) = no_place
    remove(given[0], -1)
    assert folder.exists()
    remove(*given)
    assert not folder.exists()


@pytest.mark.usefixtures("no_place")
def test_without_any_place_one_is_asked_for(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "absent"))
    with pytest.raises(OutputError, match="set NUMBA_CACHE_DIR"):
        keep_kernels()


@pytest.mark.usefixtures("no_place")
def test_a_place_that_is_given_or_takes_files_stays(tmp_path, monkeypatch):
    monkeypatch.setattr(_kernel_cache, "_usual_places", lambda: iter([tmp_path / "new"]))
    keep_kernels()
    assert os.environ[NAME] == ""
    keep_kernels.cache_clear()
    monkeypatch.setattr(_kernel_cache, "_usual_places", lambda: iter([]))
    monkeypatch.setenv(NAME, str(tmp_path / "given"))
    keep_kernels()
    assert os.environ[NAME] == str(tmp_path / "given")


def test_the_usual_places_are_those_of_numba(monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", "/caches")
    package, home = _kernel_cache._usual_places()
    assert package.parent.name == "mapfilter"
    assert home == Path("/caches/numba")


@pytest.mark.parametrize("temporary", [True, False])
@pytest.mark.parametrize("numba_first", [True, False])
def test_python_users_need_no_place_either(tmp_path, temporary, numba_first):
    """Importing a kernel without a place that takes files; the places refuse, also to root."""
    code = NO_PLACE + (
        "import mapfilter as mf\n"
        "try:\n"
        "    print(mf.build.__name__)\n"
        "except mf.errors.MapfilterError as error:\n"
        "    print(error)\n"
    )
    places = {"TMPDIR": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "no")}
    environment = {k: v for k, v in os.environ.items() if k != NAME} | places
    if not temporary:
        code = f"import tempfile; tempfile.tempdir = {str(tmp_path / 'absent')!r}\n{code}"
    run = [sys.executable, "-c", code, *(["numba"] if numba_first else [])]
    done = subprocess.run(run, env=environment, capture_output=True, text=True, check=False)
    assert not done.returncode, done.stderr
    wanted = "build" if temporary else "compiled kernels: expected a place to keep them"
    assert done.stdout.startswith(wanted)
    assert not list(tmp_path.iterdir())
