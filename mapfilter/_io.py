"""Atomic writes and checksums: no incomplete file is ever left behind.

A result is written beside its place and renamed into it. A process killed in between leaves the
old result intact, and a hidden ``.NAME.partial-*`` that the next write of that name removes.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache
from io import BufferedReader
from pathlib import Path

from mapfilter._inputs import open_input
from mapfilter._partial import is_in_new, is_left, new_partial, nothing_left, partials
from mapfilter._replace import ASIDE, NEW, discard, exchange, note_old
from mapfilter.errors import MapfilterError, OutputError, StoreError, fail

_SYNCED_AT_ONCE = 16
_WRITE_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)


@cache
def program_version() -> str:
    """Return the version of the program, for the record in what it writes."""
    # Here, as it takes a tenth of the time of --help, and few results need it.
    from importlib.metadata import version

    return version("mapfilter")


def sha256_file(path: Path) -> str:
    """Return the SHA-256 of a file's bytes as hexadecimal digits."""
    with open_input(path, StoreError) as stream:
        return sha256_of(stream)


def sha256_of(stream: BufferedReader) -> str:
    """Return the SHA-256 of an open file, which is then again at its beginning."""
    digest = hashlib.file_digest(stream, "sha256").hexdigest()
    stream.seek(0)
    return digest


@contextlib.contextmanager
def atomic_file(path: Path) -> Iterator[Path]:
    """Give a temporary path beside ``path``; rename it into place when the block succeeds.

    The temporary path keeps the suffix of ``path``, because drivers choose formats by it. Where
    ``path`` is a link, its target is replaced. What lies in a new folder of :func:`atomic_dir` or
    :func:`replaced_files` is flushed to the disk with this. Raises OutputError where a file or its
    folder cannot be written, as on a full disk.
    """
    with nothing_left(path.parent):
        target, partial = _partial_folder(path)
        temporary = partial / path.name
        flushed = not is_in_new(target)
        try:
            with _writing(temporary, path):
                yield temporary
                if flushed:
                    _sync(temporary)
            with _into_place(path, target, flushed=flushed):
                temporary.replace(target)
        finally:
            shutil.rmtree(partial, ignore_errors=True)


@contextlib.contextmanager
def atomic_dir(path: Path) -> Iterator[Path]:
    """Give a temporary folder beside ``path``; exchange it with ``path`` when the block succeeds.

    Where ``path`` is a link, its target is replaced. Of the older folder only what it held at the
    beginning is removed; the rest is kept beside it as ``NAME.kept``. Raises OutputError where
    ``path`` is a file, or the folder cannot be written.
    """
    if path.exists() and not path.is_dir():
        raise fail(OutputError, str(path), "a folder, or nothing yet", "a file")
    with nothing_left(path.parent):
        target, partial = _partial_folder(path)
        new = partial / NEW
        try:
            with _writing(new, path):
                new.mkdir()
                note_old(partial, target)
                yield new
                _sync_all(sorted(new.rglob("*")))
                _sync(new)
            with _into_place(path, target):
                if target.exists():
                    exchange(new, target)
                else:
                    new.rename(target)
        finally:
            discard(partial, target)


@contextlib.contextmanager
def replaced_files(folder: Path, older: Callable[[], Iterable[Path]]) -> Iterator[Path]:
    """Give a new folder; when the block succeeds, move the files in it into ``folder``.

    Files of the same name there are replaced one by one, and those of ``older``, asked for then,
    that have no successor are removed, with folders that they leave empty. All others stay, and if
    the block fails, all. Raises OutputError where the folder cannot be written.
    """
    with nothing_left(folder):
        ensure_writable_folder(folder)
        _, partial = _partial_folder(folder / "results")
        new = partial / NEW
        try:
            with _writing(new, folder):
                new.mkdir()
                yield new
            with _into_place(folder, folder):
                stale = set(older())
                files = sorted(path for path in new.rglob("*") if not path.is_dir())
                _sync_all(files)
                for file in files:
                    target = folder / file.relative_to(new)
                    target.parent.mkdir(parents=True, exist_ok=True)
                    file.replace(target)
                    stale.discard(target)
                _sync_all({(folder / file.relative_to(new)).parent for file in files})
                for path in sorted(stale):
                    path.unlink(missing_ok=True)
                    if path.parent != folder and not any(path.parent.iterdir()):
                        path.parent.rmdir()
        finally:
            shutil.rmtree(partial, ignore_errors=True)


