"""Parts on disk: how columns are kept, geometry, and what a part has to agree with."""

import json
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import shapely
from small_world import CRS

from mapfilter.database.checked import HeldPart, Part
from mapfilter.database.manifest import describe_part
from mapfilter.database.parquet import (
    WindowReader,
    check_extent,
    check_places,
    dictionary,
    geo_metadata,
    open_writer,
    opened,
    part_ranges,
    point_coordinates,
    point_geometry,
    read_columns,
    write_columns,
)
from mapfilter.errors import StoreError
from mapfilter.lattice import Lattice

LATTICE = Lattice(CRS, 1000.0, 2000.0, 5.0, 4, 6)
ROW = np.array([0, 0, 1, 2, 3, 3], dtype=np.int32)
COL = np.array([1, 5, 2, 2, 0, 4], dtype=np.int32)


def table(row=ROW, col=COL):
    east, north = LATTICE.east_north(row, col)
    return pa.table({
        "point": row.astype(np.int64) * LATTICE.cols + col, "row": row, "col": col,
        "way_class": dictionary(np.arange(row.size) % 2, ("path", "road")),
        "level_dbm": (-50.0 - col).astype(np.float32), "on_square": row > 1,
        "geometry": point_geometry(east, north),
    })  # fmt: skip


def points_file(path, bounds_m=None, crs=CRS, row=ROW, col=COL, rows_in_a_group=2):
    """Write points as a database does: GeoParquet with the bounds of the pixels' centres."""
    given = table(row, col)
    places = point_coordinates(given["geometry"].chunk(0))
    bounds_m = [*places.min(axis=0), *places.max(axis=0)] if bounds_m is None else bounds_m
    with open_writer(given.schema, path) as writer:
        writer.write_table(given, rows_in_a_group)
        writer.add_key_value_metadata({"geo": geo_metadata(crs, bounds_m).decode()})
    return path


def test_whole_numbers_are_kept_as_differences_and_what_repeats_itself_in_a_dictionary(tmp_path):
    write_columns(table(), tmp_path / "a.parquet")
    group = pq.read_metadata(tmp_path / "a.parquet").row_group(0)
    columns = {group.column(n).path_in_schema: group.column(n) for n in range(group.num_columns)}
    for name in ("point", "row", "col"):
        assert "DELTA_BINARY_PACKED" in columns[name].encodings
    for name in ("way_class", "level_dbm"):
        assert columns[name].has_dictionary_page
    assert not columns["geometry"].has_dictionary_page
    assert {column.compression for column in columns.values()} == {"ZSTD"}


