"""Indexes of rasters: which file is one, what its rows may say, and how they fit their rasters."""

from pathlib import Path

import numpy as np
import pytest
from raster_files import INDEX_HEADER, write_bil

from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import Lattice
from mapfilter.rasters.atoll import IndexRow, find_index, read_index
from mapfilter.rasters.plain_grids import GridHeader

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 6, 8)


def index(folder, text, name="index.txt"):
    path = folder / name
    path.write_text(text)
    return path


def test_an_index_without_its_columns_is_none(tmp_path):
    with pytest.raises(InputError) as caught:
        read_index(index(tmp_path, "TX_NAME;FILE\nA;a.bil\n"))
    assert "a column FILE_NAME" in str(caught.value)
    with pytest.raises(InputError) as caught:
        read_index(index(tmp_path, "TX_NAME;FILE_NAME;NBITS;NBITS\nA;none.bil;8;8\n"))
    assert "each column once" in str(caught.value)
    assert "none.bil" not in str(caught.value)
    with pytest.raises(InputError, match="a header without rows"):
        read_index(index(tmp_path, INDEX_HEADER))


def test_which_files_are_an_index(tmp_path):
    index(tmp_path, "\n\n" + INDEX_HEADER.lower(), "INDEX.TXT")
    for name in (".index.txt", "index.dat"):
        index(tmp_path, INDEX_HEADER, name)
    index(tmp_path, "TX_NAME\n" + INDEX_HEADER, "later.txt")
    (tmp_path / "folder.txt").mkdir()
    assert find_index(tmp_path) == tmp_path / "INDEX.TXT"


@pytest.mark.parametrize(
    ("area", "fits"),
    [
        ("385000;385040;6672970;6673000", True),
        ("385040;385040;6672970;6673000", False),
        ("385000;385040;6673000;6673000", False),
        ("385041;385040;6672970;6673000", False),
    ],
)
def test_an_area_has_a_width_and_a_height(tmp_path, area, fits):
    write_bil(tmp_path / "a.bil", LATTICE, np.full((6, 8), 100, np.int16))
    path = index(tmp_path, f"{INDEX_HEADER}A;a.bil;5;{area};16\n")
    if fits:
        (row,) = read_index(path)
        assert row.area_m == LATTICE.bounds_m
        assert (row.resolution_m, row.bits, row.cell_id) == (5.0, 16.0, "A")
        return
    with pytest.raises(InputError, match="XMIN < XMAX and YMIN < YMAX"):
        read_index(path)


@pytest.mark.parametrize("name", ["", ".", "..", "/a.bil", "a:b", "x/../a.bil"])
def test_names_that_lead_elsewhere_are_no_files(tmp_path, name):
    write_bil(tmp_path / "a.bil", LATTICE, np.full((6, 8), 100, np.int16))
    (tmp_path / "x").mkdir()
    (tmp_path / "a:b").write_bytes(b"there, but with a drive's colon")
    with pytest.raises(InputError) as caught:
        read_index(index(tmp_path, f"TX_NAME;FILE_NAME\nA;{name}\n"))
    assert "FILE_NAME: expected the name of a file" in str(caught.value)


def row(**changes):
    values = {"resolution_m": 5.0, "bits": 16.0, "area_m": LATTICE.bounds_m}
    return IndexRow("index row 2", "A", Path("a.bil"), **(values | changes))


def checked(**changes):
    faults = Faults()
    note = row(**changes).check(LATTICE, 16, faults)
    return note, [fault.where.rpartition(", ")[2] for fault in faults.found]


def moved(west=0.0, south=0.0, east=0.0, north=0.0):
    """Return the area with each edge moved by so many pixels."""
    edges = zip(LATTICE.bounds_m, (west, south, east, north), strict=True)
    return {"area_m": tuple(edge + 5.0 * shift for edge, shift in edges)}


def test_rows_of_an_index_against_the_rasters():
    assert checked() == ("", [])
    assert checked(**moved(0.009, -0.009, 0.009, -0.009)) == ("", [])
    assert checked(resolution_m=None, bits=None, area_m=None) == ("", [])
    assert checked(resolution_m=5.000004) == ("", [])
    assert checked(resolution_m=5.00001) == ("", ["RESOLUTION"])
    assert checked(bits=8.0) == ("", ["NBITS"])
    centres = "area limits are centres of pixels in the index"
    assert checked(**moved(0.5, 0.5, -0.5, -0.5)) == (centres, [])
    assert checked(**moved(0.5, 0.0, 0.5, 0.0)) == ("", ["area"])
    assert checked(**moved(0.0, 0.5, 0.0, 0.5)) == ("", ["area"])
    beyond = "rasters reach beyond their areas in the index"
    assert checked(**moved(1.0, 1.0, -1.0, -1.0)) == (beyond, [])
    assert checked(**moved(1.0, 2.0, 0.0, -0.02)) == (beyond, [])
    for edge in ({"west": -0.02}, {"south": -0.02}, {"east": 0.02}, {"north": 0.02}):
        assert checked(**moved(**edge)) == ("", ["area"])


def test_what_stands_in_for_a_header():
    header = row().header()
    assert header is not None
    assert GridHeader(*header).lattice(CRS, 6, 8) == LATTICE
    assert [float(header[1][key]) for key in ("NROWS", "NCOLS", "NBITS")] == [6, 8, 16]
    for missing in ("resolution_m", "bits", "area_m"):
        assert row(**{missing: None}).header() is None
