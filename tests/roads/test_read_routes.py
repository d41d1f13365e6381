"""One call from files or tables to the route lattice gives the points of the single steps."""

from dataclasses import replace

import geopandas
import numpy as np
import pytest
import rasterio
import shapely
from test_layers import HOUSES, ROADS, box
from test_layers import write as write_layer
from test_route_lattice import same

from mapfilter.database.build import build, build_roads
from mapfilter.database.rewrite import routes_of
from mapfilter.database.sources import LatticeRoutes
from mapfilter.errors import ConfigError, InputError
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.buildings import read_buildings
from mapfilter.roads.corridors import Positions, corridors
from mapfilter.roads.layers import read_layer_buildings, read_layer_roads, read_layer_water
from mapfilter.roads.osm import read_squares, read_water, read_ways
from mapfilter.roads.route_points import route_lattice
from mapfilter.roads.routes import read_routes

MAP = Lattice.covering("EPSG:32635", (385_500.0, 6_671_500.0, 385_900.0, 6_671_800.0), 10.0)
WEST, SOUTH, EAST, NORTH = box(0, 0, 400, 300).bounds
TOWN = Lattice.covering(ROADS.crs.to_string(), (WEST, SOUTH, EAST, NORTH), 5.0)
LAKE = geopandas.GeoDataFrame(geometry=[box(100, 30, 130, 80)], crs=ROADS.crs)


def wide(lattice, pad_m):
    west, south, east, north = lattice.bounds_m
    return west - pad_m, south - pad_m, east + pad_m, north + pad_m


def test_a_map_with_its_buildings_and_water():
    here = MAP.crs, MAP.bounds_m
    expected = route_lattice(
        read_ways("helsinki", "walking", MAP.crs, wide(MAP, 8.0)),
        read_squares("helsinki", *here),
        read_buildings("helsinki", *here),
        MAP,
        8.0,
        water=read_water("helsinki", *here),
    )
    found = read_routes("helsinki", MAP, half_width_m=8.0)
    same(replace(found, attribution=""), expected)
    bare = read_routes(
        "helsinki", MAP, half_width_m=8.0, squares=False, buildings=False, water=False
    )
    assert len(bare) > len(expected)
    assert not bare.on_square.any()


def test_a_class_that_no_way_has_is_noted():
    routes = read_routes("helsinki", MAP, half_width_by_class_m={"footwayy": 3.0})
    assert routes.notes == (
        "half_width_by_class_m: no way in the area is a 'footwayy'; did you mean 'footway'?",
    )
    assert repr(routes).endswith("; 1 note)")
    assert read_routes("helsinki", MAP, half_width_by_class_m={"footway": 3.0}).notes == ()


def test_points_of_a_map_state_its_source_and_a_database_of_them_keeps_it(tmp_path):
    routes = read_routes("helsinki", MAP)
    assert routes.attribution == "© OpenStreetMap contributors (ODbL)"
    assert read_routes(ROADS, TOWN, class_column="fclass", id_column="osm_id").attribution == ""
    kept = build_roads(routes, tmp_path / "kept")
    assert kept.attribution == routes_of(kept).attribution == routes.attribution
    source = LatticeRoutes(routes)
    assert build_roads(source, tmp_path / "source").attribution == routes.attribution
    assert source.part(MAP.window(2, 2, 20, 20)).attribution == routes.attribution
    assert build_roads(routes, tmp_path / "own", attribution="© us").attribution == "© us"
    level_dbm = np.full((MAP.rows, MAP.cols), -60.0, dtype=np.float32)
    write_rasters(tmp_path / "rxlev.tif", MAP, [("A", level_dbm)], ["A"])
    east_m, north_m = MAP.east_north(3, 4)
    plan = CellPlan(MAP.crs, (Cell("A", "A", east_m, north_m, 30.0, None, 50.0, 1800.0, "omni"),))
    rasters = open_rasters(tmp_path / "rxlev.tif")
    assert build(rasters, plan, routes, tmp_path / "db").attribution == routes.attribution
    assert build(rasters, plan, routes, tmp_path / "no", attribution="").attribution == ""


