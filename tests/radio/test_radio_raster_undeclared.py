"""Numbers that mean no data though a file does not state it."""

from pathlib import Path

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.rasters.undeclared import check_nodata_stated, nodata_taken_as_level

FILE = Path("plan.tif")


def test_zero_beside_levels_near_zero_is_a_level():
    near = np.float32([*np.linspace(-1, 0, 50), -40])
    assert nodata_taken_as_level(near) is None
    assert nodata_taken_as_level(np.zeros(5, np.float32)) == (0.0, 1.0)
    assert nodata_taken_as_level(np.float32([120, 0, 95, 0])) == (0.0, 0.5)


def test_a_number_at_the_bound_of_levels_is_none_that_means_no_data():
    assert nodata_taken_as_level(np.float32([-9999, 120, 95])) == (-9999.0, pytest.approx(1 / 3))
    # Among losses there is none of -300 dB.
    assert nodata_taken_as_level(np.float32([-9999, -300, 120, 95])) is None


def test_the_largest_number_of_a_type_far_above_all_others_means_no_data():
    losses = np.arange(70, 150, dtype=np.float32)
    for top in (255, 32767, 65535):
        found = nodata_taken_as_level(np.append(losses, np.float32([top] * 20)))
        assert found == (top, 0.2)
    tenths = np.float32(0.1) * np.append(10 * losses, np.float32([65535] * 20))
    assert nodata_taken_as_level(tenths, 0.1) == (pytest.approx(6553.5), 0.2)
    # Among numbers with decimals it is one that hardly a loss reaches, as any other.
    decimals = np.append(losses + 0.25, np.float32([255] * 20))
    assert nodata_taken_as_level(decimals) == (255, 0.2)
    # Cut off at 255, too few, or no limit of a type.
    cut_off = np.minimum(np.arange(70, 300, dtype=np.float32), 255)
    few = np.append(losses.repeat(10), np.float32([255]))
    other = np.append(losses, np.float32([200] * 20))
    for values in (cut_off, few, other):
        assert nodata_taken_as_level(values) is None


def test_a_number_that_hardly_a_level_reaches_means_no_data_far_from_all_others():
    levels = np.linspace(-130, -45, 400, dtype=np.float32)
    for number in (-1, 5, -200):
        found = nodata_taken_as_level(np.append(levels, np.float32([number] * 100)))
        assert found == (number, 0.2)
    # A hole of a few streets in a raster of a town.
    town = np.linspace(-130, -45, 40_000, dtype=np.float32)
    for number in (0, -1, -200):
        found = nodata_taken_as_level(np.append(town, np.float32([number] * 36)))
        assert found == (number, pytest.approx(36 / 40_036))
    lost = np.append(70 - town, np.float32([0] * 36))
    assert nodata_taken_as_level(lost) == (0, pytest.approx(36 / 40_036))
    # Too few, one that levels reach, near others, and cut off.
    few = np.append(levels, np.float32([-1] * 4))
    usual = np.append(levels, np.float32([-25] * 100))
    near = np.append(np.linspace(-130, -10, 400, dtype=np.float32), np.float32([-1] * 100))
    cut_off = np.minimum(np.linspace(-130, 20, 400, dtype=np.float32), -1)
    # The weakest that still is one.
    weak = np.append(np.linspace(-95, -45, 400, dtype=np.float32), np.float32([-120] * 100))
    for values in (few, usual, near, cut_off, weak):
        assert nodata_taken_as_level(values) is None


def test_a_hole_of_a_small_number_among_fewer_losses_makes_them_no_levels():
    values = np.append(np.linspace(70, 150, 30), np.full(40, 0.5)).astype(np.float32)
    assert nodata_taken_as_level(values) == (0.5, pytest.approx(4 / 7))


@pytest.mark.parametrize("times", [30, 31])
def test_more_than_ten_times_as_many_as_are_near_mean_no_data(times):
    """Three are near: within 1 dB of zero, and within 20 dB of any other number."""
    levels = np.linspace(-130, -45, 400, dtype=np.float32)
    for number, near in ((0, -0.5), (-1, -15)):
        values = np.concatenate([levels, np.full(3, near), np.full(times, number)])
        found = nodata_taken_as_level(values.astype(np.float32))
        assert found == (None if times == 30 else (number, pytest.approx(31 / 434)))


