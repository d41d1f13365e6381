"""Headers and rows of plain grids: the numbers at which each rule begins and ends."""

import numpy as np
import pyproj
import pytest

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.rasters.ascii_grids import open_ascii_grid
from mapfilter.rasters.files import Declared
from mapfilter.rasters.plain_grids import GridHeader, grid_crs

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 2, 2)
HEAD = "ncols 2\nnrows 2\nxllcorner 385000\nyllcorner 6672990\ncellsize 5\n"
ROWS = "-80 -81\n-82 -83\n"


def grid(folder, text, **declared):
    path = folder / "a.asc"
    path.write_text(text)
    return open_ascii_grid(path, "A", Declared(**({"crs": CRS} | declared)))


def values(folder, text, **declared):
    return grid(folder, text, **declared).read([0], (0, 0, 2, 2))[0].tolist()


def fault_of(call, *arguments, **options):
    with pytest.raises(InputError) as caught:
        call(*arguments, **options)
    (fault,) = caught.value.faults
    return fault


def test_a_header_of_text_has_twelve_lines_at_most(tmp_path):
    """The thirteenth line of letters would be a row."""
    more = "".join(f"{letter} {n}\n" for n, letter in enumerate("abcdefg"))
    assert values(tmp_path, more + HEAD + ROWS) == [[-80, -81], [-82, -83]]
    assert grid(tmp_path, more + HEAD + ROWS).header_bytes == len(more + HEAD)
    with pytest.raises(InputError):
        values(tmp_path, more + HEAD + "h 7\n" + ROWS)


def test_a_header_of_text_has_4096_bytes_at_most(tmp_path):
    line = "cellsize 5".ljust(4096 - len(HEAD) + 10)
    head = HEAD.replace("cellsize 5", line)
    assert len(head) == 4096
    assert values(tmp_path, head + ROWS) == [[-80, -81], [-82, -83]]
    with pytest.raises(InputError):
        values(tmp_path, head.replace("cellsize 5", "cellsize 5 ") + ROWS)


def test_a_byte_order_mark_is_before_the_header(tmp_path):
    assert values(tmp_path, "\ufeff" + HEAD + ROWS) == [[-80, -81], [-82, -83]]
    assert grid(tmp_path, "\ufeff" + HEAD + ROWS).header_bytes == len(HEAD) + 3


def test_64_characters_for_each_number_are_the_most(tmp_path):
    row = "-82 -83".rjust(127) + "\n"
    assert values(tmp_path, HEAD + "-80 -81\n" + row) == [[-80, -81], [-82, -83]]
    fault = fault_of(values, tmp_path, HEAD + "-80 -81\n " + row)
    assert fault.where.endswith("a.asc row 2")
    assert (fault.expected, fault.got) == ("2 numbers", "129 bytes")
    assert fault.hint == "rows run together"


@pytest.mark.parametrize(
    ("rows", "got", "hint"),
    [
        ("-80 -81 -82\n-83 -84\n", "more", "NCOLS is wrong, or rows run together"),
        ("-80      \n-83 -84\n", "1", "cut off, or NCOLS is wrong"),
        ("\n-80 -81\n-82 -83\n", "more", "NROWS is wrong, or rows are broken over lines"),
        ("-80 -81     ", "1", "the file is cut off, or rows are broken over lines"),
        ("-80 x\n-82 -83\n", "something else", "damaged"),
    ],
)
def test_what_is_wrong_with_rows(tmp_path, rows, got, hint):
    fault = fault_of(values, tmp_path, HEAD + rows)
    assert (str(fault.got), fault.hint) == (got, hint)


def test_rows_are_found_again_after_the_file_has_changed(tmp_path):
    first = grid(tmp_path, HEAD + ROWS)
    assert first.read([0], (1, 0, 1, 2))[0].tolist() == [[-82, -83]]
    first.path.write_text(HEAD + "-80.125 -81.25\n-82.5 -83.75\n")
    assert first.read([0], (1, 1, 1, 1))[0].tolist() == [[-83.75]]
    assert first.read([0], (0, 1, 2, 1))[0].tolist() == [[-81.25], [-83.75]]


