"""Damaged maps and layers: refused in plain words, or read in peace."""

import gzip
import io
import tempfile
import zipfile

import geopandas
import pytest
import shapely
from fuzz import fuzz
from made_maps import AREA, CRS, ORIGIN, write_pbf, write_xml

from mapfilter.lattice import Lattice
from mapfilter.roads.buildings import rasterise_heights, read_buildings
from mapfilter.roads.layers import read_layer_buildings, read_layer_roads, read_layer_water
from mapfilter.roads.osm import read_squares, read_water, read_ways
from mapfilter.roads.route_points import route_lattice

LATTICE = Lattice.covering(CRS, AREA[1], 5.0)

RING = [(50, 50), (90, 50), (90, 80), (50, 80), (50, 50)]
BOW = [(200, 200), (240, 240), (240, 200), (200, 240), (200, 200)]
WAYS = [
    (1, {"highway": "residential", "oneway": "yes"}, [(10, 10), (60, 10), (61, 40)]),
    (2, {"highway": "footway", "area": "yes"}, RING),
    (3, {"building": "yes", "height": "12.5 m", "building:levels": "4"}, BOW),
    (4, {"natural": "water"}, [(x + 100, y) for x, y in RING]),
    (5, {}, [(300, 300), (340, 300), (340, 340)]),
    (6, {}, [(340, 340), (300, 340), (300, 300)]),
]
RELATIONS = [(7, {"building": "house"}, [5, 6])]


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    """Whatever readers keep for another time goes away with the test."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


def osm_readers():
    yield lambda path: route_lattice(
        read_ways(path, "walking", *AREA), None, None, LATTICE, water=None
    )
    yield lambda path: rasterise_heights(read_buildings(path, *AREA), LATTICE)
    yield lambda path: read_squares(path, *AREA)
    yield lambda path: read_water(path, *AREA)


@pytest.mark.parametrize("name", ["map.osm.pbf", "map.osm", "map.osm.gz"])
def test_maps(tmp_path, mutation_count, name):
    path = tmp_path / name
    write = write_pbf if name.endswith(".pbf") else write_xml
    sample = write(path, WAYS, RELATIONS).read_bytes()
    readers = list(osm_readers())
    for read in readers:
        read(path)
    turn = iter(range(10**9))

    def read(data):
        path.write_bytes(data)
        readers[next(turn) % len(readers)](path)

    tally = fuzz(sample, read, mutation_count)
    assert tally.refused > 0


def test_maps_damaged_before_they_were_packed(tmp_path, mutation_count):
    """A good archive of a bad map: what the archive's checksum does not find."""
    path = tmp_path / "map.osm.gz"
    sample = write_xml(tmp_path / "map.osm", WAYS, RELATIONS).read_bytes()

    def read(data):
        path.write_bytes(gzip.compress(data, 1))
        route_lattice(read_ways(path, "walking", *AREA), None, None, LATTICE)

    tally = fuzz(sample, read, mutation_count // 3 + 1, seed=1)
    assert tally.refused > 0


def layer_readers():
    yield lambda path: route_lattice(
        read_layer_roads(path, *AREA, class_column="kind", id_column="number").ways,
        None,
        None,
        LATTICE,
    )
    yield lambda path: rasterise_heights(
        read_layer_buildings(path, *AREA, height_column="height", levels_column="number"), LATTICE
    )
    yield lambda path: read_layer_water(path, *AREA)


@pytest.mark.parametrize(
    "name",
    ["a.shp", "a.dbf", "a.shx", "a.gpkg", "a.geojson", "a.fgb", "a.parquet", "a.zip", "a.gml"],
)  # fmt: skip
@pytest.mark.parametrize("polygons", [False, True])
def test_layers(tmp_path, mutation_count, name, polygons):
    def placed(corners):
        return [(ORIGIN[0] + x, ORIGIN[1] + y) for x, y in corners]

    shape = shapely.Polygon if polygons else shapely.LineString
    frame = geopandas.GeoDataFrame(
        {"kind": ["a", "b", "c"], "number": [1, 2, 3], "height": [3.5, None, 9.0]},
        geometry=[shape(placed(RING)), shape(placed(BOW)), shape(placed(RING[:4]))],
        crs=CRS,
    )
    path = tmp_path / name
    opened = path
    if name == "a.parquet":
        frame.to_parquet(path)
    elif name == "a.zip":
        frame.to_file(tmp_path / "inner.shp")
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w") as packed:
            for part in sorted(tmp_path.glob("inner.*")):
                packed.write(part, part.name)
        path.write_bytes(archive.getvalue())
    elif path.suffix in (".shp", ".dbf", ".shx"):
        opened = tmp_path / "a.shp"
        frame.to_file(opened)
    else:
        frame.to_file(path)
    readers = list(layer_readers())
    chosen = readers[1:] if polygons else readers[:1]
    for read in chosen:
        read(opened)
    sample, turn = path.read_bytes(), iter(range(10**9))

    def read(data):
        path.write_bytes(data)
        chosen[next(turn) % len(chosen)](opened)

    tally = fuzz(sample, read, mutation_count // 3 + 1)
    assert tally.read + tally.refused > 0
