"""Compound systems, and places at which coordinates of a system mean nothing."""

import numpy as np
import pytest
from pyproj import CRS

from mapfilter._crs_reach import likely_mistake, project_within, zone_hint
from mapfilter.errors import InputError
from mapfilter.geodesy import project, projected_crs, same_crs, shown_crs

FLAT = "EPSG:25832"


@pytest.mark.parametrize(
    "spec",
    [
        "EPSG:25832+7837",
        "EPSG:5555",
        CRS("EPSG:25832+5773").to_wkt(),
        CRS("EPSG:25832").to_3d().to_wkt(),
    ],
)
def test_heights_of_a_compound_system_are_left_out(spec):
    assert projected_crs(spec) == FLAT
    assert same_crs(CRS(spec).to_wkt(), FLAT)


def test_degrees_with_heights_are_degrees():
    with pytest.raises(InputError, match=r"a projected CRS in metres, found WGS 84 \("):
        projected_crs("EPSG:4326+5773")


def test_a_nameless_system_is_shown_by_its_text():
    text = projected_crs("+proj=tmerc +lat_0=60 +lon_0=25 +datum=WGS84 +units=m")
    assert shown_crs(text).startswith("'PROJCRS[")
    assert len(shown_crs(text)) < 80
    assert shown_crs(CRS(FLAT).to_wkt()) == "ETRS89 / UTM zone 32N"


@pytest.mark.parametrize(
    ("crs", "lon_deg", "beyond"),
    [
        # Norway has one zone for its mainland, and Finland one for all of it.
        ("EPSG:25833", [4.5, 31.2], False),
        ("EPSG:3067", [19.5, 31.6], False),
        ("EPSG:32632", [70.0, 100.0, -52.0, -171.0], True),
        ("EPSG:2393", [-40.0, 100.0, -153.0], True),
        ("EPSG:31467", [70.0, -60.0, 179.0], True),
        ("EPSG:2154", [110.0, -110.0, -177.0], True),
        ("EPSG:32601", [179.9, -179.9, 171.0], False),
        ("EPSG:3857", [-179.0, 0.0, 179.0], False),
        ("+proj=utm +zone=32 +datum=WGS84", [9.0, 20.0], False),
        ("+proj=utm +zone=32 +datum=WGS84", [80.0, -60.0], True),
    ],
)
def test_coordinates_far_from_the_area_of_a_system(crs, lon_deg, beyond):
    lat_deg = np.full(len(lon_deg), 60.0)
    assert project_within(crs, lon_deg, lat_deg)[2].tolist() == [beyond] * len(lon_deg)


def test_the_own_hemisphere_is_no_matter_and_infinity_is():
    east_m, north_m, beyond = project_within("EPSG:32633", [15.0, 105.0, np.nan], [-10.0, 0.0, 0.0])
    assert beyond.tolist() == [False, True, True]
    assert (east_m[0], north_m[0]) == project("EPSG:32633", 15.0, -10.0)


@pytest.mark.parametrize("crs", ["EPSG:32635", "+proj=tmerc +lon_0=27 +datum=WGS84"])
@pytest.mark.parametrize(
    ("lon_deg", "lat_deg", "mistake"),
    [
        (60.2, 25.0, "latitude and longitude swapped"),
        (-25.0, 60.2, "a lost sign of longitude"),
        (-100.0, 20.0, "at that place it is EPSG:32614"),
    ],
)
def test_the_mistake_that_puts_a_place_beyond_is_named(crs, lon_deg, lat_deg, mistake):
    assert likely_mistake(crs, lon_deg, lat_deg).endswith(mistake)


def test_one_hemisphere_of_a_zone_tells_a_lost_sign():
    swapped = "latitude and longitude swapped"
    assert likely_mistake("EPSG:32635", -60.2, 25.0) == f"{swapped}, with a lost sign"
    assert likely_mistake("EPSG:32735", -60.2, 25.0) == swapped


def test_the_hint_names_the_zone_of_the_place():
    assert zone_hint(25.0, 60.2).endswith("at that place it is EPSG:32635")
    assert zone_hint(np.nan, 60.2) == "a position of another place"
