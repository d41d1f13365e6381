"""What an export may replace: nothing but an older export that nobody changed."""

import sqlite3
from contextlib import closing

import pytest
from small_world import LATTICE, make_database, make_world

from mapfilter.database.export import export_cog, export_geopackage
from mapfilter.database.exported import BANDS, CELLS_TAG, WRITTEN, check_export_replaceable
from mapfilter.errors import OutputError
from mapfilter.rasters.geotiff_writer import new_geotiff


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


@pytest.mark.parametrize("suffix", [".tif", ".tiff", ".TIF"])
@pytest.mark.parametrize(
    ("names", "tags", "own"),
    [
        ([name for name, _ in BANDS], {CELLS_TAG: "[]"}, True),
        ([name for name, _ in BANDS], {}, False),
        ([name for name, _ in BANDS][::-1], {CELLS_TAG: "[]"}, False),
        (["best_server"], {CELLS_TAG: "[]"}, False),
    ],
)
def test_a_raster_is_told_by_its_bands_and_its_list_of_cells(tmp_path, names, tags, own, suffix):
    path = tmp_path / f"best{suffix}"
    with new_geotiff(path, LATTICE, [(name, "") for name in names], tags):
        pass
    if own:
        check_export_replaceable(path)
        return
    with pytest.raises(OutputError, match="a file of another program"):
        check_export_replaceable(path)


def test_an_export_checks_before_it_writes(tmp_path):
    database = make_database(make_world(tmp_path), tmp_path)
    for name, export in (("best.tif", export_cog), ("layers.gpkg", export_geopackage)):
        file = tmp_path / name
        file.write_text("of another program")
        with pytest.raises(OutputError, match="nothing yet, or an older export"):
            export(database, file)
        assert file.read_text() == "of another program"
        file.unlink()
        export(database, file)
        first = file.read_bytes()
        export(database, str(file))
        assert file.read_bytes() == first
    upper = tmp_path / "LAYERS.GPKG"
    export_geopackage(database, upper)
    check_export_replaceable(upper)
    with pytest.raises(OutputError, match=r"ends in \.gpkg, found \.png"):
        export_geopackage(database, tmp_path / "layers.png")
    with pytest.raises(OutputError, match=r"ends in \.tif, found no suffix"):
        export_cog(database, tmp_path / "best")
