"""Heights of buildings from tags, and the raster made of them."""

import numpy as np
import pytest
import shapely
from made_maps import AREA, write_pbf

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.roads.buildings import rasterise_heights, read_buildings
from mapfilter.roads.ways import Buildings

SQUARE = [(50, 50), (70, 50), (70, 70), (50, 70), (50, 50)]


@pytest.fixture
def make_map(tmp_path):
    return lambda ways, relations=(): write_pbf(tmp_path / "made.osm.pbf", ways, relations)


@pytest.mark.parametrize(
    ("tags", "height_m", "source"),
    [
        ({"height": "21"}, 21.0, "height"),
        ({"height": "21.5 m"}, 21.5, "height"),
        ({"height": "9,5"}, 9.5, "height"),
        ({"height": "100 ft"}, 30.48, "height"),
        ({"height": "100 Feet"}, 30.48, "height"),
        ({"height": "100′"}, 30.48, "height"),
        ({"height": "850 cm"}, 8.5, "height"),
        ({"height": "9 metres"}, 9.0, "height"),
        ({"height": "7", "building:levels": "5"}, 7.0, "height"),
        ({"building:levels": "5"}, 16.0, "levels"),
        ({"building:levels": "5;6"}, 16.0, "levels"),
        ({"height": "tall", "building:levels": "2"}, 6.4, "levels"),
        ({"height": "0"}, 12.0, "default"),
        ({"height": "99999"}, 12.0, "default"),
        ({}, 12.0, "default"),
    ],
)
def test_height_of_a_building(make_map, tags, height_m, source):
    made = make_map([(3, {"building": "yes", **tags}, SQUARE)])
    buildings = read_buildings(made, *AREA)
    np.testing.assert_allclose(buildings.height_m, [height_m])
    counts = {
        "height": buildings.from_height,
        "levels": buildings.from_levels,
        "default": buildings.from_default,
    }
    assert counts == {**dict.fromkeys(counts, 0), source: 1}
    assert "1 building:" in buildings.height_sources


@pytest.mark.parametrize(
    "tags",
    [{"building": "no"}, {"building": "roof"}, {"building": "yes", "location": "underground"}],
)
def test_what_is_no_building(make_map, tags):
    assert len(read_buildings(make_map([(3, tags, SQUARE)]), *AREA)) == 0


def test_defaults_are_arguments_and_checked(make_map):
    levels = {"building": "yes", "building:levels": "2"}
    other = [(x + 100, y) for x, y in SQUARE]
    made = make_map([(3, levels, SQUARE), (4, {"building": "yes"}, other)])
    found = read_buildings(made, *AREA, default_height_m=8, storey_height_m=4)
    assert found.height_m.tolist() == [8.0, 8.0]
    with pytest.raises(InputError, match=r"default_height_m.*\n.*storey_height_m"):
        read_buildings(made, *AREA, default_height_m=0, storey_height_m=-1)


def test_the_highest_of_overlapping_buildings_counts():
    boxes = np.array([shapely.box(0, 0, 20, 20), shapely.box(10, 0, 30, 20)])
    lattice = Lattice("EPSG:32629", 0.0, 20.0, 5.0, 4, 8)
    for heights in ([30.0, 10.0], [10.0, 30.0]):
        buildings = Buildings("EPSG:32629", boxes, np.array(heights), 2, 0, 0)
        raster = rasterise_heights(buildings, lattice)
        assert raster.dtype == np.float32
        expected = [heights[0]] * 2 + [30.0] * 2 + [heights[1]] * 2 + [0.0] * 2
        np.testing.assert_array_equal(raster, np.tile(np.float32(expected), (4, 1)))


def test_helsinki_counts_add_up():
    bounds = (385_500.0, 6_671_300.0, 386_300.0, 6_672_300.0)
    buildings = read_buildings("helsinki", "EPSG:32635", bounds)
    assert len(buildings) > 100
    assert buildings.from_height + buildings.from_levels + buildings.from_default == len(buildings)
    assert buildings.height_m.min() > 0
