"""Line of sight over building heights."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.propagation.line_of_sight import line_of_sight, mean_roof_height, own_building

Heights = NDArray[np.float32]


def _lattice(rows: int, cols: int) -> Lattice:
    return Lattice("EPSG:32635", 0.0, 5.0 * rows, 5.0, rows, cols)


def _flat(rows: int, cols: int) -> tuple[Heights, Lattice]:
    return np.zeros((rows, cols), dtype=np.float32), _lattice(rows, cols)


@st.composite
def _towns(draw: st.DrawFn) -> tuple[Heights, Lattice]:
    rows, cols = draw(st.integers(3, 25)), draw(st.integers(3, 25))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    built = rng.random((rows, cols)) < 0.15
    return (built * rng.uniform(3, 40, (rows, cols))).astype(np.float32), _lattice(rows, cols)


def test_open_ground_is_seen_from_everywhere() -> None:
    heights, lattice = _flat(12, 17)
    assert line_of_sight(heights, lattice, (31.0, 22.0, 10.0), 1.5).all()


@pytest.mark.parametrize(("wall_m", "seen"), [(10.74, True), (10.76, False)])
def test_a_wall_half_way_blocks_above_the_middle_of_the_ray(wall_m: float, seen: bool) -> None:
    # From 20 m down to 1.5 m over 20 pixels the ray is at 10.75 m over the tenth.
    heights, lattice = _flat(1, 21)
    heights[0, 10] = wall_m
    view = line_of_sight(heights, lattice, (2.5, 2.5, 20.0), 1.5)[0]
    assert view[:10].all()
    assert not view[10:19].any()
    assert view[20] == seen


def test_a_wall_shades_what_lies_behind_it_and_nothing_else() -> None:
    heights, lattice = _flat(41, 41)
    heights[10:31, 25] = 30.0
    view = line_of_sight(heights, lattice, (*lattice.east_north(20, 10), 10.0), 1.5)
    assert view[:, :25].all()
    assert not view[20, 25:].any()
    assert view[0, 26]
    assert view[40, 26]


def test_the_own_roof_does_not_block_but_the_next_building_does() -> None:
    heights, lattice = _flat(1, 40)
    heights[0, 5:12] = 25.0
    antenna = (*lattice.east_north(0, 8), 20.0)
    assert line_of_sight(heights, lattice, antenna, 1.5)[0].all()
    heights[0, 20] = 25.0
    view = line_of_sight(heights, lattice, antenna, 1.5)[0]
    assert view[:20].all()
    assert not view[20:].any()


def test_another_wing_of_the_own_building_blocks_once_the_ray_has_left() -> None:
    heights, lattice = _flat(1, 30)
    heights[0, [3, 4, 8, 9]] = 15.0
    view = line_of_sight(heights, lattice, (*lattice.east_north(0, 3), 10.0), 1.5)[0]
    assert view[:8].all()
    assert not view[8:].any()


def test_an_antenna_outside_the_lattice() -> None:
    heights, lattice = _flat(9, 9)
    heights[:, 4] = 50.0
    view = line_of_sight(heights, lattice, (-500.0, 22.5, 30.0), 1.5)
    assert view[:, :4].all()
    assert not view[:, 4:].any()


@given(_towns(), st.floats(0.11, 0.89), st.floats(0.11, 0.89), st.floats(5, 60))
def test_higher_roofs_hide_and_higher_antennas_show(
    town: tuple[Heights, Lattice], x: float, y: float, height_m: float
) -> None:
    heights, lattice = town
    west, south, east, north = lattice.bounds_m
    place = (west + x * (east - west), south + y * (north - south))
    heights[lattice.row_col(*place)] = 0.0
    view = line_of_sight(heights, lattice, (*place, height_m), 1.5)
    higher = np.where(heights > 0, heights + 5, 0).astype(np.float32)
    assert not (line_of_sight(higher, lattice, (*place, height_m), 1.5) & ~view).any()
    assert not (view & ~line_of_sight(heights, lattice, (*place, height_m + 5), 1.5)).any()
    assert not view[heights > 1.5].any()


@given(_towns(), st.floats(5, 60))
def test_turning_the_world_turns_the_view(town: tuple[Heights, Lattice], height_m: float) -> None:
    heights, lattice = town
    rows, cols = heights.shape
    # Off every centre and edge, so that no ray runs along the border between two pixels.
    up_px, right_px = 0.5 * rows + 0.1234567, 0.5 * cols + 0.2345678
    view = line_of_sight(heights, lattice, (5 * right_px, 5 * up_px, height_m), 1.5)
    turned = np.ascontiguousarray(np.rot90(heights))
    # A quarter turn counter-clockwise: east becomes north, north becomes west.
    place = (5 * (rows - up_px), 5 * right_px, height_m)
    seen = line_of_sight(turned, _lattice(cols, rows), place, 1.5)
    np.testing.assert_array_equal(seen, np.rot90(view))


def test_own_building_is_the_connected_part() -> None:
    heights, lattice = _flat(5, 9)
    heights[1:4, 1:4] = 10.0
    heights[1:4, 6:8] = 12.0
    inside = own_building(heights, lattice, *lattice.east_north(2, 2))
    assert inside.sum() == 9
    assert inside[1:4, 1:4].all()
    assert not own_building(heights, lattice, *lattice.east_north(0, 0)).any()
    assert not own_building(heights, lattice, -1e4, 0.0).any()


def test_mean_roof_height_counts_roofs_only() -> None:
    heights, lattice = _flat(41, 41)
    heights[20, 20], heights[20, 22] = 10.0, 20.0
    mean = mean_roof_height(heights, lattice, 25.0, 15.0)
    assert mean[20, 21] == pytest.approx(15.0)
    assert mean[20, 16] == pytest.approx(10.0)
    assert mean[20, 25] == pytest.approx(15.0)
    assert mean[20, 27] == pytest.approx(20.0)
    assert mean[20, 28] == pytest.approx(15.0)
    assert (mean[:10] == 15.0).all()


@given(_towns())
def test_mean_roof_height_against_brute_force(town: tuple[Heights, Lattice]) -> None:
    heights, lattice = town
    mean = mean_roof_height(heights, lattice, 10.0, 7.0)
    for row in range(lattice.rows):
        for col in range(lattice.cols):
            near = heights[max(0, row - 2) : row + 3, max(0, col - 2) : col + 3]
            roofs = near[near > 0]
            expected = roofs.mean() if roofs.size else 7.0
            assert mean[row, col] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -1.0])
def test_heights_that_are_none(wrong: float) -> None:
    heights, lattice = _flat(3, 3)
    heights[1, 1] = wrong
    with pytest.raises(InputError, match="nodata not replaced"):
        line_of_sight(heights, lattice, (1.0, 1.0, 10.0), 1.5)
    with pytest.raises(InputError, match="3 x 3 pixels"):
        line_of_sight(heights[:2], lattice, (1.0, 1.0, 10.0), 1.5)
