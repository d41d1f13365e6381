"""Parquet parts whose pages carry checksums, so that a changed byte is an error when it is read."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray
from pyproj import CRS

from mapfilter._arrow import ParquetReader, open_parquet
from mapfilter._inputs import json_value
from mapfilter._types import Floats, Ints32
from mapfilter.database.checked import HeldPart, Part
from mapfilter.errors import MapfilterError, StoreError, fail
from mapfilter.geodesy import same_crs
from mapfilter.lattice import Lattice

# A damaged footer or page header can ask for absurd amounts of memory or name other columns.
DAMAGE = (OSError, pa.ArrowException, ValueError, KeyError, MemoryError)
_WKB_POINT = np.dtype([("order", "u1"), ("kind", "<u4"), ("east", "<f8"), ("north", "<f8")])
Window = tuple[int, int, int, int]
"""Row, column, rows and columns on a lattice."""

Source = Part | HeldPart | Path
"""A part with its checksums, one whose bytes were compared already, or a file without."""

_EVERYWHERE = (-(2**62), 2**62)
_NEAR_M = 1e-3


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


@contextmanager
def opened(source: Source, footer: pq.FileMetaData | None = None) -> Iterator[ParquetReader]:
    """Open a part; errors within the block become StoreErrors, as of a damaged part.

    ``footer`` is that of the part, where it was read before.
    """
    try:
        with ExitStack() as stack:
            of_path = isinstance(source, Path)
            given = source if of_path else stack.enter_context(source.open())
            file = stack.enter_context(open_parquet(given, footer))
            if isinstance(source, Part) and file.footer.num_rows != source.rows:
                got = file.footer.num_rows
                raise fail(StoreError, str(source), f"{source.rows} rows", got, "parts mixed up")
            yield file
    except DAMAGE as error:
        raise damaged(source, error) from error


def read_columns(source: Source, columns: Sequence[str], optional: Sequence[str] = ()) -> pa.Table:
    """Read some columns of a part and compare their checksums; StoreError where damaged.

    Columns that are ``optional`` may be absent.
    """
    with opened(source) as file:
        there = file.columns
        columns = [name for name in columns if name in there or name not in optional]
        table = file.read(columns)
        table.validate(full=True)
    if missing := [name for name in columns if name not in table.column_names]:
        raise fail(StoreError, str(source), f"column {missing[0]}", "none", "damaged")
    return table.select(list(columns))


def check_places(source: Source, table: pa.Table, lattice: Lattice) -> None:
    """Check that the points of a part lie on the lattice, and are numbered by it."""
    point, row, col = (table[name].to_numpy() for name in ("point", "row", "col"))
    numbers = row.astype(np.int64) * lattice.cols + col
    if not (np.array_equal(point, numbers) and lattice.contains(row, col).all()):
        expected = "points on the database's lattice"
        raise fail(StoreError, str(source), expected, "others", "parts mixed up")


def check_extent(source: Source, lattice: Lattice) -> None:
    """Check that CRS and extent of the points' geometry are those of their rows and columns."""
    with opened(source) as file:
        found = file.footer
        names = {found.schema.column(i).name: i for i in range(found.num_columns)}
        groups = [found.row_group(i) for i in range(found.num_row_groups)]
        ends = np.array([[_ends(one, names[axis]) for axis in ("row", "col")] for one in groups])
        column = json_value(found.metadata[b"geo"])["columns"]["geometry"]
        crs, box = CRS.from_json_dict(column["crs"]).to_wkt(), np.array(column["bbox"], float)
        (top, left), (bottom, right) = ends[:, :, 0].min(axis=0), ends[:, :, 1].max(axis=0)
    if not same_crs(crs, lattice.crs):
        hint = "manifest and parts of different databases"
        raise fail(StoreError, f"{source}, CRS", lattice.crs, CRS.from_wkt(crs).name, hint)
    west_m, north_m = lattice.east_north(top, left)
    east_m, south_m = lattice.east_north(bottom, right)
    wanted = np.array([west_m, south_m, east_m, north_m], dtype=float)
    if box.shape != (4,) or not np.abs(box - wanted).max() <= _NEAR_M:
        expected, got = (", ".join(f"{value:.1f}" for value in one) for one in (wanted, box))
        hint = "the lattice was edited, or manifest and parts are of different databases"
        raise fail(StoreError, f"{source}, extent", expected, got, hint)


def count_rows(source: Source) -> int:
    """Return the number of rows in a part's footer; raise StoreError where it is damaged."""
    with opened(source) as file:
        return int(file.footer.num_rows)


def damaged(source: Source, error: Exception) -> MapfilterError:
    """Return the error for a part that cannot be read."""
    if isinstance(error, FileNotFoundError):
        return fail(StoreError, str(source), "a part of the database", "no such file")
    reason = (str(error).splitlines() or [type(error).__name__])[0]
    return fail(StoreError, str(source), "a whole Parquet file", reason, "damaged")


def point_geometry(east_m: Floats, north_m: Floats) -> pa.Array:
    """Return points as well-known binary, shape (N,).

    Examples
    --------
    >>> import shapely
    >>> shapely.from_wkb(point_geometry(np.array([3.0]), np.array([4.0]))[0].as_py())
    <POINT (3 4)>
    """
    points = np.empty(east_m.size, dtype=_WKB_POINT)
    points["order"], points["kind"] = 1, 1
    points["east"], points["north"] = east_m, north_m
    offsets = np.arange(east_m.size + 1, dtype=np.int32) * np.int32(_WKB_POINT.itemsize)
    buffers = [None, pa.py_buffer(offsets.tobytes()), pa.py_buffer(points.tobytes())]
    return pa.Array.from_buffers(pa.binary(), east_m.size, buffers)


