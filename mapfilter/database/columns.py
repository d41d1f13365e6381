"""Parquet parts whose pages carry checksums, so that a changed byte is an error when it is read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from mapfilter.errors import MapfilterError, StoreError, fail

# A damaged footer or page header can ask for absurd amounts of memory or name other columns.
DAMAGE = (OSError, pa.ArrowException, ValueError, KeyError, MemoryError)


def write_columns(
    table: pa.Table, where: Path | pa.NativeFile, rows_in_a_group: int | None = None
) -> None:
    """Write a table as Parquet with page checksums."""
    with open_writer(table.schema, where) as writer:
        writer.write_table(table, rows_in_a_group)


def open_writer(schema: pa.Schema, where: Path | pa.NativeFile) -> pq.ParquetWriter:
    """Return a writer that adds row groups as :func:`write_columns` writes them.

    Whole numbers, which differ little from row to row along the Z-order curve, are kept as
    differences; what else repeats itself, as numbers into a dictionary.
    """
    whole = [field.name for field in schema if pa.types.is_integer(field.type)]
    unique = {*whole, "geometry"}
    return pq.ParquetWriter(
        where,
        schema,
        compression="zstd",
        write_page_checksum=True,
        use_dictionary=[name for name in schema.names if name not in unique],
        column_encoding=dict.fromkeys(whole, "DELTA_BINARY_PACKED"),
    )


def read_columns(path: Path, columns: Sequence[str]) -> pa.Table:
    """Read some columns of a part; the checksums of what is read are compared.

    Raises
    ------
    StoreError
        The part is missing or damaged, or has no such column.
    """
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as source:
            table = source.read(list(columns))
        table.validate(full=True)
    except DAMAGE as error:
        raise damaged(path, error) from error
    if missing := [name for name in columns if name not in table.column_names]:
        raise fail(StoreError, str(path), f"column {missing[0]}", "none", "damaged")
    return table.select(list(columns))


def count_rows(path: Path) -> int:
    """Return the number of rows that a part's footer tells.

    Raises
    ------
    StoreError
        The part is missing or damaged.
    """
    try:
        return int(pq.read_metadata(path).num_rows)
    except DAMAGE as error:
        raise damaged(path, error) from error


def damaged(path: Path, error: Exception) -> MapfilterError:
    """Return what to tell of a part that cannot be read."""
    if isinstance(error, FileNotFoundError):
        return fail(StoreError, str(path), "a part of the database", "no such file")
    said = (str(error).splitlines() or [type(error).__name__])[0]
    return fail(StoreError, str(path), "a whole Parquet file", said, "damaged")
