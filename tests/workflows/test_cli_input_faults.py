"""Wrong maps, cell plans and land-use rasters: one message, exit code 2, nothing written."""

import numpy as np
import pytest
import rasterio
from command_line import assert_done, assert_refused, contents, mapfilter, settings

from mapfilter.roads.maps import resolve_map


@pytest.mark.parametrize("command", ["predict", "build", "simulate"])
@pytest.mark.parametrize(
    ("name", "keep", "told"),
    [
        ("none.osm.pbf", None, "none.osm.pbf: expected a map (.osm.pbf, .pbf, .osm, .osm.gz), or"),
        ("map.osm.pbf", 0, "map.osm.pbf: expected a map, found an empty file"),
        ("map.osm.pbf", 300_000, "map.osm.pbf: expected a whole .osm.pbf file"),
        ("map.osm.pbf", 50, "map.osm.pbf: expected a whole .osm.pbf file"),
        ("map.o5m", 1000, "map.o5m: expected a map (.osm.pbf, .pbf, .osm, .osm.gz), found .o5m"),
        ("map.osm.gz", 1000, "map.osm.gz: expected a whole OpenStreetMap XML file, found Not a"),
    ],
)
def test_maps(command, name, keep, told, own_world):
    file = own_world.folder / name
    if keep is not None:
        file.write_bytes(resolve_map("helsinki").read_bytes()[:keep])
    before = contents(own_world.folder)
    assert_refused(mapfilter(command, "-c", own_world.toml, *settings(area__map=file)), told)
    assert contents(own_world.folder) == before


def test_a_text_file_called_pbf(own_world):
    file = own_world.folder / "map.osm.pbf"
    file.write_text("<osm/>" * 1000)
    refused = mapfilter("predict", "-c", own_world.toml, *settings(area__map=file))
    assert_refused(refused, "cut off, or another format under this name")


GOOD = "A,S1,60.16690,24.94300,30,60,50,1825.2,612,17"
PLAN_FAULTS = [
    (GOOD, "A,S1,24.94300,60.16690,30,60,50,1825.2,612,17", "row 2, lat, lon", "swapped"),
    (GOOD, "A,S1,6671700,385800,30,60,50,1825.2,612,17", "row 2", "metres given for degrees"),
    (GOOD, "A,S1,nan,24.94300,30,60,50,1825.2,612,17", "row 2, lat", "found nan"),
    (GOOD, "A,S1,60.16690,inf,30,60,50,1825.2,612,17", "row 2, lon", "found inf"),
    (GOOD, "A,S1,60.16690,24.94300,30,60,50", "row 2, fields", "found 7"),
    (GOOD, "B,S1,60.16690,24.94300,30,60,50,1825.2,612,17", "'B'", "found"),
    (GOOD, "../../etc,S1,60.16690,24.94300,30,60,50,1825.2,612,17", "row 2, cell", "without /"),
    (GOOD, "A/1,S1,60.16690,24.94300,30,60,50,1825.2,612,17", "row 2, cell", "'A/1'"),
    (GOOD, "A\\1,S1,60.16690,24.94300,30,60,50,1825.2,612,17", "row 2, cell", "found"),
    (GOOD, "A,S1,60.16690,24.94300,30,60,50,1825200000,612,17", "row 2", "Hz given for MHz"),
    ("cell,site,lat,lon", "cell,site,latt,lon", "header", "lat meant"),
]


@pytest.mark.parametrize(("old", "new", "where", "told"), PLAN_FAULTS)
def test_plans(old, new, where, told, own_world):
    text = own_world.plan.read_text(encoding="utf-8")
    assert old in text
    own_world.plan.write_text(text.replace(old, new), encoding="utf-8")
    before = contents(own_world.folder)
    for command in ("predict", "build", "simulate"):
        assert_refused(mapfilter(command, "-c", own_world.toml), "cells.csv", where, told)
    assert contents(own_world.folder) == before


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (None, "No such file or directory"),
        (b"", "found nothing (likely: an empty file)"),
        (b"cell,site,lat,lon,height_m,eirp_dbm,frequency_mhz\n", "a header without rows"),
        (b"\xff\xfe\x00", "text in UTF-8"),
    ],
)
def test_plans_that_are_no_table(text, told, own_world):
    own_world.plan.unlink()
    if text is not None:
        own_world.plan.write_bytes(text)
    before = contents(own_world.folder)
    assert_refused(mapfilter("predict", "-c", own_world.toml), "cells.csv", told)
    assert contents(own_world.folder) == before


