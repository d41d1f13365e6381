"""Atomic writes and checksums: no incomplete file is ever left behind.

A result is written beside its place and renamed into it. A process killed in between leaves the
old result intact, and a hidden ``.NAME.partial-*`` that the next write of that name removes.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache
from io import BufferedReader
from pathlib import Path
from typing import Any

from mapfilter._inputs import is_unicode, json_value, open_input, read_input
from mapfilter._partial import is_in_new, is_left, new_partial, nothing_left, partials
from mapfilter._replace import ASIDE, NEW, discard, exchange, note_old
from mapfilter.errors import Faults, MapfilterError, OutputError, StoreError, fail

_LARGEST_JSON_BYTES = 256 << 20
_SEAL = "sha256"
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


def left_aside(path: Path) -> Path | None:
    """Return the folder moved aside by a replacement that was cut short, if there is one."""
    found = (partial / ASIDE for partial in partials(path))
    return next((aside for aside in found if aside.is_dir()), None)


def check_replaceable(folder: Path, head: str, what: str, own: Callable[[str], bool]) -> None:
    """Raise OutputError where a folder, which may be absent, holds files of others.

    Those of mapfilter are listed as ``parts`` in the JSON file ``head``, with ``what`` as format,
    and are as they were written: their names are ``own``, and their checksums those of the list.
    A list that was edited is not believed.
    """
    inner = folder.rglob("*") if folder.is_dir() else ()
    found = {p.relative_to(folder).as_posix() for p in inner if p.is_symlink() or not p.is_dir()}
    try:
        value = read_json(folder / head)
        if _SEAL in value:
            check_seal(value, head)
    except StoreError:
        value = {}
    if value.get("format") == what and isinstance(parts := value.get("parts"), list):
        listed = {str(one.get("path")): one for one in parts if isinstance(one, dict)}
        names = filter(own, found & set(listed))
        found -= {head, *(name for name in names if _as_listed(folder, listed[name]))}
    if foreign := sorted(found):
        got = f"other files ({', '.join(foreign[:3])}{', …' if len(foreign) > 3 else ''})"
        hint = "a mistyped path, or files edited since; choose another, or move the files away"
        raise fail(OutputError, str(folder), f"a {what}, or nothing yet", got, hint)


def _as_listed(folder: Path, part: Mapping[str, Any]) -> bool:
    try:
        return sha256_file(folder / str(part["path"])) == part.get("sha256")
    except (OSError, StoreError):
        return False


def check_part(file: Path, part: Mapping[str, Any], faults: Faults, *, full: bool = True) -> bool:
    """Note where a file is missing or has another size (``full``: or SHA-256) than its entry."""
    size, digest, before = part.get("bytes"), str(part.get("sha256")), len(faults.found)
    if not file.is_file():
        faults.add(str(file), f"a file of {size} bytes", "no such file", "not copied whole")
    elif (found := file.stat().st_size) != size:
        faults.add(str(file), f"{size} bytes", f"{found} bytes", "cut off or overwritten")
    elif full and (of_file := sha256_file(file)) != digest:
        expected, got = f"SHA-256 {digest[:12]}…", f"{of_file[:12]}…"
        faults.add(str(file), expected, got, "changed after it was written")
    return len(faults.found) == before


def check_version(where: str, found: object, known: int) -> None:
    """Raise StoreError where a file has another version than this mapfilter reads."""
    if found == known and not isinstance(found, bool):
        return
    newer = isinstance(found, int) and found > known
    older = isinstance(found, int) and not isinstance(found, bool) and 0 < found < known
    hint = "written by a newer mapfilter; update it" if newer else "edited or damaged"
    if older:
        hint = "written by an older mapfilter; make it again"
    raise fail(StoreError, where, f"version {known}", found, hint)


def write_json(path: Path, value: Mapping[str, Any]) -> None:
    """Write a JSON object atomically, keys in the order given."""
    with atomic_file(path) as temporary:
        text = json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object; raise StoreError where it is missing, cut off or something else."""
    data = read_input(path, _LARGEST_JSON_BYTES, "JSON", StoreError)
    return parse_json(data, str(path))


def parse_json(data: bytes, where: str) -> dict[str, Any]:
    """Return the JSON object that a file's bytes hold; raise StoreError for something else."""
    try:
        value = json_value(data)
    except (ValueError, RecursionError) as error:
        hint = "cut off" if isinstance(error, json.JSONDecodeError) else "edited or damaged"
        raise fail(StoreError, where, "JSON", f"no JSON ({error})", hint) from error
    if not is_unicode(value):
        hint = "half of a surrogate pair: text cut off, or decoded twice"
        raise fail(StoreError, where, "text in Unicode", "a lone surrogate", hint)
    if not isinstance(value, dict):
        raise fail(StoreError, where, "a JSON object", type(value).__name__)
    return value


def sealed(value: Mapping[str, Any]) -> dict[str, Any]:
    """Return a JSON object with the SHA-256 of all its other entries under ``sha256``."""
    rest = {key: item for key, item in value.items() if key != _SEAL}
    text = json.dumps(rest, sort_keys=True, separators=(",", ":"))
    return {**rest, _SEAL: hashlib.sha256(text.encode()).hexdigest()}


def check_seal(value: Mapping[str, Any], where: str) -> None:
    """Raise StoreError where an object that :func:`sealed` made was changed, if only by a digit."""
    if value.get(_SEAL) != sealed(value)[_SEAL]:
        expected, got = "entries as they were written", "others, by their SHA-256"
        raise fail(StoreError, where, expected, got, "edited or damaged")


def write_sealed(path: Path, value: Mapping[str, Any]) -> None:
    """Write a JSON object with its checksum, for :func:`read_sealed`."""
    write_json(path, sealed(value))


def read_sealed(path: Path) -> dict[str, Any]:
    """Read a JSON object; raise StoreError where it is missing, cut off or changed."""
    value = read_json(path)
    check_seal(value, str(path))
    return value


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
