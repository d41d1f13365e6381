"""Roads, buildings and water from vector files, in the formats that GDAL and geopandas write."""

import re
import zipfile

import geopandas
import numpy as np
import pandas as pd
import pytest
import shapely
from made_maps import AREA, CRS, ORIGIN, write_pbf

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.roads.layers import read_layer_buildings, read_layer_roads, read_layer_water
from mapfilter.roads.osm import read_water
from mapfilter.roads.route_points import route_lattice
from mapfilter.roads.routes import read_roads, read_routes

FORMATS = ("roads.shp", "roads.gpkg", "roads.geojson", "roads.fgb", "roads.parquet", "roads.gml",
           "roads.sqlite", "roads.shp.zip")  # fmt: skip


def at(*corners):
    return [(ORIGIN[0] + x, ORIGIN[1] + y, *z) for x, y, *z in corners]


def line(*corners):
    return shapely.LineString(at(*corners))


def box(west, south, east, north):
    return shapely.box(ORIGIN[0] + west, ORIGIN[1] + south, ORIGIN[0] + east, ORIGIN[1] + north)


ROADS = geopandas.GeoDataFrame(
    {
        "fclass": ["footway", "primary", "primary", "footway"],
        "osm_id": ["900", "20", "30", "40"],
        "lanes": [1, 4, 2, 1],
    },
    geometry=[
        line((10, 10), (60, 10)),
        shapely.MultiLineString([at((0, 50), (50, 50)), at((60, 50), (500, 50))]),
        line((-1000, 200), (1400, 200)),
        line((5000, 5000), (5100, 5000)),
    ],
    crs=CRS,
)

HOUSES = geopandas.GeoDataFrame(
    {
        "hoehe": [21.5, None, None],
        "etagen": ["5", "4;5", None],
    },
    geometry=[box(10, 10, 30, 30), box(50, 10, 70, 30), box(-20, 100, 20, 120)],
    crs=CRS,
)


def write(frame, path, **options):
    if path.suffix == ".parquet":
        frame.to_parquet(path)
    elif path.name.endswith(".zip"):
        write(frame, path.with_name("inner.shp"))
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for part in path.parent.glob("inner.*"):
                archive.write(part, part.name)
    else:
        if path.suffix == ".sqlite":
            options["driver"] = "SQLite"
        frame.to_file(path, **options)
    return path


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("crs", [CRS, "EPSG:4326", "EPSG:3035"])
def test_every_format_in_any_crs(tmp_path, name, crs):
    path = write(ROADS.to_crs(crs), tmp_path / name)
    found = read_layer_roads(path, *AREA, class_column="fclass", id_column="osm_id")
    assert found.ways.way_id.tolist() == [20, 20, 30, 900]
    assert [found.ways.class_names[code] for code in found.ways.way_class] == (
        ["primary", "primary", "primary", "footway"]
    )
    lengths = shapely.length(found.ways.geometry)
    np.testing.assert_allclose(lengths, [50, 340, 400, 50], atol=0.05)
    assert not len(found.areas)
    assert not found.notes


@pytest.mark.parametrize("order", [[3, 1, 0, 2], [2, 3, 1, 0]])
def test_lines_may_come_in_any_order_and_direction(order):
    turned = ROADS.iloc[order]
    turned = turned.set_geometry(turned.geometry.reverse())
    lattice, columns = (
        Lattice.covering(*AREA, 5.0),
        {"class_column": "fclass", "id_column": "osm_id"},
    )
    usual, found = (read_routes(one, lattice, **columns) for one in (ROADS, turned))
    assert len(usual) > 300
    for name in ("row", "col", "way_id", "distance_to_way_m"):
        np.testing.assert_array_equal(getattr(found, name), getattr(usual, name))


def test_features_are_numbered_when_nobody_names_them(tmp_path):
    found = read_layer_roads(write(ROADS, tmp_path / "a.shp"), *AREA)
    assert sorted(set(found.ways.way_id.tolist())) == [1, 2, 3]
    assert found.ways.class_names == ("road",)


