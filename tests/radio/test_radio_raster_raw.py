"""Raw pixels: what a header without a line means, and where the pixels begin."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.rasters.files import Declared
from mapfilter.rasters.raw_grids import open_raw_grid

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 3, 4)
PLACE = "NROWS 3\nNCOLS 4\nULXMAP 385002.5\nULYMAP 6672997.5\nXDIM 5\nYDIM 5\n"
VALUES = np.arange(12).reshape(3, 4) + 60


def raw(folder, data, header, suffix=".bil", **declared):
    path = folder / f"a{suffix}"
    path.write_bytes(data)
    path.with_suffix(".hdr").write_text(PLACE + header)
    return open_raw_grid(path, "A", Declared(crs=CRS, **declared))


def faults(*arguments, **options):
    with pytest.raises(InputError) as caught:
        raw(*arguments, **options)
    return [(fault.where.rpartition("/")[2], fault.expected, fault.got)
            for fault in caught.value.faults]  # fmt: skip


@pytest.mark.parametrize(
    ("header", "suffix", "dtype"),
    [
        ("", ".bil", "u1"),
        ("", ".flt", "<f4"),
        ("", ".FLT", "<f4"),
        ("NBITS 8\n", ".flt", "u1"),
        ("NBITS 16\n", ".bil", "<i2"),
        ("NBITS 32\n", ".bil", "<f4"),
        ("NBITS 64\n", ".bil", "<f8"),
        ("NBITS 8\nPIXELTYPE SIGNEDINT\n", ".bil", "i1"),
        ("NBITS 8\nPIXELTYPE signed\n", ".bil", "i1"),
        ("NBITS 16\nPIXELTYPE unsigned\n", ".bil", "<u2"),
        ("NBITS 32\nPIXELTYPE SIGNEDINT\n", ".bil", "<i4"),
        ("NBITS 32\nPIXELTYPE UNSIGNEDINT\nBYTEORDER m\n", ".bil", ">u4"),
        ("NBITS 16\nBYTEORDER MSBFIRST\n", ".bil", ">i2"),
        ("NBITS 16\nBYTEORDER lsbfirst\n", ".bil", "<i2"),
        ("PIXELTYPE FLOAT\nBYTEORDER M\n", ".flt", ">f4"),
    ],
)
def test_types_of_pixels(tmp_path, header, suffix, dtype):
    grid = raw(tmp_path, VALUES.astype(dtype).tobytes(), header, suffix)
    assert (grid.lattice, grid.cell_ids, grid.nodata) == (LATTICE, ("A",), ())
    assert (grid.bits, grid.skip_bytes) == (8 * np.dtype(dtype).itemsize, 0)
    np.testing.assert_array_equal(grid.read([0], (0, 0, 3, 4))[0], VALUES)
    np.testing.assert_array_equal(grid.read([0, 0], (1, 1, 2, 3))[1], VALUES[1:, 1:])
    assert grid.parts == (tmp_path / f"a{suffix}", tmp_path / "a.hdr")


def test_types_that_are_none(tmp_path):
    kinds = "NBITS 8, 16 or 32, and PIXELTYPE SIGNEDINT, UNSIGNEDINT or FLOAT"
    long, order = "C" * 30, "Q" * 30
    assert faults(tmp_path, b"", f"NBITS 24\nPIXELTYPE {long}\n")[0] == (
        "a.hdr", kinds, f"24 and {long[:20]}")  # fmt: skip
    assert faults(tmp_path, b"", f"BYTEORDER {order}\n")[0] == (
        "a.hdr, BYTEORDER", "I or M", repr(order[:20]))  # fmt: skip
    assert faults(tmp_path, b"", "NBITS 16\nPIXELTYPE FLOAT\n")[0] == (
        "a.hdr", kinds, "16 and FLOAT")  # fmt: skip
    # A number of bits that is none is told once.
    (fault,) = faults(tmp_path, b"", "NBITS 8.5\n")
    assert fault[0] == "a.hdr, NBITS"


@pytest.mark.parametrize("skip", [0, 3, 1 << 20])
def test_pixels_begin_after_what_is_skipped(tmp_path, skip):
    data = b"\1" * skip + VALUES.astype("<i2").tobytes()
    grid = raw(tmp_path, data, f"NBITS 16\nSKIPBYTES {skip}\n")
    np.testing.assert_array_equal(grid.read([0], (0, 0, 3, 4))[0], VALUES)
    for wrong in (data[:-1], data + b"\1"):
        told = faults(tmp_path, wrong, f"NBITS 16\nSKIPBYTES {skip}\n")
        assert told == [("a.bil", f"{skip + 24} bytes for 3 rows of 8", f"{len(wrong)} bytes")]


def test_a_mebibyte_is_skipped_at_most(tmp_path):
    data = b"\1" * ((1 << 20) + 1) + VALUES.astype("u1").tobytes()
    told = faults(tmp_path, data, f"SKIPBYTES {(1 << 20) + 1}\n")
    assert told == [("a.hdr, SKIPBYTES", "at most 1048576", str((1 << 20) + 1))]


def test_numbers_that_mean_no_data_are_the_given_one_and_the_header_s(tmp_path):
    data = VALUES.astype("u1").tobytes()
    grid = raw(tmp_path, data, "NODATA 61\nNODATA_VALUE 62\n", nodata=63.0)
    assert grid.nodata == (63.0, 61.0)
    found = grid.read([0], (0, 0, 3, 4))[0]
    assert np.flatnonzero(np.isnan(found)).tolist() == [1, 3]
    assert raw(tmp_path, data, "NODATA_VALUE 62\n").nodata == (62.0,)
    assert raw(tmp_path, data, "", nodata=0.0).nodata == (0.0,)
    of_nan = raw(tmp_path, data, "NODATA nan\n", nodata=61.0).read([0], (0, 0, 3, 4))[0]
    assert np.flatnonzero(np.isnan(of_nan)).tolist() == [1]
    assert faults(tmp_path, data, "NODATA x\n")[0][:2] == ("a.hdr, NODATA", "a number")


def test_a_header_stands_before_an_index_that_places_the_pixels(tmp_path):
    row = {"NROWS": "3", "NCOLS": "4", "NBITS": "16", "XDIM": "5", "YDIM": "5",
           "ULXMAP": "385002.5", "ULYMAP": "6672997.5"}  # fmt: skip
    data = VALUES.astype(">i2").tobytes()
    path = tmp_path / "a.bil"
    path.write_bytes(data)
    declared = Declared(crs=CRS, header=("index row 2", row))
    path.with_suffix(".hdr").write_text("BYTEORDER M\n")
    grid = open_raw_grid(path, "A", declared)
    assert grid.lattice == LATTICE
    np.testing.assert_array_equal(grid.read([0], (0, 0, 3, 4))[0], VALUES)
    assert grid.parts == (path, tmp_path / "a.hdr")
    path.with_suffix(".hdr").write_text(PLACE.replace("385002.5", "385012.5") + "NBITS 16\n")
    assert open_raw_grid(path, "A", declared).lattice.west_m == 385010.0
    path.with_suffix(".hdr").unlink()
    path.write_bytes(VALUES.astype("<i2").tobytes())
    grid = open_raw_grid(path, "A", declared)
    np.testing.assert_array_equal(grid.read([0], (0, 0, 3, 4))[0], VALUES)
    assert grid.parts == (path,)
    with pytest.raises(InputError, match=r"a\.hdr: expected a readable file"):
        open_raw_grid(path, "A", Declared(crs=CRS))


@pytest.mark.parametrize("missing", ["NROWS", "NCOLS"])
def test_lines_that_are_missing_are_named(tmp_path, missing):
    path = tmp_path / "a.bil"
    path.write_bytes(VALUES.astype("u1").tobytes())
    lines = [line for line in PLACE.splitlines() if not line.startswith(missing)]
    path.with_suffix(".hdr").write_text("\n".join(lines))
    with pytest.raises(InputError) as caught:
        open_raw_grid(path, "A", Declared(crs=CRS))
    (fault,) = caught.value.faults
    assert (fault.expected, fault.got, fault.hint) == (
        f"a line {missing}", "none", "a header that is cut off")  # fmt: skip


def test_the_crs_file_belongs_to_the_raster(tmp_path):
    raw(tmp_path, VALUES.astype("u1").tobytes(), "")
    crs_file = tmp_path / "a.prj"
    crs_file.write_text("EPSG:32635")
    grid = open_raw_grid(tmp_path / "a.bil", "A", Declared())
    assert grid.lattice == LATTICE
    assert grid.parts == (tmp_path / "a.bil", tmp_path / "a.hdr", crs_file)


def test_a_header_of_envi_is_named_as_that(tmp_path):
    path = tmp_path / "a.bil"
    path.write_bytes(VALUES.astype("u1").tobytes())
    path.with_suffix(".hdr").write_text("ENVI\nsamples = 4\nlines = 3\ndata type = 1\n")
    with pytest.raises(InputError, match=r"a\.hdr: .* found ENVI .*gdal_translate") as caught:
        open_raw_grid(path, "A", Declared())
    assert len(caught.value.faults) == 1


@pytest.mark.parametrize("given", ["4.5", "-4", "wide"])
def test_a_length_of_rows_that_is_none_is_told_once(tmp_path, given):
    (fault,) = faults(tmp_path, bytes(12), f"TOTALROWBYTES {given}\n")
    assert fault[0] == "a.hdr, TOTALROWBYTES"
    assert given in fault[2]


def test_rows_as_long_as_their_pixels_or_longer(tmp_path):
    assert raw(tmp_path, bytes(12), "TOTALROWBYTES 4\n").row_bytes == 4
    assert raw(tmp_path, bytes(14), "TOTALROWBYTES 5\n").row_bytes == 5
    for given in (3, 0):
        found = faults(tmp_path, bytes(12), f"TOTALROWBYTES {given}\n")
        least = "at least 4 for 4 pixels of 8 bits"
        assert found[0] == ("a.hdr, TOTALROWBYTES", least, str(given))
