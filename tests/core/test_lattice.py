"""The lattice: pixels and coordinates, row 0 in the north."""

from dataclasses import replace

import numpy as np
import pyproj
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.errors import InputError
from mapfilter.geodesy import project
from mapfilter.lattice import Lattice

CRS = "EPSG:32629"
LATTICE = Lattice(CRS, 531_000.0, 4_556_000.0, 5.0, 40, 50)
SIZES = st.integers(1, 60)
RESOLUTIONS = st.sampled_from([0.5, 1.0, 2.5, 5.0, 10.0, 25.0, 0.1, 1 / 3])


@st.composite
def lattices(draw):
    resolution = draw(RESOLUTIONS)
    west, north = draw(st.integers(-1000, 1000)), draw(st.integers(-1000, 1000))
    return Lattice(CRS, west * resolution, north * resolution, resolution, draw(SIZES), draw(SIZES))


@given(lattices())
def test_every_pixel_centre_lies_in_its_own_pixel(lattice):
    row, col = np.indices((lattice.rows, lattice.cols))
    east, north = lattice.east_north(row, col)
    again = lattice.row_col(east, north)
    assert np.array_equal(again[0], row)
    assert np.array_equal(again[1], col)
    assert lattice.contains(row, col).all()
    west, south, right, top = lattice.bounds_m
    assert ((east > west) & (east < right) & (north > south) & (north < top)).all()


@given(lattices(), st.floats(-2000, 2000), st.floats(-2000, 2000))
def test_a_position_is_at_most_half_a_pixel_from_its_centre(lattice, east, north):
    row, col = lattice.row_col(east, north)
    assert isinstance(row, int)
    assert isinstance(col, int)
    centre = lattice.east_north(row, col)
    half = lattice.resolution_m * (0.5 + 1e-6)
    assert abs(centre[0] - east) <= half
    assert abs(centre[1] - north) <= half


def test_row_zero_is_the_northern_edge_as_in_gdal():
    assert LATTICE.east_north(0, 0) == (531_002.5, 4_555_997.5)
    assert LATTICE.east_north(39, 49) == (531_247.5, 4_555_802.5)
    assert LATTICE.bounds_m == (531_000.0, 4_555_800.0, 531_250.0, 4_556_000.0)
    a, b, c, d, e, f = LATTICE.gdal_transform
    row, col = 7, 11
    corner = (a + col * b + row * c, d + col * e + row * f)
    assert corner == (531_055.0, 4_555_965.0)
    assert LATTICE.row_col(corner[0] + 0.01, corner[1] - 0.01) == (row, col)


def test_edges_belong_to_the_pixel_to_the_south_and_east():
    assert LATTICE.row_col(531_000.0, 4_556_000.0) == (0, 0)
    assert LATTICE.row_col(531_005.0, 4_555_995.0) == (1, 1)
    outside = LATTICE.row_col(
        np.array([530_999.9, 531_250.0, 531_000.0]), np.array([4_556_000.1, 4_555_999, 4_555_800.0])
    )
    assert not LATTICE.contains(*outside).any()
    assert [part.tolist() for part in outside] == [[-1, 0, 40], [-1, 50, 0]]


@given(
    st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(0.01, 500), st.floats(0.01, 500),
    RESOLUTIONS,
)  # fmt: skip
def test_covering_covers_snaps_and_is_not_larger_than_it_must_be(west, south, wide, high, res):
    lattice = Lattice.covering(CRS, (west, south, west + wide, south + high), res)
    left, bottom, right, top = lattice.bounds_m
    slack = 1e-6 * res
    assert left <= west + slack
    assert bottom <= south + slack
    assert right >= west + wide - slack
    assert top >= south + high - slack
    assert max(west - left, right - west - wide, south - bottom, top - south - high) < res + slack
    for edge in (left, top):
        assert edge / res == pytest.approx(round(edge / res), abs=1e-6)


def test_covering_of_neighbouring_areas_is_one_lattice():
    a = Lattice.covering(CRS, (1.0, 1.0, 12.0, 12.0), 5.0)
    b = Lattice.covering(CRS, (12.0, 1.0, 31.0, 12.0), 5.0)
    assert (a.bounds_m, b.bounds_m) == ((0.0, 0.0, 15.0, 15.0), (10.0, 0.0, 35.0, 15.0))
    assert Lattice.covering(CRS, a.bounds_m, 5.0) == a


