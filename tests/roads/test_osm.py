"""Which ways and areas of a map a profile may use, and what is wrong with broken maps."""

import os
import tempfile

import numpy as np
import pytest
import shapely
from made_maps import AREA, write_pbf

from mapfilter.errors import InputError
from mapfilter.geodesy import project
from mapfilter.roads import elements, maps
from mapfilter.roads.maps import box_deg, map_bounds_deg, resolve_map
from mapfilter.roads.osm import read_squares, read_ways

RING = [(50, 50), (90, 50), (90, 80), (50, 80), (50, 50)]

CASES = [
    # tags beside highway, walking, driving
    ("footway", {}, True, False),
    ("steps", {}, True, False),
    ("residential", {}, True, True),
    ("motorway", {}, False, True),
    ("trunk_link", {}, False, True),
    ("construction", {}, False, False),
    ("elevator", {}, False, False),
    ("service", {"access": "private"}, False, False),
    ("service", {"access": "private", "foot": "yes"}, True, False),
    ("service", {"access": "no", "motor_vehicle": "yes"}, False, True),
    ("service", {"access": "permissive"}, True, True),
    ("residential", {"motor_vehicle": "no"}, True, False),
    ("residential", {"motor_vehicle": "no", "motorcar": "yes"}, True, True),
    ("residential", {"vehicle": "private", "motor_vehicle": "destination"}, True, True),
    ("primary", {"foot": "no"}, False, True),
    ("cycleway", {"foot": "use_sidepath"}, False, False),
    ("residential", {"tunnel": "yes"}, False, True),
    ("residential", {"tunnel": "building_passage"}, True, True),
    ("footway", {"indoor": "yes"}, False, False),
]


@pytest.fixture
def make_map(tmp_path):
    return lambda ways, relations=(): write_pbf(tmp_path / "made.osm.pbf", ways, relations)


@pytest.mark.parametrize(("highway", "tags", "walking", "driving"), CASES)
def test_rules_of_the_profiles(make_map, highway, tags, walking, driving):
    always = {"highway": "residential"}
    made = make_map(
        [
            (5, {"highway": highway, **tags}, [(10, 10), (60, 10)]),
            (9, always, [(10, 20), (60, 20)]),
        ]
    )
    for profile, expected in (("walking", walking), ("driving", driving)):
        ways = read_ways(made, profile, *AREA)
        assert (5 in ways.way_id) is expected
        assert 9 in ways.way_id


def test_ways_keep_place_class_and_vertices(make_map):
    corners = [(10.0, 10.0), (60.0, 10.0), (61.0, 40.0)]
    made = make_map([(7, {"highway": "path", "tunnel": "building_passage"}, corners)])
    ways = read_ways(made, "walking", *AREA)
    assert ways.way_id.tolist() == [7]
    assert ways.class_names == ("path",)
    assert ways.covered.tolist() == [True]
    found = shapely.get_coordinates(ways.geometry) - (AREA[1][0], AREA[1][1])
    np.testing.assert_allclose(found, corners, atol=0.02)  # a map keeps 1e-7 degrees


@pytest.mark.parametrize(
    ("tags", "expected"),
    [
        ({}, 0),
        ({"oneway": "yes"}, 1),
        ({"oneway": "-1"}, -1),
        ({"oneway": "no"}, 0),
        ({"junction": "roundabout"}, 1),
    ],
)
def test_one_way_streets_bind_drivers_only(make_map, tags, expected):
    made = make_map([(7, {"highway": "residential", **tags}, [(10, 10), (60, 10)])])
    assert read_ways(made, "driving", *AREA).oneway.tolist() == [expected]
    assert read_ways(made, "walking", *AREA).oneway.tolist() == [0]


def test_ways_are_cut_at_the_edge_and_keep_their_direction(make_map):
    # It leaves to the south, comes back, and ends beyond the eastern edge.
    corners = [(100, 50), (100, -50), (200, -50), (200, 50), (500, 50)]
    made = make_map([(7, {"highway": "residential", "oneway": "yes"}, corners)])
    ways = read_ways(made, "driving", *AREA)
    assert ways.way_id.tolist() == [7, 7]
    lines = [shapely.get_coordinates(line) - (AREA[1][0], AREA[1][1]) for line in ways.geometry]
    lines.sort(key=lambda line: line[0, 0])
    np.testing.assert_allclose(lines[0], [(100, 50), (100, 0)], atol=0.02)
    np.testing.assert_allclose(lines[1], [(200, 0), (200, 50), (400, 50)], atol=0.02)


