"""Nothing half-written is ever left behind, also when the writing process is killed."""

import ctypes
import errno
import hashlib
import signal
import subprocess
import sys

import pytest
from folders import names, read_folder, told, write_folder

from mapfilter import _replace
from mapfilter._io import atomic_dir, atomic_file, ensure_writable_folder, left_aside, sha256_file
from mapfilter._json_files import read_json, write_json
from mapfilter.errors import StoreError


def test_sha256_of_a_file_longer_than_one_chunk(tmp_path):
    data = bytes(range(256)) * 5000
    (tmp_path / "f").write_bytes(data)
    assert sha256_file(tmp_path / "f") == hashlib.sha256(data).hexdigest()


def test_a_file_is_made_with_its_folders_and_replaced_later(tmp_path):
    path = tmp_path / "a" / "b" / "result.tar.gz"
    for text in ("first", "second"):
        with atomic_file(path) as temporary:
            assert temporary.name == path.name, "drivers choose formats by the suffix"
            temporary.write_text(text)
            assert not path.exists() or path.read_text() == "first"
        assert path.read_text() == text
        assert names(path.parent) == [path.name]


def test_a_folder_is_made_and_replaced_as_a_whole(tmp_path):
    path = tmp_path / "a" / "database"
    write_folder(path, "first")
    (path / "only in the first").write_text("")
    write_folder(path, "second")
    assert read_folder(path) == {"deep/part": "second"}
    assert names(path.parent) == ["database"]


@pytest.mark.parametrize("kind", [ValueError, KeyboardInterrupt])
def test_an_exception_leaves_the_old_and_nothing_else(tmp_path, kind):
    file, folder = tmp_path / "file", tmp_path / "folder"
    file.write_text("old")
    write_folder(folder, "old")

    def interrupted(path, atomic):
        with atomic(path) as new:
            (new if atomic is atomic_file else new / "part").write_text("half")
            raise kind

    for path in (file, tmp_path / "new file"):
        with pytest.raises(kind):
            interrupted(path, atomic_file)
    for path in (folder, tmp_path / "new folder"):
        with pytest.raises(kind):
            interrupted(path, atomic_dir)
    assert (file.read_text(), read_folder(folder)) == ("old", {"deep/part": "old"})
    assert names(tmp_path) == ["file", "folder"]


WRITER = """
import sys
from pathlib import Path
from mapfilter._io import atomic_dir, atomic_file
kind, path = sys.argv[1], Path(sys.argv[2])
with (atomic_dir if kind == "folder" else atomic_file)(path) as new:
    (new / "part" if kind == "folder" else new).write_text("half")
    print("in the middle", flush=True)
    sys.stdin.read()
"""


