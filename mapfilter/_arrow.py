"""Reading with Arrow, so that no thread of it holds an object of Python afterwards.

Arrow's threads may still hold the last reference to what they read when the result is there. They
give it back when they are next given time; where that is bytes or a file of Python, and Python is
ending by then, the process aborts after all its work is done. So Parquet is read without threads,
and readers that always use them get a copy in Arrow's own memory.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, BinaryIO

import pyarrow as pa
import pyarrow.parquet as pq


class ParquetReader:
    """An open Parquet file, read by the thread that asks and by no other.

    Parameters
    ----------
    file : pyarrow.parquet.ParquetFile
        The file, opened without reading ahead.
    """

    def __init__(self, file: pq.ParquetFile) -> None:
        self._file = file

    @property
    def footer(self) -> pq.FileMetaData:
        """What the file's end says about its columns and row groups."""
        return self._file.metadata

    @property
    def columns(self) -> list[str]:
        """The names of its columns."""
        return list(self._file.schema_arrow.names)

    def read(self, columns: Sequence[str] | None = None) -> pa.Table:
        """Return all rows, of these columns or of all."""
        return self._file.read(None if columns is None else list(columns), use_threads=False)

    def read_group(self, group: int, columns: Sequence[str]) -> pa.Table:
        """Return some columns of one row group."""
        return self._file.read_row_group(group, list(columns), use_threads=False)


@contextmanager
def open_parquet(source: Any, footer: pq.FileMetaData | None = None) -> Iterator[ParquetReader]:
    """Open Parquet, and compare the checksums of its pages where it has any.

    ``source`` is a path, a file of Python or one of Arrow; ``footer`` its footer, where it was read
    before. Raises what Arrow raises.
    """
    # Reading ahead is left to a thread, which would hold the source.
    with pq.ParquetFile(
        source, metadata=footer, pre_buffer=False, page_checksum_verification=True
    ) as file:
        yield ParquetReader(file)


def arrow_bytes(data: bytes | memoryview) -> pa.Buffer:
    """Return a copy of bytes in memory that Arrow may give back whenever it likes.

    For readers of Arrow that always use threads, as that of CSV.
    """
    held = pa.allocate_buffer(len(data))
    if len(data):
        memoryview(held).cast("B")[:] = data
    return held


def arrow_file(stream: BinaryIO) -> pa.Buffer:
    """Return the bytes of a file as :func:`arrow_bytes` does, read into that memory at once.

    Raises
    ------
    OSError
        The file became shorter meanwhile.
    """
    held = pa.allocate_buffer(stream.seek(0, os.SEEK_END))
    stream.seek(0)
    if stream.readinto(memoryview(held)) != held.size:  # type: ignore[attr-defined]
        raise OSError("the file became shorter while it was read")
    return held