def test_a_loop_is_a_way_and_an_area_is_a_square(make_map):
    shifted = [(x + 100, y) for x, y in RING]
    made = make_map(
        [
            (1, {"highway": "pedestrian"}, RING),
            (2, {"highway": "pedestrian", "area": "yes"}, shifted),
        ]
    )
    ways, squares = read_ways(made, "walking", *AREA), read_squares(made, *AREA)
    assert ways.way_id.tolist() == [1]
    assert shapely.length(ways.geometry).sum() == pytest.approx(140, abs=0.1)
    assert squares.area_id.tolist() == [2]
    assert shapely.area(squares.geometry).sum() == pytest.approx(1200, abs=2)


@pytest.mark.parametrize(
    ("tags", "is_square"),
    [
        ({"place": "square"}, True),
        ({"highway": "footway", "area": "yes"}, True),
        ({"highway": "pedestrian", "area": "yes", "access": "private"}, False),
        ({"highway": "pedestrian", "area": "yes", "tunnel": "yes"}, False),
        ({"highway": "service", "area": "yes"}, False),
        ({"highway": "elevator"}, False),
    ],
)
def test_which_areas_are_squares(make_map, tags, is_square):
    made = make_map([(3, tags, RING), (4, {"highway": "path"}, [(10, 10), (60, 10)])])
    assert (3 in read_squares(made, *AREA).area_id) is is_square


def test_multipolygon_squares_have_negative_ids(make_map):
    path = (4, {"highway": "path"}, [(10, 10), (60, 10)])
    made = make_map([(3, {}, RING), path], [(8, {"highway": "pedestrian"}, [3])])
    assert read_squares(made, *AREA).area_id.tolist() == [-8]


def test_squares_are_cut_at_the_edge(make_map):
    half_out = [(x - 70, y) for x, y in RING]
    made = make_map([(3, {"place": "square"}, half_out)])
    assert shapely.area(read_squares(made, *AREA).geometry).sum() == pytest.approx(600, abs=2)


def test_no_way_in_the_area_is_told(make_map):
    made = make_map([(7, {"highway": "path"}, [(10, 10), (60, 10)])])
    crs, (west, south, east, north) = AREA
    with pytest.raises(InputError, match="outside the map"):
        read_ways(made, "walking", crs, (west + 5e3, south, east + 5e3, north))


def test_swapped_longitude_and_latitude_are_guessed():
    west, south, east, north = map_bounds_deg("helsinki")
    crs = "EPSG:32638"
    low, high = project(crs, south, west), project(crs, north, east)
    bounds = tuple(float(value) for value in (*low, *high))
    with pytest.raises(InputError, match="longitude and latitude swapped"):
        read_ways("helsinki", "walking", crs, bounds)


def test_broken_maps_are_named(tmp_path, make_map):
    whole = make_map([(7, {"highway": "path"}, [(10, 10), (60, 10)])]).read_bytes()
    broken = {
        "empty.osm.pbf": (b"", "empty file"),
        "cut.osm.pbf": (whole[:-20], "whole .osm.pbf"),
        "text.osm.pbf": (b"<osm></osm>" * 50, "whole .osm.pbf"),
        "map.o5m": (whole, "osmium cat"),
    }
    for name, (content, message) in broken.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=message) as caught:
            read_ways(tmp_path / name, "walking", *AREA)
        assert name in str(caught.value)
    with pytest.raises(InputError, match="no such file"):
        read_ways(tmp_path / "none.osm.pbf", "walking", *AREA)


def test_bounds_come_from_the_header_or_else_from_the_ways(make_map):
    assert map_bounds_deg("helsinki") == pytest.approx((24.93518, 60.16416, 24.95341, 60.17911))
    made = make_map([(7, {"highway": "path"}, [(0, 0), (100, 100)])])
    west, south, east, north = map_bounds_deg(made)
    low, high = project("EPSG:32629", west, south), project("EPSG:32629", east, north)
    assert high[0] - low[0] == pytest.approx(100, abs=1.5)
    assert high[1] - low[1] == pytest.approx(100, abs=1.5)


