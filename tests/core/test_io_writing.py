"""Errors of writing are told as such, links are followed, and nothing of others is replaced."""

import errno
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from folders import names, read_folder, told, write_folder

from mapfilter import _io, _replace
from mapfilter._io import atomic_dir, atomic_file, replaced_files
from mapfilter._json_files import check_replaceable, check_version, sealed
from mapfilter.errors import OutputError, StoreError


def fails(atomic, path, error):
    def write():
        with atomic(path) as new:
            (new if atomic is atomic_file else new / "part").write_text("half")
            raise error

    return write


@pytest.mark.parametrize("atomic", [atomic_file, atomic_dir])
@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO])
def test_what_fails_while_writing_is_told(tmp_path, atomic, number):
    path = tmp_path / "result"
    fault = told(path, fails(atomic, path, OSError(number, os.strerror(number))))
    assert fault.got == os.strerror(number)
    assert names(tmp_path) == []


def test_what_fails_within_the_new_folder_is_told_by_its_final_name(tmp_path):
    def missing():
        with atomic_dir(tmp_path / "folder") as new:
            (new / "none" / "part").write_text("")

    told(tmp_path / "folder", missing)

    def nested():
        with (
            atomic_dir(tmp_path / "folder") as new,
            atomic_file(new / "deep" / "part"),
        ):
            raise OSError(errno.ENOSPC, "No space left on device")

    told(tmp_path / "folder" / "deep" / "part", nested)


@pytest.mark.parametrize("atomic", [atomic_file, atomic_dir])
def test_what_fails_while_reading_something_else_is_not_called_an_output_error(tmp_path, atomic):
    missing = FileNotFoundError(errno.ENOENT, "No such file", str(tmp_path / "input"))
    for error in (missing, BrokenPipeError(errno.EPIPE, "Broken pipe")):
        with pytest.raises(type(error)):
            fails(atomic, tmp_path / "result", error)()


def test_a_file_size_limit_is_told(tmp_path):
    code = """
import resource, sys
from pathlib import Path
from mapfilter._io import atomic_file
from mapfilter.errors import OutputError
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
try:
    with atomic_file(Path(sys.argv[1])) as new:
        new.write_bytes(bytes(5000))
except OutputError as error:
    print(error)
"""
    run = subprocess.run([sys.executable, "-c", code, str(tmp_path / "f")],
                         capture_output=True, text=True, check=True)  # fmt: skip
    assert "found File too large" in run.stdout
    assert names(tmp_path) == []


@pytest.mark.parametrize("dangling", [False, True])
def test_output_through_a_link_replaces_what_it_leads_to(tmp_path, dangling):
    disk, here = tmp_path / "disk", tmp_path / "here"
    disk.mkdir()
    here.mkdir()
    (here / "file").symlink_to(disk / "big file")
    (here / "folder").symlink_to(Path("..") / "disk" / "big folder")
    if not dangling:
        (disk / "big file").write_text("old")
        write_folder(disk / "big folder", "old")
    with atomic_file(here / "file") as temporary:
        assert temporary.name == "file"
        temporary.write_text("new")
    write_folder(here / "folder", "new")
    assert (here / "file").is_symlink()
    assert (here / "folder").is_symlink()
    assert (disk / "big file").read_text() == "new"
    assert read_folder(disk / "big folder") == {"deep/part": "new"}
    assert names(disk) == ["big file", "big folder"]
    assert names(here) == ["file", "folder"]


@pytest.fixture
def synced(monkeypatch):
    """Names of files and folders in the order in which they are flushed to the disk."""
    names_, fsync = [], os.fsync

    def noted(handle):
        names_.append(Path(f"/proc/self/fd/{handle}").readlink().name)
        fsync(handle)

    monkeypatch.setattr(os, "fsync", noted)
    return names_


def test_files_and_folders_are_on_the_disk_before_and_after_the_rename(tmp_path, synced):
    write_folder(tmp_path / "folder", "text")
    # What lies in the folder is synced side by side, in any order.
    assert sorted(synced[:-2]) == ["deep", "part"]
    assert synced[-2:] == ["new", tmp_path.name]
    synced.clear()
    with atomic_file(tmp_path / "file") as temporary:
        temporary.write_text("")
    assert synced == ["file", tmp_path.name]


