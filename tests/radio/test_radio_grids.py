"""Raw pixels with a header and ESRI ASCII grids, against GDAL and against hostile headers."""

from pathlib import Path

import numpy as np
import pyproj
import pytest
import rasterio
from hypothesis import given, settings
from hypothesis import strategies as st
from raster_files import HDR, write_ascii, write_bil

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import RxLevRasters

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 2.5, 5, 7)
LEVEL = np.linspace(-120, -40, 35).reshape(5, 7).round()
ASCII = "ncols 2\nnrows 2\nxllcorner 385000\nyllcorner 6673000\ncellsize 5\n"
BIL = "NROWS 2\nNCOLS 2\nNBITS 16\nBYTEORDER I\nULXMAP 385002.5\nULYMAP 6673007.5\nXDIM 5\nYDIM 5\n"


def _open(path: Path, nodata: float | None = None) -> RxLevRasters:
    return open_rasters(path, "level", crs=CRS, nodata=nodata)


def _complaint(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        _open(path).read()
    return str(caught.value)


@pytest.mark.parametrize("order", ["I", "M"])
@pytest.mark.parametrize("dtype", ["i1", "i2", "i4", "f4"])
def test_raw_pixels_as_gdal_reads_them(tmp_path: Path, dtype: str, order: str) -> None:
    values = LEVEL.astype(dtype)
    path = write_bil(tmp_path / "S 1.bil", LATTICE, values, order=order, nodata=-120)
    rasters = _open(path)
    assert rasters.cell_ids == ("S 1",)
    assert rasters.lattice == LATTICE
    found = rasters.read()[0]
    assert np.isnan(found[0, 0])
    found[0, 0] = -120
    np.testing.assert_array_equal(found, LEVEL)
    if dtype != "i1":
        with rasterio.open(path) as source:
            assert source.transform.to_gdal() == LATTICE.gdal_transform
            np.testing.assert_array_equal(source.read(1), values)


def test_unsigned_losses_and_padding_of_rows(tmp_path: Path) -> None:
    values = np.full((5, 10), 65535, dtype="<u2")
    values[:, :7] = -LEVEL
    header = HDR + "TOTALROWBYTES 20\n"
    path = write_bil(tmp_path / "a.bil", LATTICE, values, header=header, nodata=65535)
    rasters = open_rasters(path, "loss", crs=CRS)
    np.testing.assert_array_equal(rasters.read((1, 2, 3, 4))[0], -LEVEL[1:4, 2:6])


def test_float_grids_are_placed_by_their_corner(tmp_path: Path) -> None:
    path = tmp_path / "a.flt"
    path.write_bytes(LEVEL[:2, :2].astype(">f4").tobytes())
    path.with_suffix(".hdr").write_text(ASCII + "byteorder MSBFIRST\n")
    rasters = _open(path)
    assert rasters.lattice == Lattice(CRS, 385000.0, 6673010.0, 5.0, 2, 2)
    np.testing.assert_array_equal(rasters.read()[0], LEVEL[:2, :2].astype("f4"))


@pytest.mark.parametrize("corner", [True, False])
def test_ascii_grids_as_gdal_reads_them(tmp_path: Path, corner: bool) -> None:
    path = write_ascii(tmp_path / "S 1.asc", LATTICE, LEVEL, corner=corner, nodata="-120")
    rasters = _open(path)
    assert rasters.lattice == LATTICE
    assert rasters.cell_ids == ("S 1",)
    with rasterio.open(path) as source:
        assert source.transform.to_gdal() == LATTICE.gdal_transform
        expected = source.read(1, masked=True).astype(np.float32).filled(np.nan)
    np.testing.assert_array_equal(rasters.read()[0], expected)
    assert np.isnan(expected[0, 0])


@given(st.integers(0, 4), st.integers(0, 6), st.integers(1, 5), st.integers(1, 7))
@settings(max_examples=30)
def test_windows_of_plain_grids(
    tmp_path_factory: pytest.TempPathFactory, row: int, col: int, rows: int, cols: int
) -> None:
    folder = tmp_path_factory.mktemp("grids")
    write_ascii(folder / "A.asc", LATTICE, LEVEL)
    write_bil(folder / "B.bil", LATTICE, LEVEL.astype("i2"))
    rows, cols = min(rows, 5 - row), min(cols, 7 - col)
    part = _open(folder).read((row, col, rows, cols), ["B", "A", "B"])
    assert part.shape == (3, rows, cols)
    np.testing.assert_array_equal(part[0], LEVEL[row : row + rows, col : col + cols])
    np.testing.assert_array_equal(part[0], part[1])


def test_ascii_without_nodata_line_windows_ends_and_decimal_commas(tmp_path: Path) -> None:
    path = tmp_path / "a.asc"
    text = ASCII.replace("size 5", "size 2,5") + "-80,5 -9999\n-81 -82.25"
    path.write_bytes(text.replace("\n", "\r\n").encode())
    rasters = _open(path)
    assert rasters.lattice == Lattice(CRS, 385000.0, 6673005.0, 2.5, 2, 2)
    np.testing.assert_array_equal(rasters.read()[0], [[-80.5, np.nan], [-81, -82.25]])


def test_the_crs_lies_beside_the_grid(tmp_path: Path) -> None:
    path = write_ascii(tmp_path / "a.asc", LATTICE, LEVEL)
    prj = path.with_suffix(".prj")
    prj.write_text(pyproj.CRS(CRS).to_wkt("WKT1_ESRI"))
    assert open_rasters(path, "level").lattice == LATTICE
    assert _open(path).lattice == LATTICE
    with pytest.raises(InputError, match="two systems mixed up"):
        open_rasters(path, "level", crs="EPSG:3067")
    prj.write_text(pyproj.CRS("EPSG:4326").to_wkt("WKT1_ESRI"))
    assert "degrees given for metres" in _complaint(path)
    prj.write_text("Projection UTM\nZone 35")
    assert _open(path).lattice == LATTICE
    with pytest.raises(InputError, match=r"a\.prj: expected a CRS as well.*, found a file"):
        open_rasters(path, "level")
    prj.write_text(pyproj.CRS("EPSG:3067").to_wkt())
    with pytest.raises(InputError, match="found EPSG:3067"):
        open_rasters(path, "level", crs=CRS)
    prj.write_bytes(b"")
    with pytest.raises(InputError, match=r"found an empty file \(likely: .*set crs in \[rasters\]"):
        open_rasters(path, "level")


def test_heights_of_a_compound_crs_are_left_out(tmp_path: Path) -> None:
    path = write_ascii(tmp_path / "a.asc", LATTICE, LEVEL)
    path.with_suffix(".prj").write_text(pyproj.CRS(f"{CRS}+5773").to_wkt())
    assert open_rasters(path, "level").lattice == LATTICE
    assert _open(path).lattice == LATTICE


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("nrows 2", "nrows 3"), "3 lines of numbers, found 2"),
        (("nrows 2", "nrows 1"), "1 lines of numbers, found more"),
        (("ncols 2", "ncols 3"), "row 1: expected 3 numbers, found 2"),
        (("ncols 2", "ncols 1"), "row 1: expected 1 numbers, found more"),
        (("ncols 2", "ncols -2"), "NCOLS: expected a whole number"),
        (("ncols 2", "ncols 2.5"), "NCOLS: expected a whole number"),
        (("ncols 2", "ncols 2147483647"), "NCOLS: expected a whole number"),
        (("nrows 2", "nrows 5000000"), "the file is cut off, or its header is damaged"),
        (("cellsize 5", "cellsize 0"), "metres > 0"),
        (("cellsize 5", "cellsize nan"), "CELLSIZE: expected a number"),
        (("cellsize 5\n", ""), "the size of a pixel"),
        (("xllcorner 385000\n", ""), "exported without its place"),
        (("385000", "1e300"), "within 1e+08 m of the origin"),
        (("385000", "inf"), "XLLCORNER: expected a number"),
        (("-82", "x"), "row 2: expected 2 numbers, found something else"),
        (("-82", "1_0"), "row 2: expected 2 numbers, found something else"),
        (("-82", "1e39"), ""),
        (("ncols", "what"), "no ASCII grid"),
        (("-79", "120"), "path losses, or raw RXLEV, given for levels"),
        (("-79", "-999"), "-999 means no data, and the file does not state it"),
    ],
)
def test_ascii_grids_that_are_wrong(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    path = tmp_path / "a.asc"
    path.write_text((ASCII + "-79 -80\n-81 -82\n").replace(*change))
    if said:
        assert said in _complaint(path)
    else:
        assert np.isnan(_open(path).read()).sum() == 1


def test_degrees_in_a_header_are_told(tmp_path: Path) -> None:
    path = tmp_path / "a.asc"
    text = ASCII.replace("385000", "24.9").replace("6673000", "60.1").replace("size 5", "size 5e-5")
    path.write_text(text + "-79 -80\n-81 -82\n")
    assert "degrees given for metres" in _complaint(path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("NROWS 2", "NROWS 3"), "the file is cut off, or the header is of another"),
        (("NROWS 2", "NROWS 1"), "NBITS, NROWS or NCOLS is wrong"),
        (("NBITS 16", "NBITS 8"), "NBITS, NROWS or NCOLS is wrong"),
        (("NBITS 16", "NBITS 12"), "NBITS 8, 16 or 32"),
        (("NROWS 2\n", ""), "a line NROWS"),
        (("NROWS 2", "NROWS 0"), "NROWS: expected a whole number"),
        (("BYTEORDER I", "BYTEORDER X"), "BYTEORDER: expected I or M"),
        (("BYTEORDER I", "BYTEORDER M"), "factor left out, or the wrong byte order"),
        (("YDIM 5", "YDIM 4"), "square pixels, found 5 x 4"),
        (("YDIM 5", "NBANDS 2\nYDIM 5"), "one band per file"),
        (("YDIM 5", "SKIPBYTES 99999999\nYDIM 5"), "SKIPBYTES: expected"),
        (("YDIM 5", "TOTALROWBYTES 1\nYDIM 5"), "TOTALROWBYTES: expected at least 4"),
        (("YDIM 5", "PIXELTYPE COMPLEX\nYDIM 5"), "PIXELTYPE SIGNEDINT"),
    ],
)
def test_raw_pixels_whose_header_is_wrong(
    tmp_path: Path, change: tuple[str, str], said: str
) -> None:
    path = tmp_path / "a.bil"
    path.write_bytes(np.array([[-79, -80], [-81, -82]], dtype="<i2").tobytes())
    path.with_suffix(".hdr").write_text(BIL.replace(*change))
    assert said in _complaint(path)


def test_raw_pixels_without_header_or_pixels(tmp_path: Path) -> None:
    path = tmp_path / "a.bil"
    path.write_bytes(bytes(8))
    assert "a.hdr: expected a readable file" in _complaint(path)
    path.with_suffix(".hdr").write_bytes(b"NROWS 2\n" * 10_000)
    assert "at most 64 KiB" in _complaint(path)
    path.write_bytes(b"")
    assert "an empty file" in _complaint(path)


def test_a_file_that_shrinks_after_it_was_opened(tmp_path: Path) -> None:
    for path in (
        write_bil(tmp_path / "a.bil", LATTICE, LEVEL.astype("i2")),
        write_ascii(tmp_path / "b.asc", LATTICE, LEVEL),
    ):
        rasters = _open(path)
        path.write_bytes(path.read_bytes()[:-30])
        with pytest.raises(InputError, match="cut off"):
            rasters.read()
        path.unlink()
        with pytest.raises(InputError, match="No such file"):
            rasters.read()
