"""Files of a log's tables, CSV or Parquet, as tables whose values are not checked yet."""

from __future__ import annotations

import codecs
import csv
import io
import warnings
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.csv as arrow_csv

from mapfilter._arrow import arrow_bytes, open_parquet
from mapfilter._cut_ends import without_cut_row, without_zero_end
from mapfilter._inputs import first_foreign_byte, open_input, read_input, wide_encoding
from mapfilter._separator_line import without_separator_line
from mapfilter._types import Ints
from mapfilter.errors import InputError, fail, listed
from mapfilter.tracks.schema import SCHEMA

SEPARATORS = (",", ";", "\t")
_LARGEST_BYTES = 2 << 30
_BLOCK_BYTES = 1 << 22
_MOST_COLUMNS = 1000
_DECIMAL_COMMA = r"^\s*([-+]?\d*),(\d+(?:[eE][-+]?\d+)?)\s*$"
"""A number that has a comma for a point."""


class ReadTable(NamedTuple):
    """A table of a log as it was read.

    ``rows`` are texts where they come from CSV. ``row_numbers`` are for messages: the line of a CSV
    file, in which the header is line 1 as in editors; the row of a Parquet file, counted from 1.
    """

    rows: pd.DataFrame
    row_numbers: Ints
    notes: tuple[str, ...] = ()


def read_table(table: str, path: Path) -> ReadTable:
    """Read one of :data:`mapfilter.tracks.schema.TABLES` from CSV or Parquet.

    CSV is UTF-8, else Windows-1252 with a note, with commas, semicolons or tabs; decimal commas
    where commas separate nothing.

    Raises
    ------
    InputError
        The file is empty, damaged or no such table.
    """
    try:
        if path.suffix == ".csv":
            return _read_csv(table, path)
        with open_input(path) as stream, open_parquet(stream) as source:
            rows = as_frame(source.read())
        return ReadTable(rows, np.arange(1, len(rows) + 1))
    except pd.errors.EmptyDataError as error:
        raise fail(InputError, str(path), "a header line", "an empty file", "cut off") from error
    except (pd.errors.ParserError, pd.errors.ParserWarning) as error:
        got = str(error).splitlines()[0]
        hint = "decimal commas between commas (separate fields by semicolons), or cut off"
        raise fail(InputError, str(path), "a readable table", got, hint) from error
    except (pa.ArrowException, UnicodeDecodeError, csv.Error, OSError, ValueError) as error:
        got = (str(error).splitlines() or [type(error).__name__])[0]
        raise fail(InputError, str(path), "a readable table", got, "cut off") from error


def as_frame(table: pa.Table) -> pd.DataFrame:
    """Return the columns of a Parquet file.

    What pandas wrote about its index and its types is left out: the columns hold everything, and
    damaged, it is a fault in no column.
    """
    # Texts that are no UTF-8 are read like others, and fail only when they are used.
    table.validate(full=True)
    plain = table.replace_schema_metadata(None)
    for i, column in enumerate(plain.schema):
        if pa.types.is_decimal(column.type):
            plain = plain.set_column(i, column.name, plain[i].cast(pa.float64()))
    settings: dict[str, Any] = {"split_blocks": True, "self_destruct": True}
    mapper = {pa.int64(): pd.Int64Dtype()}.get
    return plain.to_pandas(types_mapper=mapper, ignore_metadata=True, **settings)


