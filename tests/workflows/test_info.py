"""``info`` says what files and folders of all kinds are, and where to use them."""

import gzip
import json
import shutil
import subprocess
import sys
from pathlib import Path

import geopandas
import numpy as np
import pytest
import rasterio
import shapely
from command_line import assert_done, assert_refused, mapfilter
from made_recordings import MADE
from pyproj import CRS

from mapfilter.errors import InputError
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.estimate_store import write_estimate, write_gpx
from mapfilter.positioning.step_output import Fix
from mapfilter.roads.maps import resolve_map
from mapfilter.workflows.info import run_info


def info(path):
    return assert_done(mapfilter("info", path, "--json")).json


def write_raster(path, values, **tags):
    with rasterio.open(
        path, "w", driver="GTiff", height=values.shape[0], width=values.shape[1], count=1,
        dtype=values.dtype, crs="EPSG:32632", transform=rasterio.Affine(2, 0, 100, 0, -2, 900),
    ) as target:  # fmt: skip
        target.write(values, 1)
        target.update_tags(**tags)


def test_a_map():
    found = info(resolve_map("helsinki"))
    assert (found["kind"], found["use"]) == ("map", "area.map")
    box = found["bounds_deg"]
    assert 24.9 < box["west"] < box["east"] < 25.0 < 60.1 < box["south"] < box["north"] < 60.2


def test_a_map_that_is_none(tmp_path):
    (tmp_path / "town.osm.pbf").write_text("cell,site\n")
    assert_refused(mapfilter("info", tmp_path / "town.osm.pbf"), "town.osm.pbf: expected")


def test_a_raster_of_roads_is_no_raster_of_levels(tmp_path):
    values = np.zeros((30, 40), dtype=np.uint8)
    values[3, 5:20], values[9, 2] = 1, 7
    write_raster(tmp_path / "roads.tif", values)
    found = info(tmp_path / "roads.tif")
    assert (found["kind"], found["values"]) == ("classes", [0, 1, 7])
    assert found["bounds_m"] == [100.0, 840.0, 180.0, 900.0]
    assert "roads.raster" in found["use"]
    # Levels without a unit may be losses.
    write_raster(tmp_path / "HD1.tif", np.full((3, 3), -80.0, dtype=np.float32))
    found = info(tmp_path / "HD1.tif")
    assert (found["kind"], found["quantity"], found["crs"]) == ("rasters", "none", "EPSG:32632")
    assert found["use"] == "rasters.path, with rasters.quantity, which the files do not state"


def write_plain_grids(folder, ids=("K1", "K2", "K3"), west="385410"):
    folder.mkdir()
    index = ["TX_NAME;FILE_NAME;RESOLUTION;AREA_XMIN;AREA_XMAX;AREA_YMIN;AREA_YMAX;NBITS"]
    for cell_id in ids:
        (folder / f"{cell_id}.bil").write_bytes(np.full((4, 6), 1600, "<i2").tobytes())
        (folder / f"{cell_id}.hdr").write_text(
            f"NROWS 4\nNCOLS 6\nNBITS 16\nBYTEORDER I\nULXMAP {west}\nULYMAP 6671475\n"
            "XDIM 5\nYDIM 5\nNODATA -9999\n"
        )
        index.append(f"{cell_id};{cell_id}.bil;5;385407.5;385437.5;6671457.5;6671477.5;16")
    return index


@pytest.mark.parametrize("indexed", [True, False])
def test_rasters_that_state_neither_system_nor_quantity_are_described(tmp_path, indexed):
    folder = tmp_path / "planner"
    index = write_plain_grids(folder)
    if indexed:
        (folder / "index.txt").write_text("\n".join(index) + "\n")
    found = info(folder)
    assert (found["kind"], found["cell_ids"]) == ("rasters", ["K1", "K2", "K3"])
    assert (found["crs"], found["quantity"]) == ("none", "none")
    assert (found["rows"], found["cols"], found["resolution_m"]) == (4, 6, 5)
    assert found["bounds_m"] == [385407.5, 6671457.5, 385437.5, 6671477.5]
    assert "with rasters.crs and rasters.quantity" in found["use"]
    assert info(folder / "K1.bil")["cell_ids"] == ["K1"]
    # What one option supplies is described with the other one missing.
    for name in ("K1", "K2", "K3"):
        (folder / f"{name}.prj").write_text(CRS.from_epsg(32635).to_wkt("WKT1_ESRI"))
    found = info(folder)
    assert (found["crs"], found["quantity"]) == ("EPSG:32635", "none")