@pytest.mark.parametrize(
    ("bounds", "resolution"),
    [
        ((0.0, 0.0, 10.0, 10.0), 0.0),
        ((0.0, 0.0, 10.0, 10.0), -5.0),
        ((0.0, 0.0, 10.0, 10.0), float("nan")),
        ((0.0, 0.0, float("nan"), 10.0), 5.0),
        ((0.0, 0.0, float("inf"), 10.0), 5.0),
        ((10.0, 0.0, 0.0, 10.0), 5.0),
        ((0.0, 0.0, 0.0, 10.0), 5.0),
    ],
)
def test_covering_nothing_is_told(bounds, resolution):
    with pytest.raises(InputError, match="lattice"):
        Lattice.covering(CRS, bounds, resolution)


def test_all_faults_of_a_lattice_come_together():
    with pytest.raises(InputError) as caught:
        Lattice(CRS, float("inf"), 0.0, float("nan"), 0, -3)
    assert [fault.where for fault in caught.value.faults] == [
        "lattice corner", "lattice resolution", "lattice size",
    ]  # fmt: skip


@given(lattices(), st.data())
def test_a_window_keeps_every_pixel_in_its_place(lattice, data):
    row = data.draw(st.integers(0, lattice.rows - 1))
    col = data.draw(st.integers(0, lattice.cols - 1))
    window = lattice.window(row, col, data.draw(SIZES), data.draw(SIZES))
    assert row + window.rows <= lattice.rows
    assert col + window.cols <= lattice.cols
    last = window.rows - 1, window.cols - 1
    for there in ((0, 0), last):
        here = there[0] + row, there[1] + col
        assert window.east_north(*there) == pytest.approx(lattice.east_north(*here))


def test_a_window_beyond_the_lattice_is_told():
    with pytest.raises(InputError, match="at least one pixel"):
        LATTICE.window(40, 0, 5, 5)
    with pytest.raises(InputError, match="at least one pixel"):
        LATTICE.window(-5, 0, 5, 5)


def test_a_window_that_begins_outside_is_clipped_as_one_that_ends_there():
    assert LATTICE.window(-2, -1, 4, 3) == LATTICE.window(0, 0, 2, 2)


@given(lattices(), st.integers(1, 70))
def test_tiles_cover_every_pixel_exactly_once_row_by_row(lattice, size):
    seen = np.zeros((lattice.rows, lattice.cols), dtype=int)
    tiles = lattice.tiles(size)
    for row, col, rows, cols in tiles:
        assert 1 <= rows <= size
        assert 1 <= cols <= size
        seen[row : row + rows, col : col + cols] += 1
        window = lattice.window(row, col, size, size)
        assert (window.rows, window.cols) == (rows, cols)
    assert (seen == 1).all()
    assert tiles == sorted(tiles)


def test_aligned_means_the_same_to_a_thousandth_of_a_pixel():
    assert LATTICE.aligned_with(LATTICE)
    assert LATTICE.aligned_with(replace(LATTICE, west_m=LATTICE.west_m + 0.004))
    assert not LATTICE.aligned_with(replace(LATTICE, crs="EPSG:32630"))
    for changed in (
        replace(LATTICE, west_m=LATTICE.west_m + 0.006),
        replace(LATTICE, north_m=LATTICE.north_m - 0.006),
        replace(LATTICE, north_m=LATTICE.north_m + 5.0),
        replace(LATTICE, resolution_m=5.0002),
        replace(LATTICE, rows=41),
        replace(LATTICE, cols=49),
        replace(LATTICE, rows=50, cols=40),
    ):
        assert not LATTICE.aligned_with(changed), changed
        assert not changed.aligned_with(LATTICE)
    assert LATTICE.aligned_with(replace(LATTICE, crs=pyproj.CRS(CRS).to_wkt()))