@pytest.mark.parametrize(
    ("line", "declared", "nodata"),
    [
        ("", None, (-9999.0,)),
        ("nodata_value 0\n", None, (0.0,)),
        ("nodata 3,5\n", None, (3.5,)),
        ("nodata 3\nnodata_value 4\n", 5.0, (4.0, 5.0)),
    ],
)
def test_numbers_of_text_that_mean_no_data(tmp_path, line, declared, nodata):
    assert grid(tmp_path, HEAD + line + ROWS, nodata=declared).nodata == nodata


@pytest.mark.parametrize("line", ["", "NODATA_value nan\n"])
@pytest.mark.parametrize("word", ["nan", "NaN", "inf"])
def test_a_first_row_may_begin_with_no_data_in_words(tmp_path, line, word):
    found = values(tmp_path, HEAD + line + f"{word} -81\n-82 -83\n")
    np.testing.assert_array_equal(found, [[np.nan, -81], [-82, -83]])


def test_a_number_for_no_data_that_is_none(tmp_path):
    fault = fault_of(grid, tmp_path, HEAD + "nodata " + "y" * 70 + "\n" + ROWS)
    assert fault.where.endswith("a.asc, NODATA")
    assert fault.got == repr("y" * 60)


@pytest.mark.parametrize("lines", ["ncols 2\n", "nrows 2\n", "other 3\n"])
def test_a_grid_of_text_has_both_sizes(tmp_path, lines):
    fault = fault_of(grid, tmp_path, lines + "xllcorner 1\n" + ROWS)
    assert (fault.expected, fault.hint) == ("lines NCOLS and NROWS first", "no ASCII grid")


def test_one_row_and_one_column_are_enough(tmp_path):
    one = HEAD.replace("ncols 2", "ncols 1").replace("nrows 2", "nrows 1")
    assert grid(tmp_path, one + "-").read is not None
    assert grid(tmp_path, one + "-80\n").read([0], (0, 0, 1, 1))[0].tolist() == [[-80]]
    for size in ("ncols", "nrows"):
        fault = fault_of(grid, tmp_path, one.replace(f"{size} 1", f"{size} 0") + "-80\n")
        assert fault.where.endswith(size.upper())
        assert fault.expected == "a whole number in 1..10000000"


def test_the_crs_file_belongs_to_the_grid(tmp_path):
    path = tmp_path / "a.asc"
    assert grid(tmp_path, HEAD + ROWS).parts == (path,)
    crs_file = tmp_path / "a.PRJ"
    crs_file.write_text(pyproj.CRS(CRS).to_wkt("WKT1_ESRI"))
    assert grid(tmp_path, HEAD + ROWS).parts == (path, crs_file)
    assert grid(tmp_path, HEAD + ROWS, crs=None).lattice == LATTICE


def test_a_crs_is_recognised_in_the_dialect_of_these_files(tmp_path):
    path = tmp_path / "a.asc"
    assert grid_crs(path, CRS) == CRS
    fault = fault_of(grid_crs, path, None)
    assert (fault.expected, fault.got) == ("a projected CRS in metres", "none")
    crs_file = tmp_path / "a.prj"
    crs_file.write_text("﻿" + pyproj.CRS(CRS).to_wkt("WKT1_ESRI"), encoding="utf-8")
    assert grid_crs(path, None) == CRS
    assert grid_crs(path, CRS) == CRS
    assert fault_of(grid_crs, path, "EPSG:32634").expected == "EPSG:32634, as declared"
    for damaged, got in (
        (b"\xff\xfe\xff", "a file that begins with 'ÿþÿ'"),
        (b"nothing that is known", "a file that begins with 'nothing that is known'"),
        (b" " + b"x" * 31, f"a file that begins with {'x' * 29!r}"),
        (b"x" * 70_000, "a larger file"),
        (b"", "an empty file"),
    ):
        crs_file.write_bytes(damaged)
        assert fault_of(grid_crs, path, None).got == got


def lattice(rows=2, cols=2, **values):
    header = GridHeader("a.hdr", {key: str(value) for key, value in values.items()})
    return header.lattice(CRS, rows, cols), [fault.expected for fault in header.faults.found]


PLACE = {"XLLCORNER": 385000, "YLLCORNER": 6672990}