def test_one_fault_of_all_rasters_is_not_several_sets(tmp_path):
    write_plain_grids(tmp_path / "cut", west="")
    told = mapfilter("info", tmp_path / "cut")
    assert_refused(told, "K1.hdr: expected XLLCORNER")
    assert "rasters of one set" not in told.err
    two = tmp_path / "two"
    two.mkdir()
    for name in ("a", "b"):
        with rasterio.open(
            two / f"{name}.tif", "w", driver="GTiff", height=3, width=3, count=2, dtype="float32",
            crs="EPSG:32632", transform=rasterio.Affine(2, 0, 100, 0, -2, 900),
        ) as target:  # fmt: skip
            target.descriptions = ("A", "B")
    assert_refused(mapfilter("info", two), "rasters of one set")


def test_layers(tmp_path):
    roads = {"class": ["road"], "geometry": [shapely.LineString([(0, 0), (9, 9)])]}
    frame = geopandas.GeoDataFrame(roads, crs="EPSG:32632")
    for name in ("roads.gpkg", "roads.geojson", "roads.json"):
        frame.to_file(tmp_path / name, driver="GPKG" if name.endswith("gpkg") else "GeoJSON")
        (layer,) = info(tmp_path / name)["layers"]
        assert (layer["layer"], layer["features"]) == ("roads", 1)
        assert layer["columns"] == "class"
    # Of another version GDAL warns, and reads it: that is nothing for the terminal.
    content = bytearray((tmp_path / "roads.gpkg").read_bytes())
    content[60:64] = (10_912).to_bytes(4, "big")
    (tmp_path / "newer.gpkg").write_bytes(content)
    assert_done(mapfilter("info", tmp_path / "newer.gpkg"))
    (tmp_path / "cut.gpkg").write_bytes((tmp_path / "roads.gpkg").read_bytes()[:900])
    assert_refused(mapfilter("info", tmp_path / "cut.gpkg"), "cut.gpkg: expected a layer")


@pytest.mark.parametrize(
    ("text", "kind", "use"),
    [
        ("cell,site,lat,lon,height_m\nA,S,60,24,30\n", "cell plan", "cells.plan"),
        ("TX_ID;SITE_NAME;LATITUDE;LONGITUDE\nA;S;60;24\n", "cell plan", "cells.plan"),
        ("latitude,longitude\n39.7,-104.9\n", "table", "mapfilter convert --column"),
        ("x,y,ap1,ap2\n1,2,-60,100\n", "table", "mapfilter locate --db"),
    ],
)
def test_tables(text, kind, use, tmp_path):
    (tmp_path / "some.csv").write_text(text)
    found = info(tmp_path / "some.csv")
    assert (found["kind"], found["rows"]) == (kind, 1)
    assert use in found["use"]


def test_configurations(tmp_path):
    (tmp_path / "area.toml").write_text('[area]\nmap = "helsinki"\n')
    assert info(tmp_path / "area.toml")["use"] == "mapfilter check -c area.toml"
    (tmp_path / "area.toml").write_text('[area]\nmop = "helsinki"\n')
    assert_refused(mapfilter("info", tmp_path / "area.toml"), "area.mop")


def test_recordings_and_what_they_are_for(tmp_path):
    for name, use in (
        ("nmea", "mapfilter replay --log, or mapfilter convert"),
        ("rinex-nav", "beside a recording of pseudoranges"),
        ("opencellid-cells", "cells.plan"),
    ):
        file, text = MADE[name][:2]
        path = tmp_path / file
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        found = info(path)
        assert (found["kind"], found["format"]) == ("recording", name)
        assert use in found["use"]


def test_a_folder_of_recordings(tmp_path):
    folder = tmp_path / "all" / "day"
    folder.mkdir(parents=True)
    for number in range(2):
        (folder / f"{number}.csv").write_text(MADE["opencellid"][1])
    (folder / "README.md").write_text("of my phone\n")
    found = info(folder)
    assert (found["kind"], found["files"]) == ("recordings", 2)
    assert found["formats"] == {"opencellid": 2}
    assert_refused(mapfilter("info", tmp_path / "all"), "name one of day")


def test_tables_without_a_head_are_described_with_what_is_lacking(tmp_path):
    (tmp_path / "obd.csv").write_text("time,wheel_speed_kmh\n1780200000,3\n1780200001,4\n")
    (tmp_path / "truth.csv").write_text(
        "time,lat,lon\n1780200000,49.81,9.31\n1780200001,49.81,9.31\n"
    )
    (tmp_path / "mood.csv").write_text("hour,mood\n1,good\n")
    found = info(tmp_path)
    assert found == {
        "kind": "tables",
        "tables": {
            "mood.csv": "1 row of hour, mood",
            "obd.csv": "odometry: 2 rows",
            "truth.csv": "positions: 2 rows",
        },
        "lacking": [
            "log.json with the CRS, beside truth.csv, for a track log",
            "cells with levels, or positions",
        ],
        "use": "mapfilter replay --db DB --log obd.csv --truth truth.csv",
    }
    (tmp_path / "obd.csv").write_text("time,wheel_speed_kmh\n")
    found = info(tmp_path)
    assert "motion: steps, speeds or an odometer" in found["lacking"]


