"""Classified rasters and their tables."""

import tracemalloc

import numpy as np
import pytest
import rasterio

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.roads.landuse import read_landuse

CRS = "EPSG:32629"
LATTICE = Lattice(CRS, 531_000.0, 4_556_000.0, 5.0, 4, 6)
VALUES = np.array([[1, 1, 2, 2, 3, 3]] * 2 + [[2, 2, 2, 2, 1, 1]] * 2, dtype=np.uint8)
TABLE = "class,value,walkable\nstreet,1,1\nhouse,2,0\npark,3,1\n"
COLOURS = np.array([[0, 0, 0], [200, 10, 30], [90, 90, 90], [0, 255, 0]], dtype=np.uint8)
COLOUR_TABLE = "class;r;g;b;walkable\nstreet;200;10;30;1\nhouse;90;90;90;0\npark;0;255;0;1\n"


@pytest.fixture
def write(tmp_path):
    def write_raster(bands, *, table=TABLE, lattice=LATTICE, crs=CRS, nodata=None):
        bands = np.atleast_3d(bands) if bands.ndim == 3 else bands[None]
        path, table_path = tmp_path / "landuse.tif", tmp_path / "classes.csv"
        profile = {
            "driver": "GTiff", "count": len(bands), "dtype": bands.dtype, "crs": crs,
            "height": bands.shape[1], "width": bands.shape[2], "nodata": nodata,
            "transform": rasterio.Affine.from_gdal(*lattice.gdal_transform),
        }  # fmt: skip
        with rasterio.open(path, "w", **profile) as target:
            target.write(bands)
        table_path.write_text(table, encoding="utf-8")
        return path, table_path

    return write_raster


def test_values(write):
    np.testing.assert_array_equal(read_landuse(*write(VALUES), LATTICE).walkable, VALUES != 2)


def test_colours(write):
    bands = np.moveaxis(COLOURS[VALUES], -1, 0)
    mask = read_landuse(*write(bands, table=COLOUR_TABLE), LATTICE).walkable
    np.testing.assert_array_equal(mask, VALUES != 2)


def test_tables_of_any_length(write):
    codes = VALUES.astype(np.uint16) * 20_000
    rows = "".join(f"class {code},{code},{int(code != 40_000)}\n" for code in range(60_001))
    landuse = read_landuse(*write(codes, table=f"class,value,walkable\n{rows}"), LATTICE)
    np.testing.assert_array_equal(landuse.walkable, VALUES != 2)
    assert landuse.code.max() == 60_000
    assert read_landuse(*write(VALUES), LATTICE).code.dtype == np.int8


def test_of_many_unknown_classes_the_most_frequent_are_told(write):
    codes = np.arange(24, dtype=np.uint8).reshape(4, 6)
    codes[0, :3] = 23
    with pytest.raises(InputError) as caught:
        read_landuse(*write(codes), LATTICE)
    told = [fault.got for fault in caught.value.faults]
    assert told[0] == "value 23 at 4 points"
    assert told[-1] == "10 others at 10 points"
    assert len(told) == 11


def test_finer_and_coarser_rasters_are_read_at_the_lattice_points(write):
    fine = Lattice(CRS, LATTICE.west_m, LATTICE.north_m, 1.0, 20, 30)
    files = write(np.kron(VALUES, np.ones((5, 5), np.uint8)), lattice=fine)
    np.testing.assert_array_equal(read_landuse(*files, LATTICE).walkable, VALUES != 2)
    coarse = Lattice(CRS, LATTICE.west_m, LATTICE.north_m, 10.0, 2, 3)
    files = write(VALUES[::2, ::2], lattice=coarse)
    np.testing.assert_array_equal(read_landuse(*files, LATTICE).walkable, VALUES != 2)


def test_off_the_raster_and_no_data_are_not_walkable(write):
    part = Lattice(CRS, LATTICE.west_m + 5, LATTICE.north_m, 5.0, 4, 4)
    mask = read_landuse(*write(VALUES[:, 1:5], lattice=part, nodata=3), LATTICE).walkable
    expected = VALUES == 1
    expected[:, [0, 5]] = False
    np.testing.assert_array_equal(mask, expected)


def test_resampling_is_told_and_alignment_is_not(write):
    assert read_landuse(*write(VALUES), LATTICE).notes == ()
    larger = Lattice(CRS, LATTICE.west_m - 10, LATTICE.north_m + 5, 5.0, 5, 8)
    files = write(np.pad(VALUES, ((1, 0), (2, 0)), constant_values=1), lattice=larger)
    assert read_landuse(*files, LATTICE).notes == ()
    for west_m, size_m in ((LATTICE.west_m - 2.5, 5.0), (LATTICE.west_m, 10.0)):
        files = write(VALUES, lattice=Lattice(CRS, west_m, LATTICE.north_m, size_m, 4, 6))
        note, *_ = read_landuse(*files, LATTICE).notes
        assert f"landuse.tif: pixels of {size_m:g} m resampled" in note


def test_a_raster_of_a_part_of_the_area_is_told(write):
    part = Lattice(CRS, LATTICE.west_m, LATTICE.north_m, 5.0, 4, 3)
    (note,) = read_landuse(*write(VALUES[:, :3], lattice=part), LATTICE).notes
    assert note.endswith("landuse.tif: covers 50% of the area")


