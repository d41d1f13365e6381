"""Data frames of pandas or Polars in Parquet, as CSV."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from mapfilter._arrow import open_parquet
from mapfilter._inputs import open_input
from mapfilter._words import number_of
from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.contained.tables import as_table
from mapfilter.tracks.readers.texts.text import Text

_MOST_VALUES = 50_000_000
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
            if rows * len(names) > _MOST_VALUES:
                got = f"{rows} rows of {len(names)} columns"
                raise fail(InputError, str(path), "a table of at most 5e7 values", got)
            table = file.read()
        # Texts that are no UTF-8 would fail when they are used.
        table.validate(full=True)
    except (pa.ArrowException, OSError, ValueError) as error:
        raise fail(InputError, str(path), "a Parquet file that can be read", error) from error
    columns, left = {}, []
    for name in names:
        column = table.column(name)
        if pa.types.is_dictionary(column.type):
            column = column.cast(column.type.value_type)
        if _is_of_values(column.type):
            is_index = name == _INDEX and pa.types.is_timestamp(column.type)
            columns["time" if is_index else name] = pc.fill_null(column.cast(pa.string()), "")
        else:
            left.append(name)
    notes = (f"{number_of(len(left), 'column')} without single values left out",) if left else ()
    lists = [column.to_pylist() for column in columns.values()]
    made = (list(row) for row in zip(*lists, strict=True))
    return as_table(Text(path, b"", notes), list(columns), made, "Parquet")


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