def test_a_layer_as_a_file_and_as_a_table(tmp_path):
    columns = {"class_column": "fclass", "id_column": "osm_id"}
    file = tmp_path / "roads.gpkg"
    write_layer(ROADS, file)
    layer = read_layer_roads(file, TOWN.crs, wide(TOWN, 6.0), **columns)
    here = TOWN.crs, TOWN.bounds_m
    expected = route_lattice(
        layer.ways,
        layer.areas,
        read_layer_buildings(HOUSES, *here),
        TOWN,
        water=read_layer_water(LAKE, *here),
    )
    options = {"buildings": HOUSES, "water": LAKE, **columns}
    same(read_routes(file, TOWN, **options), expected)
    # In degrees, numbered otherwise, and with another name of the geometry.
    table = ROADS.to_crs("EPSG:4326").set_index("lanes").rename_geometry("shape")
    found = read_routes(table, TOWN, **options)
    np.testing.assert_array_equal(found.point, expected.point)
    np.testing.assert_array_equal(found.way_id, expected.way_id)
    alone = read_routes(ROADS, TOWN, half_width_by_class_m={"primary": 0.0}, **columns)
    assert set(alone.way_id.tolist()) == {900}


def test_ways_of_tracks():
    east = np.arange(WEST + 20, WEST + 200, 5.0)
    ways = corridors(TOWN.crs, [Positions(east, np.full(east.size, SOUTH + 100.0))]).ways
    found = read_routes(ways, TOWN, half_width_m=10.0)
    same(found, route_lattice(ways, None, None, TOWN, 10.0))


def test_land_use_decides_and_roads_name_the_ways(tmp_path):
    table = tmp_path / "classes.csv"
    table.write_text("class,value,walkable\nstreet,1,1\nhouse,2,0\n")
    codes = np.full((1, TOWN.rows, TOWN.cols), 2, np.uint8)
    codes[:, TOWN.rows // 2 :] = 1
    profile = {"driver": "GTiff", "count": 1, "dtype": "uint8", "crs": TOWN.crs}
    profile |= {"height": TOWN.rows, "width": TOWN.cols}
    profile["transform"] = rasterio.Affine.from_gdal(*TOWN.gdal_transform)
    with rasterio.open(tmp_path / "landuse.tif", "w", **profile) as target:
        target.write(codes)
    landuse = tmp_path / "landuse.tif", table
    for roads, has_ways in ((None, False), (ROADS, True)):
        found = read_routes(roads, TOWN, landuse=landuse)
        np.testing.assert_array_equal(found.mask(), codes[0] == 1)
        assert (found.way_id > 0).any() == has_ways


@pytest.mark.parametrize(
    ("roads", "message"),
    [
        (None, "roads: expected a map, a layer or ways; or landuse, found none"),
        ("town.pbf", "town.pbf: expected a map .* found no such file"),
        ("town.gpkg", "town.gpkg: expected a vector file, found no such file"),
        (ROADS.set_crs(None, allow_override=True), "GeoDataFrame, crs: .*set_crs"),
        (geopandas.GeoDataFrame({"a": [1]}), "GeoDataFrame: expected a geometry column"),
        (ROADS.iloc[:0], "GeoDataFrame, area .*: expected features in the area"),
        (ROADS.assign(geometry=shapely.Point(WEST, SOUTH)), "expected lines or polygons"),
    ],
)
def test_what_gives_no_roads_is_refused(roads, message):
    with pytest.raises(InputError, match=message):
        read_routes(roads, TOWN)


@pytest.mark.parametrize("roads", [ROADS.geometry, list(ROADS.geometry), {"a": 1}])
def test_lines_that_are_no_layer_are_told_what_one_is(roads):
    with pytest.raises(ConfigError) as caught:
        read_routes(roads, TOWN)
    (fault,) = caught.value.faults
    assert fault.expected == "the path or name of a map, a GeoDataFrame, or ways"
