"""Data frames of pandas or Polars in Parquet, as CSV."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from mapfilter._arrow import open_parquet
from mapfilter._inputs import open_input
from mapfilter._words import number_of
from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.contained.tables import (
    A_TABLE,
    MOST_LETTERS,
    MOST_VALUES,
    SMALLER,
    as_table,
)
from mapfilter.tracks.readers.texts.text import Text

_ROWS_AT_ONCE = 256
_OWN, _HEADS = b"mapfilter", ("log.json", "manifest.json")
"""What marks an estimate, and what lies beside the tables of a log and of a database."""
_INDEX = "__index_level_0__"


def frame_of(path: Path) -> Text:
    """Return the columns of a Parquet file that hold one value in each row as a text of CSV.

    Times without a zone stay so; an index of times, which pandas writes without a name, is "time".

    Raises
    ------
    InputError
        It cannot be read, or is too large.
    """
    try:
        with open_input(path) as stream, open_parquet(stream) as file:
            rows, names = file.footer.num_rows, file.columns
            _check_foreign(path, file.footer.metadata or {})
            if rows * len(names) > MOST_VALUES:
                got = f"{rows} rows of {len(names)} columns"
                raise fail(InputError, str(path), A_TABLE, got, SMALLER)
            table = file.read()
        # Texts that are no UTF-8 would fail when they are used.
        table.validate(full=True)
    except (pa.ArrowException, OSError, ValueError) as error:
        raise fail(InputError, str(path), "a Parquet file that can be read", error) from error
    columns, left = [], []
    for name, column in zip(names, table.columns, strict=True):
        if _is_of_values(_plain_type(column.type)):
            is_index = name == _INDEX and pa.types.is_timestamp(column.type)
            columns.append(("time" if is_index and "time" not in names else name, column))
        else:
            left.append(name)
    notes = (f"{number_of(len(left), 'column')} without single values left out",) if left else ()
    if sum(_letters(column) for _, column in columns) > MOST_LETTERS:
        raise fail(InputError, str(path), A_TABLE, "a larger one", SMALLER)
    header = [name for name, _ in columns]
    rows = _rows([column for _, column in columns], table.num_rows)
    return as_table(Text(path, b"", notes), header, rows, "Parquet")


def _rows(columns: Sequence[pa.ChunkedArray], count: int) -> Iterator[tuple[str, ...]]:
    """Yield rows of texts; few are held at once, as equal texts may be one in the file."""
    for begin in range(0, count, _ROWS_AT_ONCE):
        parts = (column.slice(begin, _ROWS_AT_ONCE) for column in columns)
        yield from zip(*map(_texts, parts), strict=True)


def _texts(column: pa.ChunkedArray) -> list[str]:
    plain = column.cast(_plain_type(column.type))
    return list(pc.fill_null(plain.cast(pa.string()), "").to_pylist())


def _letters(column: pa.ChunkedArray) -> int:
    """Return the size of all texts that a column has by number; a file holds each of them once."""
    if not (pa.types.is_dictionary(column.type) and _is_text(column.type.value_type)):
        return 0
    sizes = (
        pc.sum(pc.take(pc.binary_length(chunk.dictionary), chunk.indices)).as_py() or 0
        for chunk in column.chunks
    )
    return sum(sizes)


def _is_text(kind: pa.DataType) -> bool:
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))


def _plain_type(kind: pa.DataType) -> pa.DataType:
    return kind.value_type if pa.types.is_dictionary(kind) else kind


def _check_foreign(path: Path, metadata: Mapping[bytes, bytes]) -> None:
    """Refuse what mapfilter wrote: a table of a log, a part of a database, or an estimate."""
    if _OWN in metadata:
        hint = "what a filter estimated; it is no recording, nor a ground truth"
        raise fail(InputError, str(path), "a recording", "an estimate of mapfilter", hint)
    if any((path.parent / name).is_file() for name in _HEADS):
        hint = "a part of a log or a database; name the folder that it lies in"
        raise fail(InputError, str(path), "a recording", "a table of mapfilter", hint)


def _is_of_values(kind: pa.DataType) -> bool:
    return any(
        is_kind(kind)
        for is_kind in (
            *(pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean, pa.types.is_string),
            *(pa.types.is_large_string, pa.types.is_timestamp, pa.types.is_date, pa.types.is_time),
            pa.types.is_decimal,
        )
    )
