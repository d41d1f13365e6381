"""Rows of parts by window: those within it and no others, from few row groups."""

from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from small_world import CRS

from mapfilter.database.parquet import WindowReader, count_rows, read_columns, write_columns
from mapfilter.database.tiles import z_order
from mapfilter.errors import StoreError
from mapfilter.lattice import Lattice


def grouped(path, rows_in_a_group=4, cols=6):
    """Write places along a curve of four rows and six columns, a few to a row group."""
    row, col = (axis.ravel() for axis in np.mgrid[:4, :cols])
    order = z_order(row, col).argsort()
    row, col = row[order].astype(np.int32), col[order].astype(np.int32)
    table = pa.table({
        "point": row.astype(np.int64) * cols + col, "row": row, "col": col,
        "level_dbm": (-50.0 - row - col / 10).astype(np.float32),
    })  # fmt: skip
    write_columns(table, path, rows_in_a_group)
    return table


PLACES = Lattice(CRS, 1000.0, 2000.0, 5.0, 4, 6)


@pytest.mark.parametrize(
    "window", [(0, 0, 4, 6), (0, 0, 1, 1), (1, 2, 2, 3), (3, 5, 1, 1), (2, 0, 2, 2), (0, 4, 4, 2)]
)
def test_windows_hold_their_rows_and_no_others(tmp_path, window):
    path = tmp_path / "part.parquet"
    table = grouped(path)
    assert pq.read_metadata(path).num_row_groups == 6
    reader = WindowReader([path], ["row", "col", "level_dbm"], PLACES)
    top, left, rows, cols = window
    # The neighbour first, so that its groups are held.
    reader.read((max(top - 1, 0), left, rows, cols))
    found = reader.read(window)
    row, col = table["row"].to_numpy(), table["col"].to_numpy()
    inside = (row >= top) & (row < top + rows) & (col >= left) & (col < left + cols)
    assert inside.sum() == rows * cols == found["row"].size
    for name in ("row", "col", "level_dbm"):
        np.testing.assert_array_equal(np.sort(found[name]), np.sort(table[name].to_numpy()[inside]))


def test_only_groups_that_meet_a_window_are_decoded(tmp_path, monkeypatch):
    path = tmp_path / "part.parquet"
    grouped(path)
    reader = WindowReader([path], ["row", "col", "level_dbm"], PLACES)
    decoded = []
    group = WindowReader._group
    monkeypatch.setattr(WindowReader, "_group", lambda self, n: decoded.append(n) or group(self, n))
    # Groups are squares of two by two pixels: three side by side, twice.
    reader.read((0, 0, 2, 2))
    assert decoded == [0]
    reader.read((0, 0, 2, 3))
    assert decoded == [0, 1]
    reader.read((0, 0, 3, 3))
    assert sorted(decoded) == [0, 1, 2, 3]
    assert reader.read((4, 0, 2, 2)) == {}
    assert reader.read((0, 6, 2, 2)) == {}


def test_parts_of_another_lattice_are_refused(tmp_path):
    path = tmp_path / "part.parquet"
    grouped(path)
    for lattice in (replace(PLACES, cols=7), replace(PLACES, rows=3)):
        with pytest.raises(StoreError, match="points on the database's lattice"):
            WindowReader([path], ["row", "col", "level_dbm"], lattice).read((0, 0, 4, 6))


def test_columns_that_are_missing_and_rows_that_are_counted(tmp_path):
    path = tmp_path / "part.parquet"
    table = grouped(path)
    assert count_rows(path) == 24
    assert read_columns(path, ["col", "row"]).equals(table.select(["col", "row"]))
    with pytest.raises(StoreError, match="column other"):
        read_columns(path, ["row", "other"])
    with pytest.raises(StoreError, match="no such file"):
        count_rows(tmp_path / "none.parquet")


def test_a_footer_that_is_cut_off_or_of_other_columns(tmp_path):
    path = tmp_path / "part.parquet"
    table = grouped(path)
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(StoreError, match="a whole Parquet file"):
        WindowReader([path], ["row", "col", "level_dbm"], PLACES)
    write_columns(table.drop_columns(["col"]), path)
    with pytest.raises(StoreError, match="a whole Parquet file"):
        WindowReader([path], ["row", "level_dbm"], PLACES)
    with pytest.raises(StoreError, match="no such file"):
        WindowReader([tmp_path / "none.parquet"], ["row"], PLACES)
