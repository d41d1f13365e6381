"""What an export may replace: nothing but an older export that nobody changed."""

import sqlite3
from contextlib import closing

import pytest

from mapfilter.database.exported import WRITTEN, check_export_replaceable
from mapfilter.errors import OutputError


@pytest.fixture
def geopackage(tmp_path):
    """Return a function that writes the table of contents of a GeoPackage, and its path."""
    path = tmp_path / "layers.gpkg"

    def write(*changed):
        with closing(sqlite3.connect(path)) as connection, connection:
            connection.execute("CREATE TABLE gpkg_contents (table_name TEXT, last_change TEXT)")
            rows = [(f"layer {n}", time) for n, time in enumerate(changed)]
            connection.executemany("INSERT INTO gpkg_contents VALUES (?, ?)", rows)
        return path

    return write


def test_an_older_export_is_replaced(geopackage, tmp_path):
    check_export_replaceable(tmp_path / "none.gpkg")
    check_export_replaceable(geopackage(WRITTEN, WRITTEN))


@pytest.mark.parametrize(
    "changed", [(), (WRITTEN, "2026-11-29T10:00:00.000Z"), ("2026-11-29T10:00:00.000Z", WRITTEN)]
)
def test_edited_layers_and_a_file_without_layers_are_kept(geopackage, changed):
    with pytest.raises(OutputError, match="or an older export"):
        check_export_replaceable(geopackage(*changed))


def test_a_folder_and_files_of_other_programs_are_kept(tmp_path):
    (tmp_path / "folder.gpkg").mkdir()
    (tmp_path / "notes.gpkg").write_text("notes")
    (tmp_path / "notes.tif").write_text("notes")
    for name in ("folder.gpkg", "notes.gpkg", "notes.tif"):
        with pytest.raises(OutputError, match="or an older export"):
            check_export_replaceable(tmp_path / name)
