"""Limits of what raster files may hold, each tried on both of its sides."""

import numpy as np
import pytest
from raster_files import write_ascii, write_bil

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.rasters.ascii_grids import open_ascii_grid
from mapfilter.rasters.files import Declared, check_plausible, without_nodata
from mapfilter.rasters.opening import _listed, open_rasters
from mapfilter.rasters.plain_grids import GridHeader

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 6, 8)


def plausible(values, quantity, folder):
    check_plausible(np.array([values], dtype=np.float32), quantity, folder / "a.tif")


@pytest.mark.parametrize(
    ("values", "quantity"),
    [
        ((-300, -80), "level"),
        ((-80, 60, -80), "level"),
        ((-80, 0, 0, -80), "level"),
        ((np.nan, np.nan), "level"),
        ((100, 400), "loss"),
        ((0, 100, 100), "loss"),
        ((20, 20, 20), "loss"),
        ((10, 10, 100, 100), "loss"),
        ((19, 20, 20, 100), "loss"),
        ((0, 100), "deviation"),
        ((np.nan, -80), "level"),
    ],
)
def test_what_is_just_plausible(tmp_path, values, quantity):
    plausible(values, quantity, tmp_path)


@pytest.mark.parametrize(
    ("values", "quantity", "said"),
    [
        ((-300.5, -80), "level", "a level in -300..60 dBm"),
        ((-80, 60.5), "level", "a level in -300..60 dBm"),
        ((0, 0, 0, -80, -80), "level", "mostly 0 and above"),
        ((0, 0, -80, np.nan, np.nan), "level", "mostly 0 and above"),
        ((100, 400.5), "loss", "a loss in 0..400 dB"),
        ((-0.5, 100), "loss", "a loss in 0..400 dB"),
        ((19, 19, 100), "loss", "mostly above 20 dB"),
        ((0, 100.5), "deviation", "a deviation in 0..100 dB"),
        ((-0.5, 5), "deviation", "a deviation in 0..100 dB"),
        ((-250, 100), "loss", "-250 means no data"),
        ((-249, 100), "loss", "levels given for path losses"),
        ((-999, -999), "level", "path losses, or raw RXLEV"),
        ((-1001, -900), "level", "factor left out, or the wrong byte order"),
        ((65413, 65524), "level", "negative numbers read as unsigned ones"),
        ((40000, 65524), "level", "factor left out, or the wrong byte order"),
        ((128, 200, 255), "level", "negative numbers read as unsigned ones"),
        ((127, 200, 255), "level", "path losses, or raw RXLEV"),
        ((128, 200, 256), "level", "path losses, or raw RXLEV"),
        ((128, 200.5, 255), "level", "path losses, or raw RXLEV"),
        ((-1000, -900, -80), "level", "path losses, or raw RXLEV"),
        ((-999, -999, -998, -80), "level", "path losses, or raw RXLEV"),
    ],
)
def test_what_is_just_not(tmp_path, values, quantity, said):
    with pytest.raises(InputError) as caught:
        plausible(values, quantity, tmp_path)
    assert said in str(caught.value)


def test_numbers_that_mean_no_data_are_compared_in_single_precision():
    values = np.array([0.1, 5.0, np.inf, -np.inf, -9999.0], dtype=np.float32)
    found = without_nodata(values, (0.1, -9999.0))
    np.testing.assert_array_equal(found, np.array([np.nan, 5.0, np.nan, np.nan, np.nan], "f4"))


HEADER = {
    "NROWS": "6",
    "NCOLS": "8",
    "CELLSIZE": "5",
    "XLLCORNER": "385000",
    "YLLCORNER": "6672970",
}


def placed(**changes):
    values = {key: text for key, text in (HEADER | changes).items() if text}
    rows, cols = (int(values[key]) for key in ("NROWS", "NCOLS"))
    header = GridHeader("a.hdr", values)
    lattice = header.lattice(CRS, rows, cols)
    return lattice, [fault.expected for fault in header.faults.found]


