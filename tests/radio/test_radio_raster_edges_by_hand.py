"""Limits of rasters by hand: numbers that mean no data, coinciding pixels, rows of an index."""

import math
from pathlib import Path

import numpy as np
import pytest
from raster_files import INDEX_HEADER

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.rasters.atoll import IndexRow, read_index
from mapfilter.rasters.resampling import _alike, _shift, read_on
from mapfilter.rasters.undeclared import check_nodata_stated, nodata_taken_as_level

CRS = "EPSG:32635"


def numbers(*parts):
    """Return values of (value, how many times)."""
    return np.concatenate([np.full(count, value, dtype=np.float32) for value, count in parts])


@pytest.mark.parametrize(
    ("values", "marker"),
    [
        # One number beyond all levels, alone or among levels; 50 may be a loss, as 70 may.
        ([70, 70], (70, 1)),
        ([70, 70, 50], None),
        ([70, 70, -50], (70, 2 / 3)),
        ([70, 71, -50], None),
        ([60, 60, -50], None),
        ([-301, -50], (-301, 0.5)),
        ([-300, -50], None),
        ([-301, 50, 70], (-301, 1 / 3)),
        ([-301, 0, 70], (-301, 1 / 3)),
        ([-301, -302, 70], None),
        # A hundredth of zeros, below or above all of which the others are.
        (numbers((-80, 99), (0, 1)), (0, 0.01)),
        (numbers((-80, 100), (0, 1)), None),
        ([0, 20, 100], (0, 1 / 3)),
        ([0, 19.9, 100], None),
        # Ten times as many as come near them.
        (numbers((-80, 50), (0, 11), (-0.5, 1)), (0, 11 / 62)),
        (numbers((-80, 50), (0, 10), (-0.5, 1)), None),
        (numbers((-80, 50), (0, 10), (-1, 1)), (0, 10 / 61)),
        # The largest of a type, 20 dB above all others.
        ([255, 255, 235, 100], (255, 0.5)),
        ([255, 255, 236, 100], None),
        (numbers((255, 1), (100, 99)), (255, 0.01)),
        (numbers((255, 1), (100, 100)), None),
        ([32_767, 100], (32_767, 0.5)),
        ([65_535, 100], (65_535, 0.5)),
        ([255, 255], (255, 1)),
        # Whole numbers to a thousandth, and a millionth of themselves.
        ([255, 255, 100.0005], (255, 2 / 3)),
        ([255, 255, 100.0015], None),
        ([65_535, 65_535, 20_000.0195], (65_535, 2 / 3)),
        ([65_535, 65_535, 20_000.0235], None),
    ],
)
def test_one_number_beyond_all_levels(values, marker):
    found = nodata_taken_as_level(np.float32(values))
    assert found == (None if marker is None else pytest.approx(marker))


@pytest.mark.parametrize("factor", [0.1, 0.5, 2.0])
def test_the_largest_of_a_type_is_one_as_stored(factor):
    stored = np.float32([65_535, 65_535, 1000])
    marker = pytest.approx((65_535 * factor, 2 / 3))
    assert nodata_taken_as_level(stored * np.float32(factor), factor) == marker
    assert nodata_taken_as_level(stored * np.float32(factor)) is None


