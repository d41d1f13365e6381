"""Names of half-written results, which tell whether their process still lives.

A name is ``.NAME.partial-HOST-PID-TOKEN``: folders are shared by hosts whose process numbers mean
nothing to each other. TOKEN is random, and tells apart the results that one process writes.
"""

from __future__ import annotations

import contextlib
import glob
import hashlib
import os
import platform
import re
import shutil
import tempfile
import time
import uuid
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from mapfilter._replace import ASIDE, NEW

ABANDONED_S = 7 * 86400.0
"""So long after its last change, the folder of a process of another host is taken for left."""
_LOOK_S = 0.02
_NAME = re.compile(r"(?:(?P<host>h[0-9a-f]{8})-)?(?P<pid>[0-9]{1,20})-[^-]{0,64}")


@contextlib.contextmanager
def nothing_left(*folders: Path) -> Iterator[None]:
    """Remove, where the block fails, folders that it made and that hold no file.

    Those are the folders and what is in them, as far as they were not there before, and their
    parents that were made for them, where nothing else is in those.
    """
    made = [(folder, tuple(_absent_parents(folder))) for folder in folders if _is_absent(folder)]
    try:
        yield
    except BaseException:
        # Longer paths are inside shorter ones.
        for folder, parents in sorted(made, key=lambda one: -len(one[0].parts)):
            removed = False
            if not folder.is_symlink():
                for inner in (Path(root) for root, _, _ in os.walk(folder, topdown=False)):
                    # What is hidden, and empty for now, may be what another process begins.
                    hidden = any(part.startswith(".") for part in inner.relative_to(folder).parts)
                    removed = not hidden and _remove_empty(inner)
            # Parents of a folder that was not made are of others, and those that hold anything.
            if removed:
                all(map(_remove_empty, parents))
        raise


def _remove_empty(folder: Path) -> bool:
    """Remove a folder unless something is in it, or another process begins it."""
    with contextlib.suppress(OSError):
        if ".partial-" not in folder.name:
            folder.rmdir()
            return True
    return False


def _absent_parents(folder: Path) -> Iterator[Path]:
    """Yield the parents of a folder that are not there, the innermost first."""
    while _is_absent(folder := folder.parent):
        yield folder


def _is_absent(folder: Path) -> bool:
    """Return whether there is no such folder; not where that cannot be told."""
    try:
        return folder != folder.parent and not folder.exists()
    except OSError:
        return False


def new_partial(path: Path) -> Path:
    """Make a new hidden folder beside a path; raises OSError."""
    prefix = f"{_prefix(path)}{_host()}-{os.getpid()}-"
    return Path(tempfile.mkdtemp(prefix=prefix, dir=path.parent))


def partials(path: Path) -> Iterator[Path]:
    """Yield the folders of half-written results of a path."""
    yield from sorted(path.parent.glob(f"{glob.escape(_prefix(path))}*"))


def is_left(partial: Path) -> bool:
    """Return whether nobody writes into a folder any more.

    Of a process of this host that is known; one of another host may be at work for a week since
    the last change of a file.
    """
    found = _NAME.fullmatch(partial.name.rpartition(".partial-")[2])
    if found is None:
        return True
    if found["host"] in (None, _host()):
        return not _is_alive(found["pid"])
    return time.time() - _changed_s(partial) > ABANDONED_S


def is_in_new(path: Path) -> bool:
    """Return whether a path lies in a half-written result that is a folder."""
    return any(one.name == NEW and ".partial-" in one.parent.name for one in path.parents)


def remove_left(folder: Path, wait_s: float) -> None:
    """Remove what processes left half-written in a folder and in those in it.

    Each process that still lives is waited for, as long as ``wait_s``. An older result that was set
    aside stays for the next write, which puts it back.
    """
    for partial in sorted(folder.rglob(".*.partial-*")):
        until_s = time.monotonic() + wait_s
        while not is_left(partial) and time.monotonic() < until_s:
            time.sleep(_LOOK_S)
        if is_left(partial) and not (partial / ASIDE).exists():
            shutil.rmtree(partial, ignore_errors=True)


def _prefix(path: Path) -> str:
    return f".{path.name}.partial-"


@cache
def _host() -> str:
    """Return a short name of this host; two containers on it have two."""
    known = f"{platform.node()}\0{uuid.getnode()}"
    return f"h{hashlib.sha256(known.encode()).hexdigest()[:8]}"


def _changed_s(folder: Path) -> float:
    newest_s = 0.0
    for path in (folder, *folder.rglob("*")):
        with contextlib.suppress(OSError):
            newest_s = max(newest_s, path.lstat().st_mtime)
    return newest_s


def _is_alive(pid: str) -> bool:
    try:
        with contextlib.suppress(PermissionError):
            os.kill(int(pid), 0)
    except (ValueError, OverflowError, ProcessLookupError):
        return False
    return True