def test_places_by_corner_centre_and_upper_centre_are_one():
    for keys in (
        {},
        {"XLLCORNER": "", "YLLCORNER": "", "XLLCENTER": "385002.5", "YLLCENTER": "6672972.5"},
        {"XLLCORNER": "", "YLLCORNER": "", "XLLCENTRE": "385002.5", "YLLCENTRE": "6672972.5"},
        {"XLLCORNER": "", "YLLCORNER": "", "ULXMAP": "385002.5", "ULYMAP": "6672997.5"},
        {"CELLSIZE": "", "XDIM": "5", "YDIM": "5"},
        {"CELLSIZE": "", "DX": "5", "DY": "5.000004"},
    ):
        assert placed(**keys) == (LATTICE, [])


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"CELLSIZE": "", "XDIM": "5"}, "the size of a pixel: CELLSIZE, or XDIM and YDIM"),
        ({"CELLSIZE": "", "XDIM": "5", "YDIM": "5.00001"}, "square pixels"),
        ({"CELLSIZE": "", "XDIM": "5", "YDIM": "-5"}, "metres > 0"),
        ({"CELLSIZE": "100000001"}, "metres > 0"),
        ({"CELLSIZE": "0"}, "metres > 0"),
        ({"CELLSIZE": "", "XDIM": "5", "YDIM": "0"}, "metres > 0"),
        ({"XLLCORNER": "100000001"}, "a grid within 1e+08 m of the origin"),
        ({"YLLCORNER": "-100000031"}, "a grid within 1e+08 m of the origin"),
        ({"CELLSIZE": "20000000"}, "a grid within 1e+08 m of the origin"),
        ({"CELLSIZE": "0.04", "XLLCORNER": "24.9", "YLLCORNER": "60.1"}, f"metres in {CRS}"),
        ({"YLLCORNER": ""}, "XLLCORNER and YLLCORNER, their CENTER, or ULXMAP and ULYMAP"),
        ({"XLLCORNER": ""}, "XLLCORNER and YLLCORNER, their CENTER, or ULXMAP and ULYMAP"),
    ],
)
def test_places_that_are_none(changes, expected):
    assert placed(**changes) == (None, [expected])


def test_places_that_just_are():
    assert placed(XLLCORNER="-100000000")[0].west_m == -1e8
    assert placed(CELLSIZE="0.05", XLLCORNER="24.9", YLLCORNER="60.1")[1] == []
    assert placed(CELLSIZE="0.04", XLLCORNER="181", YLLCORNER="60.1")[1] == []


@pytest.mark.parametrize(("text", "value"), [("10000000", 10_000_000), ("3,0", 3), ("2", 2)])
def test_whole_numbers(text, value):
    header = GridHeader("a.hdr", {"NROWS": text})
    assert header.whole("NROWS", low=2) == value
    assert header.faults.found == []


@pytest.mark.parametrize("text", ["10000001", "1", "2.5", "1_0", "nan", "x"])
def test_whole_numbers_that_are_none(text):
    header = GridHeader("a.hdr", {"NROWS": text})
    assert header.whole("NROWS", low=2) is None
    assert len(header.faults.found) == 1


def test_a_header_is_the_first_two_words_of_each_line_and_the_first_of_each_key():
    header = GridHeader.of("a", [b"nrows = 3 # rows", b"alone", b"NCOLS 4", b"ncols 5"])
    assert header.values == {"NROWS": "3", "NCOLS": "4"}


def test_a_header_of_64_kib_is_the_longest(tmp_path):
    path = tmp_path / "a.hdr"
    path.write_bytes(b"NROWS 3\n".ljust(65536))
    assert GridHeader.read(path).values == {"NROWS": "3"}
    path.write_bytes(b"NROWS 3\n".ljust(65537))
    with pytest.raises(InputError, match="64 KiB"):
        GridHeader.read(path)


def ascii_text(rows, head=None):
    text = head or "ncols 2\nnrows 2\nxllcorner 385000\nyllcorner 6673000\ncellsize 5\n"
    return text + rows


@pytest.mark.parametrize(
    ("rows", "values"),
    [
        ("-80 -81\n-82 -83\n", [[-80, -81], [-82, -83]]),
        ("-80 -81\n-82 -83", [[-80, -81], [-82, -83]]),
        ("-80 -81\n-82 -83\n\n  \n", [[-80, -81], [-82, -83]]),
        ("-80 -9999\n-82 -83\n", [[-80, np.nan], [-82, -83]]),
    ],
)
def test_rows_of_text(tmp_path, rows, values):
    path = tmp_path / "a.asc"
    path.write_text(ascii_text(rows))
    grid = open_ascii_grid(path, "a", Declared(crs=CRS))
    np.testing.assert_array_equal(grid.read([0], (0, 0, 2, 2))[0], np.array(values, "f4"))
    np.testing.assert_array_equal(grid.read([0, 0], (1, 1, 1, 1))[1], [[-83]])