def _read_csv(table: str, path: Path) -> ReadTable:
    data = read_input(path, _LARGEST_BYTES, "a table").removeprefix(codecs.BOM_UTF8)
    _check_encoding(path, data.rstrip(b"\0"))
    data, zeros = without_zero_end(data)
    if (foreign := first_foreign_byte(data)) >= 0:
        data = data.decode("cp1252").encode()
    if zeros and not data:
        raise fail(InputError, str(path), "a header line", "zero bytes only", "cut off")
    data = without_separator_line(data)
    begin = len(data) - len(data.lstrip(b"\r\n \t"))
    end = data.find(b"\n", begin)
    if begin == len(data):
        raise pd.errors.EmptyDataError
    begin = max(data.rfind(b"\n", 0, begin), data.rfind(b"\r", 0, begin)) + 1
    blank_lines = len(data[:begin].splitlines())
    first = data[begin : end if end >= 0 else len(data)]
    header = first.splitlines()[0].decode() if first else ""
    separator = max(SEPARATORS, key=header.count)
    names = [name.strip() for name in next(csv.reader([header], delimiter=separator), [])]
    if len(names) > _MOST_COLUMNS:
        expected = f"at most {_MOST_COLUMNS} columns"
        raise fail(InputError, f"{path}, header", expected, len(names), "no table of a log")
    if twice := sorted(name for name, times in Counter(names).items() if name and times > 1):
        raise fail(InputError, f"{path}, header", "each column once", f"{listed(twice)} more often")
    data, cut = without_cut_row(data, separator, begin + len(header.encode()))
    rows = _plain_rows(data, begin, names, separator)
    if rows is None:
        rows = _any_rows(data, blank_lines, names, separator)
    lines = np.arange(len(rows)) + blank_lines + 2
    blank = np.ones(len(rows), dtype=np.bool_)
    for name in rows.columns:
        if not blank.any():
            break
        blank &= (rows[name] == "").to_numpy()
    if blank.any():
        rows, lines = rows[~blank].reset_index(drop=True), lines[~blank]
    if separator != ",":
        # Also of columns that are no part of a log, but read: degrees and their accuracy.
        texts = {column.name for column in SCHEMA[table] if column.kind == "text"}
        for name in rows.columns[~rows.columns.isin(texts)]:
            rows[name] = rows[name].str.replace(_DECIMAL_COMMA, r"\1.\2", regex=True)
    notes = [f"{path}: {zeros}"] if zeros else []
    notes += [f"{path}: no UTF-8 (byte {foreign}); read as Windows-1252"] if foreign >= 0 else []
    if cut:
        ends = data.count(b"\n") or data.count(b"\r")
        notes.append(f"{path} row {ends + 1}: {cut}, left out")
    return ReadTable(rows, lines, tuple(notes))


def _check_encoding(path: Path, data: bytes) -> None:
    """Refuse UTF-16 and UTF-32, with a mark or without one, and bytes of no text."""
    if wide := wide_encoding(data):
        hint = "saved as Unicode; save as UTF-8"
        raise fail(InputError, str(path), "text in UTF-8", f"{wide} text", hint)
    head = data[:512]
    zeros = head.count(b"\0")
    if zeros and max(head[::2].count(b"\0"), head[1::2].count(b"\0")) >= 0.4 * len(head):
        got = "UTF-16 or UTF-32 text without a byte order mark"
        raise fail(InputError, str(path), "text in UTF-8", got, "saved as Unicode; save as UTF-8")
    if (at := data.find(b"\0")) >= 0:
        got = f"a zero byte (byte {at + 1})"
        raise fail(InputError, str(path), "text in UTF-8", got, "no text file, or cut off")


def _plain_rows(data: bytes, begin: int, names: list[str], separator: str) -> pd.DataFrame | None:
    """Read rows that have as many fields as the header, without blank lines; else None."""
    if b'"' in data or b"\n\n" in data or not all(names):
        return None
    if b"\r" in data and (b"\n\r" in data or data.count(b"\r") != data.count(b"\r\n")):
        return None
    try:
        found = arrow_csv.read_csv(
            pa.BufferReader(arrow_bytes(memoryview(data)[begin:])),
            arrow_csv.ReadOptions(
                column_names=names, skip_rows=1, block_size=_BLOCK_BYTES, use_threads=False
            ),
            arrow_csv.ParseOptions(delimiter=separator, quote_char=False, ignore_empty_lines=False),
            arrow_csv.ConvertOptions(
                column_types=dict.fromkeys(names, pa.string()), strings_can_be_null=False
            ),
        )
    except pa.ArrowException:
        return None
    return found.to_pandas(types_mapper={pa.string(): pd.StringDtype(na_value=np.nan)}.get)


def _any_rows(data: bytes, blank_lines: int, names: list[str], separator: str) -> pd.DataFrame:
    with warnings.catch_warnings():
        # pandas only warns when rows have more fields than the header, and drops the rest.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        rows = pd.read_csv(
            io.BytesIO(data),
            dtype=str,
            sep=separator,
            header=blank_lines,
            keep_default_na=False,
            index_col=False,
            encoding="utf-8",
            skip_blank_lines=False,
        )
    if len(names) == len(rows.columns):
        given = map(str, rows.columns)
        rows.columns = [name or other for name, other in zip(names, given, strict=True)]
    return rows