@pytest.mark.parametrize("kind", ["file", "folder"])
def test_a_killed_process_leaves_the_old_and_the_next_write_cleans_up(tmp_path, kind):
    path, other = tmp_path / "result", tmp_path / "result.partial-x"
    other.write_text("of somebody else")
    if kind == "file":
        path.write_text("old")
    else:
        write_folder(path, "old")
    writer = subprocess.Popen(
        [sys.executable, "-c", WRITER, kind, str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with writer:
        assert writer.stdout.readline() == "in the middle\n"
        partial = [n for n in names(tmp_path) if n.startswith(".result.partial-")]
        assert len(partial) == 1
        # The partial folder of a process that lives is left alone.
        with atomic_file(tmp_path / "result") if kind == "file" else atomic_dir(path) as new:
            (new if kind == "file" else new / "part").write_text("other writer")
        assert partial[0] in names(tmp_path)
        writer.send_signal(signal.SIGKILL)
    text = path.read_text() if kind == "file" else read_folder(path)
    assert text in ("other writer", {"part": "other writer"})
    assert partial[0] in names(tmp_path)
    with atomic_file(path) if kind == "file" else atomic_dir(path) as new:
        (new if kind == "file" else new / "part").write_text("new")
    assert (path.read_text() if kind == "file" else read_folder(path)) in ("new", {"part": "new"})
    assert names(tmp_path) == ["result", "result.partial-x"]


def test_names_with_glob_signs_clean_only_their_own(tmp_path):
    for name in (".a[b].partial-0x-1", ".ab.partial-0x-1", ".a[b].partial-99999999999999999999-1"):
        (tmp_path / name).mkdir()
    with atomic_file(tmp_path / "a[b]") as temporary:
        temporary.write_text("")
    assert names(tmp_path) == [".ab.partial-0x-1", "a[b]"]


def test_places_that_cannot_be_written_are_told(tmp_path):
    (tmp_path / "file").write_text("in the way")
    below = tmp_path / "file" / "below" / "result"
    for atomic in (atomic_file, atomic_dir):
        told(below.parent, atomic(below).__enter__)
    told(tmp_path / "file", lambda: ensure_writable_folder(tmp_path / "file"))
    assert told(tmp_path / "file", atomic_dir(tmp_path / "file").__enter__).got == "a file"
    long = tmp_path / ("x" * 250)
    for atomic in (atomic_file, atomic_dir):
        assert told(long, atomic(long).__enter__).got == "File name too long"
    assert names(tmp_path) == ["file"]
    assert (tmp_path / "file").read_text() == "in the way"


def test_a_file_does_not_replace_a_folder(tmp_path):
    write_folder(tmp_path / "folder", "kept")

    def write():
        with atomic_file(tmp_path / "folder") as temporary:
            temporary.write_text("new")

    told(tmp_path / "folder", write)
    assert read_folder(tmp_path / "folder") == {"deep/part": "kept"}
    assert names(tmp_path) == ["folder"]


class NoSystemCalls:
    """A C library that is too old."""

    def __init__(self, *_args, **_options):
        pass


class Refusing:
    """A C library whose file system refuses to exchange."""

    number = errno.EINVAL

    def __init__(self, *_args, **_options):
        pass

    def renameat2(self, *_args):
        ctypes.set_errno(self.number)
        return -1


class Failing(Refusing):
    number = errno.EACCES


@pytest.mark.parametrize("library", [NoSystemCalls, Refusing])
def test_two_renames_where_the_system_cannot_exchange(tmp_path, monkeypatch, library):
    monkeypatch.setattr(_replace.ctypes, "CDLL", library)
    write_folder(tmp_path / "folder", "first")
    write_folder(tmp_path / "folder", "second")
    assert read_folder(tmp_path / "folder") == {"deep/part": "second"}
    assert names(tmp_path) == ["folder"]


def test_an_exchange_that_is_forbidden_is_told_and_keeps_the_old(tmp_path, monkeypatch):
    monkeypatch.setattr(_replace.ctypes, "CDLL", Failing)
    write_folder(tmp_path / "folder", "first")
    fault = told(tmp_path / "folder", lambda: write_folder(tmp_path / "folder", "second"))
    assert fault.got == "Permission denied"
    assert read_folder(tmp_path / "folder") == {"deep/part": "first"}
    assert names(tmp_path) == ["folder"]


def test_a_second_rename_that_fails_is_undone(tmp_path, monkeypatch):
    monkeypatch.setattr(_replace.ctypes, "CDLL", NoSystemCalls)
    write_folder(tmp_path / "folder", "first")
    rename = type(tmp_path).rename

    def flaky(self, target):
        if self.name == "new":
            raise OSError(errno.EIO, "Input/output error")
        return rename(self, target)

    monkeypatch.setattr(type(tmp_path), "rename", flaky)
    told(tmp_path / "folder", lambda: write_folder(tmp_path / "folder", "second"))
    assert read_folder(tmp_path / "folder") == {"deep/part": "first"}
    assert names(tmp_path) == ["folder"]


def test_a_process_killed_between_two_renames_loses_nothing(tmp_path):
    finished = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"],
                              capture_output=True, text=True, check=True)  # fmt: skip
    stale = tmp_path / f".folder.partial-{finished.stdout.strip()}-abc"
    for state in ("old", "new"):
        (stale / state).mkdir(parents=True)
        (stale / state / "part").write_text(state)
    assert left_aside(tmp_path / "folder") == stale / "old"
    assert left_aside(tmp_path / "other") is None
    with pytest.raises(ValueError, match="again"), atomic_dir(tmp_path / "folder"):
        raise ValueError("again")
    assert read_folder(tmp_path / "folder") == {"part": "old"}
    assert names(tmp_path) == ["folder"]


def test_json_round_trip_keeps_the_order_and_is_readable(tmp_path):
    path = tmp_path / "manifest.json"
    value = {"z": 1, "a": [0.1, None, "Töölö"], "m": {"deep": True}}
    write_json(path, value)
    assert read_json(path) == value
    assert list(read_json(path)) == ["z", "a", "m"]
    assert "Töölö" in path.read_text(encoding="utf-8")
    with pytest.raises(ValueError, match="JSON"):
        write_json(path, {"z": float("nan")})
    assert read_json(path) == value
    assert names(tmp_path) == ["manifest.json"]


@pytest.mark.parametrize(
    ("data", "got"),
    [
        (b"", "no JSON"),
        (b'{"a": 1', "no JSON"),
        (b'{"a": "\xff"}', "no JSON"),
        (b"\x80\x00\x01", "no JSON"),
        (b"[" * 100_000, "no JSON"),
        (b'{"a": ' + b"9" * 5000 + b"}", "no JSON"),
        (b"[1, 2]", "list"),
        (b"null", "NoneType"),
        (None, "No such file or directory"),
    ],
)
def test_json_that_is_missing_damaged_or_no_object(tmp_path, data, got):
    path = tmp_path / "manifest.json"
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(StoreError) as caught:
        read_json(path)
    (fault,) = caught.value.faults
    assert fault.where == str(path)
    assert fault.got.startswith(got)


def test_json_in_place_of_a_folder(tmp_path):
    with pytest.raises(StoreError, match="Is a directory"):
        read_json(tmp_path)