@pytest.mark.parametrize("marker", [0, -1, 1])
@pytest.mark.parametrize("place", [(0, 0), (0, 4), (2, 2), (4, 1)])
def test_a_single_marker_means_no_data_far_from_all_pixels_beside_it(marker, place):
    levels = np.full((5, 5), -80, np.float32)
    levels[place] = marker
    assert nodata_taken_as_level(levels) == (marker, 1 / 25)
    # A zero of so many pixels is told by all of them.
    near = None if marker else (0, 1 / 25)
    assert nodata_taken_as_level(np.float32(0.2) * levels, 0.2) == near
    assert nodata_taken_as_level(levels / 2, 0.5) == (marker / 2, 1 / 25)
    assert nodata_taken_as_level(levels.ravel()) == near


@pytest.mark.parametrize("row", range(-2, 3))
@pytest.mark.parametrize("col", range(-2, 3))
def test_one_pixel_near_a_marker_tells_that_it_is_a_level_if_it_lies_beside_it(row, col):
    levels = np.full((7, 7), -80, np.float32)
    levels[3, 3] = -1
    levels[3 + row, 3 + col] = -20.5
    if (row, col) == (0, 0):
        assert nodata_taken_as_level(levels) is None
        return
    beside = max(abs(row), abs(col)) == 1
    assert nodata_taken_as_level(levels) == (None if beside else (-1, pytest.approx(1 / 49)))


def test_a_hole_and_what_lies_beyond_the_edge_are_no_neighbours():
    levels = np.full((6, 6), np.nan, np.float32)
    levels[:, 3:] = -70
    levels[1:3, :4] = 0
    assert nodata_taken_as_level(levels) == (0, pytest.approx(8 / 24))
    alone = np.full((3, 3), np.nan, np.float32)
    alone[1, 1] = -1
    assert nodata_taken_as_level(alone) is None


def told(bands, quantity, factor=1.0):
    """The message of a refusal; "" where there is none."""
    names = [f"C{number}" for number in range(len(bands))]
    try:
        check_nodata_stated(np.float32(bands), names, quantity, factor, FILE)
    except InputError as error:
        return str(error)
    return ""


def band(usual, number, count):
    """A band of 2 500 pixels that lie 100 units apart at most, the last ones of one number."""
    values = np.linspace(usual, usual - 50, 2500)
    values[values.size - count :] = number
    return values.reshape(50, 50)


def test_markers_among_levels_are_refused_for_each_cell():
    said = told([band(-60, -1, 25), band(-60, -80, 25), band(-60, 0, 24)], "level")
    assert "plan.tif pixels, cell C0: expected a level, or no data, found -1 in 1% of the" in said
    assert "likely: -1 means no data, and the file does not state it; set nodata" in said
    assert "cell C1" not in said
    assert "cell C2: expected a level, or no data, found 0 in 24 pixels of a tile" in said
    assert told([band(-60, -1, 25) / 2], "level", 0.5).count("found -0.5 in 1%") == 1
    assert "likely: -1 means" in told([band(-60, -1, 25) / 2], "level", 0.5)


def test_a_single_marker_among_many_levels_is_refused():
    assert "cell C0: expected a level, or no data, found -1 in 1 pixel of" in told(
        [band(-60, -1, 1)], "level"
    )


@pytest.mark.parametrize("number", [-9999, -200, -20])
def test_what_no_cell_is_received_at_and_what_levels_reach_is_left(number):
    """The last is a level that is rare, but may be one."""
    assert told([band(-60, number, 100)], "level") == ""


def test_what_is_far_above_all_levels_is_left_to_other_checks():
    assert told([band(-60, 100, 100)], "level") == ""


def test_markers_among_losses_are_refused_where_they_look_like_small_ones():
    losses = 100 - band(-60, 0, 0)
    for number, part in ((0, 25), (-1, 25), (10, 25), (-9999, 25), (0, 3)):
        given = losses.copy()
        given[0, :part] = number
        expected = f"{number} in 1% of the pixels" if part == 25 else f"{number} in {part} pixels"
        assert f"expected a loss, or no data, found {expected} of a tile" in told([given], "loss")
    for number in (255, 20):
        given = losses.copy()
        given[0, :25] = number
        assert told([given], "loss") == ""


def test_other_quantities_have_no_such_numbers():
    assert told([100 - band(-60, 0, 25)], "deviation") == ""
