"""Orbits, frames, time, noise and visibility against known cases and brute force."""

import json
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Transformer

from mapfilter.errors import InputError
from mapfilter.gnss.almanacs import Almanac, nominal_gps
from mapfilter.gnss.noise import correlated_along, elevation_sigma_m, multipath_bias_m
from mapfilter.gnss.orbits import gps_time, satellite_positions_m
from mapfilter.gnss.sky import Directions, LocalFrame, directions, ecef_from_lonlat
from mapfilter.gnss.skyline import Skyline

GEODETIC = Transformer.from_crs("EPSG:4978", "EPSG:4979", always_xy=True)
CASES = json.loads((Path(__file__).parents[1] / "fusion_cases.json").read_text(encoding="utf-8"))
ELEMENTS = CASES["yuma"]["alm"]
ONE = Almanac(
    ("G01",),
    *(
        np.array([value])
        for value in (
            190.0, ELEMENTS["toa"], ELEMENTS["sqrtA"], ELEMENTS["e"], ELEMENTS["i"],
            ELEMENTS["OMEGA0"], ELEMENTS["OMEGADOT"], ELEMENTS["omega"], ELEMENTS["M0"],
        )
    ),
    np.array([True]),
)  # fmt: skip


@pytest.mark.parametrize("case", CASES["yuma"]["cases"], ids=lambda case: str(case["tow"]))
def test_orbits_of_the_reference(case):
    found = satellite_positions_m(ONE, case["tow"])
    np.testing.assert_allclose(found[0], case["ecef"], rtol=1e-10, atol=1e-3)


def test_the_week_is_the_same_as_half_a_week_around():
    late = satellite_positions_m(ONE, 5.0)
    np.testing.assert_allclose(satellite_positions_m(ONE, 5.0, 191), late, atol=1e-3)
    earlier = satellite_positions_m(ONE, 5.0, 190)
    assert np.linalg.norm(earlier - late) > 1e6
    times = satellite_positions_m(ONE, [5.0, 406000.0])
    np.testing.assert_array_equal(times[0], late)


@pytest.mark.parametrize("tow", [-1.0, 604801.0, 1.7e9, np.nan])
def test_times_that_are_none_of_a_week(tow):
    with pytest.raises(InputError, match="seconds of the week"):
        satellite_positions_m(ONE, tow)


def test_gps_time_knows_leap_seconds():
    def at(*date):
        return gps_time(datetime(*date, tzinfo=UTC).timestamp())

    assert at(1980, 1, 6) == (0, 0.0)
    assert at(1999, 8, 22) == (1024, 13.0)
    assert at(2024, 1, 7) == (2296, 18.0)
    before = datetime(2016, 12, 31, 23, 59, 59, tzinfo=UTC).timestamp()
    assert gps_time(before + 1)[1] - gps_time(before)[1] == 2.0
    for bad in (0.0, np.nan, np.inf, -1e9):
        with pytest.raises(InputError, match="Unix time"):
            gps_time(bad)


def test_frames_of_the_reference():
    lat, lon, height = CASES["lla_ecef"]["lla"]
    found = ecef_from_lonlat(lon, lat, height)
    np.testing.assert_allclose(found, CASES["lla_ecef"]["ecef"], rtol=1e-10)
    for value, told in zip(GEODETIC.transform(*found), (lon, lat, height), strict=True):
        assert value == pytest.approx(told, abs=1e-6)


@given(st.floats(-180, 180), st.floats(-90, 90), st.floats(-1e5, 1e5), st.floats(-1e5, 1e5))
@settings(max_examples=50, deadline=None)
def test_local_frames_keep_lengths_and_come_back(lon, lat, east, north):
    frame = LocalFrame(lon, lat, 100.0)
    np.testing.assert_allclose(frame.axes @ frame.axes.T, np.eye(3), atol=1e-12)
    there = frame.origin_m + [east, north, 50.0] @ frame.axes
    np.testing.assert_allclose(frame.to_local(there), [east, north, 50.0], atol=1e-6)
    up = GEODETIC.transform(*(frame.origin_m + 10.0 * frame.axes[2]))[2]
    assert up == pytest.approx(110.0, abs=1e-3)


@pytest.mark.parametrize("place", [(0, 91), (181, 0), (np.nan, 0), (0, np.nan), (0, 0, np.inf)])
def test_places_off_the_earth(place):
    with pytest.raises(InputError, match="local frame"):
        LocalFrame(*place)


def test_masks():
    frame = LocalFrame(4.86, 43.52)
    seen = directions(frame.to_local(satellite_positions_m(nominal_gps(), 0.0)))
    assert seen.above(0).sum() > seen.above(15).sum() > seen.above(40).sum()
    for bad in (-1, 90, np.nan):
        with pytest.raises(InputError, match="mask_deg"):
            seen.above(bad)