@pytest.mark.parametrize("rows_in_a_group", [1, 4, 5, None])
def test_rows_of_a_group(tmp_path, rows_in_a_group):
    write_columns(table(), tmp_path / "a.parquet", rows_in_a_group)
    footer = pq.read_metadata(tmp_path / "a.parquet")
    assert footer.num_row_groups == -(-6 // (rows_in_a_group or 6))
    assert read_columns(tmp_path / "a.parquet", ["row", "point"]).equals(
        table().select(["row", "point"])
    )


def test_any_changed_byte_of_a_page_is_told(tmp_path):
    """Checksums of the pages tell, without those of the manifest."""
    path = tmp_path / "a.parquet"
    write_columns(table(), path)
    whole, column = path.read_bytes(), pq.read_metadata(path).row_group(0).column(4)
    last = column.dictionary_page_offset + column.total_compressed_size - 1
    path.write_bytes(whole[:last] + bytes([whole[last] ^ 1]) + whole[last + 1 :])
    with pytest.raises(StoreError, match="a whole Parquet file"):
        read_columns(path, ["level_dbm"])
    assert read_columns(path, ["row"]).num_rows == 6


def test_optional_columns_may_be_absent_and_no_others(tmp_path):
    path = tmp_path / "a.parquet"
    write_columns(table(), path)
    found = read_columns(path, ["col", "power", "row"], optional=["power", "row"])
    assert found.column_names == ["col", "row"]
    with pytest.raises(StoreError, match="column power, found none"):
        read_columns(path, ["col", "power"], optional=["row"])


def test_a_part_has_the_rows_that_the_manifest_lists(tmp_path):
    write_columns(table(), tmp_path / "points.parquet")
    entry = describe_part(tmp_path, tmp_path / "points.parquet", 6)
    part = Part.of(tmp_path, entry, "")
    assert read_columns(part, ["row"]).num_rows == 6
    with pytest.raises(StoreError, match="7 rows, found 6"), opened(replace(part, rows=7)):
        pass
    held = HeldPart(part.file, part.file.read_bytes())
    assert read_columns(held, ["col"]).equals(table().select(["col"]))


@pytest.mark.parametrize(
    "change",
    [{}, {"row": 4}, {"col": 6}, {"row": -1}, {"point": 3}],
)
def test_points_are_numbered_by_the_lattice(tmp_path, change):
    given = table()
    for name, value in change.items():
        values = given[name].to_numpy().copy()
        values[2] = value
        given = given.set_column(given.column_names.index(name), name, pa.array(values))
    if "point" not in change:
        number = given["row"].to_numpy().astype(np.int64) * 6 + given["col"].to_numpy()
        given = given.set_column(0, "point", pa.array(number))
    if not change:
        check_places(tmp_path / "a", given, LATTICE)
        return
    with pytest.raises(StoreError, match="points on the database's lattice"):
        check_places(tmp_path / "a", given, LATTICE)


BOUNDS = np.array([1002.5, 1982.5, 1027.5, 1997.5])


def test_the_extent_of_points_is_that_of_their_rows_and_columns(tmp_path):
    check_extent(points_file(tmp_path / "a.parquet"), LATTICE)
    column = json.loads(pq.read_metadata(tmp_path / "a.parquet").metadata[b"geo"])["columns"]
    assert column["geometry"]["bbox"] == BOUNDS.tolist()
    for number in range(4):
        for off_m, good in ((8e-4, True), (-8e-4, True), (1.2e-3, False), (-1.2e-3, False)):
            moved = BOUNDS.copy()
            moved[number] += off_m
            file = points_file(tmp_path / "b.parquet", moved.tolist())
            if good:
                check_extent(file, LATTICE)
                continue
            with pytest.raises(StoreError) as caught:
                check_extent(file, LATTICE)
            (fault,) = caught.value.faults
            assert fault.where == f"{file}, extent"
            assert fault.expected == "1002.5, 1982.5, 1027.5, 1997.5"


@pytest.mark.parametrize(
    "changes", [{"west_m": 11_000.0}, {"north_m": 2005.0}, {"resolution_m": 10.0}]
)
def test_the_extent_is_that_of_the_manifests_lattice(tmp_path, changes):
    file = points_file(tmp_path / "a.parquet")
    with pytest.raises(StoreError, match="the lattice was edited"):
        check_extent(file, replace(LATTICE, **changes))


def test_an_extent_of_another_crs_or_of_too_few_numbers(tmp_path):
    with pytest.raises(StoreError, match="EPSG:32629, found WGS 84 / UTM zone 30N"):
        check_extent(points_file(tmp_path / "a.parquet", crs="EPSG:32630"), LATTICE)
    with pytest.raises(StoreError, match="extent"):
        check_extent(points_file(tmp_path / "b.parquet", BOUNDS[:3].tolist()), LATTICE)
    with pytest.raises(StoreError, match="extent"):
        check_extent(points_file(tmp_path / "c.parquet", [1002.5, 1982.5, np.nan, 1997.5]), LATTICE)


def test_geometry_there_and_back():
    east, north = np.array([3.5, -4.0, 1e6]), np.array([0.25, 7.0, 5e6])
    found = point_geometry(east, north)
    shapes = shapely.from_wkb(found.to_pylist())
    assert [(p.x, p.y) for p in shapes] == [*zip(east, north, strict=True)]
    np.testing.assert_array_equal(point_coordinates(found), np.column_stack([east, north]))
    # Of a slice its own ones, not those that the buffer begins with.
    np.testing.assert_array_equal(point_coordinates(found[1:]), [[-4.0, 7.0], [1e6, 5e6]])
    np.testing.assert_array_equal(point_coordinates(found[1:2]), [[-4.0, 7.0]])
    assert point_coordinates(found[:0]).shape == (0, 2)
    assert len(point_geometry(np.empty(0), np.empty(0))) == 0


def test_the_key_of_geoparquet():
    geo = json.loads(geo_metadata(CRS, (1.0, 2.0, 3.0, 4.0)))
    assert (geo["version"], geo["primary_column"]) == ("1.1.0", "geometry")
    column = geo["columns"]["geometry"]
    assert (column["encoding"], column["geometry_types"]) == ("WKB", ["Point"])
    assert column["crs"]["id"] == {"authority": "EPSG", "code": 32629}
    assert column["bbox"] == [1.0, 2.0, 3.0, 4.0]
    assert "bbox" not in json.loads(geo_metadata(CRS, None))["columns"]["geometry"]


def test_ranges_are_those_of_all_groups(tmp_path):
    footer = pq.read_metadata(points_file(tmp_path / "a.parquet"))
    assert footer.num_row_groups == 3
    found = part_ranges(footer, ("col", "row", "level_dbm"))
    assert found == [(0, 5), (0, 3), (-55.0, -50.0)]


def test_a_part_without_statistics_may_lie_anywhere(tmp_path):
    """It is read for every window, and its rows are chosen all the same."""
    path = tmp_path / "a.parquet"
    pq.write_table(table(), path, write_statistics=False)
    (low, high), *_ = part_ranges(pq.read_metadata(path), ("row",))
    assert low < -(2**60)
    assert high > 2**60
    found = WindowReader([path], ["row", "col"], LATTICE).read((1, 2, 2, 1))
    assert (found["row"].tolist(), found["col"].tolist()) == ([1, 2], [2, 2])


def test_windows_return_text_as_arrow_and_numbers_as_numpy(tmp_path):
    path = points_file(tmp_path / "a.parquet")
    reader = WindowReader([path, path], ["row", "way_class", "col"], LATTICE)
    found = reader.read((0, 0, 4, 6))
    assert list(found) == ["row", "way_class", "col"]
    assert found["way_class"].to_pylist() == ["path", "road"] * 6
    np.testing.assert_array_equal(found["row"], [*ROW, *ROW])
    # What a window has in its groups but not within it is empty, not missing.
    assert reader.read((0, 3, 1, 1))["row"].size == 0


def test_no_byte_of_a_written_page_changes_unnoticed():
    """A part that is damaged on disk is refused or read as it was; its pages have checksums."""
    values = np.random.default_rng(3).random(24).astype(np.float32)
    given = pa.table({"level_dbm": values, "row": np.arange(24, dtype=np.int32)})
    sink = pa.BufferOutputStream()
    write_columns(given, sink)
    whole = sink.getvalue().to_pybytes()
    group = pq.read_metadata(pa.BufferReader(whole)).row_group(0)
    refused = 0
    for column in (group.column(0), group.column(1)):
        for at in range(column.data_page_offset, column.data_page_offset + 80):
            damaged = bytearray(whole)
            damaged[at] ^= 0x10
            try:
                read = pq.read_table(
                    pa.BufferReader(bytes(damaged)), page_checksum_verification=True
                )
            except (OSError, pa.ArrowException, ValueError, MemoryError):
                refused += 1
                continue
            assert read.equals(given)
    assert refused > 80
