"""Databases whose files are damaged, changed, mixed up or moved aside."""

import json

import pyarrow.parquet
import pytest
from small_world import IDS, change_manifest

from mapfilter.database.export import export_geopackage
from mapfilter.database.manifest import levels_folders
from mapfilter.database.store import open_database
from mapfilter.errors import StoreError


def change_byte(part, place):
    content = bytearray(part.read_bytes())
    content[place] ^= 1
    part.write_bytes(bytes(content))


def test_a_changed_byte_is_found_by_the_full_check(copy):
    part = copy / levels_folders([IDS[1]])[IDS[1]] / "part-0.parquet"
    change_byte(part, part.stat().st_size // 2)
    for verify in ("sizes", "full"):
        with pytest.raises(StoreError, match="SHA-256"):
            open_database(copy, verify=verify)


def end_of_column(part, name):
    """Place of a byte within the last page of a column."""
    chunks = pyarrow.parquet.read_metadata(part).row_group(0)
    (chunk,) = (
        chunks.column(i)
        for i in range(chunks.num_columns)
        if chunks.column(i).path_in_schema == name
    )
    start = chunk.dictionary_page_offset or chunk.data_page_offset
    return start + chunk.total_compressed_size - 5


@pytest.mark.parametrize(
    "columns",
    [("point", "point"), ("level_dbm", "best_level_dbm"), ("below_best_db", "distance_to_way_m")],
)
def test_a_changed_byte_of_the_data_is_found_when_it_is_read(copy, columns):
    level = copy / levels_folders([IDS[1]])[IDS[1]] / "part-0.parquet"
    database = open_database(copy)
    for part, name in zip((level, copy / "points.parquet"), columns, strict=True):
        change_byte(part, end_of_column(part, name))
    for read in (database.points, database.field, lambda: database.cell_points(IDS[1])):
        with pytest.raises(StoreError, match=r"parquet: expected SHA-256 .*changed"):
            read()
    with pytest.raises(StoreError, match=r"points\.parquet"):
        export_geopackage(database, copy.parent / "db.gpkg")
    assert not (copy.parent / "db.gpkg").exists()
    assert database.cell_points(IDS[0])[0].size > 0


def test_a_part_that_vanishes_after_opening(copy):
    database = open_database(copy)
    (copy / "points.parquet").unlink()
    with pytest.raises(StoreError, match=r"points\.parquet.*no such file"):
        database.points()


def test_a_damaged_footer_is_found_when_opened(copy):
    change_byte(copy / "points.parquet", -6)
    with pytest.raises(StoreError, match=r"points\.parquet: expected SHA-256"):
        open_database(copy)


def test_parts_of_another_lattice_are_refused(copy):
    manifest = json.loads((copy / "manifest.json").read_text())
    manifest["lattice"]["cols"] += 1
    change_manifest(copy, lattice=manifest["lattice"])
    database = open_database(copy)
    for read in (database.points, lambda: database.cell_points(IDS[0])):
        with pytest.raises(StoreError, match="on the database's lattice"):
            read()


def test_a_database_moved_aside_by_a_write_cut_short_is_named(copy):
    aside = copy.parent / ".db.partial-1-x" / "old"
    aside.parent.mkdir()
    copy.rename(aside)
    with pytest.raises(StoreError) as caught:
        open_database(copy)
    assert str(aside) in str(caught.value)
    open_database(aside)