def test_an_output_folder_names_what_it_holds(world):
    assert_refused(mapfilter("info", world.out), "name one of ", "database, journeys")


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("towers.json", b'{"a": 1}\n', "it begins with '{\"a\": 1}'"),
        ("graph.gz", gzip.compress(b"<graphml>", mtime=0), "a binary file"),
        ("ways.parquet", b"PAR1 and more", "pandas, geopandas and QGIS open it"),
    ],
)
def test_files_of_other_kinds(name, content, told, tmp_path):
    (tmp_path / name).write_bytes(content)
    assert_refused(mapfilter("info", tmp_path / name), told)


def test_a_part_of_a_log_is_told_by_its_folder(tmp_path):
    (tmp_path / "gnss.csv").write_text("time,lat,lon\n0,60,24\n1,60.001,24\n")
    assert info(tmp_path / "gnss.csv")["kind"] == "recording"
    (tmp_path / "log.json").write_text("{}")
    assert_refused(mapfilter("info", tmp_path / "gnss.csv"), "name the folder that it lies in")


def test_a_part_of_a_database_is_told_by_its_folder(world):
    points = world.out / "database" / "points.parquet"
    assert_refused(mapfilter("info", points), "a part of a database; name the folder")


def test_a_raster_in_degrees_without_its_empty_cells(tmp_path):
    values = np.array([[0, 1], [7, 255]], dtype=np.uint8)
    with rasterio.open(
        tmp_path / "use.tif", "w", driver="GTiff", height=2, width=2, count=1, dtype="uint8",
        crs="EPSG:4326", transform=rasterio.Affine(0.5, 0, 24, 0, -0.5, 61), nodata=255,
    ) as target:  # fmt: skip
        target.write(values, 1)
    found = info(tmp_path / "use.tif")
    assert found["bounds_deg"] == [24.0, 60.0, 25.0, 61.0]
    assert (found["resolution_deg"], found["values"]) == (0.5, [0, 1, 7])
    assert "bounds_m" not in found


def test_a_device_is_no_file():
    with pytest.raises(InputError, match="/dev/null: expected a file or folder"):
        run_info(Path("/dev/null"))