def test_a_value_below_zero_is_unknown_and_not_outside(write):
    values = VALUES.astype(np.int16)
    values[0, 0] = -1
    with pytest.raises(InputError, match="value -1 at 1 point"):
        read_landuse(*write(values), LATTICE)


@pytest.mark.parametrize("rows_at_a_time", [1, 3, 1000])
def test_windows_change_nothing(write, monkeypatch, rows_at_a_time):
    rng = np.random.default_rng(4)
    fine = Lattice(CRS, LATTICE.west_m - 3, LATTICE.north_m + 4, 0.7, 45, 60)
    values = rng.integers(1, 4, (45, 60)).astype(np.uint8)
    monkeypatch.setattr("mapfilter.roads.landuse._LARGEST_WINDOW_PX", 60 * 8 * rows_at_a_time)
    found = read_landuse(*write(values, lattice=fine), LATTICE).walkable
    row, col = np.divmod(np.arange(24), 6)
    there = fine.row_col(*LATTICE.east_north(row, col))
    np.testing.assert_array_equal(found.ravel(), values[there] != 2)


def test_a_fine_raster_is_never_in_memory_as_a_whole(write, monkeypatch):
    fine = Lattice(CRS, LATTICE.west_m, LATTICE.north_m, 0.01, 2000, 3000)
    files = write(np.kron(VALUES, np.ones((500, 500), np.uint8)), lattice=fine)
    monkeypatch.setattr("mapfilter.roads.landuse._LARGEST_WINDOW_PX", 1 << 16)
    tracemalloc.start()
    try:
        found = read_landuse(*files, LATTICE).walkable
        _, peak_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    np.testing.assert_array_equal(found, VALUES != 2)
    assert peak_bytes < fine.rows * fine.cols / 2


def test_unknown_values_and_colours_are_listed_with_their_counts(write):
    odd = VALUES.copy()
    odd[0, :3], odd[1, 0] = 9, 77
    with pytest.raises(InputError) as caught:
        read_landuse(*write(odd), LATTICE)
    assert "value 9 at 3 points" in str(caught.value)
    assert "value 77 at 1 point" in str(caught.value)
    bands = np.moveaxis(COLOURS[VALUES], -1, 0)
    bands[:, 0, 0] = 201, 11, 30
    with pytest.raises(InputError, match="colour 201,11,30 at 1 point"):
        read_landuse(*write(bands, table=COLOUR_TABLE), LATTICE)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("", "no rows"),
        ("name,value\nstreet,1\n", "name, value"),
        ("class,value,walkable\nstreet,one,1\n", "row 2, value"),
        ("class,value,walkable\nstreet,²,1\n", "row 2, value"),
        (f"class,value,walkable\nstreet,{'9' * 5000},1\n", "row 2, value"),
        ("class,value,walkable\nstreet,1,yes\n", "row 2, walkable"),
        ("class,value,walkable\npath,2,1\n\n\nstreet,1,yes\n", "row 5, walkable"),
        ("class,value,walkable\nstreet,1,1\npath,1,1\n", "row 3: .*again that of 'street'"),
        ("class,r,g,b,walkable\nstreet,1,2,300,1\n", "row 2, b"),
        (TABLE.replace("1\n", "0\n").replace("park,3,1", "park,3,0"), "wrong table"),
        (COLOUR_TABLE, "three colour bands"),
    ],
)
def test_tables_that_do_not_fit(write, table, message):
    with pytest.raises(InputError, match=message):
        read_landuse(*write(VALUES, table=table), LATTICE)


def test_rasters_that_do_not_fit(write, tmp_path):
    with pytest.raises(InputError, match="another zone"):
        read_landuse(*write(VALUES, crs="EPSG:32630"), LATTICE)
    with pytest.raises(InputError, match="degrees"):
        read_landuse(*write(VALUES, crs="EPSG:4326"), LATTICE)
    with pytest.raises(InputError, match="CRS left out"):
        read_landuse(*write(VALUES, crs=None), LATTICE)
    with pytest.raises(InputError, match="continuous"):
        read_landuse(*write(VALUES.astype(np.float32)), LATTICE)
    bands = np.moveaxis(COLOURS[VALUES], -1, 0).astype(np.uint16)
    with pytest.raises(InputError, match="colours of 8 bits"):
        read_landuse(*write(bands, table=COLOUR_TABLE), LATTICE)
    path, table = write(VALUES)
    with rasterio.open(path, "r+") as source:
        source.transform = rasterio.Affine(5, 1, 531_000, 1, -5, 4_556_000)
    with pytest.raises(InputError, match="rotated"):
        read_landuse(path, table, LATTICE)
    with rasterio.open(path, "r+") as source:
        source.transform = rasterio.Affine(-5, 0, 531_030, 0, -5, 4_556_000)
    with pytest.raises(InputError, match="mirrored"):
        read_landuse(path, table, LATTICE)
    far = Lattice(CRS, 600_000.0, 4_556_000.0, 5.0, 4, 6)
    with pytest.raises(InputError, match="another area"):
        read_landuse(*write(VALUES, lattice=far), LATTICE)
    path, table = write(VALUES)
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(InputError, match=r"landuse\.tif"):
        read_landuse(path, table, LATTICE)
    with pytest.raises(InputError, match="no such file"):
        read_landuse(tmp_path / "none.tif", table, LATTICE)
    with pytest.raises(InputError, match=r"none\.csv"):
        read_landuse(path, tmp_path / "none.csv", LATTICE)
