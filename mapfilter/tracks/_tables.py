"""The tables of a log as files: Parquet, or CSV as spreadsheets of any country write it."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from mapfilter._types import Ints
from mapfilter.errors import InputError, fail
from mapfilter.tracks.schema import SCHEMA

_SEPARATORS = (",", ";", "\t")
_LONGEST_ROW_BYTES = 1 << 16
_DECIMAL_COMMA = r"^\s*([-+]?\d*),(\d+(?:[eE][-+]?\d+)?)\s*$"


@dataclass(frozen=True, eq=False, slots=True)
class ReadTable:
    """A table of a log as it was read.

    Parameters
    ----------
    rows : pandas.DataFrame
        Values; texts where they come from CSV.
    row_numbers : (N,) integer array
        What messages call each row: the line of a CSV file, in which the header is line 1 as in
        editors and spreadsheets; the row of a Parquet file, counted from 1.
    notes : tuple of str
        What was mended.
    """

    rows: pd.DataFrame
    row_numbers: Ints
    notes: tuple[str, ...] = ()


def read_table(table: str, path: Path) -> ReadTable:
    """Read a table of a log.

    CSV is UTF-8 with commas, semicolons or tabs; decimal commas where commas separate nothing.

    Parameters
    ----------
    table : str
        Out of :data:`mapfilter.tracks.schema.TABLES`.
    path : Path

    Raises
    ------
    InputError
        The file is empty, damaged or no such table.
    """
    try:
        if path.suffix == ".csv":
            return _read_csv(table, path)
        rows = pq.read_table(path).to_pandas(types_mapper={pa.int64(): pd.Int64Dtype()}.get)
        return ReadTable(rows, np.arange(1, len(rows) + 1))
    except pd.errors.EmptyDataError as error:
        raise fail(InputError, str(path), "a header line", "an empty file", "cut off") from error
    except (pd.errors.ParserError, pd.errors.ParserWarning) as error:
        got = str(error).splitlines()[0]
        hint = "decimal commas between commas (separate fields by semicolons), or cut off"
        raise fail(InputError, str(path), "a readable table", got, hint) from error
    except (pa.ArrowException, UnicodeDecodeError, OSError) as error:
        got = str(error).splitlines()[0]
        raise fail(InputError, str(path), "a readable table", got, "cut off") from error


def _read_csv(table: str, path: Path) -> ReadTable:
    header, blank_lines = _header(path)
    separator = max(_SEPARATORS, key=header.count)
    with warnings.catch_warnings():
        # pandas only warns when rows have more fields than the header, and drops the rest.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        rows = pd.read_csv(
            path,
            dtype=str,
            sep=separator,
            header=blank_lines,
            keep_default_na=False,
            index_col=False,
            encoding="utf-8-sig",
            skip_blank_lines=False,
        )
    rows.columns = [str(name).strip() for name in rows.columns]
    lines = np.arange(len(rows)) + blank_lines + 2
    blank = (rows == "").all(axis=1).to_numpy()
    rows, lines = rows[~blank].reset_index(drop=True), lines[~blank]
    if separator != ",":
        numbers = [column.name for column in SCHEMA[table] if column.kind != "text"]
        for name in rows.columns.intersection(numbers):
            rows[name] = rows[name].str.replace(_DECIMAL_COMMA, r"\1.\2", regex=True)
    return ReadTable(rows, lines, _cut_off(path, separator, header))


def _header(path: Path) -> tuple[str, int]:
    """Return the first line that holds something, and how many blank ones are before it."""
    with path.open(encoding="utf-8-sig") as stream:
        for number, line in enumerate(stream):
            if line.strip():
                return line, number
    return "", 0


def _cut_off(path: Path, separator: str, header: str) -> tuple[str, ...]:
    """Return a note where a file ends without a line's end before the last row has all fields."""
    with path.open("rb") as stream:
        stream.seek(max(0, path.stat().st_size - _LONGEST_ROW_BYTES))
        last = stream.read().splitlines(keepends=True)[-1].decode(errors="replace")
    if last.endswith(("\n", "\r")) or last.count(separator) >= header.count(separator):
        return ()
    return (f"{path}: ends within a row, as if cut off",)
