"""Coordinate systems and angles, against independent derivatives and hand-worked numbers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter import geodesy
from mapfilter._area_scale import check_scale
from mapfilter.angles import (
    azimuth_from_heading_deg,
    heading_from_azimuth_rad,
    wrap_one_rad,
    wrap_rad,
)
from mapfilter.degrees import check_bbox
from mapfilter.errors import InputError
from mapfilter.geodesy import (
    grid_convergence_rad,
    project,
    projected_crs,
    same_crs,
    same_grid,
    unproject,
    utm_crs,
)

ANGLES = st.floats(-1e4, 1e4)
TURN = 2 * np.pi


@given(ANGLES)
def test_wrapped_angles_lie_in_one_turn_and_point_the_same_way(angle):
    wrapped = wrap_rad(angle)
    assert -np.pi <= wrapped < np.pi
    assert np.cos(wrapped - angle) == pytest.approx(1.0)
    assert wrap_rad(wrapped) == pytest.approx(wrapped, abs=1e-15)


@given(st.floats(-np.pi, np.pi, exclude_max=True), st.integers(-20, 20))
def test_whole_turns_are_taken_away(angle, turns):
    off = wrap_rad(wrap_rad(angle + turns * TURN) - angle)
    assert abs(off) < 1e-12


def test_both_sides_of_the_seam():
    assert wrap_rad([np.pi, -np.pi, 3 * np.pi]).tolist() == [-np.pi] * 3
    assert wrap_rad(np.pi + np.array([-1e-12, 1e-12])) == pytest.approx([np.pi, -np.pi])
    assert wrap_rad(-np.pi + np.array([-1e-12, 1e-12])) == pytest.approx([np.pi, -np.pi])
    assert wrap_rad(-1e-20) == pytest.approx(0.0)
    assert np.isnan(wrap_rad(np.nan))
    assert wrap_rad(np.zeros((2, 3))).shape == (2, 3)


def test_azimuths_are_clockwise_from_north_and_headings_counter_clockwise_from_east():
    azimuths = [0, 45, 90, 180, 270, 360, -90]
    headings = np.degrees(heading_from_azimuth_rad(azimuths))
    assert headings == pytest.approx([90, 45, 0, -90, -180, 90, -180])
    assert azimuth_from_heading_deg(np.radians([90, 0, -90, 180])) == pytest.approx(
        [0, 90, 180, 270]
    )


@given(st.floats(-720, 720), st.floats(-0.1, 0.1))
def test_azimuth_and_heading_are_each_others_inverse(azimuth_deg, convergence_rad):
    heading = heading_from_azimuth_rad(azimuth_deg, convergence_rad)
    back = azimuth_from_heading_deg(heading, convergence_rad)
    assert 0 <= back < 360
    assert abs((back - azimuth_deg + 180) % 360 - 180) < 1e-9


PLACES = [
    # UTM zone, and places west and east of its central meridian in both hemispheres
    ("EPSG:32629", -11.5, 41.1, -1),
    ("EPSG:32629", -8.6, 41.1, 1),
    ("EPSG:32635", 24.94, 60.17, -1),
    ("EPSG:32635", 29.5, 60.17, 1),
    ("EPSG:32734", 18.42, -33.92, 1),
    ("EPSG:32734", 23.9, -33.92, -1),
    ("EPSG:2193", 174.78, -41.29, -1),  # axes given as north, east; central meridian 173
    ("EPSG:3413", -30.0, 75.0, 1),
    ("EPSG:2154", 7.75, 48.58, 1),
]


def bearing_of_true_north_rad(crs, lon, lat, step_deg=1e-4):
    """Heading, on the grid, of a small step due north: a derivative of the projection itself."""
    east, north = project(crs, [lon, lon], [lat - step_deg, lat + step_deg])
    return float(np.arctan2(north[1] - north[0], east[1] - east[0]))


@pytest.mark.parametrize(("crs", "lon", "lat", "sign"), PLACES)
def test_convergence_against_a_derivative_of_the_projection(crs, lon, lat, sign):
    convergence = grid_convergence_rad(crs, lon, lat)
    north_on_grid = bearing_of_true_north_rad(crs, lon, lat)
    assert wrap_rad(north_on_grid - np.pi / 2 - convergence) == pytest.approx(0.0, abs=1e-7)
    assert heading_from_azimuth_rad(0.0, convergence) == pytest.approx(north_on_grid, abs=1e-7)
    if sign:
        assert convergence * sign > 0


@pytest.mark.parametrize(("crs", "lon", "lat", "sign"), PLACES)
def test_a_walk_along_a_geodesic_has_the_heading_of_its_azimuth(crs, lon, lat, sign):  # noqa: ARG001
    from pyproj import Geod

    for azimuth_deg in (0.0, 37.0, 90.0, 200.0, 330.0):
        to_lon, to_lat, _ = Geod(ellps="WGS84").fwd(lon, lat, azimuth_deg, 5.0)
        east, north = project(crs, [lon, to_lon], [lat, to_lat])
        heading = np.arctan2(north[1] - north[0], east[1] - east[0])
        expected = heading_from_azimuth_rad(azimuth_deg, grid_convergence_rad(crs, lon, lat))
        assert wrap_rad(heading - expected) == pytest.approx(0.0, abs=2e-6)


def test_convergence_of_utm_by_hand():
    # tan γ = tan Δλ · sin φ on the sphere; at 60.17° N and -2.06° from the meridian -1.79°.
    expected = np.arctan(np.tan(np.radians(24.94 - 27.0)) * np.sin(np.radians(60.17)))
    assert grid_convergence_rad("EPSG:32635", 24.94, 60.17) == pytest.approx(expected, abs=2e-5)
    assert grid_convergence_rad("EPSG:32635", 27.0, 60.17) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("place", [(0.0, 95.0), (float("nan"), 41.0), (float("inf"), 0.0)])
def test_convergence_of_no_place_is_told(place):
    with pytest.raises(InputError, match="place: expected a longitude and latitude"):
        grid_convergence_rad("EPSG:32629", *place)


@given(st.floats(-11.9, -6.1), st.floats(-79, 83))
def test_project_and_unproject_are_each_others_inverse(lon, lat):
    crs = utm_crs(-9.0, lat)
    east, north = project(crs, lon, lat)
    back = unproject(crs, east, north)
    assert (float(back[0]), float(back[1])) == pytest.approx((lon, lat), abs=1e-9)


def test_projection_of_a_known_place():
    # On the central meridian east is 500 km; on the equator north is 0.
    assert project("EPSG:32629", -9.0, 0.0) == (pytest.approx(500_000), pytest.approx(0, abs=1e-6))
    east, north = project("EPSG:32734", [21.0], [0.0])
    assert (east.shape, east[0], north[0]) == ((1,), pytest.approx(5e5), pytest.approx(1e7))
    with pytest.raises(InputError, match="EPSG:32629"):
        project("EPSG:nonsense", 0.0, 0.0)


@pytest.mark.parametrize(
    ("lon", "lat", "zone"),
    [(-180, 1, 32601), (179.99, 1, 32660), (180, 1, 32660), (0, 0, 32631), (-0.01, -0.01, 32730)],
)
def test_utm_zones_at_the_seams(lon, lat, zone):
    assert utm_crs(lon, lat) == f"EPSG:{zone}"


@pytest.mark.parametrize(
    ("lon", "lat", "code"),
    [
        # Cork, Dublin, Brussels, Nairobi, Cape Town, Ushuaia, Sydney, Tokyo, Honolulu.
        (-8.47, 51.90, 32629), (-6.26, 53.35, 32629), (4.35, 50.85, 32631), (36.8, -1.29, 32737),
        (18.4, -33.9, 32734), (-68.3, -54.8, 32719), (151.2, -33.9, 32756), (139.7, 35.7, 32654),
        (-157.9, 21.3, 32604),
        # Bergen and Oslo, and the edges of 32V.
        (5.32, 60.39, 32632), (10.75, 59.91, 32632), (2.99, 60.0, 32631), (3.0, 56.0, 32632),
        (4.0, 55.99, 32631), (4.0, 64.0, 32631), (12.0, 60.0, 32633),
        # Svalbard, of whose zones three are missing.
        (8.99, 78.0, 32631), (9.0, 78.0, 32633), (15.63, 78.22, 32633), (21.0, 80.0, 32635),
        (33.0, 80.0, 32637), (41.99, 80.0, 32637), (42.0, 80.0, 32638), (-0.01, 80.0, 32630),
        (15.0, 71.99, 32633), (8.0, 71.99, 32632),
        # Beyond its latitudes UPS takes the place of UTM.
        (10.0, 84.0, 32633), (10.0, 84.01, 5041), (0.0, 90.0, 5041), (10.0, -80.0, 32732),
        (10.0, -80.01, 5042), (0.0, -90.0, 5042),
    ],
)  # fmt: skip
def test_places_of_the_world_have_their_zone(lon, lat, code):
    assert utm_crs(lon, lat) == f"EPSG:{code}"


@pytest.mark.parametrize("sign", [1, -1])
def test_about_the_poles_a_metre_is_one(sign):
    """By the sphere: 100 m along the meridian, and as far along the parallel, within 1 %."""
    lon, lat = 30.0, 86.0 * sign
    crs = projected_crs(utm_crs(lon, lat))
    step_deg = 100 / 111_195
    wide_deg = step_deg / np.cos(np.radians(lat))
    east, north = project(crs, [lon, lon, lon + wide_deg], [lat, lat + step_deg, lat])
    moved = (east[1:] - east[0]) + 1j * (north[1:] - north[0])
    assert np.abs(moved) == pytest.approx([100, 100], rel=0.01)
    # North is left of grid north by the convergence, and east right of north.
    to_north_rad = np.pi / 2 + grid_convergence_rad(crs, lon, lat)
    assert np.angle(moved) == pytest.approx([to_north_rad, to_north_rad - np.pi / 2], abs=1e-3)


@pytest.mark.parametrize(
    "spec",
    ["EPSG:32629", "epsg:32629", 32629, "+proj=utm +zone=29 +datum=WGS84 +units=m +type=crs"],
)
def test_the_same_system_however_it_is_called(spec):
    assert same_crs(projected_crs(spec), "EPSG:32629")


@pytest.mark.parametrize(
    ("a", "b", "same"),
    [
        ("EPSG:25832", "EPSG:32632", True),
        ("EPSG:3067", "EPSG:32635", True),
        ("EPSG:26918", "EPSG:32618", True),
        ("EPSG:32632", "EPSG:32632", True),
        ("EPSG:32632", "EPSG:32732", False),
        ("EPSG:32632", "EPSG:32633", False),
        ("EPSG:23032", "EPSG:32632", False),
        ("EPSG:31467", "EPSG:25832", False),
        ("EPSG:4647", "EPSG:25832", False),
        ("EPSG:32632", "+proj=tmerc +lat_0=0 +lon_0=0 +datum=WGS84 +units=m +type=crs", False),
    ],
)
def test_systems_with_the_same_metres_are_one_grid(a, b, same):
    assert same_grid(a, b) is same
    assert same_grid(b, a) is same


def test_a_system_without_a_number_keeps_its_text():
    local = "+proj=tmerc +lat_0=41.1 +lon_0=-8.6 +datum=WGS84 +units=m +type=crs"
    text = projected_crs(local)
    assert text.startswith("PROJCRS")
    assert projected_crs(text) == text
    assert same_crs(text, local)
    assert not same_crs(text, "EPSG:32629")


def test_systems_of_other_axis_order_are_taken():
    assert projected_crs("EPSG:2193") == "EPSG:2193"
    assert projected_crs("EPSG:31467") == "EPSG:31467"


def test_the_text_of_a_system_is_found_once_and_each_fault_is_told_where_it_is(monkeypatch):
    local = "+proj=tmerc +lat_0=-41.3 +lon_0=174.7 +datum=WGS84 +units=m"
    for where in ("a.csv, crs", "b.csv, crs"):
        with pytest.raises(InputError, match=f"^{where}: expected a projected CRS in metres"):
            projected_crs("EPSG:4326", where)
    text = projected_crs(local)
    monkeypatch.setattr(geodesy, "known_crs", None)
    assert projected_crs(local) == text
    # always_xy: east comes first whatever the register says.
    east, north = project("EPSG:2193", 174.78, -41.29)
    assert (round(float(east), -5), round(float(north), -5)) == (1.7e6, 5.4e6)


@pytest.mark.parametrize(
    ("spec", "got", "hint"),
    [
        (None, "none", "CRS left out on export"),
        ("", "none", "CRS left out on export"),
        ("EPSG:4326", "WGS 84", "degrees given for metres"),
        (4258, "ETRS89", "degrees given for metres"),
        (
            "EPSG:2225",
            "NAD83 / California zone 1 (ftUS) (US survey foot",
            "coordinates in feet; project them, as by gdalwarp or ogr2ogr -t_srs EPSG:32610",
        ),
        (
            "+proj=utm +zone=35 +datum=WGS84 +units=us-ft",
            "unknown (US survey foot",
            "coordinates in feet; project them, as by gdalwarp or ogr2ogr -t_srs and the code of a "
            "UTM zone",
        ),
        (
            "EPSG:2048",
            "Hartebeesthoek94 / Lo19 (metre west, metre south)",
            "coordinates to the west; project them, as by gdalwarp or ogr2ogr -t_srs EPSG:32734",
        ),
        (
            "EPSG:5513",
            "S-JTSK / Krovak (metre south, metre west)",
            "coordinates to the west; project them, as by gdalwarp or ogr2ogr -t_srs EPSG:32633",
        ),
        (
            "+proj=utm +zone=35 +datum=WGS84 +units=km",
            "unknown (kilometre east",
            "coordinates in kilometres; project them, as by gdalwarp or ogr2ogr -t_srs and the "
            "code of a UTM zone",
        ),
        ("EPSG:4978", "WGS 84 (metre", ""),
        ("EPSG:5773", "EGM96 height (metre up)", ""),
        ("nonsense", "'nonsense'", ""),
        ("EPSG:999999", "'EPSG:999999'", ""),
        (-1, "-1", ""),
        (float("nan"), "nan", ""),
        ([1], "[1]", ""),
        ({}, "{}", ""),
        (b"\x00", "b'\\x00'", ""),
    ],
)
def test_systems_that_do_not_count_metres_east_and_north(spec, got, hint):
    with pytest.raises(InputError) as caught:
        projected_crs(spec, "roads.gpkg, crs")
    (fault,) = caught.value.faults
    assert fault.where == "roads.gpkg, crs"
    assert fault.got.startswith(got)
    assert fault.hint == hint


@pytest.mark.parametrize("lat", [-17.0, 60.0])
def test_an_area_across_180_degrees_is_named_as_that(lat):
    east, north = project("EPSG:32660" if lat > 0 else "EPSG:32760", 180.0, lat)
    crs = "EPSG:32660" if lat > 0 else "EPSG:32760"
    bounds_m = (float(east) - 800, float(north) - 900, float(east) + 800, float(north) + 900)
    with pytest.raises(InputError, match="an area on one side of 180° of longitude") as refused:
        check_scale(crs, bounds_m, "area.crs")
    assert "across it (likely: no maps are made across it" in str(refused.value)
    aside_m = (bounds_m[0] - 5000, bounds_m[1], bounds_m[2] - 5000, bounds_m[3])
    check_scale(crs, aside_m, "area.crs")


def test_an_area_beyond_a_crs_is_refused_without_a_scale():
    with pytest.raises(InputError, match="found EPSG:4647, in which it has no place") as refused:
        check_scale("EPSG:4647", (474_800.0, 5_523_800.0, 478_200.0, 5_527_200.0), "area.crs")
    assert "nan" not in str(refused.value)


PORTO = (-8.63, 41.13, -8.59, 41.16)


def test_a_good_box_passes_also_at_the_ends():
    check_bbox(PORTO)
    check_bbox((-180.0, -90.0, 180.0, 90.0))


@pytest.mark.parametrize(
    ("box", "hint"),
    [
        ((531_000.0, 4_553_000.0, 534_000.0, 4_556_000.0), "metres given for degrees"),
        ((-33.95, 151.1, -33.85, 151.3), "longitude and latitude swapped"),
        ((PORTO[2], PORTO[1], PORTO[0], PORTO[3]), "corners swapped"),
        ((PORTO[0], PORTO[3], PORTO[2], PORTO[1]), "corners swapped"),
        ((PORTO[0], PORTO[1], PORTO[0], PORTO[3]), "corners swapped"),
        ((float("nan"), 41.0, -8.0, 42.0), ""),
        ((-8.63, 41.13, float("inf"), 41.16), ""),
    ],
)
def test_bad_boxes_are_told_with_their_likely_mistake(box, hint):
    with pytest.raises(InputError) as caught:
        check_bbox(box, "area.bbox")
    (fault,) = caught.value.faults
    assert (fault.where, fault.hint) == ("area.bbox", hint)


def test_angles_that_are_not_finite_are_unknown_without_a_warning():
    assert np.isnan(wrap_rad([np.inf, -np.inf, np.nan])).all()


@pytest.mark.parametrize("near", [0.0, np.pi, -np.pi, 2 * np.pi, -3 * np.pi, 1e-20, 1e6])
def test_one_angle_is_wrapped_to_the_same_bits(near):
    angles = np.concatenate([near + np.random.default_rng(3).normal(0, 4, 500), [near, -near]])
    angles = np.concatenate([angles, np.nextafter(angles, -np.inf), np.nextafter(angles, np.inf)])
    assert np.array([wrap_one_rad(one) for one in angles.tolist()]).tobytes() == (
        wrap_rad(angles).tobytes()
    )
    assert np.isnan(wrap_one_rad(float("nan")))


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("UTM35", "EPSG:32635, or EPSG:32735 south of the equator"),
        ("utm zone 5 S", "EPSG:32705"),
        ("WGS84 UTM 34N", "EPSG:32634"),
        ("EPSG32635", "EPSG:32635"),
        ("epsg 2154", "EPSG:2154"),
        ("UTM61", ""),
        ("UTM zone", ""),
    ],
)
def test_a_text_that_is_nearly_a_system_says_which(text, hint):
    with pytest.raises(InputError) as caught:
        projected_crs(text, "rasters.crs")
    assert caught.value.faults[0].hint == hint
