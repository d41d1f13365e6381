"""Atomic writes and checksums: nothing half-written is ever left behind.

A result is written beside its place and renamed into it. A process killed in between leaves the
old result intact, and a hidden ``.NAME.partial-*`` that the next write of that name removes.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from mapfilter.errors import MapfilterError, OutputError, StoreError, fail

_CHUNK_BYTES = 1 << 20
_ASIDE = "old"
_AT_FDCWD = -100
_RENAME_EXCHANGE = 2


def sha256_file(path: Path) -> str:
    """Return the SHA-256 of a file's bytes as hexadecimal digits."""
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while chunk := stream.read(_CHUNK_BYTES):
            digest.update(chunk)
    return digest.hexdigest()


@contextlib.contextmanager
def atomic_file(path: Path) -> Iterator[Path]:
    """Give a temporary path beside ``path``; rename it into place when the block succeeds.

    The temporary path keeps the suffix of ``path``, because drivers choose formats by it.

    Raises
    ------
    OutputError
        The folder cannot be made or written.
    """
    partial = _partial_folder(path)
    temporary = partial / path.name
    try:
        yield temporary
        _sync(temporary)
        try:
            temporary.replace(path)
        except OSError as error:
            raise _not_writable(path, error) from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)


@contextlib.contextmanager
def atomic_dir(path: Path) -> Iterator[Path]:
    """Give a temporary folder beside ``path``; exchange it with ``path`` when the block succeeds.

    Raises
    ------
    OutputError
        The parent folder cannot be made or written, or ``path`` is a file.
    """
    if path.exists() and not path.is_dir():
        raise fail(OutputError, str(path), "a folder, or nothing yet", "a file")
    partial = _partial_folder(path)
    new = partial / "new"
    new.mkdir()
    try:
        yield new
        for file in sorted(new.rglob("*")):
            _sync(file)
        try:
            if path.exists():
                _exchange(new, path)
            else:
                new.rename(path)
        except OSError as error:
            raise _not_writable(path, error) from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def write_json(path: Path, value: Mapping[str, Any]) -> None:
    """Write a JSON object atomically, keys in the order given."""
    with atomic_file(path) as temporary:
        text = json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object that mapfilter wrote.

    Raises
    ------
    StoreError
        The file is missing, cut off or not a JSON object.
    """
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise fail(StoreError, str(path), "a readable file", error.strerror or error) from error
    except (ValueError, RecursionError) as error:
        raise fail(StoreError, str(path), "JSON", f"no JSON ({error})", "cut off") from error
    if not isinstance(value, dict):
        raise fail(StoreError, str(path), "a JSON object", type(value).__name__)
    return value


def ensure_writable_folder(path: Path) -> None:
    """Make ``path`` and its parents, and see that files can be made in it.

    Raises
    ------
    OutputError
        It cannot be made, is a file, or nothing can be written in it.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise _not_writable(path, error) from error


def _partial_folder(path: Path) -> Path:
    ensure_writable_folder(path.parent)
    prefix = f".{path.name}.partial-"
    for stale in path.parent.glob(f"{_glob_escape(prefix)}*"):
        if not _is_alive(stale.name.removeprefix(prefix).split("-")[0]):
            if (stale / _ASIDE).is_dir() and not path.exists():
                # Its process died between the two renames of an exchange.
                (stale / _ASIDE).rename(path)
            shutil.rmtree(stale, ignore_errors=True)
    try:
        return Path(tempfile.mkdtemp(prefix=f"{prefix}{os.getpid()}-", dir=path.parent))
    except OSError as error:
        raise _not_writable(path, error) from error


def _glob_escape(text: str) -> str:
    return "".join(f"[{c}]" if c in "*?[" else c for c in text)


def _is_alive(pid: str) -> bool:
    try:
        os.kill(int(pid), 0)
    except (ValueError, OverflowError, ProcessLookupError):
        return False
    except PermissionError:
        return True
    return True


def _exchange(new: Path, old: Path) -> None:
    """Swap two folders in one step where the system can, else by two renames."""
    renameat2 = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if renameat2 is not None:
        ends = os.fsencode(new), os.fsencode(old)
        if renameat2(_AT_FDCWD, ends[0], _AT_FDCWD, ends[1], _RENAME_EXCHANGE) == 0:
            return
        if ctypes.get_errno() not in (errno.EINVAL, errno.ENOSYS):
            number = ctypes.get_errno()
            raise OSError(number, os.strerror(number), str(old))
    aside = new.with_name(_ASIDE)
    old.rename(aside)
    try:
        new.rename(old)
    except BaseException:
        aside.rename(old)
        raise


def _sync(path: Path) -> None:
    if path.is_file():
        with path.open("rb") as stream:
            os.fsync(stream.fileno())


def _not_writable(path: Path, error: OSError) -> MapfilterError:
    return fail(OutputError, str(path), "a place that can be written", error.strerror or error)
