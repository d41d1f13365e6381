"""Parts of a database, whose bytes are compared with their checksums before anything reads them.

A Parquet reader that is given damaged bytes may end the process. Therefore it gets none: the
manifest holds the SHA-256 of each part, and of large ones of each block, so that a window of a
large part costs no more than the blocks that it touches. Bytes of a database that replaced the one
that was opened have other checksums, too: a reader sees the database that it opened, or an error.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import pyarrow as pa

from mapfilter._inputs import open_input
from mapfilter._io import sha256_file
from mapfilter.errors import MapfilterError, StoreError, fail

BLOCK_BYTES = 1 << 18
MANIFEST = "manifest.json"


@dataclass(frozen=True, slots=True)
class Part:
    """A part as the manifest lists it.

    Parameters
    ----------
    folder : Path
        Of the database.
    path : str
        Within the folder.
    rows, size : int
        Rows, and bytes.
    sha256 : str
        Of the file.
    blocks : tuple of str
        SHA-256 of each 256 KiB in turn; empty for a file of one block.
    generation : str
        SHA-256 of the manifest.
    """

    folder: Path
    path: str
    rows: int
    size: int
    sha256: str
    blocks: tuple[str, ...]
    generation: str

    @classmethod
    def of(cls, folder: Path, entry: Mapping[str, Any], generation: str) -> Part:
        """Return the part of an entry of the manifest."""
        blocks = tuple(entry.get("blocks", ()))
        size, digest = int(entry["bytes"]), str(entry["sha256"])
        return cls(folder, str(entry["path"]), int(entry["rows"]), size, digest, blocks, generation)

    def __str__(self) -> str:
        return str(self.file)

    @property
    def file(self) -> Path:
        """Where the part is."""
        return self.folder / self.path

    @contextmanager
    def open(self) -> Iterator[pa.NativeFile]:
        """Open the part for Arrow; any read may raise a StoreError.

        Raises
        ------
        StoreError
            The part is missing or damaged, or the database was replaced since it was opened.
        """
        try:
            stream = open_input(self.file, StoreError)
        except StoreError as error:
            got = error.faults[0].got if self.file.exists() else "no such file"
            raise self.unlike("a part of the database", got) from error
        with stream:
            size = stream.seek(0, io.SEEK_END)
            if size != self.size:
                raise self.unlike(f"{self.size} bytes", f"{size} bytes")
            checked = _CheckedFile(stream, self)
            if self.blocks:
                with pa.PythonFile(checked, mode="r") as source:
                    yield source
            else:
                with pa.BufferReader(checked.read_block(0)) as source:
                    yield source

    def unlike(self, expected: str, got: object) -> MapfilterError:
        """Return the error for a part that is not the one that the manifest lists."""
        if generation_of(self.folder) != self.generation:
            expected, got = "the database that was opened", "another one, or none"
            hint = "it was replaced while in use; open it again"
            return fail(StoreError, str(self.folder), expected, got, hint)
        return fail(StoreError, str(self.file), expected, got, "changed after it was written")


def part_named(name: str, folder: Path, manifest: Mapping[str, Any], generation: str) -> Part:
    """Return a part of a database that belongs to no cell."""
    (entry,) = (part for part in manifest["parts"] if part["path"] == name)
    return Part.of(folder, entry, generation)


@dataclass(frozen=True, slots=True)
class HeldPart:
    """The bytes of a part that were compared with their checksum, and where they come from."""

    path: Path
    data: bytes

    def __str__(self) -> str:
        return str(self.path)

    @contextmanager
    def open(self) -> Iterator[pa.NativeFile]:
        """Open the bytes for Arrow."""
        with pa.BufferReader(self.data) as source:
            yield source


class _CheckedFile(io.RawIOBase):
    """Gives out bytes of blocks whose checksums are right."""

    def __init__(self, stream: BinaryIO, part: Part) -> None:
        self._stream, self._part = stream, part
        self._at = 0
        self._held: tuple[int | None, bytes] = None, b""

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._at

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        base = {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._part.size}[whence]
        self._at = base + offset
        return self._at

    def read(self, size: int | None = None) -> bytes:
        left = max(self._part.size - self._at, 0)
        end = self._at + (left if size is None or size < 0 else min(size, left))
        found = []
        while self._at < end:
            number, start = divmod(self._at, BLOCK_BYTES)
            block = self.read_block(number)[start : start + end - self._at]
            found.append(block)
            self._at += len(block)
        return b"".join(found)

    def read_block(self, number: int) -> bytes:
        """Return a block; the last one is kept, as its neighbours in the file share it."""
        part = self._part
        if self._held[0] != number:
            size = BLOCK_BYTES if part.blocks else part.size
            try:
                self._stream.seek(number * size)
                block = self._stream.read(size)
            except OSError as error:
                raise part.unlike("a readable file", error.strerror or error) from error
            expected = part.blocks[number] if part.blocks else part.sha256
            found = hashlib.sha256(block).hexdigest()
            if found != expected:
                raise part.unlike(f"SHA-256 {expected[:12]}…", f"{found[:12]}…")
            self._held = number, block
        return self._held[1]


def checksums(path: Path) -> tuple[str, tuple[str, ...]]:
    """Return the SHA-256 of a file, and of its blocks where it has several."""
    whole, blocks = hashlib.sha256(), []
    with open_input(path, StoreError) as stream:
        while block := stream.read(BLOCK_BYTES):
            whole.update(block)
            blocks.append(hashlib.sha256(block).hexdigest())
    return whole.hexdigest(), tuple(blocks) if len(blocks) > 1 else ()


def generation_of(folder: Path) -> str:
    """Return the SHA-256 of a database's manifest; an empty text where there is none."""
    try:
        return sha256_file(folder / MANIFEST)
    except StoreError:
        return ""