def check_replaceable(path: Path, is_own: Callable[[Path], bool], older: str) -> None:
    """Check that a path holds nothing yet, or a file that may be replaced.

    Parameters
    ----------
    is_own : callable
        Tells whether a file is one of those that ``older`` names.
    older : str
        Such as "an older export".

    Raises
    ------
    OutputError
        There is a folder or another file.
    """
    if not path.exists() or (path.is_file() and is_own(path)):
        return
    got = "a folder" if path.is_dir() else "a file of another program, or one changed since"
    hint = "an input, or a file that was edited; give another name, or move it away"
    raise fail(OutputError, str(path), f"nothing yet, or {older}", got, hint)


def left_aside(path: Path) -> Path | None:
    """Return the folder moved aside by a replacement that was cut short, if there is one."""
    found = (partial / ASIDE for partial in partials(path))
    return next((aside for aside in found if aside.is_dir()), None)


def ensure_writable_folder(path: Path) -> None:
    """Make ``path`` and its parents; raise OutputError where no file can be made in it."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise _not_writable(path, error) from error


@contextlib.contextmanager
def _writing(temporary: Path, path: Path) -> Iterator[None]:
    """Turn errors in writing ``temporary`` into OutputErrors of ``path``, but not of reading."""
    try:
        yield
    except OutputError as error:
        named = (replace(f, where=f.where.replace(str(temporary), str(path))) for f in error.faults)
        raise OutputError(tuple(named)) from error
    except OSError as error:
        if isinstance(error.filename, str | bytes):
            of_writing = Path(os.fsdecode(error.filename)).is_relative_to(temporary.parent)
        else:
            of_writing = error.errno in _WRITE_ERRORS
        if not of_writing:
            raise
        raise _not_writable(path, error) from error


@contextlib.contextmanager
def _into_place(path: Path, target: Path, *, flushed: bool = True) -> Iterator[None]:
    try:
        yield
        if flushed:
            _sync(target.parent)
    except OSError as error:
        raise _not_writable(path, error) from error


def _partial_folder(path: Path) -> tuple[Path, Path]:
    """Return the target of a path that may be a link, and a new hidden folder beside it."""
    path = Path(os.path.realpath(path)) if path.is_symlink() else path
    ensure_writable_folder(path.parent)
    for stale in partials(path):
        if is_left(stale):
            if (stale / ASIDE).is_dir() and not path.exists():
                # Its process died between the two renames of an exchange.
                (stale / ASIDE).rename(path)
            discard(stale, path)
    try:
        return path, new_partial(path)
    except OSError as error:
        raise _not_writable(path, error) from error


def _sync_all(paths: Iterable[Path]) -> None:
    """Do what :func:`_sync` does for files and folders, side by side."""
    # Most of the time of each is waiting for the disk, which takes many at once.
    with ThreadPoolExecutor(_SYNCED_AT_ONCE) as pool:
        for _ in pool.map(_sync, paths):
            pass


def _sync(path: Path) -> None:
    """Flush a file, or a folder's list of names, to the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        # Not every file system can do this for folders.
        if error.errno != errno.EINVAL or not path.is_dir():
            raise
    finally:
        os.close(handle)


def _not_writable(path: Path, error: OSError) -> MapfilterError:
    return fail(OutputError, str(path), "a place that can be written", error.strerror or error)
