"""Resume long computations: finished parts stay on disk, with what determines them.

A part is taken over only where inputs and code are the same. Either a head of digests lies beside
the parts and is compared (:func:`start_or_resume`: other inputs are refused), or the digest is part
of the folder's name (:class:`FinishedParts`: parts of other inputs are not found).
"""

from __future__ import annotations

import contextlib
import glob
import hashlib
import secrets
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from pathlib import Path

from mapfilter._alone import writing_alone
from mapfilter._code import code_digest
from mapfilter._inputs import read_input
from mapfilter._io import ensure_writable_folder
from mapfilter._json_files import read_json, write_json
from mapfilter.errors import ConfigError, InputError, OutputError, Stopped, fail

_CODE = "code_sha256"
_CODE_NAME = "version of mapfilter and libraries"
_CHECKSUM_BYTES = 32
_KEY_DIGITS = 16
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
        check_same(head_file, head, names)
    else:
        try:
            for part in parts:
                part.unlink(missing_ok=True)
        except OSError as error:
            expected = "older results that can be removed"
            raise fail(OutputError, str(head_file), expected, error.strerror or error) from error
    write_json(head_file, with_code(head))
    return known


def with_code(head: Mapping[str, object]) -> dict[str, object]:
    """Return the head of a computation with the checksum of the code that does it."""
    return {**head, _CODE: code_digest()}


def check_same(
    head_file: Path, head: Mapping[str, object], names: Mapping[str, str] | None = None
) -> dict[str, object]:
    """Return the head that lies in a file; ConfigError where the parts are of something else.

    Parameters and errors are those of :func:`start_or_resume`.
    """
    found, head = read_json(head_file), with_code(head)
    names = {**(names or {key: key for key in head}), _CODE: _CODE_NAME}
    changed = [name for key, name in names.items() if found.get(key) != head[key]]
    if changed:
        expected = f"the same {', '.join(names.values())} to resume"
        of_code = changed == [_CODE_NAME]
        cause = "mapfilter or a library was updated" if of_code else "settings changed"
        hint = f"{cause} since; start without --resume, or in another folder"
        raise fail(
            ConfigError, str(head_file), expected, f"another {', another '.join(changed)}", hint
        )
    return found


@contextlib.contextmanager
def kept_when_stopped(what: str) -> Iterator[None]:
    """Note on an interrupt that passes through what is kept, and how to go on."""
    try:
        yield
    except (KeyboardInterrupt, Stopped) as error:
        error.add_note(f"finished {what} are kept: go on with --resume")
        raise


def load_part(file: Path) -> bytes | None:
    """Return what :func:`save_part` wrote; None where there is none, or it is damaged."""
    try:
        data = read_input(file, _LARGEST_PART_BYTES, "a part")
    except InputError:
        return None
    checksum, part = data[:_CHECKSUM_BYTES], data[_CHECKSUM_BYTES:]
    return part if _checksum(file.name, part) == checksum else None


def save_part(file: Path, part: bytes) -> None:
    """Write a finished part with a checksum of it and its name; OutputError where that fails."""
    # Hosts that share the folder may have processes of the same number.
    temporary = file.with_name(f"{file.name}.{secrets.token_hex(8)}")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_bytes(_checksum(file.name, part) + part)
        temporary.replace(file)
    except OSError as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        got = error.strerror or error
        raise fail(OutputError, str(file), "a place that can be written", got) from error


class FinishedParts:
    """A hidden folder beside a result, with one checksummed file per finished part.

    As a context manager it removes the folder when the block succeeds, or fails by an input error
    or because nothing can be written; it stays when the block is interrupted or a worker dies.
    When the block succeeds, folders of the same result that were left by other inputs or other code
    are removed, too.

    No other process writes the same result meanwhile: its parts would be taken for left ones.

    ``digest`` gives that of everything that determines the parts, and is called once, when it is
    first needed. With ``keep`` parts that are there already are taken over, else removed; their
    folder and files are called after ``name``.
    """

    def __init__(
        self, result: Path, digest: Callable[[], str], *, keep: bool = False, name: str = "part"
    ) -> None:
        self._result, self._digest, self._name = result, digest, name
        self.keep = keep
        self._alone = contextlib.ExitStack()

    @cached_property
    def folder(self) -> Path:
        """Folder of the parts; emptied on first use, unless they are kept."""
        digest = hashlib.sha256(f"{self._digest()} {code_digest()}".encode()).hexdigest()
        folder = self._result.with_name(
            f".{self._result.name}.{self._name}s-{digest[:_KEY_DIGITS]}"
        )
        if not self.keep:
            shutil.rmtree(folder, ignore_errors=True)
        return folder

    def __enter__(self) -> FinishedParts:
        ensure_writable_folder(self._result.parent)
        self._alone.enter_context(writing_alone(self._result))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, *_: object
    ) -> None:
        with self._alone:
            self._leave(kind, error)

    def _leave(self, kind: type[BaseException] | None, error: BaseException | None) -> None:
        # Without a use there is no folder, and the digest may take long.
        used = "folder" in vars(self)
        if used and (kind is None or issubclass(kind, InputError | OutputError)):
            shutil.rmtree(self.folder, ignore_errors=True)
        if used and kind is None:
            pattern = f".{glob.escape(self._result.name)}.{self._name}s-{'[0-9a-f]' * _KEY_DIGITS}"
            for other in self._result.parent.glob(pattern):
                shutil.rmtree(other, ignore_errors=True)
        if used and isinstance(error, KeyboardInterrupt | Stopped) and self.folder.is_dir():
            error.add_note(f"finished {self._name}s are kept: go on with --resume")

    def load(self, number: int) -> bytes | None:
        """Return a finished part, or None when there is none or its file is damaged."""
        return load_part(self._file(number))

    def save(self, number: int, part: bytes) -> None:
        """Write a finished part; raise OutputError where that fails."""
        save_part(self._file(number), part)

    def _file(self, number: int) -> Path:
        return self.folder / f"{self._name}-{number}.arrow"


def _checksum(name: str, part: bytes) -> bytes:
    return hashlib.sha256(name.encode() + b"\0" + part).digest()