def test_the_size_of_a_pixel_is_that_of_the_first_two_keys():
    assert lattice(**PLACE, XDIM=5, YDIM=5, CELLSIZE=7) == (LATTICE, [])
    assert lattice(**PLACE, DX=5, CELLSIZE=5) == (LATTICE, [])
    assert lattice(**PLACE, DX=5, CELLSIZE=7) == (None, ["square pixels"])
    assert lattice(**PLACE, XDIM="x", YDIM=5) == (None, ["a number"])
    assert lattice(**PLACE, XDIM="x", YDIM="y") == (None, ["a number"] * 2)
    # A millionth of the longer side.
    assert lattice(**PLACE, XDIM=1, YDIM=1.0000010000005)[1] == []
    assert lattice(**PLACE, XDIM=1.0000010000005, YDIM=1)[1] == []
    for side_m in (5.000006, 4.999994):
        assert lattice(**PLACE, XDIM=5, YDIM=side_m) == (None, ["square pixels"])
    none = (None, ["the size of a pixel: CELLSIZE, or XDIM and YDIM"])
    assert lattice(**PLACE) == lattice(**PLACE, YDIM=5) == none


def test_pixels_of_a_hundred_thousand_kilometres_are_the_largest():
    found, faults = lattice(1, 1, XLLCORNER=0, YLLCORNER=-100000000, CELLSIZE=100000000)
    assert (found, faults) == (Lattice(CRS, 0.0, 0.0, 1e8, 1, 1), [])
    for rows, cols in ((1, 2), (2, 1)):
        found, faults = lattice(rows, cols, XLLCORNER=0, YLLCORNER=-1e8, CELLSIZE=1e8)
        assert (found, faults) == (None, ["a grid within 1e+08 m of the origin"])


def test_degrees_end_at_180():
    degrees = (None, [f"metres in {CRS}"])
    for west, north in ((180, 60), (-180, 60), (24, -180), (24, 179.96)):
        assert lattice(XLLCORNER=west, YLLCORNER=north - 0.08, CELLSIZE=0.04) == degrees
    for west, north in ((181, 60), (-181, 60), (24, 181), (24, -181)):
        assert lattice(XLLCORNER=west, YLLCORNER=north - 0.08, CELLSIZE=0.04)[1] == []


@pytest.mark.parametrize("missing", ["XLLCORNER", "YLLCORNER", "CELLSIZE"])
def test_a_number_that_is_none_places_nothing(missing):
    found, faults = lattice(**(PLACE | {"CELLSIZE": 5} | {missing: "nan"}))
    assert (found, faults) == (None, ["a number"])
    assert lattice(None, 2, **PLACE, CELLSIZE=5) == (None, [])
    assert lattice(2, None, **PLACE, CELLSIZE=5) == (None, [])


def test_centres_of_the_lower_left_pixel_and_of_the_upper_left_one():
    found, _ = lattice(3, 2, XLLCENTER=385002.5, YLLCORNER=6672985, CELLSIZE=5)
    assert found == Lattice(CRS, 385000.0, 6673000.0, 5.0, 3, 2)
    found, _ = lattice(3, 2, XLLCORNER=385000, YLLCENTRE=6672987.5, CELLSIZE=5)
    assert found == Lattice(CRS, 385000.0, 6673000.0, 5.0, 3, 2)
    found, _ = lattice(3, 2, ULXMAP=385002.5, YLLCENTER=6672987.5, CELLSIZE=5)
    assert found == Lattice(CRS, 385000.0, 6673000.0, 5.0, 3, 2)


@pytest.mark.parametrize(("default", "value", "count"), [(None, None, 1), (7, 7, 0), (0, 0, 0)])
def test_a_whole_number_may_have_a_default(default, value, count):
    header = GridHeader("a.hdr", {})
    assert header.whole("NBITS", default) == value
    assert len(header.faults.found) == count
    given = GridHeader("a.hdr", {"NBITS": "0", "SKIP": "12"})
    assert (given.whole("NBITS", default), given.whole("SKIP", high=12)) == (0, 12)
    assert given.whole("SKIP", high=11) is None
    assert given.whole("NBITS", low=1) is None
    assert [fault.expected for fault in given.faults.found] == [
        "a whole number in 0..11",
        "a whole number in 1..10000000",
    ]


def test_infinite_pixels_and_long_numbers_are_no_data_or_told(tmp_path):
    rows = "1e39 -1e39\n1e400 -80\n"
    found = np.array(values(tmp_path, HEAD + rows))
    assert np.isnan(found).tolist() == [[True, True], [True, False]]