def test_classes_are_words_or_numbers(tmp_path):
    frame = ROADS.assign(code=[5111.0, None, 3.5, 7.0], word=["", None, " lane ", "x"])
    path = write(frame, tmp_path / "a.gpkg")
    assert read_layer_roads(path, *AREA, class_column="code").ways.class_names == (
        ("3.5", "5111", "road")
    )
    assert read_layer_roads(path, *AREA, class_column="word").ways.class_names == ("lane", "road")
    assert read_layer_roads(path, *AREA, class_column="lanes").ways.class_names == ("1", "2", "4")


@pytest.mark.parametrize(("words", "kind"), [([1, None, 2, 1], "Int64"), ([*"1N21"], "string")])
def test_classes_may_lack_in_tables_of_nullable_types(tmp_path, words, kind):
    code = pd.array([None if word == "N" else word for word in words], dtype=kind)
    frame = ROADS.assign(code=code)
    path = write(frame, tmp_path / "a.parquet")
    for source in (frame, path):
        ways = read_layer_roads(source, *AREA, class_column="code").ways
        assert ways.class_names == ("1", "2", "road")


def test_half_widths_go_by_class(tmp_path):
    path = write(ROADS, tmp_path / "a.shp")
    ways = read_layer_roads(path, *AREA, class_column="fclass").ways
    lattice = Lattice.covering(CRS, AREA[1], 5.0)
    widths = {"primary": 12.0, "footway": 0.0}
    routes = route_lattice(ways, None, None, lattice, half_width_by_class_m=widths)
    assert set(routes.class_names) == {"footway", "primary", "square"}
    rows = np.unique(routes.row[routes.way_id == 3])
    assert rows.size == 4  # 2.5 and 7.5 m to either side of the street at 200 m
    assert not np.any(routes.way_id == 1)


def test_vehicles_have_no_footways_of_a_layer(tmp_path):
    path = write(ROADS, tmp_path / "a.gpkg")
    lattice = Lattice.covering(CRS, AREA[1], 5.0)

    def read(**options):
        return read_roads(path, lattice, **{"class_column": "fclass", **options})

    assert set(read().ways.class_names) == {"footway", "primary"}
    driven = read(profile="driving")
    assert driven.ways.class_names == ("primary",)
    assert driven.notes[-1].startswith("profile driving: 1 way left out, of classes footway; ")
    kept = read(profile="driving", half_width_by_class_m={"footway": 3.0})
    assert set(kept.ways.class_names) == {"footway", "primary"}
    numbered = read(profile="driving", class_column="lanes")
    assert "no class of the layer is known as a road or a footway (1, 2, 4)" in numbered.notes[-1]
    with pytest.raises(InputError, match="ways for vehicles in the area, found only footway"):
        read_roads(
            write(ROADS[ROADS["fclass"] == "footway"], tmp_path / "b.gpkg"),
            lattice,
            profile="driving",
            class_column="fclass",
        )


def test_polygons_of_roads_are_areas(tmp_path):
    bow = shapely.Polygon(at((100, 100), (140, 140), (140, 100), (100, 140)))
    frame = geopandas.GeoDataFrame({"a": [1, 2]}, geometry=[box(-20, 10, 30, 20), bow], crs=CRS)
    found = read_layer_roads(write(frame, tmp_path / "a.fgb"), *AREA)
    assert not len(found.ways)
    assert set(found.areas.area_id.tolist()) == {1, 2}
    assert shapely.area(found.areas.geometry).sum() == pytest.approx(300 + 800)
    routes = route_lattice(found.ways, found.areas, None, Lattice.covering(CRS, AREA[1], 5.0))
    assert routes.on_square.all()
    named = read_layer_roads(tmp_path / "a.fgb", *AREA, class_column="a", id_column="a")
    assert set(named.areas_without(["2"]).area_id.tolist()) == {1}


def test_heights_and_missing_shapes_are_no_trouble(tmp_path):
    frame = geopandas.GeoDataFrame(
        {"a": [1, 2, 3]},
        geometry=[line((0, 10, 7.0), (50, 10, 8.0)), None, shapely.LineString()],
        crs=CRS,
    )
    found = read_layer_roads(write(frame, tmp_path / "a.gpkg"), *AREA)
    assert len(found.ways) == 1
    assert not shapely.has_z(found.ways.geometry).any()


