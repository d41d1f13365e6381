"""Exchanging folders, and removing of the older one no more than what was there at the beginning.

While a result is written, which may take hours, somebody may put a file into the folder that it is
going to replace, or change one there. Such files are kept beside it, in ``NAME.kept``.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import itertools
import json
import os
import shutil
from pathlib import Path

ASIDE = "old"
NEW = "new"

_AT_FDCWD = -100
_RENAME_EXCHANGE = 2
_LISTING = "old.json"


def note_old(partial: Path, target: Path) -> None:
    """Note which files a folder holds that is going to be replaced, if it is there."""
    if target.is_dir():
        noted = {"inode": target.stat().st_ino, "files": _files(target)}
        (partial / _LISTING).write_text(json.dumps(noted), encoding="utf-8")


def discard(partial: Path, target: Path) -> None:
    """Remove a partial folder; what was added to or changed in the older result is kept.

    ``partial`` holds a half-written result, or after an exchange the older one.
    """
    try:
        noted = json.loads((partial / _LISTING).read_text(encoding="utf-8"))
        inode, files = noted["inode"], noted["files"]
    except (OSError, ValueError, KeyError, TypeError):
        inode, files = None, {}
    for name in (NEW, ASIDE):
        old = partial / name
        if inode is None or not old.is_dir() or old.stat().st_ino != inode:
            continue
        others = [path for path, stamp in _files(old).items() if files.get(path) != stamp]
        if others:
            with contextlib.suppress(OSError):
                _keep(old, others, target)
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


def _keep(old: Path, paths: list[str], target: Path) -> None:
    names = (f"{target.name}.kept{'' if n == 1 else n}" for n in itertools.count(1))
    kept = next(place for place in map(target.with_name, names) if not os.path.lexists(place))
    for path in paths:
        (kept / path).parent.mkdir(parents=True, exist_ok=True)
        (old / path).rename(kept / path)