@pytest.mark.parametrize(
    ("usual", "number", "count", "near", "is_marker"),
    [
        # Levels beyond -20 and -140 dBm, losses beyond 20 and 200 dB.
        (-80, -19.9, 20, 0, True),
        (-80, -20.1, 20, 0, False),
        (-100, -140.1, 20, 0, True),
        (-100, -139.9, 20, 0, False),
        (150, 19.9, 20, 0, True),
        (150, 20.1, 20, 0, False),
        (150, 200.1, 20, 0, True),
        (150, 199.9, 20, 0, False),
        # In 20 pixels or more, ten times as many as lie within 20 dB.
        (-80, -10, 19, 0, False),
        (-80, -10, 20, 1, True),
        (-80, -10, 20, 2, False),
        (-80, -10, 21, 2, True),
    ],
)
def test_a_number_far_from_all_others(usual, number, count, near, is_marker):
    beside = number + math.copysign(19.9, usual - number)
    values = numbers((usual, 100), (number, count), (beside, near))
    found = nodata_taken_as_level(values)
    share = count / len(values)
    assert found == (pytest.approx((number, share)) if is_marker else None)
    # 20 dB from it is far.
    beside = number + math.copysign(20.0, usual - number)
    if abs(usual - number) > 20 and is_marker:
        values = numbers((usual, 100), (number, count), (beside, 50))
        assert nodata_taken_as_level(values) == pytest.approx((number, count / len(values)))


@pytest.mark.parametrize(
    ("values", "factor", "marker"),
    [
        # A stored 0, -1 or 1, 20 dB or more from the pixels beside it.
        ([[-21, -80], [-80, -1]], 1.0, (-1, 0.25)),
        ([[-20.9, -80], [-80, -1]], 1.0, None),
        ([[-80, -80], [-80, 1]], 1.0, (1, 0.25)),
        ([[-80, -80], [-80, 2]], 1.0, None),
        ([[-80, -80], [-80, -0.1]], 0.1, (-0.1, 0.25)),
        ([[-80, np.nan], [np.nan, -1]], 1.0, (-1, 0.5)),
        ([[np.nan, -1], [np.nan, -1]], 1.0, None),
        # Pixels two away are not beside it.
        ([[-1, -80, -5]], 1.0, (-1, 1 / 3)),
        ([[-5], [-80], [-1]], 1.0, (-1, 1 / 3)),
        ([[-1, -5, -80]], 1.0, None),
    ],
)
def test_a_hole_of_one_pixel(values, factor, marker):
    found = nodata_taken_as_level(np.float32(values), factor)
    assert found == (None if marker is None else pytest.approx(marker))


@pytest.mark.parametrize(
    ("west_m", "north_m", "side_m", "shift"),
    [
        # The source's corner is 3 pixels east and 2 south of that of the target, to 1/1000.
        (3.0, -2.0, 1.0, (2, 3)),
        (0.001, 0.0, 1.0, (0, 0)),
        (0.0, -0.001, 1.0, (0, 0)),
        (0.0011, 0.0, 1.0, None),
        (0.0, 0.0011, 1.0, None),
        (0.5, 0.5, 1.0, None),
        # Pixels of ten rows that differ by 1/1000 in all.
        (0.0, 0.0, 1.00009, (0, 0)),
        (0.0, 0.0, 0.99991, (0, 0)),
        (0.0, 0.0, 1.00011, None),
    ],
)
def test_pixels_that_coincide(west_m, north_m, side_m, shift):
    target = Lattice(CRS, 0.0, 0.0, 1.0, 20, 20)
    for rows, cols in ((10, 5), (5, 10)):
        assert _shift(Lattice(CRS, west_m, north_m, side_m, rows, cols), target) == shift


def test_resolutions_that_are_alike():
    assert _alike(5.0, 5.0)
    assert _alike(5.0, 5.0000049)
    assert _alike(5.0000049, 5.0)
    assert not _alike(5.0, 5.0000051)
    assert not _alike(5.0000051, 5.0)


class Ramp:
    """A raster file of pixels of 10 m that have their column's number, in all rows."""

    lattice = Lattice(CRS, 0.0, 0.0, 10.0, 4, 4)

    def read(self, bands, window):
        _, col, rows, cols = window
        values = np.arange(col, col + cols, dtype=np.float32)
        return np.broadcast_to(values, (len(bands), rows, cols))


