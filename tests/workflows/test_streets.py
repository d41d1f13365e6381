"""Where one can be, from files that a configuration names in place of the map."""

import json

import geopandas
import numpy as np
import pytest
import rasterio
import shapely
from affine import Affine
from command_line import assert_done, assert_refused, mapfilter

from mapfilter.config.load import load_config
from mapfilter.database.store import open_database
from mapfilter.geodesy import unproject
from mapfilter.workflows.inputs.world import World

CRS = "EPSG:32635"
WEST, SOUTH = 385_800.0, 6_671_700.0
BOX = ["area.bbox=24.9420,60.1660,24.9495,60.1697", "area.crs=EPSG:32635"]

PLAN = """cell,site,lat,lon,height_m,azimuth_deg,eirp_dbm,frequency_mhz
A,S1,60.16690,24.94300,30,60,50,1825.2
B,S2,60.16890,24.94880,25,240,50,1827.6
"""

LAYERS = """[area]
map = "none"
bbox = [24.9420, 60.1660, 24.9495, 60.1697]
[cells]
plan = "cells.csv"
[buildings]
layer = "town.gpkg"
layer_name = "houses"
height_column = "height"
[roads]
layer = "town.gpkg"
layer_name = "streets"
class_column = "kind"
id_column = "number"
water_layer = "town.gpkg"
water_layer_name = "sea"
[roads.half_width_by_class_m]
street = 8.0
alley = 0.0
[prediction]
shadowing_db = 0.0
[prediction.ground_truth]
write = false
[journeys]
count = 1
length_m = 200
radio = "as_predicted"
"""


def line(*corners):
    return shapely.LineString([(WEST + x, SOUTH + y) for x, y in corners])


def box(west, south, east, north):
    return shapely.box(WEST + west, SOUTH + south, WEST + east, SOUTH + north)


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """Two crossing streets, an alley, a house on the crossing's corner, the sea in the south."""
    folder = tmp_path_factory.mktemp("town")
    streets = {
        "kind": ["street", "path", "alley"],
        "number": [11, 12, 13],
        "geometry": [
            line((-500, 100), (900, 100)),
            line((100, -500), (100, 900)),
            line((0, 200), (400, 200)),
        ],
    }
    houses = {"height": [20.0, None], "geometry": [box(105, 105, 140, 140), box(0, 300, 20, 320)]}
    for name, columns in (
        ("streets", streets),
        ("houses", houses),
        ("sea", {"geometry": [box(-900, -900, 900, 20)]}),
    ):
        geopandas.GeoDataFrame(columns, crs=CRS).to_file(folder / "town.gpkg", layer=name)
    (folder / "cells.csv").write_text(PLAN, encoding="utf-8")
    (folder / "town.toml").write_text(LAYERS, encoding="utf-8")
    return folder


def test_all_commands_run_without_a_map(town, tmp_path):
    arguments = ("-c", town / "town.toml", "--out", tmp_path)
    predicted = assert_done(mapfilter("predict", *arguments, "--json")).json
    assert predicted["notes"][0].startswith("2 buildings: height from the map for 1")
    built = assert_done(mapfilter("build", *arguments, "--json")).json
    assert "2 buildings cut out" in built["notes"]
    assert "1 water cut out, save under bridges" in built["notes"]
    database = open_database(tmp_path / "database")
    roles = [entry["role"] for entry in database.manifest["inputs"]]
    assert roles.count("roads") == 1
    assert "map" not in roles
    assert database.attribution == ""
    points = database.points()
    assert set(points.way_id.tolist()) == {11, 12}
    east, north = database.lattice.east_north(points.row, points.col)
    assert np.abs(north[points.way_id == 11] - SOUTH - 100).max() <= 8.0
    assert np.abs(east[points.way_id == 12] - WEST - 100).max() <= 6.0
    in_house = (np.abs(east - WEST - 122.5) < 17.5) & (np.abs(north - SOUTH - 122.5) < 17.5)
    assert not in_house.any()
    assert np.any(north < SOUTH)  # the path goes on, on a bridge or a pier
    assert_done(mapfilter("simulate", *arguments))


def test_layers_beside_a_map(town):
    config = load_config(
        None,
        [*BOX, f"roads.layer={town / 'town.gpkg'}", "roads.layer_name=streets"],
    )
    world = World.of(config)
    assert len(world.buildings) > 10
    assert set(world.ways.class_names) == {"road"}
    assert world.streets.attribution.startswith("© OpenStreetMap")