def test_files_of_a_new_folder_are_flushed_once(tmp_path, synced):
    with replaced_files(tmp_path / "results", lambda: ()) as new:
        for path in (new / "a", new / "deep" / "b"):
            with atomic_file(path) as temporary:
                temporary.write_text("text")
    assert sorted(synced) == sorted(["a", "b", "deep", "results", tmp_path.name])
    synced.clear()
    with atomic_dir(tmp_path / "folder") as new, atomic_file(new / "deep" / "part") as temporary:
        temporary.write_text("text")
    assert sorted(synced) == sorted(["deep", "new", "part", tmp_path.name])
    assert read_folder(tmp_path / "folder") == {"deep/part": "text"}


def test_folders_that_cannot_be_synced_are_let_go(tmp_path, monkeypatch):
    fsync = os.fsync

    def only_files(handle):
        if Path(f"/proc/self/fd/{handle}").is_dir():
            raise OSError(errno.EINVAL, "Invalid argument")
        fsync(handle)

    monkeypatch.setattr(os, "fsync", only_files)
    write_folder(tmp_path / "folder", "text")
    assert read_folder(tmp_path / "folder") == {"deep/part": "text"}


EMPTY = hashlib.sha256(b"").hexdigest()
LISTED = [{"path": path, "sha256": EMPTY} for path in ("one", "deep/two", "notes.txt", "../x")]
HEAD = json.dumps({"format": "a thing", "parts": [*LISTED, 3, {}]})


def check(folder):
    check_replaceable(folder, "head.json", "a thing", {"one", "deep/two", "../x"}.__contains__)


@pytest.mark.parametrize(
    ("files", "foreign"),
    [
        ({}, None),
        ({"head.json": HEAD, "one": "", "deep/two": ""}, None),
        ({"head.json": HEAD, "one": "", "deep/three": ""}, "deep/three"),
        ({"head.json": HEAD, ".hidden": ""}, ".hidden"),
        ({"head.json": HEAD, "one": "changed by hand"}, "one"),
        ({"head.json": HEAD, "notes.txt": ""}, "notes.txt"),
        ({"head.json": json.dumps(sealed(json.loads(HEAD))), "one": ""}, None),
        (
            {"head.json": json.dumps({**sealed(json.loads(HEAD)), "more": 1}), "one": ""},
            "head.json, one",
        ),
        ({"head.json": '{"format": "other", "parts": []}'}, "head.json"),
        ({"head.json": '{"format": "a thing"}'}, "head.json"),
        ({"head.json": HEAD[:20], "one": ""}, "head.json, one"),
        ({"a": "", "b": "", "c": "", "d": ""}, "a, b, c, …"),
    ],
)
def test_only_what_a_head_lists_and_is_as_it_was_may_be_replaced(tmp_path, files, foreign):
    folder = tmp_path / "folder"
    (tmp_path / "x").touch()
    check(folder)
    (folder / "deep").mkdir(parents=True)
    for name, text in files.items():
        (folder / name).write_text(text)
    if foreign is None:
        check(folder)
    else:
        fault = told(folder, lambda: check(folder))
        assert fault.got == f"other files ({foreign})"


def test_a_link_in_a_folder_is_somebody_elses(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "link").symlink_to(tmp_path)
    told(tmp_path / "folder", lambda: check(tmp_path / "folder"))


