"""The same map as .osm.pbf, .osm and .osm.gz is the same to the readers; broken ones are named."""

import gzip

import numpy as np
import pytest
import shapely
from made_maps import AREA, write_pbf, write_xml
from test_osm import CASES, RING

from mapfilter.errors import InputError
from mapfilter.geodesy import project
from mapfilter.roads.buildings import read_buildings
from mapfilter.roads.maps import map_bounds_deg
from mapfilter.roads.osm import read_squares, read_ways

SUFFIXES = ("osm", "osm.gz")


def shifted(dx, dy):
    return [(x + dx, y + dy) for x, y in RING]


def town():
    """Every rule of the profiles, loops, areas, one-way streets, buildings, multipolygons."""
    ways = [
        (100 + i, {"highway": highway, **tags}, [(10, 3 * i), (60, 3 * i), (61, 3 * i + 1)])
        for i, (highway, tags, _, _) in enumerate(CASES)
    ]
    ways += [
        (1, {"highway": "pedestrian"}, RING),
        (2, {"highway": "pedestrian", "area": "yes"}, shifted(100, 0)),
        (3, {"place": "square", "name": 'Ä "q" <&>'}, shifted(150, 0)),
        (4, {"highway": "residential", "junction": "roundabout"}, shifted(0, 100)),
        (5, {"highway": "residential", "junction": "roundabout"}, shifted(60, 100)[::-1]),
        (6, {"highway": "residential", "oneway": "-1"}, [(300, 10), (350, 10)]),
        (7, {"highway": "service"}, [(-1000, 333), (1400, 333)]),
        (8, {"highway": "footway", "area": "no"}, shifted(120, 100)),
        (9, {"highway": "footway", "area": "yes"}, [(380, 10), (420, 10), (420, 30), (380, 10)]),
        (20, {"building": "yes", "building:levels": "4"}, shifted(200, 200)),
        (21, {"building": "yes", "height": "21,5 m"}, shifted(260, 200)),
        (22, {"building": "roof"}, shifted(320, 200)),
        (23, {"building": "no"}, shifted(320, 240)),
        (24, {"building": "yes", "location": "underground"}, shifted(200, 240)),
        (30, {}, shifted(200, 300)[:3]),
        (31, {}, shifted(200, 300)[2:]),
        (32, {}, shifted(260, 300)),
    ]
    return ways, [(8, {"highway": "pedestrian"}, [32]), (9, {"building": "house"}, [30, 31])]


def layers(path):
    return (
        read_ways(path, "walking", *AREA),
        read_ways(path, "driving", *AREA),
        read_squares(path, *AREA),
        read_buildings(path, *AREA),
    )


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_all_formats_hold_the_same(tmp_path, suffix):
    ways, relations = town()
    expected = layers(write_pbf(tmp_path / "town.osm.pbf", ways, relations))
    found = layers(write_xml(tmp_path / f"town.{suffix}", ways, relations))
    assert 7 in expected[0].way_id
    assert -8 in expected[2].area_id
    assert len(expected[3]) == 3
    for a, b in zip(expected, found, strict=True):
        for name in a.__dataclass_fields__:
            x, y = getattr(a, name), getattr(b, name)
            if name in ("geometry", "footprints"):
                assert np.all(shapely.equals(x, y) | shapely.equals_exact(x, y, 1e-3))
                lines = shapely.get_type_id(x) == 1
                assert np.all(shapely.equals_exact(x[lines], y[lines], 1e-3))
            elif isinstance(x, np.ndarray):
                np.testing.assert_array_equal(x, y)
            else:
                assert x == y


def test_real_maps_are_read(shared_data):
    extracts = shared_data / "osm-extracts"
    for name, crs, bounds_deg, buildings in (
        ("monaco-2012.osm.gz", "EPSG:32632", (7.40, 43.72, 7.44, 43.75), 900),
        ("dreieich.osm.gz", "EPSG:32632", (8.6805, 49.9864, 8.7394, 50.0121), 3500),
    ):
        west, south, east, north = bounds_deg
        low, high = project(crs, west, south), project(crs, east, north)
        bounds_m = tuple(float(value) for value in (*low, *high))
        ways = read_ways(extracts / name, "walking", crs, bounds_m)
        assert len(ways) > 300
        assert len(read_buildings(extracts / name, crs, bounds_m)) > buildings


def test_bounds_are_those_of_the_head_or_else_of_the_ways(tmp_path):
    ways = [(7, {"highway": "path"}, [(0, 0), (100, 100)])]
    box = (-8.7, 41.1, -8.6, 41.2)
    assert map_bounds_deg(write_xml(tmp_path / "a.osm.gz", ways, bounds=box)) == box
    of_ways = map_bounds_deg(write_xml(tmp_path / "b.osm", ways))
    west, south = project(AREA[0], *of_ways[:2])
    assert (west, south) == pytest.approx(AREA[1][:2], abs=1)
    wrong = map_bounds_deg(write_xml(tmp_path / "c.osm", ways, bounds=(1, 2, "x", 4)))
    assert wrong == of_ways


def test_broken_maps_are_named(tmp_path):
    ways, relations = town()
    whole = write_xml(tmp_path / "whole.osm", ways, relations).read_bytes()
    packed = gzip.compress(whole)
    laughs = b"""<!DOCTYPE osm [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><osm>&b;</osm>"""
    broken = {
        "cut.osm": (whole[: len(whole) // 2], "unclosed token"),
        "cut-in-utf8.osm": (whole[:-8], "line"),
        "cut.osm.gz": (packed[: len(packed) // 2], "cut off"),
        "plain.osm.gz": (whole, "cut off, or another format"),
        "packed.osm": (packed, "not well-formed"),
        "page.osm": (b"<html><body/></html>", "another kind of XML"),
        "laughs.osm": (laughs, "a document type"),
        "changed.osm.gz": (packed[:-8] + b"\0" * 8, "CRC"),
        "nothing.osm": (b"", "empty file"),
        "text.osm": (b"ways\n", "syntax error"),
        "none.osm": (b"<osm version='0.6'/>", "a map with ways"),
    }
    for name, (content, message) in broken.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=message) as caught:
            read_ways(tmp_path / name, "walking", *AREA)
        assert name in str(caught.value)


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path):
    bomb = tmp_path / "bomb.osm.gz"
    members = [b"<osm>", *[b" " * (1 << 20)] * 120, b"</osm>"]
    packed = {member: gzip.compress(member) for member in set(members)}
    bomb.write_bytes(b"".join(packed[member] for member in members))
    with pytest.raises(InputError, match="bomb"):
        read_ways(bomb, "walking", *AREA)


def test_nothing_is_left_beside_the_map(tmp_path):
    made = write_xml(tmp_path / "map.osm.gz", *town())
    read_ways(made, "walking", *AREA)
    assert [path.name for path in tmp_path.iterdir()] == ["map.osm.gz"]