def test_one_of_several_layers_is_named(tmp_path):
    path = write(ROADS, tmp_path / "a.gpkg", layer="roads")
    write(HOUSES, path, layer="houses")
    with pytest.raises(InputError, match=r"one of its layers: roads, houses|houses, roads"):
        read_layer_roads(path, *AREA)
    with pytest.raises(InputError, match="likely: 'roads'"):
        read_layer_roads(path, *AREA, layer_name="road")
    assert len(read_layer_roads(path, *AREA, layer_name="roads").ways) == 4
    with pytest.raises(InputError, match="polygons in the area, found MultiLineString"):
        read_layer_buildings(path, *AREA, layer_name="roads")


def test_columns_that_are_not_there_or_hold_other_things(tmp_path):
    path = write(ROADS, tmp_path / "a.gpkg")
    with pytest.raises(InputError, match="likely: 'fclass'"):
        read_layer_roads(path, *AREA, class_column="class")
    with pytest.raises(InputError, match="whole numbers > 0, found 'footway'"):
        read_layer_roads(path, *AREA, id_column="fclass")


def test_heights_of_buildings(tmp_path):
    path = write(HOUSES, tmp_path / "a.gpkg")
    columns = {"height_column": "hoehe", "levels_column": "etagen"}
    found = read_layer_buildings(path, *AREA, **columns, default_height_m=9, storey_height_m=3)
    assert found.height_m.tolist() == [21.5, 12.0, 9.0]
    assert (found.from_height, found.from_levels, found.from_default) == (1, 1, 1)
    plain = read_layer_buildings(path, *AREA)
    assert plain.height_m.tolist() == [12.0] * 3
    assert "the default for 3" in plain.height_sources


def test_water_of_a_layer_and_of_a_map(tmp_path):
    lake = geopandas.GeoDataFrame({"a": [1]}, geometry=[box(-100, 100, 100, 200)], crs=CRS)
    path = write(lake, tmp_path / "a.shp")
    assert shapely.area(read_layer_water(path, *AREA).geometry).sum() == pytest.approx(10_000)
    west, south, east, north = AREA[1]
    far = (west + 1e4, south, east + 1e4, north)
    assert not len(read_layer_water(path, CRS, far))
    with pytest.raises(InputError, match="polygons, found LineString"):
        read_layer_water(write(ROADS[:1], tmp_path / "b.gpkg"), *AREA)
    ring = [(50, 50), (90, 50), (90, 80), (50, 80), (50, 50)]
    kinds = [
        ({"natural": "water"}, True), ({"waterway": "riverbank"}, True),
        ({"landuse": "reservoir"}, True), ({"natural": "water", "tunnel": "culvert"}, False),
        ({"natural": "water", "location": "underground"}, False),
        ({"natural": "water", "intermittent": "yes"}, False), ({"natural": "wood"}, False),
        ({"waterway": "river"}, False),
    ]  # fmt: skip
    for number, (tags, is_water) in enumerate(kinds):
        made = write_pbf(tmp_path / f"{number}.osm.pbf", [(3, tags, ring)])
        assert (len(read_water(made, *AREA)) == 1) is is_water, tags


def test_files_of_other_places_are_told_with_the_likely_mistake(tmp_path):
    swapped = ROADS.to_crs("EPSG:4326")
    swapped = swapped.set_geometry(shapely.transform(swapped.geometry, lambda xy: xy[:, ::-1]))
    metres = ROADS.set_crs("EPSG:4326", allow_override=True)
    far = ROADS[3:]
    for name, frame, message in (
        ("a.gpkg", swapped, "longitude and latitude swapped"),
        ("b.gpkg", metres, "another CRS left out on export"),
        ("c.gpkg", far, "the area lies outside the layer"),
        ("d.shp", ROADS, "the .prj file was left behind"),
    ):
        path = write(frame, tmp_path / name)
        path.with_suffix(".prj").unlink(missing_ok=True)
        with pytest.raises(InputError, match=message) as caught:
            read_layer_roads(path, *AREA)
        assert name in str(caught.value)