@pytest.mark.parametrize(
    ("before_px", "column"), [(0.0, 1), (0.8e-6, 1), (1.5e-6, 0), (-1e-6, 1), (0.5, 0)]
)
def test_a_centre_on_an_edge_is_of_the_later_pixel(before_px, column):
    """To a millionth of a pixel: one of 4 m whose centre is so far before 10 m."""
    west_m = 8.0 - 10.0 * before_px
    lattice = Lattice(CRS, west_m, 0.0, 4.0, 1, 1)
    values = read_on(Ramp(), [0], lattice, (0, 0, 1, 1), "nearest")
    assert values.tolist() == [[[column]]]


@pytest.mark.parametrize(
    ("east_m", "value"),
    # The centres of the first pixels are at 5, 15 and 25 m; before the first there is none.
    [(5.0, 0.0), (10.0, 0.5), (12.5, 0.75), (22.0, 1.7), (1.0, 0.0), (39.0, 3.0), (41.0, np.nan)],
)
def test_between_two_centres_by_their_distance(east_m, value):
    lattice = Lattice(CRS, east_m - 2.0, -4.0, 4.0, 1, 1)
    values = read_on(Ramp(), [0], lattice, (0, 0, 1, 1), "bilinear")
    assert values.tolist() == [[[pytest.approx(value, nan_ok=True)]]]


def test_every_fault_of_a_row_of_an_index_is_told_at_once(tmp_path):
    """A row without its raster, or without a name, hid what else was wrong with it."""
    path = tmp_path / "index.txt"
    path.write_text(f"{INDEX_HEADER};none.bil;-5;10;5;0;x;16\n")
    with pytest.raises(InputError) as caught:
        read_index(path)
    places = [fault.where.partition(" row 2, ")[2] for fault in caught.value.faults]
    assert places == ["TX_NAME", "FILE_NAME", "AREA_YMAX", "RESOLUTION"]
    path.write_text(f"{INDEX_HEADER}A;none.bil;0;5;5;0;9;16\n")
    with pytest.raises(InputError) as caught:
        read_index(path)
    places = [fault.where.partition(" row 2, ")[2] for fault in caught.value.faults]
    assert places == ["FILE_NAME", "area", "RESOLUTION"]
    # Rows without a name are not those of one cell.
    (tmp_path / "a.bil").touch()
    path.write_text(INDEX_HEADER + 2 * ";a.bil;5;0;5;0;5;16\n")
    with pytest.raises(InputError) as caught:
        read_index(path)
    assert [fault.where[-7:] for fault in caught.value.faults] == ["TX_NAME", "TX_NAME"]


ROW = IndexRow("index.txt row 2", "A", None, 5.0, 16.0, (0.0, 0.0, 40.0, 30.0))


def test_the_header_that_an_index_gives():
    """Of 6 rows and 8 columns of 5 m; the first pixel's centre is 2.5 m within its corner."""
    where, values = ROW.header()
    assert where == "index.txt row 2"
    assert {name: float(value) for name, value in values.items()} == {
        "NROWS": 6,
        "NCOLS": 8,
        "NBITS": 16,
        "XDIM": 5,
        "YDIM": 5,
        "ULXMAP": 2.5,
        "ULYMAP": 27.5,
    }


@pytest.mark.parametrize(
    ("quantity", "usual", "marker", "is_refused"),
    [
        # What would be the strongest level or the least loss; deviations may have any number.
        ("level", -80, -1, True),
        ("level", -100, -200, False),
        ("loss", 120, 0, True),
        ("loss", 120, 255, False),
        ("deviation", 6, 0, False),
        ("deviation", 120, 0, False),
    ],
)
def test_markers_that_would_be_strong_levels(quantity, usual, marker, is_refused):
    band = np.full((20, 20), usual, dtype=np.float32)
    band[:2] = marker
    try:
        check_nodata_stated(band[None], ["A"], quantity, 1.0, Path("a.bil"))
    except InputError as error:
        assert is_refused
        (fault,) = error.faults
        assert fault.where == "a.bil pixels, cell A"
        assert fault.got == f"{marker:g} in 10% of the pixels of a tile"
    else:
        assert not is_refused
