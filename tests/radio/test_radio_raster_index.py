"""Indexes of rasters: which file is one, what its rows may say, and how they fit their rasters."""

from pathlib import Path

import numpy as np
import pytest
from raster_files import INDEX_HEADER, write_bil

from mapfilter.errors import Faults, InputError
from mapfilter.lattice import Lattice
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


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-be", "cp1252"])
@pytest.mark.parametrize("first", ["", "sep=;\r\n"])
def test_an_index_saved_as_unicode_is_found(tmp_path, encoding, first):
    """As Excel saves "Unicode text": without it rasters had no header, or other names."""
    write_bil(tmp_path / "a.bil", LATTICE, np.full((6, 8), 100, np.int16))
    mark = "\ufeff" if encoding == "utf-16-be" else ""
    text = f"{mark}{first}{INDEX_HEADER}Köln;a.bil;5;385000;385040;6672970;6673000;16\n"
    (tmp_path / "index.txt").write_bytes(text.encode(encoding))
    assert find_index(tmp_path) == tmp_path / "index.txt"
    assert [row.cell_id for row in read_index(tmp_path / "index.txt")] == ["Köln"]


def test_names_with_the_folder_itself_are_those_of_its_files(tmp_path):
    write_bil(tmp_path / "a.bil", LATTICE, np.full((6, 8), 100, np.int16))
    rows = read_index(index(tmp_path, "TX_NAME;FILE_NAME\nA;.\\A.BIL\nB;./a.bil\n"))
    assert [row.path for row in rows] == [tmp_path / "a.bil"] * 2


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


@pytest.mark.parametrize("folder", ["C:\\Work\\losses\\", "losses\\", "/srv/losses/", "../losses/"])
def test_paths_of_another_computer_are_named_as_such(tmp_path, folder):
    write_bil(tmp_path / "a.bil", LATTICE, np.full((6, 8), 100, np.int16))
    path = index(tmp_path, f"TX_NAME;FILE_NAME\nA;{folder}A.BIL\nB;{folder}b.bil\n")
    with pytest.raises(InputError) as caught:
        read_index(path)
    first, second = caught.value.faults
    assert (
        first.hint == "a path of another computer; a.bil is beside the index: leave its name alone"
    )
    assert second.hint == "rasters moved elsewhere, or exported to another folder"


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


def test_a_hundredth_of_a_pixel_is_the_same_place():
    """At the origin edges are exact: a hundredth belongs to it, on each side of a limit."""
    lattice = Lattice(CRS, 0.0, 0.0, 1.0, 6, 8)

    def told(west, south, east, north):
        faults = Faults()
        area = (west, south - 6.0, east + 8.0, north)
        note = IndexRow("row 2", "A", Path("a.bil"), 1.0, None, area).check(lattice, 16, faults)
        return note, [(fault.got, fault.hint) for fault in faults.found]

    beyond = "rasters reach beyond their areas in the index"
    for edges in ((0.01, 0, 0, 0), (-0.01, 0, 0, 0), (0, 0, 0, 0.01), (0, 0, 0, -0.01)):
        assert told(*edges) == ("", [])
    assert told(0.012, 0, 0, 0) == told(0, 0, 0, -0.012) == (beyond, [])
    # A hundredth within a larger area is none without.
    assert told(1, 1, -1, 0.01) == told(-0.01, 1, -1, -1) == (beyond, [])
    for edges in ((-0.012, 1, -1, -1), (1, 1, -1, 0.012), (1, -0.012, -1, -1), (1, 1, 0.012, -1)):
        assert told(*edges)[1][0][1] == "index and rasters of different runs"
    centres = "area limits are centres of pixels in the index"
    assert told(0.505, 0.495, -0.505, -0.495) == (centres, [])
    assert told(0.515, 0.5, -0.5, -0.5) == (beyond, [])
    half = "half a pixel: a corner where the header has to hold the pixel's centre"
    runs = "index and rasters of different runs"
    for west, south, right, up, hint in (
        (0.5, 0.5, "-0.50", "-0.50", half),
        (-0.5, 0.004, "+0.50", "+0.00", half),
        (0.004, -0.5, "+0.00", "+0.50", half),
        (-0.506, 0.0, "+0.51", "+0.00", half),
        (0.0, 0.494, "+0.00", "-0.49", half),
        (0.5, 0.25, "-0.50", "-0.25", runs),
        (0.516, 0.0, "-0.52", "+0.00", runs),
        (1.0, 0.5, "-1.00", "-0.50", runs),
    ):
        note, faults = told(west, south, west, south)
        assert note == ""
        assert faults == [(f"a.bil shifted by {right} pixels east, {up} north", hint)]


def test_a_table_without_one_of_its_columns_is_no_index_of_a_folder(tmp_path):
    index(tmp_path, "TX_NAME;FILE\nA;a.bil\n")
    assert find_index(tmp_path) is None
    head = "TX_NAME;FILE_NAME".rjust(1 << 16)
    index(tmp_path, head + "\nA;a.bil\n")
    assert find_index(tmp_path) == tmp_path / "index.txt"
    index(tmp_path, " " + head + "\nA;a.bil\n")
    assert find_index(tmp_path) is None


def test_of_many_indexes_five_are_named(tmp_path):
    for n in range(7):
        index(tmp_path, INDEX_HEADER, f"i{n}.txt")
    with pytest.raises(InputError) as caught:
        find_index(tmp_path)
    (fault,) = caught.value.faults
    assert fault.got == "i0.txt, i1.txt, i2.txt, i3.txt, i4.txt"


def test_rows_are_checked_one_by_one(tmp_path):
    write_bil(tmp_path / "a.bil", LATTICE, np.full((6, 8), 100, np.int16))
    lines = [
        "A;a.bil;5;385000;385040;6672970;6673000;16",
        f"B;{'y' * 90};;;;;;",
        f"C;a.bil;{'x' * 90};;;;;",
        "D;a.bil;-5;;;;;",
        "A;a.bil;5;;;;;",
        "A;A.BIL;;;;;;",
        "E;a.bil;5;385000;385040;6672970;;16",
    ]
    with pytest.raises(InputError) as caught:
        read_index(index(tmp_path, INDEX_HEADER + "\n".join(lines)))
    found = [(fault.where.rpartition(" row ")[2], fault.got) for fault in caught.value.faults]
    first = f"{tmp_path / 'index.txt'} row 2"
    assert found == [
        ("3, FILE_NAME", repr("y" * 80)),
        ("4, RESOLUTION", repr("x" * 80)),
        ("5, RESOLUTION", "-5"),
        ("6, TX_NAME", f"'A', as in {first}"),
        ("7, TX_NAME", f"'A', as in {first}"),
    ]
    rows = read_index(index(tmp_path, INDEX_HEADER + "\n".join([lines[0], lines[-1]])))
    assert [row.path for row in rows] == [tmp_path / "a.bil"] * 2
    assert [row.where.rpartition(" ")[2] for row in rows] == ["2", "3"]
    assert (rows[0].area_m, rows[1].area_m) == (LATTICE.bounds_m, None)