@pytest.mark.parametrize(
    ("prj", "told"),
    [
        (b"", "a.prj is empty: copy it again"),
        (b"not found", "a.prj holds none that is known: copy it again"),
        (b"\xff\xfe\0", "a.prj holds none that is known: copy it again"),
        (None, r"expected a CRS that is known, found .* \(likely: a .prj file that was cut off"),
    ],
)
def test_a_prj_that_is_damaged_is_named(tmp_path, prj, told):
    path = write(ROADS, tmp_path / "a.shp")
    beside = path.with_suffix(".prj")
    beside.write_bytes(beside.read_bytes()[:100] if prj is None else prj)
    with pytest.raises(InputError, match=r"a\.shp, crs: ") as refused:
        read_layer_roads(path, *AREA)
    assert re.search(told, str(refused.value))


@pytest.mark.parametrize("name", ["a.gpkg", "a.parquet"])
@pytest.mark.parametrize("heights", ["+5773", "+3900"])
def test_heights_of_a_layer_are_left_out(tmp_path, name, heights):
    flat = ROADS.to_crs("EPSG:4326")
    expected = read_layer_roads(write(flat, tmp_path / "b.gpkg"), *AREA)
    tall = flat.set_crs(f"EPSG:4326{heights}", allow_override=True)
    found = read_layer_roads(write(tall, tmp_path / name), *AREA)
    pairs = zip(found.ways.geometry, expected.ways.geometry, strict=True)
    assert all(shapely.equals_exact(one, other, 1e-6) for one, other in pairs)
    assert len(found.ways.geometry)


@pytest.mark.parametrize("name", ["a.shp", "a.gpkg", "a.geojson", "a.fgb", "a.parquet", "a.gml"])
@pytest.mark.parametrize("keep", [0, 10, 0.3, 0.6, 0.95])
def test_cut_off_files_are_refused(tmp_path, name, keep):
    many = geopandas.GeoDataFrame(
        {"fclass": ["path"] * 400},
        geometry=[line((i, 10), (i + 60, 10 + i / 2)) for i in range(400)],
        crs=CRS,
    )
    path = write(many, tmp_path / name)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(keep * len(whole)) if keep < 1 else keep])
    with pytest.raises(InputError, match=name):
        read_layer_roads(path, *AREA)


def test_what_is_no_vector_file(tmp_path):
    (tmp_path / "points.csv").write_text("a,b\n1,2\n")
    (tmp_path / "a.vrt").write_text("<OGRVRTDataSource><OGRVRTLayer/></OGRVRTDataSource>")
    (tmp_path / "folder").mkdir()
    with zipfile.ZipFile(tmp_path / "bomb.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for number in range(120):
            archive.writestr(f"{number}.shp", b" " * (1 << 20))
    for name, message in (
        ("none.shp", "no such file"),
        ("points.csv", "a vector file that GDAL reads"),
        ("a.vrt", "leads to other places"),
        ("folder", "a folder"),
        ("bomb.zip", "decompression bomb"),
    ):
        with pytest.raises(InputError, match=message):
            read_layer_roads(tmp_path / name, *AREA)


@pytest.mark.parametrize("name", ["a.shp", "a.gpkg", "a.geojson", "a.fgb", "a.parquet"])
def test_empty_layers(tmp_path, name):
    path = write(ROADS[:0], tmp_path / name)
    with pytest.raises(InputError, match=name):
        read_layer_roads(path, *AREA)


@pytest.mark.parametrize("crs", [CRS, "EPSG:4326"])
def test_an_area_in_another_zone_is_told_with_the_zone_that_fits(crs, tmp_path):
    path = write(ROADS[:1].to_crs(crs), tmp_path / "a.gpkg")
    for zone in ("EPSG:32628", "EPSG:32630"):
        told = rf"none: the area is 50\d km away, and would be there as numbers of {CRS} instead "
        with pytest.raises(InputError, match=f"{told}of {zone} .*is of another zone"):
            read_layer_roads(path, zone, AREA[1])
    with pytest.raises(InputError, match=r"found none \(likely: the area lies outside"):
        read_layer_roads(path, "EPSG:3035", AREA[1])