def test_a_listed_part_that_is_a_link_to_nothing_is_no_part(tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir()
    head = {"format": "x", "parts": [{"path": "part", "sha256": "0" * 64}]}
    (folder / "head.json").write_text(json.dumps(head))
    (folder / "part").symlink_to("nowhere")
    with pytest.raises(OutputError, match="other files"):
        check_replaceable(folder, "head.json", "x", lambda _: True)


def test_what_is_put_into_a_folder_or_changed_there_while_it_is_replaced_is_kept(tmp_path):
    folder = tmp_path / "folder"
    write_folder(folder, "old")
    (folder / "plain").write_text("old")
    with atomic_dir(folder) as new:
        (new / "part").write_text("new")
        (folder / "deep" / "mine").write_text("of the user")
        (folder / "plain").write_text("edited")
    assert read_folder(folder) == {"part": "new"}
    assert read_folder(tmp_path / "folder.kept") == {"deep/mine": "of the user", "plain": "edited"}
    with atomic_dir(folder) as new:
        (new / "part").write_text("newer")
        (folder / "mine too").write_text("of the user")
    assert read_folder(tmp_path / "folder.kept2") == {"mine too": "of the user"}
    assert names(tmp_path) == ["folder", "folder.kept", "folder.kept2"]


def test_a_folder_that_somebody_makes_while_the_first_result_is_written_is_kept(tmp_path):
    folder = tmp_path / "folder"
    with atomic_dir(folder) as new:
        (new / "part").write_text("new")
        (folder / "deep").mkdir(parents=True)
        (folder / "deep" / "mine").write_text("of the user")
    assert read_folder(folder) == {"part": "new"}
    assert read_folder(tmp_path / "folder.kept") == {"deep/mine": "of the user"}
    assert names(tmp_path) == ["folder", "folder.kept"]


def test_what_cannot_be_kept_is_not_removed_and_kept_by_the_next_write(tmp_path, monkeypatch):
    folder = tmp_path / "folder"
    write_folder(folder, "old")

    def refused(*_):
        raise PermissionError(errno.EACCES, "Permission denied")

    with monkeypatch.context() as patch:
        patch.setattr(_replace, "_keep", refused)
        with atomic_dir(folder) as new:
            (new / "part").write_text("new")
            (folder / "mine").write_text("of the user")
    assert read_folder(folder) == {"part": "new"}
    monkeypatch.setattr(_io, "is_left", lambda _: True)
    write_folder(folder, "newer")
    assert read_folder(tmp_path / "folder.kept") == {"mine": "of the user"}
    assert names(tmp_path) == ["folder", "folder.kept"]


def test_so_it_is_when_the_writer_is_killed_after_the_exchange(tmp_path):
    code = """
import os, sys
from pathlib import Path
from mapfilter import _io
folder = Path(sys.argv[1])
_io.discard = lambda *_: os._exit(9)
with _io.atomic_dir(folder) as new:
    (new / "part").write_text("new")
    (folder / "mine").write_text("of the user")
"""
    folder = tmp_path / "folder"
    write_folder(folder, "old")
    run = subprocess.run([sys.executable, "-c", code, str(folder)], check=False)
    assert run.returncode == 9
    assert read_folder(folder) == {"part": "new"}
    with atomic_dir(folder) as new:
        (new / "part").write_text("newer")
    assert read_folder(folder) == {"part": "newer"}
    assert read_folder(tmp_path / "folder.kept") == {"mine": "of the user"}
    assert names(tmp_path) == ["folder", "folder.kept"]


def test_versions():
    check_version("x", 1, 1)
    for found, hint in ((2, "newer"), (0, "edited"), (None, "edited"), ("2", "edited"),
                        (True, "edited"), (1.5, "edited")):  # fmt: skip
        with pytest.raises(StoreError, match=hint):
            check_version("x", found, 1)


def test_what_another_command_wrote_meanwhile_with_the_same_bytes_is_not_kept(tmp_path):
    path = tmp_path / "folder"
    with atomic_dir(path) as new:
        (new / "same").write_text("as it was written")
        (new / "own").write_text("mine")
        (new / "link").symlink_to("same")
        write_folder(path, "of another command")
        (path / "same").write_text("as it was written")
        (path / "own").write_text("his!")
        (path / "link").write_text("as it was written")
    assert read_folder(tmp_path / "folder.kept") == {
        "deep/part": "of another command",
        "own": "his!",
        "link": "as it was written",
    }


def test_two_equal_commands_at_once_leave_one_result(tmp_path):
    path = tmp_path / "folder"
    with atomic_dir(path) as new:
        (new / "deep").mkdir()
        (new / "deep" / "part").write_text("equal")
        write_folder(path, "equal")
    assert names(tmp_path) == ["folder"]