def test_a_file_that_cannot_be_opened_is_refused(tmp_path, monkeypatch):
    (tmp_path / "a.json").write_text("{}")

    def refuse(*_args, **_kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("mapfilter._inputs.os.open", refuse)
    with pytest.raises(InputError, match="a readable file, found Permission denied"):
        run_info(tmp_path / "a.json")


def estimate_in(folder, figures=None):
    """An estimate of two epochs in a folder, with figures beside it."""
    fixes = [
        Fix(float(time_s), 385_000.0, 6_672_000.0, np.eye(2), np.arange(3.0), status, 1, np.nan, 0,
            np.nan, Reason.USED)
        for time_s, status in enumerate((Status.SEARCHING, Status.CONVERGED))
    ]  # fmt: skip
    folder.mkdir(parents=True)
    estimate = TrackEstimate.of_fixes("EPSG:32635", "bayes", fixes)
    write_estimate(estimate, folder / "estimate.parquet")
    write_gpx(estimate, folder / "estimate.gpx")
    if figures is not None:
        (folder / "figures.json").write_text(json.dumps(figures))
    return folder


FIGURES = {
    "log": "walk", "filter": "bayes", "epochs": 2, "epochs_by_status": {"SEARCHING": 1},
    "switched": True, "switch_time_s": 1.0, "error_mean_m": 7.5, "unused": {}, "notes": [],
}  # fmt: skip


def test_a_replay_is_a_result_no_recording(tmp_path):
    folder = estimate_in(tmp_path / "located", FIGURES)
    shown = {name: FIGURES[name] for name in FIGURES if name not in ("unused", "notes")}
    for path, kind in (
        (folder, "replay"),
        (folder / "figures.json", "replay"),
        (folder / "estimate.parquet", "estimate"),
        (folder / "estimate.gpx", "estimate"),
    ):
        found = info(path)
        assert found.pop("use").startswith(
            "what a filter estimated, not to be taken for a ground truth; "
        )
        assert found == {"kind": kind, **shown}
    (folder / "replay.html").touch()
    assert info(folder)["use"].endswith(f"mapfilter view {folder}")
    (folder / "figures.json").write_text("{")
    assert_refused(mapfilter("info", folder), "figures.json: expected")


@pytest.mark.parametrize("success", [True, False, None])
def test_a_switch_that_is_not_judged_is_told(tmp_path, success):
    folder = estimate_in(tmp_path / "located", {**FIGURES, "success": success})
    for path in (folder, folder / "estimate.parquet"):
        assert info(path)["success"] is success
    assert "success" not in info(estimate_in(tmp_path / "without a truth", FIGURES))


def test_figures_with_a_filter_alone_are_those_of_another_program(tmp_path):
    name, text = MADE["gpx"]
    (tmp_path / name).write_text(text)
    (tmp_path / "figures.json").write_text('{"filter": 1}')
    assert info(tmp_path)["kind"] == "recordings"


def test_an_estimate_by_itself(tmp_path):
    folder = estimate_in(tmp_path / "located")
    found = info(folder / "estimate.parquet")
    assert (found["kind"], found["filter"], found["switched"]) == ("estimate", "bayes", True)
    assert found["epochs_by_status"] == {"SEARCHING": 1, "CONVERGED": 1}


def test_several_replays_and_located_reports(tmp_path):
    for name in ("a", "b"):
        estimate_in(tmp_path / "several" / name, FIGURES)
    figures = {"logs": 2, "switched": 1, "final_statuses": {"LOST": 1, "TRACKING": 1}}
    (tmp_path / "several" / "summary.json").write_text(json.dumps(figures))
    found = info(tmp_path / "several")
    assert found.pop("use").startswith("what a filter estimated")
    assert found == {"kind": "replays", **figures}
    assert info(tmp_path / "several" / "summary.json")["kind"] == "replays"
    (tmp_path / "reports").mkdir()
    (tmp_path / "reports" / "positions.csv").write_text("time_s,lat,lon\n0,60,24\n")
    (tmp_path / "reports" / "figures.json").write_text('{"database_reports": 9, "reports": 3}')
    found = info(tmp_path / "reports")
    assert (found["kind"], found["reports"]) == ("located reports", 3)
    assert info(tmp_path / "reports" / "figures.json") == found


def test_figures_of_another_program_are_no_results(tmp_path):
    name, text = MADE["gpx"]
    (tmp_path / name).write_text(text)
    (tmp_path / "summary.json").write_text("[1, 2]")
    (tmp_path / "figures.json").write_text("no JSON")
    assert info(tmp_path)["kind"] == "recordings"


def test_points_with_times_and_texts_of_cells_are_recordings(tmp_path):
    """The former were streets only, the latter a table whose columns are its first line."""
    at = {"type": "Point", "coordinates": [24.94, 60.17]}
    point = {"type": "Feature", "properties": {"time": "2026-05-13T08:00:00Z"}, "geometry": at}
    path = tmp_path / "drive.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [point]}))
    found = info(path)
    assert (found["kind"], found["use"].rpartition("; ")[2]) == (
        "layers",
        "points with times: mapfilter replay --log, or mapfilter convert",
    )
    log = tmp_path / "log.txt"
    log.write_text(
        "05-13 11:00:00.123 1 1 D Own: [CellInfoLte:{CellIdentityLte:{ mCi=7, mPci=1}}]\n"
    )
    assert_refused(mapfilter("info", log), "a logcat without years")


def test_a_zip_of_a_track_log_is_named_as_that(world, tmp_path):
    """Offsets were asked for its tables, and its tables were no recordings."""
    log = next(world.journeys.iterdir())
    path = Path(shutil.make_archive(str(tmp_path / "walk"), "zip", log))
    unpack = "a ZIP of a track log; unpack it, and name its folder"
    assert_refused(mapfilter("info", path), unpack)
    assert_refused(mapfilter("convert", path, "--out", tmp_path / "out"), unpack)
    offset = mapfilter("convert", path, "--offset", "walk.zip=3", "--out", tmp_path / "out")
    assert_refused(offset, "a track log has the times of its tables")
    assert "parquet" not in offset.err


@pytest.mark.parametrize(
    ("kind", "unused"),
    [
        ("database", {"numba", "scipy", "pandas", "rasterio", "pyogrio", "mapfilter.config"}),
        ("log", {"numba", "scipy", "rasterio", "pyogrio", "mapfilter.config"}),
    ],
)
def test_what_other_kinds_need_is_not_imported(world, kind, unused):
    """It takes as long as all else; asked of a process of its own."""
    path = world.database if kind == "database" else next(world.journeys.iterdir())
    code = (
        "import sys; from pathlib import Path; from mapfilter.workflows.info import run_info\n"
        f"print(run_info(Path({str(path)!r}))['kind'], *{unused!r} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout.split()) == (0, [kind]), done.stderr
