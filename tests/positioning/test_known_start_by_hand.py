"""Where a known start may lie, to the metre, and what is said of one that lies elsewhere."""

from fractions import Fraction

import numpy as np
import pytest

from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import unproject
from mapfilter.lattice import Lattice
from mapfilter.positioning.known_start import check_place, check_start

WEST_M, NORTH_M = 385_000.0, 6_672_000.0
AREA = Lattice("EPSG:32635", WEST_M, NORTH_M, 10.0, 30, 50)
"""500 m by 300 m in Helsinki."""
EAST_M, SOUTH_M = WEST_M + 500.0, NORTH_M - 300.0


def fault(east_m, north_m, sd_m):
    """Return the only fault of a start, as text; "" for none."""
    faults = Faults()
    check_place("start", east_m, north_m, sd_m, AREA, faults, "the place")
    return "\n".join(map(str, faults.found))


@pytest.mark.parametrize(("sd_m", "reach_m"), [(0.0, 500.0), (100.0, 500.0), (100.4, 502.0)])
def test_a_start_lies_up_to_500_m_or_five_deviations_outside(sd_m, reach_m):
    for side in (-1, 1):
        # Three to four to five, from a corner.
        east_m = (WEST_M if side < 0 else EAST_M) + side * 0.6 * reach_m
        north_m = (SOUTH_M if side < 0 else NORTH_M) + side * 0.8 * reach_m
        assert fault(east_m - side, north_m - side, sd_m) == ""
        assert f"or at most {reach_m:.0f} m outside" in fault(east_m + side, north_m + side, sd_m)
    assert fault(WEST_M - reach_m, NORTH_M, sd_m) == ""


def test_what_is_said_of_a_start_elsewhere():
    lon_deg, lat_deg = unproject(
        AREA.crs, [WEST_M, WEST_M, EAST_M, EAST_M], [SOUTH_M, NORTH_M, SOUTH_M, NORTH_M]
    )
    box = (
        f"latitude {min(lat_deg):.4f} to {max(lat_deg):.4f}, "
        f"longitude {min(lon_deg):.4f} to {max(lon_deg):.4f}"
    )
    assert fault(EAST_M + 1260.0, NORTH_M, 5.0) == (
        f"start: expected a place in the area ({box}), or at most 500 m outside, "
        "found the place, 1.3 km outside (likely: a position of another area or zone)"
    )
    # Two tenths of a degree wide and high it is not.
    assert lat_deg.max() - lat_deg.min() < 0.01
    assert lon_deg.max() - lon_deg.min() < 0.01


def test_a_start_is_shown_as_it_was_given():
    with pytest.raises(InputError) as caught:
        check_start(EAST_M + 1260.125, NORTH_M, 5, AREA)
    assert "found 386760.125 m east, 6672000 m north, 1.3 km outside" in str(caught.value)


@pytest.mark.parametrize("number", [int, float, np.int64, np.float32, np.float64])
def test_numbers_of_any_kind_are_a_start(number):
    check_start(number(EAST_M), number(NORTH_M), number(7), AREA)


@pytest.mark.parametrize(
    "wrong", [True, np.True_, "385000", None, np.nan, np.inf, [1.0], np.ones(1), 1j, Fraction(1, 2)]
)
def test_all_that_is_no_number_is_told_together(wrong):
    with pytest.raises(InputError) as caught:
        check_start(wrong, wrong, wrong, AREA)
    assert [one.where for one in caught.value.faults] == [
        "start, east_m", "start, north_m", "start, sd_m",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("start", "where"),
    [
        ((1.0001e8, NORTH_M, 5.0), "start, east_m"),
        ((-1.0001e8, NORTH_M, 5.0), "start, east_m"),
        ((EAST_M, 1.0001e8, 5.0), "start, north_m"),
        ((EAST_M, -1.0001e8, 5.0), "start, north_m"),
        ((EAST_M, NORTH_M, 100_001.0), "start, sd_m"),
        ((EAST_M, NORTH_M, -1e-9), "start, sd_m"),
    ],
)
def test_numbers_beyond_the_earth_are_refused_by_name(start, where):
    with pytest.raises(InputError) as caught:
        check_start(*start, AREA)
    assert [one.where for one in caught.value.faults] == [where]


def test_the_largest_numbers_are_places_elsewhere():
    for east_m, north_m in [(1e8, NORTH_M), (-1e8, NORTH_M), (EAST_M, 1e8), (EAST_M, -1e8)]:
        with pytest.raises(InputError) as caught:
            check_start(east_m, north_m, 5.0, AREA)
        assert [one.where for one in caught.value.faults] == ["start"]
    check_start(EAST_M, NORTH_M, 100_000.0, AREA)
    check_start(EAST_M, NORTH_M, 0.0, AREA)