def test_all_faults_of_a_plan_are_told_together(own_world):
    text = own_world.plan.read_text(encoding="utf-8")
    text = text.replace("60.16690,24.94300,30,60", "24.94300,60.16690,0,60")
    text = text.replace("C,S2", "B,S2")
    own_world.plan.write_text(text, encoding="utf-8")
    refused = mapfilter("predict", "-c", own_world.toml)
    assert_refused(refused, "row 2, height_m", "row 2, lat, lon", "row 4, cell", "'B'")


def test_a_plan_of_another_place(own_world):
    text = own_world.plan.read_text(encoding="utf-8").replace(",60.1", ",41.1")
    own_world.plan.write_text(text.replace(",24.9", ",-8.6"), encoding="utf-8")
    refused = mapfilter("predict", "-c", own_world.toml)
    assert_refused(refused, "cells.csv row 2, lat, lon", "a cell of another place, or another CRS")


@pytest.fixture
def landuse(own_world):
    """A land-use raster of streets (7) and houses (9) over the world, and its table."""
    raster, table = own_world.folder / "use.tif", own_world.folder / "use.csv"
    with rasterio.open(own_world.rasters) as source:
        profile = {**source.profile, "count": 1, "dtype": "uint8", "nodata": 0, "driver": "GTiff"}
    values = np.full((profile["height"], profile["width"]), 9, np.uint8)
    values[:, ::8] = 7
    with rasterio.open(raster, "w", **profile) as target:
        target.write(values, 1)
    table.write_text("class,value,walkable\nstreet,7,1\nhouse,9,0\n")
    given = settings(roads__landuse=raster, roads__landuse_table=table)
    return raster, table, given


def test_landuse_replaces_the_ways(own_world, landuse):
    _, _, given = landuse
    found = assert_done(mapfilter("build", "-c", own_world.toml, *given, "--json")).json
    assert found["points"] == 86 * 11
    assert found["notes"] == []
    inputs = assert_done(mapfilter("info", own_world.database, "--json")).json["inputs"]
    names = {entry["role"]: entry["name"] for entry in inputs}
    assert names["landuse"] == "use.tif"
    assert names["landuse_table"] == "use.csv"
    assert names["plan"] == "cells.csv"
    assert names["rasters"] == "rxlev.tif"


def test_landuse_that_was_resampled_is_told(own_world, landuse):
    raster, _, given = landuse
    with rasterio.open(raster, "r+") as source:
        west, north = source.transform.c, source.transform.f
        source.transform = rasterio.Affine(6, 0, west, 0, -6, north)
    found = assert_done(mapfilter("build", "-c", own_world.toml, *given, "--json")).json
    assert "use.tif: pixels of 6 m resampled" in found["notes"][0]


def test_landuse_of_another_crs_or_cut_off(own_world, landuse):
    raster, table, given = landuse
    before = contents(own_world.database)
    whole = raster.read_bytes()
    with rasterio.open(raster, "r+") as target:
        target.crs = "EPSG:32634"
    assert_refused(mapfilter("build", "-c", own_world.toml, *given), "use.tif, crs", "EPSG:32634")
    for size in (0, len(whole) // 2):
        raster.write_bytes(whole[:size])
        assert_refused(mapfilter("build", "-c", own_world.toml, *given), "use.tif")
    raster.write_bytes(whole)
    table.write_text("class,value,walkable\nstreet,7,1\n")
    assert_refused(mapfilter("build", "-c", own_world.toml, *given), "value 9 at", "use.csv")
    for name in (raster, table):
        name.unlink()
        assert_refused(mapfilter("build", "-c", own_world.toml, *given), name.name)
    assert contents(own_world.database) == before


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("area.map=nowhere.osm.pbf", "nowhere.osm.pbf: expected a map"),
        ("area.crs=EPSG:4326", "area.crs: expected a projected CRS in metres"),
        ("area.bbox=2.3,48.8,2.32,48.82", "helsinki, area 2.2997, 48.7999"),
        ("cells.seed=3", "found No such file or directory (likely: not predicted yet"),
    ],
)
def test_what_keeps_rasters_from_being_predicted_is_told_before_that_there_are_none(
    setting, told, tmp_path
):
    refused = mapfilter("build", "--set", setting, "--out", tmp_path / "out")
    assert (refused.code, told in refused.err) == (2, True)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "given",
    ["[prediction]\nmodel = 'survey'\n", "[roads]\nlayer = 'roads.gpkg'\n"],
    ids=["survey", "own roads"],
)
def test_an_area_that_is_not_needed_is_not_asked_for(given, tmp_path):
    """A survey covers its measurements, and a planner's rasters are an area of their own."""
    (tmp_path / "given.toml").write_text(f"[area]\nmap = 'none'\n{given}")
    refused = mapfilter("build", "-c", tmp_path / "given.toml", "--out", tmp_path / "out")
    assert refused.code == 2
    assert "run mapfilter predict first, or set rasters.path" in refused.err