def test_box_in_degrees_holds_the_box_in_metres():
    bounds = (500_000.0, 6_600_000.0, 700_000.0, 6_800_000.0)
    west, south, east, north = box_deg("EPSG:32635", bounds)
    rng = np.random.default_rng(1)
    lon, lat = rng.uniform(west, east, 2000), rng.uniform(south, north, 2000)
    x, y = project("EPSG:32635", lon, lat)
    inside = (x >= bounds[0]) & (x <= bounds[2]) & (y >= bounds[1]) & (y <= bounds[3])
    assert inside.mean() > 0.7
    corners = project("EPSG:32635", [west, east], [south, north])
    assert corners[1][0] < bounds[1]
    assert corners[1][1] >= bounds[3]


def test_the_embedded_map_is_central_helsinki():
    assert resolve_map("helsinki").is_file()
    low, high = project("EPSG:32635", 24.9352, 60.1642), project("EPSG:32635", 24.9534, 60.1791)
    bounds = tuple(float(value) for value in (*low, *high))
    ways = read_ways("helsinki", "walking", "EPSG:32635", bounds)
    squares = read_squares("helsinki", "EPSG:32635", bounds)
    assert len(ways) > 1000
    assert len(squares) > 10
    assert np.all(np.diff(ways.way_id) >= 0)


@pytest.fixture
def shared_temporary(monkeypatch, tmp_path):
    folder = tmp_path / "shared"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def test_a_map_is_read_anew_each_time_and_nothing_of_it_is_kept(tmp_path, shared_temporary):
    path, footway = tmp_path / "a.osm.pbf", {"highway": "footway"}
    found = []
    for corner in (50, 60):
        write_pbf(path, [(1, footway, [(10, 10), (corner, 10)])])
        # A file of the same size and time is another one nevertheless.
        os.utime(path, (1_700_000_000, 1_700_000_000))
        ways = read_ways(path, "walking", *AREA)
        found.append((path.stat().st_size, shapely.length(ways.geometry).sum()))
    assert found[0][0] == found[1][0]
    assert [length_m for _, length_m in found] == pytest.approx([40, 50], abs=0.1)
    assert not list(shared_temporary.iterdir())


def test_folders_of_other_users_do_not_matter(make_map, shared_temporary):
    (shared_temporary / "pyrosm").write_text("of another user")
    path = make_map([(1, {"highway": "footway"}, [(10, 10), (50, 10)])])
    assert len(read_ways(path, "walking", *AREA)) == 1


def test_a_map_is_read_again_when_it_was_written_anew(make_map):
    road = {"highway": "residential"}
    made = make_map([(5, road, [(10, 10), (60, 10)])])
    first = read_ways(made, "walking", *AREA)
    again = read_ways(made, "walking", *AREA)
    assert first.way_id.tolist() == again.way_id.tolist() == [5]
    assert shapely.equals_exact(first.geometry, again.geometry).all()
    before = made.stat()
    make_map([(6, road, [(10, 10), (60, 10)])])
    os.utime(made, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert made.stat().st_size == before.st_size
    assert read_ways(made, "walking", *AREA).way_id.tolist() == [6]


def test_what_is_changed_of_a_small_map_stays_with_who_changed_it(make_map):
    made = make_map([(5, {"highway": "residential"}, [(10, 10), (60, 10)])])
    query = elements.Query({"highway": ()}, ("highway", "name"))
    found = maps.read_elements(made, *AREA, query)
    found.loc[0, "highway"] = "changed"
    found["name"] = "changed"
    again = maps.read_elements(made, *AREA, query)
    assert (again["highway"][0], again["name"][0]) == ("residential", "")


def test_a_small_map_is_read_once_for_each_part(make_map, monkeypatch):
    made = make_map([(5, {"highway": "residential"}, [(10, 10), (60, 10)])])
    read, read_anew = [], maps._read_anew

    def counted(*given):
        read.append(given)
        return read_anew(*given)

    monkeypatch.setattr(maps, "_read_anew", counted)
    for profile in ("walking", "driving"):
        read_ways(made, profile, *AREA)
    assert len(read) == 1
    (crs, (west, south, east, north)) = AREA
    read_ways(made, "walking", crs, (west - 1_000, south, east, north))
    assert len(read) == 2
    monkeypatch.setattr(elements, "_LARGEST_KEPT_BYTES", 1)
    for _ in range(2):
        read_ways(made, "walking", *AREA)
    assert len(read) == 4
