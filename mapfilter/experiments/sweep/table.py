"""Table of a sweep: one tidy row for each run, in Parquet."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, fields
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from mapfilter._arrow import open_parquet
from mapfilter._inputs import open_input
from mapfilter._io import atomic_file, sha256_file, sha256_of
from mapfilter._json_files import read_json, write_json
from mapfilter._resume import load_part, save_part
from mapfilter.errors import StoreError, fail, listed
from mapfilter.evaluation.accuracy import Accuracy
from mapfilter.evaluation.claims import ClaimedRadii
from mapfilter.evaluation.success_cells import COORDINATES, SuccessCell
from mapfilter.experiments.sweep.plan import Run

_TYPES = {
    "str": pa.string(),
    "float": pa.float64(),
    "int": pa.int32(),
    "int | None": pa.int32(),
    "bool": pa.bool_(),
    "bool | None": pa.bool_(),
}


def _columns(of: type) -> list[tuple[str, pa.DataType]]:
    """Return columns for the fields of a dataclass, by their annotations."""
    return [(field.name, _TYPES[str(field.type)]) for field in fields(of) if field.type in _TYPES]


SCHEMA = pa.schema(
    [
        *_columns(SuccessCell)[: len(COORDINATES)],
        ("route", pa.int32()),
        ("draw", pa.int32()),
        *_columns(Accuracy),
        *_columns(ClaimedRadii),
        ("final_status", pa.string()),
    ]
)
"""Columns: coordinates of the run in the grid, then its results; null where undefined.

The coordinates are those of :class:`mapfilter.evaluation.success_cells.SuccessCell`, the results
those of :class:`mapfilter.evaluation.accuracy.Accuracy` and of
:class:`mapfilter.evaluation.claims.ClaimedRadii`. Varied options are further columns, named by
their dotted keys, before ``route``.
"""

_GROUP_ROWS = 100_000
_SHA256 = "runs_sha256"
HEAD = "sweep.json"
_VARIED_AT = SCHEMA.get_field_index("route")


def schema_of(varied: Iterable[str]) -> pa.Schema:
    """Return the columns of a sweep that varies some options."""
    schema = SCHEMA
    for place, key in enumerate(varied):
        schema = schema.insert(_VARIED_AT + place, pa.field(key, pa.float64()))
    return schema


def row(
    run: Run,
    score: Accuracy,
    radii: ClaimedRadii,
    final_status: str,
    varied: Iterable[tuple[str, float]] = (),
) -> tuple[Any, ...]:
    """Return a run's row, in the order of :func:`schema_of`."""
    reading = run.reading
    return (
        run.database,
        run.radio.name,
        run.radio.prediction_error_db,
        run.report_period_s,
        run.imu_period_s,
        reading.choice.name,
        reading.name,
        reading.update_length_m,
        *run.noises,
        *(float(value) for _, value in varied),
        run.route,
        run.draw,
        *astuple(score),
        *astuple(radii),
        final_status,
    )


def to_table(rows: Sequence[tuple[Any, ...]], schema: pa.Schema = SCHEMA) -> pa.Table:
    """Return rows as a table; NaN becomes null."""
    columns = zip(*rows, strict=True)
    arrays = [
        pa.array(column, type=field.type, from_pandas=True)
        for column, field in zip(columns, schema, strict=True)
    ]
    return pa.Table.from_arrays(arrays, schema=schema)


def write_part(table: pa.Table, path: Path) -> None:
    """Write the rows of a batch with a checksum; the file is there whole or not at all."""
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd")
    save_part(path, sink.getvalue().to_pybytes())


def read_part(path: Path, rows: int, schema: pa.Schema = SCHEMA) -> pa.Table | None:
    """Return a batch's rows, or None where they do not lie there, whole and unchanged."""
    data = load_part(path)
    if data is None:
        return None
    with open_parquet(pa.BufferReader(data)) as source:
        table = source.read()
    return table if table.num_rows == rows and table.schema.equals(schema) else None


def join_parts(tables: Iterable[pa.Table], path: Path, schema: pa.Schema = SCHEMA) -> None:
    """Put the rows of batches together, in their order, holding only some of them in memory."""
    waiting: list[pa.Table] = []
    with (
        atomic_file(path) as temporary,
        pq.ParquetWriter(temporary, schema, compression="zstd") as writer,
    ):
        for table in tables:
            waiting.append(table)
            if sum(map(len, waiting)) >= _GROUP_ROWS:
                writer.write_table(pa.concat_tables(waiting).combine_chunks())
                waiting = []
        if waiting:
            writer.write_table(pa.concat_tables(waiting).combine_chunks())


def note_whole(path: Path, head: Mapping[str, object]) -> None:
    """Write the head of a sweep beside its table, with the table's checksum."""
    write_json(path.with_name(HEAD), {**head, _SHA256: sha256_file(path)})


def is_whole(path: Path) -> bool:
    """Return whether the table of a sweep is the one of the head beside it, unchanged."""
    head = path.with_name(HEAD)
    if not (path.is_file() and head.is_file()):
        return False
    return read_json(head).get(_SHA256) == sha256_file(path)


def read_runs(path: Path) -> pd.DataFrame:
    """Read the table of a sweep; with the head of the sweep beside it, its checksum is compared.

    Raises
    ------
    StoreError
        It is missing, changed, cut off or no table of a sweep.
    """
    head = path.with_name(HEAD)
    try:
        with open_input(path, StoreError) as stream:
            if head.is_file() and read_json(head).get(_SHA256) != sha256_of(stream):
                hint = "changed after it was written, or a sweep that "
                hint += "is not finished: go on with --resume"
                raise fail(StoreError, str(path), f"the table of {HEAD}", "another", hint)
            with open_parquet(stream) as source:
                table = source.read()
            table.validate(full=True)
    except (OSError, ValueError, pa.ArrowException) as error:
        raise fail(StoreError, str(path), "the table of a sweep", error, "cut off") from error
    lacking = set(SCHEMA.names) - set(table.column_names)
    if lacking:
        expected, got = "all columns of a sweep", f"none of {listed(sorted(lacking))}"
        hint = "of an earlier version of mapfilter: sweep again" if head.is_file() else ""
        raise fail(StoreError, str(path), expected, got, hint)
    # What pandas noted about columns may be damaged, and is needed for none of them.
    return table.replace_schema_metadata(None).to_pandas()
