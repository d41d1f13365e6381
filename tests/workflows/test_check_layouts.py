"""Check with roads of layers and tracks, a public list of cells, ground truth, surveyed rasters."""

import geopandas
import numpy as np
import pytest
import rasterio
import shapely
from check_world import CRS, LATTICE, SITES, box_deg, make_world, write_tiff
from command_line import mapfilter

from mapfilter.geodesy import unproject
from mapfilter.propagation.models import PredictionModel
from mapfilter.propagation.predict import predict
from mapfilter.radio.cells import Cell, CellPlan

OWN_LIST = [f"244-5-1-{number}" for number in (1, 2, 3)]


@pytest.fixture
def world(tmp_path, levels):
    world = make_world(tmp_path, levels)
    world.landuse = None
    return world


def found(world, *settings, rewrite=lambda text: text):
    world.write()
    world.toml.write_text(rewrite(world.toml.read_text(encoding="utf-8")), encoding="utf-8")
    outcome = mapfilter("check", "-c", world.toml, "--json", *settings)
    assert outcome.err == ""
    return [(finding["code"], finding["severity"]) for finding in outcome.json["findings"]]


def streets_at(east_m=0.0):
    """A grid of streets over the lattice, perhaps moved."""
    west, south, east, north = LATTICE.bounds_m
    across = [((west, y), (east, y)) for y in np.arange(south + 50, north, 150)]
    along = [((x, south), (x, north)) for x in np.arange(west + 50, east, 150)]
    lines = shapely.linestrings([*across, *along])
    return shapely.transform(lines, lambda xy: xy + np.array([east_m, 0.0]))


def write_layer(world, east_m=0.0):
    path = world.folder / "streets.geojson"
    geopandas.GeoDataFrame(geometry=streets_at(east_m), crs=CRS).to_crs(4326).to_file(path)
    return f"--set=roads.layer={path}"


def write_tracks(world, east_m=0.0):
    """Drives along the streets, a reading each 20 m."""
    rows = ["cell,lat,lon,level_dbm,time,accuracy_m"]
    for line in streets_at(east_m):
        places = shapely.segmentize(line, 20.0)
        lon, lat = unproject(CRS, *shapely.get_coordinates(places).T)
        for x, y in zip(lon, lat, strict=True):
            rows.append(f"S1A,{y:.7f},{x:.7f},-80,{1.6e9 + 2 * len(rows)},5")
    path = world.folder / "tracks.csv"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return f"--set=roads.tracks.files={path}"


def without_box(text):
    return "\n".join(line for line in text.splitlines() if not line.startswith(("bbox", "map")))


@pytest.mark.parametrize("write", [write_layer, write_tracks])
class TestRoadsThatReplaceTheMap:
    def test_nothing_is_found_in_clean_ones(self, write, world):
        assert found(world, "--set=area.map=none", write(world)) == []

    def test_the_map_is_not_asked_where_the_area_is(self, write, world):
        """The embedded map is the default; it is of another part of the town."""
        assert found(world, write(world), rewrite=without_box) == []

    def test_partly_outside_the_rasters(self, write, world):
        given = write(world, east_m=300.0)
        west, south, east, north = box_deg()
        wide = f"--set=area.bbox={west},{south},{east + 0.004},{north}"
        codes = found(world, "--set=area.map=none", wide, given)
        assert codes == [("roads-outside-rasters", "warning")]

    def test_of_another_place(self, write, world):
        codes = found(world, "--set=area.map=none", write(world, east_m=30_000.0))
        assert codes == [("roads-invalid", "error")]


@pytest.fixture
def public(world):
    """Three cells of a public list, each with its raster."""
    rows = ["radio,mcc,net,area,cell,unit,lon,lat,range,samples,changeable,created,updated,average"]
    cells = []
    for cell_id, (east_m, north_m, _) in zip(OWN_LIST, SITES.values(), strict=True):
        lon, lat = unproject(CRS, [east_m], [north_m])
        rows.append(f"LTE,244,5,1,{cell_id[-1]},0,{lon[0]:.6f},{lat[0]:.6f},1000,9,1,1,1,0")
        cells.append(
            Cell(cell_id, cell_id, east_m, north_m, 30.0, None, 52.0, 1800.0, antenna="omni")
        )
    rows.append("LTE,244,5,1,9,0,28.1,61.2,1000,9,1,1,1,0")
    (world.folder / "list.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    model = PredictionModel(model="log_distance", shadowing_db=6.0)
    plan = CellPlan(CRS, tuple(cells))
    world.levels = {name: np.array(values) for name, values in predict(plan, LATTICE, None, model)}
    world.set(f"--set=cells.plan={world.folder / 'list.csv'}", "--set=cells.layout=opencellid")
    return world


def test_nothing_is_found_in_a_clean_public_list(public):
    assert found(public, *public.settings) == []


def test_a_cell_of_a_public_list_without_raster(public):
    public.levels.pop(OWN_LIST[1])
    assert found(public, *public.settings) == [("cell-without-raster", "error")]


def test_exchanged_rasters_of_a_public_list(public):
    one, two, _ = OWN_LIST
    public.rename({one: two, two: one})
    assert found(public, *public.settings) == [("site-labels-swapped", "error")]


def given_ground_truth(world, levels):
    path = world.folder / "other.tif"
    write_tiff(path, LATTICE, levels, "level")
    return f"--set=rasters.ground_truth={path}"


def test_ground_truth_is_looked_at_like_the_rasters(world, levels):
    assert found(world, given_ground_truth(world, levels)) == []
    swapped = levels | {"S1A": levels["S1C"], "S1C": levels["S1A"]}
    assert found(world, given_ground_truth(world, swapped)) == [("sector-labels-swapped", "error")]
    raw = {name: np.clip(np.floor(v + 111), 0, 63) for name, v in levels.items()}
    assert found(world, given_ground_truth(world, raw)) == [("rxlev-as-level", "error")]


def test_ground_truth_that_is_not_there(world):
    given = f"--set=rasters.ground_truth={world.folder / 'none.tif'}"
    assert found(world, given) == [("ground-truth-missing", "warning")]


def test_lobes_of_surveyed_rasters_are_passed_over(world):
    world.rename({"S1A": "S1C", "S1C": "S1A"})
    assert found(world) == [("sector-labels-swapped", "error")]
    with rasterio.open(world.rasters, "r+") as target:
        target.update_tags(MODEL="survey gp")
    outcome = mapfilter("check", "-c", world.toml, "--json")
    assert outcome.json["findings"] == []


def test_a_misspelt_antenna(world):
    world.row("S2A")["antenna"] = "sectr"
    world.write()
    outcome = mapfilter("check", "-c", world.toml, "--json")
    (finding,) = outcome.json["findings"]
    assert (finding["code"], finding["severity"]) == ("antenna-missing", "warning")
    assert "Did you mean 'sector' in place of 'sectr'?" in finding["evidence"]


def test_antennas_matter_little_beside_rasters_that_cannot_be_read(world):
    """A database takes its levels from these rasters, once they are mended."""
    world.row("S2A")["antenna"] = "sectr"
    world.write()
    world.rasters.write_bytes(b"no raster")
    outcome = mapfilter("check", "-c", world.toml, "--json")
    codes = {(f["code"], f["severity"]) for f in outcome.json["findings"]}
    assert codes == {("rasters-invalid", "error"), ("antenna-missing", "warning")}