def point_coordinates(geometry: pa.Array) -> Floats:
    """Return east and north of points that :func:`point_geometry` made, shape (N, 2).

    Examples
    --------
    >>> point_coordinates(point_geometry(np.array([3.0, 5.0]), np.array([4.0, 6.0]))).tolist()
    [[3.0, 4.0], [5.0, 6.0]]
    """
    # Offsets into the bytes show where a slice of a longer array begins.
    _, offsets, data = geometry.buffers()
    first = np.frombuffer(offsets, np.int32)[geometry.offset] if len(geometry) else 0
    points = np.frombuffer(data, _WKB_POINT, len(geometry), int(first))
    return np.column_stack((points["east"], points["north"]))


def geo_metadata(crs: str, bounds_m: Sequence[float] | None) -> bytes:
    """Return the value of the GeoParquet 1.1 key ``geo`` for a ``geometry`` column of points."""
    column: dict[str, Any] = {
        "encoding": "WKB",
        "geometry_types": ["Point"],
        "crs": CRS.from_user_input(crs).to_json_dict(),
    }
    if bounds_m is not None:
        column["bbox"] = list(bounds_m)
    geo = {"version": "1.1.0", "primary_column": "geometry", "columns": {"geometry": column}}
    return json.dumps(geo).encode()


def dictionary(codes: NDArray[Any], names: tuple[str, ...]) -> pa.Array:
    """Return codes into names as a dictionary-encoded column of text."""
    return pa.DictionaryArray.from_arrays(
        pa.array(np.asarray(codes, dtype=np.int32)), pa.array(names, type=pa.string())
    )


def text_codes(column: Any) -> tuple[Ints32, tuple[str, ...]]:
    """Return codes and names of a column of text."""
    joined = column.dictionary_encode().unify_dictionaries().combine_chunks()
    if hasattr(joined, "chunks"):
        joined = joined.chunk(0)
    names = tuple(str(name) for name in joined.dictionary.to_pylist())
    return joined.indices.to_numpy().astype(np.int32), names


class WindowReader:
    """Reads some columns, among them ``row`` and ``col``, of a database's parts by windows.

    Points lie along a space-filling curve, so a row group covers a small area. Groups of the window
    that was read last are kept, as its neighbour needs most of them again.
    """

    def __init__(self, parts: Sequence[Source], columns: Sequence[str], lattice: Lattice) -> None:
        self._columns, self._lattice = list(columns), lattice
        self._groups: list[tuple[Source, pq.FileMetaData, int]] = []
        self._held: dict[int, pa.Table] = {}
        boxes: list[tuple[int, int, int, int]] = []
        for part in parts:
            with opened(part) as file:
                footer = file.footer
                names = {footer.schema.column(i).name: i for i in range(footer.num_columns)}
                for group in range(footer.num_row_groups):
                    ends = [_ends(footer.row_group(group), names[axis]) for axis in ("row", "col")]
                    self._groups.append((part, footer, group))
                    boxes.append((*ends[0], *ends[1]))
        self._boxes = np.array(boxes, dtype=np.int64).reshape(len(boxes), 4)

    def read(self, window: Window) -> dict[str, Any]:
        """Return the rows within a window, column by column: text as Arrow, others as NumPy."""
        row, col, rows, cols = window
        low_row, high_row, low_col, high_col = self._boxes.T
        meets = (low_row < row + rows) & (high_row >= row)
        meets &= (low_col < col + cols) & (high_col >= col)
        wanted = np.flatnonzero(meets).tolist()
        self._held = {i: self._held.get(i) or self._group(i) for i in wanted}
        tables = []
        for table in self._held.values():
            at = table["row"].to_numpy(), table["col"].to_numpy()
            inside = (at[0] >= row) & (at[0] < row + rows)
            inside &= (at[1] >= col) & (at[1] < col + cols)
            tables.append(table.filter(pa.array(inside)))
        if not tables:
            return {}
        found = pa.concat_tables(tables)
        columns = ((name, found[name]) for name in self._columns)
        return {name: c if pa.types.is_dictionary(c.type) else c.to_numpy() for name, c in columns}

    def _group(self, number: int) -> pa.Table:
        part, footer, group = self._groups[number]
        with opened(part, footer) as file:
            table = file.read_group(group, ["point", *self._columns])
            table.validate(full=True)
        check_places(part, table, self._lattice)
        return table


def part_ranges(footer: pq.FileMetaData, columns: Sequence[str]) -> list[tuple[float, float]]:
    """Return the least and the largest value of each column of a part, by its footer alone."""
    names = {footer.schema.column(i).name: i for i in range(footer.num_columns)}
    groups = [footer.row_group(i) for i in range(footer.num_row_groups)]
    found: list[tuple[float, float]] = []
    for column in columns:
        ends = [_ends(one, names[column]) for one in groups]
        found.append((min(low for low, _ in ends), max(high for _, high in ends)))
    return found


def _ends(group: pq.RowGroupMetaData, column: int) -> tuple[int, int]:
    known = group.column(column).statistics
    return (known.min, known.max) if known is not None and known.has_min_max else _EVERYWHERE
