"""Classified rasters and their tables."""

import numpy as np
import pytest
import rasterio

from mapfilter.errors import InputError
from mapfilter.geodesy import Lattice
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
    np.testing.assert_array_equal(read_landuse(*write(VALUES), LATTICE), VALUES != 2)


def test_colours(write):
    bands = np.moveaxis(COLOURS[VALUES], -1, 0)
    mask = read_landuse(*write(bands, table=COLOUR_TABLE), LATTICE)
    np.testing.assert_array_equal(mask, VALUES != 2)


def test_finer_and_coarser_rasters_are_read_at_the_lattice_points(write):
    fine = Lattice(CRS, LATTICE.west_m, LATTICE.north_m, 1.0, 20, 30)
    files = write(np.kron(VALUES, np.ones((5, 5), np.uint8)), lattice=fine)
    np.testing.assert_array_equal(read_landuse(*files, LATTICE), VALUES != 2)
    coarse = Lattice(CRS, LATTICE.west_m, LATTICE.north_m, 10.0, 2, 3)
    files = write(VALUES[::2, ::2], lattice=coarse)
    np.testing.assert_array_equal(read_landuse(*files, LATTICE), VALUES != 2)


def test_off_the_raster_and_no_data_are_not_walkable(write):
    part = Lattice(CRS, LATTICE.west_m + 5, LATTICE.north_m, 5.0, 4, 4)
    mask = read_landuse(*write(VALUES[:, 1:5], lattice=part, nodata=3), LATTICE)
    expected = VALUES == 1
    expected[:, [0, 5]] = False
    np.testing.assert_array_equal(mask, expected)


def test_unknown_values_and_colours_are_listed_with_their_counts(write):
    odd = VALUES.copy()
    odd[0, :3], odd[1, 0] = 9, 77
    with pytest.raises(InputError) as caught:
        read_landuse(*write(odd), LATTICE)
    assert "value 9 at 3 points" in str(caught.value)
    assert "value 77 at 1 points" in str(caught.value)
    bands = np.moveaxis(COLOURS[VALUES], -1, 0)
    bands[:, 0, 0] = 201, 11, 30
    with pytest.raises(InputError, match="colour 201,11,30 at 1 points"):
        read_landuse(*write(bands, table=COLOUR_TABLE), LATTICE)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("", "no rows"),
        ("name,value\nstreet,1\n", "name, value"),
        ("class,value,walkable\nstreet,one,1\n", "row 2, value"),
        ("class,value,walkable\nstreet,1,yes\n", "row 2, walkable"),
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
