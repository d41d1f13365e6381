"""Which mistake explains positions elsewhere, and that beside a meridian a sign explains none."""

import numpy as np
import pytest

from mapfilter.errors import Faults
from mapfilter.geodesy import project, unproject
from mapfilter.lattice import Lattice
from mapfilter.tracks.checks.misplaced import check_near, degrees_for_metres, misplaced_by

CRS = "EPSG:32631"


def box(lon_deg, lat_deg):
    """An area of 2 km with its south-west corner there."""
    west_m, south_m = project(CRS, [lon_deg], [lat_deg])
    return Lattice(CRS, float(west_m[0]), float(south_m[0]) + 2000.0, 5.0, 400, 400)


GREENWICH, EQUATOR, LYON = box(0.02, 51.5), box(3.0, 0.02), box(4.8, 45.7)


@pytest.mark.parametrize("off_deg", [-0.06, -0.08, -0.1])
@pytest.mark.parametrize("of", ["longitude", "latitude"])
def test_beside_a_meridian_the_other_side_is_a_place_of_its_own(of, off_deg):
    lattice, lon_deg, lat_deg = GREENWICH, off_deg, 51.51
    if of == "latitude":
        lattice, lon_deg, lat_deg = EQUATOR, 3.01, off_deg
    east_m, north_m = project(CRS, [lon_deg], [lat_deg])
    assert misplaced_by(east_m, north_m, lattice) == ""
    faults = Faults()
    check_near("log", east_m, north_m, lattice, faults)
    assert str(faults.found[0]).endswith("(likely: log of another area or zone)")


@pytest.mark.parametrize(
    ("lon_deg", "lat_deg", "cause"),
    [
        (-4.81, 45.71, "a lost sign of longitude"),
        (4.81, -45.71, "a lost sign of latitude"),
        (45.71, 4.81, "latitude and longitude swapped"),
        (4.81, 47.0, ""),
    ],
)
def test_a_mistake_that_brings_positions_much_nearer_is_named(lon_deg, lat_deg, cause):
    east_m, north_m = project(CRS, [lon_deg], [lat_deg])
    assert misplaced_by(east_m, north_m, LYON) == cause
    assert degrees_for_metres(east_m, north_m, LYON) == ""


@pytest.mark.parametrize(
    ("stated", "named"), [("EPSG:32633", "EPSG:32633"), ("EPSG:25829", "EPSG:32629")]
)
def test_metres_of_another_zone_than_the_stated_one_are_named(stated, named):
    """They were those of a log of another area."""
    west_m, south_m, east_m, north_m = LYON.bounds_m
    lon_deg, lat_deg = unproject(stated, (west_m + east_m) / 2, (south_m + north_m) / 2)
    wrong = project(CRS, [lon_deg], [lat_deg])
    assert misplaced_by(*wrong, LYON) == f"a wrong CRS: {named} is stated for metres of {CRS}"
    elsewhere = project(CRS, [lon_deg], [lat_deg + 0.2])
    assert misplaced_by(*elsewhere, LYON) == ""


@pytest.mark.parametrize("scale", [1.0, 1e6, 1e7])
def test_degrees_are_no_metres(scale):
    given = degrees_for_metres(np.array([4.81]) * scale, np.array([45.71]) * scale, LYON)
    assert given.startswith("degrees")
    assert given.endswith("given for metres")


@pytest.mark.parametrize(
    ("east_m", "north_m", "is_near"),
    [
        (4990.0, 0.0, True),
        (-4990.0, 0.0, True),
        (0.0, 4990.0, True),
        (5010.0, 0.0, False),
        (0.0, 5010.0, False),
        (3600.0, 3600.0, False),
        (3500.0, 3500.0, True),
    ],
)
def test_positions_within_5_km_are_near(east_m, north_m, is_near):
    """Of an area of 2 km; 3500 and 3600 m to both sides are 4950 and 5091 m away."""
    lattice = Lattice(CRS, 500_000.0, 4_002_000.0, 5.0, 400, 400)
    east = 500_000.0 + np.array([3e4, east_m + 2000.0 * (east_m > 0)])
    north = 4_000_000.0 + np.array([9e4, north_m + 2000.0 * (north_m > 0)])
    faults = Faults()
    check_near("log.csv", east, north, lattice, faults, "another log")
    if is_near:
        assert faults.found == []
        return
    (fault,) = faults.found
    area = "500000..502000 m east, 4000000..4002000 m north"
    assert fault.expected == f"positions near the database's {area}"
    where = f"{east.min():.0f}..{east.max():.0f} m east, {north.min():.0f}..{north.max():.0f}"
    assert (fault.got, fault.hint) == (f"{where} m north", "another log")


def test_a_fault_names_the_mistake_that_explains_it():
    """Positions in the middle of Lyon whose longitude has lost its sign, and those of nowhere."""
    for lon_deg, hint in ((-4.81, "a lost sign of longitude"), (9.0, "another log")):
        east_m, north_m = project(CRS, [lon_deg, lon_deg], [45.705, 45.71])
        faults = Faults()
        check_near("log.csv", east_m, north_m, LYON, faults, "another log")
        assert [fault.hint for fault in faults.found] == [hint]