def test_a_lattice_in_words_names_its_crs_in_short():
    assert str(Lattice("EPSG:32635", 0.0, 0.0, 5.0, 300, 1000)) == (
        "300 x 1000 pixels of 5 m (5 x 1.5 km), EPSG:32635"
    )
    wkt = pyproj.CRS("+proj=tmerc +lon_0=9 +ellps=WGS84").to_wkt()
    assert str(Lattice(wkt, 0.0, 0.0, 5.0, 1, 1)).endswith(", unknown")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"crs": "EPSG:4326"}, r"^lattice crs: expected a projected CRS in metres, found WGS 84"),
        ({"crs": ""}, r"^lattice crs: expected a projected CRS in metres, found none"),
        (
            {"rows": 4.5},
            r"^lattice size: expected whole numbers of rows and columns, found 4.5 x 3",
        ),
        (
            {"cols": 3.0},
            r"^lattice size: expected whole numbers of rows and columns, found 2 x 3.0",
        ),
        ({"west_m": "500000"}, r"^lattice corner: expected finite metres, found \('500000', "),
        ({"north_m": None}, r"^lattice corner: expected finite metres, found \(500000.0, None\)"),
        ({"resolution_m": "5"}, r"^lattice resolution: expected metres > 0, found 5$"),
    ],
)
def test_what_is_no_lattice_is_refused(change, message):
    given = {
        "crs": "EPSG:32629", "west_m": 500000.0, "north_m": 4500010.0, "resolution_m": 5.0,
        "rows": 2, "cols": 3,
    }  # fmt: skip
    assert Lattice(**given | {"rows": np.int32(2), "west_m": np.float32(500000)}).rows == 2
    with pytest.raises(InputError, match=message):
        Lattice(**given | change)


def test_a_corner_may_be_as_project_returns_it():
    corner_m = project("EPSG:32629", -8.6, 41.1)
    lattice = Lattice("EPSG:32629", *corner_m, 5.0, 2, 3)
    assert lattice == Lattice("EPSG:32629", *map(float, corner_m), 5.0, 2, 3)
    assert lattice.east_north(0, 0) == (float(corner_m[0]) + 2.5, float(corner_m[1]) - 2.5)
    assert hash(lattice) == hash(Lattice("EPSG:32629", *map(float, corner_m), 5.0, 2, 3))


@pytest.mark.parametrize("unknown", [np.nan, np.inf, -np.inf])
def test_positions_that_are_none_lie_outside(unknown):
    lattice = Lattice("EPSG:32629", 500000.0, 4500010.0, 5.0, 2, 3)
    assert lattice.row_col(unknown, 4500009.0) == (0, -1)
    row, col = lattice.row_col([500001.0, unknown], [unknown, 4500001.0])
    assert (row.tolist(), col.tolist()) == ([-1, 1], [0, -1])
    assert lattice.contains(row, col).tolist() == [False, False]


def test_pixels_may_be_lists():
    lattice = Lattice("EPSG:32629", 500000.0, 4500010.0, 5.0, 2, 3)
    east_m, north_m = lattice.east_north([0, 1], [0, 2])
    assert (east_m.tolist(), north_m.tolist()) == ([500002.5, 500012.5], [4500007.5, 4500002.5])
    assert lattice.contains([0, 2], (0, 2)).tolist() == [True, False]


@pytest.mark.parametrize("given", [32629, "epsg:32629", pyproj.CRS(CRS)])
def test_a_crs_in_any_form_is_the_same_text(given):
    lattice = replace(LATTICE, crs=given)
    assert (lattice, hash(lattice), str(lattice)) == (LATTICE, hash(LATTICE), str(LATTICE))
    assert lattice.crs == CRS


def test_numbers_of_numpy_become_those_of_python():
    """As files of the database hold them, which know no others."""
    lattice = Lattice(
        CRS, np.float64(531_000), np.float64(4_556_000), np.float64(5), *np.array([40, 50])
    )
    assert lattice == LATTICE
    kinds = [type(getattr(lattice, name)) for name in ("west_m", "resolution_m", "rows", "cols")]
    assert kinds == [float, float, int, int]


@pytest.mark.parametrize("bounds", [(0, 0, 10), "west", None, (0, 0, 10, "north")])
def test_bounds_that_are_no_four_numbers_are_named(bounds):
    with pytest.raises(InputError, match=r"lattice: expected west, south, east, north in metres"):
        Lattice.covering(CRS, bounds, 5.0)


@pytest.mark.parametrize("resolution", ["5", None, np.inf, 0.0])
def test_a_resolution_that_is_no_number_is_named(resolution):
    with pytest.raises(InputError, match="lattice: expected finite bounds and a resolution > 0"):
        Lattice.covering(CRS, (0, 0, 10, 10), resolution)
