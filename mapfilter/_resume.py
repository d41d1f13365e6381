"""Resume long computations: finished parts stay on disk, with what determines them.

A part is taken over only where the inputs are the same. Either a head of digests lies beside the
parts and is compared (:func:`start_or_resume`: other inputs are refused), or the digest is part of
the folder's name (:class:`FinishedParts`: parts of other inputs are not found).
"""

from __future__ import annotations

import contextlib
import os
import shutil
import zlib
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from pathlib import Path

from mapfilter._inputs import read_input
from mapfilter._io import ensure_writable_folder, read_json, write_json
from mapfilter.errors import ConfigError, InputError, OutputError, fail

_CHECKSUM_BYTES = 4
_LARGEST_PART_BYTES = 1 << 30


def start_or_resume(
    head_file: Path,
    head: Mapping[str, object],
    parts: Iterable[Path],
    *,
    resume: bool,
    names: Mapping[str, str] | None = None,
) -> bool:
    """Write the head of a computation, and remove older parts unless it is resumed.

    Parameters
    ----------
    head_file : Path
        JSON file that gets ``head``.
    head : mapping
        Everything that determines the results: values or digests, as JSON holds them.
    parts : iterable of Path
        Files of finished parts, complete or not.
    resume : bool
        Keep the parts, where the head lies there already; it is returned whether they are kept.
    names : mapping of str to str, optional
        The entries of ``head`` to compare, as messages name them; by default all, by their keys.

    Raises
    ------
    ConfigError
        The parts there were made from something else.
    OutputError
        An older part cannot be removed, or the head cannot be written.
    """
    known = resume and head_file.is_file()
    if known:
        found, names = read_json(head_file), names or {key: key for key in head}
        changed = [name for key, name in names.items() if found.get(key) != head[key]]
        if changed:
            expected = f"the same {', '.join(names.values())} to resume"
            hint = "settings changed since; start without --resume, or in another folder"
            got = f"another {', another '.join(changed)}"
            raise fail(ConfigError, str(head_file), expected, got, hint)
    else:
        try:
            for part in parts:
                part.unlink(missing_ok=True)
        except OSError as error:
            expected = "older results that can be removed"
            raise fail(OutputError, str(head_file), expected, error.strerror or error) from error
    write_json(head_file, head)
    return known


class FinishedParts:
    """A hidden folder beside a result, with one checksummed file per finished part.

    As a context manager it removes the folder when the block succeeds, or fails by an input error
    or because nothing can be written; it stays when the block is interrupted or a worker dies.

    ``digest`` gives that of everything that determines the parts, and is called once, when it is
    first needed. With ``keep`` parts that are there already are taken over, else removed; their
    folder and files are called after ``name``.
    """

    def __init__(
        self, result: Path, digest: Callable[[], str], *, keep: bool = False, name: str = "part"
    ) -> None:
        self._result, self._digest, self._name = result, digest, name
        self.keep = keep

    @cached_property
    def folder(self) -> Path:
        """Folder of the parts; emptied on first use, unless they are kept."""
        folder = self._result.with_name(f".{self._result.name}.{self._name}s-{self._digest()[:16]}")
        if not self.keep:
            shutil.rmtree(folder, ignore_errors=True)
        return folder

    def __enter__(self) -> FinishedParts:
        ensure_writable_folder(self._result.parent)
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        # Without a use there is no folder, and the digest may take long.
        used = "folder" in vars(self)
        if used and (kind is None or issubclass(kind, InputError | OutputError)):
            shutil.rmtree(self.folder, ignore_errors=True)

    def load(self, number: int) -> bytes | None:
        """Return a finished part, or None when there is none or its file is damaged."""
        try:
            data = read_input(self._file(number), _LARGEST_PART_BYTES, "a part")
        except InputError:
            return None
        checksum, part = data[:_CHECKSUM_BYTES], data[_CHECKSUM_BYTES:]
        return part if _checksum(part) == checksum else None

    def save(self, number: int, part: bytes) -> None:
        """Write a finished part; raise OutputError where that fails."""
        file = self._file(number)
        temporary = file.with_name(f"{file.name}.{os.getpid()}")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            temporary.write_bytes(_checksum(part) + part)
            temporary.replace(file)
        except OSError as error:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
            got = error.strerror or error
            raise fail(OutputError, str(file), "a place that can be written", got) from error

    def _file(self, number: int) -> Path:
        return self.folder / f"{self._name}-{number}.arrow"


def _checksum(part: bytes) -> bytes:
    return zlib.crc32(part).to_bytes(_CHECKSUM_BYTES, "big")