@pytest.mark.parametrize(
    "rows", ["-80 -81\n-82 -83\n-84 -85\n", "-80 -81\n", "-80\n-81\n-82 -83\n"]
)
def test_rows_of_text_that_are_more_or_fewer(tmp_path, rows):
    path = tmp_path / "a.asc"
    path.write_text(ascii_text(rows + " " * 20))
    with pytest.raises(InputError):
        open_ascii_grid(path, "a", Declared(crs=CRS)).read([0], (0, 0, 2, 2))


def test_the_shortest_text_that_can_hold_the_numbers(tmp_path):
    path = tmp_path / "a.asc"
    path.write_text(ascii_text("1 2\n3 4"))
    grid = open_ascii_grid(path, "a", Declared(crs=CRS))
    assert grid.read([0], (0, 0, 2, 2))[0].tolist() == [[1, 2], [3, 4]]
    path.write_text(ascii_text("1 2\n3 "))
    with pytest.raises(InputError, match="at least 7 bytes for 2 x 2 numbers"):
        open_ascii_grid(path, "a", Declared(crs=CRS))


def test_numbers_that_mean_no_data_in_text_are_the_headers_and_the_given_one(tmp_path):
    path = write_ascii(tmp_path / "a.asc", LATTICE, np.full((6, 8), 7.0), nodata="7")
    assert open_ascii_grid(path, "a", Declared(crs=CRS)).nodata == (7.0,)
    assert open_ascii_grid(path, "a", Declared(crs=CRS, nodata=8.0)).nodata == (7.0, 8.0)
    write_ascii(path, LATTICE, np.full((6, 8), 7.0))
    assert open_ascii_grid(path, "a", Declared(crs=CRS)).nodata == (-9999.0,)


def test_a_million_columns_of_text_are_the_most(tmp_path):
    path = tmp_path / "a.asc"
    head = "ncols {}\nnrows 1\nxllcorner 385000\nyllcorner 6673000\ncellsize 5\n"
    path.write_text(head.format(1_000_000) + "1 " * 1_000_000)
    assert open_ascii_grid(path, "a", Declared(crs=CRS)).lattice.cols == 1_000_000
    path.write_text(head.format(1_000_001) + "1 " * 1_000_001)
    with pytest.raises(InputError, match="NCOLS: expected at most 1000000"):
        open_ascii_grid(path, "a", Declared(crs=CRS))


def test_raw_pixels_may_lack_the_padding_of_the_last_row_and_no_more(tmp_path):
    values = np.arange(48, dtype=np.int16).reshape(6, 8) + 100
    path = write_bil(tmp_path / "a.bil", LATTICE, values)
    header = path.with_suffix(".hdr")
    header.write_text(header.read_text() + "TOTALROWBYTES 20\n")
    padded = np.zeros((6, 10), dtype="<i2")
    padded[:, :8] = values
    whole = padded.tobytes()
    for data, fits in (
        (whole, True),
        (whole[:-4], True),
        (whole[:-5], False),
        (whole + b"x", False),
    ):
        path.write_bytes(data)
        if fits:
            found = open_rasters(path, "loss", crs=CRS).read()[0]
            np.testing.assert_array_equal(found, values)
        else:
            with pytest.raises(InputError, match="120 bytes for 6 rows of 20"):
                open_rasters(path, "loss", crs=CRS)


@pytest.mark.parametrize("count", [100_000, 100_001])
def test_a_folder_holds_100_000_rasters_at_most(tmp_path, monkeypatch, count):
    path = tmp_path / "a.asc"
    # As many files take minutes to write: one of them stands for all.
    monkeypatch.setattr(type(tmp_path), "iterdir", lambda _: iter([path] * count))
    monkeypatch.setattr("mapfilter.rasters.opening._is_raster", lambda _: True)
    if count > 100_000:
        with pytest.raises(InputError, match="expected at most 100000 rasters, found 100001"):
            _listed(tmp_path)
    else:
        assert len(_listed(tmp_path)) == count
