"""Half-written results of processes that live, of those that ended, and of other hosts."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from folders import names

from mapfilter import _partial
from mapfilter._io import atomic_dir, atomic_file, replaced_files
from mapfilter._partial import ABANDONED_S, is_left, new_partial, nothing_left, partials


@pytest.fixture
def ended():
    """The number of a process that has ended."""
    done = subprocess.run([sys.executable, "-c", ""], check=True)
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        process.wait()
    assert done.returncode == 0
    return process.pid


@pytest.fixture
def on(monkeypatch):
    """Make this process one of another host."""

    def on(name):
        monkeypatch.setattr(_partial.platform, "node", lambda: name)
        _partial._host.cache_clear()

    yield on
    monkeypatch.undo()
    _partial._host.cache_clear()


def test_what_a_process_of_another_host_writes_is_left_alone(tmp_path, on, monkeypatch, ended):
    """Its number is that of a process that has ended here."""
    path = tmp_path / "result"
    on("there")
    monkeypatch.setattr(_partial.os, "getpid", lambda: ended)
    partial = new_partial(path)
    (partial / "new").write_text("half")
    on("here")
    assert list(partials(path)) == [partial]
    assert not is_left(partial)
    with atomic_file(path) as temporary:
        temporary.write_text("of this host")
    assert partial.name in names(tmp_path)
    on("there")
    assert is_left(partial)
    with atomic_file(path) as temporary:
        temporary.write_text("of that host")
    assert names(tmp_path) == ["result"]


def test_a_folder_of_another_host_is_removed_a_week_after_its_last_change(tmp_path, on):
    on("there")
    partial = new_partial(tmp_path / "result")
    (partial / "new").write_text("half")
    on("here")
    long_ago_s = partial.stat().st_mtime - ABANDONED_S - 60
    os.utime(partial, (long_ago_s, long_ago_s))
    assert not is_left(partial), "a file in it is younger"
    os.utime(partial / "new", (long_ago_s, long_ago_s))
    assert is_left(partial)


def test_names_of_one_process_differ(tmp_path):
    one, other = new_partial(tmp_path / "a-b"), new_partial(tmp_path / "a-b")
    assert one != other
    assert not is_left(one)
    assert set(partials(tmp_path / "a-b")) == {one, other}
    assert not list(partials(tmp_path / "a"))


@pytest.mark.parametrize("name", ["", "x", "0x-1", "h12345678-x-1"])
def test_names_without_a_process_are_of_nobody(tmp_path, name):
    (tmp_path / f".result.partial-{name}").mkdir()
    assert is_left(tmp_path / f".result.partial-{name}")


def test_files_are_on_the_disk_before_they_replace_others(tmp_path, monkeypatch):
    folder = tmp_path / "report"
    (folder / "deep").mkdir(parents=True)
    (folder / "a.txt").write_text("old")
    events = []
    fsync, replace = os.fsync, type(tmp_path).replace

    def flushed(handle):
        events.append(("flushed", Path(f"/proc/self/fd/{handle}").readlink().name))
        fsync(handle)

    def replaced(self, target):
        events.append(("replaced", target.name))
        return replace(self, target)

    monkeypatch.setattr(os, "fsync", flushed)
    monkeypatch.setattr(type(tmp_path), "replace", replaced)
    with replaced_files(folder, lambda: ()) as new:
        (new / "a.txt").write_text("new")
        (new / "deep").mkdir()
        (new / "deep" / "b.txt").write_text("new")
    for name in ("a.txt", "b.txt"):
        assert events.index(("flushed", name)) < events.index(("replaced", name))
    after = [name for what, name in events[events.index(("replaced", "b.txt")) :]]
    assert {"deep", "report"} <= set(after), "the lists of names are flushed, too"


def test_folders_that_a_block_made_and_left_empty_are_removed_where_it_fails(tmp_path):
    (tmp_path / "there").mkdir()
    kept = tmp_path / "there" / "kept"

    def make_folders_and_fail():
        (tmp_path / "there" / "a" / "b" / "inner").mkdir(parents=True)
        kept.mkdir()
        (kept / "empty").mkdir()
        (kept / "file").touch()
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"), nothing_left(tmp_path / "there" / "a" / "b", kept):
        make_folders_and_fail()
    assert sorted(path.name for path in (tmp_path / "there").rglob("*")) == ["file", "kept"]


def test_folders_that_another_program_makes_meanwhile_stay(tmp_path):
    runs = tmp_path / "deep" / "runs"

    def make_folders_and_fail():
        (runs / "a" / "inner").mkdir(parents=True)
        (runs / "b" / "raw").mkdir(parents=True)
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"), nothing_left(runs / "a"):
        make_folders_and_fail()
    left = sorted(str(path.relative_to(runs)) for path in runs.rglob("*"))
    assert left == ["b", "b/raw"]


def test_a_folder_above_that_another_program_makes_meanwhile_stays(tmp_path):
    def make_folder_and_fail():
        (tmp_path / "runs").mkdir()
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"), nothing_left(tmp_path / "runs" / "a"):
        make_folder_and_fail()
    assert (tmp_path / "runs").is_dir()


def test_folders_behind_a_link_stay(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "far")

    def make_folders_and_fail():
        (tmp_path / "far" / "empty").mkdir(parents=True)
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"), nothing_left(tmp_path / "link"):
        make_folders_and_fail()
    assert (tmp_path / "far" / "empty").is_dir()


def test_an_older_folder_stays_and_so_does_what_a_block_made_that_succeeds(tmp_path):
    older = tmp_path / "older"
    older.mkdir()
    with nothing_left(tmp_path / "new"):
        (tmp_path / "new").mkdir()
    with pytest.raises(KeyboardInterrupt), nothing_left(older):
        raise KeyboardInterrupt
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new", "older"]


def test_a_file_that_is_not_written_leaves_no_folder(tmp_path):
    for write in (atomic_file, atomic_dir, lambda path: replaced_files(path, lambda: ())):
        with pytest.raises(ValueError, match="no"), write(tmp_path / "a" / "b"):
            raise ValueError("no")
        assert not list(tmp_path.iterdir())


def test_a_place_that_cannot_be_looked_at_is_left_to_what_writes(tmp_path):
    with nothing_left(tmp_path / ("a" * 300) / "b"):
        pass


def test_what_another_process_begins_is_empty_for_now_and_stays(tmp_path):
    hidden = tmp_path / "out" / ".database.partial-1-x" / "new"

    def make_folders_and_fail():
        hidden.mkdir(parents=True)
        (tmp_path / "out" / ".database.tiles-1").mkdir()
        (tmp_path / "out" / "empty").mkdir()
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"), nothing_left(tmp_path / "out"):
        make_folders_and_fail()
    assert hidden.is_dir()
    assert names(tmp_path / "out") == [".database.partial-1-x", ".database.tiles-1"]
