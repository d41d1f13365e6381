"""Exchanging folders, and removing of the older one no more than what was there at the beginning.

While a result is written, which may take hours, somebody may put a file into the folder that it is
going to replace, or change one there. Such files are kept beside it, in ``NAME.kept``, unless the
new result holds the same bytes under their names, as after two equal commands at once.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import filecmp
import itertools
import json
import os
import shutil
from pathlib import Path
from typing import Any

ASIDE = "old"
NEW = "new"

_AT_FDCWD = -100
_RENAME_EXCHANGE = 2
_LISTING = "old.json"


def note_old(partial: Path, target: Path) -> None:
    """Note which files a folder holds that is going to be replaced; none if it is not there."""
    noted: dict[str, Any] = {"inode": None, "files": {}, "new": (partial / NEW).stat().st_ino}
    if target.is_dir():
        noted |= {"inode": target.stat().st_ino, "files": _files(target)}
    (partial / _LISTING).write_text(json.dumps(noted), encoding="utf-8")


def discard(partial: Path, target: Path) -> None:
    """Remove a partial folder; what was added to or changed in the older result is kept.

    ``partial`` holds a half-written result, or after an exchange the older one.
    """
    try:
        noted = json.loads((partial / _LISTING).read_text(encoding="utf-8"))
        inode, files, new = noted["inode"], noted["files"], noted["new"]
    except (OSError, ValueError, KeyError, TypeError):
        inode, files, new = None, {}, None
    for name in (NEW, ASIDE):
        old = partial / name
        if new is None or not old.is_dir():
            continue
        found = old.stat().st_ino
        # Where nothing was there at first, whatever was replaced came meanwhile.
        if found == new or inode not in (None, found):
            continue
        changed = (path for path, stamp in _files(old).items() if files.get(path) != stamp)
        others = [path for path in changed if not _same(old / path, target / path)]
        if others:
            try:
                _keep(old, others, target)
            except OSError:
                # What cannot be kept is not removed; the next write of this name tries again.
                return
    shutil.rmtree(partial, ignore_errors=True)


def exchange(new: Path, old: Path) -> None:
    """Swap two folders in one step where the system can, else by two renames."""
    renameat2 = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if renameat2 is not None:
        ends = os.fsencode(new), os.fsencode(old)
        if renameat2(_AT_FDCWD, ends[0], _AT_FDCWD, ends[1], _RENAME_EXCHANGE) == 0:
            return
        if ctypes.get_errno() not in (errno.EINVAL, errno.ENOSYS):
            number = ctypes.get_errno()
            raise OSError(number, os.strerror(number), str(old))
    aside = new.with_name(ASIDE)
    old.rename(aside)
    try:
        new.rename(old)
    except BaseException:
        aside.rename(old)
        raise


def _files(folder: Path) -> dict[str, list[int]]:
    """Return inode, size and time of change of each file in a folder and those within it."""
    found = {}
    for path in folder.rglob("*"):
        with contextlib.suppress(FileNotFoundError):
            stat = path.lstat()
            if path.is_symlink() or not path.is_dir():
                name = path.relative_to(folder).as_posix()
                found[name] = [stat.st_ino, stat.st_size, stat.st_mtime_ns]
    return found


def _same(one: Path, other: Path) -> bool:
    """Return whether two regular files hold the same bytes."""
    if one.is_symlink() or other.is_symlink() or not (one.is_file() and other.is_file()):
        return False
    try:
        return filecmp.cmp(one, other, shallow=False)
    except OSError:
        return False


def _keep(old: Path, paths: list[str], target: Path) -> None:
    names = (f"{target.name}.kept{'' if n == 1 else n}" for n in itertools.count(1))
    kept = next(place for place in map(target.with_name, names) if not os.path.lexists(place))
    for path in paths:
        (kept / path).parent.mkdir(parents=True, exist_ok=True)
        (old / path).rename(kept / path)