def test_noise_grows_towards_the_horizon_and_is_refused_below():
    assert elevation_sigma_m(np.radians([5.0, 90.0])).round(2).tolist() == [22.95, 2.0]
    for bad in (0.0, -0.1, np.nan):
        with pytest.raises(InputError, match="elevation mask"):
            elevation_sigma_m([1.0, bad])
    with pytest.raises(InputError, match="zenith_m"):
        elevation_sigma_m(1.0, -1.0)


def test_echoes_only_lengthen():
    rng = np.random.default_rng(3)
    way = np.cumsum(np.full(40_000, 1.0))
    bias = multipath_bias_m(way, 3, rng, mean_m=3.0, correlation_m=10.0)
    assert bias.min() >= 0
    assert bias.mean() == pytest.approx(3.0, abs=0.2)
    assert np.quantile(bias, 0.5) == pytest.approx(3 * np.log(2), abs=0.15)
    assert not multipath_bias_m(way[:5], 2, rng, mean_m=0.0).any()
    with pytest.raises(InputError, match="distances that never decrease"):
        multipath_bias_m([1.0, 0.0], 2, rng)


@pytest.mark.parametrize("uneven", [False, True])
def test_correlation_along_a_way(uneven):
    rng = np.random.default_rng(4)
    step = rng.uniform(1, 9, 4000) if uneven else np.full(4000, 5.0)
    drawn = correlated_along(np.cumsum(step), 50, 100.0, rng)
    assert drawn.std() == pytest.approx(1.0, abs=0.03)
    lag = np.mean(drawn[20:] * drawn[:-20])
    assert lag == pytest.approx(np.exp(-1.0), abs=0.04)


def city():
    rng = np.random.default_rng(5)
    shapes, heights = [], []
    for east in range(-150, 150, 50):
        for north in range(-150, 150, 50):
            box = shapely.box(east + 8, north + 8, east + 42, north + 42)
            yard = shapely.box(east + 18, north + 18, east + 32, north + 32)
            shapes.append(box.difference(yard) if rng.random() < 0.5 else box)
            heights.append(rng.uniform(5, 40))
    shapes.append(shapely.union(shapely.box(200, 0, 220, 20), shapely.box(200, 30, 220, 50)))
    heights.append(60.0)
    return shapes, np.array(heights)


def test_rays_against_brute_force():
    """Along each ray, samples every 0.1 m against all footprints."""
    shapes, heights = city()
    skyline, rng = Skyline(shapes, heights), np.random.default_rng(6)
    places = np.column_stack([rng.uniform(-160, 160, (60, 2)), rng.uniform(0, 20, 60)])
    toward = Directions(np.radians(rng.uniform(8, 88, 7)), rng.uniform(0, 2 * np.pi, 7))
    seen = skyline.seen(places, toward)
    away = np.arange(0.0, 400.0, 0.1)
    tree = shapely.STRtree(shapes)
    for k, (east, north, up) in enumerate(places):
        for s in range(7):
            a, rise = toward.azimuth_rad[s], np.tan(toward.elevation_rad[s])
            points = shapely.points(east + away * np.sin(a), north + away * np.cos(a))
            hit, building = tree.query(points, predicate="within")
            blocked = (heights[building] > up + away[hit] * rise + 0.3).any()
            free = (heights[building] < up + away[hit] * rise - 0.3).all()
            if blocked or free:
                assert seen[k, s] == (not blocked), (k, s)


def test_what_is_below_the_horizon_or_under_a_roof_sees_nothing():
    skyline = Skyline([shapely.box(0, 0, 10, 10)], [20.0])
    up = Directions(np.radians([89.0, 45.0, -5.0]), np.zeros(3))
    assert skyline.seen([[5.0, 5.0, 1.5]], up).tolist() == [[False, False, False]]
    assert skyline.seen([[5.0, 5.0, 20.5]], up).tolist() == [[True, True, False]]
    assert skyline.seen([[500.0, 5.0, 1.5]], up).tolist() == [[True, True, False]]
    assert Skyline([], []).seen([[0.0, 0.0, 0.0]], up).tolist() == [[True, True, False]]


def test_a_canyon_hides_the_sky_across_and_not_along():
    walls = [shapely.box(-1000, 11, 1000, 40), shapely.box(-1000, -40, 1000, -11)]
    skyline = Skyline(walls, [26.0, 26.0])
    lowest = np.degrees(np.arctan2(26 - 1.5, 11.0))
    elevation = np.radians([lowest - 1, lowest + 1, 20.0, 20.0])
    toward = Directions(elevation, np.radians([0.0, 180.0, 90.0, 0.0]))
    assert skyline.seen([[0.0, 0.0, 1.5]], toward).tolist() == [[False, True, True, False]]


@pytest.mark.parametrize("heights", [[1.0, 2.0], [np.nan], [-1.0], [np.inf]])
def test_heights_that_are_none(heights):
    with pytest.raises(InputError, match="heights_m"):
        Skyline([shapely.box(0, 0, 1, 1)], heights)
