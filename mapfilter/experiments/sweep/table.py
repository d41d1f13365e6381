"""Table of a sweep: one tidy row for each run, in Parquet."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import astuple
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from mapfilter._io import atomic_file
from mapfilter.errors import StoreError, fail
from mapfilter.evaluation.accuracy import Accuracy
from mapfilter.experiments.sweep.plan import Run

_TEXT, _FLOAT, _INT, _BOOL = pa.string(), pa.float64(), pa.int32(), pa.bool_()

SCHEMA = pa.schema(
    [
        ("database", _TEXT),
        ("radio", _TEXT),
        ("prediction_error_db", _FLOAT),
        ("report_period_s", _FLOAT),
        ("imu_period_s", _FLOAT),
        ("filter", _TEXT),
        ("reading", _TEXT),
        ("update_length_m", _FLOAT),
        ("sigma_trans_m", _FLOAT),
        ("sigma_orient_deg", _FLOAT),
        ("bias_sd_deg", _FLOAT),
        ("drift_deg_per_sqrt_s", _FLOAT),
        ("scale", _FLOAT),
        ("route", _INT),
        ("draw", _INT),
        ("switched", _BOOL),
        ("success", _BOOL),
        ("switch_time_s", _FLOAT),
        ("switch_distance_m", _FLOAT),
        ("error_at_switch_m", _FLOAT),
        ("error_mean_m", _FLOAT),
        ("error_67_m", _FLOAT),
        ("error_95_m", _FLOAT),
        ("scored_epochs", _INT),
        ("final_status", _TEXT),
    ]
)
"""Columns: coordinates of the run in the grid, then its results; null where undefined.

Varied options are further columns, named by their dotted keys, before ``route``.
"""

_GROUP_ROWS = 100_000
_VARIED_AT = SCHEMA.get_field_index("route")


def schema_of(varied: Iterable[str]) -> pa.Schema:
    """Return the columns of a sweep that varies some options."""
    schema = SCHEMA
    for place, key in enumerate(varied):
        schema = schema.insert(_VARIED_AT + place, pa.field(key, _FLOAT))
    return schema


def row(
    run: Run, score: Accuracy, final_status: str, varied: Iterable[tuple[str, float]] = ()
) -> tuple[Any, ...]:
    """Return a run's row, in the order of :func:`schema_of`."""
    noise, reading = run.noise, run.reading
    return (
        run.database,
        run.radio.name,
        run.radio.prediction_error_db,
        run.report_period_s,
        run.imu_period_s,
        reading.choice.name,
        reading.name,
        reading.update_length_m,
        noise.sigma_trans_m,
        noise.sigma_orient_deg,
        noise.bias_sd_deg,
        noise.drift_deg_per_sqrt_s,
        noise.scale,
        *(float(value) for _, value in varied),
        run.route,
        run.draw,
        *astuple(score),
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
    """Write the rows of a batch; the file is there whole or not at all."""
    with atomic_file(path) as temporary:
        pq.write_table(table, temporary, compression="zstd")


def is_part(path: Path, rows: int, schema: pa.Schema = SCHEMA) -> bool:
    """Return whether a batch's rows lie there, whole."""
    if not path.is_file():
        return False
    try:
        found = pq.read_metadata(path)
    except (OSError, pa.ArrowInvalid):
        return False
    return bool(found.num_rows == rows and found.schema.to_arrow_schema().equals(schema))


def join_parts(parts: Iterable[Path], path: Path, schema: pa.Schema = SCHEMA) -> None:
    """Put the parts together, in their order, holding only some of them in memory."""
    waiting: list[pa.Table] = []
    with (
        atomic_file(path) as temporary,
        pq.ParquetWriter(temporary, schema, compression="zstd") as writer,
    ):
        for part in parts:
            waiting.append(pq.read_table(part, schema=schema))
            if sum(map(len, waiting)) >= _GROUP_ROWS:
                writer.write_table(pa.concat_tables(waiting).combine_chunks())
                waiting = []
        if waiting:
            writer.write_table(pa.concat_tables(waiting).combine_chunks())


def read_runs(path: Path) -> pd.DataFrame:
    """Read the table of a sweep.

    Raises
    ------
    StoreError
        It is missing, cut off or no table of a sweep.
    """
    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowInvalid) as error:
        raise fail(StoreError, str(path), "the table of a sweep", error, "cut off") from error
    lacking = set(SCHEMA.names) - set(table.column_names)
    if lacking:
        raise fail(StoreError, str(path), "all columns of a sweep", f"none of {sorted(lacking)}")
    return table.to_pandas()