def test_ways_beyond_the_edge_reach_inside():
    settings = ["area.southwest=24.944,60.167", "area.size_m=200,200", "area.crs=EPSG:32635"]
    narrow = World.of(load_config(None, settings))
    wide = World.of(load_config(None, ["area.southwest=24.943,60.1665", "area.size_m=400,400"]))
    west, south, east, north = narrow.lattice.bounds_m
    x, y = wide.routes.east_north_m
    inside = (x > west) & (x < east) & (y > south) & (y < north)
    found = set(zip(*narrow.routes.east_north_m, strict=True))
    assert found == set(zip(x[inside].tolist(), y[inside].tolist(), strict=True))
    bounds = shapely.bounds(narrow.ways.geometry)
    assert bounds[:, 0].min() >= west
    assert bounds[:, 3].max() <= north


def test_half_widths_by_class_and_classes_that_no_way_has():
    settings = ["roads.half_width_by_class_m.footway=0", "roads.half_width_by_class_m.stepz=2"]
    streets = World.of(load_config(None, [*BOX, *settings])).streets
    names = np.array(streets.source.ways.ways.class_names)
    assert "footway" not in names[streets.source.ways.ways.way_class]
    assert any("no way in the area is a 'stepz'; did you mean 'steps'?" in n for n in streets.notes)


def test_a_class_that_no_way_has_is_noted_beside_land_use(tmp_path):
    transform = Affine(10, 0, WEST - 500, 0, -10, SOUTH + 900)
    shape = {"height": 150, "width": 150, "count": 1, "dtype": "uint8"}
    with rasterio.open(tmp_path / "u.tif", "w", crs=CRS, transform=transform, **shape) as target:
        target.write(np.ones((150, 150), dtype=np.uint8), 1)
    (tmp_path / "u.csv").write_text("value,class,walkable\n1,open,1\n")
    names = {"landuse": "u.tif", "landuse_table": "u.csv"}
    settings = [f"roads.{key}={tmp_path / name}" for key, name in names.items()]
    given = [*BOX, *settings, "roads.half_width_by_class_m.stepz=2"]
    notes = World.of(load_config(None, given)).streets.notes
    assert any("no way in the area is a 'stepz'" in note for note in notes)


def test_tracks_become_ways(tmp_path):
    rng = np.random.default_rng(3)
    rows = ["session,time,lat,lon,cell,level_dbm,accuracy_m"]
    for session in range(3):
        x = np.arange(0.0, 300.0, 6.0)
        lon, lat = unproject(
            CRS, WEST + x + rng.normal(0, 1, x.size), SOUTH + 100 + rng.normal(0, 1, x.size)
        )
        for i in range(x.size):
            at = f"{session},2021-01-0{session + 1}T00:{i:02d}:00Z,{lat[i]:.7f},{lon[i]:.7f}"
            rows += [f"{at},A,-70,5", f"{at},B,-80,5"]
    (tmp_path / "drive.csv").write_text("\n".join(rows) + "\n")
    settings = [*BOX, "area.map=none", f"roads.tracks.files={tmp_path / 'drive.csv'}"]
    world = World.of(load_config(None, [*settings, "roads.half_width_m=10"]))
    assert world.ways.class_names == ("corridor",)
    _, y = world.routes.east_north_m
    assert np.abs(y - SOUTH - 100).max() < 13
    assert any("10 m to either side of tracks" in note for note in world.streets.notes)
    assert [role for role, _ in world.streets.files] == ["tracks"]
    elsewhere = ["area.bbox=25.5,60.16,25.51,60.17", *settings[1:]]
    with pytest.raises(Exception, match="tracks of another place"):
        _ = World.of(load_config(None, elsewhere)).routes


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (["area.map=none"], "roads.layer, roads.raster or roads.tracks.files"),
        (
            [*BOX, "area.map=none"],
            "roads.layer, roads.raster or roads.tracks.files",
        ),
        (["roads.class_column=kind"], "layer with layer_name, class_column and id_column"),
        (["buildings.levels_column=x"], "layer with layer_name, height_column and levels_column"),
        (["roads.water_layer_name=x"], "water_layer with water_layer_name"),
        (
            ["roads.layer=a.shp", "roads.tracks.files=b.csv"],
            "layer, raster and tracks.files",
        ),
        (["roads.layer=none.shp"], "none.shp: expected a vector file, found no such file"),
        (["roads.half_width_by_class_m.path=-1"], "half_width_by_class_m.path"),
    ],
)
def test_what_does_not_go_together(tmp_path, settings, told):
    given = [word for setting in settings for word in ("--set", setting)]
    made = tmp_path / "out"
    predicted = mapfilter("predict", "--out", made, "--set", BOX[0])
    assert predicted.code == 0, predicted.err
    assert_refused(mapfilter("build", "--out", made, *given), told)


def test_notes_are_json(town, tmp_path):
    found = assert_done(mapfilter("predict", "-c", town / "town.toml", "--out", tmp_path, "--json"))
    assert isinstance(json.loads(found.out.splitlines()[-1])["notes"], list)
